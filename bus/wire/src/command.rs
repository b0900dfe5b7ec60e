//! [`Command`]: the steering board's own commands, by the codes of its header (K, styrenhet.h).
//!
//! They are apart from the operator's commands because the same byte means different things in the
//! two lists: 7 is "right" to an operator and a quarter turn left to the board (AMB-2).

use crate::coded::coded;

coded! {
    /// How fast a person drives.
    pub enum Speed {
        /// As fast as the robot drives by itself.
        Full = 0,
        /// A quarter of that.
        Slow = 1,
        /// Half of that.
        Middle = 2,
    }
}

impl Speed {
    /// The word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Slow => "slow",
            Self::Middle => "middle",
            Self::Full => "full",
        }
    }

    /// The speed with this word.
    pub fn from_word(word: &str) -> Option<Self> {
        let mut all = Self::ALL.iter().copied();
        all.find(|speed| speed.as_str() == word)
    }
}

coded! {
    /// A command to the wheels; the high nibble of its code is 0 (T3). Only boards of this project
    /// have the codes with 1 and 2 there: the [`Speed`] of the command in the low nibble.
    pub enum WheelCommand {
        /// Stand still. The arm may move only in this state (T4).
        Standby = 1,
        /// Straight ahead without looking at the line.
        ManualForward = 2,
        /// Follow the line forward.
        ActiveForward = 3,
        /// Straight back without looking at the line.
        ManualBackward = 4,
        /// Follow the line backward.
        ActiveBackward = 5,
        /// Turn left until another command comes.
        ManualLeft = 6,
        /// A quarter turn left, once. Only the logic unit may command it.
        LeftPerp = 7,
        /// 45 degrees left, once.
        LeftDiag = 8,
        /// Turn right until another command comes.
        ManualRight = 9,
        /// A quarter turn right, once. Only the logic unit may command it.
        RightPerp = 10,
        /// 45 degrees right, once.
        RightDiag = 11,
        /// Straight ahead, slowly.
        SlowForward = 0x12,
        /// Straight back, slowly.
        SlowBackward = 0x14,
        /// Turn left, slowly.
        SlowLeft = 0x16,
        /// Turn right, slowly.
        SlowRight = 0x19,
        /// Straight ahead at the middle speed.
        MiddleForward = 0x22,
        /// Straight back at the middle speed.
        MiddleBackward = 0x24,
        /// Turn left at the middle speed.
        MiddleLeft = 0x26,
        /// Turn right at the middle speed.
        MiddleRight = 0x29,
    }
}

impl WheelCommand {
    /// The same command at full speed.
    #[must_use]
    pub const fn at_full(self) -> Self {
        match self {
            Self::SlowForward | Self::MiddleForward => Self::ManualForward,
            Self::SlowBackward | Self::MiddleBackward => Self::ManualBackward,
            Self::SlowLeft | Self::MiddleLeft => Self::ManualLeft,
            Self::SlowRight | Self::MiddleRight => Self::ManualRight,
            full => full,
        }
    }

    /// Its speed. Commands that are not given by hand have no other speed than the full one.
    pub const fn speed(self) -> Speed {
        match self.code() >> 4 {
            1 => Speed::Slow,
            2 => Speed::Middle,
            _ => Speed::Full,
        }
    }

    /// Whether it runs once and ends by itself. Otherwise it is a setpoint that holds.
    pub const fn is_one_shot(self) -> bool {
        matches!(
            self,
            Self::LeftPerp | Self::LeftDiag | Self::RightPerp | Self::RightDiag
        )
    }
}

coded! {
    /// One step of the arm; the high nibble of the code is F (T3).
    pub enum ArmCommand {
        /// Turn the gripper clockwise.
        Clockwise = 0xF1,
        /// Turn the gripper counter-clockwise.
        CounterClockwise = 0xF2,
        /// Draw the arm in.
        In = 0xF3,
        /// Reach out.
        Out = 0xF4,
        /// Raise the arm.
        Up = 0xF5,
        /// Lower the arm.
        Down = 0xF6,
        /// Swing the arm left.
        Left = 0xF7,
        /// Swing the arm right.
        Right = 0xF8,
        /// Close the gripper until it holds something (AMB-29).
        Squeeze = 0xF9,
        /// Open the gripper.
        Release = 0xFA,
        /// The delivery sequence: lower, open, back up. Only the logic unit may command it
        /// (AMB-27).
        Drop = 0xFB,
    }
}

/// A command as the steering board executes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Command {
    /// For the wheels.
    Wheel(WheelCommand),
    /// For the arm.
    Arm(ArmCommand),
}

impl Command {
    /// The command with this firmware code; `None` for codes that are in no list (AMB-52).
    pub const fn from_code(code: u8) -> Option<Self> {
        if let Some(wheel) = WheelCommand::from_code(code) {
            Some(Self::Wheel(wheel))
        } else if let Some(arm) = ArmCommand::from_code(code) {
            Some(Self::Arm(arm))
        } else {
            None
        }
    }

    /// The firmware code: 1 to 11 for the wheels, 0xF1 to 0xFB for the arm.
    pub const fn code(self) -> u8 {
        match self {
            Self::Wheel(wheel) => wheel.code(),
            Self::Arm(arm) => arm.code(),
        }
    }

    /// Whether it runs once and reports its end, as timed turns and all arm commands do. Otherwise
    /// it is a setpoint that holds.
    pub const fn is_one_shot(self) -> bool {
        match self {
            Self::Wheel(wheel) => wheel.is_one_shot(),
            Self::Arm(_) => true,
        }
    }
}
