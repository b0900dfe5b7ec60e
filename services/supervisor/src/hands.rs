//! The ports through which an operator acts on the bus: orders, buttons, steering, and requests to
//! the bridge.
//!
//! The attendant uses them for a mission, and each one-shot command for its order, so that both act
//! the same way. They decide nothing.

use std::time::Duration;

use anyhow::{Context, Result};
use lager_operator::Act;
use lager_ports::{Bus, Cause, Client, Publisher};
use lager_topics::{
    Ask, BridgeAnswer, BridgeRequest, Input, MissionOrder, OperatorInput, Order, SteeringCommand,
    SteeringOrder,
};

/// How long a mission waits for an answer before it looks at the robot again, in real time.
const GLANCE: Duration = Duration::from_millis(100);

/// Publishers and the client of one operator.
pub struct Hands {
    order: Publisher<MissionOrder>,
    press: Publisher<OperatorInput>,
    steer: Publisher<SteeringCommand>,
    ask: Client<BridgeRequest>,
}

impl Hands {
    /// How long the bridge may take to answer, in real time.
    pub const ANSWER: Duration = Duration::from_millis(500);

    /// Opens every port an operator writes to.
    pub fn new(bus: &Bus) -> Result<Self> {
        Ok(Self {
            order: bus.publisher()?,
            press: bus.publisher()?,
            steer: bus.publisher()?,
            ask: bus.client()?,
        })
    }

    /// Does one thing for a mission. If the bridge does not answer, that is no error: it is asked
    /// again.
    pub fn carry_out(&self, act: Act) -> Result<()> {
        match act {
            Act::Ask { ask, .. } => {
                if let Err(silence) = self.ask.call(ask, GLANCE) {
                    tracing::debug!(%silence, "the bridge does not answer yet");
                }
            }
            Act::Order(order) => self.fetch(order)?,
            Act::Press(input) => self.press(input)?,
            // No mission asks a simulated world.
            Act::AskWorld { .. } => {}
        }
        Ok(())
    }

    /// Asks the bridge and waits for its answer.
    pub fn ask(&self, ask: Ask) -> Result<BridgeAnswer> {
        self.ask
            .call(ask, Self::ANSWER)
            .context("the bridge does not answer; is the robot up? (`lager up`)")
    }

    /// Orders a product.
    pub fn fetch(&self, order: Order) -> Result<()> {
        self.order.send(Cause::OWN, order)?;
        Ok(())
    }

    /// Gives or renews a steering order; which of the two, its id says.
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
