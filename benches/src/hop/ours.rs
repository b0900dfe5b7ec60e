//! The typed ports as an end of the hop: publish, wait, receive, as every service does it.

use std::time::Instant;

use lager_ports::{Bus, BusConfig, Policy, Publisher, Subscriber, Waiter};
use lager_topics::Topic;

use crate::ball::{Ball, FIRST, Ping, Pong, SECOND};
use crate::baseline::{End, Fault, LIMIT, TIME_OUT};
use crate::error::{BenchError, no_bus};
use crate::slow;

/// An end that publishes to `Out` and waits for `Back`.
pub(crate) struct Ours<Out: Topic, Back: Topic> {
    publisher: Publisher<Out>,
    subscriber: Subscriber<Back>,
    waiter: Waiter,
}

/// The first process's end.
pub(crate) fn first(config: &BusConfig, policy: Policy) -> Result<Ours<Ping, Pong>, BenchError> {
    Ours::open(&Bus::open(config, FIRST).map_err(no_bus)?, policy)
}

/// The second process's end.
pub(crate) fn second(config: &BusConfig, policy: Policy) -> Result<Ours<Pong, Ping>, BenchError> {
    Ours::open(&Bus::open(config, SECOND).map_err(no_bus)?, policy)
}

impl<Out, Back> Ours<Out, Back>
where
    Out: Topic<Payload = Ball>,
    Back: Topic<Payload = Ball>,
{
    fn open(bus: &Bus, policy: Policy) -> Result<Self, BenchError> {
        Ok(Self {
            subscriber: bus.subscriber().map_err(no_bus)?,
            waiter: bus.waiter(policy).map_err(no_bus)?,
            publisher: bus.publisher().map_err(no_bus)?,
        })
    }
}

impl<Out, Back> End for Ours<Out, Back>
where
    Out: Topic<Payload = Ball>,
    Back: Topic<Payload = Ball>,
{
    fn send(&mut self, ball: &Ball) -> Result<(), Fault> {
        let mut loan = self.publisher.loan().map_err(broken)?;
        *loan = *ball;
        slow::publish(0);
        loan.send().map_err(broken)
    }

    fn receive(&mut self) -> Result<Ball, Fault> {
        let mut start = None;
        loop {
            self.waiter.wait(TIME_OUT);
            // A sample may be found before its ring, which then ends the next wait for nothing.
            if self.waiter.has::<Back>()
                && let Some(sample) = self.subscriber.receive().map_err(broken)?
            {
                return Ok(*sample);
            }
            if start.get_or_insert_with(Instant::now).elapsed() > LIMIT {
                return Err(Fault::Silent);
            }
        }
    }
}

fn broken(error: impl core::fmt::Display) -> Fault {
    Fault::Broken(error.to_string())
}
