//! The floor: the same chain as the robot's, of the barest primitives the system has.
//!
//! ```text
//!  sensor pty                                                       steering pty
//!   --> read | slot 0, futex ~~wake~~> nothing | slot 1, futex ~~wake~~> write -->
//!       ends, reading thread           middle                   ends, main thread
//! ```
//!
//! It has as many processes, threads, wake-ups and bytes as the robot, in the same places and on
//! the same cores, but no packets, no decision and no bus. The time that a robot takes beyond this
//! is its software's.

use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::error::Error;
use std::os::fd::{OwnedFd, RawFd};
use std::path::PathBuf;

use lager_rig::process::Main;
use lager_rig::{Cable, Parent, Process, Refused, Shareable, Shared, timespec};
use lager_wire::PACKET_LENGTH;
use rustix::fs::{Mode as FileMode, OFlags};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use rustix::thread::futex;
use serde::{Deserialize, Serialize};

use super::pace::{ANSWER_WITHIN, Chain, now_ns, sleep_until_due};
use super::processes::Processes;
use super::services::Place;
use crate::error::BenchError;

const ENDS: &str = "path, floor's ends";
const MIDDLE: &str = "path, floor's middle";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(ENDS, ends), (MIDDLE, middle)];

/// Longest sleep in a futex, in ns: as long as the robot's services sleep.
const LONGEST_WAIT_NS: u64 = 20_000_000;

/// What a sample is here.
type Bytes = [u8; PACKET_LENGTH];

/// One sample, and a word that says which one it is.
#[derive(Debug)]
#[repr(C, align(64))]
struct Slot {
    words: [AtomicU64; 2],
    number: AtomicU32,
}

/// What the processes of the floor share.
#[derive(Debug)]
#[repr(C)]
struct Slots([Slot; 2]);

// SAFETY: atomics only, and zeros are valid.
#[allow(unsafe_code)]
unsafe impl Shareable for Slots {}

impl Slot {
    /// Writes the sample and wakes who waits for it.
    fn put(&self, bytes: &Bytes) {
        let mut wide = [0; 16];
        wide[..PACKET_LENGTH].copy_from_slice(bytes);
        let (low, high) = wide.split_at(8);
        for (word, half) in self.words.iter().zip([low, high]) {
            let half = half.try_into().expect("half of sixteen is eight");
            word.store(u64::from_le_bytes(half), Ordering::Relaxed);
        }
        self.number.fetch_add(1, Ordering::Release);
        // Nobody waiting is no failure.
        let _ = futex::wake(&self.number, futex::Flags::empty(), 1);
    }

    /// Sleeps until there is another sample than number `seen`, and reads it.
    fn take(&self, seen: &mut u32) -> Bytes {
        loop {
            let number = self.number.load(Ordering::Acquire);
            if number != *seen {
                *seen = number;
                break;
            }
            let longest = timespec(LONGEST_WAIT_NS);
            // Whatever ended the sleep, the word says whether there is something.
            let _ = futex::wait(&self.number, futex::Flags::empty(), number, Some(&longest));
        }
        let mut wide = [0; 16];
        for (word, half) in self.words.iter().zip(wide.chunks_exact_mut(8)) {
            half.copy_from_slice(&word.load(Ordering::Relaxed).to_le_bytes());
        }
        wide[..PACKET_LENGTH]
            .try_into()
            .expect("a packet fits into two words")
    }
}

/// What the floor's processes are told.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Setup {
    place: Place,
    slots: RawFd,
    ports: [PathBuf; 2],
}

fn ends(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some(setup) = parent.hear::<Setup>()? else {
        return Ok(());
    };
    setup.place.take()?;
    let slots = Shared::<Slots>::inherited(setup.slots)?;
    let [sensor, steering] = [open(&setup.ports[0])?, open(&setup.ports[1])?];
    parent.say(&())?;
    let [first, second] = &slots.0;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut bytes = Bytes::default();
            while read_whole(&sensor, &mut bytes).is_ok() {
                first.put(&bytes);
            }
        });
        let mut seen = 0;
        loop {
            let bytes = second.take(&mut seen);
            rustix::io::write(&steering, &bytes).map_err(port_error)?;
        }
    })
}

fn middle(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some(setup) = parent.hear::<Setup>()? else {
        return Ok(());
    };
    setup.place.take()?;
    let slots = Shared::<Slots>::inherited(setup.slots)?;
    parent.say(&())?;
    let [first, second] = &slots.0;
    let mut seen = 0;
    loop {
        second.put(&first.take(&mut seen));
    }
}

/// A serial port whose `read` blocks, as one would open it without further needs.
fn open(path: &PathBuf) -> Result<OwnedFd, Refused> {
    let opened = || -> Result<OwnedFd, Errno> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let port = rustix::fs::open(path, flags, FileMode::empty())?;
        let mut termios = tcgetattr(&port)?;
        termios.make_raw();
        tcsetattr(&port, OptionalActions::Now, &termios)?;
        Ok(port)
    };
    opened().map_err(port_error)
}

fn port_error(errno: Errno) -> Refused {
    Refused::to_make("the floor's end of a pseudo terminal")(errno)
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
    // Before the slots and the cables: the processes end first.
    processes: Processes,
    _slots: Shared<Slots>,
    cables: [Cable; 2],
    sent: u64,
}

impl Floor {
    /// Starts it; `ends` is where the bridge would be, `logic` where logic would be.
    pub(super) fn start(ends: Place, logic: Place) -> Result<Self, BenchError> {
        let slots = Shared::<Slots>::new()?;
        let cables = [Cable::new()?, Cable::new()?];
        let setup = |place| Setup {
            place,
            slots: slots.number(),
            ports: [0, 1].map(|cable: usize| cables[cable].path().clone()),
        };
        let mut processes = Vec::new();
        for (name, place) in [(MIDDLE, logic), (ENDS, ends)] {
            let mut process = Process::start(name)?;
            let () = process.ask(&setup(place))?;
            processes.push(process);
        }
        Ok(Self {
            processes: Processes::new(processes),
            _slots: slots,
            cables,
            sent: 0,
        })
    }
}

impl Chain for Floor {
    fn begin(&mut self) -> Result<(), BenchError> {
        self.processes.wake()
    }

    fn frame(&mut self) -> Result<u64, BenchError> {
        self.sent += 1;
        let mut bytes = Bytes::default();
        bytes[..8].copy_from_slice(&self.sent.to_le_bytes());
        sleep_until_due();
        let start = now_ns();
        self.cables[0].write(&bytes)?;
        let mut answer = [0; 64];
        let mut have = 0;
        loop {
            let count = self.cables[1].read_until(start + ANSWER_WITHIN, &mut answer[have..])?;
            let end = now_ns();
            have += count;
            if count == 0 {
                return Err(self.processes.fault("floor", self.sent));
            }
            if have >= PACKET_LENGTH {
                let got = u64::from_le_bytes(answer[..8].try_into().expect("eight of eleven"));
                if have > PACKET_LENGTH || got != self.sent {
                    return Err(BenchError::WrongSample {
                        contender: "floor".to_owned(),
                        expected: self.sent,
                        got,
                    });
                }
                return Ok(end - start);
            }
        }
    }

    fn count(&mut self) -> Result<(), BenchError> {
        self.processes.start_counting()
    }

    fn end(&mut self) -> Result<(), BenchError> {
        self.processes.rest()
    }

    fn cpu_percent(&self) -> Option<f64> {
        self.processes.cpu_percent()
    }
}
