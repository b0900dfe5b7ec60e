//! The readers of `ring-64`, all in one process: an actor that is rung, and observers.

use std::error::Error;
use std::time::Instant;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::subscriber::Subscriber as BareSubscriber;
use iceoryx2::prelude::ipc;
use lager_ports::{Subscriber, Waiter};
use lager_rig::Parent;
use lager_topics::{OBSERVERS, Role, SensorLine, Stamp, Topic};

use super::{Contender, Job, Observed, Own, Round, samples};
use crate::baseline::iceoryx::{self, Member};
use crate::baseline::{Fault, LIMIT, TIME_OUT, broken};
use crate::error::{BenchError, no_bus};
use crate::pair;
use crate::report::Mode;
use crate::sample::{Ping, RECEIVER, Sample};

pub(super) fn readers(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(parent, |own| own, read)
}

/// Reads the samples of a round, and has no times to tell.
fn read(own: &Own, round: &Round) -> Result<Vec<u64>, BenchError> {
    let Job { contender, mode } = round.what;
    let mut ports = Ports::open(own, contender, mode)?;
    own.together(round, || {
        for number in samples(round) {
            let failed = |fault| round.failed(number, fault);
            ports.drain().map_err(failed)?;
            own.memory().are_ready_for(number);
            ports.until_rung(mode).map_err(failed)?;
        }
        Ok(Vec::new())
    })
}

/// The readers' ports.
// One of them lives at a time, so nothing is saved by making it smaller.
#[allow(clippy::large_enum_variant)]
enum Ports {
    Lager {
        actor: Subscriber<Ping>,
        waiter: Waiter,
        observers: Vec<Subscriber<Ping>>,
        observed: Vec<Subscriber<Observed>>,
    },
    Bare {
        listeners: Vec<Listener<ipc::Service>>,
        subscribers: Vec<BareSubscriber<ipc::Service, Sample, Stamp>>,
    },
}

impl Ports {
    fn open(own: &Own, contender: Contender, mode: Mode) -> Result<Self, BenchError> {
        Ok(match contender {
            Contender::Lager | Contender::Ring => {
                let actor = own.bus(RECEIVER)?;
                let mut observed = Vec::new();
                if contender == Contender::Ring {
                    // As many readers as the other topic has; one of them is not an observer.
                    observed = observers(own, OBSERVERS)?;
                    observed.push(actor.subscriber().map_err(no_bus)?);
                }
                Self::Lager {
                    actor: actor.subscriber().map_err(no_bus)?,
                    waiter: actor.waiter(mode.policy()).map_err(no_bus)?,
                    observers: observers(own, OBSERVERS)?,
                    observed,
                }
            }
            Contender::Notify(listeners) | Contender::Event(listeners) => {
                let member = Member::join(&own.config)?;
                let (service, count) = (listeners.service(), listeners.count());
                Self::Bare {
                    listeners: (0..count)
                        .map(|_| member.listener(service, count))
                        .collect::<Result<_, _>>()?,
                    subscribers: (0..=OBSERVERS)
                        .map(|_| member.subscriber(service, Some(&SensorLine::QOS)))
                        .collect::<Result<_, _>>()?,
                }
            }
        })
    }

    /// Takes everything that has come, for everybody.
    fn drain(&mut self) -> Result<(), Fault> {
        match self {
            Self::Lager {
                actor,
                observers,
                observed,
                ..
            } => {
                drain(actor)?;
                observers.iter_mut().try_for_each(drain)?;
                observed.iter_mut().try_for_each(drain)
            }
            Self::Bare {
                listeners,
                subscribers,
                ..
            } => {
                for listener in listeners {
                    listener.try_wait(|_| ()).map_err(iceoryx::broken)?;
                }
                for subscriber in subscribers {
                    while iceoryx::receive(subscriber)?.is_some() {}
                }
                Ok(())
            }
        }
    }

    /// Waits as the actor, until it is rung.
    fn until_rung(&mut self, mode: Mode) -> Result<(), Fault> {
        let start = Instant::now();
        loop {
            let rung = match self {
                Self::Lager { actor, waiter, .. } => {
                    waiter.wait(TIME_OUT);
                    actor.receive().map_err(broken)?.is_some()
                }
                Self::Bare { listeners, .. } => {
                    let rings = if mode == Mode::Spin {
                        listeners[0].try_wait(|_| ())
                    } else {
                        listeners[0].timed_wait(|_| (), TIME_OUT)
                    };
                    rings.map_err(iceoryx::broken)? > 0
                }
            };
            if rung {
                return Ok(());
            }
            if start.elapsed() > LIMIT {
                return Err(Fault::Silent);
            }
        }
    }
}

fn observers<T: Topic>(own: &Own, number: usize) -> Result<Vec<Subscriber<T>>, BenchError> {
    let bus = own.bus(Role::Observer)?;
    (0..number)
        .map(|_| bus.subscriber().map_err(no_bus))
        .collect()
}

fn drain<T: Topic>(subscriber: &mut Subscriber<T>) -> Result<(), Fault> {
    while subscriber.receive().map_err(broken)?.is_some() {}
    Ok(())
}
