//! Measures how long sensor frames take until logic has decided, for `latency/path`.
//!
//! It stands apart from the shell because it must cost the path nothing. While frames are handled
//! it keeps only their times, and counts them when the turn is over and its orders have left.
//! Moments are arguments; it reads no clock and does not allocate.

use heapless::Vec;
use lager_sample::{Stamp, Topic};
use lager_topics::{PathLatency, SensorDistance, SensorLine};

/// How often the counts are published, in real ns.
const PERIOD_NS: u64 = 1_000_000_000;

/// How many frames can come in one turn: the queues of both topics.
const TURN: usize = SensorLine::QOS.buffer + SensorDistance::QOS.buffer;

/// Times of one frame, in ns of `CLOCK_MONOTONIC`: read, published, received.
type Times = [u64; 3];

/// Measures how long frames take.
#[derive(Debug, Default)]
pub(crate) struct FrameMeter {
    /// The frames of the present turn.
    taken: Vec<Times, TURN>,
    counted: PathLatency,
    told_ns: u64,
}

impl FrameMeter {
    /// The navigator got a frame with this stamp, received at `received_ns`.
    pub(crate) fn took(&mut self, stamp: &Stamp, received_ns: u64) {
        let way = [stamp.source_time_ns, stamp.publish_time_ns, received_ns];
        // This happens only if frames come in while more than a queue of them is handled. The
        // earlier frames were decided by the time when this one was received.
        if self.taken.is_full() {
            self.turn_over(received_ns);
        }
        let _ = self.taken.push(way);
    }

    /// The turn is over, and all its orders have left.
    pub(crate) fn turn_over(&mut self, now_ns: u64) {
        let counted = &mut self.counted;
        for [read, published, received] in &self.taken {
            let way = [*read, *published, *received, now_ns];
            // A writer of another program may stamp anything.
            if !way.is_sorted() {
                continue;
            }
            counted.read_publish.record(published - read);
            counted.publish_receive.record(received - published);
            counted.decide.record(now_ns - received);
            counted.total.record(now_ns - read);
        }
        self.taken.clear();
    }

    /// The counts to publish now, once a second.
    pub(crate) fn due(&mut self, now_ns: u64) -> Option<&PathLatency> {
        if now_ns.saturating_sub(self.told_ns) < PERIOD_NS {
            return None;
        }
        self.told_ns = now_ns;
        Some(&self.counted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(read_ns: u64) -> Stamp {
        Stamp {
            source_time_ns: read_ns,
            publish_time_ns: read_ns + 1_000,
            ..Stamp::default()
        }
    }

    #[test]
    fn every_frame_of_a_turn_counts_in_every_stage() {
        let mut meter = FrameMeter::default();
        meter.took(&frame(500), 3_500);
        meter.took(&frame(1_500), 4_500);
        meter.turn_over(10_500);
        meter.turn_over(20_500);
        let counted = meter.due(PERIOD_NS).expect("it is due");
        let sums = [
            &counted.read_publish,
            &counted.publish_receive,
            &counted.decide,
            &counted.total,
        ]
        .map(|stage| (stage.count, stage.sum_ns));
        assert_eq!(sums, [(2, 2_000), (2, 4_000), (2, 13_000), (2, 19_000)]);
    }

    #[test]
    fn times_that_cannot_be_true_do_not_count() {
        let mut meter = FrameMeter::default();
        meter.took(&frame(5_000), 5_500);
        meter.turn_over(9_000);
        assert_eq!(meter.due(PERIOD_NS).map(|told| told.total.count), Some(0));
    }

    #[test]
    fn more_frames_than_a_turn_should_bring_all_count() {
        let mut meter = FrameMeter::default();
        for at in 0..2 * TURN as u64 + 1 {
            meter.took(&frame(at), at + 2_000);
        }
        meter.turn_over(10_000);
        let told = meter.due(PERIOD_NS).map(|told| told.total.count);
        assert_eq!(told, Some(2 * TURN as u64 + 1));
    }

    #[test]
    fn it_tells_once_a_second_and_counts_on() {
        let mut meter = FrameMeter::default();
        meter.took(&frame(500), 3_500);
        meter.turn_over(4_000);
        assert!(meter.due(PERIOD_NS).is_some());
        assert!(meter.due(2 * PERIOD_NS - 1).is_none());
        meter.took(&frame(5_500), 8_500);
        meter.turn_over(9_000);
        assert_eq!(
            meter.due(2 * PERIOD_NS).map(|told| told.total.count),
            Some(2)
        );
    }
}
