//! `lager bench`: becomes the program `lager-bench` beside this one. It is a program of its own, so
//! that a robot's build does not contain the benches.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::os::unix::process::CommandExt as _;
use std::process::Command;

use anyhow::{Error, anyhow};

/// Replaces this process by that program. Returns only if that fails, with the error.
pub fn become_it(arguments: &[OsString]) -> Error {
    let program = match std::env::current_exe() {
        Ok(own) => own.with_file_name("lager-bench"),
        Err(error) => return anyhow!("cannot find this program's own file: {error}"),
    };
    let error = Command::new(&program).args(arguments).exec();
    let program = program.display();
    match error.kind() {
        ErrorKind::NotFound => anyhow!(
            "`lager bench` is a program of its own, and there is no {program}; in the source tree, \
             `cargo build --release -p lager-benches --bin lager-bench` builds it"
        ),
        _ => anyhow!("cannot start {program}: {error}"),
    }
}
