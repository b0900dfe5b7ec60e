//! [`Reason`]: why something is not done, or how it ended, as a code with values.
//!
//! A reason travels as text, on a line or to a page. The program that shows it makes a sentence
//! from it in the reader's language:
//!
//! ```text
//! late 340                              came 340 ms late; give it anew
//! not_possible forward refusal_no_board forward is not possible now: no steering board is connected
//! ```
//!
//! The values have the order in which the English sentence uses them first. The last value is the
//! rest of the line, so it may be a reason itself. In all others a blank is written `%20`.

use alloc::format;
use alloc::string::{String, ToString};
use core::fmt::{self, Display, Write};

use lager_floor::{FloorError, Node};

use crate::lease::TooLate;
use crate::sentence::{Language, Sentence};

/// The codes that programs give directly. Each is a name in the table of sentences.
macro_rules! codes {
    ($( $code:ident = $name:literal, )*) => {
        /// Why something is not done, or how it ended. Each code is a sentence of the table.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs, reason = "the table of sentences says what each one means")]
        pub enum Code {
            $( $code, )*
        }

        impl Code {
            /// Every code.
            pub const ALL: &[Self] = &[$( Self::$code, )*];

            /// Its name in the table.
            pub const fn as_str(self) -> &'static str {
                match self {
                    $( Self::$code => $name, )*
                }
            }
        }
    };
}

codes! {
    Misread = "misread",
    LateAnswer = "late_answer",
    OnlyLooks = "only_looks",
    NotDriver = "not_driver",
    Late = "late",
    AskedAnew = "asked_anew",
    WheelAsked = "wheel_asked",
    WheelKept = "wheel_kept",
    WheelUnanswered = "wheel_unanswered",
    AskDriver = "ask_driver",
    Driven = "driven",
    RobotSilent = "robot_silent",
    SaveFailed = "save_failed",
    SaveUnreadable = "save_unreadable",
    SavedIn = "saved_in",
    SavedNowhere = "saved_nowhere",
    UsesThis = "uses_this",
    UsesTold = "uses_told",
    UsesDriven = "uses_driven",
    UsesFloorBefore = "uses_floor_before",
    UsesWorldBefore = "uses_world_before",
    FloorUnfit = "floor_unfit",
    FloorElsewhere = "floor_elsewhere",
    Ordered = "ordered",
    Gone = "gone",
    ProductsFull = "products_full",
    NotQueued = "not_queued",
    Unsaved = "unsaved",
    PageSilent = "page_silent",
    NumberUsed = "number_used",
    NotLines = "not_lines",
    OtherLanguage = "other_language",
    NoToken = "no_token",
    OtherHost = "other_host",
    OtherPage = "other_page",
    NoFile = "no_file",
    PagesFull = "pages_full",
    NoHistory = "no_history",
    HistoryBusy = "history_busy",
    TooMuch = "too_much",
    DriverOnly = "driver_only",
    Plain = "plain",
    ActsFull = "acts_full",
    NotAsked = "not_asked",
    CommandsFull = "commands_full",
    NoRobot = "no_robot",
    NoWarehouse = "no_warehouse",
    FloorSize = "floor_size",
    FloorDelivery = "floor_delivery",
    FloorSide = "floor_side",
    ProductNegative = "product_negative",
    ProductOutside = "product_outside",
    ProductTwice = "product_twice",
    NameNumber = "name_number",
    NameUnfit = "name_unfit",
    NameTwice = "name_twice",
    GoodsLine = "goods_line",
    GoodsMost = "goods_most",
    Stopped = "stopped",
    LinkLost = "link_lost",
    HeldUp = "held_up",
    PeerSilent = "peer_silent",
    DriveOver = "drive_over",
    ModeChanged = "mode_changed",
    Replaced = "replaced",
    LinesUnread = "lines_unread",
    HelloFirst = "hello_first",
    NoProduct = "no_product",
    OnlyArm = "only_arm",
    WithStop = "with_stop",
    TasksFull = "tasks_full",
    OrderZero = "order_zero",
    OrderThere = "order_there",
    OrderUnderWay = "order_under_way",
    OrderHeld = "order_held",
    OrderUnknown = "order_unknown",
    NotPicking = "not_picking",
    NothingPicked = "nothing_picked",
    Moving = "moving",
    OrderUntaken = "order_untaken",
    LogicSilent = "logic_silent",
    CancelUnheard = "cancel_unheard",
    CalibrationSilent = "calibration_silent",
    CalibrationPartly = "calibration_partly",
    CalibrationBroken = "calibration_broken",
    NewerStop = "newer_stop",
    NewerStopBy = "newer_stop_by",
    BridgeUnknown = "bridge_unknown",
    WorldSilent = "world_silent",
    TooMuchAsked = "too_much_asked",
    NotRunning = "not_running",
    Unanswered = "unanswered",
    NotPossible = "not_possible",
    Refused = "refused",
    OverHeldUp = "over_held_up",
    OverUnheard = "over_unheard",
    Endless = "endless",
}

/// A code with its values, as it is written in a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reason(String);

impl Reason {
    /// `code` with `values`, in the order in which the English sentence uses them.
    pub fn new(code: Code, values: &[&dyn Display]) -> Self {
        let mut left = values.iter();
        Self::of(code.as_str(), |_| left.next().map(ToString::to_string))
    }

    /// The sentence `name` of the table. `value` gives each value by its key.
    pub fn of(name: &str, mut value: impl FnMut(&str) -> Option<String>) -> Self {
        let mut line = String::from(name);
        let mut keys = Sentence::of(name)
            .into_iter()
            .flat_map(Sentence::keys)
            .peekable();
        while let Some(key) = keys.next() {
            let value = value(key).unwrap_or_default();
            line.push(' ');
            line.push_str(&match keys.peek() {
                None => value.replace(['\r', '\n'], " "),
                Some(_) => value.replace('%', "%25").replace([' ', '\r', '\n'], "%20"),
            });
        }
        Self(line)
    }

    /// A reason from a line. Text that is no code is shown as it is.
    pub fn read(line: &str) -> Self {
        Self(line.into())
    }

    /// The reason as it is written in a line.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The name of its sentence.
    pub fn code(&self) -> &str {
        self.0.split(' ').next().unwrap_or("")
    }

    /// The sentence, in this language.
    pub fn sentence(&self, language: Language) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = put(&self.0, language, &mut text);
        text
    }
}

impl Display for Reason {
    /// The English sentence.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        put(&self.0, Language::English, formatter)
    }
}

impl core::error::Error for Reason {}

impl From<Code> for Reason {
    fn from(code: Code) -> Self {
        Self::new(code, &[])
    }
}

impl fmt::Display for TooLate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Reason::from(*self).fmt(formatter)
    }
}

impl core::error::Error for TooLate {}

impl From<TooLate> for Reason {
    fn from(TooLate(late): TooLate) -> Self {
        Self::new(Code::Late, &[&late.as_millis()])
    }
}

impl From<FloorError> for Reason {
    fn from(error: FloorError) -> Self {
        let pair = |node: Node| format!("{}, {}", node.x, node.y);
        match error {
            FloorError::Size { size } => Self::new(Code::FloorSize, &[&size.x, &size.y]),
            FloorError::Side { cm } => Self::new(Code::FloorSide, &[&cm]),
            FloorError::Delivery { size, delivery } => {
                let corners = [(0, 0), (0, size.y), (size.x, 0), (size.x, size.y)];
                let [a, b, c, d] = corners.map(|(x, y)| pair(Node::new(x, y)));
                Self::new(Code::FloorDelivery, &[&pair(delivery), &a, &b, &c, &d])
            }
            FloorError::TooManyProducts { count } => Self::new(Code::GoodsMost, &[&count]),
            FloorError::ProductNegative { number } => Self::new(Code::ProductNegative, &[&number]),
            FloorError::ProductTwice { id, .. } => Self::new(Code::ProductTwice, &[&id]),
            FloorError::ProductOutside { id, square, size } => {
                let last = Node::new(size.x - 1, size.y - 1);
                let values: [&dyn Display; 3] = [&id, &pair(square), &pair(last)];
                Self::new(Code::ProductOutside, &values)
            }
        }
    }
}

fn put(line: &str, language: Language, to: &mut dyn Write) -> fmt::Result {
    let (name, values) = line.split_once(' ').unwrap_or((line, ""));
    let Some(sentence) = Sentence::of(name) else {
        return to.write_str(line);
    };
    let count = sentence.keys().count();
    sentence.put(language, to, &mut |key, to| {
        let place = sentence.keys().position(|other| other == key).unwrap_or(0);
        let value = values.splitn(count, ' ').nth(place).unwrap_or("");
        let value = match place + 1 == count {
            true => value.into(),
            false => value.replace("%20", " ").replace("%25", "%"),
        };
        match key {
            "why" => put(&value, language, to),
            "command" => match Sentence::of(&command(&value)) {
                Some(name) => name.put(language, to, &mut |_, _| Ok(())),
                None => to.write_str(&value),
            },
            _ => to.write_str(&value),
        }
    })
}

/// The name of a command's own sentence.
fn command(name: &str) -> String {
    ["command_", name].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_floor_that_cannot_be_is_told_with_what_can() {
        let node = Node::new;
        let size = node(3, 2);
        let sentences = [
            (
                FloorError::Size { size: node(2, 100) },
                "the size is 2 x 100 squares; each must be from 1 to 99",
            ),
            (
                FloorError::Delivery {
                    size,
                    delivery: node(1, 0),
                },
                "the delivery is at (1, 0), which is no corner of the floor; its corners are (0, 0), \
                 (0, 2), (3, 0) and (3, 2)",
            ),
            (
                FloorError::Side { cm: 39 },
                "a square's side is 39 cm; it must be from 40 to 500 cm",
            ),
            (
                FloorError::ProductNegative { number: -1 },
                "goods -1 have a negative number; numbers start at 0",
            ),
            (
                FloorError::TooManyProducts { count: 257 },
                "the warehouse has 257 goods; at most 256 fit",
            ),
            (
                FloorError::ProductTwice { id: 7, index: 1 },
                "goods 7 are listed twice; all goods need a number of their own",
            ),
            (
                FloorError::ProductOutside {
                    id: 7,
                    square: node(3, 0),
                    size,
                },
                "goods 7 stand in the square (3, 0), but the last one is (2, 1)",
            ),
        ];
        for (error, sentence) in sentences {
            let reason = Reason::from(error);
            assert_eq!(reason.to_string(), sentence);
            assert_ne!(reason.sentence(Language::Swedish), sentence);
        }
    }
}
