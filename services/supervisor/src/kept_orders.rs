//! Keeps the orders of a robot's own queue over the end of `up`, for its next start.
//!
//! ```text
//!   the robot's queue ──> attendant ──> up ──> orders.toml      whenever it changes
//!   orders.toml ──> up ──> attendant ──> the robot's queue      one after the other, at the start
//! ```
//!
//! At the next start `up` gives them to the robot again, as a person would: that ends no stop and
//! changes no mode. A real robot also learns again which goods are not in their place. In a
//! simulated world they are on their shelves again.

use core::time::Duration;
use std::collections::VecDeque;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};

use lager_home::Clock;
use lager_operator::{Act, Ids, Seen, Wanted};
use lager_station::files;
use lager_topics::{Goal, GoneGoods, Input, InputKind, NavigatorStatus, Order, OrderQueue, Phase};
use serde::{Deserialize, Serialize};

/// How many orders a robot can get back: as many as can wait in it.
pub const MOST_ORDERS: usize = lager_logic::queue::MOST_ORDERS;

/// How long the end of `up` waits for a disk.
const DISK: Duration = Duration::from_secs(2);

/// What the file keeps.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KeptOrders {
    /// Products whose goods are not in their place.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gone: Vec<i32>,
    /// The orders, the next one first.
    #[serde(rename = "order", skip_serializing_if = "Vec::is_empty")]
    pub orders: Vec<KeptOrder>,
}

/// One order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptOrder {
    /// Its number.
    pub id: u32,
    /// The product to fetch.
    pub product: i32,
}

impl KeptOrders {
    /// What to keep of a robot that shows this. An order that is under way is kept as well, unless
    /// its goods are in a real claw: the robot would look for them in their old place.
    pub fn of(queue: &OrderQueue, status: &NavigatorStatus, is_real: bool) -> Self {
        let is_held = status.goal == Goal::Delivery;
        let under_way = (queue.under_way != 0 && !(is_real && is_held)).then_some(KeptOrder {
            id: queue.order_id,
            product: queue.product,
        });
        let waiting = queue.orders().iter().map(|order| KeptOrder {
            id: order.id,
            product: order.product,
        });
        let gone = queue.gone().iter().map(|gone: &GoneGoods| gone.product);
        Self {
            gone: gone.filter(|_| is_real).collect(),
            orders: under_way.into_iter().chain(waiting).collect(),
        }
    }

    /// Whether there is nothing to keep.
    pub fn is_nothing(&self) -> bool {
        self.gone.is_empty() && self.orders.is_empty()
    }

    /// Whether one of the orders is for this product.
    pub fn has(&self, product: i32) -> bool {
        self.orders.iter().any(|order| order.product == product)
    }

    /// Adds orders for products that waited elsewhere, as many as the robot can get back. Returns
    /// the others.
    pub fn add(&mut self, products: &[i32]) -> Vec<i32> {
        let mut left = Vec::new();
        let mut id = Ids::default().fresh(Clock::monotonic_ns());
        for product in products.iter().copied() {
            if self.has(product) {
                continue;
            }
            if self.orders.len() == MOST_ORDERS {
                left.push(product);
                continue;
            }
            while id == 0 || self.orders.iter().any(|order| order.id == id) {
                id = id.wrapping_add(1);
            }
            self.orders.push(KeptOrder { id, product });
        }
        left
    }

    /// Adds orders that somebody else keeps and that are not here.
    pub fn add_kept(&mut self, other: &Self) {
        for product in &other.gone {
            if !self.gone.contains(product) {
                self.gone.push(*product);
            }
        }
        for order in &other.orders {
            if self.orders.iter().all(|own| own.id != order.id) {
                self.orders.push(*order);
            }
        }
    }

    /// What to tell people of it at the start.
    pub fn sentence(&self) -> Option<String> {
        let products: Vec<String> = self
            .orders
            .iter()
            .map(|it| it.product.to_string())
            .collect();
        match &products[..] {
            [] => None,
            [product] => Some(format!(
                "1 order waits from before, for goods {product}; `lager queue clear` takes it back"
            )),
            all => Some(format!(
                "{} orders wait from before, for goods {}; `lager queue clear` takes them back",
                all.len(),
                all.join(", ")
            )),
        }
    }
}

/// Gives a robot its orders back. Pure: time and the robot's state in, acts out.
#[derive(Clone, Debug, Default)]
pub struct Returned {
    left: VecDeque<KeptOrder>,
    gone: VecDeque<i32>,
    wanted: Wanted,
    ids: Ids,
}

impl Returned {
    /// The robot gets all of `kept` back.
    pub fn new(kept: KeptOrders) -> Self {
        Self {
            left: kept.orders.into(),
            gone: kept.gone.into(),
            ..Self::default()
        }
    }

    /// What the robot has not got back yet.
    pub fn left(&self) -> KeptOrders {
        KeptOrders {
            gone: self.gone.iter().copied().collect(),
            orders: self.left.iter().copied().collect(),
        }
    }

    /// Looks, in ns of real time, and does at most one thing. What the robot shows or refuses is
    /// done.
    pub fn step(&mut self, now_ns: u64, seen: &Seen) -> Option<Act> {
        let (status, queue) = (seen.status?, seen.queue?);
        self.gone
            .retain(|product| queue.gone().iter().all(|gone| gone.product != *product));
        let refused = seen.refused.map(|(id, ..)| id);
        self.left.retain(|order| {
            let is_shown = status.order_id == order.id || queue.has(order.id);
            !is_shown && refused != Some(order.id)
        });
        let gone = self.gone.front().map(|product| {
            Act::Press(Input {
                kind: InputKind::GoodsGoneEarlier.into(),
                order_id: product.cast_unsigned(),
                ..Input::default()
            })
        });
        let order = self
            .left
            .front()
            .map(|&KeptOrder { id, product }| Act::Order(Order { id, product }));
        // Without a map the robot would refuse the orders, or take goods for unknown ones.
        let takes_orders = status.phase != Phase::WaitingForMap && !status.needs_reset();
        let act = gone.or(order).filter(|_| takes_orders);
        self.wanted.turn(now_ns, &mut self.ids, act)
    }
}

/// Writes the file in a thread, because a disk may take seconds and a robot's stop must not wait
/// for it.
#[derive(Debug)]
pub struct KeptFile {
    changes: Option<Sender<KeptOrders>>,
    ended: Receiver<()>,
}

impl KeptFile {
    /// Writes to `path` from now on.
    pub fn new(path: PathBuf) -> Self {
        let (changes, received) = channel::<KeptOrders>();
        let (ends, ended) = channel();
        let writes = move || {
            while let Ok(mut kept) = received.recv() {
                // Only the last one counts.
                while let Ok(newer) = received.try_recv() {
                    kept = newer;
                }
                if let Err(error) = write(&path, &kept) {
                    let path = path.display();
                    tracing::error!("the waiting orders are not kept in {path}: {error}");
                }
            }
            let _ = ends.send(());
        };
        if let Err(error) = std::thread::Builder::new().spawn(writes) {
            tracing::error!("the waiting orders are not kept, as no thread can start: {error}");
        }
        Self {
            changes: Some(changes),
            ended,
        }
    }

    /// Writes this to the file.
    pub fn keep(&self, kept: KeptOrders) {
        if let Some(to) = &self.changes {
            // The thread ends only when this is dropped.
            let _ = to.send(kept);
        }
    }
}

impl Drop for KeptFile {
    fn drop(&mut self) {
        self.changes = None;
        let _ = self.ended.recv_timeout(DISK);
    }
}

/// The orders of a robot that is up, as its attendant reports them, and the file that keeps them.
#[derive(Debug, Default)]
pub struct Keeping {
    /// What the robot has not got back yet.
    left: KeptOrders,
    /// Everything to keep.
    all: KeptOrders,
    file: Option<KeptFile>,
}

impl Keeping {
    /// The robot gets `kept` back, and `file` keeps its orders from then on.
    pub fn new(kept: KeptOrders, file: KeptFile) -> Self {
        file.keep(kept.clone());
        Self {
            left: kept.clone(),
            all: kept,
            file: Some(file),
        }
    }

    /// What the robot must still get back.
    pub fn left(&self) -> &KeptOrders {
        &self.left
    }

    /// The attendant has reported what is left to give back and what to keep.
    pub fn take(&mut self, left: KeptOrders, all: KeptOrders) {
        self.left = left;
        if self.all != all {
            if let Some(file) = &self.file {
                file.keep(all.clone());
            }
            self.all = all;
        }
    }

    /// Nobody knows the robot's orders any more: it gets all of them back.
    pub fn begin_again(&mut self) {
        self.left = self.all.clone();
    }

    /// Drops the orders for other products than these. Returns the products of those orders.
    pub fn keep_only(&mut self, products: &[i32]) -> Vec<i32> {
        let mut all = self.all.clone();
        let (fit, unfit) = all
            .orders
            .iter()
            .partition(|it| products.contains(&it.product));
        all.orders = fit;
        let unfit: Vec<KeptOrder> = unfit;
        self.take(all.clone(), all);
        unfit.into_iter().map(|order| order.product).collect()
    }
}

fn write(path: &Path, kept: &KeptOrders) -> io::Result<()> {
    if kept.is_nothing() {
        return match fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        };
    }
    let text = toml::to_string(kept).map_err(io::Error::other)?;
    if let Some(folder) = path.parent() {
        // The bus's folder, and this one in it, may have been removed.
        fs::create_dir_all(folder)?;
    }
    files::replace(path, &text)
}

#[cfg(test)]
mod tests {
    use lager_topics::{Failure, GoneWhy, WaitingOrder};

    use super::*;

    fn queue(under_way: Option<(u32, i32)>, waiting: &[(u32, i32)], gone: &[i32]) -> OrderQueue {
        let mut queue = OrderQueue {
            under_way: under_way.is_some().into(),
            count: waiting.len() as u8,
            gone_count: gone.len() as u8,
            ..OrderQueue::default()
        };
        (queue.order_id, queue.product) = under_way.unwrap_or_default();
        for (place, (id, product)) in queue.orders.iter_mut().zip(waiting) {
            (place.id, place.product) = (*id, *product);
        }
        for (place, product) in queue.gone.iter_mut().zip(gone) {
            (place.product, place.why) = (*product, GoneWhy::Delivered.into());
        }
        let _: &[WaitingOrder] = queue.orders();
        queue
    }

    fn waits() -> NavigatorStatus {
        NavigatorStatus {
            phase: Phase::WaitingForOrder.into(),
            ..NavigatorStatus::default()
        }
    }

    fn kept(orders: &[(u32, i32)], gone: &[i32]) -> KeptOrders {
        let order = |(id, product): &(u32, i32)| KeptOrder {
            id: *id,
            product: *product,
        };
        KeptOrders {
            gone: gone.to_vec(),
            orders: orders.iter().map(order).collect(),
        }
    }

    #[test]
    fn an_order_under_way_is_kept_unless_its_goods_are_in_a_real_claw() {
        let queue = queue(Some((7, 1)), &[(8, 2)], &[1, 5]);
        let brings = NavigatorStatus {
            goal: Goal::Delivery.into(),
            ..waits()
        };
        for (is_real, status, wanted) in [
            (false, waits(), kept(&[(7, 1), (8, 2)], &[])),
            (false, brings, kept(&[(7, 1), (8, 2)], &[])),
            (true, waits(), kept(&[(7, 1), (8, 2)], &[1, 5])),
            (true, brings, kept(&[(8, 2)], &[1, 5])),
        ] {
            assert_eq!(KeptOrders::of(&queue, &status, is_real), wanted);
        }
    }

    #[test]
    fn a_robot_is_given_back_its_orders_once_it_can_take_them() {
        let mut returned = Returned::new(kept(&[(7, 1), (8, 2)], &[5]));
        let at = |ms: u64| ms * 1_000_000;
        let mut seen = Seen {
            queue: Some(queue(None, &[], &[])),
            status: Some(NavigatorStatus::default()),
            ..Seen::default()
        };
        assert!(returned.step(at(0), &seen).is_none(), "it has no map");
        seen.status = Some(waits());
        let press = returned.step(at(10), &seen);
        assert!(
            matches!(press, Some(Act::Press(input)) if input.kind == InputKind::GoodsGoneEarlier && input.order_id == 5),
            "{press:?}"
        );
        assert!(returned.step(at(20), &seen).is_none(), "not again so soon");
        assert!(returned.step(at(510), &seen).is_some(), "again");
        seen.queue = Some(queue(None, &[], &[5]));
        let order = returned.step(at(520), &seen);
        assert!(matches!(
            order,
            Some(Act::Order(Order { id: 7, product: 1 }))
        ));
        // It is under way, and the next one is refused.
        seen.queue = Some(queue(Some((7, 1)), &[], &[5]));
        let order = returned.step(at(530), &seen);
        assert!(matches!(
            order,
            Some(Act::Order(Order { id: 8, product: 2 }))
        ));
        assert_eq!(returned.left(), kept(&[(8, 2)], &[]));
        seen.refused = Some((8, 2, Failure::default()));
        assert!(returned.step(at(540), &seen).is_none());
        assert!(returned.left().is_nothing());
    }

    #[test]
    fn what_waited_at_the_station_waits_behind_and_no_product_twice() {
        let mut all = kept(&[(7, 1)], &[]);
        assert_eq!(all.add(&[2, 1, 3]), [0; 0]);
        let products: Vec<i32> = all.orders.iter().map(|order| order.product).collect();
        assert_eq!(products, [1, 2, 3]);
        let ids: std::collections::BTreeSet<u32> = all.orders.iter().map(|it| it.id).collect();
        assert_eq!(ids.len(), 3, "each has a number of its own");
        let many: Vec<i32> = (1..=40).collect();
        assert_eq!(all.add(&many), (32..=40).collect::<Vec<_>>());
        let said = kept(&[(7, 3), (8, 1)], &[]).sentence().unwrap();
        assert!(
            said.starts_with("2 orders wait from before, for goods 3, 1;"),
            "{said}"
        );
    }

    #[test]
    fn what_is_kept_is_read_again_and_nothing_leaves_no_file() {
        let path = std::env::temp_dir().join(format!("lager-kept-{}.toml", std::process::id()));
        let all = kept(&[(7, 1), (u32::MAX, i32::MAX)], &[5]);
        let file = KeptFile::new(path.clone());
        file.keep(all.clone());
        drop(file);
        assert_eq!(files::read_toml::<KeptOrders>(&path).unwrap(), all);
        let file = KeptFile::new(path.clone());
        file.keep(KeptOrders::default());
        drop(file);
        assert!(!path.exists());
    }

    #[test]
    fn orders_for_goods_that_are_not_there_are_dropped_and_told() {
        let order = |id, product| KeptOrder { id, product };
        let kept = KeptOrders {
            gone: Vec::new(),
            orders: vec![order(1, 3), order(2, 9), order(3, 5)],
        };
        let mut keeping = Keeping {
            left: KeptOrders::default(),
            all: kept,
            file: None,
        };
        assert_eq!(keeping.keep_only(&[9, 10]), [3, 5]);
        assert_eq!(keeping.left().orders, [order(2, 9)]);
        assert_eq!(keeping.all.orders, [order(2, 9)]);
    }
}
