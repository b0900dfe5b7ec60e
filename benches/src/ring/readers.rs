//! The readers of `ring-64`, all in one process: an actor that is rung, and observers.

use core::sync::atomic::Ordering;
use std::time::Instant;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::subscriber::Subscriber as BareSubscriber;
use iceoryx2::prelude::ipc;
use lager_ports::{Policy, Subscriber, Waiter};
use lager_topics::{OBSERVERS, Role, SensorLine, Stamp, Topic};

use super::{Contender, Place, Round, Unheard, broken};
use crate::ball::{Ball, Ping, SECOND};
use crate::baseline::iceoryx;
use crate::baseline::{Fault, LIMIT, TIME_OUT};
use crate::error::BenchError;
use crate::error::no_bus;
use crate::parts::Stage;
use crate::report::Mode;

pub(super) fn audience(stage: &mut Stage) -> Result<(), BenchError> {
    let Some(place) = Place::enter(stage)? else {
        return Ok(());
    };
    while let Some(round) = stage.hear::<Round>()? {
        let mut seats = Seats::take(&place, round.contender, round.mode)?;
        place.meet(&round, 1)?;
        for number in round.all() {
            seats.drain().map_err(|fault| round.failed(number, fault))?;
            place.hall.ready.store(number, Ordering::Release);
            seats
                .until_rung(round.mode)
                .map_err(|fault| round.failed(number, fault))?;
        }
        place.meet(&round, 2)?;
        drop(seats);
        stage.tell(&())?;
    }
    Ok(())
}

/// The readers' ports.
// One of them lives at a time, so nothing is saved by making it smaller.
#[allow(clippy::large_enum_variant)]
enum Seats {
    Lager {
        actor: Subscriber<Ping>,
        waiter: Waiter,
        observers: Vec<Subscriber<Ping>>,
        unheard: Vec<Subscriber<Unheard>>,
    },
    Bare {
        listeners: Vec<Listener<ipc::Service>>,
        subscribers: Vec<BareSubscriber<ipc::Service, Ball, Stamp>>,
    },
}

impl Seats {
    fn take(place: &Place, contender: Contender, mode: Mode) -> Result<Self, BenchError> {
        let policy = match mode {
            Mode::Spin => Policy::Spin,
            Mode::Adaptive => Policy::ADAPTIVE,
            Mode::Block => Policy::Block,
        };
        Ok(match contender {
            Contender::Lager | Contender::Ring => {
                let actor = place.bus(SECOND)?;
                let mut unheard = Vec::new();
                if contender == Contender::Ring {
                    // As many readers as the other topic has; one of them is not an observer.
                    unheard = observers(place, OBSERVERS)?;
                    unheard.push(actor.subscriber().map_err(no_bus)?);
                }
                Self::Lager {
                    actor: actor.subscriber().map_err(no_bus)?,
                    waiter: actor.waiter(policy).map_err(no_bus)?,
                    observers: observers(place, OBSERVERS)?,
                    unheard,
                }
            }
            Contender::Notify(listeners) | Contender::Event(listeners) => {
                let member = place.member()?;
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
                unheard,
                ..
            } => {
                drain(actor)?;
                observers.iter_mut().try_for_each(drain)?;
                unheard.iter_mut().try_for_each(drain)
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

fn observers<T: Topic>(place: &Place, number: usize) -> Result<Vec<Subscriber<T>>, BenchError> {
    let bus = place.bus(Role::Observer)?;
    (0..number)
        .map(|_| bus.subscriber().map_err(no_bus))
        .collect()
}

fn drain<T: Topic>(subscriber: &mut Subscriber<T>) -> Result<(), Fault> {
    while subscriber.receive().map_err(broken)?.is_some() {}
    Ok(())
}
