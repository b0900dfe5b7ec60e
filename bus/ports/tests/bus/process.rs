//! Other processes: starts this test program again as a process of a robot, until a test kills it.

use std::mem::ManuallyDrop;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use lager_ports::{Bus, Cause};
use lager_rig::process::{end_with_parent, ready};
use lager_rig::{Parent, Process, bus_at};
use lager_topics::{
    BridgeAnswer, BridgeRequest, Health, LinkHealth, NavStatus, NavigatorStatus, Outcome, Role,
    SensorLine, SteeringCommand,
};
use lager_wake::Policy;

use crate::domain::{Domain, frame};
use crate::swept::stranger;

/// Starts the process `name` on the bus of `domain`, and waits until it is ready.
pub(crate) fn start(domain: &Domain, name: &str) -> Process {
    let mut process = Process::start_in_test(name, "process::child").unwrap();
    process.tell(domain.config.folder.as_ref().unwrap());
    let () = process.hear_within(Duration::from_secs(60)).unwrap();
    process
}

/// The bus's folder, which the parent passes on.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();

fn folder() -> PathBuf {
    FOLDER.get().expect("it is told").clone()
}

fn open(role: Role) -> Bus {
    Bus::open(&bus_at(folder()), role).unwrap()
}

#[test]
#[ignore = "a process for the other tests to start and kill"]
fn child() {
    let Some(mut parent) = Parent::of_this_process() else {
        return;
    };
    let told = parent.hear().unwrap().expect("a folder");
    FOLDER.set(told).expect("it is told once");
    match parent.name() {
        "line-writer" => {
            let bus = open(Role::Bridge);
            let publisher = bus.publisher::<SensorLine>().unwrap();
            for number in 0..10 {
                publisher.send(Cause::OWN, frame(number)).unwrap();
            }
            ready();
            end_with_parent();
        }
        "line-writer-ahead" => {
            let bus = open(Role::Bridge);
            let publisher = bus.publisher::<SensorLine>().unwrap();
            for number in 0..10 {
                let mut loan = publisher.loan().unwrap();
                *loan = frame(number);
                loan.send_ahead().unwrap();
            }
            ready();
            end_with_parent();
        }
        "line-actor" => {
            let bus = open(Role::Logic);
            let _subscriber = bus.subscriber::<SensorLine>().unwrap();
            ready();
            end_with_parent();
        }
        "health-writer" => {
            let bus = open(Role::Bridge);
            let publisher = bus.publisher::<LinkHealth>().unwrap();
            for bus_lost in 0..=7 {
                let health = Health {
                    bus_lost,
                    ..Health::default()
                };
                publisher.send(Cause::event(1234), health).unwrap();
            }
            ready();
            end_with_parent();
        }
        "line-reader" => {
            let bus = open(Role::Observer);
            let _subscriber = bus.subscriber::<SensorLine>().unwrap();
            ready();
            end_with_parent();
        }
        "stranger" => {
            // The parent cleans up.
            let domain = ManuallyDrop::new(Domain::at(folder()));
            let ends = AtomicBool::new(false);
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    let _ = std::io::stdin().read_line(&mut String::new());
                    ends.store(true, Ordering::Relaxed);
                });
                stranger(&domain, ready, &ends);
            });
            // Nobody reads the output at the end of a test.
            std::process::exit(0);
        }
        "onlooker" => {
            let _bus = open(Role::Observer);
            ready();
            end_with_parent();
        }
        "navigator" => {
            let bus = open(Role::Logic);
            let publisher = bus.publisher::<NavStatus>().unwrap();
            for order_id in 0..=7 {
                let status = NavigatorStatus {
                    order_id,
                    ..NavigatorStatus::default()
                };
                publisher.send(Cause::event(1234), status).unwrap();
            }
            ready();
            end_with_parent();
        }
        "watcher" => {
            let bus = open(Role::Observer);
            let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
            let mut watcher = bus.watcher().unwrap();
            subscriber.wakes(&mut watcher);
            std::thread::spawn(|| end_with_parent());
            ready();
            loop {
                watcher.wait(Duration::from_secs(3600));
                while subscriber.receive().unwrap().is_some() {}
            }
        }
        "navigator-waits" => {
            // Sleeps whenever it can.
            let bus = open(Role::Logic);
            let waiter = bus.waiter(Policy::Block).unwrap();
            std::thread::spawn(|| end_with_parent());
            ready();
            loop {
                waiter.wait(Duration::from_secs(3600));
            }
        }
        "navigator-hurries" => {
            // Wakes and sleeps as fast as others ring.
            let bus = open(Role::Logic);
            let waiter = bus.waiter(Policy::Block).unwrap();
            std::thread::spawn(|| end_with_parent());
            ready();
            loop {
                waiter.wait(Duration::from_micros(50));
            }
        }
        "navigator-spins" => {
            // Holds the right to look without pause.
            let bus = open(Role::Logic);
            let waiter = bus.waiter(Policy::ADAPTIVE).unwrap();
            std::thread::spawn(|| end_with_parent());
            let ringer = waiter.ringer();
            std::thread::spawn(move || {
                loop {
                    ringer.ring();
                    std::thread::sleep(Duration::from_micros(20));
                }
            });
            for _ in 0..1000 {
                waiter.wait(Duration::from_secs(60));
            }
            ready();
            loop {
                waiter.wait(Duration::from_secs(60));
            }
        }
        "line-flood" => {
            // Rings without pause.
            let bus = open(Role::Bridge);
            let publisher = bus.publisher::<SensorLine>().unwrap();
            std::thread::spawn(|| end_with_parent());
            ready();
            loop {
                publisher.send(Cause::OWN, frame(0)).unwrap();
            }
        }
        "deaf-bridge" => {
            // Should act on steering/command and answer requests, but does neither.
            let bus = open(Role::Bridge);
            let _waiter = bus.waiter(Policy::Block).unwrap();
            let _subscriber = bus.subscriber::<SteeringCommand>().unwrap();
            let _server = bus.server::<BridgeRequest>().unwrap();
            ready();
            end_with_parent();
        }
        "bridge" => {
            let bus = open(Role::Bridge);
            let waiter = bus.waiter(Policy::Block).unwrap();
            let server = bus.server::<BridgeRequest>().unwrap();
            ready();
            std::thread::spawn(|| end_with_parent());
            loop {
                waiter.wait(Duration::from_millis(20));
                server
                    .serve(|ask| BridgeAnswer {
                        outcome: Outcome::Done.into(),
                        gain_p: ask.gain_p,
                        ..BridgeAnswer::default()
                    })
                    .unwrap();
            }
        }
        "asker" => {
            // Asks, and is killed before anybody answers.
            let bus = open(Role::Operator);
            let client = bus.client::<BridgeRequest>().unwrap();
            std::thread::spawn(|| {
                std::thread::sleep(Duration::from_millis(20));
                ready();
                end_with_parent();
            });
            let _ = client.call(lager_topics::Ask::default(), Duration::from_secs(60));
        }
        other => panic!("there is no process `{other}`"),
    }
}
