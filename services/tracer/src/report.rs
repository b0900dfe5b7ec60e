//! What became of late frames: the verdict on each, and a table of causes.

use core::fmt;
use std::collections::BTreeMap;

use serde::Serialize;

use crate::frame::Cause;

/// The verdict on a late frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Verdict {
    /// The frame's number.
    pub number: u64,
    /// When its way began, in ns of `CLOCK_MONOTONIC`.
    pub start_ns: u64,
    /// How long it took, in ns.
    pub took_ns: u64,
    /// Why.
    pub cause: Cause,
    /// How long that took beyond what is usual, in ns.
    pub beyond_ns: u64,
    /// Which interrupt, behind whom, and so on.
    pub detail: String,
    /// In which stage the longest part of it was.
    pub stage: &'static str,
    /// The thread that it kept.
    pub thread: String,
    /// On which core.
    pub core: Option<usize>,
}

/// A line of the table: late frames of one cause.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Line {
    /// The cause.
    pub cause: Cause,
    /// See [`Verdict::detail`].
    pub detail: String,
    /// How many late frames.
    pub count: usize,
    /// The longest time of such a frame, in ns.
    pub worst_ns: u64,
    /// What the cause took of it beyond what is usual, in ns.
    pub beyond_ns: u64,
    /// The stage of that frame.
    pub stage: &'static str,
    /// The thread that it kept.
    pub thread: String,
}

/// What became of late frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// How many frames there were.
    pub frames: u64,
    /// Those that took longer are late, in ns.
    pub limit_ns: u64,
    /// What each cause takes in the median frame that is in time, in ns.
    pub usual_ns: BTreeMap<Cause, u64>,
    /// The causes, the most frequent first.
    pub causes: Vec<Line>,
    /// Each late frame, the latest first.
    pub late: Vec<Verdict>,
    /// How often the kernel left out events, because they were not read in time.
    pub holes: u64,
    /// What a person should know beside it.
    pub notes: Vec<String>,
}

/// Late frames that are shown one by one.
const SHOWN: usize = 10;

impl Report {
    pub(crate) fn new(
        frames: u64,
        limit_ns: u64,
        usual_ns: BTreeMap<Cause, u64>,
        mut late: Vec<Verdict>,
        holes: u64,
    ) -> Self {
        late.sort_by_key(|verdict| core::cmp::Reverse(verdict.took_ns));
        let mut causes: Vec<Line> = Vec::new();
        // The latest comes first, so each line has its worst from the beginning.
        for verdict in &late {
            let same = |line: &&mut Line| {
                line.cause == verdict.cause
                    && (line.detail == verdict.detail || line.cause == Cause::Unknown)
            };
            match causes.iter_mut().find(same) {
                Some(line) => line.count += 1,
                None => causes.push(Line {
                    cause: verdict.cause,
                    detail: verdict.detail.clone(),
                    count: 1,
                    worst_ns: verdict.took_ns,
                    beyond_ns: verdict.beyond_ns,
                    stage: verdict.stage,
                    thread: verdict.thread.clone(),
                }),
            }
        }
        causes.sort_by_key(|line| core::cmp::Reverse(line.count));
        Self {
            frames,
            limit_ns,
            usual_ns,
            causes,
            late,
            holes,
            notes: Vec::new(),
        }
    }

    /// How many late frames have this cause.
    pub fn count(&self, cause: Cause) -> usize {
        let lines = self.causes.iter().filter(|line| line.cause == cause);
        lines.map(|line| line.count).sum()
    }
}

/// ns as us.
fn us(ns: u64) -> String {
    format!("{:.1}", ns as f64 / 1e3)
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limit = us(self.limit_ns);
        let late = self.late.len();
        writeln!(
            f,
            "{late} of {} frames took longer than {limit} us",
            self.frames
        )?;
        if !self.usual_ns.is_empty() {
            let part = |(cause, ns): (&Cause, &u64)| format!("{} {}", cause.name(), us(*ns));
            let parts: Vec<_> = self.usual_ns.iter().map(part).collect();
            writeln!(f, "a frame in time, us in the median: {}", parts.join(", "))?;
        }
        if late > 0 {
            writeln!(f, "\nlate  worst, us  beyond, us  cause")?;
        }
        for line in &self.causes {
            let (worst, beyond) = (us(line.worst_ns), us(line.beyond_ns));
            let cause = line.cause.name();
            writeln!(
                f,
                "{:>4} {worst:>10}  {beyond:>10}  {cause}: {}{}",
                line.count,
                line.detail,
                place(line.stage, &line.thread)
            )?;
        }
        if late > 0 {
            writeln!(f, "\n frame    took, us  beyond, us  the latest")?;
        }
        for verdict in self.late.iter().take(SHOWN) {
            let (took, beyond) = (us(verdict.took_ns), us(verdict.beyond_ns));
            let cause = verdict.cause.name();
            writeln!(
                f,
                "{:>6}  {took:>10}  {beyond:>10}  {cause}: {}{}",
                verdict.number,
                verdict.detail,
                place(verdict.stage, &verdict.thread)
            )?;
        }
        if self.holes > 0 {
            writeln!(
                f,
                "\nthe kernel left out events {} times; a late frame of such a time is unknown",
                self.holes
            )?;
        }
        for note in &self.notes {
            writeln!(f, "{note}")?;
        }
        Ok(())
    }
}

/// Where it happened, if that is known.
fn place(stage: &str, thread: &str) -> String {
    match stage {
        "" => String::new(),
        stage => format!(" ({stage}: {thread})"),
    }
}
