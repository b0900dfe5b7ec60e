//! `topic delay`: how old samples are when they are published, and when an observer gets them.
//!
//! The tool is woken when everybody else has the sample. Over a robot's gateway nobody wakes it; it
//! looks every millisecond, and a sample waits for the next look. So the tool notes when each look
//! begins, and reports the wait separately:
//!
//! ```text
//!  source_time --> publish_time ~~~~> look --> received
//!    | written     |    own wait     | read    |       a sample that waited for the look
//!
//!  source_time --> look ... publish_time ----> received
//!    | written            |          read      |       one that came during the look
//! ```
//!
//! Over a robot's gateway the clocks of both machines are compared by round trips. A delay between
//! them that is smaller than the comparison is sure has no figure: `-` in text, null in JSON.
//!
//! Of the topics of the path it also tells what logic and bridge have counted themselves ([`Actor`]).
//!
//! `read` contains the time that the bus takes, as far as an observer can see it. `lager bench hop`
//! measures how long a receiver takes that the bus wakes.

use std::cell::Cell;
use std::io::Write;
use std::time::Duration;

use hdrhistogram::Histogram;
use lager_ports::ReceiveError;
use lager_wake::Pace;
use serde_json::{Value, json};

use crate::actor::Actor;
use crate::measure::{Arrival, Gauge, Limits, Plan};
use crate::origin::Origin;
use crate::{ToolError, Tools};

/// The time between two looks where nobody wakes it. It is a fifth of the other tools' shortest one,
/// so the wait is short.
const POLL: Duration = Duration::from_millis(1);

/// Longer delays are not told apart, in ns: a minute.
const LONGEST_NS: u64 = 60_000_000_000;

impl<W: Write, P: Origin> Tools<'_, W, P> {
    /// `topic delay`: measures the delays of `name` until a limit or the shutdown.
    ///
    /// # Errors
    /// No topic has that name, it cannot be read, or the output cannot be written.
    pub fn delay(&mut self, name: &str, limits: Limits) -> Result<(), ToolError> {
        let open = || Actor::of(name, self.place);
        let actor = self.watchdog.over("opening the topic", open);
        let actor = Cell::new(actor.map_err(Into::into)?);
        let plan = Plan {
            limits,
            pace: Pace::every(POLL),
            woken: true,
            head: HEAD,
            needs_clock: true,
            gauge: |_| Delays {
                actor: actor.take(),
                ..Delays::default()
            },
        };
        self.measure(name, &plan)
    }
}

const HEAD: &str = "\
         source -> publish (ms)            publish -> receive (ms)           own wait
samples     p50      p99      max         p50      p99      max         p50      max";

/// One stage's delays, in ns.
#[derive(Debug)]
pub(crate) struct Stage(Histogram<u64>);

impl Default for Stage {
    fn default() -> Self {
        // Three digits are exact.
        Self(Histogram::new_with_bounds(1, LONGEST_NS, 3).expect("bounds that make sense"))
    }
}

impl Stage {
    pub(crate) fn add(&mut self, ns: u64) {
        self.0.saturating_record(ns);
    }

    pub(crate) fn at(&self, percent: f64) -> u64 {
        match self.0.is_empty() {
            true => 0,
            false => self.0.value_at_percentile(percent),
        }
    }

    pub(crate) fn max(&self) -> u64 {
        match self.0.is_empty() {
            true => 0,
            false => self.0.max(),
        }
    }

    /// The figures that are not smaller than the clocks are unsure.
    fn as_json(&self, unsure_ns: u64) -> Value {
        let sure = |ns: u64| (ns >= unsure_ns).then_some(ns);
        // With fewer than ten beyond it, it would be little more than the longest by another name.
        let is_many = self.0.len() >= 10_000;
        let p999 = is_many.then(|| sure(self.at(99.9))).flatten();
        json!({
            "p50_ns": sure(self.at(50.0)), "p90_ns": sure(self.at(90.0)),
            "p99_ns": sure(self.at(99.0)), "p999_ns": p999,
            "max_ns": sure(self.max()),
        })
    }
}

/// A figure in ms, if it is not smaller than the clocks are unsure.
fn ms(ns: u64, unsure_ns: u64) -> String {
    match ns >= unsure_ns {
        true => format!("{:8.3}", ns as f64 / 1e6),
        false => format!("{:>8}", "-"),
    }
}

/// The delays of one window.
#[derive(Default)]
struct Delays {
    samples: u64,
    /// From the source to the publication.
    written: Stage,
    /// From the publication to the beginning of the look that found the sample.
    own_wait: Stage,
    /// From that moment until the observer had the sample; from the publication if it came later.
    read: Stage,
    /// How far the last two may be wrong, at most.
    unsure_ns: u64,
    /// Who counts these samples itself.
    actor: Option<Actor>,
}

impl Gauge for Delays {
    fn add(&mut self, seen: &Arrival) {
        self.unsure_ns = self.unsure_ns.max(seen.unsure_ns);
        let published = seen.stamp.publish_time_ns;
        self.samples += 1;
        self.written
            .add(published.saturating_sub(seen.stamp.source_time_ns));
        self.own_wait.add(seen.looked_ns.saturating_sub(published));
        self.read.add(
            seen.received_ns
                .saturating_sub(seen.looked_ns.max(published)),
        );
    }

    fn next(self) -> Self {
        Self {
            actor: self.actor,
            ..Self::default()
        }
    }

    fn look(&mut self) -> Result<(), ReceiveError> {
        self.actor.as_mut().map_or(Ok(()), Actor::look)
    }

    fn last_words(&self) -> String {
        self.actor.as_ref().map_or_else(String::new, Actor::as_text)
    }

    fn as_json(&self) -> Value {
        json!({
            "source_to_publish": self.written.as_json(0),
            "publish_to_receive": self.read.as_json(self.unsure_ns),
            "own_wait": self.own_wait.as_json(self.unsure_ns),
            "clock_unsure_ns": self.unsure_ns,
            "actor": self.actor.as_ref().map(Actor::as_json),
        })
    }

    fn as_text(&self) -> String {
        let three = |stage: &Stage, unsure_ns: u64| {
            [stage.at(50.0), stage.at(99.0), stage.max()]
                .map(|ns| ms(ns, unsure_ns))
                .join(" ")
        };
        format!(
            "{:7} {}    {}    {} {}",
            self.samples,
            three(&self.written, 0),
            three(&self.read, self.unsure_ns),
            ms(self.own_wait.at(50.0), self.unsure_ns),
            ms(self.own_wait.max(), self.unsure_ns),
        )
    }
}

#[cfg(test)]
mod tests {
    use lager_sample::Stamp;

    use super::*;

    fn seen(source: u64, published: u64, looked_ns: u64, received_ns: u64) -> Arrival {
        Arrival {
            stamp: Stamp {
                source_time_ns: source,
                publish_time_ns: published,
                ..Stamp::default()
            },
            looked_ns,
            received_ns,
            unsure_ns: 0,
        }
    }

    #[test]
    fn the_observers_own_wait_is_no_delay_of_the_bus() {
        let mut delays = Delays::default();
        delays.add(&seen(1_000, 3_000, 903_000, 903_500));
        assert_eq!(delays.written.max(), 2_000);
        assert_eq!(delays.own_wait.max() / 1_000, 900);
        assert_eq!(delays.read.max(), 500);
        // A sample that comes during the look has not waited.
        let mut delays = Delays::default();
        delays.add(&seen(1_000, 3_000, 2_500, 3_700));
        assert_eq!((delays.own_wait.max(), delays.read.max()), (0, 700));
    }

    #[test]
    fn a_delay_that_the_clocks_cannot_tell_has_no_figure() {
        let mut delays = Delays::default();
        delays.add(&Arrival {
            unsure_ns: 1_000,
            ..seen(1_000, 3_000, 2_500, 3_700)
        });
        let json = delays.as_json();
        assert_eq!(json["publish_to_receive"]["max_ns"], Value::Null);
        assert_eq!(json["source_to_publish"]["max_ns"], 2_000);
        assert_eq!(json["clock_unsure_ns"], 1_000);
        delays.add(&seen(1_000, 3_000, 2_500, 103_000));
        assert_eq!(delays.as_json()["publish_to_receive"]["max_ns"], 100_031);
        assert!(delays.as_text().contains(" - "), "{}", delays.as_text());
    }
}
