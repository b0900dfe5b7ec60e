//! Finds other programs that have a board's serial port open: `ModemManager`, a getty, a serial
//! monitor.
//!
//! Two readers of one port share its bytes, and each loses those that the other gets. The kernel
//! says who has the port open (`/proc/PID/fd`), but only of this user's processes; root sees all.
//! Of other users' processes only names are known. So the check reports programs that are known to
//! open serial ports, programs that name the port on their command line, and those that say so in a
//! lock file, as terminal programs do.
//!
//! `ModemManager` opens each new port for a moment, so whether it has one open now says nothing. It
//! leaves a port alone whose udev property says so, which the Debian package's rules set.

use std::fs::{self, Metadata};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::process::{Pid, test_kill_process};

/// Programs that open serial ports by themselves.
const MEDDLERS: [&str; 2] = [MODEM_MANAGER, "brltty"];

const MODEM_MANAGER: &str = "ModemManager";
/// The property of a port that it leaves alone, as udev keeps it in this folder.
const LEFT_ALONE: &str = "E:ID_MM_DEVICE_IGNORE=1";
const UDEV: &str = "/run/udev/data";
/// Where terminal programs leave files such as `LCK..ttyUSB0` with their process number.
const LOCKS: &str = "/run/lock";

/// A process that is not the robot's and has a port open, or may.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Other {
    pid: u32,
    name: String,
    port: PathBuf,
    /// Whether it certainly has the port open.
    is_sure: bool,
}

impl Other {
    /// What it does, and how to end it.
    pub fn said(&self) -> String {
        let Self {
            pid,
            name,
            port,
            is_sure,
        } = self;
        let port_name = port.file_name().unwrap_or_default().to_string_lossy();
        let does = match is_sure {
            true => format!("has {} open as well", port.display()),
            false => format!("may have {} open", port.display()),
        };
        let end = match name.as_str() {
            MODEM_MANAGER => "the Debian package's udev rules keep it away from boards that are plugged in after the installation, `sudo systemctl stop ModemManager` ends it, and `sudo systemctl disable ModemManager` for good".to_owned(),
            "lager" => "end that robot with Ctrl-C where it runs, or the service with `sudo systemctl stop lager`".to_owned(),
            name if name.ends_with("getty") => {
                format!("`sudo systemctl stop serial-getty@{port_name}` ends it")
            }
            _ => format!("`kill {pid}` ends it"),
        };
        format!("process {pid} ({name}) {does}; the robot loses the bytes that it reads; {end}")
    }
}

/// The processes, except `own`, that have one of `ports` open or may have it open.
pub fn others(ports: &[&PathBuf], own: &[u32]) -> Vec<Other> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let mut found = Vec::new();
    for process in processes {
        let Some(pid) = process
            .file_name()
            .to_str()
            .and_then(|name| name.parse().ok())
        else {
            continue;
        };
        if own.contains(&pid) || pid == std::process::id() {
            continue;
        }
        let folder = process.path();
        let name = fs::read_to_string(folder.join("comm")).unwrap_or_default();
        for port in ports {
            let is_open = is_open(&folder, port);
            let is_guilty = match is_open {
                _ if name.trim() == MODEM_MANAGER => !is_left_alone(Path::new(UDEV), port),
                Some(is_open) => is_open,
                None => is_suspect(&folder, name.trim(), port),
            };
            if is_guilty {
                found.push(Other {
                    pid,
                    name: name.trim().to_owned(),
                    port: (*port).clone(),
                    is_sure: is_open == Some(true),
                });
            }
        }
    }
    for port in ports {
        if let Some(pid) = locked_by(Path::new(LOCKS), port)
            && !own.contains(&pid)
            && pid != std::process::id()
            && found.iter().all(|other| other.pid != pid)
        {
            let name = fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
            found.push(Other {
                pid,
                name: name.trim().to_owned(),
                port: (*port).clone(),
                is_sure: true,
            });
        }
    }
    found
}

/// The running process that says by a lock file that it has the port.
fn locked_by(locks: &Path, port: &Path) -> Option<u32> {
    let port = fs::canonicalize(port).ok()?;
    let file = format!("LCK..{}", port.file_name()?.to_str()?);
    let text = fs::read_to_string(locks.join(file)).ok()?;
    let pid: u32 = text.split_whitespace().next()?.parse().ok()?;
    let process = Pid::from_raw(pid.try_into().ok()?)?;
    // A program that was killed leaves its file.
    let is_there = matches!(test_kill_process(process), Ok(()) | Err(Errno::PERM));
    is_there.then_some(pid)
}

/// Whether a process has a port open; `None` if the process is another user's.
fn is_open(process: &Path, port: &Path) -> Option<bool> {
    let of_port = fs::metadata(port).ok()?;
    let is_same = |of: &Metadata| of.file_type().is_char_device() && of.rdev() == of_port.rdev();
    let mut files = fs::read_dir(process.join("fd")).ok()?.flatten();
    Some(files.any(|file| fs::metadata(file.path()).is_ok_and(|of| is_same(&of))))
}

/// Whether udev tells `ModemManager` to leave a port alone.
fn is_left_alone(udev: &Path, port: &Path) -> bool {
    let Ok(of_port) = fs::metadata(port) else {
        // There is nothing yet that it could open.
        return true;
    };
    let (major, minor) = (
        rustix::fs::major(of_port.rdev()),
        rustix::fs::minor(of_port.rdev()),
    );
    let properties = fs::read_to_string(udev.join(format!("c{major}:{minor}")));
    properties.is_ok_and(|text| text.lines().any(|line| line == LEFT_ALONE))
}

/// Whether another user's process may have the port open.
fn is_suspect(process: &Path, name: &str, port: &Path) -> bool {
    let command = fs::read(process.join("cmdline")).unwrap_or_default();
    // If the port is a link, other programs use the name that it leads to.
    let port = fs::canonicalize(port).unwrap_or_else(|_| port.to_owned());
    let port_name = port.file_name().unwrap_or_default().to_string_lossy();
    let mut words = command.split(|byte| *byte == 0);
    MEDDLERS.contains(&name)
        || words.any(|word| {
            let word = String::from_utf8_lossy(word);
            word == port_name || word == port.to_string_lossy()
        })
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    #[test]
    fn whoever_has_a_port_open_is_named_with_what_ends_it() {
        let port = PathBuf::from("/dev/null");
        let own = Path::new("/proc/self");
        let open = File::open(&port).expect("a device");
        assert_eq!(is_open(own, &port), Some(true));
        drop(open);
        let missing = PathBuf::from("/dev/lager-no-such-port");
        assert_eq!(is_open(own, &missing), None);
        // This process is the doctor itself.
        let others = others(&[&port], &[]);
        assert!(others.iter().all(|other| other.pid != std::process::id()));
    }

    #[test]
    fn a_lock_file_counts_while_its_process_runs() {
        let locks = std::env::temp_dir().join(format!("lager-locks-{}", std::process::id()));
        fs::create_dir_all(&locks).expect("a temporary folder");
        let port = Path::new("/dev/null");
        assert_eq!(locked_by(&locks, port), None);
        let own = std::process::id();
        for (text, pid) in [
            (format!("{own:10}\n"), Some(own)),
            (format!("{own} minicom root"), Some(own)),
            // No process has such a number.
            (format!("{}\n", i32::MAX), None),
            ("-1\n".into(), None),
            ("minicom\n".into(), None),
        ] {
            fs::write(locks.join("LCK..null"), &text).expect("a file");
            assert_eq!(locked_by(&locks, port), pid, "{text}");
        }
        fs::remove_dir_all(&locks).expect("its own folder");
    }

    #[test]
    fn modem_manager_leaves_a_port_alone_when_udev_says_so() {
        let udev = std::env::temp_dir().join(format!("lager-udev-{}", std::process::id()));
        fs::create_dir_all(&udev).expect("a temporary folder");
        // Linux gives this device these numbers on every machine.
        let port = Path::new("/dev/null");
        assert!(!is_left_alone(&udev, port));
        for (properties, is_told) in [
            ("S:serial/by-id/usb-x\nE:ID_MM_DEVICE_IGNORE=1\n", true),
            ("E:ID_MM_DEVICE_IGNORE=0\n", false),
            ("E:ID_VENDOR=x\n", false),
        ] {
            fs::write(udev.join("c1:3"), properties).expect("a file");
            assert_eq!(is_left_alone(&udev, port), is_told, "{properties}");
        }
        fs::remove_dir_all(&udev).expect("its own folder");
    }

    #[test]
    fn each_kind_of_program_is_ended_in_its_own_way() {
        let other = |name: &str, is_sure| Other {
            pid: 4_711,
            name: name.to_owned(),
            port: "/dev/ttyUSB0".into(),
            is_sure,
        };
        for (name, is_sure, words) in [
            (
                "minicom",
                true,
                [
                    "process 4711 (minicom) has /dev/ttyUSB0 open",
                    "`kill 4711`",
                ],
            ),
            (
                "ModemManager",
                false,
                ["may have /dev/ttyUSB0 open", "systemctl stop ModemManager"],
            ),
            ("agetty", true, ["(agetty)", "serial-getty@ttyUSB0"]),
        ] {
            let said = other(name, is_sure).said();
            assert!(words.iter().all(|word| said.contains(word)), "{said}");
        }
    }
}
