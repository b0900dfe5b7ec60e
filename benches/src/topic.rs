//! `topic`: how late a running bus's samples come to a reader, of any topic, a user's own too.
//!
//! ```text
//!   source_time ──> publish_time ~~~~~~~~> received        by one clock, CLOCK_MONOTONIC
//!                        |<-- service ------->|            the report's line `from its sending`
//!        |<------------- response ----------->|            its first line
//! ```
//!
//! | row | mode | who it is |
//! |---|---|---|
//! | `observer` | `poll` | looks every millisecond, as `lager topic delay` does; nobody wakes it |
//! | `actor` | `block`, `adaptive`, `spin` | is rung, as the topic's own actors are |
//!
//! It only reads. An actor takes a seat and a place of a part that the topic wakes, of which each has
//! several; so its writers ring one process more, which costs them a wake a sample. It publishes
//! nothing and holds no lock of a service, so who commands the robot stays who it was. Only the table
//! of the robot's topics says whom a topic wakes; of other topics there is only the observer.

use core::time::Duration;
use std::time::Instant;

use lager_home::Clock;
use lager_ports::{Bus, BusConfig, Layout, Look, Place as _, Source, TopicInfo};
use lager_rig::interrupted;
use lager_sample::{Part, Stamp, Topic};
use lager_topics::{Role, TopicVisitor, visit};
use serde::Serialize;

use crate::baseline::TIME_OUT;
use crate::error::BenchError;
use crate::group::{Entry, Group, Session};
use crate::report::{Mode, Options, Regime, Report};
use crate::rounds::Taken;
use lager_machine::{Machine, Observed};

/// The time between two looks of the observer.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// After so long a silence a round ends.
const SILENCE: Duration = Duration::from_secs(10);

/// Samples of a round, unless others are asked for: with `--quick`, and without.
const SAMPLES: [usize; 2] = [100, 1_000];

const OBSERVER: &str = "observer";
const ACTOR: &str = "actor";

/// Measures a topic of the bus: a row for each mode of `options`.
///
/// # Errors
/// The topic is not there, it wakes nobody and an actor is asked for, no sample came, or the bus
/// cannot be read.
pub fn measure(config: &BusConfig, name: &str, options: &Options) -> Result<Report, BenchError> {
    let entry = |mode: &Mode| match mode {
        Mode::Poll => Entry::new(OBSERVER, *mode, &[]),
        _ => Entry::new(ACTOR, *mode, &[]),
    };
    let entries: Vec<_> = options.modes.iter().map(entry).collect();
    let observed = Observed::begin(None);
    let heard = Heard {
        config: config.clone(),
        name: name.to_owned(),
        modes: options.modes.clone(),
    };
    heard.must_be_there()?;
    let group = Group {
        what: name.to_owned(),
        regime: Regime::Plain,
        entries,
        rounds: [1; 2],
        samples: SAMPLES,
        open: Box::new(move || Ok(Box::new(heard.clone()))),
    };
    Ok(Report {
        rows: group.measure(options)?,
        machine: Machine::here().to_string(),
        conditions: Some(observed.end()),
    })
}

/// The topic to listen to.
#[derive(Clone)]
struct Heard {
    config: BusConfig,
    name: String,
    modes: Vec<Mode>,
}

impl Heard {
    fn open(&self, part: impl Into<Part>) -> Result<Bus, BenchError> {
        Bus::open(&self.config, part).map_err(unreadable)
    }

    fn info(&self, bus: &Bus) -> Result<TopicInfo, BenchError> {
        let topics = bus.every_topic().map_err(unreadable)?;
        let mut topics = topics.into_iter();
        topics
            .find(|topic| topic.name == self.name)
            .ok_or_else(|| BenchError::NoTopic(self.name.clone(), self.config.unit.to_string()))
    }

    /// Refuses what cannot be measured, before anything is.
    fn must_be_there(&self) -> Result<(), BenchError> {
        let info = self.info(&self.open(Role::Observer)?)?;
        let acts = self.modes.iter().any(|mode| *mode != Mode::Poll);
        if acts && self.part(&info).is_none() {
            return Err(BenchError::NotWoken(self.name.clone()));
        }
        Ok(())
    }

    /// The part whose processes the topic wakes, if the table says so.
    fn part(&self, info: &TopicInfo) -> Option<Part> {
        let entry = info.entry.filter(|_| info.layout == Layout::Ours)?;
        entry.qos.actors.first().copied()
    }

    fn observe(&self, samples: usize) -> Result<Taken, BenchError> {
        let bus = self.open(Role::Observer)?;
        let wait = || std::thread::sleep(LOOK_EVERY);
        match self.info(&bus)?.layout {
            Layout::Ours => {
                let typed = Typed {
                    bus: &bus,
                    acts: None,
                    samples,
                };
                visit(&self.name, typed).map_err(unreadable)?
            }
            _ => {
                let found = bus.described(&self.name).map_err(unreadable)?;
                let found = found.ok_or_else(|| {
                    BenchError::NoTopic(self.name.clone(), self.config.unit.to_string())
                })?;
                listen(&self.name, found, samples, wait)
            }
        }
    }

    fn act(&self, mode: Mode, samples: usize) -> Result<Taken, BenchError> {
        let part = self.part(&self.info(&self.open(Role::Observer)?)?);
        let part = part.ok_or_else(|| BenchError::NotWoken(self.name.clone()))?;
        let bus = self.open(part)?;
        let typed = Typed {
            bus: &bus,
            acts: Some(mode),
            samples,
        };
        visit(&self.name, typed).map_err(unreadable)?
    }
}

impl Session for Heard {
    fn round(&mut self, index: usize, samples: usize) -> Result<Taken, BenchError> {
        match self.modes[index] {
            Mode::Poll => self.observe(samples),
            mode => self.act(mode, samples),
        }
    }
}

/// Listens to a topic whose type this program has.
struct Typed<'a> {
    bus: &'a Bus,
    /// How the actor waits; `None` is an observer.
    acts: Option<Mode>,
    samples: usize,
}

impl TopicVisitor for Typed<'_> {
    type Output = Result<Taken, BenchError>;

    fn visit<T: Topic>(self) -> Self::Output {
        let subscriber = self.bus.subscriber::<T>().map_err(unreadable)?;
        let Some(mode) = self.acts else {
            let wait = || std::thread::sleep(LOOK_EVERY);
            return listen(T::NAME, subscriber, self.samples, wait);
        };
        let waiter = self.bus.waiter(mode.policy()).map_err(unreadable)?;
        listen(T::NAME, subscriber, self.samples, || {
            waiter.wait(TIME_OUT);
            // Clears the reason of the ring.
            waiter.has::<T>();
        })
    }
}

/// The times of the next samples. Those from before this call, of a state, do not count.
fn listen(
    name: &str,
    mut from: impl Source,
    samples: usize,
    mut wait: impl FnMut(),
) -> Result<Taken, BenchError> {
    let began = Clock::monotonic_ns();
    let mut heard = Instant::now();
    let mut taken = Taken::default();
    loop {
        while let Some(stamp) = from.next(Stamps).map_err(unreadable)? {
            let received = Clock::monotonic_ns();
            if stamp.publish_time_ns < began {
                continue;
            }
            heard = Instant::now();
            taken.add(Some(stamp.source_time_ns), stamp.publish_time_ns, received);
            if taken.service.len() == samples {
                taken.lost = from.lost();
                return Ok(taken);
            }
        }
        if interrupted() {
            return Err(BenchError::Interrupted);
        }
        if heard.elapsed() >= SILENCE {
            taken.lost = from.lost();
            return match taken.service.is_empty() {
                true => Err(BenchError::Quiet(name.to_owned(), SILENCE)),
                false => Ok(taken),
            };
        }
        wait();
    }
}

/// Looks only at the stamp.
struct Stamps;

impl Look for Stamps {
    type Output = Stamp;

    fn look<P: Serialize>(self, stamp: &Stamp, _lost: u64, _payload: &P) -> Stamp {
        *stamp
    }
}

fn unreadable(error: impl core::fmt::Display) -> BenchError {
    BenchError::Bus(format!("the bus cannot be read: {error}"))
}
