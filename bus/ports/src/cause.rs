//! Why a sample is published: what a writer says of it, and what a reader hands on.
//!
//! Whatever a service publishes because of a sample gets that sample's [`Cause`]. So the stamp of a
//! steering command tells when the frame's bytes were read, when the frame was published, when
//! logic received it and when logic published the command. Logic and bridge count how long each
//! stage took, and publish it once a second on `latency/path` and `latency/command`.
//!
//! It is apart from publisher and subscriber because it is the only way from one to the other: a
//! chain's times are carried by this type alone, so no writer can leave out a stage or make one up.
//! It never reads the clock.

use lager_topics::{Stamp, Topic};

/// From what a sample follows.
///
/// ```text
///  Cause::OWN            the writer itself: a timer, a wish, a person at its keyboard
///  Cause::event(t)       something outside the bus that happened at t: bytes read from a port
///  sample.cause()        a received sample, and whatever that followed from
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cause {
    /// 0 = the moment of publishing.
    source_time_ns: u64,
    publish_time_ns: u64,
    receive_time_ns: u64,
    topic: u32,
}

impl Cause {
    /// Nothing but the writer's own doing: the source is the moment of publishing.
    pub const OWN: Self = Self::event(0);

    /// Something outside the bus that happened at `at_ns` of `CLOCK_MONOTONIC`.
    pub const fn event(at_ns: u64) -> Self {
        Self {
            source_time_ns: at_ns,
            publish_time_ns: 0,
            receive_time_ns: 0,
            topic: 0,
        }
    }

    /// When the sample was received, in ns of `CLOCK_MONOTONIC`; 0 = the cause is no sample.
    pub const fn receive_time_ns(&self) -> u64 {
        self.receive_time_ns
    }

    /// A sample of `T`, received at `receive_time_ns`.
    pub(crate) const fn sample<T: Topic>(stamp: &Stamp, receive_time_ns: u64) -> Self {
        Self {
            source_time_ns: stamp.source_time_ns,
            publish_time_ns: stamp.publish_time_ns,
            receive_time_ns,
            topic: T::ID,
        }
    }

    /// What a sample with this stamp followed from.
    pub(crate) const fn of(stamp: &Stamp) -> Self {
        Self {
            source_time_ns: stamp.source_time_ns,
            publish_time_ns: stamp.cause_publish_time_ns,
            receive_time_ns: stamp.cause_receive_time_ns,
            topic: stamp.cause_topic,
        }
    }

    /// `stamp` with what it follows from.
    pub(crate) const fn stamp(self, stamp: Stamp) -> Stamp {
        Stamp {
            source_time_ns: if self.source_time_ns == 0 {
                stamp.publish_time_ns
            } else {
                self.source_time_ns
            },
            cause_publish_time_ns: self.publish_time_ns,
            cause_receive_time_ns: self.receive_time_ns,
            cause_topic: self.topic,
            ..stamp
        }
    }
}

#[cfg(test)]
mod tests {
    use lager_topics::SensorLine;

    use super::*;

    fn published(at: u64) -> Stamp {
        Stamp {
            publish_time_ns: at,
            sequence: 7,
            ..Stamp::default()
        }
    }

    #[test]
    fn the_writers_own_doing_happens_when_it_is_published() {
        let stamp = Cause::OWN.stamp(published(50));
        assert_eq!(stamp.source_time_ns, 50);
        assert_eq!(
            (stamp.cause_publish_time_ns, stamp.cause_receive_time_ns),
            (0, 0)
        );
        assert_eq!(stamp.cause_topic, 0);
    }

    #[test]
    fn a_sample_hands_on_its_source_and_adds_its_own_way() {
        let frame = Cause::event(10).stamp(published(20));
        let order = Cause::sample::<SensorLine>(&frame, 30).stamp(published(40));
        assert_eq!(
            order,
            Stamp {
                sequence: 7,
                source_time_ns: 10,
                cause_publish_time_ns: 20,
                cause_receive_time_ns: 30,
                publish_time_ns: 40,
                cause_topic: SensorLine::ID,
                ..Stamp::default()
            }
        );
        // Handed on once more, the source stays and the way is the last stage's.
        let third = Cause::sample::<SensorLine>(&order, 50).stamp(published(60));
        assert_eq!(
            (third.source_time_ns, third.cause_publish_time_ns),
            (10, 40)
        );
    }

    #[test]
    fn a_stamp_that_is_made_again_says_the_same() {
        let order = Cause::sample::<SensorLine>(&Cause::event(10).stamp(published(20)), 30)
            .stamp(published(40));
        assert_eq!(Cause::of(&order).stamp(published(40)), order);
    }
}
