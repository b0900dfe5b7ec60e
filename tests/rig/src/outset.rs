//! An operator for tests: it gives the map, sets the autonomous mode and gives an order, until the
//! robot sets out.

use core::error::Error;
use core::time::Duration;
use std::time::Instant;

use lager_orders::Mode;
use lager_ports::{Bus, Cause, Client, Publisher, Subscriber};
use lager_topics::{
    Ask, AskKind, BridgeRequest, LinkHealth, MissionOrder, NavMap, NavStatus, Order, Phase,
};

use crate::one_square;

/// How long the bridge may take to answer.
const ANSWERS_WITHIN: Duration = Duration::from_secs(30);

/// The operator repeats its order after this time, since logic may have subscribed after the first.
const ORDER_AGAIN: Duration = Duration::from_millis(500);

/// The operator of a robot in a warehouse of [`one_square`]. Keep it as long as the robot runs:
/// processes that join the bus later get the map from it.
#[derive(Debug)]
pub struct Outset {
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    map: Publisher<NavMap>,
    orders: Publisher<MissionOrder>,
    requests: Client<BridgeRequest>,
    is_autonomous: bool,
    ordered: Option<Instant>,
}

impl Outset {
    /// Joins as the operator, and gives the map.
    ///
    /// # Errors
    /// The bus refuses.
    pub fn new(bus: &Bus) -> Result<Self, Box<dyn Error>> {
        let map: Publisher<NavMap> = bus.publisher()?;
        map.send(Cause::OWN, one_square())?;
        Ok(Self {
            health: bus.subscriber()?,
            status: bus.subscriber()?,
            map,
            orders: bus.publisher()?,
            requests: bus.client()?,
            is_autonomous: false,
            ordered: None,
        })
    }

    /// Does the next thing, and returns whether the robot is on its way to its product. Call it
    /// again and again while the test plays the boards.
    ///
    /// # Errors
    /// The bus fails, or the bridge does not answer.
    pub fn goes_on(&mut self) -> Result<bool, Box<dyn Error>> {
        self.map.tick();
        if !self.is_autonomous {
            let health = self.health.latest()?;
            if health.is_some_and(|health| health.boards_are_ready()) {
                let ask = Ask {
                    kind: AskKind::SetMode.into(),
                    mode: Mode::Autonomous.into(),
                    ..Ask::default()
                };
                self.requests.call(ask, ANSWERS_WITHIN)?;
                self.is_autonomous = true;
            }
            return Ok(false);
        }
        let phase = self.status.latest()?.and_then(|status| status.phase.get());
        let is_due = self.ordered.is_none_or(|at| at.elapsed() > ORDER_AGAIN);
        if phase == Some(Phase::WaitingForOrder) && is_due {
            self.orders.send(Cause::OWN, Order { id: 1, product: 1 })?;
            self.ordered = Some(Instant::now());
        }
        Ok(phase == Some(Phase::Approaching))
    }
}
