//! The lines that a page and the panel say to each other: the station's extension
//! ([`lager_lines::extension`]) with the robot's name in it, and a few words about the station
//! itself.
//!
//! # Page to panel, one line in a message
//!
//! ```text
//! do <robot> <number> <ms> <action> as in the extension, but `drive` without a time, which is the
//!                                   station's; answered by `answer <number> ...`, once
//! stop <robot> <number>             stand at once; the panel does this before all that waits
//! take <robot> <number>             take the wheel, or ask the person who drives for it
//! free <robot> <number>             leave the wheel; the person who has asked gets it
//! keep <robot> <number>             refuse to hand over the wheel
//! renew <robot> <number>            stop a simulated robot and put it on the delivery node of the
//!                                   warehouse that the station has saved
//! warehouse <number> <json>         describe another warehouse, in the fields of the station's file
//! here <ms>                         the page is there; once a second
//! ```
//!
//! `<ms>` is the time of the page's own clock. The panel refuses an action that arrives too late.
//!
//! # Panel to page, one or more lines in a message
//!
//! ```text
//! you <name> driver|viewer <release>
//!                                   what this page is called and may do, and the release of this
//!                                   program; the first line. A person asks for a name by the socket's
//!                                   address (`/live?name=Anna`)
//! time <ms> [<here>]                the station's clock, in ms since 1970, first and after each `here`,
//!                                   which it then repeats, so that the page knows its round trip
//! warehouse <json>                  the warehouse, or `null`; when it has changed
//! kept <path>                       where the station keeps it
//! about <robot> connected=0|1 speaks=0|1 driver=<name>|- [asks=<name>] uses=<what> renews=0|1
//!       [age_ms=<int>]              which warehouse it uses: `this`, `told` or `driven` (other goods),
//!                                   `floor_before`, `world_before` (simulated), or `-`: not known
//! from <robot> <report>             a line of the extension, `thought <text>`, or `asked <name>
//!                                   <what>`: a person here wants an action or `stop`, has taken the
//!                                   wheel (`take`), asks for it (`ask`), keeps or leaves it (`keep`,
//!                                   `free`), or has described the `warehouse`
//! past <robot> <ms> <report>        the same, from that many ms ago
//! answer <number> done [<reason>{; <reason>}] | stopped <ms> | refused <reason> | lost <reason>
//! ```
//!
//! The page makes a sentence of a reason in its reader's language ([`lager_orders::Reason`]). After
//! `warehouse`, `done` says where the station keeps it, and what robots do that know another
//! warehouse. `lost` means that the robot got the action, and that nobody knows what it did.
//!
//! The panel refuses a line that it cannot read, if the line has a number. It closes a page that
//! goes on like this.

use std::fmt::Display;

use lager_lines::extension::Order;
use lager_lines::{Name, hint};
use lager_orders::lease::COMMAND;
use lager_orders::{Action, Code, Reason};
use lager_plant::Warehouse;

/// What a page says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Said {
    /// Have a robot do something.
    Do {
        robot: Name,
        number: u32,
        /// When it was said, by the page's clock.
        said_ms: u32,
        action: Action,
    },
    /// Stop a robot.
    Stop { robot: Name, number: u32 },
    /// Take the driver's seat of a robot.
    Take { robot: Name, number: u32 },
    /// Leave it.
    Free { robot: Name, number: u32 },
    /// Put a simulated robot into the saved warehouse.
    Renew { robot: Name, number: u32 },
    /// Keep it, whoever asks.
    Keep { robot: Name, number: u32 },
    /// The page is there.
    Here {
        /// When it said so, by its clock.
        said_ms: u32,
    },
    /// Describe the warehouse.
    Warehouse {
        number: u32,
        warehouse: Box<Warehouse>,
    },
}

/// Why the panel cannot read a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Unread {
    /// The line's number, if it could be read.
    pub(crate) number: Option<u32>,
    /// What is wrong with it.
    pub(crate) why: Reason,
}

impl Unread {
    fn new(number: Option<u32>, why: impl Display) -> Self {
        let why = Reason::new(Code::Misread, &[&why]);
        Self { number, why }
    }
}

/// Reads a line of a page.
///
/// # Errors
///
/// When it is none.
pub(crate) fn read(line: &str) -> Result<Said, Unread> {
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    match word {
        "warehouse" => read_warehouse(rest),
        "here" => Ok(Said::Here {
            said_ms: read_number(rest)?,
        }),
        "do" | "stop" | "take" | "free" | "keep" | "renew" => read_for_robot(word, rest),
        _ => Err(Unread::new(
            None,
            "a page says do, stop, take, free, keep, renew, warehouse or here",
        )),
    }
}

fn read_warehouse(rest: &str) -> Result<Said, Unread> {
    let (number, json) = rest.split_once(' ').unwrap_or((rest, ""));
    let number = read_number(number)?;
    let warehouse = serde_json::from_str(json).map_err(|error: serde_json::Error| {
        let hint = hint(&error.to_string());
        let why = Reason::new(Code::NoWarehouse, &[&format!("{error}{hint}")]);
        Unread {
            number: Some(number),
            why,
        }
    })?;
    Ok(Said::Warehouse {
        number,
        warehouse: Box::new(warehouse),
    })
}

fn read_for_robot(word: &str, rest: &str) -> Result<Said, Unread> {
    let (robot, rest) = rest.split_once(' ').unwrap_or((rest, ""));
    let (number, action) = rest.split_once(' ').unwrap_or((rest, ""));
    let number = read_number(number)?;
    let robot = Name::new(robot).map_err(|error| Unread::new(Some(number), error))?;
    if word == "do" {
        let (said_ms, action) = action.split_once(' ').unwrap_or((action, ""));
        let said_ms = said_ms.parse().map_err(|_| {
            Unread::new(
                Some(number),
                "the page's time in ms belongs before the action",
            )
        })?;
        let lease = match action.starts_with("drive ") {
            true => format!(" {}", COMMAND.as_millis()),
            false => String::new(),
        };
        return match Order::read(&format!("do {number} {action}{lease}")) {
            // How late it is, nobody says but the panel.
            Some(Ok(Order::Do {
                number,
                late_ms: 0,
                action,
            })) => Ok(Said::Do {
                robot,
                number,
                said_ms,
                action,
            }),
            Some(Err(error)) => Err(Unread::new(Some(number), error)),
            _ => Err(Unread::new(Some(number), "this is no action")),
        };
    }
    // A stop is one whatever stands behind it.
    match (word, action) {
        ("stop", _) => Ok(Said::Stop { robot, number }),
        ("take", "") => Ok(Said::Take { robot, number }),
        ("free", "") => Ok(Said::Free { robot, number }),
        ("keep", "") => Ok(Said::Keep { robot, number }),
        ("renew", "") => Ok(Said::Renew { robot, number }),
        _ => Err(Unread::new(
            Some(number),
            "nothing belongs behind the number",
        )),
    }
}

fn read_number(text: &str) -> Result<u32, Unread> {
    text.parse()
        .map_err(|_| Unread::new(None, "a number from 0 to 4294967295 belongs here"))
}

#[cfg(test)]
mod tests {
    use lager_lines::extension::Spelled;

    use super::*;

    #[test]
    fn an_action_is_the_extensions() {
        let Ok(Said::Do {
            robot,
            number: 5,
            said_ms: 70_000,
            action,
        }) = read("do r1 5 70000 drive 2")
        else {
            panic!();
        };
        assert_eq!(robot, Name::new("r1").unwrap());
        assert_eq!(Spelled(&action).to_string(), "drive 00000010 150");
    }

    #[test]
    fn what_is_none_says_why_and_whose() {
        let why = |line| read(line).unwrap_err();
        assert_eq!(why("do r1 5 0 fly").number, Some(5));
        assert!(why("do r1 5 0 fly").why.as_str().contains("one of order"));
        assert!(why("do r1 5 resume 7").why.as_str().contains("time in ms"));
        assert_eq!(why("do r1 x 0 resume 7").number, None);
        assert_eq!(why("do R! 5 0 resume 7").number, Some(5));
        assert_eq!(why("here").number, None);
        assert_eq!(why("take r1 5 6").number, Some(5));
        assert!(why("hello").why.as_str().contains("warehouse"));
        assert_eq!(why("").number, None);
        let wrong = why("warehouse 7 {\"size\":[2,2]}");
        assert_eq!(wrong.number, Some(7));
        assert!(wrong.why.as_str().contains("side_length_cm"), "{wrong:?}");
    }

    #[test]
    fn a_stop_is_read_whatever_stands_behind_it() {
        assert!(matches!(
            read("stop r1 5 please"),
            Ok(Said::Stop { number: 5, .. })
        ));
    }

    #[test]
    fn a_warehouse_is_the_files() {
        let line = r#"warehouse 7 {"size":[2,3],"side_length_cm":40,"product":[{"id":1,"square":[0,0],"side":"up"}],"exit":{"length_cm":80}}"#;
        let Ok(Said::Warehouse { warehouse, .. }) = read(line) else {
            panic!();
        };
        assert_eq!((warehouse.size.x, warehouse.size.y), (2, 3));
        assert_eq!(warehouse.products.len(), 1);
        assert_eq!(warehouse.exit.length_cm, 80);
        let Err(unread) = read(&line.replace("side\":", "sied\":")) else {
            panic!("a mistyped key is taken");
        };
        assert!(
            unread.why.as_str().ends_with("; did you mean `side`?"),
            "{unread:?}"
        );
    }
}
