//! `topic hz`: rate, age and loss of one topic, once a second, from the stamps alone.

use std::io::Write;
use std::time::{Duration, Instant};

use lager_ports::{Clock, Source};
use lager_topics::{Stamp, Topic, TopicVisitor, visit};
use serde_json::json;

use crate::source::Stamped;
use crate::{ToolError, Tools};

/// One line is printed for each window.
const WINDOW: Duration = Duration::from_secs(1);

impl<W: Write> Tools<'_, W> {
    /// `topic hz`: measures `name` until `windows` lines are printed or the shutdown.
    ///
    /// # Errors
    /// No topic has that name, it cannot be read, or the output cannot be written.
    pub fn hz(&mut self, name: &str, windows: Option<u64>) -> Result<(), ToolError> {
        match visit(
            name,
            Hz {
                tools: self,
                windows,
            },
        ) {
            Ok(measured) => measured,
            Err(unknown) => {
                let found = self.found(name, unknown)?;
                self.hz_from(name, found, windows)
            }
        }
    }
}

struct Hz<'a, 'b, W> {
    tools: &'a mut Tools<'b, W>,
    windows: Option<u64>,
}

/// What the stamps of one window tell.
#[derive(Debug, Default)]
struct Window {
    samples: u64,
    first_ns: u64,
    last_ns: u64,
    longest_gap_ns: u64,
    oldest_source_ns: u64,
}

impl Window {
    fn add(&mut self, stamp: &Stamp, now_ns: u64) {
        if self.samples == 0 {
            self.first_ns = stamp.publish_time_ns;
        } else {
            let gap = stamp.publish_time_ns.saturating_sub(self.last_ns);
            self.longest_gap_ns = self.longest_gap_ns.max(gap);
        }
        self.last_ns = stamp.publish_time_ns;
        self.oldest_source_ns = self
            .oldest_source_ns
            .max(now_ns.saturating_sub(stamp.source_time_ns));
        self.samples += 1;
    }

    /// Samples a second between the first and the last of the window.
    fn rate(&self) -> f64 {
        let span = self.last_ns.saturating_sub(self.first_ns);
        if self.samples < 2 || span == 0 {
            return 0.0;
        }
        (self.samples - 1) as f64 * 1e9 / span as f64
    }
}

impl<W: Write> TopicVisitor for Hz<'_, '_, W> {
    type Output = Result<(), ToolError>;

    fn visit<T: Topic>(self) -> Self::Output {
        let subscriber = self.tools.subscriber::<T>()?;
        self.tools.hz_from(T::NAME, subscriber, self.windows)
    }
}

impl<W: Write> Tools<'_, W> {
    fn hz_from(
        &mut self,
        name: &str,
        mut from: impl Source,
        windows: Option<u64>,
    ) -> Result<(), ToolError> {
        let (mut printed, mut lost) = (0, 0);
        let mut heard = Instant::now();
        while windows.is_none_or(|count| printed < count) {
            let mut window = Window::default();
            let end = Instant::now() + WINDOW;
            while Instant::now() < end {
                if self.shutdown.is_requested() {
                    return Ok(());
                }
                while let Some(stamp) = self.receive(&mut from, Stamped)? {
                    window.add(&stamp, Clock::monotonic_ns());
                    heard = Instant::now();
                }
                self.pause(heard)?;
            }
            let newly_lost = from.lost() - lost;
            lost = from.lost();
            printed += 1;
            if self.as_json {
                let value = json!({
                    "topic": name, "hz": window.rate(), "samples": window.samples,
                    "longest_gap_ns": window.longest_gap_ns,
                    "oldest_ns": window.oldest_source_ns, "lost": newly_lost,
                });
                writeln!(self.out, "{value}")?;
            } else if window.samples == 0 {
                writeln!(self.out, "no sample in the last second")?;
            } else {
                writeln!(
                    self.out,
                    "{:9.2} Hz   longest gap {:8.3} ms   oldest {:8.3} ms   lost {newly_lost}",
                    window.rate(),
                    window.longest_gap_ns as f64 / 1e6,
                    window.oldest_source_ns as f64 / 1e6,
                )?;
            }
            self.out.flush()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(publish_time_ns: u64) -> Stamp {
        Stamp {
            publish_time_ns,
            source_time_ns: publish_time_ns - 500,
            ..Stamp::default()
        }
    }

    #[test]
    fn a_window_tells_rate_longest_gap_and_oldest_sample() {
        let mut window = Window::default();
        for at in [1_000_000, 2_000_000, 5_000_000] {
            window.add(&stamp(at), at + 100);
        }
        assert!((window.rate() - 500.0).abs() < 1e-9);
        assert_eq!(window.longest_gap_ns, 3_000_000);
        assert_eq!(window.oldest_source_ns, 600);
    }

    #[test]
    fn one_sample_has_no_rate() {
        let mut window = Window::default();
        window.add(&stamp(1_000), 1_000);
        assert!(window.rate() < f64::EPSILON);
    }
}
