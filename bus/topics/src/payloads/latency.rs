//! How long the robot takes to react: `latency/path`.

use crate::schema::payload;

payload! {
    /// Distribution of one stage's duration over one window, in real ns. All 0 without frames.
    pub struct StageLatency: 64 bytes {
        /// Commands measured.
        pub count: u64,
        /// The shortest.
        pub min_ns: u64,
        /// Half of them took at most this long.
        pub p50_ns: u64,
        /// Nine in ten took at most this long.
        pub p90_ns: u64,
        /// All but one in a hundred took at most this long.
        pub p99_ns: u64,
        /// All but one in a thousand took at most this long.
        pub p999_ns: u64,
        /// The longest.
        pub max_ns: u64,
        /// The mean.
        pub mean_ns: u64,
    }
}

payload! {
    /// The way of the commands that sensor frames have caused, from the `read` that brought the
    /// frame's bytes to the end of the `write` of the command.
    ///
    /// ```text
    ///  bridge's reader          logic                   bridge's main loop
    ///  read --> publish ~~wake~~> receive --> publish ~~wake~~> receive --> write
    ///   read_publish | publish_receive | decide | order_receive | receive_write
    ///   |<-------------------------------- total ------------------------------>|
    /// ```
    ///
    /// Counted is the first write of an order that logic gave because of a `sensor/line` or
    /// `sensor/distance` sample and that the arbiter put in force at once. Not counted: renewals
    /// and repetitions, orders that followed from the clock, from reports or from a person, and
    /// those that were refused, replaced or held back before they were written.
    pub struct PathLatency: 408 bytes {
        /// Commands measured since the bridge was started.
        pub since_start: u64,
        /// When the window began, in ns of `CLOCK_MONOTONIC`.
        pub window_start_ns: u64,
        /// How long it was, in ns: about a second of real time.
        pub window_ns: u64,
        /// From the `read` of the frame's last bytes to its publication.
        pub read_publish: StageLatency,
        /// From there until logic has received it: logic's wake-up.
        pub publish_receive: StageLatency,
        /// From there until logic has published its order: the decision.
        pub decide: StageLatency,
        /// From there until the bridge has received it: its main loop's wake-up.
        pub order_receive: StageLatency,
        /// From there until the command is written.
        pub receive_write: StageLatency,
        /// All of it.
        pub total: StageLatency,
    }
}
