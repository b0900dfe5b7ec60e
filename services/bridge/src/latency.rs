//! How long logic's orders take to the wire, for `latency/command`.
//!
//! It is pure and stands apart from the main loop, so that tests can prove which orders count:
//! stamps and moments are arguments, and it reads no clock. Until an order is written it keeps only
//! the order's times. Nothing here allocates.
//!
//! ```text
//!   heard(order in force, its stamp)          written: measured
//!  ----------------------------------> under way ----------------->
//!                                          | end of the turn: held back or not taken by the
//!                                          v driver; only its receipt is measured
//! ```

use heapless::Vec;
use lager_sample::{Stamp, Topic};
use lager_topics::{CommandLatency, SensorDistance, SensorLine, SteeringCommand};

use crate::arbiter::OrderKey;

/// How often the counts are published, in real ns.
const PERIOD_NS: u64 = 1_000_000_000;

/// The times of one order's way, in ns of `CLOCK_MONOTONIC`: the frame was read, the order was
/// published, the bridge received the order.
type Times = [u64; 3];

/// Measures the orders that sensor frames have caused.
#[derive(Clone, Debug, Default)]
pub(crate) struct CommandMeter {
    counted: CommandLatency,
    /// How long the orders of this turn took to reach the bridge, in ns.
    received: Vec<u64, { SteeringCommand::QOS.buffer }>,
    under_way: Option<(OrderKey, Times)>,
    told_ns: u64,
}

impl CommandMeter {
    /// An order came from the bus at `received_ns`. It was put in force as `in_force`, or was a
    /// renewal or was refused. If it is in force and a sensor frame caused it, it is measured up to
    /// its write, and the measurement of the order before it ends.
    pub(crate) fn heard(&mut self, in_force: Option<OrderKey>, stamp: &Stamp, received_ns: u64) {
        let way = way(stamp, received_ns);
        if let Some(key) = in_force {
            self.under_way = way.map(|way| (key, way));
        }
        if let Some([_, published, received]) = way {
            let took = received - published;
            if let Err(took) = self.received.push(took) {
                self.counted.order_receive.record(took);
            }
        }
    }

    /// Whether to measure the write of this order.
    pub(crate) fn is_waiting_for(&self, key: OrderKey) -> bool {
        self.under_way.is_some_and(|(waiting, _)| waiting == key)
    }

    /// The measured order has been written.
    pub(crate) fn written(&mut self, written_ns: u64) {
        if let Some((_, [read, _, received])) = self.under_way.take() {
            let counted = &mut self.counted;
            let wrote = written_ns.saturating_sub(received);
            counted.receive_write.record(wrote);
            counted.total.record(written_ns.saturating_sub(read));
        }
    }

    /// The turn is over. If an order has not been written by now, the bridge holds it back for a
    /// reason, and it is not measured.
    pub(crate) fn turn_over(&mut self) {
        self.under_way = None;
        for took in &self.received {
            self.counted.order_receive.record(*took);
        }
        self.received.clear();
    }

    /// Whether to publish the counts now; if so, the next time is a second later.
    pub(crate) fn is_due(&mut self, now_ns: u64) -> bool {
        let is_due = now_ns.saturating_sub(self.told_ns) >= PERIOD_NS;
        if is_due {
            self.told_ns = now_ns;
        }
        is_due
    }

    /// The counts so far.
    pub(crate) fn counted(&self) -> &CommandLatency {
        &self.counted
    }
}

/// The times of an order that a sensor frame caused; `None` for any other, and for impossible
/// times.
fn way(stamp: &Stamp, received_ns: u64) -> Option<Times> {
    if ![SensorLine::ID, SensorDistance::ID].contains(&stamp.cause_topic) {
        return None;
    }
    let way = [stamp.source_time_ns, stamp.publish_time_ns, received_ns];
    way.is_sorted().then_some(way)
}

#[cfg(test)]
mod tests {
    use lager_topics::{Durations, Origin, SteeringState};

    use super::*;

    const KEY: OrderKey = OrderKey {
        origin: Origin::Logic,
        id: 7,
    };

    /// The stamp of an order that a frame of `T` has caused, read at `read_ns` and published 6 us
    /// later.
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

    /// Takes up an order and writes it: receiving takes 4 us, writing 5 us.
    fn measure(meter: &mut CommandMeter, stamp: &Stamp) {
        meter.heard(Some(KEY), stamp, stamp.publish_time_ns + 4_000);
        meter.written(stamp.publish_time_ns + 9_000);
        meter.turn_over();
    }

    fn told(meter: &CommandMeter) -> [(u64, u64); 3] {
        let counted = meter.counted();
        let told = |stage: &Durations| (stage.count, stage.sum_ns);
        [
            told(&counted.order_receive),
            told(&counted.receive_write),
            told(&counted.total),
        ]
    }

    #[test]
    fn every_stage_and_the_whole_are_told_apart() {
        let mut meter = CommandMeter::default();
        measure(&mut meter, &caused_by::<SensorLine>(500));
        measure(&mut meter, &caused_by::<SensorDistance>(900));
        assert_eq!(told(&meter), [(2, 8_000), (2, 10_000), (2, 30_000)]);
    }

    #[test]
    fn a_renewal_counts_where_it_is_received_and_measures_no_write() {
        let mut meter = CommandMeter::default();
        let stamp = caused_by::<SensorLine>(500);
        meter.heard(None, &stamp, stamp.publish_time_ns + 4_000);
        assert!(!meter.is_waiting_for(KEY));
        meter.turn_over();
        assert_eq!(told(&meter), [(1, 4_000), (0, 0), (0, 0)]);

        // Nor does it keep the write of the order before it from being measured.
        meter.heard(Some(KEY), &stamp, stamp.publish_time_ns + 4_000);
        meter.heard(None, &stamp, stamp.publish_time_ns + 4_000);
        assert!(meter.is_waiting_for(KEY));
    }

    #[test]
    fn nothing_is_counted_before_the_order_is_written() {
        let mut meter = CommandMeter::default();
        meter.heard(Some(KEY), &caused_by::<SensorLine>(500), 10_000);
        assert_eq!(told(&meter), [(0, 0); 3]);
    }

    #[test]
    fn all_orders_that_a_queue_holds_and_more_are_counted() {
        let mut meter = CommandMeter::default();
        for _ in 0..SteeringCommand::QOS.buffer + 3 {
            meter.heard(None, &caused_by::<SensorLine>(500), 10_000);
        }
        meter.turn_over();
        let orders = SteeringCommand::QOS.buffer as u64 + 3;
        assert_eq!(meter.counted().order_receive.count, orders);
    }

    #[test]
    fn only_sensor_frames_cause_what_counts() {
        let mut meter = CommandMeter::default();
        let own = Stamp {
            source_time_ns: 10,
            publish_time_ns: 10,
            ..Stamp::default()
        };
        let of_a_report = caused_by::<SteeringState>(500);
        for stamp in [own, of_a_report] {
            meter.heard(Some(KEY), &stamp, stamp.publish_time_ns + 1);
            assert!(!meter.is_waiting_for(KEY));
            meter.written(stamp.publish_time_ns + 2);
            meter.turn_over();
        }
        assert_eq!(told(&meter), [(0, 0); 3]);
    }

    #[test]
    fn times_that_cannot_be_true_do_not_count() {
        let mut meter = CommandMeter::default();
        let mut stamp = caused_by::<SensorLine>(500);
        stamp.source_time_ns = stamp.publish_time_ns + 1;
        measure(&mut meter, &stamp);
        let honest = caused_by::<SensorLine>(500);
        meter.heard(Some(KEY), &honest, honest.publish_time_ns - 1);
        meter.written(honest.publish_time_ns);
        meter.turn_over();
        assert_eq!(told(&meter), [(0, 0); 3]);
    }

    #[test]
    fn only_the_order_last_put_in_force_is_waited_for_and_only_for_a_turn() {
        let mut meter = CommandMeter::default();
        let other = OrderKey { id: 8, ..KEY };
        let stamp = caused_by::<SensorLine>(500);
        meter.heard(Some(KEY), &stamp, 10_000);
        meter.heard(Some(other), &stamp, 10_000);
        assert!(meter.is_waiting_for(other) && !meter.is_waiting_for(KEY));
        meter.turn_over();
        assert!(!meter.is_waiting_for(other));
        meter.written(11_000);
        assert_eq!(meter.counted().total.count, 0);

        // An order of the clock's that comes in between ends the measurement as well.
        meter.heard(Some(KEY), &stamp, 10_000);
        meter.heard(Some(other), &Stamp::default(), 10_000);
        assert!(!meter.is_waiting_for(KEY) && !meter.is_waiting_for(other));
    }

    #[test]
    fn the_counts_are_due_once_a_second() {
        let mut meter = CommandMeter::default();
        assert!(meter.is_due(PERIOD_NS));
        assert!(!meter.is_due(2 * PERIOD_NS - 1));
        assert!(meter.is_due(2 * PERIOD_NS));
    }
}
