//! The writer: publishes or rings when all readers are ready, and is timed meanwhile.

use core::time::Duration;
use std::time::Instant;

use lager_ports::Clock;
use lager_topics::{OBSERVERS, Role, Stamp, Topic as _};

use super::{BARE_FAN, Fan, Job, KIB_64, MIB_1, Round, SMALL, event, numbers, rings};
use crate::baseline::iceoryx::{self, Member};
use crate::error::{BenchError, Fault, broken, no_bus};
use crate::pair::Side;
use crate::sample::{Block, Ping, SENDER, Sample};
use crate::slow;

/// Writes the samples of a round; what each took, in ns.
pub(super) fn round(side: &Side, round: &Round) -> Result<Vec<u64>, BenchError> {
    let times = match round.what {
        Job::Lager { words, .. } | Job::Iceoryx2 { words, .. } => match words {
            SMALL => publish::<SMALL>(side, round),
            KIB_64 => publish::<KIB_64>(side, round),
            _ => publish::<MIB_1>(side, round),
        },
        Job::Ring => ring(side, round),
        Job::Notify { listeners } => {
            let member = Member::join(&side.config)?;
            let notifier = member.notifier(&event(listeners), listeners)?;
            let notify = |_: &Sample| match notifier.notify().map_err(iceoryx::broken)? {
                notified if notified == listeners => Ok(()),
                notified => Err(Fault::Broken(format!(
                    "{notified} of {listeners} listeners were notified"
                ))),
            };
            timed(side, round, notify, |_| Ok(()))
        }
    };
    Ok(round.timed(times?))
}

fn publish<const WORDS: usize>(side: &Side, round: &Round) -> Result<Vec<u64>, BenchError> {
    // The readers wait for this, and do not look into their queues meanwhile.
    let tell = |block: &Block<WORDS>| {
        side.shared.published.set(block.number());
        Ok(())
    };
    if let Job::Lager { readers, .. } = round.what {
        let bus = side.bus(Role::Operator)?;
        let publisher = bus.publisher::<Fan<WORDS>>().map_err(no_bus)?;
        let publish = |block: &Block<WORDS>| {
            let mut loan = publisher.loan_uninit().map_err(broken)?;
            loan.words.copy_from_slice(&block.words);
            slow::publish(readers);
            loan.send().map_err(broken)
        };
        timed(side, round, publish, tell)
    } else {
        let member = Member::join(&side.config)?;
        let mut sender = member.sender::<_, Stamp>(BARE_FAN, Some(&Fan::<WORDS>::QOS))?;
        timed(side, round, |block| sender.send(block), tell)
    }
}

fn ring(side: &Side, round: &Round) -> Result<Vec<u64>, BenchError> {
    let bus = side.bus(SENDER)?;
    let publisher = bus.publisher::<Ping>().map_err(no_bus)?;
    let publish = |sample: &Sample| {
        let mut loan = publisher.loan().map_err(broken)?;
        *loan = *sample;
        if rings(sample.number()) {
            slow::publish(OBSERVERS);
        }
        loan.send().map_err(broken)
    };
    let wake = |sample: &Sample| match rings(sample.number()) {
        true => Ok(()),
        false => Ok(side.shared.lanes[0].word.wake()?),
    };
    let times = timed(side, round, publish, wake)?;
    let pairs = times.chunks_exact(2);
    Ok(pairs.map(|pair| pair[1].saturating_sub(pair[0])).collect())
}

/// Publishes each sample of a round when the readers are ready for it; how long each took, in ns.
fn timed<const WORDS: usize>(
    side: &Side,
    round: &Round,
    mut publish: impl FnMut(&Block<WORDS>) -> Result<(), Fault>,
    mut follow_up: impl FnMut(&Block<WORDS>) -> Result<(), Fault>,
) -> Result<Vec<u64>, BenchError> {
    // An actor that is rung surely sleeps by then.
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
                // It may be on this core.
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
