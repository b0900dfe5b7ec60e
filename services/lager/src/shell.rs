//! What a shell's user looks for beside the program: completions and manual pages, both made of the
//! command line itself.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::CommandFactory as _;

use crate::cli::{Cli, help};
use crate::exit;

/// `lager completions`: on standard output.
pub fn completions(shell: clap_complete::Shell) -> ExitCode {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut help::command(), "lager", &mut script);
    match std::io::stdout().write_all(&script) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => exit::FAILED,
    }
}

/// `lager manual`: a page for the program, and one for each subcommand.
///
/// # Errors
/// The folder cannot be made or written to.
pub fn manual(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), folder))
        .with_context(|| format!("cannot write the manual pages into {}", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_and_each_subcommand_that_people_see_has_a_page() {
        let folder = std::env::temp_dir().join(format!("lager-manual-{}", std::process::id()));
        manual(&folder).expect("pages");
        let page = |name: &str| fs::read_to_string(folder.join(format!("{name}.1")));
        let whole = page("lager").expect("a page");
        assert!(whole.contains("lager\\-up(1)"), "{whole}");
        for subcommand in Cli::command().get_subcommands() {
            let name = format!("lager-{}", subcommand.get_name());
            let said = page(&name).ok();
            assert_eq!(said.is_some(), !subcommand.is_hide_set(), "{name}");
        }
        let up = page("lager-up").expect("a page");
        assert!(up.contains("Serial port of the sensor board"), "{up}");
        fs::remove_dir_all(&folder).expect("its own folder");
    }
}
