//! [`Stamp`]: the header in front of every sample.

crate::payload! {
    /// When, why and by which process a sample was published, and its number in its stream.
    ///
    /// A stream is `(writer, epoch)`: one publisher's life. Its sequence starts at 0 and has no
    /// gaps, so a reader can count the samples that it missed without knowing the payload. A
    /// restarted writer has a new epoch and is a new stream, not a loss. Times are real nanoseconds
    /// of `CLOCK_MONOTONIC`, comparable between processes of one machine.
    ///
    /// A sample that follows from another one carries the times of each stage since that one:
    ///
    /// ```text
    ///  bytes read        published        received         published
    ///  source_time --> cause_publish --> cause_receive --> publish_time
    ///     |   the cause's writer |  its wake-up |  this writer  |
    /// ```
    pub struct Stamp: 56 bytes {
        /// Number of the sample in its stream, from 0.
        pub sequence: u64,
        /// When the event happened that the sample reports, in ns. A sample that follows from
        /// another sample has the time of that sample.
        pub source_time_ns: u64,
        /// When the sample from which this one follows was published, in ns; 0 = there is none.
        pub cause_publish_time_ns: u64,
        /// When this sample's writer received that sample, in ns; 0 = there is none.
        pub cause_receive_time_ns: u64,
        /// When this sample was published, in ns.
        pub publish_time_ns: u64,
        /// When the publisher was made, in ns.
        pub epoch: u64,
        /// Process id of the writer.
        pub writer: u32,
        /// [`Topic::ID`](crate::Topic::ID) of the sample from which this one follows; 0 = there is
        /// none.
        pub cause_topic: u32,
    }
}
