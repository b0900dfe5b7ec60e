//! The UART packets between the two boards and the Raspberry Pi.
//!
//! The same code runs on the boards, in the simulator and in the bridge, so the two ends of a line
//! cannot disagree about a byte. Layout and codes are the original robot's (technical
//! documentation, appendix B.1). Version 1 adds a check value, a reset cause and six kinds.
//!
//! - [`Packet`]: a packet as eleven bytes and back.
//! - [`Decoder`]: finds packets in a stream of bytes, also after noise, by their structure alone.
//! - [`link`]: both ends of the handshake, as state machines.
//! - [`OperatorCommand::firmware`]: the only table from an operator's codes to the board's.
//!
//! It never allocates, never panics on input, never reads a clock and does no input or output.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod arm;
mod board;
mod bytes;
mod coded;
mod command;
mod crc;
mod decoder;
mod handshake;
mod line;
pub mod link;
mod operator;
mod packet;
mod payload;
mod profile;
mod reset;
mod robot;
mod setting;
mod steer;
mod text;

pub use arm::{
    ArmLimits, ArmPose, ArmProfile, ArmProfileError, ArmValues, JointLimits, JointServos,
    LAST_SERVO_ID, LIMP, NO_SERVO, OneOrTwo, REVERSED, ReversedJoints, SERVO_MAX,
};
pub use board::{ArmData, BoardStatus, servo};
pub use bytes::PAYLOAD_LENGTH;
pub use command::{ArmCommand, Command, Speed, WheelCommand};
pub use crc::checksum;
pub use decoder::{Decoder, DecoderCounters};
pub use handshake::{BUILD, Callsign, Handshake, ResetCause, SynAck, Version};
pub use line::{Centimetres, LineBits, LineReading, LineState};
pub use operator::{OperatorArm, OperatorCommand};
pub use packet::{DecodeError, END, MIN_LENGTH, PACKET_LENGTH, Packet, PacketId};
pub use payload::{Kind, Payload};
pub use profile::Profile;
pub use reset::ResetOrder;
pub use robot::{
    DRIVING_DUTIES, FULL_TURNS_MS, IR_MAX, IrModel, LineProfile, OWN_CURVE_CM, RangerProfile,
    RobotProfile, RobotProfileError, SensorProfile, SteeringProfile, WheelsProfile,
};
pub use setting::{Setting, SettingKey, SettingReply, SettingStatus};
pub use steer::{COMMAND_AGE, SteerCommand, SteerData, SteerFlags};
pub use text::{Binary, CodeTextError, parse_code};
