//! Tests that `firmware/avr/build`, on a machine that lacks a tool, says so and installs nothing.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};

/// Programs that every machine has, and that the script uses before it looks for its tools.
const ORDINARY: [&str; 4] = ["bash", "dirname", "awk", "env"];

/// A folder with links to these ordinary programs and nothing else.
struct Bare(PathBuf);

impl Bare {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("lager-recipe-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        let path = std::env::var_os("PATH").unwrap();
        for name in ORDINARY {
            let found = std::env::split_paths(&path).map(|place| place.join(name));
            let program = found.into_iter().find(|program| program.exists());
            symlink(program.unwrap(), folder.join(name)).unwrap();
        }
        Self(folder)
    }

    fn build(&self, arguments: &[&str]) -> Output {
        Command::new(lager_tests::in_tree("firmware/avr/build"))
            .args(arguments)
            .env("PATH", &self.0)
            .output()
            .unwrap()
    }
}

impl Drop for Bare {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn what_is_missing_is_named_and_not_installed() {
    let bare = Bare::new();
    let refused = bare.build(&[]);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    for (program, package) in [
        ("avr-gcc", "gcc-avr"),
        ("avr-size", "binutils-avr"),
        ("avr-objcopy", "binutils-avr"),
        ("start files", "avr-libc"),
    ] {
        let line = said.lines().find(|line| line.contains(program));
        assert!(line.is_some_and(|line| line.contains(package)), "{said}");
    }
    assert!(refused.stdout.is_empty(), "nothing was built");

    let listed = bare.build(&["--missing"]);
    assert_eq!(listed.status.code(), Some(0));
    let packages = String::from_utf8(listed.stdout).unwrap();
    for package in ["gcc-avr", "binutils-avr", "avr-libc"] {
        assert!(
            packages.split_whitespace().any(|one| one == package),
            "{packages}"
        );
    }
}

#[test]
fn a_baud_rate_without_images_is_refused() {
    let refused = Bare::new().build(&["--baud", "115200"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        String::from_utf8(refused.stderr)
            .unwrap()
            .contains("500000 or 9600")
    );
}
