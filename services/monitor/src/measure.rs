//! What `topic hz`, `bw` and `delay` share: they look at stamps only, and tell each second what the
//! samples of that second were.

use std::io::Write;
use std::time::{Duration, Instant};

use lager_ports::{Clock, Source, urgency};
use lager_topics::{Stamp, Topic, TopicVisitor, visit};
use serde_json::{Value, json};

use crate::source::Stamped;
use crate::{POLL, ToolError, Tools};

/// One line is printed for each window.
const WINDOW: Duration = Duration::from_secs(1);

/// The longest wait between two looks, and how much of it each place of the queue allows.
const LONGEST_WAIT: Duration = Duration::from_millis(50);
const PLACE: Duration = Duration::from_micros(200);

/// When a tool ends by itself; whatever comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// After so long.
    pub duration: Option<Duration>,
    /// After so many samples.
    pub count: Option<u64>,
}

impl Limits {
    /// Whether it is to end after so long and so many samples.
    pub(crate) fn are_reached(&self, began: Instant, samples: u64) -> bool {
        self.count.is_some_and(|count| samples >= count)
            || self
                .duration
                .is_some_and(|duration| began.elapsed() >= duration)
    }
}

/// One sample as an observer meets it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub(crate) stamp: Stamp,
    /// When the look at the queue began that found it.
    pub(crate) looked_ns: u64,
    pub(crate) received_ns: u64,
}

/// What is measured of the samples of one window.
pub(crate) trait Gauge {
    fn add(&mut self, seen: &Seen);

    /// The gauge of the window that follows.
    fn next(&self) -> Self;

    /// For programs, an object.
    fn as_json(&self) -> Value;

    /// For people, what stands before the losses.
    fn as_text(&self) -> String;
}

/// How long a tool waits between two looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pace {
    /// So long.
    Every(Duration),
    /// As long as most of the queue stays free, for what is measured by stamps alone. Every look
    /// takes a core from somebody, and sixty observers may look on at once.
    AsTheQueueAllows,
}

impl Pace {
    /// The wait before the first look.
    fn first(self) -> Duration {
        match self {
            Self::Every(wait) => wait,
            Self::AsTheQueueAllows => POLL,
        }
    }

    /// The wait that follows `wait`, after which `samples` were found in a queue of `queue`.
    fn next(self, wait: Duration, samples: u64, queue: usize) -> Duration {
        let queue = queue as u64;
        let most = POLL.max(PLACE * queue as u32).min(LONGEST_WAIT);
        match self {
            Self::Every(wait) => wait,
            Self::AsTheQueueAllows if samples * 4 > queue => POLL.max(wait / 2),
            Self::AsTheQueueAllows if samples * 8 <= queue => most.min(wait * 2),
            Self::AsTheQueueAllows => wait.min(most),
        }
    }
}

/// What is measured and how.
pub(crate) struct Plan<F> {
    pub(crate) limits: Limits,
    pub(crate) pace: Pace,
    /// The line above the first one; none if it is empty.
    pub(crate) head: &'static str,
    /// Makes a gauge for payloads of so many bytes.
    pub(crate) gauge: F,
}

impl<W: Write> Tools<'_, W> {
    pub(crate) fn measure<G: Gauge, F: Fn(usize) -> G>(
        &mut self,
        name: &str,
        plan: Plan<F>,
    ) -> Result<(), ToolError> {
        let tools = &mut *self;
        match visit(name, Measure { tools, plan: &plan }) {
            Ok(measured) => measured,
            Err(unknown) => {
                let found = self.found(name, unknown)?;
                let size = found.description().size();
                self.measure_from(name, size, found, &plan)
            }
        }
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
        let mut wait = plan.pace.first();
        if plan.pace == Pace::AsTheQueueAllows {
            urgency::wake_with_others(2 * POLL);
        }
        if !self.as_json && !plan.head.is_empty() {
            writeln!(self.out, "{}", plan.head)?;
        }
        let mut gauge = (plan.gauge)(size);
        while !is_over {
            let before = total;
            let end = Instant::now() + WINDOW;
            while !is_over && Instant::now() < end {
                if self.shutdown.is_requested() {
                    return Ok(());
                }
                let looked_ns = Clock::monotonic_ns();
                let so_far = total;
                while !is_over && let Some(stamp) = self.receive(&mut from, Stamped)? {
                    let received_ns = Clock::monotonic_ns();
                    gauge.add(&Seen {
                        stamp,
                        looked_ns,
                        received_ns,
                    });
                    total += 1;
                    heard = Instant::now();
                    is_over = plan.limits.are_reached(began, total);
                }
                is_over |= plan.limits.are_reached(began, total);
                if !is_over {
                    self.pause(heard, wait)?;
                    wait = plan.pace.next(wait, total - so_far, from.queue());
                }
            }
            let newly_lost = from.lost() - lost;
            lost = from.lost();
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
        Ok(())
    }
}

struct Measure<'a, 'b, W, F> {
    tools: &'a mut Tools<'b, W>,
    plan: &'a Plan<F>,
}

impl<W: Write, G: Gauge, F: Fn(usize) -> G> TopicVisitor for Measure<'_, '_, W, F> {
    type Output = Result<(), ToolError>;

    fn visit<T: Topic>(self) -> Self::Output {
        let subscriber = self.tools.subscriber::<T>()?;
        let size = size_of::<T::Payload>();
        self.tools
            .measure_from(T::NAME, size, subscriber, self.plan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The wait after some seconds of so many samples a second.
    fn settled(per_second: u64, queue: usize) -> Duration {
        let pace = Pace::AsTheQueueAllows;
        (0..100).fold(pace.first(), |wait, _| {
            let samples = per_second * wait.as_micros() as u64 / 1_000_000;
            pace.next(wait, samples, queue)
        })
    }

    #[test]
    fn a_tool_looks_as_seldom_as_most_of_the_queue_stays_free() {
        let ms = Duration::from_millis;
        assert_eq!(settled(200, 256), ms(50));
        assert_eq!(settled(1_000, 256), ms(40));
        assert_eq!(settled(10_000, 256), ms(5));
        // A place that each sample takes from the one before is looked at often.
        assert_eq!(settled(50, 1), POLL);
        assert_eq!(settled(0, 16), POLL);
        assert_eq!(Pace::Every(ms(1)).next(ms(1), 0, 256), ms(1));
    }
}
