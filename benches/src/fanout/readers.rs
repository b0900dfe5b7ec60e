//! The process of those who read: every subscriber of a contender, drained after each publish.

use std::error::Error;

use lager_ports::Subscriber;
use lager_rig::Parent;
use lager_topics::{Role, Stamp, Topic};

use super::{BARE, Contender, Fan, KIB_64, MIB_1, Own, Round, SMALL};
use crate::baseline::iceoryx::Member;
use crate::baseline::{Fault, broken, iceoryx};
use crate::error::{BenchError, no_bus};
use crate::pair;
use crate::sample::Block;

pub(super) fn readers(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let read = |own: &Own, round: &Round| match round.what.words {
        SMALL => read::<SMALL>(own, round),
        KIB_64 => read::<KIB_64>(own, round),
        _ => read::<MIB_1>(own, round),
    };
    pair::measure(parent, |own| own, read)
}

fn read<const WORDS: usize>(own: &Own, round: &Round) -> Result<Vec<u64>, BenchError> {
    let all = 0..round.what.readers;
    match round.what.contender {
        Contender::Lager => {
            let bus = own.bus(Role::Observer)?;
            let readers = all.map(|_| bus.subscriber().map_err(no_bus));
            let readers: Vec<Subscriber<Fan<WORDS>>> = readers.collect::<Result<_, _>>()?;
            drained(own, round, readers, |reader| {
                let sample = reader.receive().map_err(broken)?;
                Ok(sample.map(|sample| sample.number()))
            })
        }
        Contender::Iceoryx2 => {
            let member = Member::join(&own.config)?;
            let limits = Some(&Fan::<WORDS>::QOS);
            let readers = all.map(|_| member.subscriber::<Block<WORDS>, Stamp>(BARE, limits));
            let readers = readers.collect::<Result<Vec<_>, _>>()?;
            drained(own, round, readers, |reader| {
                let sample = reader.receive().map_err(iceoryx::broken)?;
                Ok(sample.map(|sample| sample.payload().number()))
            })
        }
    }
}

/// Lets every reader receive the samples of a round, each when it is published. There are no times
/// to tell.
fn drained<R>(
    own: &Own,
    round: &Round,
    mut readers: Vec<R>,
    receive: impl Fn(&mut R) -> Result<Option<u64>, Fault>,
) -> Result<Vec<u64>, BenchError> {
    own.together(round, || {
        for number in round.all() {
            let failed = |fault| round.failed(number, fault);
            own.memory().are_ready_for(number);
            own.memory().await_writer(number).map_err(failed)?;
            for reader in &mut readers {
                match receive(reader).map_err(failed)? {
                    Some(got) if got == number => {}
                    Some(got) => return Err(round.wrong(number, got)),
                    None => return Err(failed(Fault::Broken("a reader found nothing".into()))),
                }
            }
        }
        Ok(Vec::new())
    })
}
