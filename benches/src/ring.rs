//! `ring-64`: what it costs a writer to wake the one actor of a topic that 64 observers read.
//!
//! ```text
//!   ringer, core 0                      audience, core 1: an actor and 64 observers
//!                    <── ready ─────── all drained, the actor waits (mode: asleep or looking)
//!   t0  publish, ring ───────────────>
//!   t1                                 the actor wakes, everybody drains
//! ```
//!
//! Timed is `t1 - t0`, for which the writer is kept from its work. The typed ports publish and
//! ring; bare iceoryx2 publishes the same and notifies a listener for each reader (`event`), or, as
//! the typed ports do it, one listener for the actor while 64 readers poll (`event-1`).
//!
//! The cost of the ring alone is the difference between publishing on a topic with an actor and
//! publishing on one with as many readers but no actor, measured in pairs (`lager/ring`). It
//! compares with iceoryx2 notifying without publishing anything (`notify`, `notify-1`).

mod audience;
mod ringer;

use core::sync::atomic::AtomicU64;
use core::time::Duration;
use std::os::fd::RawFd;
use std::path::PathBuf;

use lager_ports::{Bus, BusConfig};
use lager_topics::{OBSERVERS, Qos, Role, Topic};
use serde::{Deserialize, Serialize};

use crate::ball::{Ball, Ping};
use crate::baseline::iceoryx::Member;
use crate::baseline::{Fault, LIMIT};
use crate::domain::Domain;
use crate::error::BenchError;
use crate::error::no_bus;
use crate::machine::{self, Awake};
use crate::parts::{Part, Play, Stage};
use crate::report::{Mode, Options, Regime, Row};
use crate::run::{self, Entry};
use crate::shared::{Barrier, Board, Shared};
use crate::slow;
use audience::audience;
use ringer::ringer;

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
    /// Bare iceoryx2 notifies so many listeners.
    Notify(Listeners),
    /// Bare iceoryx2 publishes and then notifies so many listeners.
    Event(Listeners),
}

/// Who listens on bare iceoryx2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Listeners {
    /// Every reader.
    All,
    /// The actor; the observers poll.
    Actor,
}

impl Listeners {
    const fn count(self) -> usize {
        match self {
            Self::All => OBSERVERS + 1,
            Self::Actor => 1,
        }
    }

    /// The event and the topic; a service keeps its number of listeners.
    const fn service(self) -> &'static str {
        match self {
            Self::All => "bench/bare-ring",
            Self::Actor => "bench/bare-ring-1",
        }
    }
}

impl Contender {
    const ALL: [Self; 6] = [
        Self::Lager,
        Self::Ring,
        Self::Event(Listeners::All),
        Self::Notify(Listeners::All),
        Self::Event(Listeners::Actor),
        Self::Notify(Listeners::Actor),
    ];

    fn entry(self, mode: Mode) -> Entry {
        let (name, variant, against): (_, _, &[&str]) = match self {
            Self::Lager => ("lager", "", &["iceoryx2/event", "iceoryx2/event-1"]),
            Self::Ring => ("lager", "ring", &["iceoryx2/notify", "iceoryx2/notify-1"]),
            Self::Notify(Listeners::All) => ("iceoryx2", "notify", &[]),
            Self::Event(Listeners::All) => ("iceoryx2", "event", &[]),
            Self::Notify(Listeners::Actor) => ("iceoryx2", "notify-1", &[]),
            Self::Event(Listeners::Actor) => ("iceoryx2", "event-1", &[]),
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
    folder: PathBuf,
    hall: RawFd,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Round {
    contender: Contender,
    mode: Mode,
    balls: u32,
    number: u32,
    /// A deliberate slow-down of each ball, in ns.
    spin_ns: u64,
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
                folder: domain.folder().to_owned(),
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
            spin_ns: slow::spin_ns(),
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
                folder: Some(setup.folder),
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
        Member::join(&self.config)
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

fn broken(error: impl core::fmt::Display) -> Fault {
    Fault::Broken(error.to_string())
}
