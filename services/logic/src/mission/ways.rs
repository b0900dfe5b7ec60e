//! Where the robot is on its map, which ways are open, and the route from here to the goal.

use lager_floor::{Heading, Node};
use lager_topics::{
    BlockSource, BlockedWays, EventKind, Failure, FailureKind, Goal, Phase, Route, RouteNode,
    Thought, ThoughtKind, WarehouseMap,
};

use super::{Mission, Tables};
use crate::belief::Belief;
use crate::blocks::{Block, Blocks};
use crate::ending::Ending;
use crate::map::{Map, PickStation};
use crate::output::Output;

impl Mission {
    /// Takes a published map. Returns whether the robot stands at the start again.
    pub(crate) fn take_map(&mut self, published: &WarehouseMap, out: &mut Output) -> bool {
        if self.published == *published {
            return false;
        }
        self.published = *published;
        let map = match Map::new(published) {
            Ok(map) => map,
            Err(failure) => {
                if self.map.is_none() {
                    self.failure = failure;
                }
                out.think(Thought {
                    failure,
                    ..ThoughtKind::MapRefused.into()
                });
                return false;
            }
        };
        let Some(known) = &self.map else {
            return self.take_first_map(map, out);
        };
        if *known == map {
            return false;
        }
        let idle = self.phase == Phase::WaitingForOrder || self.phase.needs_reset();
        let same_station = map.station(self.order.product) == known.station(self.order.product);
        let same_floor = map.same_floor(known);
        if !(idle || same_floor && same_station) {
            out.think(ThoughtKind::MapKept);
            // If the same map comes again, it is checked again.
            self.published = WarehouseMap::default();
            return false;
        }
        out.think(ThoughtKind::MapChanged);
        if let Some(before) = self.map.replace(map) {
            self.follow_goods(&before, out);
        }
        self.none_reachable = None;
        self.tables.distances.forget();
        if same_floor {
            return false;
        }
        self.tables.blocks.clear();
        out.blocks_changed = true;
        if self.phase == Phase::WaitingForOrder {
            self.stand_at_start();
            return true;
        }
        false
    }

    /// The first map of this process: a new robot stands at the start, a restarted one where it
    /// was.
    pub(super) fn take_first_map(&mut self, map: Map, out: &mut Output) -> bool {
        let is_at_station = matches!(self.phase, Phase::Positioning | Phase::Picking);
        let needs_station = self.goal == Goal::Product || is_at_station;
        let station_is_missing = needs_station && map.station(self.order.product).is_none();
        let place_is_missing = !map.grid.contains(self.place.node) || station_is_missing;
        if self.blocked_floor != Node::default() && self.blocked_floor != map.grid.size() {
            self.tables.blocks.clear();
        }
        self.map = Some(map);
        match self.phase {
            Phase::WaitingForMap => {
                self.stand_at_start();
                out.think(ThoughtKind::MapTaken);
                return true;
            }
            Phase::Lost => self.tell_failure(out),
            _ if place_is_missing => self.get_stuck(FailureKind::OffTheMap, 0, 0, out),
            _ => {
                self.find_way(out);
            }
        }
        false
    }

    /// On the delivery node, looking into the warehouse (AMB-50).
    pub(super) fn stand_at_start(&mut self) {
        if let Some(map) = &self.map {
            let (node, heading) = (map.grid.delivery(), map.grid.exit().back());
            self.stand_at(node, heading);
        }
    }

    /// The robot is on a node and waits for an order; everything from before is forgotten.
    pub(super) fn stand_at(&mut self, node: Node, heading: Heading) {
        self.place = Belief::at(node, heading);
        self.target = heading;
        self.phase = Phase::WaitingForOrder;
        self.goal = Goal::None;
        self.parked = false;
        self.forced = false;
        self.failure = Failure::default();
        self.none_reachable = None;
        self.battery.accept();
    }

    /// A person has put the robot down, on the delivery node if there is no `place`. Returns
    /// whether the robot believes it.
    pub(crate) fn put_down(&mut self, place: Option<(Node, Heading)>, out: &mut Output) -> bool {
        if let Some((node, _)) = place
            && !self.map.as_ref().is_some_and(|map| map.grid.contains(node))
        {
            out.think_of(ThoughtKind::NoSuchNode, node);
            return false;
        }
        let why = self.failure_here(FailureKind::PutDown, 0, 0);
        if matches!(self.goal, Goal::Product | Goal::Delivery) {
            out.announce_failure(EventKind::Refused, self.place, self.order, why);
        }
        out.queue_changed = true;
        self.set_route(Route::default(), out);
        match (place, &self.map) {
            (_, None) => self.phase = Phase::WaitingForMap,
            (None, Some(_)) => {
                self.stand_at_start();
                out.think(ThoughtKind::PutAtStart);
            }
            (Some((node, heading)), Some(_)) => {
                self.stand_at(node, heading);
                out.think_of(ThoughtKind::PutDown, node);
            }
        }
        true
    }

    /// A way is blocked or open now. Returns whether a robot without a way can go on.
    pub(crate) fn take_way(&mut self, block: Block, open: bool, out: &mut Output) -> bool {
        let Some(map) = &self.map else { return false };
        let Block { node, heading, .. } = block;
        let changed = match open {
            true => self.tables.blocks.open(node, heading),
            false => self.tables.blocks.block(map, block),
        };
        if !changed {
            return false;
        }
        out.blocks_changed = true;
        let kind = match open {
            true => ThoughtKind::WayOpen,
            false => ThoughtKind::WayBlocked,
        };
        let Node { x, y } = node;
        out.think(Thought {
            x,
            y,
            heading: heading.into(),
            ..kind.into()
        });
        self.find_way(out)
    }

    /// Goes on if the robot stands because it had no way, and there is one now. Returns whether it
    /// does.
    pub(super) fn find_way(&mut self, out: &mut Output) -> bool {
        let waits = self.waits_for_way();
        if waits && self.phase == Phase::Picking {
            return self.leave(self.forced, out);
        }
        let has_way = self.plan(out).is_some() || self.along_station().is_some();
        if !waits || !has_way || self.phase != Phase::Stuck {
            return false;
        }
        self.go_on_for_a_way(out);
        true
    }

    /// Sets out from the node where it stood because it had no way.
    pub(super) fn go_on_for_a_way(&mut self, out: &mut Output) {
        self.failure = Failure::default();
        // If it must stand at the node for another reason, it is not stuck there.
        self.phase = Phase::Driving;
        self.set_out(out);
    }

    /// Something stands on the way ahead.
    pub(super) fn block_ahead(&mut self, out: &mut Output) {
        let Belief { node, heading, .. } = self.place;
        let block = Block {
            node,
            heading,
            since: self.now,
            source: BlockSource::Sensor,
        };
        if let Some(map) = &self.map {
            self.tables.blocks.block(map, block);
        }
        out.blocks_changed = true;
        out.announce(EventKind::WayBlocked, self.place, self.order);
    }

    /// It has turned round between two nodes and goes back to the one it came from.
    pub(super) fn go_back(&mut self, outcome: Ending, out: &mut Output) {
        let Belief { node, heading, .. } = self.place;
        if let Some(map) = &self.map {
            self.place.node = map.grid.neighbour(node, heading.back()).unwrap_or(node);
        }
        self.doubt_turn(outcome, true, out);
        self.phase = Phase::Driving;
        self.plan_from_edge(node, heading, out);
    }

    /// Whether it stands because it has no way.
    pub(super) fn waits_for_way(&self) -> bool {
        matches!(
            self.failure.kind.get(),
            Some(FailureKind::NoWay | FailureKind::Unreachable)
        )
    }

    /// The failure that means "no way".
    pub(super) fn no_way(&self) -> FailureKind {
        match self.tries {
            0 => FailureKind::NoWay,
            _ => FailureKind::Unreachable,
        }
    }

    /// Forgets blocks that it has seen long ago.
    pub(super) fn forget_old_blocks(&mut self, out: &mut Output) {
        let long_ago = self.now.checked_sub(self.config.try_again);
        if long_ago.is_some_and(|until| self.tables.blocks.open_sensed(until)) {
            out.blocks_changed = true;
        }
    }

    /// Tries blocked ways again, if it stands because it has no way and found the last block long
    /// ago. Returns whether it goes on.
    pub(crate) fn try_again(&mut self, out: &mut Output) -> bool {
        if !matches!(self.phase, Phase::Stuck | Phase::Picking) || !self.waits_for_way() {
            return false;
        }
        let last = self.tables.blocks.last_sensed();
        let is_due = last.is_some_and(|last| self.now >= last + self.config.try_again);
        if !is_due {
            return false;
        }
        self.forget_old_blocks(out);
        self.tries = self.tries.saturating_add(1);
        out.think(ThoughtKind::TriesAgain);
        self.find_way(out)
    }

    /// The blocked ways in their published form.
    pub(crate) fn blocked_ways(&self) -> BlockedWays {
        let map = self.map.as_ref();
        let floor = map.map_or(self.blocked_floor, |map| map.grid.size());
        BlockedWays {
            width: floor.x,
            height: floor.y,
            tries: self.tries,
            ..self.tables.blocks.to_payload()
        }
    }

    /// Takes the blocked ways that an earlier navigator published.
    pub(crate) fn restore_blocks(&mut self, ways: &BlockedWays) {
        self.tables.blocks = Blocks::from_payload(ways);
        self.blocked_floor = Node::new(ways.width, ways.height);
        self.tries = ways.tries;
    }

    /// Publishes the route of a robot between two nodes that first drives along `heading` to the
    /// node `towards`.
    pub(super) fn plan_from_edge(&mut self, towards: Node, heading: Heading, out: &mut Output) {
        let Some(map) = &self.map else { return };
        let Some(goals) = self.goals() else { return };
        let Tables { blocks, distances } = &mut *self.tables;
        distances.search(map, blocks, goals);
        let mut route = Route::default();
        distances.write_route(map, towards, heading, &mut route);
        let moved = usize::from(route.length).min(route.nodes.len() - 1);
        route.nodes.copy_within(0..moved, 1);
        route.nodes[0] = RouteNode {
            x: towards.x,
            y: towards.y,
        };
        route.length += 1;
        self.set_route(route, out);
    }

    /// Whether nothing stands on the edge of a station.
    pub(super) fn is_open(&self, station: &PickStation) -> bool {
        let node = station.edge.from;
        self.map.as_ref().is_some_and(|map| {
            station
                .edge
                .heading_from(node)
                .is_some_and(|heading| self.tables.blocks.is_open(map, node, heading))
        })
    }

    /// Whether the way straight on behind the delivery corner is open.
    pub(super) fn may_go_past_corner(&self) -> bool {
        let Belief { node, heading, .. } = self.place;
        let blocks = &self.tables.blocks;
        let is_open = |map: &Map| map.has_tape(node, heading) && blocks.is_open(map, node, heading);
        self.map.as_ref().is_some_and(is_open)
    }

    /// The nodes of which the robot must reach one, if it has a goal that it can reach at all.
    fn goals(&self) -> Option<[Node; 2]> {
        let map = self.map.as_ref()?;
        match self.goal {
            Goal::Product => self
                .station()
                .filter(|at| self.is_open(at))
                .map(|at| at.edge.ends()),
            Goal::Delivery | Goal::Home => Some([map.grid.delivery(); 2]),
            Goal::None => None,
        }
    }

    /// Plans from the last node to the goal, publishes the route, and returns its first heading.
    pub(super) fn plan(&mut self, out: &mut Output) -> Option<Heading> {
        let Some(goals) = self.goals() else {
            self.set_route(Route::default(), out);
            return None;
        };
        let map = self.map.as_ref()?;
        let Belief { node, heading, .. } = self.place;
        let Tables { blocks, distances } = &mut *self.tables;
        distances.search(map, blocks, goals);
        let next = distances.next(map, node, heading);
        let mut route = Route::default();
        distances.write_route(map, node, heading, &mut route);
        self.set_route(route, out);
        next
    }

    pub(super) fn set_route(&mut self, route: Route, out: &mut Output) {
        if route != self.route {
            self.route = route;
            out.route_changed = true;
        }
    }
}
