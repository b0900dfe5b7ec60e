//! What happens at a port, as the bridge's core is told.
//!
//! Apart from the core and from the receiving end, which both use it.

use core::time::Duration;

use lager_wire::link::Up;
use lager_wire::{ArmData, BoardStatus, LineReading, SettingReply, SteerData, Version};

/// A moment by both of the times the bridge goes by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moment {
    /// Robot time: leases and deadlines.
    pub robot: Duration,
    /// The machine's `CLOCK_MONOTONIC` in ns: the stamps of samples and requests.
    pub ns: u64,
}

/// A board that has come up, in the bridge's own count of epochs.
#[derive(Clone, Copy, Debug)]
pub struct BoardUp {
    /// What the link says of it.
    pub up: Up,
    /// The board's epoch over all lives of the bridge.
    pub link_epoch: u32,
}

/// What has happened at a port.
#[derive(Clone, Copy, Debug)]
pub enum PortEvent {
    /// The port is open.
    Opened,
    /// The port has gone.
    Lost,
    /// The board must be asked who it is.
    SendSyn,
    /// The board's SYN must be answered.
    SendAck {
        /// The rules the board speaks by.
        version: Version,
        /// The board that has come up with it.
        up: Option<BoardUp>,
    },
    /// An original board was found running.
    Adopt(BoardUp),
    /// The board has fallen silent.
    Silent,
    /// A report of the steering board.
    Steer {
        /// The report.
        data: SteerData,
        /// When it was read.
        at: Moment,
    },
    /// A servo's state.
    Arm(ArmData),
    /// A board's own counters.
    Status(BoardStatus),
    /// A board's answer to a setting.
    Setting(SettingReply),
    /// What a line sensor reads while the line sensors are calibrated.
    Reading(LineReading),
}
