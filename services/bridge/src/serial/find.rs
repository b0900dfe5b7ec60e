//! Finds the boards among the serial devices of this machine, where the configuration names no ports.
//!
//! A board says who it is without being asked: ten times a second until somebody answers, and by its
//! reports after that. So this only listens. **Nothing is written to a device that has not spoken as
//! a board**; then the handshake follows, as at a named port. What another device notices is that its
//! port is opened (its lines DTR and RTS rise), and that the port has the boards' speed for a moment;
//! the former settings come back.
//!
//! A console of the kernel is never opened, nor a port that another program has open or may have open
//! ([`super::holders`]). If two boards say that they are the same one, neither is taken.

use std::fmt;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_wire::link::{HostEvent, HostLink};
use lager_wire::{Callsign, Decoder, Payload, Version};

use super::holders::{self, Other};
use super::{OpenPortError, SerialPort};

/// Where the devices are, if nobody names another folder.
pub const DEVICES: &str = "/dev";

/// How the names of USB adapters and of boards with USB begin. The UART of a Pi itself may be a
/// console or have a radio behind it, so somebody has to name it.
const NAMES: [&str; 2] = ["ttyUSB", "ttyACM"];

/// The kernel's list of its consoles.
const CONSOLES: &str = "/sys/class/tty/console/active";

/// How long it listens to a device, in robot time: an original board takes 0.6 s to prove itself.
const LISTENS: Duration = Duration::from_millis(800);
/// The same in real time, if the clock of emulated boards hardly goes on.
const PATIENCE: Duration = Duration::from_secs(10);
const PAUSE: Duration = Duration::from_millis(5);

/// A serial device, and what it has said.
#[derive(Debug)]
pub struct Device {
    /// Its path.
    pub path: PathBuf,
    /// What it has said.
    pub said: Said,
}

/// What a device has said, or why it was not asked.
#[derive(Debug)]
pub enum Said {
    /// It is a board. Its port is still open, unless somebody has taken it.
    Board(Callsign, Option<Box<SerialPort>>),
    /// Nothing.
    Nothing,
    /// Something, but not what a board says.
    Other,
    /// It was not opened: it is a console of the kernel.
    Console,
    /// It was not opened: others have it, or may have it.
    Held(Vec<Other>),
    /// It cannot be opened.
    Refused(OpenPortError),
}

/// Why a board was not found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotFound {
    /// There is no device at all.
    #[error(
        "there is no serial device ({}/ttyUSB* or ttyACM*): plug in the boards' USB cables, or name their ports in [serial]",
        folder.display()
    )]
    NoDevice {
        /// The folder in which they would be.
        folder: PathBuf,
    },
    /// No device said that it is this board.
    #[error(
        "no {role} board speaks at any serial device ({devices}): look at its power and its USB cable, or name the ports of both boards in [serial]"
    )]
    Silent {
        /// The board.
        role: Callsign,
        /// Each device, with what it said.
        devices: String,
    },
    /// Several devices said so.
    #[error(
        "{ports} all have a {role} board: unplug those of another robot, or name the ports of this one in [serial]"
    )]
    Several {
        /// The board.
        role: Callsign,
        /// Their ports.
        ports: String,
    },
}

/// The paths of the devices in `folder`, each device once, in the order of their names.
pub fn devices(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_one = |name: &str| NAMES.iter().any(|start| name.starts_with(start));
    let mut paths: Vec<PathBuf> = entries
        .filter(|entry| entry.file_name().to_str().is_some_and(is_one))
        .map(|entry| entry.path())
        .collect();
    paths.sort_unstable();
    let mut seen = Vec::new();
    paths.retain(|path| match fs::metadata(path) {
        Ok(device) if seen.contains(&device.rdev()) => false,
        Ok(device) => {
            seen.push(device.rdev());
            true
        }
        // It has gone meanwhile.
        Err(_) => false,
    });
    paths
}

/// Listens to each device in `folder` that nobody uses, until all have said that they are boards, or
/// for some time. Ends early once `goes_on` is false.
pub fn listen(folder: &Path, baud: u32, clock: &Clock, goes_on: impl Fn() -> bool) -> Vec<Device> {
    let consoles = fs::read_to_string(CONSOLES).unwrap_or_default();
    let mut heard: Vec<(PathBuf, Result<Ear, Said>)> = devices(folder)
        .into_iter()
        .map(|path| {
            let ear = open(&path, baud, &consoles).map(Ear::new);
            (path, ear)
        })
        .collect();
    let (start, began) = (Instant::now(), clock.now());
    let is_deaf = |(_, ear): &(_, Result<Ear, Said>)| matches!(ear, Ok(ear) if ear.board.is_none());
    let mut now = Duration::ZERO;
    while heard.iter().any(is_deaf) && now < LISTENS && start.elapsed() < PATIENCE && goes_on() {
        thread::sleep(PAUSE);
        now = clock.now().saturating_sub(began);
        for (_, ear) in &mut heard {
            if let Ok(ear) = ear {
                ear.hear(now);
            }
        }
    }
    let said = |ear: Result<Ear, Said>| ear.map_or_else(|said| said, Ear::said);
    heard
        .into_iter()
        .map(|(path, ear)| Device {
            path,
            said: said(ear),
        })
        .collect()
}

/// Opens a device unless it has another use.
fn open(path: &Path, baud: u32, consoles: &str) -> Result<SerialPort, Said> {
    let real = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let name = real.file_name().unwrap_or_default();
    if consoles.split_whitespace().any(|console| name == console) {
        return Err(Said::Console);
    }
    let others = holders::others(&[&path.to_owned()], &[]);
    if !others.is_empty() {
        return Err(Said::Held(others));
    }
    SerialPort::open(path, baud).map_err(Said::Refused)
}

/// Takes the port of the board `role` out of what the devices have said.
///
/// # Errors
/// No device or more than one has said that it is this board. The sentence names each device.
pub fn take(folder: &Path, devices: &mut [Device], role: Callsign) -> Result<SerialPort, NotFound> {
    let is_it = |device: &&Device| matches!(device.said, Said::Board(is, _) if is == role);
    let ports: Vec<String> = devices
        .iter()
        .filter(is_it)
        .map(|device| device.path.display().to_string())
        .collect();
    if devices.is_empty() {
        return Err(NotFound::NoDevice {
            folder: folder.to_owned(),
        });
    }
    if ports.len() > 1 {
        return Err(NotFound::Several {
            role,
            ports: ports.join(" and "),
        });
    }
    for device in devices.iter_mut() {
        if let Said::Board(is, port) = &mut device.said
            && *is == role
            && let Some(port) = port.take()
        {
            return Ok(*port);
        }
    }
    let devices: Vec<String> = devices.iter().map(Device::to_string).collect();
    Err(NotFound::Silent {
        role,
        devices: devices.join("; "),
    })
}

/// The ports of both boards, for a person who works on them. A board in its bootloader says nothing, so
/// silent devices count for the boards that are missing, if there are as many, and if no board can be
/// at a port that was not opened.
pub fn both(folder: &Path, mut devices: Vec<Device>) -> [Result<PathBuf, NotFound>; 2] {
    let roles = [Callsign::Sensor, Callsign::Steering];
    let found = roles.map(|role| take(folder, &mut devices, role));
    let missing = found
        .iter()
        .filter(|found| matches!(found, Err(NotFound::Silent { .. })));
    let are_all_heard = devices
        .iter()
        .all(|device| !matches!(device.said, Said::Held(_) | Said::Refused(_)));
    let silent = devices
        .iter()
        .filter(|device| matches!(device.said, Said::Nothing));
    let mut silent: Vec<PathBuf> = silent.map(|device| device.path.clone()).collect();
    if silent.len() != missing.count() || !are_all_heard {
        silent.clear();
    }
    found.map(|found| match found {
        Ok(port) => Ok(port.path().to_owned()),
        Err(error @ NotFound::Silent { .. }) => silent.pop().ok_or(error),
        Err(error) => Err(error),
    })
}

impl fmt::Display for Device {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        match &self.said {
            Said::Board(role, _) => write!(formatter, "{path} has the {role} board"),
            Said::Nothing => write!(formatter, "{path} says nothing"),
            Said::Other => write!(formatter, "{path} speaks, but not as a board does"),
            Said::Console => write!(formatter, "{path} is a console of this machine"),
            Said::Held(others) => {
                let said: Vec<String> = others.iter().map(Other::said).collect();
                formatter.write_str(&said.join("; "))
            }
            Said::Refused(OpenPortError::Busy { .. }) => write!(
                formatter,
                "{path} is in use, for the other board or by a program of another user"
            ),
            Said::Refused(error) => error.fmt(formatter),
        }
    }
}

/// One device, and what has come from it.
struct Ear {
    port: SerialPort,
    one: Decoder,
    /// Knows an original board, whose packets have no check value, by several in a row.
    link: HostLink,
    /// The board that the last sound packet came from. One alone can be chance, if a device sends much
    /// at another speed.
    once: Option<Callsign>,
    bytes: usize,
    board: Option<Callsign>,
}

impl Ear {
    fn new(port: SerialPort) -> Self {
        Self {
            port,
            one: Decoder::new(Version::One),
            link: HostLink::new(),
            once: None,
            bytes: 0,
            board: None,
        }
    }

    /// Takes what has come by `now`.
    fn hear(&mut self, now: Duration) {
        if self.board.is_some() {
            return;
        }
        let mut buffer = [0; 512];
        // A device that has gone says no more.
        let count = self
            .port
            .read(&mut buffer, Duration::ZERO)
            .unwrap_or_default();
        self.bytes += count;
        // The link asks to send a handshake now and then. Nobody does, because a board speaks unasked.
        while self.link.poll(now).is_some() {}
        for byte in &buffer[..count] {
            self.take(*byte, now);
        }
    }

    fn take(&mut self, byte: u8, now: Duration) {
        if let Some(packet) = self.one.push(byte) {
            let role = match packet.payload {
                Payload::Handshake(handshake) => Some(handshake.sign),
                payload => payload.kind().comes_only_from(),
            };
            if let Some(role @ (Callsign::Sensor | Callsign::Steering)) = role {
                let before = self.once.replace(role);
                self.board = before.filter(|before| *before == role);
            }
        }
        let up = match self.link.push(byte, now) {
            Some(HostEvent::SendAck { up: Some(up) } | HostEvent::Up(up)) => up,
            _ => return,
        };
        if up.version == Version::Original {
            self.board = self.board.or(Some(up.callsign));
        }
    }

    fn said(self) -> Said {
        let Some(role) = self.board else {
            self.port.put_back();
            return match self.bytes {
                0 => Said::Nothing,
                _ => Said::Other,
            };
        };
        Said::Board(role, Some(Box::new(self.port)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_console_is_never_opened() {
        let port = Path::new("/dev/null");
        let refused = open(port, 9_600, "tty0 null\n").map(|_| ());
        assert!(matches!(refused, Err(Said::Console)), "{refused:?}");
    }
}
