//! The navigator's answer to an input: events, a thought, and which states have changed.

use lager_topics::{Event, EventKind, Failure, Order, Role, Thought, ThoughtKind};

use crate::belief::Belief;
use lager_floor::Node;

/// The navigator's news after an input.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// The events of the mission, in order.
    pub events: heapless::Vec<Event, 6>,
    /// Its thought; the last one if there were several.
    pub thought: Option<Thought>,
    /// [`Navigator::route`](crate::Navigator::route) has changed.
    pub route_changed: bool,
    /// [`Navigator::blocks`](crate::Navigator::blocks) have changed.
    pub blocks_changed: bool,
    /// [`Navigator::queue`](crate::Navigator::queue) has changed.
    pub queue_changed: bool,
    /// More of [`Navigator::status`](crate::Navigator::status) has changed than what changes with
    /// every frame: it has to go out at once.
    pub status_changed: bool,
}

impl Output {
    pub(crate) fn think(&mut self, thought: impl Into<Thought>) {
        self.thought = Some(Thought {
            from: Role::Logic.into(),
            ..thought.into()
        });
    }

    /// Thinks something of a node.
    pub(crate) fn think_of(&mut self, kind: ThoughtKind, Node { x, y }: Node) {
        self.think(Thought {
            x,
            y,
            ..kind.into()
        });
    }

    pub(crate) fn announce(&mut self, kind: EventKind, at: Belief, order: Order) {
        self.announce_failure(kind, at, order, Failure::default());
    }

    pub(crate) fn announce_failure(
        &mut self,
        kind: EventKind,
        at: Belief,
        order: Order,
        failure: Failure,
    ) {
        let event = Event {
            kind: kind.into(),
            x: at.node.x,
            y: at.node.y,
            heading: at.heading.into(),
            order_id: order.id,
            product: order.product,
            failure,
        };
        self.status_changed = true;
        // One input causes at most five: a node, a blocked way, a failure, a refusal and a new
        // order.
        let _ = self.events.push(event);
    }
}
