//! The robot's place: the node that it passed last, its heading, and other places where it may be
//! since a turn was disturbed.
//!
//! If a turn was cut short, or its reports were lost, the navigator judges its end by dead
//! reckoning and by the tape under the sensors. But one tape looks like another, and the robot may
//! have turned a quarter or two more. So it drives on in the heading that it believes and remembers
//! the other possible headings. It compares each mark with all of them. A heading that the mark
//! does not fit is dropped. If the mark fits another heading better than the believed one, the
//! navigator believes that one:
//!
//! ```text
//!   a disturbed turn ends        a mark that fits          a mark that fits another better
//!   ---------------------> doubt -----------------> less ----------------------------> that one
//!        others where there is tape     doubt     doubt                             believed now
//! ```
//!
//! The angle between the other headings and the believed one never changes, so only their nodes are
//! state. This file never turns the robot. The planner does, from the node that the navigator
//! believes now.

use lager_floor::{Heading, Node, Spin};
use lager_topics::NavigatorStatus;

use crate::judge::{EdgeMarks, Verdict, judge};
use crate::map::Map;
use crate::marks::Sides;

/// Where the navigator believes the robot to be, and where else it may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Belief {
    /// Node last passed.
    pub(crate) node: Node,
    /// Where it looks.
    pub(crate) heading: Heading,
    /// The others.
    pub(crate) doubt: Doubt,
}

impl Default for Belief {
    fn default() -> Self {
        Self::at(Node::default(), Heading::Right)
    }
}

/// The other possible places. Index 0 is the one where the robot would look one quarter further to
/// the right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Doubt {
    nodes: [Option<Node>; 3],
}

impl Doubt {
    /// None but the belief.
    pub(crate) fn is_none(&self) -> bool {
        self.nodes.iter().all(Option::is_none)
    }

    /// Writes the state into a status.
    pub(crate) fn fill(&self, status: &mut NavigatorStatus) {
        for (index, node) in self.nodes.iter().enumerate() {
            if let Some(node) = node {
                status.doubt |= 2 << index;
                (status.doubt_x[index], status.doubt_y[index]) = (node.x, node.y);
            }
        }
    }

    /// The state from a status.
    pub(crate) fn of(status: &NavigatorStatus) -> Self {
        let mut doubt = Self::default();
        for (index, node) in doubt.nodes.iter_mut().enumerate() {
            if status.doubt & (2 << index) != 0 {
                *node = Some(Node::new(status.doubt_x[index], status.doubt_y[index]));
            }
        }
        doubt
    }

    /// The others as (quarters to the right of the belief, node).
    fn others(self) -> impl Iterator<Item = (u8, Node)> {
        (1..)
            .zip(self.nodes)
            .filter_map(|(quarters, node)| Some((quarters, node?)))
    }

    /// The other places as seen from the one `quarters` to the right, which the navigator believes
    /// now. `old` is the node of its earlier belief, if that is still possible.
    fn seen_from(self, quarters: u8, old: Option<Node>) -> Self {
        let mut seen = Self::default();
        let index = |other: u8| usize::from((other + 4 - quarters) % 4) - 1;
        for (other, node) in self.others().filter(|(other, _)| *other != quarters) {
            seen.nodes[index(other)] = Some(node);
        }
        seen.nodes[index(0)] = old;
        seen
    }

    /// Keeps the other places for which `keep` returns a node.
    fn retain(&mut self, mut keep: impl FnMut(u8, Node) -> Option<Node>) {
        for (quarters, node) in (1..).zip(&mut self.nodes) {
            *node = node.and_then(|at| keep(quarters, at));
        }
    }
}

impl Belief {
    /// A place without a doubt.
    pub(crate) fn at(node: Node, heading: Heading) -> Self {
        Self {
            node,
            heading,
            doubt: Doubt::default(),
        }
    }

    /// A disturbed turn has ended here, so the robot may look elsewhere. In the middle of an edge
    /// (`on_edge`) the opposite heading belongs to the node at its other end.
    pub(crate) fn doubt_turn(&mut self, map: &Map, on_edge: bool) {
        let mut doubt = Doubt::default();
        for quarters in 1..=3 {
            let heading = self.heading.turned(Spin::Right, quarters);
            doubt.nodes[usize::from(quarters) - 1] = match (on_edge, quarters) {
                (false, _) => Some(self.node),
                (true, 2) => map.grid.neighbour(self.node, self.heading),
                (true, _) => None,
            }
            .filter(|node| map.has_tape(*node, heading));
        }
        if !doubt.is_none() {
            self.doubt = doubt;
        }
    }

    /// The axle has come to the next node, from each of the possible places.
    pub(crate) fn move_on(&mut self, map: &Map) {
        let believed = self.heading;
        self.node = map.grid.neighbour(self.node, believed).unwrap_or(self.node);
        self.doubt.retain(|quarters, node| {
            map.grid
                .neighbour(node, believed.turned(Spin::Right, quarters))
        });
    }

    /// Compares a mark with each possible place. If the believed place, on `edge`, does not fit, it
    /// believes another one. Returns whether it did.
    pub(crate) fn ask_mark(
        &mut self,
        map: &Map,
        edge: &EdgeMarks,
        sides: Sides,
        at_mm: f32,
        tolerance: f32,
    ) -> bool {
        let fit = |edge: &EdgeMarks| fit(edge, sides, at_mm, tolerance);
        let believed = self.heading;
        let mut fitting = self.doubt;
        let mut best = (fit(edge), None);
        fitting.retain(|quarters, node| {
            let heading = believed.turned(Spin::Right, quarters);
            let fits = fit(&map.edge(node, heading)?);
            if fits > best.0 {
                best = (fits, Some((quarters, node)));
            }
            (fits > Fit::No).then_some(node)
        });
        let (_, Some((quarters, node))) = best else {
            // A mark that fits no possible place is dirt.
            if best.0 > Fit::No {
                self.doubt = fitting;
            }
            return false;
        };
        let old = (fit(edge) > Fit::No).then_some(self.node);
        self.node = node;
        self.heading = believed.turned(Spin::Right, quarters);
        self.doubt = fitting.seen_from(quarters, old);
        true
    }
}

/// How well a mark fits an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    /// The edge has no such mark.
    No,
    /// The mark is the node at its end, with one side unseen.
    Half,
    /// The mark is a station, or the node with all its sides.
    Whole,
}

/// As [`judge`], but a mark with a side that the node does not have is not that node: when in
/// doubt, a border tells one place from another.
fn fit(edge: &EdgeMarks, sides: Sides, at_mm: f32, tolerance: f32) -> Fit {
    match judge(edge, sides, at_mm, tolerance) {
        Verdict::Station => Fit::Whole,
        Verdict::Node if sides == edge.crossing => Fit::Whole,
        Verdict::Node if sides.is_within(edge.crossing) => Fit::Half,
        Verdict::Node | Verdict::Unexpected => Fit::No,
    }
}
