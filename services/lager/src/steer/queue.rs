//! The commands about orders: `fetch` and `queue`. They read what the robot has understood from
//! `mission/queue` and never assume it.

use std::fmt::Write;
use std::time::Duration;

use anyhow::{Result, bail};
use lager_lines::Called;
use lager_ports::Subscriber;
use lager_topics::{
    EventKind, Input, InputKind, MissionEvent, MissionQueue, Mode, Order, OrderQueue,
};

use super::{Operator, first};
use crate::goods;
use crate::hands::Hands;

/// How long after a word the robot is looked at again, in real time.
const GLANCE: Duration = Duration::from_millis(50);

impl Operator {
    /// `lager fetch`: ordered until logic shows that it took the order.
    pub fn fetch(&mut self, product: &Called) -> Result<String> {
        // The order would wait, and the robot would drive off when somebody else changes the mode.
        if self.health()?.mode.get() != Some(Mode::Autonomous) {
            bail!(
                "the robot is in manual mode and fetches nothing; `lager mode autonomous` changes that, and `lager queue add` orders for later"
            );
        }
        self.order(product)
    }

    /// `lager queue`: the orders with their numbers.
    pub fn orders(&self) -> Result<String> {
        let (_, now) = self.queue()?;
        Ok(listed(&now))
    }

    /// `lager queue cancel`.
    pub fn cancel(&self, id: u32) -> Result<String> {
        let (mut queue, now) = self.queue()?;
        if !now.is_under_way(id) {
            now.before(id)?;
        }
        let gone = |queue: &OrderQueue| !queue.has(id);
        let said = self.say_until(InputKind::OrderCancelled, id, &mut queue, gone);
        if said.is_err() && now.is_under_way(id) {
            bail!("order {id} is carried out: its goods are in the claw, or about to be");
        }
        said?;
        Ok(format!("order {id} is taken back"))
    }

    /// `lager queue up`.
    pub fn move_up(&self, id: u32) -> Result<String> {
        let (mut queue, now) = self.queue()?;
        let before = now.before(id)?;
        if before == 0 {
            return Ok(format!("order {id} is the next one already"));
        }
        let is_earlier = |queue: &OrderQueue| queue.before(id).ok().is_none_or(|now| now < before);
        self.say_until(InputKind::OrderMovedUp, id, &mut queue, is_earlier)?;
        Ok(format!("order {id} is carried out earlier"))
    }

    /// `lager queue clear`.
    pub fn clear_queue(&self) -> Result<String> {
        let (mut queue, now) = self.queue()?;
        let is_empty = |queue: &OrderQueue| queue.orders().is_empty();
        if is_empty(&now) {
            return Ok("no order waits".into());
        }
        self.say_until(InputKind::QueueCleared, 0, &mut queue, is_empty)?;
        Ok("all waiting orders are taken back".into())
    }

    /// The queue, and where to learn of its changes.
    fn queue(&self) -> Result<(Subscriber<MissionQueue>, OrderQueue)> {
        let mut queue = self.bus.subscriber::<MissionQueue>()?;
        let now = first(&mut queue, &self.bus, &self.patience)?;
        Ok((queue, now))
    }

    /// `lager queue add`: ordered until logic shows that it took the order, or refuses it.
    pub fn order(&self, product: &Called) -> Result<String> {
        let product = goods::number(&self.running, product)?;
        let mut queue = self.bus.subscriber::<MissionQueue>()?;
        let mut events = self.bus.subscriber::<MissionEvent>()?;
        let order = Order {
            id: Hands::fresh_id(),
            product,
        };
        loop {
            self.hands.fetch(order)?;
            self.patience.pause(GLANCE)?;
            while let Some(event) = events.receive()? {
                if event.kind.get() == Some(EventKind::Refused) && event.order_id == order.id {
                    let why = event.failure;
                    bail!("logic refuses to fetch product {product}: {why}");
                }
            }
            if let Some(queue) = queue.latest()? {
                if queue.is_under_way(order.id) {
                    return Ok(format!("logic fetches product {product}"));
                }
                match queue.before(order.id) {
                    Ok(0) => return Ok(format!("logic fetches product {product} next")),
                    Ok(before) => {
                        return Ok(format!(
                            "logic fetches product {product}; waiting before it: {before}"
                        ));
                    }
                    Err(_) => {}
                }
            }
            if self.patience.is_over() {
                bail!("logic does not take the order: it is not up, or does not answer");
            }
        }
    }

    /// Gives one command about the queue, once, since not all of them may be repeated, and waits
    /// until logic shows the effect.
    pub(super) fn say_until(
        &self,
        kind: InputKind,
        order_id: u32,
        queue: &mut Subscriber<MissionQueue>,
        done: impl Fn(&OrderQueue) -> bool,
    ) -> Result<()> {
        self.hands.press(Input {
            kind: kind.into(),
            order_id,
            id: Hands::fresh_id(),
            ..Input::default()
        })?;
        loop {
            self.patience.pause(GLANCE)?;
            if let Some(queue) = queue.latest()?
                && done(&queue)
            {
                return Ok(());
            }
            if self.patience.is_over() {
                bail!("logic does not react; `lager queue` shows what it goes by");
            }
        }
    }
}

/// The orders, one a line.
fn listed(queue: &OrderQueue) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    if queue.under_way != 0 {
        let (id, product) = (queue.order_id, queue.product);
        let _ = writeln!(text, "order {id}: product {product}, under way");
    }
    for order in queue.orders() {
        let state = match order.put_off {
            0 => "waits",
            _ => "waits for a way",
        };
        let _ = writeln!(
            text,
            "order {}: product {}, {state}",
            order.id, order.product
        );
    }
    match text.is_empty() {
        true => "no order is under way or waits".into(),
        false => text.trim_end().into(),
    }
}
