//! The writer of `ring-64`: waits until its readers are ready, and is timed while it rings.

use core::time::Duration;
use std::error::Error;
use std::time::Instant;

use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc;
use lager_ports::{Clock, Publisher};
use lager_rig::Parent;
use lager_topics::{OBSERVERS, SensorLine, Stamp, Topic};

use super::{Contender, Listeners, Observed, Own, Round, samples};
use crate::baseline::iceoryx::{self, Member, Sender};
use crate::baseline::{Fault, broken};
use crate::error::{BenchError, no_bus};
use crate::pair;
use crate::report::Mode;
use crate::sample::{Ping, SENDER, Sample};
use crate::slow;

pub(super) fn writer(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(parent, |own| own, write)
}

/// Writes the samples of a round; what each took, in ns.
fn write(own: &Own, round: &Round) -> Result<Vec<u64>, BenchError> {
    let nothing = |_: &Sample| Ok(());
    let times = match round.what.contender {
        Contender::Lager => {
            let publisher = own.bus(SENDER)?.publisher::<Ping>().map_err(no_bus)?;
            timed(own, round, |sample| send(&publisher, sample), nothing)?
        }
        Contender::Ring => {
            let bus = own.bus(SENDER)?;
            let quiet = bus.publisher::<Observed>().map_err(no_bus)?;
            let loud = bus.publisher::<Ping>().map_err(no_bus)?;
            // The first of a pair goes where nobody is rung.
            let is_first = |sample: &Sample| sample.number().is_multiple_of(2);
            let publish = |sample: &Sample| match is_first(sample) {
                true => send(&quiet, sample),
                false => send(&loud, sample),
            };
            // The readers need a ring all the same, to go on.
            let ring = |sample: &Sample| match is_first(sample) {
                true => send(&loud, sample),
                false => Ok(()),
            };
            let times = timed(own, round, publish, ring)?;
            let pairs = times.chunks_exact(2);
            pairs.map(|pair| pair[1].saturating_sub(pair[0])).collect()
        }
        Contender::Notify(listeners) => {
            let member = Member::join(&own.config)?;
            let notifier = member.notifier(listeners.service(), listeners.count())?;
            timed(own, round, |_| notify(&notifier, listeners), nothing)?
        }
        Contender::Event(listeners) => {
            let member = Member::join(&own.config)?;
            let notifier = member.notifier(listeners.service(), listeners.count())?;
            let limits = Some(&SensorLine::QOS);
            let mut sender = Sender::<Stamp>::new(member.publisher(listeners.service(), limits)?);
            let publish = |sample: &Sample| {
                sender.send(sample)?;
                notify(&notifier, listeners)
            };
            timed(own, round, publish, nothing)?
        }
    };
    Ok(round.timed(times))
}

/// Publishes each sample of a round when the readers are ready for it; how long each took, in ns.
fn timed(
    own: &Own,
    round: &Round,
    mut publish: impl FnMut(&Sample) -> Result<(), Fault>,
    mut follow_up: impl FnMut(&Sample) -> Result<(), Fault>,
) -> Result<Vec<u64>, BenchError> {
    own.together(round, || {
        let mut times = Vec::with_capacity(samples(round).count());
        for number in samples(round) {
            let failed = |fault| round.failed(number, fault);
            await_readers(own, round.what.mode, number).map_err(failed)?;
            let sample = Sample::new(number);
            let before = Clock::monotonic_ns();
            publish(&sample).map_err(failed)?;
            times.push(Clock::monotonic_ns() - before);
            follow_up(&sample).map_err(failed)?;
        }
        Ok(times)
    })
}

/// Waits until the readers are ready, and for an actor that sleeps until it surely does.
fn await_readers(own: &Own, mode: Mode, number: u64) -> Result<(), Fault> {
    const TO_SLEEP: Duration = Duration::from_micros(60);
    own.memory().await_readers(number)?;
    let ready = Instant::now();
    while mode == Mode::Block && ready.elapsed() < TO_SLEEP {
        // It may be on this core.
        rustix::thread::sched_yield();
    }
    Ok(())
}

fn send<T: Topic<Payload = Sample>>(
    publisher: &Publisher<T>,
    sample: &Sample,
) -> Result<(), Fault> {
    let mut loan = publisher.loan().map_err(broken)?;
    *loan = *sample;
    if !T::QOS.actors.is_empty() {
        slow::publish(OBSERVERS);
    }
    loan.send().map_err(broken)
}

fn notify(notifier: &Notifier<ipc::Service>, listeners: Listeners) -> Result<(), Fault> {
    let notified = notifier.notify().map_err(iceoryx::broken)?;
    let count = listeners.count();
    if notified == count {
        Ok(())
    } else {
        Err(Fault::Broken(format!(
            "{notified} of {count} listeners were notified"
        )))
    }
}
