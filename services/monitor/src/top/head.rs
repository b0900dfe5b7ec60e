//! The head of `lager top`: links, mode, stop, mission, load and the path's latencies, from the
//! samples of four states and the stop word.

use std::time::Duration;

use lager_ports::Stop;
use lager_topics::{
    BoardHealth, Health, Hold, NavigatorStatus, OrderQueue, PathLatency, StageLatency,
};
use serde_json::{Value, json};

/// What the machine does beside.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Load {
    /// Processes that want a core, as the mean of a minute.
    pub(crate) minute: f64,
    /// Cores.
    pub(crate) cores: usize,
}

/// What the head shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Head {
    pub(crate) robot: String,
    pub(crate) health: Option<Health>,
    /// When each board's count of packets last changed, in ns: sensor, steering.
    heard_ns: [Option<u64>; 2],
    pub(crate) status: Option<NavigatorStatus>,
    pub(crate) queue: Option<OrderQueue>,
    pub(crate) path: Option<PathLatency>,
    /// The stop that is set, as its word says; `None` if none is or the word cannot be read.
    pub(crate) stop: Option<Stop>,
    pub(crate) load: Load,
    /// Robot seconds a second.
    pub(crate) pace: Option<f64>,
}

impl Head {
    /// Takes a state of the links as of that moment.
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

    /// Takes the path's latencies; those of a second without commands say nothing.
    pub(crate) fn take_path(&mut self, path: PathLatency) {
        if path.total.count > 0 {
            self.path = Some(path);
        }
    }

    pub(crate) fn mode(&self) -> String {
        let mode = self.health.as_ref().and_then(|health| health.mode.get());
        mode.map_or("no bridge".to_owned(), |mode| {
            format!("{mode:?}").to_lowercase()
        })
    }

    /// Who has stopped the robot and why, in words.
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
            text += &format!(", order {} product {}", queue.order_id, queue.product);
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

    /// For programs.
    pub(crate) fn as_json(&self, now_ns: u64) -> Value {
        let link = |place: usize| {
            let health = self.health.as_ref()?;
            let board = [&health.sensor, &health.steering][place];
            let age = self.heard_ns[place].map(|at| now_ns.saturating_sub(at));
            Some(json!({
                "up": board.up != 0, "age_ns": age, "lost": board.lost_total,
                "bad_crc": board.bad_crc, "skipped_bytes": board.skipped_bytes,
                "reboots": board.reboots, "load_percent": board.board_load_percent,
            }))
        };
        json!({
            "robot": self.robot, "mode": self.mode(), "stop": self.stopped(now_ns),
            "sensor": link(0), "steering": link(1), "mission": self.mission(),
            "robot_seconds_per_second": self.pace, "load_minute": self.load.minute,
            "cores": self.load.cores, "path": self.path,
        })
    }
}

/// The stages of the path in their order, by name; the last one is all of it.
pub(crate) fn stages(path: &PathLatency) -> [(&'static str, &StageLatency); 6] {
    [
        ("read", &path.read_publish),
        ("to logic", &path.publish_receive),
        ("decide", &path.decide),
        ("to bridge", &path.order_receive),
        ("write", &path.receive_write),
        ("total", &path.total),
    ]
}

/// Shares of a stage's commands on a logarithmic scale of times, as far as its percentiles tell
/// them: between two percentiles they are taken as even.
pub(crate) fn shares<const N: usize>(stage: &StageLatency, from_ns: f64, to_ns: f64) -> [f64; N] {
    let mut shares = [0.0; N];
    let scale = (to_ns / from_ns).ln();
    let at = |ns: u64| {
        let place = (ns.max(1) as f64 / from_ns).ln() / scale * N as f64;
        place.clamp(0.0, N as f64)
    };
    let known = [
        (stage.min_ns, stage.p50_ns, 0.5),
        (stage.p50_ns, stage.p90_ns, 0.4),
        (stage.p90_ns, stage.p99_ns, 0.09),
        (stage.p99_ns, stage.p999_ns, 0.009),
        (stage.p999_ns, stage.max_ns, 0.001),
    ];
    if stage.count == 0 {
        return shares;
    }
    for (from, to, share) in known {
        let (from, to) = (at(from), at(to).max(at(from) + 1e-3));
        for (place, sum) in shares.iter_mut().enumerate() {
            let left = from.max(place as f64);
            let right = to.min(place as f64 + 1.0);
            // What lies at the very end belongs to the last place.
            let is_last = place + 1 == N && from >= N as f64;
            let part = match is_last {
                true => 1.0,
                false => ((right - left) / (to - from)).max(0.0),
            };
            *sum += share * part;
        }
    }
    shares
}

/// A span in a few letters.
pub(crate) fn span(span: Duration) -> String {
    let seconds = span.as_secs_f64();
    match seconds {
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3_600.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3_600.0),
    }
}

#[cfg(test)]
mod tests {
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
    fn the_shares_of_a_stage_are_a_whole() {
        let stage = StageLatency {
            count: 100,
            min_ns: 20_000,
            p50_ns: 100_000,
            p90_ns: 150_000,
            p99_ns: 900_000,
            p999_ns: 2_000_000,
            max_ns: 60_000_000,
            mean_ns: 120_000,
        };
        let shares = shares::<24>(&stage, 10_000.0, 10_000_000.0);
        let sum: f64 = shares.iter().sum();
        assert!((sum - 1.0).abs() < 1e-6, "{shares:?}");
        let most = shares.iter().copied().fold(0.0, f64::max);
        // 100 to 150 us are the places 8 and 9 of three decades.
        assert!((shares[8] - most).abs() < 1e-9, "{shares:?}");
        assert_eq!(
            super::shares::<4>(&StageLatency::default(), 1.0, 10.0),
            [0.0; 4]
        );
    }
}
