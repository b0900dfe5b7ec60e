//! The readers, all in one process: they wait for each sample or ring, and drain their queues.

use std::time::Instant;

use lager_ports::{Bus, Policy, Subscriber};
use lager_topics::{OBSERVERS, Role, Stamp, Topic};

use super::{BARE_FAN, Fan, Job, KIB_64, MIB_1, Round, SMALL, event, numbers, rings};
use crate::baseline::iceoryx::{self, Member};
use crate::baseline::{LIMIT, TIME_OUT};
use crate::error::{BenchError, Fault, broken, no_bus};
use crate::pair::Side;
use crate::sample::{Block, Ping, RECEIVER};

/// Reads the samples of a round. There are no times to tell.
pub(super) fn round(side: &Side, round: &Round) -> Result<Vec<u64>, BenchError> {
    match round.what {
        Job::Lager { words, readers } | Job::Iceoryx2 { words, readers } => match words {
            SMALL => receive::<SMALL>(side, round, readers),
            KIB_64 => receive::<KIB_64>(side, round, readers),
            _ => receive::<MIB_1>(side, round, readers),
        },
        Job::Ring => {
            let (actor, observer) = (side.bus(RECEIVER)?, side.bus(Role::Observer)?);
            let mut acting = actor.subscriber::<Ping>().map_err(no_bus)?;
            let waiter = actor.waiter(Policy::Block).map_err(no_bus)?;
            let mut observing = subscribers::<Ping>(&observer, OBSERVERS)?;
            let elsewhere = &side.shared.lanes[0].word;
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
        Job::Notify { listeners } => {
            let member = Member::join(&side.config)?;
            let name = event(listeners);
            let all = (0..listeners).map(|_| member.listener(&name, listeners));
            let all = all.collect::<Result<Vec<_>, _>>()?;
            let is_rung = |_| {
                let rings = all[0].timed_wait(|_| (), TIME_OUT);
                Ok(rings.map_err(iceoryx::broken)? > 0)
            };
            let drain = |_| {
                let drained = all
                    .iter()
                    .try_for_each(|one| one.try_wait(|_| ()).map(drop));
                drained.map_err(iceoryx::broken)
            };
            in_turns(side, round, until(is_rung), drain)
        }
    }
}

fn receive<const WORDS: usize>(
    side: &Side,
    round: &Round,
    readers: usize,
) -> Result<Vec<u64>, BenchError> {
    if let Job::Lager { .. } = round.what {
        let bus = side.bus(Role::Observer)?;
        each_receives(
            side,
            round,
            subscribers::<Fan<WORDS>>(&bus, readers)?,
            |reader| {
                let sample = reader.receive().map_err(broken)?;
                Ok(sample.map(|sample| sample.number()))
            },
        )
    } else {
        let member = Member::join(&side.config)?;
        let limits = Some(&Fan::<WORDS>::QOS);
        let all = (0..readers).map(|_| member.subscriber::<Block<WORDS>, Stamp>(BARE_FAN, limits));
        each_receives(side, round, all.collect::<Result<_, _>>()?, |reader| {
            let sample = reader.receive().map_err(iceoryx::broken)?;
            Ok(sample.map(|sample| sample.payload().number()))
        })
    }
}

/// Lets every reader receive each sample when it is published.
fn each_receives<R>(
    side: &Side,
    round: &Round,
    mut readers: Vec<R>,
    receive: impl Fn(&mut R) -> Result<Option<u64>, Fault>,
) -> Result<Vec<u64>, BenchError> {
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

/// For each sample of a round: tells the writer that all are ready, waits, and drains.
fn in_turns(
    side: &Side,
    round: &Round,
    mut wait: impl FnMut(u64) -> Result<(), Fault>,
    mut drain: impl FnMut(u64) -> Result<(), Fault>,
) -> Result<Vec<u64>, BenchError> {
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

/// Waits as the actor, until it is rung.
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

fn drain<T: Topic>(subscriber: &mut Subscriber<T>) -> Result<(), Fault> {
    while subscriber.receive().map_err(broken)?.is_some() {}
    Ok(())
}
