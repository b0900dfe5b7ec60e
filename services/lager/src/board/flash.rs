//! `lager board flash`: a board's fuses and bootloader by a programmer, with avrdude.
//!
//! ```text
//!   signature, high fuse, lock bits --> low, high, extended fuse --> erase, bootloader, lock bits
//!          read; another chip: end
//! ```
//!
//! The high fuse comes before the erasure, since it keeps the EEPROM and so the board's settings. A
//! chip whose lock bits are set takes no fuse before it is erased, and then it may lose them.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, anyhow, bail};
use lager_loader::{Image, ImageError, fuses, stk};
use lager_supervisor::console;
use lager_wire::Callsign;

use crate::cli::FlashArgs;
use crate::config::Config;

const AVRDUDE: &str = "avrdude";

/// One call of avrdude.
struct Step {
    writes: &'static str,
    arguments: Vec<String>,
}

/// What a chip says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Chip {
    signature: [u8; 3],
    high_fuse: u8,
    lock: u8,
}

/// Sets up a board's chip, or shows how.
pub fn run(config: &Config, args: &FlashArgs) -> Result<()> {
    let board = args.board.callsign();
    let loader = loader(config, args, board)?;
    let reading = reading(args);
    if args.dry_run {
        console::print(&format!(
            "# Reads the signature, which must be 0x1e,0x97,0x5; writes nothing\n{}",
            shown(&reading)
        ))?;
        for Step { writes, arguments } in steps(args, &loader, false) {
            console::print(&format!("# Writes the {writes}\n{}", shown(&arguments)))?;
        }
        return Ok(());
    }
    let chip = read(&reading)?;
    if chip.signature != stk::SIGNATURE {
        bail!("{}; nothing was written", refusal(chip.signature));
    }
    let is_locked = chip.lock & fuses::LOCKED_OUT != fuses::LOCKED_OUT;
    if is_locked && chip.high_fuse & fuses::EEPROM_ERASED != 0 {
        console::print(
            "the chip is locked, so it has to be erased before its fuses: the settings in its \
             EEPROM get lost this time",
        )?;
    }
    let mut written = Vec::new();
    for Step { writes, arguments } in steps(args, &loader, is_locked) {
        console::print(&shown(&arguments))?;
        let status = Command::new(AVRDUDE).args(&arguments).status();
        let status = status.map_err(not_run)?;
        if !status.success() {
            let so_far = match written.as_slice() {
                [] => "nothing was written before that".to_owned(),
                written => format!("the {} were written before that", written.join(", ")),
            };
            bail!(
                "avrdude could not write the {writes} ({status}), and says why above; {so_far}; \
                 the same command again begins anew"
            );
        }
        written.push(writes);
    }
    console::print(&format!(
        "the {board} board has its fuses and its bootloader; `lager board update --port PORT` gives \
         it its program, and until then it waits for one"
    ))
}

/// The bootloader's file, which looks like one.
fn loader(config: &Config, args: &FlashArgs, board: Callsign) -> Result<PathBuf> {
    let path = match &args.loader {
        Some(path) => path.clone(),
        None => {
            let found = config
                .chip
                .hex(&format!("{board}-loader.hex"), config.serial.baud);
            found.map_err(|why| anyhow!(why))?
        }
    };
    let file = || path.display().to_string();
    let text = fs::read(&path).with_context(file)?;
    match Image::from_hex(&String::from_utf8_lossy(&text)) {
        // It lies above what an application may have.
        Err(ImageError::TooLarge { .. }) => Ok(path),
        Ok(image) => bail!(
            "{} is the image of the {} board and not a bootloader; `lager board update` writes \
             images, when the board has its bootloader",
            path.display(),
            image.role()
        ),
        Err(ImageError::NoHeader | ImageError::NotWhole) => bail!(
            "{} is no bootloader of a board: it has nothing in the boot section",
            path.display()
        ),
        Err(error) => Err(error).with_context(file),
    }
}

/// The arguments of every call.
fn common(args: &FlashArgs) -> Vec<String> {
    let mut common = ["-c", args.programmer.as_str(), "-p", "m1284p"]
        .map(String::from)
        .to_vec();
    if let Some(port) = &args.port {
        common.extend(["-P".into(), port.clone()]);
    }
    if let Some(us) = args.bit_clock {
        common.extend(["-B".into(), us.to_string()]);
    }
    common
}

/// Reads what decides the rest. `-F` reads the signature of any chip, `-n` writes nothing.
fn reading(args: &FlashArgs) -> Vec<String> {
    let mut arguments = common(args);
    arguments.extend(["-q", "-F", "-n"].map(String::from));
    for memory in ["signature", "hfuse", "lock"] {
        arguments.extend(["-U".into(), format!("{memory}:r:-:h")]);
    }
    arguments
}

/// The calls that write, in their order. Without `-F` avrdude checks the signature again.
fn steps(args: &FlashArgs, loader: &Path, is_locked: bool) -> Vec<Step> {
    let step = |writes, erases: bool, wanted: &[String]| {
        let mut arguments = common(args);
        arguments.extend(erases.then(|| "-e".into()));
        for memory in wanted {
            arguments.extend(["-U".into(), memory.clone()]);
        }
        Step { writes, arguments }
    };
    let byte = |memory: &str, value: u8| format!("{memory}:w:{value:#04X}:m");
    vec![
        step(
            "low fuse",
            is_locked,
            &[byte("lfuse", args.clock.low_fuse())],
        ),
        step("high fuse", false, &[byte("hfuse", fuses::HIGH)]),
        step("extended fuse", false, &[byte("efuse", fuses::EXTENDED)]),
        step(
            "bootloader and lock bits",
            true,
            &[
                format!("flash:w:{}:i", loader.display()),
                byte("lock", fuses::LOCK),
            ],
        ),
    ]
}

/// Asks the chip what it is.
fn read(arguments: &[String]) -> Result<Chip> {
    let output = Command::new(AVRDUDE).args(arguments).output();
    let output = output.map_err(not_run)?;
    let told = String::from_utf8_lossy(&output.stdout);
    match parsed(&told) {
        Some(chip) if output.status.success() => Ok(chip),
        _ => {
            console::complain(String::from_utf8_lossy(&output.stderr).trim_end());
            bail!(
                "avrdude could not read the chip ({}), and says why above; is the board switched on, \
                 is the programmer's plug the right way round, and does a new chip, which runs at 1 \
                 MHz, need --bit-clock 10? `avrdude -c ?` lists the programmers; nothing was written",
                output.status
            );
        }
    }
}

/// Reads the five numbers that avrdude prints.
fn parsed(told: &str) -> Option<Chip> {
    let words = told.split(|mark: char| mark == ',' || mark.is_whitespace());
    let numbers: Vec<u8> = words
        .filter_map(|word| u8::from_str_radix(word.strip_prefix("0x")?, 16).ok())
        .collect();
    let [one, two, three, high_fuse, lock] = *numbers.as_slice() else {
        return None;
    };
    Some(Chip {
        signature: [one, two, three],
        high_fuse,
        lock,
    })
}

fn refusal(signature: [u8; 3]) -> String {
    let [one, two, three] = signature;
    match signature {
        [0, 0, 0] | [0xFF, 0xFF, 0xFF] => format!(
            "the programmer reads the signature {one:02x} {two:02x} {three:02x}, so no chip answers \
             it; is the board switched on, and is the programmer's plug the right way round?"
        ),
        _ => format!(
            "this is no ATmega1284P: its signature is {one:02x} {two:02x} {three:02x}, and that of \
             a board is 1e 97 05; connect the programmer to a board of the robot"
        ),
    }
}

fn not_run(error: std::io::Error) -> anyhow::Error {
    match error.kind() {
        ErrorKind::NotFound => anyhow!(
            "avrdude is not installed; `sudo apt install avrdude` installs it; nothing was written"
        ),
        _ => anyhow::Error::from(error).context("avrdude cannot be started"),
    }
}

/// A command as a person types it into a shell.
fn shown(arguments: &[String]) -> String {
    let is_plain = |mark: char| mark.is_ascii_alphanumeric() || "-_./:=,+".contains(mark);
    let words = arguments
        .iter()
        .map(|word| match word.chars().all(is_plain) {
            true => word.clone(),
            false => format!("'{}'", word.replace('\'', r"'\''")),
        });
    let words: Vec<String> = core::iter::once(AVRDUDE.into()).chain(words).collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_avrdude_prints_is_read_and_anything_else_is_not() {
        let chip = parsed("0x1e,0x97,0x5\n0x9a\n0xff\n").expect("five numbers");
        assert_eq!(chip.signature, stk::SIGNATURE);
        assert_eq!((chip.high_fuse, chip.lock), (0x9A, 0xFF));
        for other in [
            "",
            "0x1e,0x97,0x5\n",
            "0x1e,0x97,0x5\n0x9a\n0xff\n0x00\n",
            "0x1e97",
        ] {
            assert_eq!(parsed(other), None, "{other}");
        }
    }

    #[test]
    fn a_shown_command_can_be_pasted_into_a_shell() {
        let words = ["-c", "usbasp", "-U", "flash:w:/a b/it's.hex:i", "?"].map(String::from);
        let expected = r"avrdude -c usbasp -U 'flash:w:/a b/it'\''s.hex:i' '?'";
        assert_eq!(shown(&words), expected);
    }
}
