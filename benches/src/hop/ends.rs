//! The two ends of the hop: the sender times each sample's way, and the receiver sends back what it
//! receives. The table [`ROWS`] has each row with the carrier of its samples.

use core::time::Duration;
use std::time::Instant;

use lager_home::Clock;
use lager_ports::Bus;
use lager_sample::{Qos, Stamp, Topic};
use lager_topics::{Role, SensorLine};
use lager_wake::Policy;
use serde::{Deserialize, Serialize};

use crate::baseline::iceoryx::{self, Header, Member};
#[cfg(feature = "zenoh")]
use crate::baseline::zenoh;
use crate::baseline::{End, LIMIT, TIME_OUT, memory, stream};
use crate::error::{BenchError, Fault, broken, no_bus};
use crate::group::Entry;
use crate::pair::{self, Noted, Side};
use crate::plan::Plan;
use crate::report::Mode;
use crate::sample::{Ping, Pong, RECEIVER, SENDER, Sample};
use crate::slow;

/// The first of the two lines with pipes. Each line has a pipe for one process to write into: the
/// end to read from, and the end to write to.
pub(super) const PIPES: usize = 0;
/// The eventfd that each of the two processes writes to.
const EVENTFDS: usize = 2;
/// The socket of each of the two processes.
const UDS: usize = 3;
/// The socket of each of the two processes.
pub(super) const TCP: usize = 4;

/// The measurement of a round.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Job {
    /// The number of the row in [`ROWS`], or in those of any size.
    pub(super) row: usize,
    /// `Some` = one way is timed, by the clock at both ends, and a sample is due after each such
    /// time; zero is as fast as they come back. `None` = half of the round trip is timed by one
    /// end's clock, as fast as samples come back; only half of a delay at one end shows.
    pub(super) gap: Option<Duration>,
    /// If the row is one of any size: the size of a sample in words.
    pub(super) words: Option<usize>,
    /// How many observers watch.
    pub(super) observers: usize,
}

impl pair::Work for Job {
    fn observers(&self) -> (usize, usize) {
        (self.observers, self.words.unwrap_or_default())
    }
}

pub(super) type Round = pair::Round<Job>;

/// The baseline of spinning rows.
pub(super) const HEADER: &str = "iceoryx2/header";
pub(super) const TO_HEADER: &[&str] = &[HEADER];
pub(super) const TO_EVENT: &[&str] = &["iceoryx2/event"];

pub(super) const fn spins(label: &'static str, against: &'static [&'static str]) -> Entry {
    Entry::new(label, Mode::Spin, against)
}

pub(super) const fn sleeps(label: &'static str, against: &'static [&'static str]) -> Entry {
    Entry::new(label, Mode::Block, against)
}

/// A function that exchanges the samples of a round.
type Exchange = fn(&One) -> Result<Noted, BenchError>;

/// Every row, in the order of the tables: its label and its baselines, and the function that
/// exchanges its samples.
pub(super) const ROWS: &[(Entry, Exchange)] = &[
    // The typed ports.
    (
        spins("lager", &[HEADER, "iceoryx2/bare", "iceoryx2/defaults"]),
        |one| one.ours(Policy::Spin),
    ),
    // Bare iceoryx2, polled without pause, with the typed ports' header and limits.
    (spins(HEADER, &[]), |one| {
        one.polling::<Stamp>(Some(SensorLine::QOS))
    }),
    // With their limits, but without header and clock.
    (spins("iceoryx2/bare", TO_HEADER), |one| {
        one.polling::<()>(Some(SensorLine::QOS))
    }),
    // With its own default limits, without header and clock.
    (spins("iceoryx2/defaults", TO_HEADER), |one| {
        one.polling::<()>(None)
    }),
    // A cache line, watched without pause.
    (spins("cacheline", TO_HEADER), |one| {
        let [out, back] = one.lanes();
        one.exchange(memory::cache_line(out, back))
    }),
    (Entry::new("lager", Mode::Adaptive, TO_HEADER), |one| {
        // The receiver's wait is timed, so only the receiver adapts.
        one.ours(match one.side.is_first {
            true => Policy::Spin,
            false => Policy::ADAPTIVE,
        })
    }),
    (sleeps("lager", &["iceoryx2/event", "futex"]), |one| {
        one.ours(Policy::Block)
    }),
    // The same between two observers that are woken after everybody else.
    (sleeps("lager/watcher", &["lager"]), |one| one.watching()),
    // Bare iceoryx2 with the typed ports' header and limits, and an event to sleep on.
    (sleeps("iceoryx2/event", &[]), |one| {
        let member = Member::join(&one.side.config, Some(SensorLine::QOS))?;
        one.exchange(iceoryx::listening(&member, one.names())?)
    }),
    // A cache line and a futex to sleep on, and the same with an eventfd.
    (sleeps("futex", TO_EVENT), |one| {
        let [out, back] = one.lanes();
        one.exchange(memory::a_futex(out, back))
    }),
    (sleeps("eventfd", TO_EVENT), |one| {
        let [out, back] = one.lanes();
        let [ring, bell] = one.own_first(one.side.lines[EVENTFDS].each_ref());
        one.exchange(memory::an_eventfd((out, ring), (back, bell)))
    }),
    (sleeps("pipe", TO_EVENT), |one| {
        let [own, other] = one.own_first([PIPES, PIPES + 1]);
        let lines = &one.side.lines;
        one.exchange(stream::end(&lines[own][1], &lines[other][0]))
    }),
    (sleeps("uds", TO_EVENT), |one| one.socket(UDS)),
    (sleeps("tcp", TO_EVENT), |one| one.socket(TCP)),
    // Two Zenoh peers on a Unix socket, each with a channel to sleep on.
    #[cfg(feature = "zenoh")]
    (sleeps("zenoh", TO_EVENT), |one| {
        let folder = one.side.config.folder.as_deref().unwrap_or("".as_ref());
        // Each round has its own name: the socket of the round before may still be closing.
        let socket = folder.join(format!("zenoh-{}", one.round.number));
        one.exchange(zenoh::meet(&socket, one.side.is_first, one.names())?)
    }),
];

/// One round in one of the two processes, with ends of its own. The sender returns the times of one
/// way, in ns. If only one way is timed, it returns when it sent, and the receiver when it
/// received.
pub(super) fn round(one: &One<'_>) -> Result<Noted, BenchError> {
    ROWS[one.round.what.row].1(one)
}

/// One of the two processes in a round.
pub(super) struct One<'a> {
    pub(super) side: &'a Side,
    pub(super) round: &'a Round,
}

impl One<'_> {
    /// Of a pair, one for each process: first this process's, then the other's.
    pub(super) fn own_first<T>(&self, [first, second]: [T; 2]) -> [T; 2] {
        match self.side.is_first {
            true => [first, second],
            false => [second, first],
        }
    }

    fn lanes(&self) -> [&memory::Lane<8>; 2] {
        self.own_first(self.side.shared.lanes.0.each_ref())
    }

    /// The names to which bare iceoryx2 and Zenoh publish and subscribe, in this order.
    pub(super) fn names(&self) -> [&'static str; 2] {
        self.own_first(["bench/bare-ping", "bench/bare-pong"])
    }

    fn ours(&self, policy: Policy) -> Result<Noted, BenchError> {
        if self.side.is_first {
            let bus = self.side.bus(SENDER)?;
            self.exchange(ours::<Ping, Pong>(&bus, policy)?)
        } else {
            let bus = self.side.bus(RECEIVER)?;
            self.exchange(ours::<Pong, Ping>(&bus, policy)?)
        }
    }

    fn watching(&self) -> Result<Noted, BenchError> {
        let bus = self.side.bus(Role::Observer)?;
        match self.side.is_first {
            true => self.exchange(watching::<Ping, Pong>(&bus)?),
            false => self.exchange(watching::<Pong, Ping>(&bus)?),
        }
    }

    fn polling<H: Header>(&self, limits: Option<Qos>) -> Result<Noted, BenchError> {
        let member = Member::join(&self.side.config, limits)?;
        self.exchange(iceoryx::polling::<H>(&member, self.names())?)
    }

    fn socket(&self, line: usize) -> Result<Noted, BenchError> {
        let [socket, _] = self.own_first(self.side.lines[line].each_ref());
        self.exchange(stream::end(socket, socket))
    }

    /// Exchanges the samples, and keeps this end until the other process has finished too.
    fn exchange(&self, mut end: impl End) -> Result<Noted, BenchError> {
        self.side.together(self.round, || match self.side.is_first {
            true => self.time_each(|number| {
                let sent = Clock::monotonic_ns();
                let sample = end
                    .send(&Sample::new(number))
                    .and_then(|()| end.receive())
                    .map_err(|fault| self.round.failed(number, fault))?;
                let received = Clock::monotonic_ns();
                self.check(number, &sample)?;
                Ok([sent, received])
            }),
            false => self.answer_each(|number| {
                let failed = |fault| self.round.failed(number, fault);
                let sample = end.receive().map_err(failed)?;
                let received = self.now();
                end.send(&sample).map_err(failed)?;
                self.check(number, &sample)?;
                Ok(received)
            }),
        })
    }

    /// The sender's times of all samples. `there_and_back` sends one and waits until it is back: when
    /// both was.
    pub(super) fn time_each(
        &self,
        mut there_and_back: impl FnMut(u64) -> Result<[u64; 2], BenchError>,
    ) -> Result<Noted, BenchError> {
        let round = self.round;
        let mut times = Vec::with_capacity(round.all().count());
        let period = round.what.gap.filter(|gap| !gap.is_zero());
        let period = period.map(|gap| gap.as_nanos() as u64);
        let begin = |period| Plan::new(Clock::monotonic_ns() + period, period, 0);
        let mut plan = period.map(begin);
        let mut due = Vec::new();
        for number in round.all() {
            if round.is_first_timed(number) {
                // What the warm-up was late does not count.
                plan = period.map(begin);
                due.clear();
            }
            if let Some(plan) = &mut plan {
                let next = plan.next();
                due.push(next.due);
                while Clock::monotonic_ns() < next.send {}
            }
            let [sent, received] = there_and_back(number)?;
            times.push(match round.what.gap {
                None => (received - sent) / 2,
                Some(_) => sent,
            });
        }
        Ok(Noted {
            times,
            due: period.map(|period| (due, period)),
        })
    }

    /// The receiver's times of all samples, if one way is timed. `answer` receives one and sends it
    /// back: when it was received.
    pub(super) fn answer_each(
        &self,
        mut answer: impl FnMut(u64) -> Result<Option<u64>, BenchError>,
    ) -> Result<Noted, BenchError> {
        let mut times = Vec::with_capacity(self.round.all().count());
        for number in self.round.all() {
            times.extend(answer(number)?);
        }
        Ok(times.into())
    }

    /// The time, if the receiver's is needed.
    pub(super) fn now(&self) -> Option<u64> {
        self.round.what.gap.map(|_| Clock::monotonic_ns())
    }

    fn check(&self, expected: u64, sample: &Sample) -> Result<(), BenchError> {
        if sample.number() == expected && sample.is_whole() {
            return Ok(());
        }
        let got = Fault::Wrong(sample.number());
        Err(self.round.failed(expected, got))
    }
}

/// The typed ports as an end that publishes to `Out` and waits for `Back`: publish, wait and
/// receive, as every service does.
fn ours<Out, Back>(bus: &Bus, policy: Policy) -> Result<impl End + use<Out, Back>, BenchError>
where
    Out: Topic<Payload = Sample>,
    Back: Topic<Payload = Sample>,
{
    let mut subscriber = bus.subscriber::<Back>().map_err(no_bus)?;
    let waiter = bus.waiter(policy).map_err(no_bus)?;
    let publisher = bus.publisher::<Out>().map_err(no_bus)?;
    let send = move |sample: &Sample| {
        let mut loan = publisher.loan().map_err(broken)?;
        *loan = *sample;
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
                return Ok(*received);
            }
            if start.get_or_insert_with(Instant::now).elapsed() > LIMIT {
                return Err(Fault::Silent(LIMIT));
            }
        }
    };
    Ok((send, receive))
}

/// The same as an observer that is woken.
fn watching<Out, Back>(bus: &Bus) -> Result<impl End + use<Out, Back>, BenchError>
where
    Out: Topic<Payload = Sample>,
    Back: Topic<Payload = Sample>,
{
    let mut subscriber = bus.subscriber::<Back>().map_err(no_bus)?;
    let mut watcher = bus.watcher().map_err(no_bus)?;
    subscriber.wakes(&mut watcher);
    let publisher = bus.publisher::<Out>().map_err(no_bus)?;
    let send = move |sample: &Sample| {
        let mut loan = publisher.loan().map_err(broken)?;
        *loan = *sample;
        loan.send().map_err(broken)
    };
    let receive = move || {
        let start = Instant::now();
        loop {
            if let Some(received) = subscriber.receive().map_err(broken)? {
                return Ok(*received);
            }
            if start.elapsed() > LIMIT {
                return Err(Fault::Silent(LIMIT));
            }
            watcher.wait(TIME_OUT);
        }
    };
    Ok((send, receive))
}
