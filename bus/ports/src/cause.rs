//! [`Cause`]: why a writer publishes a sample. A received sample hands it on to the next sample.
//!
//! Whatever a service publishes because of a sample gets that sample's [`Cause`]. So the stamp of a
//! steering command tells when the frame's bytes were read, when the frame was published, when
//! logic received it and when logic published the command. Logic and bridge count how long each
//! stage took, and publish it once a second on `latency/path` and `latency/command`.
//!
//! This file is apart from publisher and subscriber because both use it. Only a `Cause` carries the
//! times of a chain of samples from one to the next, so no writer can leave out a stage or invent
//! one. This file never reads the clock.

use lager_sample::{Stamp, Topic};

/// The reason for a sample.
///
/// ```text
///  Cause::OWN            the writer itself decided: by a timer, or because a person asked for it
///  Cause::event(t)       something outside the bus happened at t: bytes were read from a port
///  sample.cause()        a sample was received, which has a cause of its own
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cause {
    /// When the chain began, in ns of `CLOCK_MONOTONIC`; 0 = when the sample is published.
    source_time_ns: u64,
    publish_time_ns: u64,
    receive_time_ns: u64,
    topic: u32,
}

impl Cause {
    /// The writer itself decided to publish: the chain begins when it publishes.
    pub const OWN: Self = Self::event(0);

    /// Something outside the bus happened at `at_ns` of `CLOCK_MONOTONIC`.
    pub const fn event(at_ns: u64) -> Self {
        Self {
            source_time_ns: at_ns,
            publish_time_ns: 0,
            receive_time_ns: 0,
            topic: 0,
        }
    }

    /// When the sample was received, in ns of `CLOCK_MONOTONIC`; 0 = the cause is not a sample.
    pub const fn receive_time_ns(&self) -> u64 {
        self.receive_time_ns
    }

    /// The cause is a sample of `T` with this stamp, received at `receive_time_ns`.
    pub(crate) const fn sample<T: Topic>(stamp: &Stamp, receive_time_ns: u64) -> Self {
        Self {
            source_time_ns: stamp.source_time_ns,
            publish_time_ns: stamp.publish_time_ns,
            receive_time_ns,
            topic: T::ID,
        }
    }

    /// The cause that a sample with this stamp already has.
    pub(crate) const fn of(stamp: &Stamp) -> Self {
        Self {
            source_time_ns: stamp.source_time_ns,
            publish_time_ns: stamp.cause_publish_time_ns,
            receive_time_ns: stamp.cause_receive_time_ns,
            topic: stamp.cause_topic,
        }
    }

    /// Writes this cause into `stamp`.
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
#[allow(unreachable_pub, reason = "the macro makes public types")]
mod tests {
    use lager_sample::{Qos, payload};

    use super::*;

    payload! {
        /// A count.
        pub struct Count: 4 bytes {
            /// So many.
            pub count: u32,
        }
    }

    struct Counts;

    impl Topic for Counts {
        const NAME: &'static str = "counts";
        type Payload = Count;
        const QOS: Qos = Qos::stream(1);
        const SUMMARY: &'static str = "Counts.";
    }

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
        let order = Cause::sample::<Counts>(&frame, 30).stamp(published(40));
        assert_eq!(
            order,
            Stamp {
                sequence: 7,
                source_time_ns: 10,
                cause_publish_time_ns: 20,
                cause_receive_time_ns: 30,
                publish_time_ns: 40,
                cause_topic: Counts::ID,
                ..Stamp::default()
            }
        );
        // When it is handed on again, the source stays and the times are those of the last stage.
        let third = Cause::sample::<Counts>(&order, 50).stamp(published(60));
        assert_eq!(
            (third.source_time_ns, third.cause_publish_time_ns),
            (10, 40)
        );
    }

    #[test]
    fn a_stamp_that_is_made_again_says_the_same() {
        let order = Cause::sample::<Counts>(&Cause::event(10).stamp(published(20)), 30)
            .stamp(published(40));
        assert_eq!(Cause::of(&order).stamp(published(40)), order);
    }
}
