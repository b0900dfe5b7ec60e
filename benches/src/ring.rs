//! `ring-64`: what it costs a writer to wake the one actor of a topic that 64 observers read.
//!
//! ```text
//!   ringer, core 0                      audience, core 1: an actor and 64 observers
//!                    <── ready ─────── all drained, the actor waits (mode: asleep or looking)
//!   t0  publish, ring ───────────────>
//!   t1                                 the actor wakes, everybody drains
//! ```
//!
//! Timed is `t1 - t0`, what the writer is kept from its work: the typed ports publish and ring;
//! bare iceoryx2 publishes the same and notifies a listener of each reader (`event`).
//!
//! The ringing alone is what it costs more to publish on a topic with an actor than on one with as
//! many readers but no actor, measured in pairs (`lager/ring`); it compares with iceoryx2 notifying
//! without publishing anything (`notify`).

use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;
use std::os::fd::RawFd;
use std::path::PathBuf;
use std::time::Instant;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::subscriber::Subscriber as BareSubscriber;
use iceoryx2::prelude::ipc;
use lager_ports::{Bus, BusConfig, Clock, Policy, Publisher, Subscriber, Waiter};
use lager_topics::{OBSERVERS, Qos, Role, SensorLine, Stamp, Topic};
use serde::{Deserialize, Serialize};

use crate::ball::{Ball, FIRST, Ping, SECOND};
use crate::baseline::iceoryx::{self, Member, Sender};
use crate::baseline::{Fault, LIMIT, TIME_OUT};
use crate::domain::Domain;
use crate::error::BenchError;
use crate::hop::no_bus;
use crate::machine::{self, Awake};
use crate::parts::{Part, Play, Stage};
use crate::report::{Mode, Options, Regime, Row};
use crate::run::{self, Entry};
use crate::shared::{Barrier, Board, Shared};
use crate::slow;

const RINGER: &str = "ringer";
const AUDIENCE: &str = "audience of the ringer";

pub(crate) const PARTS: &[(&str, Play)] = &[(RINGER, ringer), (AUDIENCE, audience)];

/// The same as [`Ping`], but nobody acts on it.
struct Unheard;

impl Topic for Unheard {
    const NAME: &'static str = "bench/unheard";
    type Payload = Ball;
    const QOS: Qos = Qos {
        actors: &[],
        ..Ping::QOS
    };
    const SUMMARY: &'static str = "What observers alone read, during a measurement.";
}

/// Who rings how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Contender {
    /// The typed ports publish and ring.
    Lager,
    /// The same, less what it costs to publish where nobody is to be rung.
    Ring,
    /// Bare iceoryx2 notifies a listener of each reader.
    Notify,
    /// Bare iceoryx2 publishes and then notifies.
    Event,
}

impl Contender {
    const ALL: [Self; 4] = [Self::Lager, Self::Ring, Self::Event, Self::Notify];

    fn entry(self, mode: Mode) -> Entry {
        let (name, variant, against): (_, _, &[&str]) = match self {
            Self::Lager => ("lager", "", &["iceoryx2/event"]),
            Self::Ring => ("lager", "ring", &["iceoryx2/notify"]),
            Self::Notify => ("iceoryx2", "notify", &[]),
            Self::Event => ("iceoryx2", "event", &[]),
        };
        Entry {
            name,
            variant,
            mode,
            against,
        }
    }
}

/// The rows of this scenario in one regime: `block` with an actor that sleeps when it is rung,
/// `spin` with one that looks.
pub(crate) fn measure(regime: Regime, options: &Options) -> Result<Vec<Row>, BenchError> {
    let mut rows = Vec::new();
    for mode in [Mode::Spin, Mode::Block] {
        let shares_its_core = regime == Regime::SameCore && mode == Mode::Spin;
        if !options.modes.contains(&mode) || shares_its_core {
            continue;
        }
        let entries: Vec<Entry> = Contender::ALL.iter().map(|one| one.entry(mode)).collect();
        let mut session = Session::open(regime)?;
        let (rounds, balls) = if options.quick { (2, 100) } else { (4, 500) };
        rows.extend(run::measure(
            "ring-64",
            regime,
            &entries,
            options,
            rounds,
            |index| session.round(Contender::ALL[index], mode, balls),
        )?);
    }
    Ok(rows)
}

#[derive(Debug)]
#[repr(C)]
struct Hall {
    barrier: Barrier,
    /// The ball that the audience is ready for.
    ready: AtomicU64,
}

// SAFETY: atomics only.
#[allow(unsafe_code)]
unsafe impl Board for Hall {}

#[derive(Debug, Serialize, Deserialize)]
struct Setup {
    core: usize,
    prefix: String,
    root: PathBuf,
    hall: RawFd,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Round {
    contender: Contender,
    mode: Mode,
    balls: u32,
    number: u32,
}

impl Round {
    /// The numbers of the balls; those of [`Contender::Ring`] come in pairs.
    fn all(&self) -> impl Iterator<Item = u64> {
        let base = u64::from(self.number) << 32;
        let throws = if self.contender == Contender::Ring {
            2
        } else {
            1
        };
        (1..=throws * u64::from(self.balls)).map(move |ball| base + ball)
    }

    fn failed(&self, ball: u64, fault: Fault) -> BenchError {
        let contender = self.contender.entry(self.mode).label();
        match fault {
            Fault::Silent => BenchError::NoSample {
                contender,
                expected: ball & u64::from(u32::MAX),
                limit: LIMIT,
            },
            Fault::Broken(detail) => BenchError::Carrier { contender, detail },
        }
    }
}

/// Both processes. Dropped in this order: nobody is on the bus when it is swept.
struct Session {
    ringer: Part,
    audience: Part,
    _awake: Awake,
    _hall: Shared<Hall>,
    _domain: Domain,
    rounds: u32,
}

impl Session {
    fn open(regime: Regime) -> Result<Self, BenchError> {
        let cores = machine::cores_for(regime)?;
        let domain = Domain::new()?;
        let hall = Shared::<Hall>::new()?;
        let awake = Awake::during(regime)?;
        let start = |name, core| {
            let mut part = Part::start(name)?;
            let () = part.ask(&Setup {
                core,
                prefix: domain.prefix().to_owned(),
                root: domain.root().to_owned(),
                hall: hall.number(),
            })?;
            Ok::<Part, BenchError>(part)
        };
        Ok(Self {
            ringer: start(RINGER, cores.0)?,
            audience: start(AUDIENCE, cores.1)?,
            _awake: awake,
            _hall: hall,
            _domain: domain,
            rounds: 0,
        })
    }

    fn round(
        &mut self,
        contender: Contender,
        mode: Mode,
        balls: u32,
    ) -> Result<Vec<u64>, BenchError> {
        const PATIENCE: Duration = Duration::from_secs(60);
        self.rounds += 1;
        let round = Round {
            contender,
            mode,
            balls,
            number: self.rounds,
        };
        self.ringer.tell(&round)?;
        self.audience.tell(&round)?;
        Part::both(&mut self.ringer, &mut self.audience, PATIENCE).map(|(samples, ())| samples)
    }
}

/// What a process has at hand all the time.
struct Place {
    hall: Shared<Hall>,
    config: BusConfig,
}

impl Place {
    fn enter(stage: &mut Stage) -> Result<Option<Self>, BenchError> {
        let Some(setup) = stage.hear::<Setup>()? else {
            return Ok(None);
        };
        machine::pin(setup.core)?;
        let place = Self {
            hall: Shared::inherited(setup.hall)?,
            config: BusConfig {
                prefix: Some(setup.prefix),
                root: Some(setup.root),
                ..BusConfig::default()
            },
        };
        stage.tell(&())?;
        Ok(Some(place))
    }

    fn bus(&self, role: Role) -> Result<Bus, BenchError> {
        Bus::open(&self.config, role).map_err(no_bus)
    }

    fn member(&self) -> Result<Member, BenchError> {
        let prefix = self.config.prefix.as_deref().unwrap_or_default();
        Member::join(prefix, self.config.root.as_deref().unwrap_or("".as_ref()))
    }

    /// Twice in each round: when everybody is there, and when everybody is done.
    fn meet(&self, round: &Round, times: u32) -> Result<(), BenchError> {
        const LIMIT: Duration = Duration::from_secs(15);
        if self
            .hall
            .barrier
            .pass(2, 2 * (round.number - 1) + times, LIMIT)
        {
            Ok(())
        } else {
            Err(BenchError::Alone { limit: LIMIT })
        }
    }
}

fn ringer(stage: &mut Stage) -> Result<(), BenchError> {
    let Some(place) = Place::enter(stage)? else {
        return Ok(());
    };
    while let Some(round) = stage.hear::<Round>()? {
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
    Notify(Notifier<ipc::Service>),
    Event(Notifier<ipc::Service>, Sender<Stamp>),
}

const BARE: &str = "bench/bare-ring";

/// A listener for each observer and one for the actor.
const LISTENERS: usize = OBSERVERS + 1;

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
            Contender::Notify => Self::Notify(place.member()?.notifier(BARE, LISTENERS)?),
            Contender::Event => {
                let member = place.member()?;
                Self::Event(
                    member.notifier(BARE, LISTENERS)?,
                    Sender::new(member.publisher(BARE, Some(&SensorLine::QOS))?),
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
            Self::Notify(notifier) => notify(notifier),
            Self::Event(notifier, sender) => {
                sender.send(ball)?;
                notify(notifier)
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

fn notify(notifier: &Notifier<ipc::Service>) -> Result<(), Fault> {
    let notified = notifier.notify().map_err(iceoryx::broken)?;
    if notified == LISTENERS {
        Ok(())
    } else {
        Err(Fault::Broken(format!(
            "{notified} of {LISTENERS} listeners were notified"
        )))
    }
}

fn broken(error: impl core::fmt::Display) -> Fault {
    Fault::Broken(error.to_string())
}

fn audience(stage: &mut Stage) -> Result<(), BenchError> {
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
            Contender::Notify | Contender::Event => {
                let member = place.member()?;
                Self::Bare {
                    listeners: (0..LISTENERS)
                        .map(|_| member.listener(BARE, LISTENERS))
                        .collect::<Result<_, _>>()?,
                    subscribers: (0..LISTENERS)
                        .map(|_| member.subscriber(BARE, Some(&SensorLine::QOS)))
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
