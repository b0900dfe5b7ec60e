//! How long frames take to become commands: what `latency/path` shows.
//!
//! It is pure and apart from the main loop, because it has to be proven which frames count: it
//! takes stamps and moments as arguments and reads no clock. The histograms are made once; taking
//! up, measuring and publishing do not allocate.
//!
//! ```text
//!   begin(order in force, its stamp)          written: measured
//!  ----------------------------------> under way ----------------->
//!                                          | end of the turn: held back or not taken by the
//!                                          v driver; not measured
//! ```

use hdrhistogram::Histogram;
use lager_topics::{PathLatency, SensorDistance, SensorLine, StageLatency, Stamp, Topic};

use crate::arbiter::OrderKey;

/// How often the distribution is published, in real ns.
const PERIOD_NS: u64 = 1_000_000_000;

/// Longest duration that is told from a longer one, in ns. The lease of an order is long over.
const LONGEST_NS: u64 = 10_000_000_000;

/// Significant decimal digits of the quantiles.
const DIGITS: u8 = 3;

/// Boundaries of the stages of one order's way, in ns of `CLOCK_MONOTONIC`: the frame read,
/// published, received by logic, the order published, received by the bridge.
type Way = [u64; 5];

/// The distribution of one stage in the present window.
#[derive(Clone, Debug)]
struct Stage {
    histogram: Histogram<u32>,
    min_ns: u64,
    max_ns: u64,
    sum_ns: u64,
}

/// Measures the way of commands that sensor frames have caused.
#[derive(Clone, Debug)]
pub(crate) struct PathMeter {
    /// Read to publish, publish to receive, receive to publish, publish to receive, receive to
    /// write, and the whole.
    stages: [Stage; 6],
    since_start: u64,
    window_start_ns: u64,
    under_way: Option<(OrderKey, Way)>,
}

impl PathMeter {
    /// A meter whose first window begins now.
    pub(crate) fn new(now_ns: u64) -> Self {
        Self {
            stages: core::array::from_fn(|_| Stage::new()),
            since_start: 0,
            window_start_ns: now_ns,
            under_way: None,
        }
    }

    /// An order has been put in force, received from the bus at `received_ns`. It is measured if
    /// a sensor frame has caused it, and ends the measurement of the one before.
    pub(crate) fn begin(&mut self, key: OrderKey, stamp: &Stamp, received_ns: u64) {
        self.under_way = way(stamp, received_ns).map(|way| (key, way));
    }

    /// Whether the write of this order is to be measured.
    pub(crate) fn is_waiting_for(&self, key: OrderKey) -> bool {
        self.under_way.is_some_and(|(waiting, _)| waiting == key)
    }

    /// The order under way has been written.
    pub(crate) fn written(&mut self, written_ns: u64) {
        let Some((_, way)) = self.under_way.take() else {
            return;
        };
        let [read, .., received] = way;
        let steps = way.windows(2).map(|step| step[1] - step[0]);
        let last = written_ns.saturating_sub(received);
        let total = written_ns.saturating_sub(read);
        for (stage, duration_ns) in self.stages.iter_mut().zip(steps.chain([last, total])) {
            stage.record(duration_ns);
        }
        self.since_start += 1;
    }

    /// An order that has not been written by now is held back for a reason of its own, and is not
    /// measured.
    pub(crate) fn give_up(&mut self) {
        self.under_way = None;
    }

    /// Whether the window is long enough to be told.
    pub(crate) fn is_due(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.window_start_ns) >= PERIOD_NS
    }

    /// Writes what the window has brought.
    pub(crate) fn fill(&self, now_ns: u64, latency: &mut PathLatency) {
        let [
            read_publish,
            publish_receive,
            decide,
            order_receive,
            receive_write,
            total,
        ] = &self.stages;
        *latency = PathLatency {
            since_start: self.since_start,
            window_start_ns: self.window_start_ns,
            window_ns: now_ns.saturating_sub(self.window_start_ns),
            read_publish: read_publish.latency(),
            publish_receive: publish_receive.latency(),
            decide: decide.latency(),
            order_receive: order_receive.latency(),
            receive_write: receive_write.latency(),
            total: total.latency(),
        };
    }

    /// Begins a new window.
    pub(crate) fn restart(&mut self, now_ns: u64) {
        self.window_start_ns = now_ns;
        for stage in &mut self.stages {
            stage.clear();
        }
    }
}

impl Stage {
    fn new() -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_NS, DIGITS)
            .expect("the bounds are far apart and the digits few");
        Self {
            histogram,
            min_ns: u64::MAX,
            max_ns: 0,
            sum_ns: 0,
        }
    }

    fn record(&mut self, duration_ns: u64) {
        // A longer one than the histogram tells counts as the longest; the maximum is exact.
        self.histogram.saturating_record(duration_ns);
        self.min_ns = self.min_ns.min(duration_ns);
        self.max_ns = self.max_ns.max(duration_ns);
        self.sum_ns = self.sum_ns.saturating_add(duration_ns);
    }

    fn latency(&self) -> StageLatency {
        let count = self.histogram.len();
        if count == 0 {
            return StageLatency::default();
        }
        // A quantile is the upper end of its class, which may lie beyond the maximum.
        let quantile = |part| self.histogram.value_at_quantile(part).min(self.max_ns);
        StageLatency {
            count,
            min_ns: self.min_ns,
            p50_ns: quantile(0.5),
            p90_ns: quantile(0.9),
            p99_ns: quantile(0.99),
            p999_ns: quantile(0.999),
            max_ns: self.max_ns,
            mean_ns: self.sum_ns / count,
        }
    }

    fn clear(&mut self) {
        if self.histogram.is_empty() {
            return;
        }
        self.histogram.reset();
        (self.min_ns, self.max_ns, self.sum_ns) = (u64::MAX, 0, 0);
    }
}

/// The way of an order that a sensor frame has caused; `None` for any other, and for one whose
/// times cannot be true.
fn way(stamp: &Stamp, received_ns: u64) -> Option<Way> {
    if ![SensorLine::ID, SensorDistance::ID].contains(&stamp.cause_topic) {
        return None;
    }
    let way = [
        stamp.source_time_ns,
        stamp.cause_publish_time_ns,
        stamp.cause_receive_time_ns,
        stamp.publish_time_ns,
        received_ns,
    ];
    way.is_sorted().then_some(way)
}

#[cfg(test)]
mod tests {
    use lager_topics::{Origin, SteeringState};

    use super::*;

    const KEY: OrderKey = OrderKey {
        origin: Origin::Logic,
        id: 7,
    };

    /// The stamp of an order that a frame of `T` has caused, read at `read_ns`; the stages last
    /// 1, 2 and 3 µs.
    fn caused_by<T: Topic>(read_ns: u64) -> Stamp {
        Stamp {
            source_time_ns: read_ns,
            cause_publish_time_ns: read_ns + 1_000,
            cause_receive_time_ns: read_ns + 3_000,
            publish_time_ns: read_ns + 6_000,
            cause_topic: T::ID,
            ..Stamp::default()
        }
    }

    fn told(meter: &PathMeter) -> PathLatency {
        let mut latency = PathLatency::default();
        meter.fill(1_000_000_000, &mut latency);
        latency
    }

    /// Takes up an order and writes it: receiving takes 4 µs, writing 5 µs.
    fn measure(meter: &mut PathMeter, stamp: &Stamp) {
        meter.begin(KEY, stamp, stamp.publish_time_ns + 4_000);
        meter.written(stamp.publish_time_ns + 9_000);
    }

    #[test]
    fn every_stage_and_the_whole_are_told_apart() {
        let mut meter = PathMeter::new(0);
        measure(&mut meter, &caused_by::<SensorLine>(500));
        let latency = told(&meter);
        let p50 = [
            &latency.read_publish,
            &latency.publish_receive,
            &latency.decide,
            &latency.order_receive,
            &latency.receive_write,
            &latency.total,
        ]
        .map(|stage| (stage.count, stage.p50_ns));
        assert_eq!(
            p50,
            [1_000, 2_000, 3_000, 4_000, 5_000, 15_000].map(|ns| (1, ns))
        );
        assert_eq!(latency.since_start, 1);
        assert_eq!(latency.window_ns, 1_000_000_000);
    }

    #[test]
    fn quantiles_are_within_a_thousandth_and_the_ends_are_exact() {
        let mut meter = PathMeter::new(0);
        // 1 to 10 000 µs in no order: 7919 is a prime.
        for step in 0..10_000 {
            let micros = step * 7_919 % 10_000 + 1;
            let mut stamp = caused_by::<SensorDistance>(50_000);
            stamp.publish_time_ns = stamp.cause_receive_time_ns + micros * 1_000;
            measure(&mut meter, &stamp);
        }
        let decide = told(&meter).decide;
        assert_eq!(
            (decide.count, decide.min_ns, decide.max_ns),
            (10_000, 1_000, 10_000_000)
        );
        for (told, true_ns) in [
            (decide.p50_ns, 5_000_000),
            (decide.p90_ns, 9_000_000),
            (decide.p99_ns, 9_900_000),
            (decide.p999_ns, 9_990_000),
            (decide.mean_ns, 5_000_500),
        ] {
            assert!(
                (true_ns..=true_ns + true_ns / 1_000).contains(&told),
                "{told} for {true_ns}"
            );
        }
    }

    #[test]
    fn a_duration_beyond_the_histogram_counts_as_its_longest() {
        let mut meter = PathMeter::new(0);
        let stamp = caused_by::<SensorLine>(0);
        meter.begin(KEY, &stamp, 10_000);
        meter.written(u64::MAX / 2);
        let write = told(&meter).receive_write;
        assert_eq!((write.count, write.max_ns), (1, u64::MAX / 2 - 10_000));
        assert!((LONGEST_NS..LONGEST_NS * 2).contains(&write.p50_ns));
    }

    #[test]
    fn only_sensor_frames_cause_what_counts() {
        let mut meter = PathMeter::new(0);
        let renewal = Stamp {
            source_time_ns: 10,
            publish_time_ns: 10,
            ..Stamp::default()
        };
        let of_a_report = caused_by::<SteeringState>(500);
        for stamp in [renewal, of_a_report] {
            meter.begin(KEY, &stamp, stamp.publish_time_ns + 1);
            assert!(!meter.is_waiting_for(KEY));
            meter.written(stamp.publish_time_ns + 2);
        }
        assert_eq!(told(&meter).since_start, 0);
        assert_eq!(told(&meter).total, StageLatency::default());
    }

    #[test]
    fn times_that_cannot_be_true_do_not_count() {
        let mut meter = PathMeter::new(0);
        let mut stamp = caused_by::<SensorLine>(500);
        stamp.cause_receive_time_ns = stamp.publish_time_ns + 1;
        measure(&mut meter, &stamp);
        let honest = caused_by::<SensorLine>(500);
        meter.begin(KEY, &honest, honest.publish_time_ns - 1);
        meter.written(honest.publish_time_ns);
        assert_eq!(told(&meter).since_start, 0);
    }

    #[test]
    fn only_the_order_last_put_in_force_is_waited_for_and_only_for_a_turn() {
        let mut meter = PathMeter::new(0);
        let other = OrderKey { id: 8, ..KEY };
        let stamp = caused_by::<SensorLine>(500);
        meter.begin(KEY, &stamp, 10_000);
        meter.begin(other, &stamp, 10_000);
        assert!(meter.is_waiting_for(other) && !meter.is_waiting_for(KEY));
        meter.give_up();
        assert!(!meter.is_waiting_for(other));
        meter.written(11_000);
        assert_eq!(told(&meter).since_start, 0);

        // An order of the clock's that comes in between ends the measurement as well.
        meter.begin(KEY, &stamp, 10_000);
        meter.begin(other, &Stamp::default(), 10_000);
        assert!(!meter.is_waiting_for(KEY) && !meter.is_waiting_for(other));
    }

    #[test]
    fn a_window_ends_after_a_second_and_the_count_goes_on() {
        let mut meter = PathMeter::new(5);
        assert!(!meter.is_due(PERIOD_NS + 4));
        assert!(meter.is_due(PERIOD_NS + 5));
        measure(&mut meter, &caused_by::<SensorLine>(500));
        meter.restart(2 * PERIOD_NS);
        let latency = told(&meter);
        assert_eq!(latency.window_start_ns, 2 * PERIOD_NS);
        assert_eq!((latency.total.count, latency.since_start), (0, 1));
        measure(&mut meter, &caused_by::<SensorLine>(500));
        assert_eq!(told(&meter).total.count, 1);
        assert_eq!(told(&meter).since_start, 2);
    }
}
