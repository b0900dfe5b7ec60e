//! Both processes of `publish`. The writer publishes or rings when all readers are ready, and is
//! timed. The readers wait for each sample or ring, and empty their queues.

use core::time::Duration;
use std::time::Instant;

use lager_home::Clock;
use lager_ports::{Bus, Subscriber};
use lager_sample::{Qos, Stamp, Topic};
use lager_topics::{Role, SensorLine};
use lager_wake::Policy;
use serde::{Deserialize, Serialize};

use crate::baseline::iceoryx::Member;
use crate::baseline::{LIMIT, TIME_OUT};
use crate::error::{BenchError, Fault, broken, no_bus};
use crate::pair::{self, Noted, Side};
use crate::sample::{Block, Ping, RECEIVER, SENDER, Sample, depth, drain};
use crate::slow;

/// Sizes of a block, in words of 8 bytes.
pub(super) const SMALL: usize = 8;
pub(super) const KIB_64: usize = 1 << 13;
pub(super) const MIB_1: usize = 1 << 17;

/// The measurement of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Job {
    /// The typed ports publish blocks of `words` words to `readers` readers.
    Lager { words: usize, readers: usize },
    /// The same with bare iceoryx2 and the same user header.
    Iceoryx2 { words: usize, readers: usize },
    /// The typed ports ring an actor: the longer time of a publish for which the actor waits.
    Ring,
    /// Bare iceoryx2 notifies `listeners` listeners.
    Notify { listeners: usize },
}

impl pair::Work for Job {}

type Round = pair::Round<Job>;

/// The times of the writer's samples, in ns; the readers return none.
type Times = Result<Vec<u64>, BenchError>;

/// One round in one of the two processes.
pub(super) fn round(side: &Side, round: &Round) -> Result<Noted, BenchError> {
    let times = match round.what {
        Job::Lager { words, readers } => match words {
            SMALL => lager::<SMALL>(side, round, readers),
            KIB_64 => lager::<KIB_64>(side, round, readers),
            _ => lager::<MIB_1>(side, round, readers),
        },
        Job::Iceoryx2 { words, readers } => match words {
            SMALL => iceoryx2::<SMALL>(side, round, readers),
            KIB_64 => iceoryx2::<KIB_64>(side, round, readers),
            _ => iceoryx2::<MIB_1>(side, round, readers),
        },
        Job::Ring => ring(side, round),
        Job::Notify { listeners } => notify(side, round, listeners),
    };
    times.map(Noted::from)
}

/// The topic of blocks of that size.
struct Fan<const WORDS: usize>;

impl<const WORDS: usize> Topic for Fan<WORDS> {
    const NAME: &'static str = "bench/fan";
    type Payload = Block<WORDS>;
    const QOS: Qos = Qos {
        buffer: depth(WORDS),
        actors: &[],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the publisher of a measurement to all that read.";
}

fn lager<const WORDS: usize>(side: &Side, round: &Round, readers: usize) -> Times {
    if side.is_first {
        let bus = side.bus(Role::Operator)?;
        let publisher = bus.publisher::<Fan<WORDS>>().map_err(no_bus)?;
        let publish = |block: &Block<WORDS>| {
            let mut loan = publisher.loan_uninit().map_err(broken)?;
            loan.words.copy_from_slice(&block.words);
            slow::publish();
            loan.send().map_err(broken)
        };
        timed(side, round, publish, |block| tell(side, block))
    } else {
        let bus = side.bus(Role::Observer)?;
        let readers = subscribers::<Fan<WORDS>>(&bus, readers)?;
        each_receives(side, round, readers, |reader| {
            let sample = reader.receive().map_err(broken)?;
            Ok(sample.map(|sample| sample.number()))
        })
    }
}

fn iceoryx2<const WORDS: usize>(side: &Side, round: &Round, readers: usize) -> Times {
    const NAME: &str = "bench/bare-fan";
    let member = Member::join(&side.config, Some(Fan::<WORDS>::QOS))?;
    if side.is_first {
        let mut sender = member.sender::<Block<WORDS>, Stamp>(NAME)?;
        let publish = |block: &Block<WORDS>| sender.send(block);
        timed(side, round, publish, |block| tell(side, block))
    } else {
        let all = (0..readers).map(|_| member.subscriber::<Block<WORDS>, Stamp>(NAME));
        each_receives(side, round, all.collect::<Result<_, _>>()?, |reader| {
            let sample = reader.receive().map_err(broken)?;
            Ok(sample.map(|sample| sample.payload().number()))
        })
    }
}

/// Tells the readers the sample's number, for which they wait without a look at their queues.
fn tell<const WORDS: usize>(side: &Side, block: &Block<WORDS>) -> Result<(), Fault> {
    side.shared.published.set(block.number());
    Ok(())
}

/// For each sample, waits until it is published and lets every reader receive it.
fn each_receives<R>(
    side: &Side,
    round: &Round,
    mut readers: Vec<R>,
    receive: impl Fn(&mut R) -> Result<Option<u64>, Fault>,
) -> Times {
    let drain = |number: u64| {
        readers
            .iter_mut()
            .try_for_each(|reader| match receive(reader)? {
                Some(got) if got == number => Ok(()),
                Some(got) => Err(Fault::Wrong(got)),
                None => Err(Fault::Broken("a reader found nothing".to_owned())),
            })
    };
    let published = |number| side.wait(&side.shared.published, number);
    in_turns(side, round, published, drain)
}

fn ring(side: &Side, round: &Round) -> Times {
    // The word on which the actor sleeps when it does not wait for a ring.
    let elsewhere = &side.shared.lanes.0[0].word;
    if side.is_first {
        let bus = side.bus(SENDER)?;
        let publisher = bus.publisher::<Ping>().map_err(no_bus)?;
        let publish = |sample: &Sample| {
            let mut loan = publisher.loan().map_err(broken)?;
            *loan = *sample;
            if rings(sample.number()) {
                slow::publish();
            }
            loan.send().map_err(broken)
        };
        let wake = |sample: &Sample| match rings(sample.number()) {
            true => Ok(()),
            false => Ok(elsewhere.wake()?),
        };
        let times = timed(side, round, publish, wake)?;
        let pairs = times.chunks_exact(2);
        Ok(pairs.map(|pair| pair[1].saturating_sub(pair[0])).collect())
    } else {
        let (actor, observer) = (side.bus(RECEIVER)?, side.bus(Role::Observer)?);
        let mut acting = actor.subscriber::<Ping>().map_err(no_bus)?;
        let waiter = actor.waiter(Policy::Block).map_err(no_bus)?;
        let mut observing = subscribers::<Ping>(&observer, SensorLine::QOS.observers)?;
        let mut heard = elsewhere.count();
        let is_rung = |number| {
            if rings(number) {
                waiter.wait(TIME_OUT);
            } else {
                elsewhere.sleep(heard)?;
                heard = elsewhere.count();
            }
            Ok(acting.receive().map_err(broken)?.is_some())
        };
        let all = |_| observing.iter_mut().try_for_each(drain);
        in_turns(side, round, until(is_rung), all)
    }
}

fn notify(side: &Side, round: &Round, listeners: usize) -> Times {
    let member = Member::join(&side.config, Some(<Ping>::QOS))?;
    // A service keeps its number of listeners for ever, so each number has a service.
    let name = format!("bench/bare-ring-{listeners}");
    if side.is_first {
        let notifier = member.notifier(&name, listeners)?;
        let notify = |_: &Sample| match notifier.notify().map_err(broken)? {
            notified if notified == listeners => Ok(()),
            notified => Err(Fault::Broken(format!(
                "{notified} of {listeners} listeners were notified"
            ))),
        };
        timed(side, round, notify, |_| Ok(()))
    } else {
        let all = (0..listeners).map(|_| member.listener(&name, listeners));
        let all = all.collect::<Result<Vec<_>, _>>()?;
        let is_rung = |_| {
            let rings = all[0].timed_wait(|_| (), TIME_OUT);
            Ok(rings.map_err(broken)? > 0)
        };
        let drain = |_| {
            let mut all = all.iter();
            let drained = all.try_for_each(|one| one.try_wait(|_| ()).map(drop));
            drained.map_err(broken)
        };
        in_turns(side, round, until(is_rung), drain)
    }
}

/// The samples of a round; those of [`Job::Ring`] come in pairs.
fn numbers(round: &Round) -> impl Iterator<Item = u64> + use<> {
    let each = if round.what == Job::Ring { 2 } else { 1 };
    round
        .all()
        .flat_map(move |sample| (0..each).map(move |part| each * sample + part))
}

/// Whether the actor of [`Job::Ring`] waits for the ring of this sample.
fn rings(number: u64) -> bool {
    !number.is_multiple_of(2)
}

/// Publishes each sample of a round when the readers are ready; returns the times in ns.
fn timed<const WORDS: usize>(
    side: &Side,
    round: &Round,
    mut publish: impl FnMut(&Block<WORDS>) -> Result<(), Fault>,
    mut follow_up: impl FnMut(&Block<WORDS>) -> Result<(), Fault>,
) -> Times {
    // After this pause the actor surely sleeps when it is rung.
    let pause = match round.what {
        Job::Ring | Job::Notify { .. } => Duration::from_micros(60),
        Job::Lager { .. } | Job::Iceoryx2 { .. } => Duration::ZERO,
    };
    let mut block = Box::new(Block::new(0));
    side.together(round, || {
        let mut times = Vec::with_capacity(numbers(round).count());
        for number in numbers(round) {
            let failed = |fault| round.failed(number, fault);
            side.wait(&side.shared.ready, number).map_err(failed)?;
            let ready = Instant::now();
            while ready.elapsed() < pause {
                // The actor may need this core.
                rustix::thread::sched_yield();
            }
            block.words[0] = number;
            let start = Clock::monotonic_ns();
            publish(&block).map_err(failed)?;
            times.push(Clock::monotonic_ns() - start);
            follow_up(&block).map_err(failed)?;
        }
        Ok(times)
    })
}

/// For each sample of a round: tells the writer that all readers are ready, waits, and drains.
fn in_turns(
    side: &Side,
    round: &Round,
    mut wait: impl FnMut(u64) -> Result<(), Fault>,
    mut drain: impl FnMut(u64) -> Result<(), Fault>,
) -> Times {
    side.together(round, || {
        for number in numbers(round) {
            side.shared.ready.set(number);
            wait(number)
                .and_then(|()| drain(number))
                .map_err(|fault| round.failed(number, fault))?;
        }
        Ok(Vec::new())
    })
}

/// Waits as the actor until the ring comes.
fn until(
    mut is_rung: impl FnMut(u64) -> Result<bool, Fault>,
) -> impl FnMut(u64) -> Result<(), Fault> {
    move |number| {
        let start = Instant::now();
        while !is_rung(number)? {
            if start.elapsed() > LIMIT {
                return Err(Fault::Silent(LIMIT));
            }
        }
        Ok(())
    }
}

fn subscribers<T: Topic>(bus: &Bus, number: usize) -> Result<Vec<Subscriber<T>>, BenchError> {
    let all = (0..number).map(|_| bus.subscriber().map_err(no_bus));
    all.collect()
}
