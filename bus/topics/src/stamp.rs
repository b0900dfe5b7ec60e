//! The header in front of every sample.

use crate::schema::payload;

payload! {
    /// When and by whom a sample was published, and which one of its stream it is.
    ///
    /// A stream is `(writer, epoch)`: one publisher's life. Its sequence starts at 0 and has no
    /// gaps, so a reader can count what it missed without knowing the payload; a restarted
    /// writer has a new epoch and is a new stream, not a loss. Times are real nanoseconds of
    /// `CLOCK_MONOTONIC`, comparable between processes of one machine.
    pub struct Stamp: 40 bytes {
        /// Number of the sample in its stream, from 0.
        pub sequence: u64,
        /// When the event happened that the sample reports, in ns.
        pub source_time_ns: u64,
        /// When the sample was handed to the bus, in ns.
        pub publish_time_ns: u64,
        /// When the publisher was made, in ns.
        pub epoch: u64,
        /// Process id of the writer.
        pub writer: u32,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u32,
    }
}
