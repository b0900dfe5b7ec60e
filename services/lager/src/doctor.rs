//! `lager doctor`: what is wrong with this machine, and how to mend it.
//!
//! Each check looks at one thing and returns a finding; nothing is changed but what `--fix` is
//! for: what dead processes left on the bus.

mod realtime;

use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use lager_ports::NodeState;
use rustix::process::{Resource, getrlimit};

use crate::config::{Body, Config};
use crate::exit;

/// Shared memory that a robot needs: 1 MiB when it runs alone, more with every observer.
const SHARED_MEMORY_MIB: u64 = 16;
/// Open files that one process of the bus may need: each port and connection holds some.
const OPEN_FILES: u64 = 4096;

/// How a thing stands.
enum Finding {
    Good(String),
    /// It works, but not as well as it could.
    Hint(String),
    /// The robot will not run like this.
    Bad(String),
}

use Finding::{Bad, Good, Hint};

/// Checks everything; fails when anything is bad.
pub fn run(config: &Config, fix: bool) -> Result<ExitCode> {
    let findings = [
        ("versions", versions()),
        ("shared memory", shared_memory()),
        ("open files", open_files()),
        ("session clean-up", remove_ipc()),
        ("serial rights", serial(config)),
        ("emulated boards", emulated(config)),
        ("bus", bus(config, fix)),
    ];
    let findings = findings.into_iter().chain(realtime::findings(config));
    let mut bad = 0;
    for (what, finding) in findings {
        let (mark, text) = match finding {
            Good(text) => ("ok  ", text),
            Hint(text) => ("hint", text),
            Bad(text) => {
                bad += 1;
                ("BAD ", text)
            }
        };
        crate::say(&format!("{mark}  {what:16}  {text}"))?;
    }
    Ok(if bad == 0 {
        ExitCode::SUCCESS
    } else {
        exit::FAILED
    })
}

fn versions() -> Finding {
    let kernel = rustix::system::uname();
    Good(format!(
        "lager {}, {}, Linux {}",
        env!("CARGO_PKG_VERSION"),
        lager_ports::BUS_VERSION,
        kernel.release().to_string_lossy()
    ))
}

fn shared_memory() -> Finding {
    let stat = match rustix::fs::statvfs("/dev/shm") {
        Ok(stat) => stat,
        Err(error) => {
            return Bad(format!(
                "/dev/shm cannot be used ({error}); mount a tmpfs there"
            ));
        }
    };
    let free = stat.f_bavail * stat.f_frsize / (1024 * 1024);
    if free < SHARED_MEMORY_MIB {
        return Bad(format!(
            "/dev/shm has {free} MiB free and a robot needs {SHARED_MEMORY_MIB}; enlarge it (mount -o remount,size=256M /dev/shm; in a container --shm-size=256m)"
        ));
    }
    if tempfile_in("/dev/shm").is_err() {
        return Bad("this user may not write to /dev/shm; it needs mode 1777".into());
    }
    Good(format!("/dev/shm has {free} MiB free"))
}

/// Makes and removes a file of this process's own.
fn tempfile_in(folder: &str) -> std::io::Result<()> {
    let path = Path::new(folder).join(format!("lager-doctor-{}", std::process::id()));
    fs::write(&path, b"")?;
    fs::remove_file(&path)
}

fn open_files() -> Finding {
    let limit = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX);
    if limit < OPEN_FILES {
        return Hint(format!(
            "a process may open {limit} files; with many observers {OPEN_FILES} are wanted (ulimit -n {OPEN_FILES}, or LimitNOFILE= in the unit)"
        ));
    }
    Good(format!("a process may open {limit}"))
}

/// systemd removes a user's shared memory at logout unless told otherwise.
fn remove_ipc() -> Finding {
    let off = ["/etc/systemd/logind.conf", "/usr/lib/systemd/logind.conf"]
        .iter()
        .filter_map(|path| fs::read_to_string(path).ok())
        .any(|text| text.lines().any(|line| line.trim() == "RemoveIPC=no"));
    let systemd = Path::new("/run/systemd/system").is_dir();
    if systemd && !off && !rustix::process::geteuid().is_root() {
        return Hint(
            "systemd removes this user's shared memory at logout; set RemoveIPC=no in /etc/systemd/logind.conf or run the robot as a system user"
                .into(),
        );
    }
    Good("nothing removes shared memory at logout".into())
}

fn serial(config: &Config) -> Finding {
    if config.body != Body::Serial {
        return Good("not needed by a simulated or emulated robot".into());
    }
    for port in [&config.serial.sensor, &config.serial.steering] {
        let name = port.display();
        let Ok(metadata) = fs::metadata(port) else {
            return Bad(format!(
                "{name} does not exist; plug the board in, or name the port in the configuration's [serial]"
            ));
        };
        if !metadata.file_type().is_char_device() {
            return Bad(format!("{name} is no serial port"));
        }
        let access = rustix::fs::Access::READ_OK | rustix::fs::Access::WRITE_OK;
        if rustix::fs::access(port, access).is_err() {
            return Bad(format!(
                "{name} belongs to group {} and this user may not use it; add the user to that group (often `dialout`) and log in again",
                metadata.gid()
            ));
        }
    }
    Good(format!(
        "{} and {} can be used",
        config.serial.sensor.display(),
        config.serial.steering.display()
    ))
}

fn emulated(config: &Config) -> Finding {
    match config.chip.parts(config.serial.baud) {
        Ok(parts) => Good(format!(
            "{} runs {} and {}",
            parts.emulator.display(),
            parts.sensor_elf.display(),
            parts.steering_elf.display()
        )),
        Err(missing) if config.body == Body::Chip => Bad(missing.to_string()),
        Err(missing) => Hint(format!("only `lager up --body chip` needs them: {missing}")),
    }
}

fn bus(config: &Config, fix: bool) -> Finding {
    match bus_state(config, fix) {
        Ok(finding) => finding,
        Err(error) => Bad(format!("{error:#}")),
    }
}

fn bus_state(config: &Config, fix: bool) -> Result<Finding> {
    let bus = config.bus()?;
    let swept = if fix {
        lager_ports::remove_stale_nodes(&bus)?
    } else {
        0
    };
    let nodes = lager_ports::nodes(&bus)?;
    let count = |state| nodes.iter().filter(|node| node.state == state).count();
    let alive = count(NodeState::Alive);
    let unknown = count(NodeState::Unknown);
    Ok(match count(NodeState::Stale) {
        0 if unknown > 0 => Hint(format!(
            "{alive} processes are on the bus, and {unknown} that belong to another user; one user should run all of a robot's services"
        )),
        0 => Good(format!(
            "{alive} processes are on it, {swept} dead ones were removed"
        )),
        stale if fix => Bad(format!(
            "{stale} dead processes cannot be removed; run this as the user they belonged to"
        )),
        stale => Hint(format!(
            "{stale} dead processes left something; `lager doctor --fix` removes it (a starting robot does so too)"
        )),
    })
}
