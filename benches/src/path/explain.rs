//! `lager bench path --explain`: why frames are late, each by the kernel's events around it.
//!
//! One robot answers frames as in the row `lager`; nothing takes turns with it. Between turns the
//! robot stands still, and only then are the kernel's events read, so reading them hurts no frame. Who
//! also reads the robot's commands, for their stamps, is the thread that plays the boards.

use core::fmt;
use std::path::Path;

use lager_home::Clock;
use lager_rig::schedule::{Bound, Placement};
use lager_rig::{heed_interrupts, interrupted};
use lager_sample::Stamp;
use lager_topics::SteeringCommand;
use lager_tracer::proc::{Shares, machine, stolen_ms, threads};
use lager_tracer::{Explainer, Frame, Mark, Modest, NoTracing, Tracer, Who, name_functions};
use serde::Serialize;

use super::robot::{Places, Robot};
use super::turn::{Chain, PERIOD, REST, TURN, WARM_UP, next_due};
use super::{BOARDS, Beside, SERVICES, TURNS};
use crate::error::{BenchError, no_bus};
use crate::machine::{cores_for, kept_awake};
use crate::plan::Plan;
use crate::report::{Mode, Options, Regime};

/// The ring of events of each core, in KiB: a turn makes about a tenth of it.
const RING_KIB: u32 = 16 * 1024;

/// What is explained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// A frame that takes longer than this is late, in ns.
    pub limit_ns: u64,
    /// Whether bridge, logic and boards run in real time.
    pub realtime: bool,
}

/// What became of the late frames of one robot.
#[derive(Clone, Debug, Serialize)]
pub struct Explained {
    /// How the services waited.
    pub mode: Mode,
    /// How they shared the processor.
    pub regime: Regime,
    /// Whether they ran in real time.
    pub realtime: bool,
    /// The verdicts.
    pub report: lager_tracer::Report,
    /// The latest frames for Perfetto's page; empty without the kernel's events.
    #[serde(skip)]
    pub picture: String,
}

impl fmt::Display for Explained {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let urgent = if self.realtime { ", in real time" } else { "" };
        writeln!(f, "path {} {}{urgent}", self.mode, self.regime)?;
        write!(f, "{}", self.report)
    }
}

impl Explained {
    /// Writes the picture, if there is one; says whether there is.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn draw(&self, file: &Path) -> std::io::Result<bool> {
        if self.picture.is_empty() {
            return Ok(false);
        }
        std::fs::write(file, &self.picture).map(|()| true)
    }
}

/// Explains the late frames of a robot in the first of the chosen modes and regimes in which its
/// services do not spin: blocking on two cores, if nothing is chosen.
///
/// # Errors
/// As a measurement.
pub fn explain(options: &Options, wanted: Wanted) -> Result<Explained, BenchError> {
    heed_interrupts();
    let mut modes = options.modes.iter().copied();
    let mode = match modes.any(|mode| mode == Mode::Block) {
        true => Mode::Block,
        false => Mode::Adaptive,
    };
    let regime = options.regimes.first().copied().unwrap_or(Regime::Plain);
    let _awake = kept_awake(regime)?;
    let (first, second) = cores_for(regime, options.cores)?;
    let place = |core| Placement {
        core: Some(core),
        priority: wanted.realtime.then_some(SERVICES),
    };
    let places = Places {
        bridge: place(first),
        logic: place(second),
        boards: wanted.realtime.then_some(BOARDS),
    };
    let mut robot = Robot::start("lager", mode, places, Beside::Nobody)?;
    let _bound = Bound::to(first)?;
    let mut commands = robot
        .bus()
        .subscriber::<SteeringCommand>()
        .map_err(no_bus)?;
    let services = robot.processes().services();
    let mut why = Why::begin(wanted.limit_ns);
    let stolen = stolen_ms();
    let turns = TURNS[usize::from(!options.quick)] * options.runs.max(1);
    let mut number = 0;
    for _ in 0..turns {
        robot.processes().wake();
        robot.begin()?;
        let frames = options.samples.unwrap_or(TURN);
        let mut plan = Plan::new(next_due(Clock::monotonic_ns()), PERIOD, REST);
        let mut taken = Vec::with_capacity(frames);
        for frame in 0..WARM_UP + frames {
            if interrupted() {
                return Err(BenchError::Interrupted);
            }
            if frame == WARM_UP {
                robot.counts(true)?;
            }
            let before = why.shares(&services);
            let times = robot.frame(plan.next().send)?;
            plan.answered(times[1]);
            let mut stamp = None;
            while let Some(sample) = commands.receive().map_err(no_bus)? {
                let is_of_it = sample.stamp().publish_time_ns <= times[1];
                stamp = Some(*sample.stamp()).filter(|_| is_of_it).or(stamp);
            }
            if frame >= WARM_UP {
                number += 1;
                let got = why.shares(&services).since(&before);
                why.shared(number, times, got);
                taken.push(way(number, times, stamp, services));
            }
        }
        robot.counts(false)?;
        why.turn_over(&services, &taken)?;
        robot.processes().rest();
    }
    let stolen = stolen_ms().saturating_sub(stolen);
    let (mut report, picture) = why.end();
    report.notes.push(format!(
        "a hypervisor kept {stolen} ms from this machine's cores meanwhile (in steps of 10)"
    ));
    Ok(Explained {
        mode,
        regime,
        realtime: wanted.realtime,
        report,
        picture,
    })
}

/// A frame's way, by the stamp of the command that answered it.
fn way(
    number: u64,
    [sent, answered]: [u64; 2],
    stamp: Option<Stamp>,
    [bridge, logic]: [u32; 2],
) -> Frame {
    let boards = Who::Thread(rustix::thread::gettid().as_raw_nonzero().get());
    let mut marks = Vec::new();
    if let Some(stamp) = stamp {
        let stages = [
            ("board to bridge", stamp.source_time_ns, bridge),
            ("bridge's reader", stamp.cause_publish_time_ns, bridge),
            ("bridge to logic", stamp.cause_receive_time_ns, logic),
            ("logic", stamp.publish_time_ns, logic),
        ];
        let times = stages.map(|(_, at_ns, _)| at_ns);
        if times.is_sorted() && times[0] >= sent && times[3] <= answered {
            marks.extend(stages.map(|(stage, at_ns, process)| Mark {
                stage,
                at_ns,
                by: Who::Process(process),
            }));
        }
    }
    let stage = match marks.is_empty() {
        true => "board to board",
        false => "bridge to board",
    };
    marks.push(Mark {
        stage,
        at_ns: answered,
        by: boards,
    });
    Frame {
        number,
        start_ns: sent,
        marks,
    }
}

/// What explains the frames.
enum Why {
    /// The kernel's events.
    Events(Box<Tracer>, Box<Explainer>),
    /// This user may not have them: the services' shares of time.
    Shares(Modest, NoTracing),
}

impl Why {
    fn begin(limit_ns: u64) -> Self {
        match Tracer::start(RING_KIB) {
            Ok(tracer) => {
                let explainer = Explainer::new(limit_ns, machine());
                Self::Events(Box::new(tracer), Box::new(explainer))
            }
            Err(refused) => Self::Shares(Modest::new(limit_ns), refused),
        }
    }

    /// What the services have got so far; nothing if there are events, which say more.
    fn shares(&self, services: &[u32]) -> Shares {
        match self {
            Self::Events(..) => Shares::default(),
            Self::Shares(..) => Shares::of(services),
        }
    }

    fn shared(&mut self, number: u64, [sent, answered]: [u64; 2], got: Shares) {
        if let Self::Shares(modest, _) = self {
            modest.frame(number, sent, answered.saturating_sub(sent), got);
        }
    }

    /// The turn is over and the robot still runs.
    fn turn_over(&mut self, services: &[u32; 2], frames: &[Frame]) -> Result<(), BenchError> {
        let Self::Events(tracer, explainer) = self else {
            return Ok(());
        };
        for (process, name) in services.iter().zip(["bridge", "logic"]) {
            explainer.knows(*process, name, threads(*process));
        }
        let whole = tracer.read(&mut explainer.line)?;
        frames.iter().for_each(|frame| explainer.frame(frame));
        explainer.line.forget_before(whole);
        Ok(())
    }

    /// The verdicts, and the picture of the latest frames.
    fn end(self) -> (lager_tracer::Report, String) {
        match self {
            Self::Events(tracer, mut explainer) => {
                name_functions(&mut explainer.line);
                let mut report = explainer.report();
                let missing = tracer.missing();
                if !missing.is_empty() {
                    let list = missing.join(", ");
                    report
                        .notes
                        .push(format!("this kernel has no events {list}"));
                }
                let picture = explainer.chrome(&report);
                (report, picture)
            }
            Self::Shares(modest, refused) => (modest.report(&refused.to_string()), String::new()),
        }
    }
}
