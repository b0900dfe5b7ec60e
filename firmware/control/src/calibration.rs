//! Calibrates the line sensors (E9). The operator moves the array over floor and tape for a while;
//! then each channel's threshold becomes the middle between its lowest and its highest reading.
//!
//! ```text
//!   idle -- start --> watching -- time is up --> thresholds, idle
//!                        '------- taken back --> idle
//! ```
//!
//! A channel keeps its threshold if it saw too little contrast.

use lager_wire::LineReading;

use crate::time::reached;

/// Number of line sensors.
pub(crate) const CHANNELS: usize = 11;

/// A smaller span between floor and tape, in ADC steps, changes nothing.
const LEAST_CONTRAST: u8 = 40;

#[derive(Debug, Clone)]
struct Extremes {
    ends_us: u32,
    seq: u8,
    reading: [u8; CHANNELS],
    lowest: [u8; CHANNELS],
    highest: [u8; CHANNELS],
}

/// The thresholds in force, and the calibration that may be running.
#[derive(Debug, Clone)]
pub(crate) struct Calibration {
    thresholds: [u8; CHANNELS],
    watch: Option<Extremes>,
    /// Number of the setting that has taken something back.
    taken_back: Option<u8>,
}

/// A calibration that has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Calibrated {
    /// Number of the setting that started it.
    pub(crate) seq: u8,
    /// Channels that have a new threshold, 0..=11.
    pub(crate) channels: u8,
}

impl Calibration {
    pub(crate) const fn new(thresholds: [u8; CHANNELS]) -> Self {
        Self {
            thresholds,
            watch: None,
            taken_back: None,
        }
    }

    /// Starts to watch for `span_us`. A running calibration with the same number goes on.
    pub(crate) fn start(&mut self, seq: u8, span_us: u32, now_us: u32) {
        if self.watch.as_ref().is_some_and(|watch| watch.seq == seq) {
            return;
        }
        self.watch = Some(Extremes {
            ends_us: now_us.wrapping_add(span_us),
            seq,
            reading: [0; CHANNELS],
            lowest: [u8::MAX; CHANNELS],
            highest: [u8::MIN; CHANNELS],
        });
    }

    /// Takes back the calibration that runs. Returns whether the last one that has ended is to be
    /// taken back, because none runs. The same number again changes nothing.
    pub(crate) fn take_back(&mut self, seq: u8) -> bool {
        let is_news = self.taken_back.replace(seq) != Some(seq);
        is_news && self.watch.take().is_none()
    }

    /// Puts other thresholds in force.
    pub(crate) fn put(&mut self, thresholds: [u8; CHANNELS]) {
        self.thresholds = thresholds;
    }

    /// The thresholds in force.
    pub(crate) fn thresholds(&self) -> &[u8; CHANNELS] {
        &self.thresholds
    }

    pub(crate) fn is_running(&self) -> bool {
        self.watch.is_some()
    }

    /// Whether this reading of a channel is on the side of its threshold on which tape reads high.
    pub(crate) fn judge(&mut self, channel: usize, reading: u8) -> bool {
        if let Some(watch) = &mut self.watch {
            watch.reading[channel] = reading;
            watch.lowest[channel] = watch.lowest[channel].min(reading);
            watch.highest[channel] = watch.highest[channel].max(reading);
        }
        reading >= self.thresholds[channel]
    }

    /// The lowest and highest reading of a channel so far; `None` unless a calibration runs.
    pub(crate) fn seen(&self, channel: u8) -> Option<LineReading> {
        let watch = self.watch.as_ref()?;
        let index = usize::from(channel);
        // `None` before the channel's first reading.
        let contrast = watch.highest[index].checked_sub(watch.lowest[index])?;
        Some(LineReading {
            sensor: channel,
            reading: watch.reading[index],
            lowest: watch.lowest[index],
            highest: watch.highest[index],
            tells_apart: contrast >= LEAST_CONTRAST,
        })
    }

    /// Ends the calibration when its time is up.
    pub(crate) fn finish(&mut self, now_us: u32) -> Option<Calibrated> {
        let watch = self.watch.take_if(|watch| reached(now_us, watch.ends_us))?;
        let mut channels = 0;
        for (channel, threshold) in self.thresholds.iter_mut().enumerate() {
            let contrast = watch.highest[channel].saturating_sub(watch.lowest[channel]);
            if contrast >= LEAST_CONTRAST {
                // Rounded up, so that a reading at the floor's level is never tape.
                *threshold = watch.lowest[channel] + contrast.div_ceil(2);
                channels += 1;
            }
        }
        Some(Calibrated {
            seq: watch.seq,
            channels,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_become_the_middle_of_what_was_seen() {
        let mut calibration = Calibration::new([128; CHANNELS]);
        assert!(!calibration.judge(0, 100));
        calibration.start(9, 1_000, 0);
        for channel in 0..CHANNELS {
            for reading in [20, 90, 30] {
                assert!(!calibration.judge(channel, reading));
            }
        }
        assert_eq!(calibration.finish(999), None);
        assert_eq!(
            calibration.finish(1_000),
            Some(Calibrated {
                seq: 9,
                channels: 11
            })
        );
        assert!(!calibration.is_running());
        assert!(calibration.judge(3, 55));
        assert!(!calibration.judge(3, 54));
    }

    #[test]
    fn a_channel_without_contrast_keeps_its_threshold() {
        let mut calibration = Calibration::new([128; CHANNELS]);
        calibration.start(1, 1_000, 0);
        for channel in 0..CHANNELS {
            calibration.judge(channel, 30);
            calibration.judge(channel, if channel == 4 { 69 } else { 200 });
        }
        assert_eq!(
            calibration.finish(1_000),
            Some(Calibrated {
                seq: 1,
                channels: 10
            })
        );
        assert!(!calibration.judge(4, 127));
        assert!(calibration.judge(4, 128));
        assert!(calibration.judge(5, 115));
    }

    #[test]
    fn what_a_channel_has_seen_is_told_while_the_watching_runs() {
        let mut calibration = Calibration::new([128; CHANNELS]);
        calibration.judge(3, 77);
        assert_eq!(calibration.seen(3), None, "nothing runs");
        calibration.start(1, 1_000, 0);
        assert_eq!(calibration.seen(3), None, "nothing was read");
        for reading in [40, 20, 59] {
            calibration.judge(3, reading);
        }
        let seen = LineReading {
            sensor: 3,
            reading: 59,
            lowest: 20,
            highest: 59,
            tells_apart: false,
        };
        assert_eq!(calibration.seen(3), Some(seen));
        calibration.judge(3, 60);
        let seen = LineReading {
            reading: 60,
            highest: 60,
            tells_apart: true,
            ..seen
        };
        assert_eq!(calibration.seen(3), Some(seen));
        calibration.finish(1_000);
        assert_eq!(calibration.seen(3), None);
    }

    #[test]
    fn a_repeated_start_does_not_begin_again() {
        let mut calibration = Calibration::new([128; CHANNELS]);
        calibration.start(1, 1_000, 0);
        calibration.start(1, 1_000, 900);
        assert!(calibration.finish(1_000).is_some());
        calibration.start(2, 1_000, 1_500);
        calibration.start(3, 1_000, 2_000);
        assert_eq!(calibration.finish(2_900), None, "a new number begins again");
    }
}
