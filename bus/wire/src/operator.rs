//! [`OperatorCommand`]: the operator's commands, and the only table that turns them into the
//! board's (AMB-1, AMB-2).
//!
//! They are apart because both lists use the codes 1 to 11 for different things. Every command from
//! a person goes through this table. Quarter turns and the delivery drop are not in it.

use crate::command::{ArmCommand, Command, WheelCommand};

/// An arm command that an operator may give: each one but the delivery drop (AMB-27).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OperatorArm(ArmCommand);

impl OperatorArm {
    /// The command, unless it is the delivery drop.
    pub const fn new(command: ArmCommand) -> Option<Self> {
        match command {
            ArmCommand::Drop => None,
            _ => Some(Self(command)),
        }
    }

    /// The board's command.
    pub const fn get(self) -> ArmCommand {
        self.0
    }
}

/// A command as an operator gives it; the codes are those of the operator's panel (3.3.1, 3.3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OperatorCommand {
    /// Stand still. Code 1.
    Stop,
    /// Straight ahead. Code 2.
    Forward,
    /// Follow the line forward. Code 3.
    FollowForward,
    /// Straight back. Code 4.
    Backward,
    /// Follow the line backward. Code 5.
    FollowBackward,
    /// Turn left. Code 6.
    Left,
    /// Turn right. Code 7.
    Right,
    /// 45 degrees left. Code 8.
    LeftDiag,
    /// 45 degrees right. Code 9.
    RightDiag,
    /// A step of the arm. Codes 0xF1 to 0xFA.
    Arm(OperatorArm),
}

impl OperatorCommand {
    /// Every command, wheels first.
    pub const ALL: [Self; 19] = [
        Self::Stop,
        Self::Forward,
        Self::FollowForward,
        Self::Backward,
        Self::FollowBackward,
        Self::Left,
        Self::Right,
        Self::LeftDiag,
        Self::RightDiag,
        Self::Arm(OperatorArm(ArmCommand::Clockwise)),
        Self::Arm(OperatorArm(ArmCommand::CounterClockwise)),
        Self::Arm(OperatorArm(ArmCommand::In)),
        Self::Arm(OperatorArm(ArmCommand::Out)),
        Self::Arm(OperatorArm(ArmCommand::Up)),
        Self::Arm(OperatorArm(ArmCommand::Down)),
        Self::Arm(OperatorArm(ArmCommand::Left)),
        Self::Arm(OperatorArm(ArmCommand::Right)),
        Self::Arm(OperatorArm(ArmCommand::Squeeze)),
        Self::Arm(OperatorArm(ArmCommand::Release)),
    ];

    /// The command with this operator code; `None` for codes outside 1 to 9 and 0xF1 to 0xFA.
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Stop,
            2 => Self::Forward,
            3 => Self::FollowForward,
            4 => Self::Backward,
            5 => Self::FollowBackward,
            6 => Self::Left,
            7 => Self::Right,
            8 => Self::LeftDiag,
            9 => Self::RightDiag,
            _ => match ArmCommand::from_code(code) {
                Some(ArmCommand::Drop) | None => return None,
                Some(arm) => Self::Arm(OperatorArm(arm)),
            },
        })
    }

    /// The operator code.
    pub const fn code(self) -> u8 {
        match self {
            Self::Stop => 1,
            Self::Forward => 2,
            Self::FollowForward => 3,
            Self::Backward => 4,
            Self::FollowBackward => 5,
            Self::Left => 6,
            Self::Right => 7,
            Self::LeftDiag => 8,
            Self::RightDiag => 9,
            Self::Arm(arm) => arm.0.code(),
        }
    }

    /// The board's command for it. Only here do operator codes become firmware codes: 7 becomes 9,
    /// 9 becomes 11, and nothing becomes 7 or 10.
    pub const fn firmware(self) -> Command {
        match self {
            Self::Stop => Command::Wheel(WheelCommand::Standby),
            Self::Forward => Command::Wheel(WheelCommand::ManualForward),
            Self::FollowForward => Command::Wheel(WheelCommand::ActiveForward),
            Self::Backward => Command::Wheel(WheelCommand::ManualBackward),
            Self::FollowBackward => Command::Wheel(WheelCommand::ActiveBackward),
            Self::Left => Command::Wheel(WheelCommand::ManualLeft),
            Self::Right => Command::Wheel(WheelCommand::ManualRight),
            Self::LeftDiag => Command::Wheel(WheelCommand::LeftDiag),
            Self::RightDiag => Command::Wheel(WheelCommand::RightDiag),
            Self::Arm(arm) => Command::Arm(arm.0),
        }
    }

    /// The name on a command line. Wheel names and arm names are two lists. `left` and `right` are
    /// in both, so the caller must choose the list.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Forward => "forward",
            Self::FollowForward => "follow-forward",
            Self::Backward => "backward",
            Self::FollowBackward => "follow-backward",
            Self::Left => "left",
            Self::Right => "right",
            Self::LeftDiag => "left-diag",
            Self::RightDiag => "right-diag",
            Self::Arm(arm) => match arm.0 {
                ArmCommand::Clockwise => "clockwise",
                ArmCommand::CounterClockwise => "counter-clockwise",
                ArmCommand::In => "in",
                ArmCommand::Out => "out",
                ArmCommand::Up => "up",
                ArmCommand::Down => "down",
                ArmCommand::Left => "left",
                ArmCommand::Right => "right",
                ArmCommand::Squeeze => "squeeze",
                ArmCommand::Release => "release",
                ArmCommand::Drop => "drop",
            },
        }
    }

    /// The wheel command with this name.
    pub fn wheel(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|command| !matches!(command, Self::Arm(_)) && command.name() == name)
    }

    /// The arm command with this name.
    pub fn arm(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|command| matches!(command, Self::Arm(_)) && command.name() == name)
    }
}
