//! From an order to its delivery: which orders the robot accepts, its work at the goods, and the
//! way from there.

use lager_orders::Pick;
use lager_topics::{
    EventKind, Failure, FailureKind, Goal, GoneWhy, Order, OrderQueue, Phase, Thought, ThoughtKind,
};

use super::{Mission, Tables};
use crate::goods::Gone;
use crate::map::Map;
use crate::output::Output;
use crate::queue::Queue;

impl Mission {
    /// Keeps an order for later, or refuses it with the reason.
    pub(crate) fn take_order(&mut self, order: &Order, out: &mut Output) {
        if order.id != 0 && order.id == self.order.id || self.queue.has(order.id) {
            return;
        }
        let Some(map) = &self.map else {
            return self.refuse(order, FailureKind::NoMap, out);
        };
        if map.station(order.product).is_none() {
            return self.refuse(order, FailureKind::UnknownProduct, out);
        } else if self.needs_reset() {
            return self.refuse(order, FailureKind::NeedsReset, out);
        } else if self.is_ordered(order.product) {
            return self.refuse(order, FailureKind::AlreadyOrdered, out);
        } else if self.gone.why(order.product, self.now).is_some() {
            return self.refuse_gone(order, out);
        }
        let before = self.queue.waiting().len();
        if !self.queue.push(*order) {
            return self.refuse(order, FailureKind::QueueFull, out);
        }
        out.queue_changed = true;
        if self.battery.forbids() {
            think_of_product(ThoughtKind::OrderWaitsForCharge, order.product, out);
        } else if self.phase != Phase::WaitingForOrder || before > 0 {
            out.think(Thought {
                product: order.product,
                seen: before as i32,
                ..ThoughtKind::OrderWaits.into()
            });
        }
    }

    /// Whether an order for this product waits or is under way. There is one piece of each product,
    /// so a second order would be in vain.
    fn is_ordered(&self, product: i32) -> bool {
        let mut waiting = self.queue.waiting().iter();
        self.is_under_way(self.order.id) && self.order.product == product
            || waiting.any(|waiting| waiting.order.product == product)
    }

    /// The goods of the present order are not in their place from now on.
    pub(super) fn goods_are_gone(&mut self, why: GoneWhy, out: &mut Output) {
        self.gone.add(self.order.product, why, self.now);
        out.queue_changed = true;
    }

    /// A person, or what was kept of an earlier run, says that these goods are not in their place.
    /// Waiting orders for them are refused. If the robot is on its way already, it goes on and sees
    /// for itself.
    pub(crate) fn miss_goods(&mut self, product: i32, why: GoneWhy, out: &mut Output) {
        self.gone.add(product, why, self.now);
        out.queue_changed = true;
        think_of_product(ThoughtKind::GoodsGone, product, out);
        let mut waiting = self.queue.waiting().iter().map(|waiting| waiting.order);
        if let Some(order) = waiting.find(|order| order.product == product) {
            self.queue.cancel(order.id);
            self.refuse_gone(&order, out);
            self.need_no_way();
        }
    }

    /// A person says that goods are in their place again: one product's, or all.
    pub(crate) fn find_goods(&mut self, product: Option<i32>, out: &mut Output) {
        let were_gone = match product {
            Some(product) => self.gone.remove(product),
            None => self.gone.clear(),
        };
        out.queue_changed |= were_gone;
        match product {
            Some(product) if were_gone => think_of_product(ThoughtKind::GoodsBack, product, out),
            None if were_gone => out.think(ThoughtKind::AllGoodsBack),
            _ => {}
        }
    }

    /// A person cancels a waiting order.
    pub(crate) fn cancel(&mut self, id: u32, out: &mut Output) {
        if let Some(order) = self.queue.cancel(id) {
            out.queue_changed = true;
            think_of_product(ThoughtKind::OrderCancelled, order.product, out);
            self.need_no_way();
        }
    }

    /// Whether the order with this number is the one under way.
    pub(crate) fn is_under_way(&self, id: u32) -> bool {
        let is_at_work = matches!(self.goal, Goal::Product | Goal::Delivery);
        is_at_work && self.order.id == id
    }

    /// A person cancels the present order before the robot holds its goods. The robot finishes its
    /// manoeuvre. Then, where it decides next, it goes home or begins the next order. Returns
    /// whether another manoeuvre begins at once.
    pub(crate) fn cancel_under_way(&mut self, out: &mut Output) -> bool {
        think_of_product(ThoughtKind::OrderCancelled, self.order.product, out);
        out.queue_changed = true;
        self.goal = Goal::Home;
        self.tries = 0;
        self.none_reachable = None;
        match self.phase {
            Phase::Approaching => self.phase = Phase::Driving,
            Phase::Picking => return self.leave(false, out),
            Phase::Stuck if self.waits_for_way() => self.go_on_for_a_way(out),
            _ => {
                self.find_way(out);
                return false;
            }
        }
        true
    }

    /// It is too late to cancel the present order.
    pub(crate) fn keep_order(&self, out: &mut Output) {
        think_of_product(ThoughtKind::OrderKept, self.order.product, out);
    }

    /// A person wants a waiting order earlier.
    pub(crate) fn move_up(&mut self, id: u32, out: &mut Output) {
        if self.queue.move_up(id) {
            out.queue_changed = true;
            let product = self.queue.product_of(id).unwrap_or_default();
            think_of_product(ThoughtKind::OrderMovedUp, product, out);
        }
    }

    /// A person cancels all waiting orders.
    pub(crate) fn clear_queue(&mut self, out: &mut Output) {
        if self.queue.clear() {
            out.queue_changed = true;
            out.think(ThoughtKind::QueueCleared);
            self.need_no_way();
        }
    }

    /// If a robot waits at home for a way to an order, and has no order left, it stops waiting.
    fn need_no_way(&mut self) {
        if self.phase == Phase::WaitingForOrder && self.queue.waiting().is_empty() {
            self.failure = Failure::default();
        }
    }

    /// The orders in their published form.
    pub(crate) fn order_queue(&self) -> OrderQueue {
        let is_under_way = self.is_under_way(self.order.id);
        let mut queue = self.queue.to_payload(is_under_way.then_some(self.order));
        self.gone.fill(&mut queue);
        queue
    }

    /// Takes the orders that an earlier navigator published.
    pub(crate) fn restore_queue(&mut self, queue: &OrderQueue) {
        self.queue = Queue::from_payload(queue, self.order);
        self.gone = Gone::from_payload(queue);
    }

    /// The map is another one: goods with another place on it are there again.
    pub(super) fn follow_goods(&mut self, before: &Map, out: &mut Output) {
        if let Some(map) = &self.map {
            out.queue_changed |= self.gone.follow(before, map);
        }
    }

    pub(super) fn refuse(&self, order: &Order, kind: FailureKind, out: &mut Output) {
        let seen = match kind {
            FailureKind::QueueFull => self.queue.waiting().len() as i32,
            _ => order.product,
        };
        self.refuse_with(order, self.failure_here(kind, 0, seen), out);
    }

    /// Refuses an order for goods that are not in their place.
    fn refuse_gone(&self, order: &Order, out: &mut Output) {
        if let Some((kind, ago_s)) = self.gone.why(order.product, self.now) {
            self.refuse_with(order, self.failure_here(kind, ago_s, order.product), out);
        }
    }

    fn refuse_with(&self, order: &Order, failure: Failure, out: &mut Output) {
        out.announce_failure(EventKind::Refused, self.place, *order, failure);
        out.think(Thought {
            product: order.product,
            failure,
            ..ThoughtKind::OrderRefused.into()
        });
    }

    /// Begins the first waiting order that it can reach from the node where it stands. Orders
    /// before it wait on. If it can reach none, it stands until a way opens.
    pub(crate) fn begin_next(&mut self, out: &mut Output) -> bool {
        if self.queue.waiting().is_empty() || self.must_park() {
            return false;
        }
        self.forget_old_blocks(out);
        let now = (self.tables.blocks.revision(), self.queue.revision());
        if self.none_reachable == Some(now) || self.map.is_none() {
            return false;
        }
        if let Some(index) = self.first_reachable() {
            self.queue_off(index, out);
            return self.begin_order(index, out);
        }
        if self.tables.blocks.is_empty() {
            // No way can open: the floor has none, or the product has no place on it.
            if let Some(order) = self.queue.take(0) {
                out.queue_changed = true;
                self.refuse(&order, FailureKind::NoWay, out);
            }
            return false;
        }
        self.none_reachable = Some(now);
        self.queue_off(self.queue.waiting().len(), out);
        if self.failure.is_none() {
            self.wait_for_way(FailureKind::NoWay, out);
        }
        false
    }

    /// The robot cannot reach the present order's goods now. That order waits, and another one
    /// begins if the robot can reach it. Returns whether there is one.
    pub(super) fn put_off(&mut self, out: &mut Output) -> bool {
        if self.goal != Goal::Product {
            return false;
        }
        let Some(index) = self.first_reachable() else {
            return false;
        };
        let order = self.order;
        self.queue.put_back(order);
        self.begin_order(index + 1, out);
        think_of_product(ThoughtKind::OrderPutOff, order.product, out);
        true
    }

    /// The robot stands because there is no way to its goal, but it can reach a waiting order's
    /// goods. Returns whether it begins that order.
    pub(crate) fn overtake(&mut self, out: &mut Output) -> bool {
        let stands = self.phase == Phase::Stuck && self.waits_for_way() && !self.must_park();
        let now = (self.tables.blocks.revision(), self.queue.revision());
        if !stands || self.none_reachable == Some(now) {
            return false;
        }
        self.none_reachable = Some(now);
        self.put_off(out) || self.begin_on_the_way_home(out)
    }

    /// Begins a waiting order from here, without going home first. Returns whether it can reach
    /// one.
    pub(super) fn begin_on_the_way_home(&mut self, out: &mut Output) -> bool {
        if self.goal != Goal::Home {
            return false;
        }
        let reachable = self.first_reachable();
        reachable.is_some_and(|index| self.begin_order(index, out))
    }

    /// The first waiting order to whose goods there is a way from here.
    fn first_reachable(&mut self) -> Option<usize> {
        let map = self.map.as_ref()?;
        let Tables { blocks, distances } = &mut *self.tables;
        let node = self.place.node;
        self.queue.waiting().iter().position(|waiting| {
            let station = map.station(waiting.order.product);
            station.is_some_and(|station| {
                let end = station.edge.from;
                let along = station.edge.heading_from(end);
                distances.search(map, blocks, station.edge.ends());
                along.is_some_and(|along| blocks.is_open(map, end, along))
                    && distances.from(map, node).is_some()
            })
        })
    }

    /// It is the turn of the first `count` waiting orders, and there is no way to them.
    fn queue_off(&mut self, count: usize, out: &mut Output) {
        if self.queue.put_off(count) {
            out.queue_changed = true;
            if let Some(waiting) = self.queue.waiting().first() {
                think_of_product(ThoughtKind::OrderPutOff, waiting.order.product, out);
            }
        }
    }

    /// Begins a waiting order from the node where it stands. Returns whether there is one at that
    /// place.
    fn begin_order(&mut self, index: usize, out: &mut Output) -> bool {
        let Some(order) = self.queue.take(index) else {
            return false;
        };
        out.queue_changed = true;
        self.failure = Failure::default();
        self.tries = 0;
        self.order = order;
        self.forced = false;
        self.goal = Goal::Product;
        self.misses = 0;
        out.announce(EventKind::GettingItem, self.place, order);
        self.plan(out);
        out.think(Thought {
            product: order.product,
            seen: self.route.length.into(),
            ..ThoughtKind::Fetching.into()
        });
        self.set_out(out);
        true
    }

    /// The robot stands at the goods, turned in (L7).
    pub(super) fn be_in_position(&mut self, out: &mut Output) {
        self.phase = Phase::Picking;
        if self.goal == Goal::Home {
            // Somebody has cancelled the order meanwhile.
            self.leave(false, out);
            return;
        }
        out.announce(EventKind::InPosition, self.place, self.order);
        let kind = match self.pick {
            Pick::Auto => ThoughtKind::Picking,
            Pick::Manual => ThoughtKind::AwaitsPickup,
        };
        think_of_product(kind, self.order.product, out);
    }

    /// The robot stands where it is until there is a way.
    fn wait_for_way(&mut self, kind: FailureKind, out: &mut Output) {
        self.wait_for_hand(kind, 0, self.tries.into(), out);
    }

    /// The robot stands where it is and needs a person's hand.
    pub(super) fn wait_for_hand(
        &mut self,
        kind: FailureKind,
        expected: i32,
        seen: i32,
        out: &mut Output,
    ) {
        self.failure = self.failure_here(kind, expected, seen);
        out.announce_failure(EventKind::Failed, self.place, self.order, self.failure);
        self.tell_failure(out);
    }

    /// The operator says that the goods are in the claw. If the claw does not feel them (`empty`),
    /// the operator must insist. Returns whether the robot leaves.
    pub(crate) fn picked(
        &mut self,
        order_id: u32,
        forced: bool,
        empty: Option<(FailureKind, i32, i32)>,
        out: &mut Output,
    ) -> bool {
        let meant = order_id == 0 || order_id == self.order.id;
        if self.phase != Phase::Picking || !meant {
            return false;
        }
        if let Some((kind, expected, seen)) = empty.filter(|_| !forced) {
            let failure = self.failure_here(kind, expected, seen);
            out.announce_failure(EventKind::PickupRefused, self.place, self.order, failure);
            out.think(Thought {
                product: self.order.product,
                failure,
                ..ThoughtKind::PickupRefused.into()
            });
            return false;
        }
        self.leave(forced, out)
    }

    /// Leaves with the goods, or without them if the order was cancelled. It drives back onto the
    /// edge, towards the end that is nearer to the delivery corner. Returns whether that changes
    /// anything.
    pub(super) fn leave(&mut self, forced: bool, out: &mut Output) -> bool {
        let (Some(map), Some(station)) = (&self.map, self.station()) else {
            return false;
        };
        let station = *station;
        let Tables { blocks, distances } = &mut *self.tables;
        distances.search(map, blocks, [map.grid.delivery(); 2]);
        let best = station
            .edge
            .ends()
            .into_iter()
            .filter_map(|end| Some((distances.from(map, end)?, end)))
            .min_by_key(|(edges, _)| *edges);
        let Some((_, towards)) = best else {
            self.forced = forced;
            self.wait_for_way(self.no_way(), out);
            return true;
        };
        let from = station.edge.other_end(towards).unwrap_or(towards);
        let Some(heading) = station.edge.heading_from(from) else {
            return false;
        };
        self.place.node = from;
        let has_goods = self.goal != Goal::Home;
        if has_goods {
            if self.goal == Goal::Product {
                self.goods_are_gone(GoneWhy::PickedUp, out);
            }
            self.goal = Goal::Delivery;
        }
        self.tries = 0;
        self.forced = forced;
        self.failure = Failure::default();
        self.plan_from_edge(towards, heading, out);
        if has_goods {
            think_of_product(ThoughtKind::HasGoods, self.order.product, out);
        }
        self.target = heading;
        self.phase = Phase::Leaving;
        true
    }

    /// The goods lie at the place of delivery (L8).
    pub(super) fn have_delivered(&mut self, out: &mut Output) {
        self.delivered = self.delivered.wrapping_add(1);
        out.announce(EventKind::ItemDelivered, self.place, self.order);
        think_of_product(ThoughtKind::Delivered, self.order.product, out);
        self.goods_are_gone(GoneWhy::Delivered, out);
        self.goal = Goal::Home;
        self.forced = false;
        self.phase = Phase::BackingOff;
    }
}

fn think_of_product(kind: ThoughtKind, product: i32, out: &mut Output) {
    out.think(Thought {
        product,
        ..kind.into()
    });
}
