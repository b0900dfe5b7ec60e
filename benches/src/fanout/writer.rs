//! The writer of the fan-out: publishes when all readers are ready, and is timed meanwhile.

use std::error::Error;

use lager_ports::Clock;
use lager_rig::Parent;
use lager_topics::{Role, Stamp, Topic};

use super::{BARE, Contender, Fan, KIB_64, MIB_1, Own, Round, SMALL};
use crate::baseline::iceoryx::{Header, Member, Stream};
use crate::baseline::{Fault, broken, iceoryx};
use crate::error::{BenchError, no_bus};
use crate::pair;
use crate::sample::Block;
use crate::slow;

pub(super) fn writer(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let write = |own: &Own, round: &Round| match round.what.words {
        SMALL => write::<SMALL>(own, round),
        KIB_64 => write::<KIB_64>(own, round),
        _ => write::<MIB_1>(own, round),
    };
    pair::measure(parent, |own| own, write)
}

#[allow(unsafe_code)]
fn write<const WORDS: usize>(own: &Own, round: &Round) -> Result<Vec<u64>, BenchError> {
    let readers = round.what.readers;
    match round.what.contender {
        Contender::Lager => {
            let bus = own.bus(Role::Operator)?;
            let publisher = bus.publisher::<Fan<WORDS>>().map_err(no_bus)?;
            timed(own, round, |block: &Block<WORDS>| {
                let mut loan = publisher.loan_uninit().map_err(broken)?;
                loan.words.copy_from_slice(&block.words);
                slow::publish(readers);
                loan.send().map_err(broken)
            })
        }
        Contender::Iceoryx2 => {
            let member = Member::join(&own.config)?;
            let publisher = member.publisher::<_, Stamp>(BARE, Some(&Fan::<WORDS>::QOS))?;
            let stream = Stream::new();
            timed(own, round, |block: &Block<WORDS>| {
                let mut sample = publisher.loan_uninit().map_err(iceoryx::broken)?;
                sample.user_header_mut().fill(block.number(), &stream);
                sample.payload_mut().write(*block);
                // SAFETY: the payload was written just now.
                let sample = unsafe { sample.assume_init() };
                sample.send().map_err(iceoryx::broken)?;
                Ok(())
            })
        }
    }
}

/// Publishes the samples of a round; how long each took, in ns.
fn timed<const WORDS: usize>(
    own: &Own,
    round: &Round,
    mut publish: impl FnMut(&Block<WORDS>) -> Result<(), Fault>,
) -> Result<Vec<u64>, BenchError> {
    let mut block = Box::new(Block::new(0));
    own.together(round, || {
        let mut times = Vec::with_capacity(round.all().count());
        for number in round.all() {
            let failed = |fault| round.failed(number, fault);
            own.memory().await_readers(number).map_err(failed)?;
            block.words[0] = number;
            let start = Clock::monotonic_ns();
            publish(&block).map_err(failed)?;
            times.push(Clock::monotonic_ns() - start);
            own.memory().has_published(number);
        }
        Ok(round.timed(times))
    })
}
