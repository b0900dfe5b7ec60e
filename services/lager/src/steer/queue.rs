//! `lager queue`: the orders as the robot has understood them.

use std::fmt::Write;

use anyhow::Result;
use lager_topics::{MissionQueue, OrderQueue};

use super::{Operator, first};

impl Operator {
    /// `lager queue`: the orders with their numbers.
    pub fn orders(&self) -> Result<String> {
        Ok(listed(&self.queue()?))
    }

    /// Logic's own list of orders.
    pub(super) fn queue(&self) -> Result<OrderQueue> {
        let mut queue = self.bus.subscriber::<MissionQueue>()?;
        first(&mut queue, &self.bus, &self.patience)
    }
}

/// The orders, one a line.
fn listed(queue: &OrderQueue) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    if queue.under_way != 0 {
        let (id, product) = (queue.order_id, queue.product);
        let _ = writeln!(text, "order {id}: goods {product}, under way");
    }
    for order in queue.orders() {
        let state = match order.put_off {
            0 => "waits",
            _ => "waits for a way",
        };
        let _ = writeln!(text, "order {}: goods {}, {state}", order.id, order.product);
    }
    match text.is_empty() {
        true => "no order is under way or waits".into(),
        false => text.trim_end().into(),
    }
}
