//! How the robot is, for `/diagnostics`: links, stop, navigator, and what was lost on the way.
//!
//! A level is 0 for well, 1 for a warning, 2 for an error, and 3 if nothing has been heard for
//! [`STALE`].

use std::fmt::Display;
use std::time::Duration;

use lager_orders::Mode;
use lager_stop::StopTold;
use lager_topics::{BoardHealth, Health, NavigatorStatus, Refusal, Role, StopCause, word};

use crate::messages::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::told::{Calendar, Frames};

/// The bridge tells its state ten times a second, and the navigator twenty times.
pub const STALE: Duration = Duration::from_secs(1);

const OK: u8 = 0;
const WARN: u8 = 1;
const ERROR: u8 = 2;
const SILENT: u8 = 3;

/// The last state of a service, and when it was published, in ns of the bus's stamps.
pub type Last<S> = Option<(S, u64)>;

/// A topic of the bus on its way out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passed {
    /// Its name on the bus.
    pub topic: &'static str,
    /// Samples that the gateway has read.
    pub read: u64,
    /// Samples that the bus lost before the gateway read them.
    pub lost: u64,
    /// Messages that were made of them and sent, on all topics of ROS together.
    pub sent: u64,
    /// Messages for which there was no room.
    pub refused: u64,
}

/// What is told of the gateway itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gateway {
    /// The place in ROS, in words.
    pub place: String,
    /// Services that move the robot.
    pub is_operator: bool,
    /// All topics.
    pub passed: Vec<Passed>,
}

/// All of it at `now_ns`, in ns of the bus's stamps.
pub fn diagnostics(
    (health, status): (&Last<Health>, &Last<NavigatorStatus>),
    gateway: &Gateway,
    (calendar, now_ns): (Calendar, u64),
    frames: &Frames,
) -> DiagnosticArray {
    let robot = frames.robot();
    let is_fresh = |at_ns: u64| StopTold::age(now_ns, at_ns) <= STALE;
    let health = health
        .as_ref()
        .map(|(health, at_ns)| (health, is_fresh(*at_ns)));
    let status = status
        .as_ref()
        .map(|(status, at_ns)| (status, is_fresh(*at_ns)));
    let mut all = Vec::new();
    for (name, of) in [
        (
            "sensor board",
            (|of| &of.sensor) as fn(&Health) -> &BoardHealth,
        ),
        ("steering board", |of| &of.steering),
    ] {
        all.push(match health {
            Some((health, true)) => board(name, of(health)),
            _ => part(name, SILENT, "the bridge is silent", &[]),
        });
    }
    all.push(match health {
        Some((health, true)) => stop(health, now_ns),
        _ => part("stop", SILENT, "the bridge is silent", &[]),
    });
    all.push(match status {
        Some((status, true)) => navigator(status),
        _ => part("navigator", SILENT, "the navigator is silent", &[]),
    });
    all.push(losses(
        health.map(|(health, _)| health),
        status.map(|(it, _)| it),
        gateway,
    ));
    all.push(own(gateway, calendar));
    for status in &mut all {
        status.name = format!("{robot}: {}", status.name);
        robot.clone_into(&mut status.hardware_id);
    }
    DiagnosticArray {
        header: calendar.header(now_ns, frames.base()),
        status: all,
    }
}

fn part(
    name: &str,
    level: u8,
    message: impl Into<String>,
    values: &[(&str, &dyn Display)],
) -> DiagnosticStatus {
    let values = values.iter().map(|(key, value)| KeyValue {
        key: (*key).to_owned(),
        value: value.to_string(),
    });
    DiagnosticStatus {
        level,
        name: name.to_owned(),
        message: message.into(),
        hardware_id: String::new(),
        values: values.collect(),
    }
}

fn board(name: &str, board: &BoardHealth) -> DiagnosticStatus {
    let (level, message) = match (board.up != 0, board.misfit()) {
        (false, _) => (ERROR, "not connected".to_owned()),
        (true, Some(misfit)) => (WARN, misfit.to_string()),
        (true, None) => (OK, "connected".to_owned()),
    };
    part(
        name,
        level,
        message,
        &[
            ("packets", &board.packets),
            ("lost packets", &board.lost_total),
            ("bad packets", &board.bad_crc),
            ("restarts", &board.reboots),
            ("baud", &board.baud),
            ("build", &board.build),
            ("load in percent", &board.board_load_percent),
        ],
    )
}

fn stop(health: &Health, now_ns: u64) -> DiagnosticStatus {
    let mode = match health.mode.get() {
        Some(Mode::Manual) => "manual",
        Some(Mode::Autonomous) => "autonomous",
        None => "unknown",
    };
    if health.stopped == 0 {
        let (level, message) = match health.blocked.get() {
            Some(Refusal::None) => (OK, "not stopped".to_owned()),
            Some(why) => (WARN, format!("not stopped, but nobody may move it: {why}")),
            None => (WARN, "not stopped, but nobody may move it".to_owned()),
        };
        return part("stop", level, message, &[("mode", &mode)]);
    }
    let who = health
        .stop_origin
        .get()
        .map_or("nobody known", Role::as_author);
    let why = health.stop_cause.get().unwrap_or(StopCause::WordDamaged);
    let since = StopTold::age(now_ns, health.stopped_at_ns).as_secs();
    let message = format!("stopped by {who} ({why}); `lager resume` lets it go on");
    part(
        "stop",
        WARN,
        message,
        &[("mode", &mode), ("since, in s", &since)],
    )
}

fn navigator(status: &NavigatorStatus) -> DiagnosticStatus {
    let phase = word(status.phase).unwrap_or_else(|| "unknown".to_owned());
    let doing = phase.replace('_', " ");
    let hold = word(status.hold).filter(|hold| hold != "none");
    let (level, message) = match (status.failure.is_none(), &hold) {
        (false, _) if status.needs_reset() => (ERROR, format!("{doing}: {}", status.failure)),
        (false, _) => (WARN, format!("{doing}: {}", status.failure)),
        (true, Some(hold)) => (WARN, format!("{doing}, and held: {hold}")),
        (true, None) => (OK, doing),
    };
    part(
        "navigator",
        level,
        message,
        &[
            ("order", &status.order_id),
            ("product", &status.product),
            ("waiting orders", &status.waiting),
            ("delivered", &status.delivered),
        ],
    )
}

/// What was lost: by links and services themselves, and on the way through this gateway. What came in
/// is what went on and what was lost, topic by topic.
fn losses(
    health: Option<&Health>,
    status: Option<&NavigatorStatus>,
    gateway: &Gateway,
) -> DiagnosticStatus {
    let lost: u64 = gateway.passed.iter().map(|passed| passed.lost).sum();
    let refused: u64 = gateway.passed.iter().map(|passed| passed.refused).sum();
    let (level, message) = match (lost, refused) {
        (0, 0) => (OK, "nothing is lost on the way out".to_owned()),
        _ => (
            WARN,
            format!(
                "the gateway missed {lost} samples of the bus, and had no room for {refused} messages"
            ),
        ),
    };
    let mut status = part(
        "losses",
        level,
        message,
        &[
            (
                "lost by the bridge",
                &health.map_or(0, |health| health.bus_lost),
            ),
            (
                "lost by the navigator",
                &status.map_or(0, |status| status.frames_lost),
            ),
        ],
    );
    for passed in &gateway.passed {
        let Passed {
            topic,
            read,
            lost,
            sent,
            refused,
        } = passed;
        status.values.push(KeyValue {
            key: (*topic).to_owned(),
            value: format!("read {read}, lost {lost}, sent {sent}, refused {refused}"),
        });
    }
    status
}

fn own(gateway: &Gateway, calendar: Calendar) -> DiagnosticStatus {
    let services = match gateway.is_operator {
        true => "stop, resume, fetch",
        false => "stop",
    };
    part(
        "ros2 gateway",
        OK,
        gateway.place.clone(),
        &[
            ("services", &services),
            ("added to a stamp of the bus, in ns", &calendar.offset_ns()),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: u64 = 10_000_000_000;

    fn told(health: Last<Health>, passed: Passed) -> DiagnosticArray {
        let gateway = Gateway {
            passed: vec![passed],
            ..Gateway::default()
        };
        let at = (Calendar::new(1), NOW);
        diagnostics((&health, &None), &gateway, at, &Frames::of("r1"))
    }

    fn passed(lost: u64) -> Passed {
        Passed {
            topic: "sensor/line",
            read: 7,
            lost,
            sent: 7,
            refused: 0,
        }
    }

    fn level(told: &DiagnosticArray, name: &str) -> (u8, String) {
        let name = format!("r1: {name}");
        let part = told.status.iter().find(|part| part.name == name);
        let part = part.expect("the part");
        assert_eq!(part.hardware_id, "r1");
        (part.level, part.message.clone())
    }

    #[test]
    fn a_silent_bridge_is_stale_and_not_well() {
        let heard = Some((Health::default(), NOW - 2_000_000_000));
        for told in [told(None, passed(0)), told(heard, passed(0))] {
            for part in ["sensor board", "steering board", "stop", "navigator"] {
                assert_eq!(level(&told, part).0, SILENT, "{part}");
            }
        }
    }

    #[test]
    fn a_stop_says_who_and_why() {
        let mut health = Health {
            stopped: 1,
            stop_cause: StopCause::Ordered.into(),
            stop_origin: Role::Operator.into(),
            ..Health::default()
        };
        health.sensor.up = 1;
        let told = told(Some((health, NOW)), passed(0));
        let (at, message) = level(&told, "stop");
        assert_eq!(at, WARN);
        assert!(message.contains("a `lager` command"), "{message}");
        assert_eq!(level(&told, "steering board").0, ERROR);
    }

    #[test]
    fn what_is_lost_is_a_warning_with_its_number() {
        assert_eq!(level(&told(None, passed(0)), "losses").0, OK);
        let (at, message) = level(&told(None, passed(3)), "losses");
        assert_eq!(at, WARN);
        assert!(message.contains("missed 3 samples"), "{message}");
    }
}
