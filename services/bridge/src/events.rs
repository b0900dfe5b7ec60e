//! The events of a port, for the bridge's core.
//!
//! They stand apart from the core and from the receiving end because both use them.

use lager_orders::Moment;
use lager_wire::link::Up;
use lager_wire::{ArmData, BoardStatus, LineReading, SettingReply, SteerData, Version};

/// A board that has come up, in the bridge's own count of epochs.
#[derive(Clone, Copy, Debug)]
pub struct BoardUp {
    /// The link's own news.
    pub up: Up,
    /// The board's epoch over all lives of the bridge.
    pub link_epoch: u32,
}

/// Something has happened at a port.
#[derive(Clone, Copy, Debug)]
pub enum PortEvent {
    /// The port is open.
    Opened,
    /// The port has gone.
    Lost,
    /// The bridge must ask the board who it is.
    SendSyn,
    /// The bridge must answer the board's SYN.
    SendAck {
        /// The version of the protocol that the board speaks.
        version: Version,
        /// The board, if it has come up with this SYN.
        up: Option<BoardUp>,
    },
    /// An original board was found that runs already.
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

impl PortEvent {
    /// Whether the board's next report repeats this data, so that one may be missed.
    #[must_use]
    pub fn is_repeated(&self) -> bool {
        match self {
            Self::Steer { .. }
            | Self::Arm(_)
            | Self::Status(_)
            | Self::Setting(_)
            | Self::Reading(_) => true,
            Self::Opened
            | Self::Lost
            | Self::SendSyn
            | Self::SendAck { .. }
            | Self::Adopt(_)
            | Self::Silent => false,
        }
    }
}
