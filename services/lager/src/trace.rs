//! `lager trace`: why frames of a running robot are late, by the kernel's events around each.
//!
//! It joins the bus as an observer, for the stamps of the sensor frames, and opens an instance of its
//! own in tracefs. [`lager_tracer`] finds the causes. Without the right to tracefs it says so, and
//! what `/proc` tells of the whole time.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use lager_ports::{Bus, Subscriber};
use lager_sample::{Stamp, Topic};
use lager_topics::{NavStatus, Role, SensorDistance, SensorLine};
use lager_tracer::proc::{Shares, machine, stolen_ms, threads};
use lager_tracer::{Explainer, NoTracing, Report, Services, Tracer, name_functions};

use crate::cli::TraceArgs;
use crate::config::Config;
use crate::time_limit::TimeLimit;
use crate::{diagnose, topic};

/// The ring of events of each core, in KiB: a second of a busy machine.
const RING_KIB: u32 = 16 * 1024;
/// How often samples and events are read.
const LOOK: Duration = Duration::from_millis(50);
/// A frame is explained when its way is surely over, or too long.
const SETTLED_NS: u64 = lager_tracer::follow::LONGEST_NS + 100_000_000;

/// Traces for the time that was asked for.
pub fn run(config: &Config, args: &TraceArgs, patience: &TimeLimit) -> Result<String> {
    diagnose::must_be_up(config)?;
    let bus = topic::join(config, Role::Observer, &patience.watchdog)?;
    let mut frames = Frames::of(&bus)?;
    let duration = Duration::from_secs_f64(args.duration);
    let mut tracer = match Tracer::start(RING_KIB) {
        Ok(tracer) => tracer,
        Err(refused) => return frames.modestly(&refused, duration, patience),
    };
    let mut explainer = Explainer::new(args.late, machine());
    let stolen = stolen_ms();
    let start = Instant::now();
    let settling = Duration::from_nanos(SETTLED_NS) + LOOK;
    let mut unseen = 0_u64;
    while start.elapsed() < duration + settling && !patience.shutdown.is_requested() {
        std::thread::sleep(LOOK);
        frames.hear(start.elapsed() < duration)?;
        let whole = tracer.read(&mut explainer.line)?;
        let settled = whole.saturating_sub(SETTLED_NS);
        let services = frames.services(&mut explainer);
        for (number, times) in frames.take_until(settled) {
            match services.follow(&explainer.line, number, times) {
                Some(frame) => explainer.frame(&frame),
                None => unseen += 1,
            }
        }
        // Before the oldest frame that still waits, for whoever ran then.
        explainer
            .line
            .forget_before(settled.saturating_sub(SETTLED_NS / 10));
    }
    name_functions(&mut explainer.line);
    let mut report = explainer.report();
    if unseen > 0 {
        report.notes.push(format!(
            "{unseen} frames met logic awake and were not followed"
        ));
    }
    if frames.lost() > 0 {
        let lost = frames.lost();
        report
            .notes
            .push(format!("{lost} samples were lost on the way to this tool"));
    }
    let stolen = stolen_ms().saturating_sub(stolen);
    report.notes.push(format!(
        "a hypervisor kept {stolen} ms from this machine's cores meanwhile (in steps of 10)"
    ));
    if !tracer.missing().is_empty() {
        let missing = tracer.missing().join(", ");
        report
            .notes
            .push(format!("this kernel has no events {missing}"));
    }
    if let Some(file) = &args.out {
        let drawn = std::fs::write(file, explainer.chrome(&report));
        drawn.with_context(|| format!("cannot write {}", file.display()))?;
    }
    said(&report, args.json)
}

fn said(report: &Report, json: bool) -> Result<String> {
    Ok(match json {
        true => serde_json::to_string(report)?,
        false => report.to_string().trim_end().to_owned(),
    })
}

/// The sensor frames that the robot's bus had, and who wrote them.
struct Frames {
    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    status: Subscriber<NavStatus>,
    /// Bridge and logic; 0 until one of their samples has come.
    bridge: u32,
    logic: u32,
    /// Number of each, and when it was read and published, in ns.
    heard: Vec<(u64, [u64; 2])>,
    next: u64,
}

impl Frames {
    fn of(bus: &Bus) -> Result<Self> {
        Ok(Self {
            line: bus.subscriber()?,
            distance: bus.subscriber()?,
            status: bus.subscriber()?,
            bridge: 0,
            logic: 0,
            heard: Vec::new(),
            next: 0,
        })
    }

    /// Reads what has come. Only what comes in time counts.
    fn hear(&mut self, counts: bool) -> Result<()> {
        fn all<T: Topic>(from: &mut Subscriber<T>) -> Result<Vec<Stamp>> {
            let mut stamps = Vec::new();
            while let Some(sample) = from.receive()? {
                stamps.push(*sample.stamp());
            }
            Ok(stamps)
        }
        if let Some(stamp) = all(&mut self.status)?.last() {
            self.logic = stamp.writer;
        }
        let mut stamps = all(&mut self.line)?;
        stamps.extend(all(&mut self.distance)?);
        for stamp in stamps {
            self.bridge = stamp.writer;
            let times = [stamp.source_time_ns, stamp.publish_time_ns];
            if counts && times.is_sorted() {
                self.next += 1;
                self.heard.push((self.next, times));
            }
        }
        Ok(())
    }

    fn lost(&self) -> u64 {
        self.line.lost() + self.distance.lost()
    }

    /// The threads of both services.
    fn services(&self, explainer: &mut Explainer) -> Services {
        let of = |process| match process {
            0 => Vec::new(),
            process => threads(process),
        };
        let services = Services {
            bridge: of(self.bridge),
            logic: of(self.logic),
        };
        explainer.knows(self.bridge, "bridge", services.bridge.clone());
        explainer.knows(self.logic, "logic", services.logic.clone());
        services
    }

    /// The frames that were published before that time, in ns.
    fn take_until(&mut self, ns: u64) -> Vec<(u64, [u64; 2])> {
        let (taken, stay) = self.heard.drain(..).partition(|(_, times)| times[1] < ns);
        self.heard = stay;
        taken
    }

    /// What can be said without the kernel's events.
    fn modestly(
        &mut self,
        refused: &NoTracing,
        duration: Duration,
        patience: &TimeLimit,
    ) -> Result<String> {
        let start = Instant::now();
        let mut before = None;
        while start.elapsed() < duration && !patience.shutdown.is_requested() {
            std::thread::sleep(LOOK);
            self.hear(true)?;
            if before.is_none() && self.bridge > 0 && self.logic > 0 {
                let each = [self.bridge, self.logic].map(|process| Shares::of(&[process]));
                before = Some((Instant::now(), each));
            }
        }
        let (since, before) = before.context("the robot sent no frames meanwhile")?;
        let seconds = since.elapsed().as_secs_f64();
        let mut said = format!("no causes of single frames: {refused}\n");
        for (name, process, before) in [
            ("bridge", self.bridge, before[0]),
            ("logic", self.logic, before[1]),
        ] {
            let got = Shares::of(&[process]).since(&before);
            let per_second = |ns: u64| ns as f64 / 1e6 / seconds;
            said += &format!(
                "{name}: each second {:.2} ms on a core, {:.2} ms ready without a core; \
                 {} page faults that waited for a disk\n",
                per_second(got.ran_ns),
                per_second(got.waited_ns),
                got.major_faults
            );
        }
        Ok(said.trim_end().to_owned())
    }
}
