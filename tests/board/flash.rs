//! `lager board flash` with a program that stands in for avrdude.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::Output;

use lager_tests::{Domain, in_tree};

use crate::{IMAGES, assert_says, image, told};

/// A program that stands in for avrdude. It notes its arguments, and says that the chip is `chip`.
struct Programmer {
    folder: PathBuf,
}

impl Programmer {
    /// `fails` is a word in the arguments of the call that fails.
    fn new(domain: &Domain, chip: &str, fails: &str) -> Self {
        let folder = domain.folder().join("bin");
        fs::create_dir_all(&folder).expect("a folder");
        let script = format!(
            "#!/bin/sh\necho \"$*\" >>{}/calls\ncase \"$*\" in\n  *signature:r*) printf '{chip}' ;;\n  \
             *{fails}*) echo 'avrdude: verification error' >&2; exit 1 ;;\nesac\n",
            folder.display()
        );
        let program = folder.join("avrdude");
        fs::write(&program, script).expect("a file");
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("its own file");
        let _ = fs::remove_file(folder.join("calls"));
        Self { folder }
    }

    fn flash(&self, domain: &Domain, more: &[&str]) -> Output {
        let mut command = domain.lager(&["board", "flash", "sensor", "--programmer", "usbasp"]);
        let path = std::env::var_os("PATH").unwrap_or_default();
        let path = [self.folder.clone()]
            .into_iter()
            .chain(std::env::split_paths(&path));
        let path = std::env::join_paths(path).expect("a path");
        command
            .args(more)
            .env("PATH", path)
            .current_dir(in_tree(""));
        command.output().expect("lager starts")
    }

    fn calls(&self) -> Vec<String> {
        let calls = fs::read_to_string(self.folder.join("calls")).unwrap_or_default();
        calls.lines().map(str::to_owned).collect()
    }
}

/// The chip of a board: its signature, high fuse and lock bits, as avrdude prints them.
const NEW: &str = "0x1e,0x97,0x5\\n0x99\\n0xff\\n";
const NEVER: &str = "no-such-word";

#[test]
fn a_new_board_gets_fuses_and_bootloader_and_another_chip_is_left_alone() {
    let domain = Domain::among_others();
    let programmer = Programmer::new(&domain, NEW, NEVER);
    let shown = told(&programmer.flash(&domain, &["--dry-run"]), 0);
    assert!(programmer.calls().is_empty(), "it only shows them");
    told(&programmer.flash(&domain, &[]), 0);
    let calls = programmer.calls();
    let [reading, low, high, extended, loader] = calls.as_slice() else {
        panic!("{calls:?}");
    };
    assert!(
        reading.ends_with("-F -n -U signature:r:-:h -U hfuse:r:-:h -U lock:r:-:h"),
        "{reading}"
    );
    assert_eq!(low, "-c usbasp -p m1284p -U lfuse:w:0xF7:m");
    let shown_too = told(
        &programmer.flash(&domain, &["--dry-run", "--clock", "external"]),
        0,
    );
    assert_eq!(
        shown_too,
        shown.replace("lfuse:w:0xF7:m", "lfuse:w:0xE0:m"),
        "an oscillator at XTAL1"
    );
    assert_eq!(
        high, "-c usbasp -p m1284p -U hfuse:w:0x92:m",
        "it keeps the EEPROM from now on"
    );
    assert_eq!(extended, "-c usbasp -p m1284p -U efuse:w:0xFC:m");
    let file = in_tree(IMAGES).join("sensor-loader.hex");
    let expected = format!(
        "-c usbasp -p m1284p -e -U flash:w:{}:i -U lock:w:0xEF:m",
        file.display()
    );
    assert_eq!(*loader, expected);
    for call in &calls {
        assert!(
            shown.contains(&format!("avrdude {call}\n")),
            "{call} is not in {shown}"
        );
    }

    for (signature, words) in [
        ("0x1e,0x95,0xf", "no ATmega1284P: its signature is 1e 95 0f"),
        ("0xff,0xff,0xff", "no chip answers"),
    ] {
        let programmer = Programmer::new(&domain, &NEW.replace("0x1e,0x97,0x5", signature), NEVER);
        let said = told(&programmer.flash(&domain, &[]), 1);
        assert_says(&said, &[words, "nothing was written"]);
        assert_eq!(programmer.calls().len(), 1, "{said}");
    }
    domain.assert_clean();
}

#[test]
fn what_goes_wrong_with_a_programmer_is_told_with_what_to_do() {
    let domain = Domain::among_others();
    let programmer = Programmer::new(&domain, NEW, "efuse");
    let said = told(
        &programmer.flash(&domain, &["--bit-clock", "10", "--port", "usb"]),
        1,
    );
    let before = "the low fuse, high fuse were written before that";
    assert_says(
        &said,
        &["could not write the extended fuse", before, "begins anew"],
    );
    assert!(programmer.calls()[1].starts_with("-c usbasp -p m1284p -P usb -B 10 -U lfuse"));

    // A chip that is locked is erased first, and its settings may get lost; not if a fuse keeps them.
    for (fuse, is_lost) in [("0x99", true), ("0x92", false)] {
        let chip = format!("0x1e,0x97,0x5\\n{fuse}\\n0xcc\\n");
        let programmer = Programmer::new(&domain, &chip, NEVER);
        let said = told(&programmer.flash(&domain, &[]), 0);
        assert_eq!(said.contains("get lost"), is_lost, "{said}");
        assert!(programmer.calls()[1].ends_with("-e -U lfuse:w:0xF7:m"));
    }
    let programmer = Programmer::new(&domain, "", NEVER);
    let said = told(&programmer.flash(&domain, &[]), 1);
    assert_says(&said, &["could not read the chip", "--bit-clock 10"]);

    let image = image("sensor");
    let said = told(&programmer.flash(&domain, &["--loader", &image]), 1);
    assert_says(&said, &["image of the sensor board and not a bootloader"]);
    let mut command = domain.lager(&["board", "flash", "sensor", "--programmer", "usbasp"]);
    command
        .env("PATH", domain.folder())
        .current_dir(in_tree(""));
    let said = told(&command.output().expect("lager starts"), 1);
    assert_says(&said, &["avrdude is not installed", "apt install avrdude"]);
    domain.assert_clean();
}
