//! The typed ports as an end of the hop: publish, wait, receive, as every service does it.

use std::time::Instant;

use lager_ports::{Bus, Policy, Publisher, Subscriber, Waiter};
use lager_topics::Topic;

use crate::baseline::{End, Fault, LIMIT, TIME_OUT, broken};
use crate::error::{BenchError, no_bus};
use crate::sample::Sample;
use crate::slow;

/// An end that publishes to `Out` and waits for `Back`.
pub(super) struct Ours<Out: Topic, Back: Topic> {
    publisher: Publisher<Out>,
    subscriber: Subscriber<Back>,
    waiter: Waiter,
}

impl<Out, Back> Ours<Out, Back>
where
    Out: Topic<Payload = Sample>,
    Back: Topic<Payload = Sample>,
{
    pub(super) fn open(bus: &Bus, policy: Policy) -> Result<Self, BenchError> {
        Ok(Self {
            subscriber: bus.subscriber().map_err(no_bus)?,
            waiter: bus.waiter(policy).map_err(no_bus)?,
            publisher: bus.publisher().map_err(no_bus)?,
        })
    }
}

impl<Out, Back> End for Ours<Out, Back>
where
    Out: Topic<Payload = Sample>,
    Back: Topic<Payload = Sample>,
{
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        let mut loan = self.publisher.loan().map_err(broken)?;
        *loan = *sample;
        slow::publish(0);
        loan.send().map_err(broken)
    }

    fn receive(&mut self) -> Result<Sample, Fault> {
        let mut start = None;
        loop {
            self.waiter.wait(TIME_OUT);
            // A sample may be found before its ring, which then ends the next wait for nothing.
            if self.waiter.has::<Back>()
                && let Some(received) = self.subscriber.receive().map_err(broken)?
            {
                return Ok(*received);
            }
            if start.get_or_insert_with(Instant::now).elapsed() > LIMIT {
                return Err(Fault::Silent);
            }
        }
    }
}
