//! What comm tells the station without being asked: thoughts, nodes and headings (G9, C8, L500).
//!
//! Node and heading are said when they change, and anew to every peer.

use lager_lines::conversation::RobotLine;
use lager_lines::gag::{Request, Telemetry};
use lager_lines::{Coord, Direction, MAX_LINE, Text};

/// What the peer was told last.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Told {
    node: Option<Coord>,
    looks: Option<Direction>,
}

impl Told {
    /// That the robot goes to `node`, if that is news.
    pub(crate) fn node(&mut self, node: Coord) -> Option<RobotLine> {
        (self.node.replace(node) != Some(node)).then(|| telemetry(Telemetry::Robot(node)))
    }

    /// That it looks to `looks`, if that is news.
    pub(crate) fn looks(&mut self, looks: Direction) -> Option<RobotLine> {
        (self.looks.replace(looks) != Some(looks)).then(|| telemetry(Telemetry::Heading(looks)))
    }
}

/// A sentence, cut to what a line can carry.
pub(crate) fn thought(sentence: &str) -> RobotLine {
    telemetry(Telemetry::Thought(cut(sentence, "thought ".len())))
}

/// Why an action is refused, likewise.
pub(crate) fn reason(sentence: &str) -> Text {
    cut(sentence, "refused 4294967295 ".len())
}

/// One line of a sentence that fits behind `before` bytes.
fn cut(sentence: &str, before: usize) -> Text {
    let mut one_line = sentence.replace(['\r', '\n'], " ");
    let most = MAX_LINE - before;
    if one_line.len() > most {
        let end = (0..=most).rev().find(|end| one_line.is_char_boundary(*end));
        one_line.truncate(end.unwrap_or(0));
    }
    Text::new(one_line).unwrap_or_default()
}

fn telemetry(telemetry: Telemetry) -> RobotLine {
    RobotLine::Request(Request::Telemetry(telemetry))
}
