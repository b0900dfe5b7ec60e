//! Decides what the robot does next: orders, the goal, the way at each node, and how it goes on
//! after a failure.
//!
//! ```text
//!                       map                order
//!   WaitingForMap ----------> WaitingForOrder ----> Turning <----> Driving
//!                                   ^                  |   at each node (L6)
//!                                   |                  v
//!      Returning <- TurningRound    |             Approaching -> Positioning -> Picking
//!          |            ^           |                                              | picked (L7)
//!          |        BackingOff      |                Turning/Driving <-- Leaving <-+
//!          |            ^           |                       |
//!          +--> corner -|-----------+                       v  at the delivery corner (L8)
//!                    Dropping <--------------------------- Exiting
//!
//!   Returning -> Driving: the corner's mark did not come; the next node's tells where the robot is
//!   at a node, before Driving or Approaching: Looking, whether the way is open (L6)
//!   Driving, Approaching -> Halted -> TurningBack -> Driving: something stands between the nodes
//!   any -> Stuck: lost line, missing node, moved by hand (AMB-49); only a reset leads out
//!   a restart with no state to take up -> Lost; only a reset leads out
//! ```
//!
//! Each phase has its manoeuvre (`manoeuvre/mod.rs`), and the manoeuvre's [`Ending`] leads to the
//! next phase ([`Mission::next`]). The mission knows nothing of manoeuvres, lines, marks or the
//! odometer.

mod orders;
mod ways;

use core::time::Duration;

use lager_floor::{Heading, Node, Spin};
use lager_orders::Pick;
use lager_topics::{
    EventKind, Failure, FailureKind, Goal, GoneWhy, Order, Phase, Route, Thought, ThoughtKind,
    WarehouseMap,
};

use crate::battery::Battery;
use crate::belief::Belief;
use crate::blocks::Blocks;
use crate::config::LogicConfig;
use crate::ending::Ending;
use crate::goods::Gone;
use crate::map::{Map, PickStation};
use crate::marks::Sides;
use crate::output::Output;
use crate::queue::Queue;
use crate::route::Distances;

/// The large parts, allocated once when the navigator is made.
#[derive(Clone, Debug, Default)]
struct Tables {
    blocks: Blocks,
    distances: Distances,
}

/// What the robot does at the moment, and where it is.
#[derive(Clone, Debug)]
pub(crate) struct Mission {
    config: LogicConfig,
    pub(crate) now: Duration,
    pub(crate) map: Option<Map>,
    /// The size of the floor to which an earlier navigator's blocks belong, in squares.
    blocked_floor: Node,
    /// The last published map, which is known or was refused.
    published: WarehouseMap,
    tables: Box<Tables>,
    pub(crate) place: Belief,
    pub(crate) phase: Phase,
    /// The heading to which it turns; if it does not turn, the heading that it has.
    pub(crate) target: Heading,
    pub(crate) goal: Goal,
    /// The present order; after the delivery still the last one.
    pub(crate) order: Order,
    /// The orders that wait.
    pub(crate) queue: Queue,
    /// The goods that nobody can order.
    gone: Gone,
    /// The revisions of blocks and queue with which no waiting order could begin.
    none_reachable: Option<(u32, u32)>,
    pub(crate) delivered: u32,
    pub(crate) misses: u8,
    /// How often the blocked ways were tried again for the present goal.
    tries: u8,
    /// The operator insisted that the claw holds the goods, although it does not feel them.
    pub(crate) forced: bool,
    /// Who picks the goods up.
    pub(crate) pick: Pick,
    pub(crate) battery: Battery,
    /// It must do nothing without the external computer, which is out of reach.
    pub(crate) link_lost: bool,
    /// It stands at the node because of the battery or the link.
    pub(crate) parked: bool,
    /// Why it cannot go on.
    pub(crate) failure: Failure,
    pub(crate) route: Route,
}

impl Mission {
    /// A mission that waits for its map.
    pub(crate) fn new(config: LogicConfig) -> Self {
        let place = Belief::default();
        Self {
            pick: config.pick,
            config,
            now: Duration::ZERO,
            map: None,
            blocked_floor: Node::default(),
            published: WarehouseMap::default(),
            tables: Box::default(),
            target: place.heading,
            place,
            phase: Phase::WaitingForMap,
            goal: Goal::None,
            order: Order::default(),
            queue: Queue::default(),
            gone: Gone::default(),
            none_reachable: None,
            delivered: 0,
            misses: 0,
            tries: 0,
            forced: false,
            battery: Battery::default(),
            link_lost: false,
            parked: false,
            failure: Failure::default(),
            route: Route::default(),
        }
    }

    /// No earlier navigator has left the robot's place, so it is unknown.
    pub(crate) fn lose_place(&mut self) {
        self.phase = Phase::Lost;
        self.failure = self.failure_here(FailureKind::StateLost, 0, 0);
    }

    /// Whether the robot's place is known.
    pub(crate) fn has_a_place(&self) -> bool {
        self.phase != Phase::WaitingForMap && !self.needs_reset()
    }

    /// Whether only a person who puts the robot down can help.
    pub(crate) fn needs_reset(&self) -> bool {
        self.phase.needs_reset() && !self.waits_for_way()
    }

    /// Which way a half turn goes: at a node the way on which the first quarter meets tape, too;
    /// between nodes the way on which no station's mark ends it too early.
    pub(crate) fn half_turn(&self) -> Spin {
        let Belief { node, heading, .. } = self.place;
        if self.phase == Phase::TurningBack {
            let marks = self
                .map
                .as_ref()
                .map(|map| map.station_sides(node, heading));
            return match marks {
                Some(Sides { right: true, .. }) => Spin::Left,
                _ => Spin::Right,
            };
        }
        let tape = |heading| {
            self.phase == Phase::Turning
                && self
                    .map
                    .as_ref()
                    .is_some_and(|map| map.has_tape(node, heading))
        };
        match tape(heading.right()) || !tape(heading.left()) {
            true => Spin::Right,
            false => Spin::Left,
        }
    }

    /// Decides what follows after a manoeuvre's end.
    pub(crate) fn next(&mut self, outcome: Ending, out: &mut Output) {
        match (self.phase, outcome) {
            // The robot stands where it should, and a person's hand can help it.
            (Phase::Picking, Ending::Failed(kind, expected, seen))
                if kind != FailureKind::DrivenByHand =>
            {
                if kind == FailureKind::GoodsMissing {
                    self.goods_are_gone(GoneWhy::NotFound, out);
                }
                self.wait_for_hand(kind, expected.round() as i32, seen.round() as i32, out);
            }
            (_, Ending::Failed(kind, expected, seen)) => {
                self.get_stuck(kind, expected.round() as i32, seen.round() as i32, out);
            }
            (Phase::Picking, _) => {
                self.leave(false, out);
            }
            (Phase::Turning, outcome) => {
                self.doubt_turn(outcome, false, out);
                self.set_out(out);
            }
            (Phase::Looking, Ending::Blocked) => {
                self.block_ahead(out);
                self.set_out(out);
            }
            (Phase::Looking, _) => self.set_out_along(Some(self.place.heading), out),
            (Phase::Driving | Phase::Approaching, Ending::Blocked) => self.phase = Phase::Halted,
            (Phase::Halted, Ending::Blocked) => {
                self.block_ahead(out);
                self.target = self.place.heading.back();
                self.phase = Phase::TurningBack;
            }
            (Phase::Halted, _) => self.phase = self.drive_along(self.place.heading),
            // It has backed up to the node instead.
            (Phase::TurningBack, _) if self.place.heading != self.target => self.set_out(out),
            (Phase::TurningBack, outcome) => self.go_back(outcome, out),
            (Phase::Leaving, outcome) => {
                self.doubt_turn(outcome, true, out);
                self.phase = Phase::Driving;
            }
            (Phase::Approaching, Ending::Missed) => self.miss_station(out),
            (Phase::Approaching, _) => {
                if let Some(station) = self.station() {
                    self.target = station.into;
                    self.phase = Phase::Positioning;
                }
            }
            (Phase::Positioning, Ending::Interrupted) => {
                out.think(Thought {
                    heading: self.target.into(),
                    ..ThoughtKind::TurnDisturbed.into()
                });
            }
            // It has turned in, and there is no mark: look for it.
            (Phase::Positioning, Ending::Missed) if self.place.heading == self.target => {
                out.think(ThoughtKind::StationPassed);
            }
            (Phase::Positioning, Ending::Missed) => self.go_past_station(out),
            (Phase::Positioning, _) => self.be_in_position(out),
            (Phase::Exiting, _) => {
                self.phase = Phase::Dropping;
                out.think(ThoughtKind::AtBar);
            }
            (Phase::Dropping, _) => self.have_delivered(out),
            (Phase::BackingOff, _) => {
                self.target = self.place.heading.back();
                self.phase = Phase::TurningRound;
            }
            (Phase::TurningRound, _) => self.phase = Phase::Returning,
            (Phase::Returning, Ending::Missed) if self.may_go_past_corner() => {
                out.think(ThoughtKind::CornerMissed);
                self.phase = Phase::Driving;
            }
            (Phase::Returning, Ending::Missed) => {
                self.get_stuck(FailureKind::CornerUnseen, 0, 0, out);
            }
            (Phase::Returning, _) => {
                out.announce(EventKind::NextNode, self.place, self.order);
                self.go_on_from_node(out);
            }
            (Phase::Driving, _) => {
                self.pass_node(out);
                self.go_on_from_node(out);
            }
            // In these phases the robot stands, and standing does not end.
            (Phase::WaitingForMap | Phase::WaitingForOrder | Phase::Stuck | Phase::Lost, _) => {}
        }
    }

    fn doubt_turn(&mut self, outcome: Ending, on_edge: bool, out: &mut Output) {
        let Some(map) = self.map.as_ref().filter(|_| outcome == Ending::Interrupted) else {
            return;
        };
        self.place.doubt_turn(map, on_edge);
        if !self.place.doubt.is_none() {
            out.think(Thought {
                heading: self.place.heading.into(),
                ..ThoughtKind::TurnDisturbed.into()
            });
        }
    }

    /// The axle has come to the node at the end of the edge.
    fn pass_node(&mut self, out: &mut Output) {
        if let Some(map) = &self.map {
            self.place.move_on(map);
        }
        out.announce(EventKind::NextNode, self.place, self.order);
    }

    fn go_on_from_node(&mut self, out: &mut Output) {
        self.set_out(out);
        if matches!(self.phase, Phase::Driving | Phase::Looking) {
            let Node { x, y } = self.place.node;
            out.think(Thought {
                x,
                y,
                seen: self.route.length.into(),
                ..ThoughtKind::NodePassed.into()
            });
        }
    }

    fn miss_station(&mut self, out: &mut Output) {
        self.pass_node(out);
        if self.may_try_again(out) {
            out.think(ThoughtKind::StationMissed);
            self.go_on_from_node(out);
        }
    }

    /// The robot is on the station's edge again and has not found its mark. It goes on to the node
    /// ahead, and tries again from that side.
    fn go_past_station(&mut self, out: &mut Output) {
        let along = Some(self.place.heading);
        let behind = |station: &PickStation| {
            let mut ends = station.edge.ends().into_iter();
            ends.find(|end| station.edge.heading_from(*end) == along)
        };
        self.place.node = self.station().and_then(behind).unwrap_or(self.place.node);
        self.doubt_turn(Ending::Interrupted, true, out);
        if self.may_try_again(out) {
            out.think(ThoughtKind::StationMissed);
            self.phase = Phase::Driving;
        }
    }

    /// Counts a miss. Returns whether there may be another one.
    fn may_try_again(&mut self, out: &mut Output) -> bool {
        self.misses += 1;
        let (most, misses) = (self.config.misses.into(), self.misses.into());
        if self.misses >= self.config.misses {
            self.get_stuck(FailureKind::StationMissing, most, misses, out);
        }
        self.misses < self.config.misses
    }

    /// The mark under the sensors shows that the robot has another heading than believed.
    pub(crate) fn believe_other_place(&mut self, out: &mut Output) {
        self.target = self.place.heading;
        self.phase = Phase::Driving;
        let Node { x, y } = self.place.node;
        out.think(Thought {
            x,
            y,
            heading: self.place.heading.into(),
            ..ThoughtKind::PlaceCorrected.into()
        });
    }

    /// Decides at a node where to go, and goes there: turns first, or sets out at once.
    ///
    /// Every drive away from a node begins here. It begins here again after each turn at the node
    /// and after each look along the way: if that way is blocked, it is noted, and the decision is
    /// made once more (L6).
    pub(crate) fn set_out(&mut self, out: &mut Output) {
        self.set_out_along(None, out);
    }

    /// The same, just after a look along `seen_open` has shown an open way.
    fn set_out_along(&mut self, seen_open: Option<Heading>, out: &mut Output) {
        let next = self.plan(out);
        if self.parks(out) {
            return;
        }
        let Some(map) = &self.map else { return };
        let node = self.place.node;
        let (home, exit) = (node == map.grid.delivery(), map.grid.exit());
        if let Some(heading) = self.along_station() {
            return self.go_between(heading, seen_open, out);
        }
        if !home && self.begin_on_the_way_home(out) {
            return;
        }
        match self.goal {
            Goal::Delivery if home => self.go(exit, Phase::Exiting, out),
            Goal::Home | Goal::None if home => {
                self.goal = Goal::None;
                if !self.begin_next(out) {
                    self.go(exit.back(), Phase::WaitingForOrder, out);
                }
            }
            _ => match next {
                Some(heading) => self.go_between(heading, seen_open, out),
                None if self.put_off(out) => {}
                None => self.get_stuck(self.no_way(), 0, self.tries.into(), out),
            },
        }
    }

    /// The heading from the node along the edge of the goods' station, if the goods are the goal
    /// and the edge is open.
    fn along_station(&self) -> Option<Heading> {
        self.station()
            .filter(|station| self.goal == Goal::Product && self.is_open(station))
            .and_then(|station| station.edge.heading_from(self.place.node))
    }

    /// How to drive from the node along `heading`.
    fn drive_along(&self, heading: Heading) -> Phase {
        match self.along_station() == Some(heading) {
            true => Phase::Approaching,
            false => Phase::Driving,
        }
    }

    /// Goes along `heading` towards the next node, after a look along that way.
    fn go_between(&mut self, heading: Heading, seen_open: Option<Heading>, out: &mut Output) {
        let looked = self.config.ranger_cm == 0 || seen_open == Some(heading);
        match looked || heading != self.place.heading {
            true => self.go(heading, self.drive_along(heading), out),
            false => self.phase = Phase::Looking,
        }
    }

    /// Whether the robot must begin no new way.
    pub(crate) fn must_park(&self) -> bool {
        self.battery.forbids() || self.link_lost
    }

    /// Whether it stands because it must begin no new way: at a node, or before an order that
    /// waits.
    pub(crate) fn is_kept(&self) -> bool {
        let has_order = self.phase == Phase::WaitingForOrder && !self.queue.waiting().is_empty();
        self.parked || has_order && self.must_park()
    }

    /// Stands at the node that it has just reached if it must begin no new way. Returns whether it
    /// does.
    fn parks(&mut self, out: &mut Output) -> bool {
        if self.must_park() {
            self.parked = true;
            let kind = match self.battery.forbids() {
                true => ThoughtKind::Parked,
                false => ThoughtKind::ParkedWithoutLink,
            };
            out.think_of(kind, self.place.node);
        }
        self.parked
    }

    /// Goes into `phase` if the robot looks along `heading`; otherwise turns there first.
    fn go(&mut self, heading: Heading, phase: Phase, out: &mut Output) {
        if heading != self.place.heading {
            self.phase = Phase::Turning;
            self.target = heading;
            let kind = match self.place.heading.quarters_right_to(heading) {
                1 => ThoughtKind::TurnsRight,
                2 if self.half_turn() == Spin::Right => ThoughtKind::TurnsRight,
                _ => ThoughtKind::TurnsLeft,
            };
            return out.think_of(kind, self.place.node);
        }
        self.phase = phase;
        match phase {
            Phase::Approaching => out.think(Thought {
                product: self.order.product,
                ..ThoughtKind::SeeksStation.into()
            }),
            Phase::Exiting => out.think(ThoughtKind::LeavesToDeliver),
            Phase::WaitingForOrder => out.think(ThoughtKind::IsBack),
            _ => {}
        }
    }

    /// Where the product of the order is picked.
    pub(crate) fn station(&self) -> Option<&PickStation> {
        self.map.as_ref()?.station(self.order.product)
    }

    /// Gives up until a person helps (AMB-49).
    fn get_stuck(&mut self, kind: FailureKind, expected: i32, seen: i32, out: &mut Output) {
        self.failure = self.failure_here(kind, expected, seen);
        self.phase = Phase::Stuck;
        self.parked = false;
        out.announce_failure(EventKind::Failed, self.place, self.order, self.failure);
        self.tell_failure(out);
    }

    fn tell_failure(&self, out: &mut Output) {
        out.think(Thought {
            failure: self.failure,
            ..ThoughtKind::Failed.into()
        });
    }

    fn failure_here(&self, kind: FailureKind, expected: i32, seen: i32) -> Failure {
        let Node { x, y } = self.place.node;
        Failure::new(kind, (x, y), expected, seen)
    }
}
