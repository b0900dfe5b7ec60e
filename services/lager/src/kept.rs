//! The orders of a robot's own queue, over the end of `up` and its next start.
//!
//! ```text
//!   the robot's queue ──> attendant ──> up ──> orders.toml      whenever it changes
//!   orders.toml ──> up ──> attendant ──> the robot's queue      one after the other, at the start
//! ```
//!
//! Orders from before are ordered again as a person would: they end no stop and change no mode. A
//! robot that is real is also told which goods are not in their place; in a simulated world they
//! are on their shelves again.

use core::time::Duration;
use std::collections::VecDeque;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};

use lager_station::files;
use lager_topics::{Goal, GoneGoods, Input, InputKind, NavigatorStatus, Order, OrderQueue, Phase};
use serde::{Deserialize, Serialize};

use crate::config::Body;
use crate::hands::Hands;
use crate::mission::Seen;

/// Orders that a robot can be given back, at most: as many as wait in it.
pub const MOST_ORDERS: usize = lager_logic::queue::MOST_ORDERS;

/// How often what shows no effect is said again, in robot time.
const REPEAT: Duration = Duration::from_millis(500);

/// How long the end of `up` waits for a disk.
const DISK: Duration = Duration::from_secs(2);

/// What is kept.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Kept {
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
    /// What is to be fetched.
    pub product: i32,
}

impl Kept {
    /// What is to be kept of a robot that shows this. An order under way is carried out again,
    /// unless its goods are in a real claw: then they are not where it would look for them.
    pub fn of(queue: &OrderQueue, status: &NavigatorStatus, body: Body) -> Self {
        let is_real = body == Body::Serial;
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

    /// Whether there is nothing to be kept.
    pub fn is_nothing(&self) -> bool {
        self.gone.is_empty() && self.orders.is_empty()
    }

    /// Whether one of the orders is for this product.
    pub fn has(&self, product: i32) -> bool {
        self.orders.iter().any(|order| order.product == product)
    }

    /// Adds orders for products that waited elsewhere, as long as the robot can be given them;
    /// those that are left.
    pub fn add(&mut self, products: &[i32]) -> Vec<i32> {
        let mut left = Vec::new();
        let mut id = Hands::fresh_id();
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

    /// Adds what somebody else keeps and this does not have.
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

    /// What people are told of it at the start.
    pub fn sentence(&self) -> Option<String> {
        let products: Vec<String> = self
            .orders
            .iter()
            .map(|it| it.product.to_string())
            .collect();
        match &products[..] {
            [] => None,
            [product] => Some(format!(
                "1 order waits from before, for product {product}; `lager queue clear` takes it back"
            )),
            all => Some(format!(
                "{} orders wait from before, for products {}; `lager queue clear` takes them back",
                all.len(),
                all.join(", ")
            )),
        }
    }
}

/// One thing that a robot is given back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gift {
    /// An order.
    Order(Order),
    /// That goods are not in their place.
    Gone(Input),
}

/// What a robot is given back: pure, time and what is seen in, acts out.
#[derive(Clone, Debug, Default)]
pub struct Returned {
    left: VecDeque<KeptOrder>,
    gone: VecDeque<i32>,
    acted: Option<Duration>,
}

impl Returned {
    /// All of `kept` is to be given back.
    pub fn new(kept: Kept) -> Self {
        Self {
            left: kept.orders.into(),
            gone: kept.gone.into(),
            acted: None,
        }
    }

    /// What has not been given back yet.
    pub fn left(&self) -> Kept {
        Kept {
            gone: self.gone.iter().copied().collect(),
            orders: self.left.iter().copied().collect(),
        }
    }

    /// Looks, and does at most one thing. What the robot shows or refuses has been given.
    pub fn step(&mut self, now: Duration, seen: &Seen) -> Option<Gift> {
        let (status, queue) = (seen.status?, seen.queue?);
        let before = (self.left.len(), self.gone.len());
        self.gone
            .retain(|product| queue.gone().iter().all(|gone| gone.product != *product));
        let refused = seen.refused.map(|(id, ..)| id);
        self.left.retain(|order| {
            let is_shown = status.order_id == order.id || queue.has(order.id);
            !is_shown && refused != Some(order.id)
        });
        if (self.left.len(), self.gone.len()) != before {
            self.acted = None;
        }
        // It would refuse them, or think of goods that are on no map.
        let takes_orders = status.phase != Phase::WaitingForMap && !status.needs_reset();
        if !takes_orders || self.acted.is_some_and(|acted| now < acted + REPEAT) {
            return None;
        }
        let gift = match (self.gone.front(), self.left.front()) {
            (Some(product), _) => Gift::Gone(Input {
                kind: InputKind::GoodsGone.into(),
                order_id: product.cast_unsigned(),
                id: Hands::fresh_id(),
                ..Input::default()
            }),
            (None, Some(KeptOrder { id, product })) => Gift::Order(Order {
                id: *id,
                product: *product,
            }),
            (None, None) => return None,
        };
        self.acted = Some(now);
        Some(gift)
    }
}

/// Writes what is kept, in a thread, because a disk may take seconds and a robot's stop must not
/// wait for it.
#[derive(Debug)]
pub struct KeptFile {
    changes: Option<Sender<Kept>>,
    ended: Receiver<()>,
}

impl KeptFile {
    /// Writes to `path` from now on.
    pub fn new(path: PathBuf) -> Self {
        let (changes, received) = channel::<Kept>();
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

    /// Has this kept.
    pub fn keep(&self, kept: Kept) {
        if let Some(to) = &self.changes {
            // It ends only when this is dropped.
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

/// What a robot that is up has to do, as its attendant tells it, and the file that keeps it.
#[derive(Debug, Default)]
pub struct Keeping {
    /// What it is still to be given back.
    left: Kept,
    /// All that is to be kept.
    all: Kept,
    file: Option<KeptFile>,
}

impl Keeping {
    /// The robot is given back `kept`, and what it has to do from then on is kept in `file`.
    pub fn new(kept: Kept, file: KeptFile) -> Self {
        file.keep(kept.clone());
        Self {
            left: kept.clone(),
            all: kept,
            file: Some(file),
        }
    }

    /// What the robot is still to be given back.
    pub fn left(&self) -> &Kept {
        &self.left
    }

    /// The attendant has told anew what is left and what is to be kept.
    pub fn take(&mut self, left: Kept, all: Kept) {
        self.left = left;
        if self.all != all {
            if let Some(file) = &self.file {
                file.keep(all.clone());
            }
            self.all = all;
        }
    }

    /// Nobody knows any more what the robot had to do: it is given all of it back.
    pub fn begin_again(&mut self) {
        self.left = self.all.clone();
    }
}

fn write(path: &Path, kept: &Kept) -> io::Result<()> {
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

    fn kept(orders: &[(u32, i32)], gone: &[i32]) -> Kept {
        let order = |(id, product): &(u32, i32)| KeptOrder {
            id: *id,
            product: *product,
        };
        Kept {
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
        for (body, status, wanted) in [
            (Body::Sim, waits(), kept(&[(7, 1), (8, 2)], &[])),
            (Body::Sim, brings, kept(&[(7, 1), (8, 2)], &[])),
            (Body::Serial, waits(), kept(&[(7, 1), (8, 2)], &[1, 5])),
            (Body::Serial, brings, kept(&[(8, 2)], &[1, 5])),
        ] {
            assert_eq!(Kept::of(&queue, &status, body), wanted);
        }
    }

    #[test]
    fn a_robot_is_given_back_its_orders_once_it_can_take_them() {
        let mut returned = Returned::new(kept(&[(7, 1), (8, 2)], &[5]));
        let at = Duration::from_millis;
        let mut seen = Seen {
            queue: Some(queue(None, &[], &[])),
            status: Some(NavigatorStatus::default()),
            ..Seen::default()
        };
        assert!(returned.step(at(0), &seen).is_none(), "it has no map");
        seen.status = Some(waits());
        let press = returned.step(at(10), &seen);
        assert!(
            matches!(press, Some(Gift::Gone(input)) if input.kind == InputKind::GoodsGone && input.order_id == 5),
            "{press:?}"
        );
        assert!(returned.step(at(20), &seen).is_none(), "not again so soon");
        assert!(returned.step(at(510), &seen).is_some(), "again");
        seen.queue = Some(queue(None, &[], &[5]));
        let order = returned.step(at(520), &seen);
        assert!(matches!(
            order,
            Some(Gift::Order(Order { id: 7, product: 1 }))
        ));
        // It is under way, and the next one is refused.
        seen.queue = Some(queue(Some((7, 1)), &[], &[5]));
        let order = returned.step(at(530), &seen);
        assert!(matches!(
            order,
            Some(Gift::Order(Order { id: 8, product: 2 }))
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
            said.starts_with("2 orders wait from before, for products 3, 1;"),
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
        assert_eq!(files::read_toml::<Kept>(&path).unwrap(), all);
        let file = KeptFile::new(path.clone());
        file.keep(Kept::default());
        drop(file);
        assert!(!path.exists());
    }
}
