//! [`OperatorCommand`]: the operator's commands, and the only table that turns them into the
//! board's (AMB-1, AMB-2).
//!
//! They are apart because both lists use the codes 1 to 11 for different things. Every command from
//! a person goes through this table. Quarter turns and the delivery drop are not in it.

use crate::command::{ArmCommand, Command, Speed, WheelCommand};

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
    Forward(Speed),
    /// Follow the line forward. Code 3.
    FollowForward,
    /// Straight back. Code 4.
    Backward(Speed),
    /// Follow the line backward. Code 5.
    FollowBackward,
    /// Turn left. Code 6.
    Left(Speed),
    /// Turn right. Code 7.
    Right(Speed),
    /// 45 degrees left. Code 8.
    LeftDiag,
    /// 45 degrees right. Code 9.
    RightDiag,
    /// A step of the arm. Codes 0xF1 to 0xFA.
    Arm(OperatorArm),
}

impl OperatorCommand {
    /// Every command, wheels first, at full speed.
    pub const ALL: [Self; 19] = [
        Self::Stop,
        Self::Forward(Speed::Full),
        Self::FollowForward,
        Self::Backward(Speed::Full),
        Self::FollowBackward,
        Self::Left(Speed::Full),
        Self::Right(Speed::Full),
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

    /// The command with this operator code, at full speed; `None` for codes outside 1 to 9 and 0xF1 to 0xFA.
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Stop,
            2 => Self::Forward(Speed::Full),
            3 => Self::FollowForward,
            4 => Self::Backward(Speed::Full),
            5 => Self::FollowBackward,
            6 => Self::Left(Speed::Full),
            7 => Self::Right(Speed::Full),
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
            Self::Forward(_) => 2,
            Self::FollowForward => 3,
            Self::Backward(_) => 4,
            Self::FollowBackward => 5,
            Self::Left(_) => 6,
            Self::Right(_) => 7,
            Self::LeftDiag => 8,
            Self::RightDiag => 9,
            Self::Arm(arm) => arm.0.code(),
        }
    }

    /// The board's command for it. Only here do operator codes become firmware codes: 7 becomes 9,
    /// 9 becomes 11, and nothing becomes 7 or 10.
    pub const fn firmware(self) -> Command {
        use Speed::{Full, Middle, Slow};
        use WheelCommand::{
            ActiveBackward, ActiveForward, LeftDiag, ManualBackward, ManualForward, ManualLeft,
            ManualRight, MiddleBackward, MiddleForward, MiddleLeft, MiddleRight, RightDiag,
            SlowBackward, SlowForward, SlowLeft, SlowRight, Standby,
        };
        match self {
            Self::Stop => Command::Wheel(Standby),
            Self::Forward(Full) => Command::Wheel(ManualForward),
            Self::Forward(Middle) => Command::Wheel(MiddleForward),
            Self::Forward(Slow) => Command::Wheel(SlowForward),
            Self::FollowForward => Command::Wheel(ActiveForward),
            Self::Backward(Full) => Command::Wheel(ManualBackward),
            Self::Backward(Middle) => Command::Wheel(MiddleBackward),
            Self::Backward(Slow) => Command::Wheel(SlowBackward),
            Self::FollowBackward => Command::Wheel(ActiveBackward),
            Self::Left(Full) => Command::Wheel(ManualLeft),
            Self::Left(Middle) => Command::Wheel(MiddleLeft),
            Self::Left(Slow) => Command::Wheel(SlowLeft),
            Self::Right(Full) => Command::Wheel(ManualRight),
            Self::Right(Middle) => Command::Wheel(MiddleRight),
            Self::Right(Slow) => Command::Wheel(SlowRight),
            Self::LeftDiag => Command::Wheel(LeftDiag),
            Self::RightDiag => Command::Wheel(RightDiag),
            Self::Arm(arm) => Command::Arm(arm.0),
        }
    }

    /// The same command at a speed; `None` if it has no speeds. Those that follow the line, turn by
    /// a fixed angle or stand have none.
    pub const fn at(self, speed: Speed) -> Option<Self> {
        Some(match self {
            Self::Forward(_) => Self::Forward(speed),
            Self::Backward(_) => Self::Backward(speed),
            Self::Left(_) => Self::Left(speed),
            Self::Right(_) => Self::Right(speed),
            _ => return None,
        })
    }

    /// Its speed.
    pub const fn speed(self) -> Speed {
        match self {
            Self::Forward(speed)
            | Self::Backward(speed)
            | Self::Left(speed)
            | Self::Right(speed) => speed,
            _ => Speed::Full,
        }
    }

    /// The name on a command line. Wheel names and arm names are two lists. `left` and `right` are
    /// in both, so the caller must choose the list.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Forward(_) => "forward",
            Self::FollowForward => "follow-forward",
            Self::Backward(_) => "backward",
            Self::FollowBackward => "follow-backward",
            Self::Left(_) => "left",
            Self::Right(_) => "right",
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
