//! The writer of `ring-64`: waits until its audience is ready, and is timed while it rings.

use core::sync::atomic::Ordering;
use core::time::Duration;
use std::time::Instant;

use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc;
use lager_ports::{Clock, Publisher};
use lager_topics::{OBSERVERS, SensorLine, Stamp, Topic};

use super::{Contender, Listeners, Place, Round, Unheard, broken};
use crate::ball::{Ball, FIRST, Ping};
use crate::baseline::iceoryx::{self, Member, Sender};
use crate::baseline::{Fault, LIMIT};
use crate::error::BenchError;
use crate::error::no_bus;
use crate::parts::Stage;
use crate::report::Mode;
use crate::slow;

pub(super) fn ringer(stage: &mut Stage) -> Result<(), BenchError> {
    let Some(place) = Place::enter(stage)? else {
        return Ok(());
    };
    while let Some(round) = stage.hear::<Round>()? {
        slow::spins_for(round.spin_ns);
        let mut rope = Rope::tie(&place, round.contender)?;
        place.meet(&round, 1)?;
        let mut samples = Vec::with_capacity(round.balls as usize);
        for number in round.all() {
            place.await_readiness(&round, number)?;
            let ball = Ball::new(number);
            let before = Clock::monotonic_ns();
            rope.ring(&ball)
                .map_err(|fault| round.failed(number, fault))?;
            let cost = Clock::monotonic_ns() - before;
            match (&rope, samples.last_mut()) {
                // The second of a pair: what it costs more than the first.
                (Rope::Ring { unheard: false, .. }, Some(first)) => {
                    *first = cost.saturating_sub(*first);
                }
                _ => samples.push(cost),
            }
            rope.follow_up(&ball)
                .map_err(|fault| round.failed(number, fault))?;
        }
        place.meet(&round, 2)?;
        drop(rope);
        stage.tell(&samples)?;
    }
    Ok(())
}

impl Place {
    /// Waits until the audience is ready, and for one that sleeps until it surely does.
    fn await_readiness(&self, round: &Round, number: u64) -> Result<(), BenchError> {
        const TO_SLEEP: Duration = Duration::from_micros(60);
        let start = Instant::now();
        while self.hall.ready.load(Ordering::Acquire) != number {
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
}

/// The writer's ports.
// One of them lives at a time, so nothing is saved by making it smaller.
#[allow(clippy::large_enum_variant)]
enum Rope {
    Lager(Publisher<Ping>),
    Ring {
        quiet: Publisher<Unheard>,
        loud: Publisher<Ping>,
        /// Whether the last ball went where nobody is rung.
        unheard: bool,
    },
    Notify(Notifier<ipc::Service>, Listeners),
    Event(Notifier<ipc::Service>, Listeners, Sender<Stamp>),
}

impl Rope {
    fn tie(place: &Place, contender: Contender) -> Result<Self, BenchError> {
        Ok(match contender {
            Contender::Lager => Self::Lager(place.bus(FIRST)?.publisher().map_err(no_bus)?),
            Contender::Ring => {
                let bus = place.bus(FIRST)?;
                Self::Ring {
                    quiet: bus.publisher().map_err(no_bus)?,
                    loud: bus.publisher().map_err(no_bus)?,
                    unheard: false,
                }
            }
            Contender::Notify(listeners) => {
                Self::Notify(notifier(&place.member()?, listeners)?, listeners)
            }
            Contender::Event(listeners) => {
                let member = place.member()?;
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
    fn ring(&mut self, ball: &Ball) -> Result<(), Fault> {
        match self {
            Self::Lager(publisher) => send(publisher, ball),
            Self::Ring {
                quiet,
                loud,
                unheard,
            } => {
                *unheard = !*unheard;
                if *unheard {
                    send(quiet, ball)
                } else {
                    send(loud, ball)
                }
            }
            Self::Notify(notifier, listeners) => notify(notifier, *listeners),
            Self::Event(notifier, listeners, sender) => {
                sender.send(ball)?;
                notify(notifier, *listeners)
            }
        }
    }

    /// What the audience needs besides, to go on.
    fn follow_up(&mut self, ball: &Ball) -> Result<(), Fault> {
        match self {
            Self::Ring {
                loud,
                unheard: true,
                ..
            } => send(loud, ball),
            _ => Ok(()),
        }
    }
}

fn send<T: Topic<Payload = Ball>>(publisher: &Publisher<T>, ball: &Ball) -> Result<(), Fault> {
    let mut loan = publisher.loan().map_err(broken)?;
    *loan = *ball;
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
