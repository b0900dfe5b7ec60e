//! A tracer and what is not its own: other tracers, alive or killed, and other people's tracing.

use std::fs;
use std::path::{Path, PathBuf};

use lager_home::Clock;
use lager_rig::{Parent, Process};
use lager_tracer::timeline::Timeline;
use lager_tracer::{Cause, Explainer, Frame, Machine, Mark, Tracer, Who};

/// A process that traces until it is ended.
pub(crate) fn hold(parent: &mut Parent) {
    let () = parent.told().expect("a parent");
    let tracer = Tracer::start(256).expect("the right to trace");
    let name = tracer.folder().file_name().expect("a name");
    parent
        .say(&name.to_str().expect("ASCII"))
        .expect("a parent");
    let () = parent.told().expect("the end");
}

fn holder() -> (Process, String) {
    let mut process = Process::start_in_test("holder", "child").expect("a process");
    let name = process.ask(&()).expect("it traces");
    (process, name)
}

fn instances(tracer: &Tracer) -> PathBuf {
    tracer.folder().parent().expect("all instances").to_owned()
}

#[test]
#[ignore = "needs the right to tracefs; `tests/run` runs it where it has it"]
fn a_killed_ones_instance_is_switched_off_at_once_and_removed_by_the_next() {
    let (killed, of_killed) = holder();
    let (_lives, of_living) = holder();
    let own = Tracer::start(256).expect("the right to trace");
    let instances = instances(&own);
    let is_on = |name: &str| fs::read_to_string(instances.join(name).join("tracing_on"));
    assert_eq!(is_on(&of_killed).expect("it traces"), "1\n");
    killed.kill();
    assert_eq!(
        is_on(&of_killed).expect("the folder is left"),
        "0\n",
        "the kernel ended it"
    );
    let next = Tracer::start(256).expect("a second one of this process");
    assert!(
        !instances.join(&of_killed).exists(),
        "the dead one's is removed"
    );
    assert!(
        instances.join(&of_living).exists(),
        "the living one's stays"
    );
    let folders =
        [&own, &next].map(|tracer| instances.join(tracer.folder().file_name().expect("a name")));
    assert!(folders.iter().all(|folder| folder.exists()) && folders[0] != folders[1]);
    drop(next);
    assert!(!folders[1].exists(), "its own is removed in order");
}

/// The switches of a folder of tracefs.
fn switches(folder: &Path) -> Vec<String> {
    [
        "tracing_on",
        "set_event",
        "current_tracer",
        "trace_clock",
        "buffer_size_kb",
        "kprobe_events",
    ]
    .iter()
    .map(|name| fs::read_to_string(folder.join(name)).unwrap_or_default())
    .collect()
}

#[test]
#[ignore = "needs the right to tracefs; `tests/run` runs it where it has it"]
fn nobody_elses_tracing_is_touched() {
    let first = Tracer::start(256).expect("the right to trace");
    let instances = instances(&first);
    let root = instances.parent().expect("tracefs").to_owned();
    let foreign = instances.join(format!("foreign-{}", std::process::id()));
    fs::create_dir(&foreign).expect("the right to an instance");
    fs::write(foreign.join("events/sched/sched_process_fork/enable"), "1").expect("an event");
    let before = [switches(&root), switches(&foreign)];
    let mut second = Tracer::start(256).expect("the right to trace");
    second.read(&mut Timeline::default()).expect("events");
    assert_eq!([switches(&root), switches(&foreign)], before);
    drop(second);
    assert_eq!([switches(&root), switches(&foreign)], before);
    fs::remove_dir(&foreign).expect("it is ours");
}

#[test]
#[ignore = "needs the right to tracefs; `tests/run` runs it where it has it"]
fn events_that_were_lost_are_said_and_their_frame_has_no_verdict() {
    let mut tracer = Tracer::start(8).expect("the right to trace");
    let start_ns = Clock::monotonic_ns();
    let own = rustix::thread::gettid().as_raw_nonzero().get();
    // Each wakes and sleeps, so the smallest ring is full many times over.
    while tracer.lost() < 1_000 {
        std::thread::sleep(std::time::Duration::from_micros(10));
    }
    let end_ns = Clock::monotonic_ns();
    let mut explainer = Explainer::new(1, Machine::default());
    tracer.read(&mut explainer.line).expect("events");
    explainer.frame(&Frame {
        number: 1,
        start_ns,
        marks: vec![Mark {
            stage: "all",
            at_ns: end_ns,
            by: Who::Thread(own),
        }],
    });
    let report = explainer.report();
    assert!(report.holes > 0, "{report}");
    assert_eq!(report.late[0].cause, Cause::Unknown, "{report}");
    assert!(report.to_string().contains("lost"), "{report}");
}
