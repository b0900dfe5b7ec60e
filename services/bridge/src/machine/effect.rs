//! The actions that the bridge's core wants, one at a time.
//!
//! They stand apart from the core because the code that carries them out needs nothing else of it.

use lager_orders::Mode;
use lager_stop::Stop;
use lager_topics::{AskKind, Part, ProfileState, StopCause, ThoughtKind};
use lager_wire::{Callsign, PACKET_LENGTH, SteerCommand};

use crate::arbiter::OrderKey;
use crate::buttons::Touch;
use crate::events::BoardUp;

/// One thing to do.
#[derive(Clone, Copy, Debug)]
pub enum Effect {
    /// Throw away the bytes that wait at a port: they would be too old when they leave.
    Discard {
        /// The port, 0 or 1.
        place: usize,
    },
    /// Write a packet to a port, and tell [`wrote`](super::BridgeCore::wrote).
    Write(Write),
    /// Publish what [`fill_health`](super::BridgeCore::fill_health) writes.
    PublishHealth {
        /// Whether it says something new that somebody acts upon.
        rings: bool,
    },
    /// Publish what [`fill_state`](super::BridgeCore::fill_state) writes.
    PublishState {
        /// When the report that caused it was read, in ns of `CLOCK_MONOTONIC`.
        report_ns: Option<u64>,
    },
    /// Publish a report of the steering board for a `lager stop` that waits.
    ShowReport(ShownReport),
    /// Set a stop of the bridge's own.
    Stop(StopCause),
    /// Release this stop, if it is the one in force, and tell
    /// [`released`](super::BridgeCore::released).
    Release(Stop),
    /// Tell people.
    Say(Notice),
}

/// A packet for a port.
#[derive(Clone, Copy, Debug)]
pub struct Write {
    /// The port, 0 or 1.
    pub place: usize,
    /// The bytes.
    pub packet: [u8; PACKET_LENGTH],
    /// The command in it, if it is one.
    pub command: Option<SteerCommand>,
    /// The order in force, if this is its command.
    pub order: Option<OrderKey>,
}

/// A report of the steering board, for a `lager stop` that waits.
#[derive(Clone, Copy, Debug)]
pub struct ShownReport {
    /// When it was read, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
    /// The duties of the left and the right motor.
    pub duties: [u8; 2],
    /// Whether it proves that the wheels are at rest after the stop in force.
    pub proves_rest: bool,
}

/// News for people, besides the published samples.
#[derive(Clone, Copy, Debug)]
pub enum Notice {
    /// A board has come up on a port.
    Up {
        /// The port, 0 or 1.
        place: usize,
        /// The board.
        board: BoardUp,
    },
    /// The board on a port has fallen silent.
    Silent {
        /// The port, 0 or 1.
        place: usize,
    },
    /// The steering board on a port is an original one and only gets standby.
    OriginalBoard {
        /// The port, 0 or 1.
        place: usize,
    },
    /// A board resets again and again, and the bridge has stopped the robot.
    KeepsResetting(Callsign),
    /// The ports are lent, or are here again.
    Lent(bool),
    /// A board has taken its part of the robot's description, or has not.
    Profile(Part, ProfileState),
    /// Somebody pressed the switch.
    Pressed(Mode),
    /// Somebody pressed reset while a stop was in force, and this is what came of it.
    Reset(ThoughtKind),
    /// A request has set the mode.
    ModeSet(Mode),
    /// What somebody did with a button came so many ms late.
    LateTouch(Touch, u64),
    /// Somebody finds out how the buttons are connected, or does not any more.
    Listened(bool),
    /// A request came too late.
    Late(Option<AskKind>),
}
