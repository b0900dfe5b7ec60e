//! [`Edge`]: the tape between two neighbouring nodes.

use serde::{Deserialize, Serialize};

use crate::heading::Heading;
use crate::node::Node;

/// The tape between two neighbouring nodes. Each tape is written in one way only: `from` is the
/// node with the smaller coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Edge {
    /// The node at the left or lower end.
    pub from: Node,
    /// The node at the right or upper end.
    pub to: Node,
}

impl Edge {
    /// The edge at one side of a square. No floor has a square at 255: its edges would end there.
    pub const fn of(square: Node, side: Heading) -> Self {
        let Node { x, y } = square;
        let (right, up) = (x.saturating_add(1), y.saturating_add(1));
        let (from, to) = match side {
            Heading::Left => (square, Node::new(x, up)),
            Heading::Up => (Node::new(x, up), Node::new(right, up)),
            Heading::Right => (Node::new(right, y), Node::new(right, up)),
            Heading::Down => (square, Node::new(right, y)),
        };
        Self { from, to }
    }

    /// The edge between two nodes; `None` if they are not neighbours.
    pub fn between(a: Node, b: Node) -> Option<Self> {
        let (from, to) = if a <= b { (a, b) } else { (b, a) };
        let leads = |heading: Heading| heading.step_from(from) == Some(to);
        (leads(Heading::Right) || leads(Heading::Up)).then_some(Self { from, to })
    }

    /// The edge that leaves `node` along `heading`; `None` if it would lead below 0 or above 255.
    pub fn leaving(node: Node, heading: Heading) -> Option<Self> {
        Self::between(node, heading.step_from(node)?)
    }

    /// Its two ends.
    pub const fn ends(self) -> [Node; 2] {
        [self.from, self.to]
    }

    /// The direction in which it leaves its first node: right or up.
    pub const fn heading(self) -> Heading {
        match self.from.x == self.to.x {
            true => Heading::Up,
            false => Heading::Right,
        }
    }

    /// The heading along it from one of its ends; `None` if `node` is not an end.
    pub fn heading_from(self, node: Node) -> Option<Heading> {
        match node {
            _ if node == self.from => Some(self.heading()),
            _ if node == self.to => Some(self.heading().back()),
            _ => None,
        }
    }

    /// The end that is not `node`; `None` if `node` is not an end.
    pub fn other_end(self, node: Node) -> Option<Node> {
        self.heading_from(node)?.step_from(node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(x: u8, y: u8) -> Node {
        Node::new(x, y)
    }

    #[test]
    fn the_same_edge_has_one_spelling() {
        use Heading::{Down, Left, Right, Up};

        assert_eq!(Edge::of(node(0, 0), Right), Edge::of(node(1, 0), Left));
        assert_eq!(Edge::of(node(0, 0), Up), Edge::of(node(0, 1), Down));
        let left = Edge::of(node(1, 0), Left);
        assert_eq!(Edge::between(node(1, 1), node(1, 0)), Some(left));
        assert_eq!(Edge::leaving(node(1, 1), Down), Some(left));
        assert_eq!(Edge::between(node(0, 1), node(1, 0)), None);
        assert_eq!(Edge::between(node(1, 1), node(1, 1)), None);
        assert_eq!(Edge::leaving(node(0, 1), Left), None);
    }

    #[test]
    fn it_leads_from_each_end_to_the_other() {
        for side in Heading::ALL {
            let edge = Edge::of(node(3, 4), side);
            let [forth, back] = edge.ends().map(|end| edge.heading_from(end));
            assert_eq!(forth.map(Heading::back), back);
            assert_eq!(edge.other_end(edge.from), Some(edge.to));
            assert_eq!(edge.other_end(edge.to), Some(edge.from));
            assert_eq!(edge.other_end(node(9, 9)), None);
        }
    }
}
