//! Other processes: this test binary started again, playing one part until it is killed.

use std::io::{BufRead, BufReader, Write};
use std::mem::ManuallyDrop;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use lager_ports::{Bus, BusConfig, Cause, Policy};
use lager_topics::{
    Answer, BridgeRequest, Health, LinkHealth, NavStatus, NavigatorStatus, Outcome, Role,
    SensorLine, SteeringCommand,
};

use crate::domain::{Domain, frame};
use crate::swept::stranger;

const PART: &str = "LAGER_PORTS_TEST_PART";
const FOLDER: &str = "LAGER_PORTS_TEST_FOLDER";

/// A process that plays a part and waits to be killed.
pub(crate) struct Player {
    child: Child,
    // The player ends when this closes, so that none outlives a failed test.
    stdin: ChildStdin,
}

impl Player {
    /// Starts a process in `part` and waits until it is ready.
    pub(crate) fn start(domain: &Domain, part: &str) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["process::player", "--exact", "--ignored", "--nocapture"])
            .env(PART, part)
            .env(FOLDER, domain.config.folder.as_ref().unwrap())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = child.stdin.take().unwrap();
        let ready = BufReader::new(child.stdout.take().unwrap())
            .lines()
            .any(|line| line.unwrap().ends_with("READY"));
        assert!(ready, "the player `{part}` ended before it was ready");
        Self { child, stdin }
    }

    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn is_running(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// Lets it end by itself, for parts that do that in order.
    pub(crate) fn end(mut self) {
        self.stdin.write_all(b"\n").unwrap();
        assert!(self.child.wait().unwrap().success());
    }

    /// `kill -9`, and waits until it is gone.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn ready() {
    println!("READY");
    std::io::stdout().flush().unwrap();
}

/// Returns when the parent is gone or done with this process.
fn until_parent_ends() {
    let mut nothing = String::new();
    let _ = std::io::stdin().read_line(&mut nothing);
    std::process::exit(0);
}

fn open(role: Role) -> Bus {
    let config = BusConfig {
        folder: std::env::var(FOLDER).ok().map(PathBuf::from),
        ..BusConfig::default()
    };
    Bus::open(&config, role).unwrap()
}

#[test]
#[ignore = "a part for the other tests to start and kill"]
fn player() {
    let Ok(part) = std::env::var(PART) else {
        return;
    };
    match part.as_str() {
        "line-writer" => {
            let bus = open(Role::Bridge);
            let publisher = bus.publisher::<SensorLine>().unwrap();
            for number in 0..10 {
                publisher.send(Cause::OWN, frame(number)).unwrap();
            }
            ready();
            until_parent_ends();
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
            until_parent_ends();
        }
        "line-actor" => {
            let bus = open(Role::Logic);
            let _subscriber = bus.subscriber::<SensorLine>().unwrap();
            ready();
            until_parent_ends();
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
            until_parent_ends();
        }
        "line-reader" => {
            let bus = open(Role::Observer);
            let _subscriber = bus.subscriber::<SensorLine>().unwrap();
            ready();
            until_parent_ends();
        }
        "stranger" => {
            // The parent tidies up.
            let domain = ManuallyDrop::new(Domain::at(std::env::var(FOLDER).unwrap().into()));
            let ends = AtomicBool::new(false);
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    let _ = std::io::stdin().read_line(&mut String::new());
                    ends.store(true, Ordering::Relaxed);
                });
                stranger(&domain, ready, &ends);
            });
            // Nobody reads what a test says at its end.
            std::process::exit(0);
        }
        "onlooker" => {
            let _bus = open(Role::Observer);
            ready();
            until_parent_ends();
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
            until_parent_ends();
        }
        "navigator-waits" => {
            // Sleeps whenever it is let.
            let bus = open(Role::Logic);
            let waiter = bus.waiter(Policy::Block).unwrap();
            std::thread::spawn(until_parent_ends);
            ready();
            loop {
                waiter.wait(Duration::from_secs(3600));
            }
        }
        "navigator-hurries" => {
            // Wakes and sleeps as fast as it is rung.
            let bus = open(Role::Logic);
            let waiter = bus.waiter(Policy::Block).unwrap();
            std::thread::spawn(until_parent_ends);
            ready();
            loop {
                waiter.wait(Duration::from_micros(50));
            }
        }
        "navigator-spins" => {
            // Holds the right to look without pause.
            let bus = open(Role::Logic);
            let waiter = bus.waiter(Policy::ADAPTIVE).unwrap();
            std::thread::spawn(until_parent_ends);
            let ringer = waiter.ringer().unwrap();
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
            std::thread::spawn(until_parent_ends);
            ready();
            loop {
                publisher.send(Cause::OWN, frame(0)).unwrap();
            }
        }
        "deaf-bridge" => {
            // Acts on steering/command and answers requests, but does neither.
            let bus = open(Role::Bridge);
            let _waiter = bus.waiter(Policy::Block).unwrap();
            let _subscriber = bus.subscriber::<SteeringCommand>().unwrap();
            let _server = bus.server::<BridgeRequest>().unwrap();
            ready();
            until_parent_ends();
        }
        "bridge" => {
            let bus = open(Role::Bridge);
            let waiter = bus.waiter(Policy::Block).unwrap();
            let server = bus.server::<BridgeRequest>().unwrap();
            ready();
            std::thread::spawn(until_parent_ends);
            loop {
                waiter.wait(Duration::from_millis(20));
                server
                    .serve(|ask| Answer {
                        outcome: Outcome::Done.into(),
                        gain_p: ask.gain_p,
                        ..Answer::default()
                    })
                    .unwrap();
            }
        }
        "asker" => {
            // Asks and is killed before anybody answers.
            let bus = open(Role::Operator);
            let client = bus.client::<BridgeRequest>().unwrap();
            std::thread::spawn(|| {
                std::thread::sleep(Duration::from_millis(20));
                ready();
                until_parent_ends();
            });
            let _ = client.call(lager_topics::Ask::default(), Duration::from_secs(60));
        }
        other => panic!("there is no part `{other}`"),
    }
}
