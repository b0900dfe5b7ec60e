//! Comm's lines that answer no question: thoughts, nodes and headings (G9, C8).
//!
//! It sends node and heading when they change, and again to every new peer.

use lager_floor::{Heading, Node};
use lager_lines::conversation::RobotLine;
use lager_lines::gag::{Request, Telemetry};
use lager_lines::{MAX_LINE, Text};
use lager_orders::Reason;

/// The last node and heading that the peer was told.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Told {
    node: Option<Node>,
    looks: Option<Heading>,
}

impl Told {
    /// The line that the robot goes to `node`, if that is news.
    pub(crate) fn node(&mut self, node: Node) -> Option<RobotLine> {
        (self.node.replace(node) != Some(node)).then(|| telemetry(Telemetry::Robot(node)))
    }

    /// The line that it looks to `looks`, if that is news.
    pub(crate) fn looks(&mut self, looks: Heading) -> Option<RobotLine> {
        (self.looks.replace(looks) != Some(looks)).then(|| telemetry(Telemetry::Heading(looks)))
    }
}

/// A sentence, cut to the length of a line.
pub(crate) fn thought(sentence: &str) -> RobotLine {
    telemetry(Telemetry::Thought(cut(sentence, "thought ".len())))
}

/// A reason, cut to the length of a line.
pub(crate) fn reason(reason: &Reason) -> Reason {
    Reason::read(cut(reason.as_str(), "refused 4294967295 ".len()).as_str())
}

/// The part of a sentence that fits into a line after `before` bytes.
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
