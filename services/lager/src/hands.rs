//! The operator's hands on the bus: everything a person, or the script, can do to the robot.
//!
//! One set of ports for `up` and for the one-shot commands, so that both act the same way. It
//! decides nothing.

use std::time::Duration;

use anyhow::{Context, Result};
use lager_ports::{Bus, Cause, Client, Clock, Publisher};
use lager_topics::{
    Answer, Ask, BridgeRequest, Input, MissionOrder, NavMap, OperatorInput, Order, SteeringCommand,
    SteeringOrder, WarehouseMap,
};

use crate::operator::Act;

/// How long the bridge may take to answer, in real time.
const ANSWER: Duration = Duration::from_millis(500);

/// Publishers and the client of one operator.
pub struct Hands {
    map: Publisher<NavMap>,
    order: Publisher<MissionOrder>,
    press: Publisher<OperatorInput>,
    steer: Publisher<SteeringCommand>,
    ask: Client<BridgeRequest>,
}

impl Hands {
    /// Opens every port an operator writes to.
    pub fn new(bus: &Bus) -> Result<Self> {
        Ok(Self {
            map: bus.publisher()?,
            order: bus.publisher()?,
            press: bus.publisher()?,
            steer: bus.publisher()?,
            ask: bus.client()?,
        })
    }

    /// An id that no order of this or an earlier process has had for the last hour: the
    /// milliseconds of the machine's clock.
    pub fn fresh_id() -> u32 {
        let milliseconds = Clock::monotonic_ns() / 1_000_000;
        u32::try_from(milliseconds & u64::from(u32::MAX)).unwrap_or(1)
    }

    /// Tells the robot its warehouse; late joiners get it too.
    pub fn publish_map(&self, map: &WarehouseMap) -> Result<()> {
        self.map.send(Cause::OWN, *map)?;
        Ok(())
    }

    /// Lets late joiners have the map.
    pub fn tick(&self) {
        self.map.tick();
    }

    /// Does one thing of the script. A bridge that does not answer is no error: the script asks
    /// again.
    pub fn carry_out(&self, act: Act) -> Result<()> {
        match act {
            Act::Ask(ask) => {
                if let Err(silence) = self.ask.call(ask, Duration::from_millis(20)) {
                    tracing::debug!(%silence, "the bridge does not answer yet");
                }
            }
            Act::Order(order) => self.fetch(order)?,
            Act::Steer(order) => self.steer(order)?,
            Act::Press(input) => self.press(input)?,
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

    /// Gives or renews a steering order.
    pub fn steer(&self, order: SteeringOrder) -> Result<()> {
        self.steer.send(Cause::OWN, order)?;
        Ok(())
    }

    /// Presses a button.
    pub fn press(&self, input: Input) -> Result<()> {
        self.press.send(Cause::OWN, input)?;
        Ok(())
    }
}
