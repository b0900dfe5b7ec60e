//! [`Step`] and [`Question`]: what is found out, one after the other.
//!
//! Each step rests on those before it: the line is followed by sensors that are known, and times are
//! taken when the motors are known and the battery does not change the speed. Of the arm, a person's
//! hand shows everything before a servo moves.

use lager_orders::Language;

use crate::words::Said;

/// What is found out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// Whether both boards are there and fit this program.
    Boards,
    /// Thresholds and polarity of the line sensors.
    Line,
    /// The model of the distance sensor.
    Distance,
    /// Which motor is which, and which way is forwards.
    Wheels,
    /// Whether the battery is measured.
    Battery,
    /// How long a full turn takes.
    Turn,
    /// How fast the robot drives.
    Speed,
    /// Which servos move the arm's joints, which way they count, and how far they may go.
    Arm,
    /// The arm's poses.
    Poses,
    /// Whether each joint goes the right way by itself.
    Joints,
    /// How far the claw closes, and how hard.
    Claw,
    /// Which lines the robot's own buttons are at, and how each of them works.
    Buttons,
    /// Whether it is saved.
    Finish,
}

impl Step {
    /// All steps, in their order.
    pub const ALL: [Self; 13] = [
        Self::Boards,
        Self::Line,
        Self::Distance,
        Self::Wheels,
        Self::Battery,
        Self::Turn,
        Self::Speed,
        Self::Arm,
        Self::Poses,
        Self::Joints,
        Self::Claw,
        Self::Buttons,
        Self::Finish,
    ];

    /// The question with which it begins.
    pub const fn first(self) -> Question {
        match self {
            Self::Boards => Question::Boards,
            Self::Line => Question::LineSway,
            Self::Distance => Question::RangeFar,
            Self::Wheels => Question::WheelsAhead,
            Self::Battery => Question::Battery,
            Self::Turn => Question::Turn,
            Self::Speed => Question::Speed,
            Self::Arm => Question::Arm,
            Self::Poses => Question::Poses,
            Self::Joints => Question::JointMoves,
            Self::Claw => Question::ClawEmpty,
            Self::Buttons => Question::ButtonsFree,
            Self::Finish => Question::Finish,
        }
    }

    /// The next step; the last one has none but itself.
    pub(crate) fn next(self) -> Self {
        Self::ALL[(self as usize + 1).min(Self::ALL.len() - 1)]
    }

    /// The step before; the first one has none but itself.
    pub(crate) fn before(self) -> Self {
        Self::ALL[(self as usize).saturating_sub(1)]
    }
}

/// What a question takes for an answer, beside the words that lead from step to step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Takes {
    /// Yes or no.
    Yes,
    /// A number, or no.
    Number,
    /// The ways of the left and the right wheels.
    Ways,
    /// The person holds the button, again and again, and then yes or no.
    Hold,
}

/// What a person is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(
    missing_docs,
    reason = "the table of sentences says what each one asks"
)]
pub enum Question {
    Boards,
    LineSway,
    LineFloor,
    LineTape,
    RangeFar,
    RangeNear,
    WheelsAhead,
    SawAhead,
    WheelsLeft,
    SawLeft,
    Battery,
    Turn,
    TurnRound,
    Speed,
    SpeedThere,
    Arm,
    JointEnd,
    Poses,
    PoseReach,
    PoseCarry,
    PoseDrop,
    PoseNeutral,
    JointMoves,
    ClawEmpty,
    ClawFull,
    ButtonsFree,
    ResetButton,
    ModeSwitch,
    SwitchAutonomous,
    Finish,
}

impl Question {
    /// All questions, in their order.
    pub const ALL: [Self; 30] = [
        Self::Boards,
        Self::LineSway,
        Self::LineFloor,
        Self::LineTape,
        Self::RangeFar,
        Self::RangeNear,
        Self::WheelsAhead,
        Self::SawAhead,
        Self::WheelsLeft,
        Self::SawLeft,
        Self::Battery,
        Self::Turn,
        Self::TurnRound,
        Self::Speed,
        Self::SpeedThere,
        Self::Arm,
        Self::JointEnd,
        Self::Poses,
        Self::PoseReach,
        Self::PoseCarry,
        Self::PoseDrop,
        Self::PoseNeutral,
        Self::JointMoves,
        Self::ClawEmpty,
        Self::ClawFull,
        Self::ButtonsFree,
        Self::ResetButton,
        Self::ModeSwitch,
        Self::SwitchAutonomous,
        Self::Finish,
    ];

    /// What is asked, in this language.
    pub fn text(self, language: Language) -> String {
        Said::from(self.sentence()).text(language)
    }

    pub(crate) const fn sentence(self) -> &'static str {
        match self {
            Self::Boards => "ask_boards",
            Self::LineSway => "ask_line_sway",
            Self::LineFloor => "ask_line_floor",
            Self::LineTape => "ask_line_tape",
            Self::RangeFar => "ask_range_far",
            Self::RangeNear => "ask_range_near",
            Self::WheelsAhead => "ask_wheels_ahead",
            Self::SawAhead => "ask_saw_ahead",
            Self::WheelsLeft => "ask_wheels_left",
            Self::SawLeft => "ask_saw_left",
            Self::Battery => "ask_battery",
            Self::Turn => "ask_turn",
            Self::TurnRound => "ask_turn_round",
            Self::Speed => "ask_speed",
            Self::SpeedThere => "ask_speed_there",
            Self::Arm => "ask_arm",
            Self::JointEnd => "ask_joint_end",
            Self::Poses => "ask_poses",
            Self::PoseReach => "ask_pose_reach",
            Self::PoseCarry => "ask_pose_carry",
            Self::PoseDrop => "ask_pose_drop",
            Self::PoseNeutral => "ask_pose_neutral",
            Self::JointMoves => "ask_joint_moves",
            Self::ClawEmpty => "ask_claw_empty",
            Self::ClawFull => "ask_claw_full",
            Self::ButtonsFree => "ask_buttons_free",
            Self::ResetButton => "ask_reset_button",
            Self::ModeSwitch => "ask_mode_switch",
            Self::SwitchAutonomous => "ask_switch_autonomous",
            Self::Finish => "ask_finish",
        }
    }

    /// What it takes for an answer.
    pub const fn takes(self) -> Takes {
        match self {
            Self::RangeFar | Self::RangeNear | Self::Battery | Self::Speed => Takes::Number,
            Self::SawAhead | Self::SawLeft => Takes::Ways,
            Self::JointMoves | Self::ClawEmpty | Self::ClawFull => Takes::Hold,
            _ => Takes::Yes,
        }
    }
}
