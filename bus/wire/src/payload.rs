//! [`Payload`]: the content of a packet, with one layout for each kind.
//!
//! The layouts stand beside their types; this file only chooses between them. Version 1 checks
//! every byte it can (unused bytes, complements, ranges), the original checks only what it must.

use crate::board::{ArmData, BoardStatus};
use crate::bytes::{Bytes, Fault};
use crate::coded::coded;
use crate::handshake::{Callsign, Handshake, Version};
use crate::line::{Centimetres, LineBits, LineReading, LineState};
use crate::reset::ResetOrder;
use crate::setting::{Setting, SettingReply};
use crate::steer::{SteerCommand, SteerData};

coded! {
    /// A packet's kind, the high nibble of its first byte (U5). 6 to 11 exist in version 1 only.
    pub enum Kind {
        /// SYN or ACK.
        Handshake = 0,
        /// The robot's position on the line.
        LineData = 1,
        /// The distance that the IR sensor sees.
        Distance = 2,
        /// The raw bits of the eleven line sensors (AMB-11).
        RawLine = 3,
        /// A command to the steering board.
        SteerCommand = 4,
        /// The steering board's report (AMB-12).
        SteerData = 5,
        /// A setting to a board.
        Setting = 6,
        /// The board's answer to a setting.
        SettingReply = 7,
        /// One servo of the arm.
        ArmData = 8,
        /// The state of a board.
        BoardStatus = 9,
        /// The readings of one line sensor during a calibration.
        LineReading = 10,
        /// The Pi tells a board to restart.
        Reset = 11,
    }
}

impl Kind {
    /// Whether this kind exists in a version.
    pub const fn exists_in(self, version: Version) -> bool {
        match version {
            Version::Original => self.code() <= Self::SteerData.code(),
            Version::One => true,
        }
    }

    /// The board that sends this kind, if only one board does.
    pub const fn comes_only_from(self) -> Option<Callsign> {
        match self {
            Self::LineData | Self::Distance | Self::RawLine | Self::LineReading => {
                Some(Callsign::Sensor)
            }
            Self::SteerData | Self::ArmData => Some(Callsign::Steering),
            Self::Handshake
            | Self::SteerCommand
            | Self::Setting
            | Self::SettingReply
            | Self::Reset
            | Self::BoardStatus => None,
        }
    }
}

/// The content of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Payload {
    /// SYN or ACK.
    Handshake(Handshake),
    /// The robot's position on the line.
    Line(LineState),
    /// The distance that the IR sensor sees.
    Distance(Centimetres),
    /// The raw bits of the eleven line sensors.
    RawLine(LineBits),
    /// A command to the steering board.
    SteerCommand(SteerCommand),
    /// The steering board's report.
    SteerData(SteerData),
    /// A setting to a board.
    Setting(Setting),
    /// The board's answer to a setting.
    SettingReply(SettingReply),
    /// One servo of the arm.
    ArmData(ArmData),
    /// The state of a board.
    BoardStatus(BoardStatus),
    /// The readings of one line sensor during a calibration.
    LineReading(LineReading),
    /// The Pi tells a board to restart.
    Reset(ResetOrder),
}

impl Payload {
    /// The kind that the packet's header states.
    pub const fn kind(&self) -> Kind {
        match self {
            Self::Handshake(_) => Kind::Handshake,
            Self::Line(_) => Kind::LineData,
            Self::Distance(_) => Kind::Distance,
            Self::RawLine(_) => Kind::RawLine,
            Self::SteerCommand(_) => Kind::SteerCommand,
            Self::SteerData(_) => Kind::SteerData,
            Self::Setting(_) => Kind::Setting,
            Self::SettingReply(_) => Kind::SettingReply,
            Self::ArmData(_) => Kind::ArmData,
            Self::BoardStatus(_) => Kind::BoardStatus,
            Self::LineReading(_) => Kind::LineReading,
            Self::Reset(_) => Kind::Reset,
        }
    }

    pub(crate) fn write(&self, version: Version, payload: &mut Bytes) {
        match self {
            Self::Handshake(handshake) => handshake.write(version, payload),
            Self::Line(state) => state.write(payload),
            Self::Distance(distance) => distance.write(payload),
            Self::RawLine(bits) => bits.write(payload),
            Self::SteerCommand(command) => command.write(version, payload),
            Self::SteerData(data) => data.write(version, payload),
            Self::Setting(setting) => setting.write(payload),
            Self::SettingReply(reply) => reply.write(payload),
            Self::ArmData(data) => data.write(payload),
            Self::BoardStatus(status) => status.write(payload),
            Self::LineReading(reading) => reading.write(payload),
            Self::Reset(order) => order.write(payload),
        }
    }

    /// `given` is how many of the bytes the packet really had. Without `BOARDS`, a kind that only
    /// boards send is a fault in the first byte.
    pub(crate) fn read<const BOARDS: bool>(
        kind: Kind,
        version: Version,
        payload: &Bytes,
        given: usize,
    ) -> Result<Self, Fault> {
        Ok(match kind {
            Kind::Handshake => Self::Handshake(Handshake::read(version, payload)?),
            Kind::SteerCommand => Self::SteerCommand(SteerCommand::read(version, payload, given)?),
            Kind::Setting => Self::Setting(Setting::read(payload)?),
            Kind::Reset => Self::Reset(ResetOrder::read(payload)?),
            _ if !BOARDS => return Err(Fault { index: 0 }),
            Kind::LineData => Self::Line(LineState::read(version, payload)?),
            Kind::Distance => Self::Distance(Centimetres::read(version, payload)?),
            Kind::RawLine => Self::RawLine(LineBits::read(version, payload, given)?),
            Kind::SteerData => Self::SteerData(SteerData::read(version, payload)?),
            Kind::SettingReply => Self::SettingReply(SettingReply::read(payload)?),
            Kind::ArmData => Self::ArmData(ArmData::read(payload)?),
            Kind::BoardStatus => Self::BoardStatus(BoardStatus::read(payload)?),
            Kind::LineReading => Self::LineReading(LineReading::read(payload)?),
        })
    }
}
