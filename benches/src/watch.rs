//! `watch-N`: the way of a sample to its actor beside N watchers, and to the watchers.
//!
//! ```text
//!   writer, core 0 ─ send ──┬──> actor, core 1             rung by the writer
//!                           └──> crier ──> N watchers      any core; every one gets each sample
//! ```
//!
//! A sample is due every 5 ms, as often as the robot's line sensor reports. A time is from the
//! sending to the receipt. Of N watchers each is timed at every Nth sample. They are threads of one
//! process, in which the actor is, too; each has a subscriber of its own.
//!
//! | row | timed | beside |
//! |---|---|---|
//! | `lager/actor alone` | the actor | nobody |
//! | `lager/actor` | the actor | N watchers that are woken |
//! | `lager/watcher` | the watchers | each other and the actor |
//! | `lager/poller` | observers that look every 5 ms | N of them |

use core::time::Duration;
use std::error::Error;
use std::sync::Barrier;
use std::time::Instant;

use lager_home::Clock;
use lager_ports::{Bus, Subscriber};
use lager_rig::Parent;
use lager_rig::process::Main;
use lager_sample::{Qos, Topic};
use lager_topics::{Role, SensorLine};
use lager_wake::Policy;
use rustix::thread::{CpuSet, sched_setaffinity};
use serde::{Deserialize, Serialize};

use crate::baseline::{LIMIT, TIME_OUT};
use crate::error::{BenchError, Fault, broken, no_bus};
use crate::group::{Entry, Group};
use crate::machine::cores_for;
use crate::pair::{self, Noted, Side};
use crate::report::{Mode, Options, Regime};
use crate::sample::{RECEIVER, SENDER, Sample};

const WRITER: &str = "writer of the watched";
const READERS: &str = "watchers";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(WRITER, exchange), (READERS, exchange)];

fn exchange(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(parent, round)
}

/// The time between two samples.
const PERIOD: Duration = Duration::from_millis(5);

/// Who is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Timed {
    Actor,
    Watchers,
    Pollers,
}

/// The measurement of a round.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Job {
    /// How many watchers or pollers there are.
    observers: usize,
    timed: Timed,
}

/// Its observers are threads of the second side, not processes.
impl pair::Work for Job {}

/// The rows with so many watchers.
fn rows(observers: usize) -> [(Entry, Job); 4] {
    const ALONE: &[&str] = &["lager/actor alone"];
    [
        (ALONE[0], &[][..], 0, Timed::Actor),
        ("lager/actor", ALONE, observers, Timed::Actor),
        ("lager/watcher", ALONE, observers, Timed::Watchers),
        ("lager/poller", ALONE, observers, Timed::Pollers),
    ]
    .map(|(label, against, observers, timed)| {
        let entry = Entry::new(label, Mode::Block, against);
        (entry, Job { observers, timed })
    })
}

/// The groups of one regime. All watchers sleep, and use all cores.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    if !options.modes.contains(&Mode::Block) || regime == Regime::SameCore {
        return Vec::new();
    }
    let cores = options.cores;
    let group = |observers: usize| {
        let rows = rows(observers);
        Group {
            what: format!("watch-{observers}"),
            regime,
            entries: rows.iter().map(|(entry, _)| *entry).collect(),
            rounds: pair::ROUNDS,
            samples: [50, 250],
            open: Box::new(move || {
                let cores = cores_for(regime, cores)?;
                pair::open(cores, PERIOD, [WRITER, READERS], &[], rows.to_vec())
            }),
        }
    };
    [1, 8, 64, 500].map(group).into()
}

/// Like `sensor/line`, with places for more observers.
struct Watched;

impl Topic for Watched {
    const NAME: &'static str = "bench/watched";
    type Payload = Sample;
    const QOS: Qos = Qos {
        actors: &[RECEIVER.part()],
        observers: 512,
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the writer of a measurement to an actor and many watchers.";
}

type Round = pair::Round<Job>;

fn round(side: &Side, round: &Round) -> Result<Noted, BenchError> {
    let times = match side.is_first {
        true => send(side, round),
        false => receive(side, round),
    };
    times.map(Noted::from)
}

/// The times at which the samples were sent.
fn send(side: &Side, round: &Round) -> Result<Vec<u64>, BenchError> {
    let bus = side.bus(SENDER)?;
    let publisher = bus.publisher::<Watched>().map_err(no_bus)?;
    side.together(round, || {
        let start = Instant::now();
        let all = round.all().zip(1_u32..);
        let sent = all.map(|(number, nth)| {
            std::thread::sleep((PERIOD * nth).saturating_sub(start.elapsed()));
            let send = || {
                let mut loan = publisher.loan().map_err(broken)?;
                *loan = Sample::new(number);
                let sent = Clock::monotonic_ns();
                loan.send().map_err(broken)?;
                Ok(sent)
            };
            send().map_err(|fault| round.failed(number, fault))
        });
        sent.collect()
    })
}

/// The times at which the timed readers had each sample.
fn receive(side: &Side, round: &Round) -> Result<Vec<u64>, BenchError> {
    let job = round.what;
    let actor = side.bus(RECEIVER)?;
    let observer = side.bus(Role::Observer)?;
    let mut acting = actor.subscriber::<Watched>().map_err(no_bus)?;
    let waiter = actor.waiter(Policy::Block).map_err(no_bus)?;
    let joined = Barrier::new(job.observers + 1);
    std::thread::scope(|scope| {
        let observe = || {
            let reader =
                on_all_cores().and_then(|()| observer.subscriber::<Watched>().map_err(broken));
            joined.wait();
            watch(&observer, reader?, round)
        };
        let observers: Vec<_> = (0..job.observers).map(|_| scope.spawn(observe)).collect();
        joined.wait();
        let acted = side.together(round, || {
            let wait = || {
                waiter.wait(TIME_OUT);
            };
            let acted = times(&mut acting, round, wait);
            let observed = observers.into_iter().map(|observer| {
                let joined = observer.join();
                joined.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            let observed: Result<Vec<_>, Fault> = observed.collect();
            let failed = |fault| round.failed(round.all().last().unwrap_or_default(), fault);
            Ok((acted.map_err(failed)?, observed.map_err(failed)?))
        });
        let (acted, observed) = acted?;
        Ok(match job.timed {
            Timed::Actor => acted,
            Timed::Watchers | Timed::Pollers => (0..acted.len())
                .map(|sample| observed[sample % observed.len()][sample])
                .collect(),
        })
    })
}

/// The receiver's process is bound to one core, but its observers are not.
fn on_all_cores() -> Result<(), Fault> {
    let mut all = CpuSet::new();
    (0..CpuSet::MAX_CPU).for_each(|core| all.set(core));
    sched_setaffinity(None, &all).map_err(broken)
}

/// One observer, until it has all samples.
fn watch(bus: &Bus, mut reader: Subscriber<Watched>, round: &Round) -> Result<Vec<u64>, Fault> {
    if round.what.timed == Timed::Pollers {
        return times(&mut reader, round, || std::thread::sleep(PERIOD));
    }
    let mut watcher = bus.watcher().map_err(broken)?;
    reader.wakes(&mut watcher);
    times(&mut reader, round, || {
        watcher.wait(TIME_OUT);
    })
}

/// When this reader has received each sample of a round.
fn times(
    reader: &mut Subscriber<Watched>,
    round: &Round,
    mut wait: impl FnMut(),
) -> Result<Vec<u64>, Fault> {
    let mut times = Vec::with_capacity(round.all().count());
    let mut heard = Instant::now();
    for number in round.all() {
        let received = loop {
            if let Some(sample) = reader.receive().map_err(broken)? {
                break *sample;
            }
            if heard.elapsed() > LIMIT {
                return Err(Fault::Silent(LIMIT));
            }
            wait();
        };
        times.push(Clock::monotonic_ns());
        heard = Instant::now();
        if received != Sample::new(number) {
            return Err(Fault::Wrong(received.number()));
        }
    }
    Ok(times)
}
