//! `health`: what a station is told once a second of the robot's machine, services and boards.
//!
//! Nothing here touches the bus. Load and memory come from the kernel, the services from the file
//! of their supervisor, and the findings from whoever composes this program.

use std::fs;
use std::sync::OnceLock;

use lager_home::{Home, UnitName, Watched};
use lager_lines::Name;
use lager_lines::extension::{Findings, Health, Release, Report, Service, Services};
use lager_orders::Moment;
use lager_topics::BoardHealth;

use crate::known::{Known, Machine};

impl Machine {
    /// How it is now, without the findings.
    pub(crate) fn look(home: &Home, robot: &UnitName) -> Self {
        let read = |path| fs::read_to_string(path).unwrap_or_default();
        Self {
            load_percent: load(&read("/proc/loadavg"), cores()),
            memory_mib: memory(&read("/proc/meminfo")),
            services: home.watched(robot),
            found: Vec::new(),
        }
    }
}

/// The cores of this machine.
fn cores() -> u16 {
    static CORES: OnceLock<u16> = OnceLock::new();
    *CORES.get_or_init(|| {
        let cores = std::thread::available_parallelism();
        cores.map_or(1, |cores| u16::try_from(cores.get()).unwrap_or(u16::MAX))
    })
}

fn load(loadavg: &str, cores: u16) -> Option<u32> {
    let wanting: f64 = loadavg.split(' ').next()?.parse().ok()?;
    Some((wanting * 100.0 / f64::from(cores)).round() as u32)
}

/// From `/proc/meminfo`, which counts KiB.
fn memory(meminfo: &str) -> Option<[u32; 2]> {
    let size = |name: &str| {
        let mut lines = meminfo.lines();
        let rest = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
        let kib: u64 = rest.trim().strip_suffix(" kB")?.parse().ok()?;
        u32::try_from(kib / 1024).ok()
    };
    Some([size("MemTotal")?, size("MemAvailable")?])
}

/// The report of this moment.
pub(crate) fn report(now: Moment, known: &Known) -> Report {
    let Machine {
        load_percent,
        memory_mib,
        services,
        found,
    } = &known.machine;
    let age_ms = |board: usize| {
        let age_ns = known.boards_ns[board].map(|at| now.ns.saturating_sub(at));
        age_ns.map(|ns| u32::try_from(ns / 1_000_000).unwrap_or(u32::MAX))
    };
    let of = |board: fn(&lager_topics::Health) -> BoardHealth| known.health.as_ref().map(board);
    let (sensor, steering) = (of(|health| health.sensor), of(|health| health.steering));
    let version = |board: &BoardHealth| {
        Some(board.version).filter(|version| *version != BoardHealth::UNKNOWN)
    };
    let service = |watched: &Watched| {
        let since_ns = now.ns.saturating_sub(watched.since_ns);
        Some(Service {
            name: Name::new(watched.name.clone()).ok()?,
            is_up: watched.pid.is_some(),
            since_s: u32::try_from(since_ns / 1_000_000_000).unwrap_or(u32::MAX),
            restarts: watched.restarts,
        })
    };
    let is_watched = !services.is_empty();
    Report::Health(Box::new(Health {
        release: Release::new(env!("CARGO_PKG_VERSION")),
        load_percent: *load_percent,
        cores: Some(cores()),
        memory_mib: memory_mib.map(|[all, _]| all),
        memory_free_mib: memory_mib.map(|[_, free]| free),
        trip_ms: known.trip_ms,
        sensor_age_ms: age_ms(0),
        steering_age_ms: age_ms(1),
        sensor_version: sensor.as_ref().and_then(version),
        steering_version: steering.as_ref().and_then(version),
        sensor_restarts: sensor.map(|board| board.reboots),
        steering_restarts: steering.map(|board| board.reboots),
        sensor_damaged: sensor.map(|board| board.bad_crc),
        steering_damaged: steering.map(|board| board.bad_crc),
        services: is_watched.then(|| Services::new(services.iter().filter_map(service))),
        found: Some(Findings::new(found.iter().cloned())),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn load_and_memory_are_read_as_the_kernel_writes_them() {
        assert_eq!(load("1.50 0.75 0.50 2/300 4711\n", 4), Some(38));
        assert_eq!(load("", 4), None);
        let meminfo =
            "MemTotal:        3884396 kB\nMemFree:  100 kB\nMemAvailable:    2150400 kB\n";
        assert_eq!(memory(meminfo), Some([3793, 2100]));
        assert_eq!(memory("MemTotal: 1 kB\n"), None);
    }
}
