//! A frame on its way, the causes of lateness, and what is known of the machine.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use crate::event::Thread;
use crate::walk::Piece;

/// Why a frame is late.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Cause {
    /// An interrupt, or work that one has left, had the core.
    Interrupt,
    /// Another thread had the core.
    RunQueue,
    /// The core slept, and did not wake quickly.
    Sleep,
    /// Nothing ran while it should have: a hypervisor gave the core to somebody else.
    Hypervisor,
    /// Memory was not there.
    PageFault,
    /// The kernel's worker that carries the bytes of serial ports.
    SerialWorker,
    /// The robot's own code took long.
    OwnCode,
    /// A signal or a debugger had stopped the robot's own code.
    Stopped,
    /// The robot's own code slept by itself, or waited for a device.
    Waited,
    /// Another program had to go first.
    OtherProgram,
    /// The events do not say, or are missing.
    Unknown,
}

impl Cause {
    /// All causes.
    pub const ALL: [Self; 11] = [
        Self::Interrupt,
        Self::RunQueue,
        Self::Sleep,
        Self::Hypervisor,
        Self::PageFault,
        Self::SerialWorker,
        Self::OwnCode,
        Self::Stopped,
        Self::Waited,
        Self::OtherProgram,
        Self::Unknown,
    ];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Interrupt => "interrupt",
            Self::RunQueue => "run queue",
            Self::Sleep => "core slept",
            Self::Hypervisor => "hypervisor",
            Self::PageFault => "page fault",
            Self::SerialWorker => "serial worker",
            Self::OwnCode => "own code",
            Self::Stopped => "stopped",
            Self::Waited => "waited",
            Self::OtherProgram => "other program",
            Self::Unknown => "unknown",
        }
    }
}

impl Serialize for Cause {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// Who brought a frame to a place on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Who {
    /// This thread.
    Thread(Thread),
    /// The thread of this process that ran then.
    Process(u32),
}

/// A place on a frame's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    /// The stage that ends here.
    pub stage: &'static str,
    /// When, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
    /// Who was there.
    pub by: Who,
}

/// A frame on its way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its number.
    pub number: u64,
    /// When its way began, in ns of `CLOCK_MONOTONIC`.
    pub start_ns: u64,
    /// The places that it passed, in their order; at least one.
    pub marks: Vec<Mark>,
}

impl Frame {
    /// When its way ended, in ns.
    pub fn end_ns(&self) -> u64 {
        self.marks.last().map_or(self.start_ns, |mark| mark.at_ns)
    }
}

/// A piece of a frame's way, and the stage in which it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Staged {
    /// The stage.
    pub stage: &'static str,
    /// The piece.
    pub piece: Piece,
}

/// What is known of the machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// How long each idle state takes to leave, in ns, by its number. Empty: the kernel does not say.
    pub idle_ns: BTreeMap<u32, u64>,
    /// The longest time to leave an idle state of which the kernel does not say it, in ns.
    pub idle_usual_ns: u64,
}

impl Default for Machine {
    fn default() -> Self {
        Self {
            idle_ns: BTreeMap::new(),
            idle_usual_ns: 1_000_000,
        }
    }
}
