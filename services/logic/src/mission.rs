//! What to do next: orders, the goal, the decision at each node, and what becomes of a failure.
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
//! Each phase has its manoeuvre (`manoeuvre/mod.rs`), and the manoeuvre's [`Outcome`] leads to the
//! next phase ([`Mission::next`]). The mission knows nothing of manoeuvres, lines, marks or the
//! odometer.

mod orders;
mod ways;

use core::time::Duration;

use lager_topics::{
    EventKind, Failure, FailureKind, Goal, GoneWhy, Heading, Order, Phase, Pick, Route, Thought,
    ThoughtKind, WarehouseMap,
};

use crate::battery::Battery;
use crate::blocks::Blocks;
use crate::config::LogicConfig;
use crate::goods::Gone;
use crate::heading::{Compass, Spin};
use crate::map::{Map, PickStation};
use crate::marks::Sides;
use crate::node::Node;
use crate::outcome::Outcome;
use crate::output::Output;
use crate::place::Place;
use crate::queue::Queue;
use crate::route::Distances;

/// What is large: allocated once, when the navigator is made.
#[derive(Clone, Debug, Default)]
struct Tables {
    blocks: Blocks,
    distances: Distances,
}

/// What the robot is for at the moment, and where it is.
#[derive(Clone, Debug)]
pub(crate) struct Mission {
    config: LogicConfig,
    pub(crate) now: Duration,
    pub(crate) map: Option<Map>,
    /// Squares of the floor that a predecessor's blocks are of.
    blocked_floor: [u8; 2],
    /// What was published last, and is known or was refused.
    published: WarehouseMap,
    tables: Box<Tables>,
    pub(crate) place: Place,
    pub(crate) phase: Phase,
    /// Where it turns to; where it looks while it does not turn.
    pub(crate) target: Heading,
    pub(crate) goal: Goal,
    /// The order it is on; after the delivery still the last one.
    pub(crate) order: Order,
    /// The orders that wait.
    pub(crate) queue: Queue,
    /// The goods that no order can be for.
    gone: Gone,
    /// Blocks and queue, by their revisions, with which no waiting order could be begun.
    none_reachable: Option<(u32, u32)>,
    pub(crate) delivered: u32,
    pub(crate) misses: u8,
    /// How often the ways that were found blocked have been tried again for the goal.
    tries: u8,
    /// The operator was believed although the claw does not feel the goods.
    pub(crate) forced: bool,
    /// Who picks the goods up.
    pub(crate) pick: Pick,
    pub(crate) battery: Battery,
    /// It is to do nothing without the external computer, which is out of reach.
    pub(crate) link_lost: bool,
    /// It stands at the node because of either.
    pub(crate) parked: bool,
    /// Why it cannot go on.
    pub(crate) failure: Failure,
    pub(crate) route: Route,
}

impl Mission {
    /// A mission that waits for its map.
    pub(crate) fn new(config: LogicConfig) -> Self {
        let place = Place::default();
        Self {
            pick: config.pick,
            config,
            now: Duration::ZERO,
            map: None,
            blocked_floor: [0; 2],
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

    /// The robot's place was not kept.
    pub(crate) fn lose_place(&mut self) {
        self.phase = Phase::Lost;
        self.failure = self.failure_here(FailureKind::StateLost, 0, 0);
    }

    /// Whether the robot is anywhere in particular.
    pub(crate) fn has_a_place(&self) -> bool {
        self.phase != Phase::WaitingForMap && !self.needs_reset()
    }

    /// Whether only a person who puts the robot down leads on.
    pub(crate) fn needs_reset(&self) -> bool {
        self.phase.needs_reset() && !self.waits_for_way()
    }

    /// Which way a half turn goes: at a node where the first quarter meets tape too, between nodes
    /// where no station's mark ends it askew.
    pub(crate) fn half_turn(&self) -> Spin {
        let Place { node, heading, .. } = self.place;
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

    /// What follows from a manoeuvre's end.
    pub(crate) fn next(&mut self, outcome: Outcome, out: &mut Output) {
        match (self.phase, outcome) {
            // The robot stands where it should; a person's hand helps it.
            (Phase::Picking, Outcome::Failed(kind, expected, seen))
                if kind != FailureKind::DrivenByHand =>
            {
                if kind == FailureKind::GoodsMissing {
                    self.goods_are_gone(GoneWhy::NotFound, out);
                }
                self.wait_for_hand(kind, expected.round() as i32, seen.round() as i32, out);
            }
            (_, Outcome::Failed(kind, expected, seen)) => {
                self.get_stuck(kind, expected.round() as i32, seen.round() as i32, out);
            }
            (Phase::Picking, _) => {
                self.leave(false, out);
            }
            (Phase::Turning, outcome) => {
                self.doubt_turn(outcome, false, out);
                self.set_out(out);
            }
            (Phase::Looking, Outcome::Blocked) => {
                self.block_ahead(out);
                self.set_out(out);
            }
            (Phase::Looking, _) => self.set_out_along(Some(self.place.heading), out),
            (Phase::Driving | Phase::Approaching, Outcome::Blocked) => self.phase = Phase::Halted,
            (Phase::Halted, Outcome::Blocked) => {
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
            (Phase::Approaching, Outcome::Missed) => self.miss_station(out),
            (Phase::Approaching, _) => {
                if let Some(station) = self.station() {
                    self.target = station.into;
                    self.phase = Phase::Positioning;
                }
            }
            (Phase::Positioning, Outcome::Interrupted) => {
                out.think(Thought {
                    heading: self.target.into(),
                    ..ThoughtKind::TurnDisturbed.into()
                });
            }
            // Turned in, and no mark: it is searched for.
            (Phase::Positioning, Outcome::Missed) if self.place.heading == self.target => {
                out.think(ThoughtKind::StationPassed);
            }
            (Phase::Positioning, Outcome::Missed) => self.go_past_station(out),
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
            (Phase::Returning, Outcome::Missed) if self.may_go_past_corner() => {
                out.think(ThoughtKind::CornerMissed);
                self.phase = Phase::Driving;
            }
            (Phase::Returning, Outcome::Missed) => {
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
            // They stand, and standing does not end.
            (Phase::WaitingForMap | Phase::WaitingForOrder | Phase::Stuck | Phase::Lost, _) => {}
        }
    }

    fn doubt_turn(&mut self, outcome: Outcome, on_edge: bool, out: &mut Output) {
        let Some(map) = self
            .map
            .as_ref()
            .filter(|_| outcome == Outcome::Interrupted)
        else {
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

    /// On the station's edge again without having found its mark: on to the node ahead, and there
    /// once more from that side.
    fn go_past_station(&mut self, out: &mut Output) {
        let along = Some(self.place.heading);
        let behind = |station: &PickStation| {
            let mut ends = station.ends.into_iter();
            ends.find(|end| station.heading_from(*end) == along)
        };
        self.place.node = self.station().and_then(behind).unwrap_or(self.place.node);
        self.doubt_turn(Outcome::Interrupted, true, out);
        if self.may_try_again(out) {
            out.think(ThoughtKind::StationMissed);
            self.phase = Phase::Driving;
        }
    }

    /// Counts a miss; whether there may be another.
    fn may_try_again(&mut self, out: &mut Output) -> bool {
        self.misses += 1;
        let (most, misses) = (self.config.misses.into(), self.misses.into());
        if self.misses >= self.config.misses {
            self.get_stuck(FailureKind::StationMissing, most, misses, out);
        }
        self.misses < self.config.misses
    }

    /// The mark under the sensors shows that the robot looks elsewhere than believed.
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

    /// Decides at a node where to go and goes there: turns first, or sets out at once.
    ///
    /// Every drive away from a node begins here, and again after each turn at it and each look
    /// along the way that it is about to take: where that is found blocked, it is taken off the map
    /// and the decision is made once more (L6).
    pub(crate) fn set_out(&mut self, out: &mut Output) {
        self.set_out_along(None, out);
    }

    /// The same; the way along `seen_open` has just been looked at.
    fn set_out_along(&mut self, seen_open: Option<Heading>, out: &mut Output) {
        let next = self.plan(out);
        if self.parks(out) {
            return;
        }
        let Some(map) = &self.map else { return };
        let node = self.place.node;
        let (home, exit) = (node == map.delivery(), map.exit());
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

    /// Where the edge of the goods' station leads from the node, while they are the goal and it is
    /// open.
    fn along_station(&self) -> Option<Heading> {
        self.station()
            .filter(|station| self.goal == Goal::Product && self.is_open(station))
            .and_then(|station| station.heading_from(self.place.node))
    }

    /// How to drive from the node along `heading`.
    fn drive_along(&self, heading: Heading) -> Phase {
        match self.along_station() == Some(heading) {
            true => Phase::Approaching,
            false => Phase::Driving,
        }
    }

    /// Goes along `heading` towards the next node, once that way has been looked at.
    fn go_between(&mut self, heading: Heading, seen_open: Option<Heading>, out: &mut Output) {
        let looked = self.config.ranger_cm == 0 || seen_open == Some(heading);
        match looked || heading != self.place.heading {
            true => self.go(heading, self.drive_along(heading), out),
            false => self.phase = Phase::Looking,
        }
    }

    /// Whether no new way may be begun.
    pub(crate) fn must_park(&self) -> bool {
        self.battery.forbids() || self.link_lost
    }

    /// Whether it stands where it is because no new way may be begun: at a node, or before an order
    /// that waits.
    pub(crate) fn is_kept(&self) -> bool {
        let has_order = self.phase == Phase::WaitingForOrder && !self.queue.waiting().is_empty();
        self.parked || has_order && self.must_park()
    }

    /// Stands at the node just reached if no new way may be begun; whether it does.
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

    /// Goes into `phase` if the robot looks along `heading`, else turns there first.
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
