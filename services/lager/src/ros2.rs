//! `lager gateway --ros2`: becomes the program `lager-ros2` with the configuration of the robot. It is
//! a program of its own, so that a robot's build has no DDS in it.

use std::ffi::OsString;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Error, Result, anyhow, bail};

use crate::cli::{GatewayArgs, GlobalArgs};
use crate::config::{Config, program_near};

/// The program, and where the source tree has it.
const PROGRAM: &str = "lager-ros2";
const BUILT: &str = "services/ros2/target/release";

/// Replaces this process by that program. Returns only if that fails, with the error.
///
/// # Errors
/// There is no such program.
pub fn become_it(config: &Config, args: &GatewayArgs, global: &GlobalArgs) -> Result<Error> {
    let Some(program) = program_near(PROGRAM, BUILT) else {
        bail!(
            "`lager gateway --ros2` is the program {PROGRAM}, which is neither beside this one nor in \
             {BUILT}; in the source tree, `services/ros2/build` builds it"
        );
    };
    // A robot that is up may have another clock than this command's configuration.
    let running = config.of_running_robot()?.unwrap_or_else(|| config.clone());
    let (least, most) = running.robot().sensors.ranger.range_cm();
    let pack = running.pack();
    let mut command = Command::new(&program);
    command.args(["--name", &config.name]);
    for (flag, number) in [
        ("--speed", running.speed.to_string()),
        ("--ranger-least-cm", least.to_string()),
        ("--ranger-most-cm", most.to_string()),
        (
            "--ranger-ahead-mm",
            running.logic.ranger_ahead_mm.to_string(),
        ),
        ("--line-ahead-mm", running.logic.sensor_ahead_mm.to_string()),
        ("--cells", pack.cells.to_string()),
    ] {
        command.args([flag, &number]);
    }
    if let Some(folder) = &config.bus.folder {
        command.arg("--bus").arg(folder);
    }
    if let Some(clock) = &running.chip.clock {
        command.arg("--clock").arg(clock);
    }
    if let Some(domain) = args.domain {
        command.args(["--domain", &domain.to_string()]);
    }
    if let Some(range) = &args.range {
        command.args(["--range", range]);
    }
    if args.operator {
        // The last flag: the rest is the command.
        command.arg("--operator").args(own_command(config, global)?);
    }
    let error = command.exec();
    Ok(anyhow!("cannot start {}: {error}", program.display()))
}

/// This program with the flags by which it finds the same robot.
fn own_command(config: &Config, global: &GlobalArgs) -> Result<Vec<OsString>> {
    let own = std::env::current_exe().context("cannot find this program's own file")?;
    let mut command = vec![
        own.into_os_string(),
        "--name".into(),
        config.name.clone().into(),
    ];
    let files = [
        (
            "--config",
            global
                .config
                .as_deref()
                .filter(|file| *file != Path::new("-")),
        ),
        ("--bus", config.bus.folder.as_deref()),
        ("--state", config.state.as_deref()),
    ];
    for (flag, file) in files {
        if let Some(file) = file {
            command.extend([flag.into(), std::path::absolute(file)?.into_os_string()]);
        }
    }
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operators_command_finds_the_same_robot_from_any_folder() {
        let mut config = Config {
            name: "r7".to_owned(),
            ..Config::default()
        };
        config.bus.folder = Some("bus".into());
        let global = GlobalArgs {
            config: Some("-".into()),
            name: None,
            bus: None,
            state: None,
            log: None,
            log_json: false,
        };
        let command = own_command(&config, &global).expect("a command");
        let folder = std::path::absolute("bus").expect("a path");
        let told: Vec<_> = command[1..].iter().map(|word| word.as_os_str()).collect();
        // Nobody gives the configuration on standard input a second time.
        assert_eq!(
            told,
            [
                "--name".as_ref(),
                "r7".as_ref(),
                "--bus".as_ref(),
                folder.as_os_str()
            ]
        );
    }
}
