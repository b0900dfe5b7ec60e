//! `lager bench`: becomes the program `lager-bench` beside this one. It is a program of its own, so
//! that a robot's build does not contain the benches.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::os::unix::process::CommandExt as _;
use std::process::Command;

use anyhow::{Error, anyhow};
use lager_ports::BusConfig;

/// Replaces this process by that program. Returns only if that fails, with the error.
pub fn become_it(arguments: &[OsString], bus: &BusConfig) -> Error {
    let arguments = with_bus(arguments, bus);
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

/// The arguments, with the bus and the robot of this configuration for what measures a running bus.
/// What the user writes there himself stands behind them, and counts.
fn with_bus(arguments: &[OsString], bus: &BusConfig) -> Vec<OsString> {
    let mut all = arguments.to_vec();
    if all.first().is_some_and(|first| first == "topic") {
        let mut more: Vec<OsString> = vec!["--name".into(), bus.unit.as_str().into()];
        if let Some(folder) = &bus.folder {
            more.extend(["--bus".into(), folder.into()]);
        }
        all.splice(1..1, more);
    }
    all
}

#[cfg(test)]
mod tests {
    use lager_topics::LAGER;

    use super::*;

    #[test]
    fn only_what_measures_a_running_bus_is_told_which() {
        let bus = BusConfig {
            folder: Some("/a/bus".into()),
            ..BusConfig::of(&LAGER)
        };
        let told = |words: &[&str]| {
            let words: Vec<OsString> = words.iter().map(OsString::from).collect();
            with_bus(&words, &bus)
        };
        assert_eq!(told(&["hop", "--quick"]), ["hop", "--quick"]);
        let expected = [
            "topic",
            "--name",
            bus.unit.as_str(),
            "--bus",
            "/a/bus",
            "sensor/line",
        ];
        assert_eq!(told(&["topic", "sensor/line"]), expected);
    }
}
