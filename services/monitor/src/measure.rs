//! The common part of `topic hz`, `bw` and `delay`. They read only the stamps, and print a line for
//! the samples of each second.

use std::io::Write;
use std::time::{Duration, Instant};

use lager_ports::{ReceiveError, Source};
use lager_sample::{Stamp, Topic};
use lager_topics::{TopicVisitor, visit};
use lager_wake::Pace;
use serde_json::{Value, json};

use crate::origin::Origin;
use crate::source::Stamped;
use crate::wakeful::Wakeful;
use crate::{ToolError, Tools};

/// The tool prints one line for each window.
const WINDOW: Duration = Duration::from_secs(1);

/// When a tool ends by itself: at whichever limit comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// After this time.
    pub duration: Option<Duration>,
    /// After this many samples.
    pub count: Option<u64>,
}

impl Limits {
    /// How long the tool still has.
    pub(crate) fn left(&self, began: Instant) -> Duration {
        match self.duration {
            Some(duration) => duration.saturating_sub(began.elapsed()),
            None => Duration::MAX,
        }
    }

    /// Whether the tool ends after this time and this many samples.
    pub(crate) fn are_reached(&self, began: Instant, samples: u64) -> bool {
        self.count.is_some_and(|count| samples >= count)
            || self
                .duration
                .is_some_and(|duration| began.elapsed() >= duration)
    }
}

/// One sample, as an observer finds it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    pub(crate) stamp: Stamp,
    /// When the look began that found it.
    pub(crate) looked_ns: u64,
    pub(crate) received_ns: u64,
    /// How far both may be wrong beside the stamp's times.
    pub(crate) unsure_ns: u64,
}

/// Measures the samples of one window.
pub(crate) trait Gauge {
    fn add(&mut self, seen: &Arrival);

    /// The gauge of the next window.
    fn next(self) -> Self;

    /// Looks at what it shows beside the samples, at the end of each window.
    ///
    /// # Errors
    /// The transport failed.
    fn look(&mut self) -> Result<(), ReceiveError> {
        Ok(())
    }

    /// What is said for people after the last window; empty for nothing.
    fn last_words(&self) -> String {
        String::new()
    }

    /// The figures for programs, as an object.
    fn as_json(&self) -> Value;

    /// The figures for people, without the losses.
    fn as_text(&self) -> String;
}

/// What to measure, and how.
pub(crate) struct Plan<F> {
    pub(crate) limits: Limits,
    /// How often it looks.
    pub(crate) pace: Pace,
    /// Whether it is woken for each sample where that can be.
    pub(crate) woken: bool,
    /// The head line; empty for none.
    pub(crate) head: &'static str,
    /// Whether it compares stamps with the time of their arrival.
    pub(crate) needs_clock: bool,
    /// Makes a gauge for payloads of this many bytes.
    pub(crate) gauge: F,
}

impl<W: Write, P: Origin> Tools<'_, W, P> {
    pub(crate) fn measure<G: Gauge, F: Fn(usize) -> G>(
        &mut self,
        name: &str,
        plan: &Plan<F>,
    ) -> Result<(), ToolError> {
        if plan.needs_clock && self.place.time().unsure_ns == u64::MAX {
            return Err(ToolError::OtherClock);
        }
        let tools = &mut *self;
        if let Ok(Some(measured)) = visit(name, Measure { tools, plan }) {
            return measured;
        }
        let found = self.described(name)?;
        let size = found.description().size();
        self.measure_from(name, size, found, plan)
    }

    fn measure_from<G: Gauge, F: Fn(usize) -> G>(
        &mut self,
        name: &str,
        size: usize,
        mut from: impl Source,
        plan: &Plan<F>,
    ) -> Result<(), ToolError> {
        let began = Instant::now();
        let (mut total, mut lost, mut is_over) = (0, 0, false);
        let mut heard = began;
        let mut pace = plan.pace.clone();
        let mut wakeful = match plan.woken {
            true => Some(Wakeful::new(self, &from, pace.wait(), Duration::ZERO)?),
            false => None,
        };
        if !self.as_json && !plan.head.is_empty() {
            let unsure_ns = self.place.time().unsure_ns;
            if unsure_ns > 0 {
                let ms = unsure_ns as f64 / 1e6;
                writeln!(
                    self.out,
                    "the robot's clock is another one, known here to {ms:.3} ms; what is below that \
                     is not told"
                )?;
            }
            writeln!(self.out, "{}", plan.head)?;
        }
        let mut gauge = (plan.gauge)(size);
        'windows: while !is_over {
            let before = total;
            let end = Instant::now() + WINDOW;
            while !is_over && Instant::now() < end {
                if self.shutdown.is_requested() {
                    break 'windows;
                }
                let looked_ns = self.place.time().now_ns;
                let so_far = total;
                while !is_over && let Some(stamp) = self.receive(&mut from, Stamped)? {
                    let now = self.place.time();
                    gauge.add(&Arrival {
                        stamp,
                        looked_ns,
                        received_ns: now.now_ns,
                        unsure_ns: now.unsure_ns,
                    });
                    total += 1;
                    heard = Instant::now();
                    is_over = plan.limits.are_reached(began, total);
                }
                is_over |= plan.limits.are_reached(began, total);
                if !is_over {
                    pace.found(total - so_far, from.queue());
                    self.ask_why(heard)?;
                    let left = plan.limits.left(began);
                    match &mut wakeful {
                        Some(wakeful) => {
                            wakeful.wait(left.min(end.saturating_duration_since(Instant::now())));
                        }
                        None => std::thread::sleep(pace.wait()),
                    }
                }
            }
            // A loss over a link is taken back if the sample comes late.
            let newly_lost = from.lost().saturating_sub(lost);
            lost = from.lost();
            self.watchdog.over("reading the topic", || gauge.look())?;
            if self.as_json {
                let mut value = gauge.as_json();
                value["topic"] = json!(name);
                value["samples"] = json!(total - before);
                value["lost"] = json!(newly_lost);
                writeln!(self.out, "{value}")?;
            } else if total == before {
                writeln!(self.out, "no sample in the last second")?;
            } else {
                writeln!(self.out, "{}   lost {newly_lost}", gauge.as_text())?;
            }
            gauge = gauge.next();
            self.out.flush()?;
        }
        let last = gauge.last_words();
        if !self.as_json && !last.is_empty() {
            writeln!(self.out, "{last}")?;
        }
        Ok(())
    }
}

struct Measure<'a, 'b, W, P, F> {
    tools: &'a mut Tools<'b, W, P>,
    plan: &'a Plan<F>,
}

impl<W: Write, P: Origin, G: Gauge, F: Fn(usize) -> G> TopicVisitor for Measure<'_, '_, W, P, F> {
    /// `None` if the topic has another layout than this program's.
    type Output = Option<Result<(), ToolError>>;

    fn visit<T: Topic>(self) -> Self::Output {
        let from = match self.tools.typed::<T>() {
            Ok(from) => from?,
            Err(error) => return Some(Err(error)),
        };
        let size = size_of::<T::Payload>();
        Some(self.tools.measure_from(T::NAME, size, from, self.plan))
    }
}
