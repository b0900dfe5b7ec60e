//! Makes `firmware/wiring.svg` and the tables of `firmware/WIRING.md` from the tables of pins.

use std::path::Path;

fn main() -> Result<(), String> {
    let firmware = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    for (path, text) in lager_pins::page::files(firmware)? {
        std::fs::write(&path, text)
            .map_err(|error| format!("{} cannot be written: {error}", path.display()))?;
    }
    Ok(())
}
