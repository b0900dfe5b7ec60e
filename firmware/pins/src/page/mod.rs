//! The wiring page's parts that are made from the tables: a drawing, and the tables in words.
//!
//! `cargo run -p lager-pins --example wiring` writes them, and `tests/page.rs` compares them.

mod drawing;
mod tables;

pub use drawing::drawing;

use std::path::{Path, PathBuf};

/// What makes the page again.
pub const COMMAND: &str = "cargo run -p lager-pins --example wiring";

/// The page and its drawing: the file of each, and what has to stand in it.
///
/// # Errors
/// The page cannot be read, or lacks a place for a table; the sentence says which.
pub fn files(firmware: &Path) -> Result<[(PathBuf, String); 2], String> {
    let page = firmware.join("WIRING.md");
    let text = std::fs::read_to_string(&page)
        .map_err(|error| format!("{} cannot be read: {error}", page.display()))?;
    let text = tables::filled(&text)?;
    Ok([(page, text), (firmware.join("wiring.svg"), drawing())])
}
