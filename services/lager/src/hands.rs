//! The operator's hands on the bus: everything that a person can do to the robot, and what is done
//! for a mission.
//!
//! One set of ports for `up` and for the one-shot commands, so that both act the same way. It
//! decides nothing.

use std::cell::Cell;
use std::time::Duration;

use anyhow::{Context, Result};
use lager_ports::{Bus, Cause, Client, Clock, Publisher};
use lager_topics::{
    Answer, Ask, BridgeRequest, Input, MissionOrder, OperatorInput, Order, SteeringCommand,
    SteeringOrder,
};

use crate::mission::Act;

/// How long the bridge may take to answer, in real time.
const ANSWER: Duration = Duration::from_millis(500);

/// How long a mission waits for an answer before the robot is looked at again, in real time.
const GLANCE: Duration = Duration::from_millis(100);

/// Publishers and the client of one operator.
pub struct Hands {
    order: Publisher<MissionOrder>,
    press: Publisher<OperatorInput>,
    steer: Publisher<SteeringCommand>,
    ask: Client<BridgeRequest>,
    /// The steering order given last and when it was first given.
    given: Cell<(u32, u64)>,
}

impl Hands {
    /// Opens every port an operator writes to.
    pub fn new(bus: &Bus) -> Result<Self> {
        Ok(Self {
            order: bus.publisher()?,
            press: bus.publisher()?,
            steer: bus.publisher()?,
            ask: bus.client()?,
            given: Cell::default(),
        })
    }

    /// An id that no order of this or an earlier process has had for the last hour: the
    /// milliseconds of the machine's clock.
    pub fn fresh_id() -> u32 {
        let milliseconds = Clock::monotonic_ns() / 1_000_000;
        u32::try_from(milliseconds & u64::from(u32::MAX))
            .unwrap_or_default()
            .max(1)
    }

    /// Does one thing for a mission. A bridge that does not answer is no error: it is asked again.
    pub fn carry_out(&self, act: Act) -> Result<()> {
        match act {
            Act::Ask(ask) => {
                if let Err(silence) = self.ask.call(ask, GLANCE) {
                    tracing::debug!(%silence, "the bridge does not answer yet");
                }
            }
            Act::Order(order) => self.fetch(order)?,
        }
        Ok(())
    }

    /// Asks the bridge and waits for its answer.
    pub fn ask(&self, ask: Ask) -> Result<Answer> {
        self.ask
            .call(ask, ANSWER)
            .context("the bridge does not answer; is the robot up? (`lager up`)")
    }

    /// Orders a product.
    pub fn fetch(&self, order: Order) -> Result<()> {
        self.order.send(Cause::OWN, order)?;
        Ok(())
    }

    /// Gives or renews a steering order; which of the two, its id says.
    pub fn steer(&self, order: SteeringOrder) -> Result<()> {
        let (id, mut given_ns) = self.given.get();
        if id != order.id || given_ns == 0 {
            given_ns = Clock::monotonic_ns();
            self.given.set((order.id, given_ns));
        }
        self.steer
            .send(Cause::OWN, SteeringOrder { given_ns, ..order })?;
        Ok(())
    }

    /// Presses a button.
    pub fn press(&self, input: Input) -> Result<()> {
        self.press.send(Cause::OWN, input)?;
        Ok(())
    }
}
