//! What to do next: maps, orders, the pick signal, and the decision at each node.

use lager_topics::{EventKind, Goal, Heading, Order, Phase, Route, RouteNode, Step, WarehouseMap};

use super::{Navigator, Output, Pause, say};
use crate::heading::Compass;
use crate::map::{Map, Station};
use crate::route::{Distances, nearer, write_route};

impl Navigator {
    pub(super) fn take_map(&mut self, published: &WarehouseMap, out: &mut Output) {
        let map = match Map::new(published) {
            Ok(map) => map,
            Err(why) => return say!(out, "I cannot use this map: {why}."),
        };
        let Some(known) = &self.map else {
            return self.take_first_map(map, out);
        };
        if *known == map {
            return;
        }
        let idle = matches!(self.phase, Phase::WaitingForOrder | Phase::Stuck);
        let same_station = map.station(self.order.product) == known.station(self.order.product);
        let same_floor = map.same_floor(known);
        if idle || (same_floor && same_station) {
            say!(out, "The map has changed.");
            self.map = Some(map);
            if !same_floor && self.phase == Phase::WaitingForOrder {
                self.stand_at_start();
            }
        } else {
            say!(out, "I keep my map until I am back; send the new one then.");
        }
    }

    /// The first map of this process: a fresh robot stands at the start, one that was restarted
    /// stands where it was.
    fn take_first_map(&mut self, map: Map, out: &mut Output) {
        let fresh = self.phase == Phase::WaitingForMap;
        let station_is_missing =
            self.goal == Goal::Product && map.station(self.order.product).is_none();
        let place_is_missing = !map.contains(self.node) || station_is_missing;
        self.map = Some(map);
        if fresh {
            self.stand_at_start();
            say!(out, "I have a map. Which product shall I fetch?");
        } else if place_is_missing {
            self.get_stuck("My place is not on this map", out);
        } else {
            self.plan(out);
        }
    }

    /// On the delivery node, looking into the warehouse (AMB-50).
    fn stand_at_start(&mut self) {
        let Some(map) = &self.map else { return };
        self.node = map.delivery();
        self.heading = map.exit().back();
        self.target = self.heading;
        self.phase = Phase::WaitingForOrder;
        self.step = Step::Seeking;
        self.goal = Goal::None;
        self.pause = Pause::None;
        self.blind = false;
        self.odometer.travelled_mm = 0.0;
        self.odometer.stirred_mm = 0.0;
        self.marks.clear();
    }

    pub(super) fn reset(&mut self, out: &mut Output) {
        if self.has_goods_to_fetch() {
            self.announce(EventKind::Refused, self.order, out);
        }
        if let Some(order) = self.pending.take() {
            self.announce(EventKind::Refused, order, out);
        }
        if self.map.is_none() {
            self.phase = Phase::WaitingForMap;
            return;
        }
        self.stand_at_start();
        self.set_route(Route::default(), out);
        say!(
            out,
            "Reset: I stand at the start. Which product shall I fetch?"
        );
    }

    fn has_goods_to_fetch(&self) -> bool {
        matches!(self.goal, Goal::Product | Goal::Delivery)
    }

    /// Keeps an order for later, or refuses it with the reason.
    pub(super) fn take_order(&mut self, order: &Order, out: &mut Output) {
        let repeated = |known: &Order| order.id != 0 && order.id == known.id;
        if repeated(&self.order) || self.pending.as_ref().is_some_and(repeated) {
            return;
        }
        let Some(map) = &self.map else {
            return self.refuse(order, "I have no map yet", out);
        };
        if map.station(order.product).is_none() {
            self.refuse(order, "it is not on my map", out);
        } else if self.phase == Phase::Stuck {
            self.refuse(order, "I am stuck and need a reset", out);
        } else if self.pending.is_some() {
            self.refuse(order, "another order is waiting already", out);
        } else {
            self.pending = Some(*order);
            if self.phase != Phase::WaitingForOrder {
                say!(out, "I shall fetch product {} next.", order.product);
            }
        }
    }

    fn refuse(&self, order: &Order, why: &str, out: &mut Output) {
        self.announce(EventKind::Refused, *order, out);
        say!(out, "I cannot fetch product {}: {why}.", order.product);
    }

    /// Begins the waiting order, if there is one, from the node it stands on.
    pub(super) fn begin_pending(&mut self, out: &mut Output) -> bool {
        let Some(map) = &self.map else { return false };
        let Some(order) = self.pending.take() else {
            return false;
        };
        let reachable = map
            .station(order.product)
            .is_some_and(|station| nearer(map, self.node, station.ends).is_some());
        if !reachable {
            self.refuse(&order, "there is no way to it", out);
            return false;
        }
        self.order = order;
        self.goal = Goal::Product;
        self.misses = 0;
        self.announce(EventKind::GettingItem, order, out);
        self.plan(out);
        say!(
            out,
            "I fetch product {}; {} crossings to go.",
            order.product,
            self.route.length
        );
        self.set_out(out);
        true
    }

    /// Decides at a node where to go and goes there: turns first, or sets out at once.
    ///
    /// Every drive away from a node begins here, and again after each turn at it, when the robot
    /// looks along the way it is about to take. So this is the one place where a way can be
    /// found blocked, be taken off the map, and the decision be made once more (L6).
    pub(super) fn set_out(&mut self, out: &mut Output) {
        let next = self.plan(out);
        let Some(map) = &self.map else { return };
        self.step = Step::Seeking;
        self.marks.clear();
        self.line_lost_at = None;
        let (home, exit) = (self.node == map.delivery(), map.exit());
        let along_station = self
            .station()
            .filter(|_| self.goal == Goal::Product)
            .and_then(|station| station.heading_from(self.node))
            .filter(|heading| map.is_open(self.node, *heading));
        if let Some(heading) = along_station {
            return self.go(heading, Phase::Approaching, out);
        }
        match self.goal {
            Goal::Delivery if home => self.go(exit, Phase::Exiting, out),
            Goal::Home | Goal::None if home => {
                self.goal = Goal::None;
                if !self.begin_pending(out) {
                    self.go(exit.back(), Phase::WaitingForOrder, out);
                }
            }
            _ => match next {
                Some(heading) => self.go(heading, Phase::Driving, out),
                None => self.get_stuck("There is no way to where I must go", out),
            },
        }
    }

    /// Goes into `phase` if the robot looks along `heading`, else turns there first.
    fn go(&mut self, heading: Heading, phase: Phase, out: &mut Output) {
        if heading != self.heading {
            return self.begin_turn(heading, Phase::Turning, out);
        }
        self.phase = phase;
        match phase {
            Phase::Approaching => say!(out, "I look for product {}.", self.order.product),
            Phase::Exiting => say!(out, "I leave the warehouse to deliver."),
            Phase::WaitingForOrder => say!(out, "I am back. Which product shall I fetch?"),
            _ => {}
        }
    }

    /// Plans from the node last passed to the goal, publishes the route and returns where it
    /// begins.
    fn plan(&mut self, out: &mut Output) -> Option<Heading> {
        let map = self.map.as_ref()?;
        let distances = match self.goal {
            Goal::Product => nearer(map, self.node, self.station()?.ends)?.1,
            Goal::Delivery | Goal::Home => Distances::to(map, map.delivery()),
            Goal::None => {
                self.set_route(Route::default(), out);
                return None;
            }
        };
        let next = distances.next(map, self.node, self.heading);
        let mut route = Route::default();
        write_route(map, &distances, self.node, self.heading, &mut route);
        self.set_route(route, out);
        next
    }

    fn set_route(&mut self, route: Route, out: &mut Output) {
        if route != self.route {
            self.route = route;
            out.route_changed = true;
        }
    }

    /// Where the product of the order is picked.
    pub(super) fn station(&self) -> Option<&Station> {
        self.map.as_ref()?.station(self.order.product)
    }

    /// The axle has come to the node at the end of the edge.
    pub(super) fn reach_node(&mut self, out: &mut Output) {
        let Some(map) = &self.map else { return };
        let missed_the_station = self.phase == Phase::Approaching;
        if self.phase == Phase::Returning {
            self.odometer.travelled_mm -= self.exit_mm;
        } else {
            self.odometer.travelled_mm -= map.side_mm();
            self.node = map.neighbour(self.node, self.heading).unwrap_or(self.node);
        }
        self.announce(EventKind::NextNode, self.order, out);
        if missed_the_station {
            self.misses += 1;
            if self.misses >= self.config.misses {
                return self.get_stuck("I cannot find the mark of the pick station", out);
            }
            say!(out, "The pick station's mark did not come; I try again.");
        }
        self.set_out(out);
        if self.phase == Phase::Driving {
            say!(out, "Crossing {}, {} to go.", self.node, self.route.length);
        }
    }

    /// The robot stands at the goods, turned in (L7).
    pub(super) fn be_in_position(&mut self, out: &mut Output) {
        self.phase = Phase::Picking;
        self.announce(EventKind::InPosition, self.order, out);
        say!(
            out,
            "I stand at product {}. Pick it up with the arm and tell me when it is done.",
            self.order.product
        );
    }

    /// The operator has the goods: back onto the edge, towards the end from which the delivery
    /// corner is nearer.
    pub(super) fn picked(&mut self, order_id: u32, out: &mut Output) {
        let meant = order_id == 0 || order_id == self.order.id;
        let (Phase::Picking, true, Some(map)) = (self.phase, meant, &self.map) else {
            return;
        };
        let Some(station) = self.station() else {
            return;
        };
        let distances = Distances::to(map, map.delivery());
        let best = station
            .ends
            .into_iter()
            .filter_map(|end| Some((distances.from(map, end)?, end)))
            .min_by_key(|(edges, _)| *edges);
        let Some((_, towards)) = best else {
            return self.get_stuck("There is no way to the delivery corner", out);
        };
        let from = station.other_end(towards).unwrap_or(towards);
        let Some(heading) = station.heading_from(from) else {
            return;
        };
        self.node = from;
        self.odometer.travelled_mm = map.side_mm() / 2.0;
        self.goal = Goal::Delivery;
        let mut route = Route::default();
        // Planned from the edge's far end with the first step given: the robot stands on it.
        write_route(map, &distances, towards, heading, &mut route);
        let length = usize::from(route.length);
        route.nodes.copy_within(0..length, 1);
        route.nodes[0] = RouteNode {
            x: towards.x,
            y: towards.y,
        };
        route.length += 1;
        self.set_route(route, out);
        say!(
            out,
            "I have product {} and take it to delivery.",
            self.order.product
        );
        self.begin_turn(heading, Phase::Leaving, out);
    }

    /// The goods lie at the place of delivery (L8).
    pub(super) fn have_delivered(&mut self, out: &mut Output) {
        self.delivered = self.delivered.wrapping_add(1);
        self.announce(EventKind::ItemDelivered, self.order, out);
        say!(
            out,
            "Product {} is delivered. I go back.",
            self.order.product
        );
        self.goal = Goal::Home;
        self.phase = Phase::BackingOff;
    }
}
