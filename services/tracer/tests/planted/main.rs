//! Causes that are planted, and whether each late frame gets the right one; and that a tracer leaves
//! alone what is not its own. All on this machine's real kernel.
//!
//! They need the right to trace and to real time, so they are ignored by default; `tests/run` runs
//! them where the machine has both. Frames, service and plants run in real time, so that the rest of
//! a busy machine is no cause.

mod instance;
mod plant;
mod service;

use std::collections::BTreeMap;
use std::time::Duration;

use lager_home::Clock;
use lager_rig::schedule::{RealTime, pin, usable_cores};
use lager_tracer::proc::{machine, threads};
use lager_tracer::{Cause, Explainer, Frame, Mark, Tracer, Verdict, Who};
use plant::Plant;
use service::Service;

/// A frame that takes longer is late, in ns. The plants take 2 ms and more.
const LATE_NS: u64 = 500_000;

/// So many late frames of each plant are looked at, and so many must have the right cause.
const LOOKED_AT: usize = 100;
const RIGHT: usize = 95;

/// More turns of a plant than are needed on a machine that often keeps it from its core.
const TURNS: u64 = 400;

#[test]
#[ignore = "a process of the other tests"]
fn child() {
    if let Some(mut parent) = lager_rig::Parent::of_this_process() {
        match parent.name() {
            "holder" => instance::hold(&mut parent),
            _ => service::serve(&mut parent),
        }
    }
}

#[test]
#[ignore = "needs the right to tracefs and to real time; `tests/run` runs it where it has them"]
fn each_planted_cause_is_named_in_95_of_100_late_frames() {
    let [own, .., other] = usable_cores()[..] else {
        panic!("this test needs two cores");
    };
    let mut service = Service::start(other);
    let plants = Plant::all([own, other], service.pid());
    pin(own).expect("a core of this process");
    let _urgent = RealTime::begin(60).expect("the right to real time");
    let mut tracer = Tracer::start(8 * 1024).expect("the right to trace");
    assert_eq!(tracer.missing(), [""; 0], "each event that a cause needs");
    let mut explainer = Explainer::new(LATE_NS, machine());
    explainer.knows(service.pid(), "service", threads(service.pid()));
    let mut number = 0;
    let mut frame = |service: &mut Service, planted: Option<&Plant>| {
        let touched = planted.map_or(0, |plant| plant.prepare(service));
        if let Some(plant) = planted {
            plant.begin();
        }
        let start_ns = Clock::monotonic_ns();
        let [read_ns, done_ns] = service.frame(touched);
        let end_ns = Clock::monotonic_ns();
        if let Some(plant) = planted {
            plant.end();
        }
        number += 1;
        let mark = |stage, at_ns, by| Mark { stage, at_ns, by };
        let own = Who::Thread(rustix::thread::gettid().as_raw_nonzero().get());
        let frame = Frame {
            number,
            start_ns,
            marks: vec![
                mark("to the service", read_ns, Who::Process(service.pid())),
                mark("service", done_ns, Who::Process(service.pid())),
                mark("back", end_ns, own),
            ],
        };
        std::thread::sleep(Duration::from_millis(2));
        let whole = tracer.read(&mut explainer.line).expect("events");
        explainer.frame(&frame);
        explainer.line.forget_before(whole - 50_000_000);
        (number, end_ns - start_ns > LATE_NS)
    };
    for _ in 0..100 {
        frame(&mut service, None);
    }
    let mut planted = BTreeMap::new();
    for plant in &plants {
        let mut late = 0;
        for _ in 0..TURNS {
            let (number, is_late) = frame(&mut service, Some(plant));
            planted.insert(number, plant);
            late += usize::from(is_late);
            frame(&mut service, None);
            if late == LOOKED_AT {
                break;
            }
        }
        assert_eq!(late, LOOKED_AT, "{plant:?} makes frames late");
    }
    let report = explainer.report();
    for plant in &plants {
        let of_it =
            |verdict: &&Verdict| planted.get(&verdict.number).is_some_and(|by| *by == plant);
        let late: Vec<&Verdict> = report.late.iter().filter(of_it).collect();
        let right = late
            .iter()
            .filter(|verdict| plant.is_named_by(verdict))
            .count();
        println!("{plant:?}: {right} of {} named rightly", late.len());
        assert!(
            right >= RIGHT,
            "{plant:?}: {right} of {}\n{report}",
            late.len()
        );
    }
    assert_eq!(report.count(Cause::Unknown), 0, "{report}");
}
