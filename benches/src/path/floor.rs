//! The floor: the same chain as the robot's, of the barest primitives the system has.
//!
//! ```text
//!  sensor pty                                                       steering pty
//!   --> read | slot 0, futex ~~wake~~> nothing | slot 1, futex ~~wake~~> write -->
//!       ends, reading thread           middle                   ends, main thread
//! ```
//!
//! It has as many processes, threads, wake-ups and bytes as the robot, in the same places, on the
//! same cores and in the same order of who goes first, but no packets, no decision and no bus. The
//! time that a robot takes beyond this is its software's.

use std::error::Error;
use std::os::fd::{OwnedFd, RawFd};
use std::path::PathBuf;

use lager_ports::{Clock, Policy, urgency};
use lager_rig::process::Main;
use lager_rig::schedule::Place;
use lager_rig::{Cable, Parent, Shareable, Shared};
use lager_topics::bytes_of;
use lager_wire::PACKET_LENGTH;
use rustix::fs::{Mode as FileMode, OFlags};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serde::{Deserialize, Serialize};

use super::processes::{ANSWER_WITHIN, Processes};
use super::turn::{Chain, sleep_until_due};
use crate::baseline::memory::Lane;
use crate::error::{BenchError, Fault};
use crate::sample::Block;

const ENDS: &str = "path, floor's ends";
const MIDDLE: &str = "path, floor's middle";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(ENDS, ends), (MIDDLE, middle)];

/// What a sample is here, and the block that carries it.
type Bytes = [u8; PACKET_LENGTH];
type Wide = Block<2>;

/// What the processes of the floor share.
#[derive(Debug)]
#[repr(C)]
struct Lanes([Lane<2>; 2]);

// SAFETY: atomics only, and zeros are valid.
#[allow(unsafe_code)]
unsafe impl Shareable for Lanes {}

/// Writes the sample and wakes who waits for it.
fn put(lane: &Lane<2>, bytes: &Bytes) -> Result<(), Errno> {
    let mut wide = [0; size_of::<Wide>()];
    wide[..PACKET_LENGTH].copy_from_slice(bytes);
    lane.slot.write(&Wide::from_bytes(&wide));
    lane.word.wake()
}

/// Sleeps until there is another sample than number `seen`, and reads it.
fn take(lane: &Lane<2>, seen: &mut u32) -> Result<Bytes, Errno> {
    while lane.word.count() == *seen {
        lane.word.sleep(*seen)?;
    }
    *seen = lane.word.count();
    let mut bytes = Bytes::default();
    bytes.copy_from_slice(&bytes_of(&lane.slot.read())[..PACKET_LENGTH]);
    Ok(bytes)
}

/// What the floor's processes are told.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Setup {
    place: Place,
    lanes: RawFd,
    ports: [PathBuf; 2],
}

/// What the parent says, and the lanes; the process has taken its place.
fn told(parent: &mut Parent) -> Result<(Setup, Shared<Lanes>), Box<dyn Error>> {
    let setup: Setup = parent.told()?;
    setup.place.take()?;
    let lanes = Shared::inherited(setup.lanes)?;
    Ok((setup, lanes))
}

fn ends(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let (setup, lanes) = told(parent)?;
    let [sensor, steering] = [open(&setup.ports[0])?, open(&setup.ports[1])?];
    parent.say(&())?;
    let [first, second] = &lanes.0;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            urgency::step_back(2, Policy::Block);
            let mut bytes = Bytes::default();
            while read_whole(&sensor, &mut bytes).is_ok() && put(first, &bytes).is_ok() {}
        });
        let mut seen = 0;
        loop {
            let bytes = take(second, &mut seen)?;
            rustix::io::write(&steering, &bytes)?;
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
        put(second, &take(first, &mut seen)?)?;
    }
}

/// A serial port whose `read` blocks, as one would open it without further needs.
fn open(path: &PathBuf) -> Result<OwnedFd, Errno> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let port = rustix::fs::open(path, flags, FileMode::empty())?;
    let mut termios = tcgetattr(&port)?;
    termios.make_raw();
    tcsetattr(&port, OptionalActions::Now, &termios)?;
    Ok(port)
}

fn read_whole(port: &OwnedFd, bytes: &mut Bytes) -> Result<(), Errno> {
    let mut have = 0;
    while have < bytes.len() {
        match rustix::io::read(port, &mut bytes[have..]) {
            Ok(0) => return Err(Errno::PIPE),
            Ok(count) => have += count,
            Err(Errno::INTR) => {}
            Err(errno) => return Err(errno),
        }
    }
    Ok(())
}

/// The floor's chain with both its processes.
pub(super) struct Floor {
    // Before the lanes and the cables: the processes end first.
    processes: Processes,
    _lanes: Shared<Lanes>,
    cables: [Cable; 2],
    sent: u64,
}

impl Floor {
    /// Starts it; `ends` is where the bridge would be, `logic` where logic would be.
    pub(super) fn start(ends: Place, logic: Place) -> Result<Self, BenchError> {
        let lanes = Shared::<Lanes>::new()?;
        let cables = [Cable::new()?, Cable::new()?];
        let setup = |place| Setup {
            place,
            lanes: lanes.number(),
            ports: [0, 1].map(|cable: usize| cables[cable].path().clone()),
        };
        let processes = Processes::start([(MIDDLE, setup(logic)), (ENDS, setup(ends))])?;
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

    fn frame(&mut self) -> Result<u64, BenchError> {
        self.sent += 1;
        let mut bytes = Bytes::default();
        bytes[..8].copy_from_slice(&self.sent.to_le_bytes());
        sleep_until_due();
        let start = Clock::monotonic_ns();
        self.cables[0].write(&bytes)?;
        let mut answer = [0; 64];
        let mut have = 0;
        loop {
            let count = self.cables[1]
                .read_until(start + ANSWER_WITHIN.as_nanos() as u64, &mut answer[have..])?;
            let end = Clock::monotonic_ns();
            have += count;
            if count == 0 {
                return Err(self.processes.fault("floor", self.sent));
            }
            if have >= PACKET_LENGTH {
                let got = u64::from_le_bytes(answer[..8].try_into().expect("eight of eleven"));
                if have > PACKET_LENGTH || got != self.sent {
                    return Err(BenchError::Failed {
                        contender: "floor".to_owned(),
                        sample: self.sent,
                        fault: Fault::Wrong(got),
                    });
                }
                return Ok(end - start);
            }
        }
    }
}
