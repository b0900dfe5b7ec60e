//! The floor: the robot's chain, made of the simplest primitives of the system.
//!
//! ```text
//!  sensor pty                                                       steering pty
//!   --> read | slot 0, futex ~~wake~~> nothing | slot 1, futex ~~wake~~> write -->
//!       ends, reading thread           middle                   ends, main thread
//! ```
//!
//! It has as many processes, threads, wake-ups and bytes as the robot, in the same places, on the
//! same cores and with the same priorities, but no packets, no decision and no bus. So the robot's
//! software causes the difference between the robot's time and the floor's.

use std::error::Error;
use std::os::fd::{OwnedFd, RawFd};
use std::path::{Path, PathBuf};

use lager_home::Clock;
use lager_rig::process::Main;
use lager_rig::schedule::Placement;
use lager_rig::{Cable, Parent, Shared};
use lager_sample::bytes_of;
use lager_wake::{Policy, urgency};
use lager_wire::PACKET_LENGTH;
use rustix::fs::{Mode as FileMode, OFlags};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::processes::{ANSWER_WITHIN, Processes};
use super::turn::{Chain, sleep_until};
use crate::baseline::memory::Lanes;
use crate::baseline::stream::read_whole;
use crate::error::{BenchError, Fault};
use crate::sample::Block;

const ENDS: &str = "path, floor's ends";
const MIDDLE: &str = "path, floor's middle";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(ENDS, ends), (MIDDLE, middle)];

/// A packet in shared memory; its unused bytes are 0.
type Carrier = Block<2>;

/// The parent's message: core and priority, the descriptor of the lanes, and the serial ports.
type ChildSetup = (Placement, RawFd, [PathBuf; 2]);

/// Hears the serial ports and the lanes, and takes its core and priority.
fn told(parent: &mut Parent) -> Result<([PathBuf; 2], Shared<Lanes<2>>), Box<dyn Error>> {
    let (place, lanes, ports): ChildSetup = parent.told()?;
    place.take()?;
    Ok((ports, Shared::inherited(lanes)?))
}

fn ends(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let ([sensor, steering], lanes) = told(parent)?;
    let (sensor, steering) = (open(&sensor)?, open(&steering)?);
    parent.say(&())?;
    let [first, second] = &lanes.0;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            urgency::step_back(2, Policy::Block);
            let mut bytes = [0; size_of::<Carrier>()];
            while read_whole(&sensor, &mut bytes[..PACKET_LENGTH]).is_ok()
                && first.put(&Carrier::from_bytes(&bytes)).is_ok()
            {}
        });
        let mut seen = 0;
        loop {
            let carrier = second.take(&mut seen)?;
            rustix::io::write(&steering, &bytes_of(&carrier)[..PACKET_LENGTH])?;
        }
    })
}

fn middle(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let (_, lanes) = told(parent)?;
    urgency::step_back(1, Policy::Block);
    parent.say(&())?;
    let [first, second] = &lanes.0;
    let mut seen = 0;
    loop {
        second.put(&first.take(&mut seen)?)?;
    }
}

/// Opens a serial port in the simplest way: its `read` blocks.
fn open(path: &Path) -> Result<OwnedFd, Errno> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let port = rustix::fs::open(path, flags, FileMode::empty())?;
    let mut termios = tcgetattr(&port)?;
    termios.make_raw();
    tcsetattr(&port, OptionalActions::Now, &termios)?;
    Ok(port)
}

/// The floor's chain with both its processes.
pub(super) struct Floor {
    // The first field, so the processes end before the lanes and cables are dropped.
    processes: Processes,
    _lanes: Shared<Lanes<2>>,
    cables: [Cable; 2],
    sent: u64,
}

impl Floor {
    /// Starts the chain; `ends` is in the bridge's place, `logic` in logic's.
    pub(super) fn start(ends: Placement, logic: Placement) -> Result<Self, BenchError> {
        let lanes = Shared::<Lanes<2>>::new()?;
        let cables = [Cable::new()?, Cable::new()?];
        let ports = cables.each_ref().map(|cable| cable.path().clone());
        let told = |place| -> ChildSetup { (place, lanes.number(), ports.clone()) };
        let processes = Processes::start([(MIDDLE, told(logic)), (ENDS, told(ends))])?;
        Ok(Self {
            processes,
            _lanes: lanes,
            cables,
            sent: 0,
        })
    }
}

impl Chain for Floor {
    fn processes(&mut self) -> &mut Processes {
        &mut self.processes
    }

    fn frame(&mut self, at: u64) -> Result<[u64; 2], BenchError> {
        self.sent += 1;
        let mut bytes = [0; PACKET_LENGTH];
        bytes[..8].copy_from_slice(&self.sent.to_le_bytes());
        sleep_until(at);
        let start = Clock::monotonic_ns();
        self.cables[0].write(&bytes)?;
        let give_up = start + ANSWER_WITHIN.as_nanos() as u64;
        let mut answer = [0; 64];
        let mut have = 0;
        while have < PACKET_LENGTH {
            match self.cables[1].read_until(give_up, &mut answer[have..])? {
                0 => return Err(self.processes.fault("floor", self.sent)),
                count => have += count,
            }
        }
        let end = Clock::monotonic_ns();
        let got = u64::from_le_bytes(answer[..8].try_into().expect("eight of eleven"));
        if have > PACKET_LENGTH || got != self.sent {
            return Err(BenchError::Failed {
                contender: "floor".to_owned(),
                sample: self.sent,
                fault: Fault::Wrong(got),
            });
        }
        Ok([start, end])
    }
}
