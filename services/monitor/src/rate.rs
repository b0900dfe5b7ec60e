//! `topic hz` and `topic bw`: rate, bytes and losses of one topic, and how old its samples were at
//! their publication. Once a second, from the stamps alone.

use std::io::Write;

use lager_sample::Stamp;
use lager_wake::Pace;
use serde_json::{Value, json};

use crate::measure::{Arrival, Gauge, Limits, Plan};
use crate::origin::Origin;
use crate::{ToolError, Tools};

impl<W: Write, P: Origin> Tools<'_, W, P> {
    /// `topic hz`: measures the rate of `name` until a limit or the shutdown.
    ///
    /// # Errors
    /// No topic has that name, it cannot be read, or the output cannot be written.
    pub fn hz(&mut self, name: &str, limits: Limits) -> Result<(), ToolError> {
        self.measure(name, &plan(limits, |_| Rate::default()))
    }

    /// `topic bw`: measures the bytes a second of `name`, stamps included, until a limit or the
    /// shutdown.
    ///
    /// # Errors
    /// As [`Tools::hz`].
    pub fn bandwidth(&mut self, name: &str, limits: Limits) -> Result<(), ToolError> {
        let gauge = |payload| Bandwidth {
            payload,
            rate: Rate::default(),
        };
        self.measure(name, &plan(limits, gauge))
    }
}

fn plan<F>(limits: Limits, gauge: F) -> Plan<F> {
    Plan {
        limits,
        pace: Pace::counting(),
        woken: false,
        head: "",
        needs_clock: false,
        gauge,
    }
}

/// What the stamps of one window tell.
#[derive(Debug, Default)]
struct Rate {
    samples: u64,
    /// The last sample before the window.
    before_ns: Option<u64>,
    first_ns: u64,
    last_ns: u64,
    longest_gap_ns: u64,
    oldest_source_ns: u64,
}

impl Rate {
    /// Samples a second, from the last sample before the window to the last one in it. In the first
    /// window, from its first sample. So a topic that comes once a second has a rate, too.
    fn hz(&self) -> f64 {
        if self.samples == 0 {
            return 0.0;
        }
        let (samples, from_ns) = match self.before_ns {
            Some(before_ns) => (self.samples, before_ns),
            None => (self.samples - 1, self.first_ns),
        };
        match self.last_ns.saturating_sub(from_ns) {
            0 => 0.0,
            span => samples as f64 * 1e9 / span as f64,
        }
    }

    /// The last sample so far.
    fn latest_ns(&self) -> Option<u64> {
        (self.samples > 0)
            .then_some(self.last_ns)
            .or(self.before_ns)
    }
}

impl Gauge for Rate {
    fn add(&mut self, seen: &Arrival) {
        let stamp = &seen.stamp;
        if let Some(latest_ns) = self.latest_ns() {
            let gap = stamp.publish_time_ns.saturating_sub(latest_ns);
            self.longest_gap_ns = self.longest_gap_ns.max(gap);
        }
        if self.samples == 0 {
            self.first_ns = stamp.publish_time_ns;
        }
        self.last_ns = stamp.publish_time_ns;
        let age = stamp.publish_time_ns.saturating_sub(stamp.source_time_ns);
        self.oldest_source_ns = self.oldest_source_ns.max(age);
        self.samples += 1;
    }

    fn next(self) -> Self {
        Self {
            before_ns: self.latest_ns(),
            ..Self::default()
        }
    }

    fn as_json(&self) -> Value {
        json!({
            "hz": self.hz(), "longest_gap_ns": self.longest_gap_ns,
            "oldest_ns": self.oldest_source_ns,
        })
    }

    fn as_text(&self) -> String {
        format!(
            "{:9.2} Hz   longest gap {:8.3} ms   oldest {:8.3} ms",
            self.hz(),
            self.longest_gap_ns as f64 / 1e6,
            self.oldest_source_ns as f64 / 1e6,
        )
    }
}

/// Counts the bytes a second of a topic.
struct Bandwidth {
    /// Bytes of a payload.
    payload: usize,
    rate: Rate,
}

impl Bandwidth {
    /// Bytes of a sample.
    fn sample(&self) -> usize {
        self.payload + size_of::<Stamp>()
    }
}

impl Gauge for Bandwidth {
    fn add(&mut self, seen: &Arrival) {
        self.rate.add(seen);
    }

    fn next(self) -> Self {
        Self {
            payload: self.payload,
            rate: self.rate.next(),
        }
    }

    fn as_json(&self) -> Value {
        json!({
            "bytes_per_s": self.rate.hz() * self.sample() as f64,
            "payload_bytes": self.payload, "stamp_bytes": size_of::<Stamp>(),
        })
    }

    fn as_text(&self) -> String {
        format!(
            "{:9.2} KiB/s   {:6} samples of {} bytes (payload {}, stamp {})",
            self.rate.hz() * self.sample() as f64 / 1024.0,
            self.rate.samples,
            self.sample(),
            self.payload,
            size_of::<Stamp>(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(publish_time_ns: u64, received_ns: u64) -> Arrival {
        Arrival {
            stamp: Stamp {
                publish_time_ns,
                source_time_ns: publish_time_ns - 500,
                ..Stamp::default()
            },
            looked_ns: received_ns,
            received_ns,
            unsure_ns: 0,
        }
    }

    #[test]
    fn a_window_tells_rate_longest_gap_oldest_sample_and_bytes() {
        let mut gauge = Bandwidth {
            payload: 64,
            rate: Rate::default(),
        };
        for at in [1_000_000, 2_000_000, 5_000_000] {
            gauge.add(&seen(at, at + 100));
        }
        assert!((gauge.rate.hz() - 500.0).abs() < 1e-9);
        assert_eq!(gauge.rate.longest_gap_ns, 3_000_000);
        assert_eq!(gauge.rate.oldest_source_ns, 500);
        assert_eq!(gauge.as_json()["bytes_per_s"], json!(500.0 * 120.0));
    }

    #[test]
    fn one_sample_has_no_rate() {
        let mut rate = Rate::default();
        rate.add(&seen(1_000, 1_000));
        assert!(rate.hz() < f64::EPSILON);
    }

    #[test]
    fn what_comes_less_often_than_a_line_is_printed_has_its_rate_and_its_gap() {
        const S: u64 = 1_000_000_000;
        let mut rate = Rate::default();
        rate.add(&seen(S, S));
        // Nothing in the window between.
        rate = rate.next().next();
        rate.add(&seen(3 * S, 3 * S));
        assert!((rate.hz() - 0.5).abs() < 1e-9, "{rate:?}");
        assert_eq!(rate.longest_gap_ns, 2 * S);
        rate = rate.next();
        rate.add(&seen(4 * S, 4 * S));
        assert!((rate.hz() - 1.0).abs() < 1e-9, "{rate:?}");
        assert_eq!(rate.longest_gap_ns, S);
    }
}
