//! The writer of `ring-64`: waits until its readers are ready, and is timed while it rings.

use core::sync::atomic::Ordering;
use core::time::Duration;
use std::error::Error;
use std::time::Instant;

use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc;
use lager_ports::{Clock, Publisher};
use lager_rig::Parent;
use lager_topics::{OBSERVERS, SensorLine, Stamp, Topic};

use super::{Contender, Listeners, Observed, Own, Round};
use crate::baseline::iceoryx::{self, Member, Sender};
use crate::baseline::{Fault, LIMIT, broken};
use crate::error::{BenchError, no_bus};
use crate::report::Mode;
use crate::sample::{Ping, SENDER, Sample};
use crate::slow;

pub(super) fn writer(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some(own) = Own::enter(parent)? else {
        return Ok(());
    };
    while let Some(round) = parent.hear::<Round>()? {
        slow::spins_for(round.spin_ns);
        let mut ports = Ports::open(&own, round.contender)?;
        let times = own.together(round.number, || write(&own, &round, &mut ports))?;
        drop(ports);
        parent.say(&times)?;
    }
    Ok(())
}

/// Writes the samples of a round; what each took, in ns.
fn write(own: &Own, round: &Round, ports: &mut Ports) -> Result<Vec<u64>, BenchError> {
    let mut times: Vec<u64> = Vec::with_capacity(round.samples);
    for number in round.all() {
        await_readiness(own, round, number)?;
        let sample = Sample::new(number);
        let before = Clock::monotonic_ns();
        ports
            .send(&sample)
            .map_err(|fault| round.failed(number, fault))?;
        let cost = Clock::monotonic_ns() - before;
        match (&*ports, times.last_mut()) {
            // The second of a pair: what it costs more than the first.
            (
                Ports::Ring {
                    is_quiet: false, ..
                },
                Some(first),
            ) => {
                *first = cost.saturating_sub(*first);
            }
            _ => times.push(cost),
        }
        ports
            .follow_up(&sample)
            .map_err(|fault| round.failed(number, fault))?;
    }
    Ok(times)
}

/// Waits until the readers are ready, and for an actor that sleeps until it surely does.
fn await_readiness(own: &Own, round: &Round, number: u64) -> Result<(), BenchError> {
    const TO_SLEEP: Duration = Duration::from_micros(60);
    let start = Instant::now();
    while own.memory().number.load(Ordering::Acquire) != number {
        if start.elapsed() > LIMIT {
            return Err(round.failed(number, Fault::Silent));
        }
        rustix::thread::sched_yield();
    }
    if round.mode == Mode::Block {
        let ready = Instant::now();
        while ready.elapsed() < TO_SLEEP {
            // It may be on this core.
            rustix::thread::sched_yield();
        }
    }
    Ok(())
}

/// The writer's ports.
// One of them lives at a time, so nothing is saved by making it smaller.
#[allow(clippy::large_enum_variant)]
enum Ports {
    Lager(Publisher<Ping>),
    Ring {
        quiet: Publisher<Observed>,
        loud: Publisher<Ping>,
        /// Whether the last sample went where nobody is rung.
        is_quiet: bool,
    },
    Notify(Notifier<ipc::Service>, Listeners),
    Event(Notifier<ipc::Service>, Listeners, Sender<Stamp>),
}

impl Ports {
    fn open(own: &Own, contender: Contender) -> Result<Self, BenchError> {
        Ok(match contender {
            Contender::Lager => Self::Lager(own.bus(SENDER)?.publisher().map_err(no_bus)?),
            Contender::Ring => {
                let bus = own.bus(SENDER)?;
                Self::Ring {
                    quiet: bus.publisher().map_err(no_bus)?,
                    loud: bus.publisher().map_err(no_bus)?,
                    is_quiet: false,
                }
            }
            Contender::Notify(listeners) => {
                Self::Notify(notifier(&Member::join(&own.config)?, listeners)?, listeners)
            }
            Contender::Event(listeners) => {
                let member = Member::join(&own.config)?;
                let publisher = member.publisher(listeners.service(), Some(&SensorLine::QOS))?;
                Self::Event(
                    notifier(&member, listeners)?,
                    listeners,
                    Sender::new(publisher),
                )
            }
        })
    }

    /// What is timed.
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        match self {
            Self::Lager(publisher) => send(publisher, sample),
            Self::Ring {
                quiet,
                loud,
                is_quiet,
            } => {
                *is_quiet = !*is_quiet;
                if *is_quiet {
                    send(quiet, sample)
                } else {
                    send(loud, sample)
                }
            }
            Self::Notify(notifier, listeners) => notify(notifier, *listeners),
            Self::Event(notifier, listeners, sender) => {
                sender.send(sample)?;
                notify(notifier, *listeners)
            }
        }
    }

    /// What the readers need besides, to go on.
    fn follow_up(&mut self, sample: &Sample) -> Result<(), Fault> {
        match self {
            Self::Ring {
                loud,
                is_quiet: true,
                ..
            } => send(loud, sample),
            _ => Ok(()),
        }
    }
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

fn notifier(member: &Member, listeners: Listeners) -> Result<Notifier<ipc::Service>, BenchError> {
    member.notifier(listeners.service(), listeners.count())
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
