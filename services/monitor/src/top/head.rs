//! The head of `lager top`: links, mode, stop, mission, battery, load, and the latencies of the path. They
//! come from the samples of five states and from the stop word.

use std::time::Duration;

use lager_battery::Battery;
use lager_sample::Stamp;
use lager_stop::Stop;
use lager_topics::{
    BoardHealth, CommandLatency, Durations, Health, Hold, NavigatorStatus, OrderQueue, PathLatency,
};
use serde_json::{Value, json};

use crate::life::{Failing, span};

/// The load of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// How many processes want a core, on average over a minute.
    pub minute: f64,
    /// Cores.
    pub cores: usize,
}

/// The content of the head.
#[derive(Clone, Debug, Default)]
pub(crate) struct Head {
    pub(crate) robot: String,
    pub(crate) health: Option<Health>,
    /// When each board's count of packets last changed, in ns: sensor, steering.
    heard_ns: [Option<u64>; 2],
    pub(crate) status: Option<NavigatorStatus>,
    pub(crate) queue: Option<OrderQueue>,
    pub(crate) battery: Battery,
    /// Its voltage in the last report of the steering board, in tenths of a volt; 0: not known.
    pub(crate) battery_decivolts: u8,
    /// The latencies from frames to decisions, and from orders to the wire.
    pub(crate) path: Recent<PathLatency>,
    pub(crate) command: Recent<CommandLatency>,
    /// The stop that is set, from the stop word; `None` if there is none or the word cannot be
    /// read.
    pub(crate) stop: Option<Stop>,
    /// The processes of the robot that stand still.
    pub(crate) failing: Vec<Failing>,
    pub(crate) load: Load,
    /// Seconds of robot time in a second.
    pub(crate) pace: Option<f64>,
}

impl Head {
    /// Takes a state of the links, published at that moment.
    pub(crate) fn take_health(&mut self, health: Health, at_ns: u64) {
        let boards = |health: &Health| [health.sensor, health.steering];
        let known = self.health.as_ref().map(boards);
        for (place, board) in boards(&health).iter().enumerate() {
            let count = |board: &BoardHealth| (board.epoch, board.packets);
            let before = known.as_ref().map(|known| count(&known[place]));
            if before != Some(count(board)) && board.up != 0 {
                self.heard_ns[place] = Some(at_ns);
            }
        }
        self.health = Some(health);
    }

    /// Seconds of robot time in a second, as text.
    pub(crate) fn shown_pace(&self) -> Option<f64> {
        self.pace.map(|pace| (pace * 100.0).round() / 100.0)
    }

    pub(crate) fn mode(&self) -> String {
        let mode = self.health.as_ref().and_then(|health| health.mode.get());
        mode.map_or("no bridge".to_owned(), |mode| {
            format!("{mode:?}").to_lowercase()
        })
    }

    /// Who has stopped the robot, and why, in words.
    pub(crate) fn stopped(&self, now_ns: u64) -> Option<String> {
        if let Some(stop) = self.stop {
            let age = Duration::from_nanos(now_ns.saturating_sub(stop.at_ns()));
            return Some(format!("{stop}, {} ago", span(age)));
        }
        let health = self.health.as_ref().filter(|health| health.stopped != 0)?;
        let cause = health.stop_cause.get();
        Some(cause.map_or("why is not known".to_owned(), |cause| cause.to_string()))
    }

    /// The link to a board, 0 the sensor's and 1 the steering's, in words.
    pub(crate) fn link(&self, place: usize, now_ns: u64) -> String {
        let Some(health) = &self.health else {
            return "not known".to_owned();
        };
        let board = [&health.sensor, &health.steering][place];
        let age = self.heard_ns[place].map(|at| Duration::from_nanos(now_ns.saturating_sub(at)));
        let state = match board.up {
            0 => "DOWN".to_owned(),
            _ => "up".to_owned(),
        };
        let age = age.map_or("-".to_owned(), span);
        format!(
            "{state:4} {age:>7} old  lost {}  CRC {}  skipped {} B  reboots {}  load {} %",
            board.lost_total,
            board.bad_crc,
            board.skipped_bytes,
            board.reboots,
            board.board_load_percent
        )
    }

    /// What is wrong with the image of a board that is up, 0 the sensor board and 1 the steering
    /// board.
    pub(crate) fn misfit(&self, place: usize) -> Option<String> {
        let health = self.health.as_ref()?;
        let board = [&health.sensor, &health.steering][place];
        let misfit = board.misfit().filter(|_| board.up != 0)?;
        Some(misfit.to_string())
    }

    pub(crate) fn mission(&self) -> String {
        let Some(status) = &self.status else {
            return "no navigator".to_owned();
        };
        let phase = status.phase.get().map_or("?".to_owned(), |phase| {
            crate::block::words(&format!("{phase:?}"))
        });
        let mut text = format!("{phase} at ({},{})", status.x, status.y);
        let queue = self.queue.unwrap_or_default();
        if queue.under_way != 0 {
            text += &format!(", order {} goods {}", queue.order_id, queue.product);
        }
        text += &format!(", {} waiting, {} delivered", queue.count, status.delivered);
        match status.hold.get() {
            None | Some(Hold::None) => {}
            Some(hold) => text += &format!(", held: {}", format!("{hold:?}").to_lowercase()),
        }
        if !status.failure.is_none() {
            text += &format!(", {}", status.failure);
        }
        text
    }

    /// The battery's voltage, while the board that measures it is heard.
    fn volts(&self) -> Option<f64> {
        let is_heard = self.health.is_some_and(|health| health.steering.up != 0);
        (is_heard && self.battery_decivolts != 0).then(|| f64::from(self.battery_decivolts) / 10.0)
    }

    /// The battery in words: its charge, how long that lasts, and its voltage, as far as they are known.
    pub(crate) fn charge(&self) -> Option<String> {
        let volts = self.volts()?;
        let Some(percent) = self.battery.percent() else {
            return Some(format!("{volts:.1} V"));
        };
        let left = self
            .battery
            .left()
            .map(|left| format!("for {}, ", span(left)));
        Some(format!(
            "{percent} %, {}{volts:.1} V",
            left.unwrap_or_default()
        ))
    }

    /// The same for programs.
    pub(crate) fn as_json(&self, now_ns: u64) -> Value {
        let link = |place: usize| {
            let health = self.health.as_ref()?;
            let board = [&health.sensor, &health.steering][place];
            let age = self.heard_ns[place].map(|at| now_ns.saturating_sub(at));
            Some(json!({
                "up": board.up != 0, "age_ns": age, "lost": board.lost_total,
                "bad_crc": board.bad_crc, "skipped_bytes": board.skipped_bytes,
                "reboots": board.reboots, "load_percent": board.board_load_percent,
                "build": board.build, "fits": board.misfit().is_none(),
            }))
        };
        let path: serde_json::Map<String, Value> = self
            .stages()
            .into_iter()
            .map(|(name, Stage { recent, whole })| {
                let [p50, p99] = [0.5, 0.99].map(|part| recent.quantile_ns(part));
                let shown = json!({
                    "count": recent.count, "p50_ns": p50, "p99_ns": p99, "max_ns": recent.max_ns,
                    "in_all": {
                        "count": whole.count, "p999_ns": whole.tail_ns(0.999),
                        "max_ns": whole.max_ns,
                    },
                });
                (name.replace(' ', "_"), shown)
            })
            .collect();
        let failing = self.failing.iter().map(|failing| {
            let silent = failing.silent.map(|long| long.as_nanos() as u64);
            let state = if silent.is_none() { "frozen" } else { "silent" };
            json!({
                "service": failing.who, "pid": failing.pid, "state": state, "silent_ns": silent,
            })
        });
        let volts = self.volts();
        let known = volts.and(Some(&self.battery));
        json!({
            "battery_V": volts, "battery_percent": known.and_then(Battery::percent),
            "battery_left_s": known.and_then(Battery::left).map(|left| left.as_secs()),
            "failing": failing.collect::<Vec<_>>(),
            "robot": self.robot, "mode": self.mode(), "stop": self.stopped(now_ns),
            "sensor": link(0), "steering": link(1), "mission": self.mission(),
            "robot_seconds_per_second": self.pace, "load_minute": self.load.minute,
            "cores": self.load.cores, "path": path,
        })
    }
}

/// Counts that only grow while their writer lives. For a robot the head shows what was counted
/// between the last two samples, for a recording all of it.
#[derive(Clone, Debug)]
pub(crate) struct Recent<T> {
    spans: Vec<Span<T>>,
    /// The process and epoch of the last sample's writer, in a recording.
    life: Option<(u32, u64)>,
}

/// The durations of a stage of the path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    /// Those of the last second, or of a whole recording.
    pub(crate) recent: Durations,
    /// All since the service started that counts them, or of a whole recording.
    pub(crate) whole: Durations,
}

/// The last counts, and the counts before them. No earlier counts mean that all of the last ones
/// count.
#[derive(Clone, Debug)]
struct Span<T> {
    before: Option<T>,
    now: T,
}

impl<T> Default for Recent<T> {
    fn default() -> Self {
        Self {
            spans: Vec::new(),
            life: None,
        }
    }
}

impl<T: Copy> Recent<T> {
    /// Takes a sample of a robot.
    pub(crate) fn take(&mut self, now: T) {
        let before = self.spans.pop().map(|span| span.now);
        self.spans = vec![Span { before, now }];
    }

    /// Takes a sample of a recording that began at that moment.
    pub(crate) fn take_recorded(&mut self, now: T, stamp: &Stamp, begun_ns: u64) {
        let life = (stamp.writer, stamp.epoch);
        if self.life == Some(life)
            && let Some(span) = self.spans.last_mut()
        {
            span.now = now;
            return;
        }
        self.life = Some(life);
        // A writer that is older than the recording counted these before it began.
        let before = (stamp.epoch < begun_ns).then_some(now);
        self.spans.push(Span { before, now });
    }

    /// The counts of a stage.
    fn of(&self, stage: impl Fn(&T) -> &Durations) -> Stage {
        let recent = self.recent(&stage);
        let whole = match (self.life, self.spans.last()) {
            (None, Some(span)) => *stage(&span.now),
            _ => recent,
        };
        Stage { recent, whole }
    }

    fn recent(&self, stage: impl Fn(&T) -> &Durations) -> Durations {
        let spans = self.spans.iter().map(|span| match &span.before {
            Some(before) => stage(&span.now).since(stage(before)),
            None => *stage(&span.now),
        });
        spans.reduce(joined).unwrap_or_default()
    }
}

/// The sum of both.
fn joined(mut one: Durations, other: Durations) -> Durations {
    one.count += other.count;
    one.sum_ns = one.sum_ns.saturating_add(other.sum_ns);
    one.max_ns = one.max_ns.max(other.max_ns);
    for (bucket, more) in one.buckets.iter_mut().zip(other.buckets) {
        *bucket += more;
    }
    one
}

impl Head {
    /// Whether the path has any figures.
    pub(crate) fn has_path(&self) -> bool {
        !self.path.spans.is_empty() || !self.command.spans.is_empty()
    }

    /// The stages of the path in their order, by name: from frames to their decision, and from
    /// orders to the wire. The last stage of each is the whole way.
    pub(crate) fn stages(&self) -> [(&'static str, Stage); 7] {
        [
            ("read", self.path.of(|path| &path.read_publish)),
            ("to logic", self.path.of(|path| &path.publish_receive)),
            ("decide", self.path.of(|path| &path.decide)),
            ("decided", self.path.of(|path| &path.total)),
            ("to bridge", self.command.of(|way| &way.order_receive)),
            ("write", self.command.of(|way| &way.receive_write)),
            ("total", self.command.of(|way| &way.total)),
        ]
    }
}

/// How a stage's durations are spread over a logarithmic scale of times. Within a bucket they count
/// as evenly spread.
pub(crate) fn shares<const N: usize>(stage: &Durations, from_ns: f64, to_ns: f64) -> [f64; N] {
    let mut shares = [0.0; N];
    if stage.count == 0 {
        return shares;
    }
    let scale = (to_ns / from_ns).ln();
    let at = |ns: u64| {
        let place = (ns.max(1) as f64 / from_ns).ln() / scale * N as f64;
        place.clamp(0.0, N as f64)
    };
    let mut lower_ns = 0;
    for (bucket, count) in stage.buckets.iter().enumerate() {
        let upper_ns = Durations::upper_ns(bucket).unwrap_or(stage.max_ns.max(lower_ns));
        let share = *count as f64 / stage.count as f64;
        let (from, to) = (at(lower_ns), at(upper_ns));
        lower_ns = upper_ns;
        if to - from < 1e-6 {
            // The whole bucket lies beyond one end of the scale.
            shares[(from as usize).min(N - 1)] += share;
            continue;
        }
        for (place, sum) in shares.iter_mut().enumerate() {
            let inside = to.min(place as f64 + 1.0) - from.max(place as f64);
            *sum += share * (inside / (to - from)).max(0.0);
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use lager_battery::Pack;

    use super::*;

    #[test]
    fn a_link_is_as_old_as_its_last_new_packet() {
        let mut head = Head::default();
        let mut health = Health::default();
        health.sensor.up = 1;
        health.sensor.packets = 5;
        head.take_health(health, 1_000_000_000);
        head.take_health(health, 1_400_000_000);
        assert!(head.link(0, 1_500_000_000).starts_with("up    500 ms old"));
        health.sensor.packets = 6;
        head.take_health(health, 1_500_000_000);
        assert!(head.link(0, 1_500_000_000).starts_with("up      0 ms old"));
        assert!(head.link(1, 1_500_000_000).starts_with("DOWN       - old"));
    }

    #[test]
    fn the_tail_is_that_of_all_that_was_counted() {
        let counted = |times: usize, longest_us: u64| {
            let mut total = Durations::default();
            (0..times).for_each(|_| total.record(100_000));
            total.record(longest_us * 1_000);
            PathLatency {
                total,
                ..PathLatency::default()
            }
        };
        let mut head = Head::default();
        head.path.take(counted(9_998, 5_000));
        let mut later = counted(9_998, 5_000);
        later.total.record(200_000);
        head.path.take(later);
        let told = &head.as_json(0)["path"]["decided"];
        assert_eq!(
            (&told["count"], &told["p99_ns"]),
            (&json!(1), &json!(229_376))
        );
        let all = &told["in_all"];
        assert_eq!(
            (&all["count"], &all["max_ns"]),
            (&json!(10_000), &json!(5_000_000))
        );
        assert!(
            all["p999_ns"].as_u64().is_some_and(|ns| ns < 200_000),
            "{told}"
        );
        head.path.take(counted(99, 5_000));
        assert_eq!(
            head.as_json(0)["path"]["decided"]["in_all"]["p999_ns"],
            Value::Null
        );
        // Of a recording, the same frames are shown twice.
        let mut head = Head::default();
        let stamp = Stamp {
            epoch: 5,
            ..Stamp::default()
        };
        head.path.take_recorded(counted(9, 5_000), &stamp, 10);
        head.path.take_recorded(counted(19, 5_000), &stamp, 10);
        let [(.., decided)] = [head.stages()[3]];
        assert_eq!((decided.recent.count, decided.whole.count), (10, 10));
    }

    #[test]
    fn the_battery_is_told_while_its_board_is_heard() {
        let pack = Pack {
            cells: 3,
            low_decivolts: 99,
        };
        let mut head = Head {
            battery: Battery::new(pack),
            ..Head::default()
        };
        let mut health = Health::default();
        health.steering.up = 1;
        head.take_health(health, 0);
        assert_eq!(head.charge(), None);
        head.battery.read(Duration::ZERO, 114);
        head.battery_decivolts = 114;
        assert_eq!(head.charge().as_deref(), Some("50 %, 11.4 V"));
        let json = head.as_json(0);
        assert_eq!(
            (&json["battery_V"], &json["battery_percent"]),
            (&json!(11.4), &json!(50))
        );
        // Of a battery that is not of such cells only the voltage is known.
        head.battery = Battery::default();
        assert_eq!(head.charge().as_deref(), Some("11.4 V"));
        health.steering.up = 0;
        head.take_health(health, 0);
        assert_eq!(head.charge(), None);
        assert_eq!(head.as_json(0)["battery_percent"], Value::Null);
    }

    #[test]
    fn a_robot_shows_its_last_second_and_a_recording_all_of_its_writers_lives() {
        let counted = |times: u64| {
            let mut counted = Durations::default();
            (0..times).for_each(|_| counted.record(50_000));
            counted
        };
        let mut live = Recent::default();
        live.take(counted(5));
        assert_eq!(live.recent(|counts| counts).count, 5);
        live.take(counted(7));
        assert_eq!(live.recent(|counts| counts).count, 2);

        let mut recorded = Recent::default();
        let begun_ns = 1_000;
        for (epoch, times) in [(500, 5), (500, 6), (500, 9), (2_000, 3), (2_000, 4)] {
            let stamp = Stamp {
                epoch,
                ..Stamp::default()
            };
            recorded.take_recorded(counted(times), &stamp, begun_ns);
        }
        // Five before the recording began, four of them in it, and four of the next writer.
        assert_eq!(recorded.recent(|counts| counts).count, 8);
    }

    #[test]
    fn the_shares_of_a_stage_are_a_whole() {
        let mut stage = Durations::default();
        for _ in 0..50 {
            stage.record(100_000);
        }
        for far_ns in [20, 5_000, 3_000_000, 60_000_000] {
            stage.record(far_ns);
        }
        let shares = shares::<24>(&stage, 10_000.0, 10_000_000.0);
        let sum: f64 = shares.iter().sum();
        assert!((sum - 1.0).abs() < 1e-6, "{shares:?}");
        let most = shares.iter().copied().fold(0.0, f64::max);
        // 100 us are in the bucket from 98 us to 115 us: places 7 and 8 of three decades.
        assert!((shares[8] - most).abs() < 1e-9, "{shares:?}");
        assert!(shares[0] > 0.0 && shares[23] > 0.0, "{shares:?}");
        assert_eq!(
            super::shares::<4>(&Durations::default(), 1.0, 10.0),
            [0.0; 4]
        );
    }
}
