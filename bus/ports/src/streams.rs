//! How a reader counts lost samples exactly, and finds out which of two samples is newer.
//!
//! A stream is one life of a publisher, `(writer, epoch)`, numbered from 0 without gaps. This file
//! is pure, so that its laws can be tested without a bus:
//!
//! - **received + lost = sent**, once the stream's last sample has been received, for every stream
//!   that began after its reader attached. In an older stream, the reader counts from the first
//!   sample that it receives. It does not count samples that were overwritten before that, because
//!   it does not know how many of them were sent after it attached.
//! - **A stamp may be false**, if its writer is damaged or foreign. So a gap counts only if that
//!   many samples could have been sent since the stream's last sample. A later sample with a lower
//!   number shows that there was no gap. And a sample from the future is not newer than the present
//!   ([`Newest`]).
//! - **A restart is not a loss.** A restarted writer has a new epoch and numbers from 0 again.

use core::ops::Range;

use lager_sample::Stamp;

/// How many streams a reader remembers. A topic has at most about twenty writers at a time; the
/// rest is for restarted ones. The stream that has been silent longest is forgotten first.
const REMEMBERED: usize = 128;

/// The shortest time between two samples of one writer, in ns; several times shorter than measured.
const SHORTEST_NS: u64 = 20;

/// A stamp that is further ahead of its reader's clock than this, in ns, is ignored. All processes
/// of a machine read the same clock, so no true stamp is ahead.
const AHEAD_NS: u64 = 1_000_000_000;

struct Stream {
    writer: u32,
    epoch: u64,
    next: u64,
    /// The numbers that the last sample skipped, which are counted as lost.
    gap: Range<u64>,
    /// All later samples of the stream were sent after this moment.
    heard_ns: u64,
}

/// Counters over all streams of one topic.
pub struct Streams {
    /// The stream heard last comes first. Never grows beyond its first capacity.
    known: Vec<Stream>,
    attached_ns: u64,
    received: u64,
    lost: u64,
}

impl Streams {
    /// For a reader that was attached at `attached_ns`.
    pub fn new(attached_ns: u64) -> Self {
        Self {
            known: Vec::with_capacity(REMEMBERED),
            attached_ns,
            received: 0,
            lost: 0,
        }
    }

    /// Counts a received sample. Reads `clock` only if the stamp does not have the next number.
    pub fn note(&mut self, stamp: &Stamp, clock: impl Fn() -> u64) {
        self.received += 1;
        let found = self
            .known
            .iter()
            .position(|known| known.writer == stamp.writer && known.epoch == stamp.epoch);
        match found {
            Some(index) => {
                self.known[..=index].rotate_right(1);
                let stream = &mut self.known[0];
                if stamp.sequence == stream.next {
                    stream.next = stream.next.saturating_add(1);
                    stream.gap = 0..0;
                    stream.heard_ns = stream.heard_ns.max(stamp.publish_time_ns);
                } else {
                    let (withdrawn, missed) = stream.jump(stamp, clock());
                    self.lost = self.lost.saturating_sub(withdrawn).saturating_add(missed);
                }
            }
            None => self.meet(stamp, clock()),
        }
    }

    /// Starts to count a stream whose first sample has arrived.
    fn meet(&mut self, stamp: &Stamp, now_ns: u64) {
        if stamp.sequence > sendable(stamp.epoch, now_ns) {
            return;
        }
        // If the stream is older than this reader, it counts from the first sample received. If it
        // is younger, everything before that sample was missed.
        let is_younger = stamp.epoch > self.attached_ns;
        if is_younger {
            self.lost = self.lost.saturating_add(stamp.sequence);
        }
        if self.known.len() == REMEMBERED {
            self.known.pop();
        }
        self.known.push(Stream {
            writer: stamp.writer,
            epoch: stamp.epoch,
            next: stamp.sequence.saturating_add(1),
            gap: if is_younger { 0..stamp.sequence } else { 0..0 },
            heard_ns: stamp.epoch.max(self.attached_ns).min(now_ns),
        });
        self.known.rotate_right(1);
    }

    /// Samples received.
    pub(crate) fn received(&self) -> u64 {
        self.received
    }

    /// Samples missed.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Streams heard, up to the number remembered.
    pub(crate) fn heard(&self) -> usize {
        self.known.len()
    }
}

impl Stream {
    /// Takes up a number that is not the next one. Returns how many losses counted earlier turn out
    /// to be none, and how many losses are new.
    fn jump(&mut self, stamp: &Stamp, now_ns: u64) -> (u64, u64) {
        let mut withdrawn = 0;
        if stamp.sequence < self.next {
            if !self.gap.contains(&stamp.sequence) {
                // The sample was received before and is repeated.
                return (0, 0);
            }
            // Numbers only grow, so the sample after the gap was not from this writer.
            withdrawn = self.gap.end - self.gap.start;
            self.next = self.gap.start;
            self.gap = 0..0;
        }
        let missed = stamp.sequence - self.next;
        self.heard_ns = self.heard_ns.min(now_ns);
        if missed > sendable(self.heard_ns, now_ns) {
            return (withdrawn, 0);
        }
        self.gap = self.next..stamp.sequence;
        self.next = stamp.sequence.saturating_add(1);
        self.heard_ns = self.heard_ns.max(stamp.publish_time_ns.min(now_ns));
        (withdrawn, missed)
    }
}

/// How many samples one writer can have sent between two moments.
fn sendable(since_ns: u64, now_ns: u64) -> u64 {
    now_ns.saturating_sub(since_ns) / SHORTEST_NS
}

/// When the newest sample of a state that a reader has taken was published. Samples of several
/// writers arrive in any order, and a keeper may send an older sample than one already seen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Newest {
    publish_ns: u64,
}

impl Newest {
    /// Whether a sample published at `publish_ns` replaces the one taken before.
    pub(crate) fn takes(&mut self, publish_ns: u64, now_ns: u64) -> bool {
        if publish_ns < self.publish_ns || publish_ns > now_ns.saturating_add(AHEAD_NS) {
            return false;
        }
        // A stamp that is a little ahead counts as published now, so that it does not hide later
        // samples.
        self.publish_ns = publish_ns.min(now_ns);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The reader's clock, unless a test has one of its own.
    const NOW: u64 = 1_000_000_000;

    fn stamp(writer: u32, epoch: u64, sequence: u64) -> Stamp {
        Stamp {
            writer,
            epoch,
            sequence,
            publish_time_ns: epoch,
            ..Stamp::default()
        }
    }

    fn lost_after(stamps: &[Stamp]) -> u64 {
        let mut streams = Streams::new(100);
        for stamp in stamps {
            streams.note(stamp, || NOW);
        }
        streams.lost()
    }

    #[test]
    fn a_gap_is_counted() {
        assert_eq!(
            lost_after(&[stamp(1, 200, 0), stamp(1, 200, 1), stamp(1, 200, 5)]),
            3
        );
    }

    #[test]
    fn a_younger_stream_is_missed_from_its_beginning() {
        assert_eq!(lost_after(&[stamp(1, 200, 7)]), 7);
    }

    #[test]
    fn an_older_stream_begins_where_it_is_heard() {
        assert_eq!(lost_after(&[stamp(1, 50, 7), stamp(1, 50, 8)]), 0);
    }

    #[test]
    fn a_restarted_writer_is_no_loss() {
        assert_eq!(lost_after(&[stamp(1, 200, 9), stamp(2, 300, 0)]), 9);
        assert_eq!(lost_after(&[stamp(1, 200, 0), stamp(1, 300, 0)]), 0);
    }

    #[test]
    fn a_repeated_sample_is_no_loss() {
        assert_eq!(
            lost_after(&[stamp(1, 200, 0), stamp(1, 200, 0), stamp(1, 200, 1)]),
            0
        );
    }

    #[test]
    fn memory_does_not_grow_with_restarts() {
        let mut streams = Streams::new(100);
        let capacity = streams.known.capacity();
        for epoch in 0..10_000 {
            streams.note(&stamp(1, 200 + epoch, 0), || NOW);
            // The writer that keeps talking is never forgotten.
            streams.note(&stamp(7, 150, epoch), || NOW);
        }
        assert_eq!(streams.known.capacity(), capacity);
        assert_eq!(streams.lost(), 0);
        assert_eq!(streams.received(), 20_000);
    }

    #[test]
    fn one_impossible_number_changes_nothing() {
        for lie in [u64::MAX, u64::MAX - 1, 1 << 40] {
            assert_eq!(
                lost_after(&[
                    stamp(1, 200, 0),
                    stamp(1, 200, lie),
                    stamp(1, 200, 1),
                    stamp(1, 200, 4)
                ]),
                2
            );
            // As a stream of its own, before or after the reader, or from the future.
            for epoch in [50, 200, u64::MAX] {
                assert_eq!(lost_after(&[stamp(9, epoch, lie), stamp(9, epoch, lie)]), 0);
            }
        }
    }

    #[test]
    fn a_gap_that_a_later_number_contradicts_was_none() {
        let lie = stamp(1, 200, 1_000);
        assert_eq!(
            lost_after(&[stamp(1, 200, 0), lie, stamp(1, 200, 1)]),
            0,
            "the number right behind the one before the lie"
        );
        assert_eq!(
            lost_after(&[stamp(1, 200, 0), lie, stamp(1, 200, 3), stamp(1, 200, 4)]),
            2,
            "the true gap is counted"
        );
        assert_eq!(
            lost_after(&[stamp(1, 200, 1_000), stamp(1, 200, 3)]),
            3,
            "at the beginning of a stream"
        );
    }

    #[test]
    fn a_time_from_the_future_hides_losses_no_longer_than_until_the_next_sample() {
        let at = |sequence, publish_time_ns| Stamp {
            publish_time_ns,
            ..stamp(1, 200, sequence)
        };
        let mut streams = Streams::new(100);
        streams.note(&at(0, 200), || 1_000);
        streams.note(&at(1, u64::MAX), || 2_000);
        streams.note(&at(7, 3_000), || 3_000);
        streams.note(&at(8, 4_000), || 4_000);
        // The sample in between is taken for missed.
        assert_eq!(streams.lost(), 6);
    }

    #[test]
    fn a_state_is_replaced_by_a_newer_one_and_not_by_one_from_the_future() {
        let mut newest = Newest::default();
        assert!(newest.takes(NOW - 5, NOW));
        assert!(!newest.takes(NOW - 6, NOW));
        for lie in [NOW + AHEAD_NS + 1, u64::MAX] {
            assert!(!newest.takes(lie, NOW), "{lie}");
        }
        assert!(newest.takes(NOW + AHEAD_NS, NOW), "a little ahead");
        assert!(newest.takes(NOW + 1, NOW + 1), "and nobody is silenced");
    }

    proptest! {
        /// However stamps lie, each makes a reader count no more than one writer could have sent
        /// since the reader is there, and a writer that speaks the truth is counted exactly.
        #[test]
        fn no_stamps_make_the_loss_absurd(
            stamps in proptest::collection::vec(
                (0..3_u32, any::<u64>(), any::<u64>(), any::<u64>(), 0..10_000_u64), 1..60),
            small in any::<bool>(),
        ) {
            let mut streams = Streams::new(100);
            let mut now = 100;
            let scale = |value: u64| if small { value % 1_000 } else { value };
            for (writer, epoch, sequence, publish_time_ns, pause) in &stamps {
                now += pause;
                let before = streams.lost();
                streams.note(&Stamp {
                    writer: *writer,
                    epoch: scale(*epoch),
                    sequence: scale(*sequence),
                    publish_time_ns: scale(*publish_time_ns),
                    ..Stamp::default()
                }, || now);
                prop_assert!(streams.lost() <= before + sendable(100, now));
            }
            let (lost, epoch) = (streams.lost(), now);
            for sequence in 0..50 {
                now += 1_000;
                streams.note(&stamp(77, epoch, sequence * 2), || now);
            }
            prop_assert_eq!(streams.lost(), lost + 49);
            prop_assert_eq!(streams.received(), stamps.len() as u64 + 50);
        }

        /// Between any two samples of a true stream somebody else uses its name once.
        #[test]
        fn a_liar_with_anothers_name_is_found_out(
            stream in proptest::collection::vec(
                (any::<bool>(), proptest::option::of(0..200_u64), any::<bool>()), 1..60),
        ) {
            let mut streams = Streams::new(100);
            let (mut missed, mut lies, mut next) = (0, 0, 0);
            let last = (true, None, false);
            for (number, (is_kept, lie, is_huge)) in (0..).zip(stream.into_iter().chain([last])) {
                if !is_kept {
                    continue;
                }
                let now = 1_000_000 + number * 1_000;
                let mut note = |sequence| {
                    let sample = stamp(1, 200, sequence);
                    streams.note(&Stamp { publish_time_ns: now, ..sample }, || now);
                };
                note(number);
                missed += number - next;
                next = number + 1;
                if let Some(lie) = lie {
                    note(if is_huge { u64::MAX - lie } else { lie });
                    lies += 1;
                }
            }
            prop_assert!(streams.lost().abs_diff(missed) <= lies);
        }

        #[test]
        fn received_and_lost_are_all_that_was_sent(
            kept in proptest::collection::vec(
                proptest::collection::vec(any::<bool>(), 1..60), 1..6),
            turns in proptest::collection::vec(any::<prop::sample::Index>(), 0..200),
        ) {
            let mut streams = Streams::new(100);
            let mut sent = 0;
            let mut queues: Vec<_> = kept
                .iter()
                .enumerate()
                .map(|(writer, kept)| {
                    // The last sample of every stream arrives; any other may be overwritten.
                    let last = kept.len() - 1;
                    sent += kept.len() as u64;
                    kept.iter()
                        .enumerate()
                        .filter(|(index, kept)| **kept || *index == last)
                        .map(|(index, _)| stamp(writer as u32, 200, index as u64))
                        .collect::<std::collections::VecDeque<_>>()
                })
                .collect();
            for turn in turns {
                let queue = turn.index(queues.len());
                if let Some(stamp) = queues[queue].pop_front() {
                    streams.note(&stamp, || NOW);
                }
            }
            for queue in queues {
                for stamp in queue {
                    streams.note(&stamp, || NOW);
                }
            }
            prop_assert_eq!(streams.received() + streams.lost(), sent);
        }
    }
}
