//! Exact loss accounting: what a reader knows of each stream it has heard.
//!
//! A stream is one publisher's life, `(writer, epoch)`, numbered from 0 without gaps. Pure, so
//! that the law can be tested without a bus: **received + lost = sent**, for every stream that
//! began after its reader, whatever was overwritten, once its last sample has been received.

use lager_topics::Stamp;

/// Streams remembered. A topic has at most some twenty writers at a time; the rest is for
/// restarted ones, and the longest silent is forgotten first.
const REMEMBERED: usize = 128;

struct Stream {
    writer: u32,
    epoch: u64,
    next: u64,
}

/// Counters over all streams of one topic.
pub(crate) struct Streams {
    /// Most recently heard first. Never grows beyond its first capacity.
    known: Vec<Stream>,
    attached_ns: u64,
    received: u64,
    lost: u64,
}

impl Streams {
    /// For a reader that was attached at `attached_ns`.
    pub(crate) fn new(attached_ns: u64) -> Self {
        Self {
            known: Vec::with_capacity(REMEMBERED),
            attached_ns,
            received: 0,
            lost: 0,
        }
    }

    /// Notes a received sample.
    pub(crate) fn note(&mut self, stamp: &Stamp) {
        self.received += 1;
        let next = stamp.sequence.wrapping_add(1);
        let found = self
            .known
            .iter()
            .position(|known| known.writer == stamp.writer && known.epoch == stamp.epoch);
        match found {
            Some(index) => {
                self.known[..=index].rotate_right(1);
                let stream = &mut self.known[0];
                // A number that was there before is a repetition and no loss.
                self.lost += stamp.sequence.saturating_sub(stream.next);
                stream.next = stream.next.max(next);
            }
            None => {
                // A stream older than this reader begins with whatever it hears first; a younger
                // one has been missed from its first sample on.
                if stamp.epoch > self.attached_ns {
                    self.lost += stamp.sequence;
                }
                if self.known.len() == REMEMBERED {
                    self.known.pop();
                }
                self.known.push(Stream {
                    writer: stamp.writer,
                    epoch: stamp.epoch,
                    next,
                });
                self.known.rotate_right(1);
            }
        }
    }

    /// Samples received.
    pub(crate) fn received(&self) -> u64 {
        self.received
    }

    /// Samples missed.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }

    /// Streams heard, up to the number remembered.
    pub(crate) fn heard(&self) -> usize {
        self.known.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn stamp(writer: u32, epoch: u64, sequence: u64) -> Stamp {
        Stamp {
            writer,
            epoch,
            sequence,
            ..Stamp::default()
        }
    }

    fn lost_after(stamps: &[Stamp]) -> u64 {
        let mut streams = Streams::new(100);
        for stamp in stamps {
            streams.note(stamp);
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
            streams.note(&stamp(1, 200 + epoch, 0));
            // The writer that keeps talking is never forgotten.
            streams.note(&stamp(7, 150, epoch));
        }
        assert_eq!(streams.known.capacity(), capacity);
        assert_eq!(streams.lost(), 0);
        assert_eq!(streams.received(), 20_000);
    }

    proptest! {
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
                    streams.note(&stamp);
                }
            }
            for queue in queues {
                for stamp in queue {
                    streams.note(&stamp);
                }
            }
            prop_assert_eq!(streams.received() + streams.lost(), sent);
        }
    }
}
