//! The hop with samples of any size (`--size`) and with observers (`--observers`).
//!
//! The sender has the sample and copies it once, as a driver does: the typed ports and iceoryx2 into
//! shared memory, where the receiver looks at its first and last word; a pipe and TCP into the kernel,
//! from which the receiver copies it out. The same comes back.

use std::os::fd::OwnedFd;
use std::time::Instant;

use iceoryx2::prelude::ipc;
use lager_home::Clock;
use lager_ports::Bus;
use lager_sample::{Stamp, Topic, bytes_of};
use lager_wake::Policy;
use rustix::io::write;

use super::ends::{HEADER, One, PIPES, TCP, TO_EVENT, TO_HEADER, sleeps, spins};
use crate::baseline::iceoryx::{LISTENERS, Member, asleep_on};
use crate::baseline::stream::read_whole;
use crate::baseline::{LIMIT, TIME_OUT, sleep_until, spin};
use crate::error::{BenchError, Fault, broken, no_bus};
use crate::group::Entry;
use crate::pair::Noted;
use crate::report::Mode;
use crate::sample::{Block, Ping, Pong, RECEIVER, SENDER, for_words};
use crate::slow;

/// What carries the samples of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Carrier {
    /// The typed ports; the sender and the receiver wait so.
    Lager([Policy; 2]),
    /// Bare iceoryx2, polled without pause.
    Polled,
    /// Bare iceoryx2 with an event to sleep on.
    Event,
    /// A pipe each way.
    Pipe,
    /// A connection over loopback.
    Tcp,
}

/// The label of the row with observers, and of the same row without them.
pub(super) const OBSERVED: &str = "lager/observed";
const ALONE: &[&str] = &["lager"];

const fn observed(mode: Mode) -> Entry {
    Entry::new(OBSERVED, mode, ALONE)
}

const SPINNING: Carrier = Carrier::Lager([Policy::Spin; 2]);
const ADAPTING: Carrier = Carrier::Lager([Policy::Spin, Policy::ADAPTIVE]);
const SLEEPING: Carrier = Carrier::Lager([Policy::Block; 2]);

/// Every row, in the order of the tables.
pub(super) const ROWS: &[(Entry, Carrier)] = &[
    (spins("lager", &[HEADER]), SPINNING),
    (observed(Mode::Spin), SPINNING),
    (spins(HEADER, &[]), Carrier::Polled),
    (Entry::new("lager", Mode::Adaptive, TO_HEADER), ADAPTING),
    (observed(Mode::Adaptive), ADAPTING),
    (sleeps("lager", TO_EVENT), SLEEPING),
    (observed(Mode::Block), SLEEPING),
    (sleeps("iceoryx2/event", &[]), Carrier::Event),
    (sleeps("pipe", TO_EVENT), Carrier::Pipe),
    (sleeps("tcp", TO_EVENT), Carrier::Tcp),
];

/// One round in one of the two processes, of samples of so many words.
pub(super) fn round(one: &One<'_>, words: usize) -> Result<Noted, BenchError> {
    let (_, carrier) = ROWS[one.round.what.row];
    for_words!(words, exchange(one, carrier))
}

fn exchange<const WORDS: usize>(one: &One<'_>, carrier: Carrier) -> Result<Noted, BenchError> {
    let [out, back] = one.names();
    match carrier {
        Carrier::Lager([policy, _]) if one.side.is_first => {
            let bus = one.side.bus(SENDER)?;
            pass(one, ours::<Ping<WORDS>, Pong<WORDS>, WORDS>(&bus, policy)?)
        }
        Carrier::Lager([_, policy]) => {
            let bus = one.side.bus(RECEIVER)?;
            pass(one, ours::<Pong<WORDS>, Ping<WORDS>, WORDS>(&bus, policy)?)
        }
        Carrier::Polled => {
            let member = Member::join(&one.side.config, Some(Ping::<WORDS>::QOS))?;
            let subscriber = member.subscriber::<Block<WORDS>, Stamp>(back)?;
            let mut sender = member.sender::<Block<WORDS>, Stamp>(out)?;
            let send = |block: &Block<WORDS>| sender.send(block);
            pass(one, (send, || spin(|| look(&subscriber))))
        }
        Carrier::Event => {
            let member = Member::join(&one.side.config, Some(Ping::<WORDS>::QOS))?;
            let listener = member.listener(back, LISTENERS)?;
            let notifier = member.notifier(out, LISTENERS)?;
            let subscriber = member.subscriber::<Block<WORDS>, Stamp>(back)?;
            let mut sender = member.sender::<Block<WORDS>, Stamp>(out)?;
            let send = |block: &Block<WORDS>| {
                sender.send(block)?;
                notifier.notify().map_err(broken)?;
                Ok(())
            };
            let mut sleep = asleep_on(&listener);
            pass(
                one,
                (send, || sleep_until(|| look(&subscriber), &mut sleep)),
            )
        }
        Carrier::Pipe => {
            let [own, other] = one.own_first([PIPES, PIPES + 1]);
            let lines = &one.side.lines;
            through_kernel::<WORDS>(one, &lines[own][1], &lines[other][0])
        }
        Carrier::Tcp => {
            let [socket, _] = one.own_first(one.side.lines[TCP].each_ref());
            through_kernel::<WORDS>(one, socket, socket)
        }
    }
}

/// One end of a line for samples of that size.
trait End<const WORDS: usize> {
    /// Sends the sample to the other end.
    fn send(&mut self, block: &Block<WORDS>) -> Result<(), Fault>;

    /// Waits for the next sample, and returns its number.
    fn receive(&mut self) -> Result<u64, Fault>;
}

impl<const WORDS: usize, S, R> End<WORDS> for (S, R)
where
    S: FnMut(&Block<WORDS>) -> Result<(), Fault>,
    R: FnMut() -> Result<u64, Fault>,
{
    fn send(&mut self, block: &Block<WORDS>) -> Result<(), Fault> {
        self.0(block)
    }

    fn receive(&mut self) -> Result<u64, Fault> {
        self.1()
    }
}

/// Exchanges the samples of a round.
fn pass<const WORDS: usize>(one: &One<'_>, mut end: impl End<WORDS>) -> Result<Noted, BenchError> {
    let mut block = Box::new(Block::<WORDS>::new(0));
    let is = |expected: u64, got: u64| match got == expected {
        true => Ok(()),
        false => Err(one.round.failed(expected, Fault::Wrong(got))),
    };
    one.side.together(one.round, || match one.side.is_first {
        true => one.time_each(|number| {
            block.mark(number);
            let sent = Clock::monotonic_ns();
            let got = end
                .send(&block)
                .and_then(|()| end.receive())
                .map_err(|fault| one.round.failed(number, fault))?;
            let received = Clock::monotonic_ns();
            is(number, got)?;
            Ok([sent, received])
        }),
        false => one.answer_each(|number| {
            let failed = |fault| one.round.failed(number, fault);
            let got = end.receive().map_err(failed)?;
            let received = one.now();
            block.mark(got);
            end.send(&block).map_err(failed)?;
            is(number, got)?;
            Ok(received)
        }),
    })
}

/// The number of a block that came whole, as far as its ends tell.
fn number<const WORDS: usize>(block: &Block<WORDS>) -> Result<u64, Fault> {
    block.marked().ok_or(Fault::Wrong(block.number()))
}

/// Publishes, waits and receives, as every service does.
fn ours<Out, Back, const WORDS: usize>(
    bus: &Bus,
    policy: Policy,
) -> Result<impl End<WORDS> + use<Out, Back, WORDS>, BenchError>
where
    Out: Topic<Payload = Block<WORDS>>,
    Back: Topic<Payload = Block<WORDS>>,
{
    let mut subscriber = bus.subscriber::<Back>().map_err(no_bus)?;
    let waiter = bus.waiter(policy).map_err(no_bus)?;
    let publisher = bus.publisher::<Out>().map_err(no_bus)?;
    let send = move |block: &Block<WORDS>| {
        // Blank memory would be written twice.
        let mut loan = publisher.loan_uninit().map_err(broken)?;
        loan.words.copy_from_slice(&block.words);
        slow::publish();
        loan.send().map_err(broken)
    };
    let receive = move || {
        let mut start = None;
        loop {
            waiter.wait(TIME_OUT);
            // A sample may be found before its ring, which then ends the next wait too early.
            if waiter.has::<Back>()
                && let Some(received) = subscriber.receive().map_err(broken)?
            {
                return number(&received);
            }
            if start.get_or_insert_with(Instant::now).elapsed() > LIMIT {
                return Err(Fault::Silent(LIMIT));
            }
        }
    };
    Ok((send, receive))
}

/// The number of the next sample, if there is one.
fn look<const WORDS: usize>(
    subscriber: &iceoryx2::port::subscriber::Subscriber<ipc::Service, Block<WORDS>, Stamp>,
) -> Result<Option<u64>, Fault> {
    let received = subscriber.receive().map_err(broken)?;
    received
        .map(|received| number(received.payload()))
        .transpose()
}

/// Writes to one descriptor and reads from the other.
fn through_kernel<const WORDS: usize>(
    one: &One<'_>,
    out: &OwnedFd,
    back: &OwnedFd,
) -> Result<Noted, BenchError> {
    let send = |block: &Block<WORDS>| {
        let mut left = bytes_of(block);
        while !left.is_empty() {
            left = &left[write(out, left)?..];
        }
        Ok(())
    };
    let mut bytes = vec![0; 8 * WORDS];
    let receive = || {
        read_whole(back, &mut bytes)?;
        let word = |bytes: &[u8]| u64::from_ne_bytes(bytes.try_into().expect("eight bytes"));
        let [first, last] = [word(&bytes[..8]), word(&bytes[8 * WORDS - 8..])];
        match first == last ^ (WORDS as u64 - 1) {
            true => Ok(first),
            false => Err(Fault::Wrong(first)),
        }
    };
    pass(one, (send, receive))
}

/// Samples of a round: as many as usual, but not more than pass in about the same time.
pub(super) fn samples(usual: usize, bytes: usize) -> usize {
    /// Bytes of a round, one way.
    const MOST: usize = 1 << 28;
    usual.min(MOST / bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_of_large_samples_has_fewer() {
        assert_eq!(samples(20_000, 64), 20_000);
        assert_eq!(samples(20_000, 1 << 20), 256);
        assert_eq!(samples(50, 1 << 20), 50);
    }
}
