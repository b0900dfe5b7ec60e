//! `health`: what a station is told once a second of the robot's machine, services and boards.
//!
//! Nothing here touches the bus or the machine: the services come from the file of their supervisor,
//! and all else of the machine from whoever composes this program.

use lager_home::Watched;
use lager_lines::Name;
use lager_lines::extension::{Findings, Health, Release, Report, Service, Services};
use lager_orders::Moment;
use lager_topics::BoardHealth;
use lager_wire::BUILD;

use crate::known::{Known, Machine};

/// The report of this moment.
pub(crate) fn report(now: Moment, known: &Known) -> Report {
    let Machine {
        load_percent,
        cores,
        memory_mib,
        found,
    } = &known.machine;
    let services = &known.services;
    let age_ms = |board: usize| {
        let age_ns = known.boards_ns[board].map(|at| now.ns.saturating_sub(at));
        age_ns.map(|ns| u32::try_from(ns / 1_000_000).unwrap_or(u32::MAX))
    };
    let of = |board: fn(&lager_topics::Health) -> BoardHealth| known.health.as_ref().map(board);
    let (sensor, steering) = (of(|health| health.sensor), of(|health| health.steering));
    let version = |board: &BoardHealth| {
        Some(board.version).filter(|version| *version != BoardHealth::UNKNOWN)
    };
    let build = |board: &BoardHealth| version(board).map(|_| board.build);
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
        cores: *cores,
        memory_mib: memory_mib.map(|[all, _]| all),
        memory_free_mib: memory_mib.map(|[_, free]| free),
        trip_ms: known.trip_ms,
        sensor_age_ms: age_ms(0),
        steering_age_ms: age_ms(1),
        sensor_version: sensor.as_ref().and_then(version),
        steering_version: steering.as_ref().and_then(version),
        sensor_build: sensor.as_ref().and_then(build),
        steering_build: steering.as_ref().and_then(build),
        program_build: Some(BUILD),
        sensor_restarts: sensor.map(|board| board.reboots),
        steering_restarts: steering.map(|board| board.reboots),
        sensor_damaged: sensor.map(|board| board.bad_crc),
        steering_damaged: steering.map(|board| board.bad_crc),
        services: is_watched.then(|| Services::new(services.iter().filter_map(service))),
        found: Some(Findings::new(found.iter().cloned())),
    }))
}
