//! `kill -9` of ringers and waiters at random moments, and what happens to their seats.

use std::time::{Duration, Instant};

use lager_ports::remove_stale_nodes;
use lager_rig::Process;
use lager_topics::{Role, SensorLine};
use lager_wake::{Policy, SEATS_PER_PART, Wake};

use crate::domain::{Domain, send, until};
use crate::process;
use crate::waiting::spins_under_quick_rings;

const LONG: Duration = Duration::from_secs(60);

/// Rounds of killing. Each round starts some processes.
const ROUNDS: u64 = 8;

/// Waits for a time that differs from round to round and from run to run.
fn somewhere(round: u64) {
    let now = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap();
    std::thread::sleep(Duration::from_micros(
        (u64::from(now.subsec_nanos()) ^ (round * 7919)) % 3000,
    ));
}

fn bells(domain: &Domain) -> usize {
    let left = domain.left_in_folder();
    left.iter().filter(|path| path.ends_with("bells")).count()
}

#[test]
fn a_ringer_killed_anywhere_leaves_a_bell_that_others_can_ring() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    for round in 0..ROUNDS {
        let flood = process::start(&domain, "line-flood");
        let end = Instant::now() + Duration::from_millis(2);
        while Instant::now() < end {
            assert_eq!(waiter.wait(LONG), Wake::Rung);
        }
        somewhere(round);
        flood.kill();
        logic.sweep();
        // Until no ring of the killed process is left.
        while waiter.wait(Duration::from_millis(1)) == Wake::Rung {}
        std::thread::scope(|scope| {
            let sleeper = scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(3));
                bridge
                    .publisher::<SensorLine>()
                    .map(|publisher| send(&publisher, 1))
            });
            assert_eq!(waiter.wait(LONG), Wake::Rung, "round {round}");
            sleeper.join().unwrap().unwrap();
        });
        send(&publisher, 2);
        assert_eq!(waiter.wait(LONG), Wake::Rung, "round {round}");
    }
}

#[test]
fn waiters_killed_anywhere_give_their_seats_to_their_successors() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let logic = domain.open(Role::Logic);
    let witness = logic.waiter(Policy::Block).unwrap();
    for round in 0..ROUNDS {
        let parts = ["navigator-hurries", "navigator-waits"];
        let victims = parts.map(|part| process::start(&domain, part));
        let end = Instant::now() + Duration::from_millis(1);
        while Instant::now() < end {
            send(&publisher, 0);
        }
        somewhere(round);
        victims.into_iter().for_each(Process::kill);
        // Nobody sweeps, but a new waiter must still get every seat of the role.
        let successors: Vec<_> = (1..SEATS_PER_PART)
            .map(|_| logic.waiter(Policy::Block).unwrap())
            .collect();
        send(&publisher, 1);
        for waiter in successors.iter().chain([&witness]) {
            assert_eq!(waiter.wait(LONG), Wake::Rung, "round {round}");
        }
    }
}

#[test]
#[ignore = "needs two cores; `tests/run` runs it where there are two"]
fn a_killed_spinner_gives_its_right_back() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let waiter = bridge.waiter(Policy::ADAPTIVE).unwrap();
    // As many as may spin at a time, or as there are seats. This waiter can spin only when they
    // give the right back.
    let cores = std::thread::available_parallelism().unwrap().get();
    let spinners: Vec<_> = (0..cores.min(8))
        .map(|_| process::start(&domain, "navigator-spins"))
        .collect();
    spinners.into_iter().for_each(Process::kill);
    bridge.sweep();
    // On one core no waiter may spin.
    spins_under_quick_rings(&waiter);
}

#[test]
fn of_killed_processes_alone_nothing_is_left() {
    let domain = Domain::new();
    for round in 0..ROUNDS {
        let parts = ["navigator-hurries", "line-flood", "navigator-waits"];
        let victims = parts.map(|part| process::start(&domain, part));
        somewhere(round);
        victims.into_iter().for_each(Process::kill);
        assert_eq!(bells(&domain), 1, "they had a board");
        until("all of it is swept", || {
            if round % 2 == 0 {
                remove_stale_nodes(&domain.config).unwrap();
            } else {
                domain.open(Role::Supervisor);
            }
            domain.in_shared_memory().is_empty() && bells(&domain) == 0
        });
    }
}

#[test]
fn the_last_to_leave_takes_the_board_away() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let bridge = domain.open(Role::Bridge);
    assert_eq!(bells(&domain), 0, "nobody needs one yet");
    let waiter = logic.waiter(Policy::Block).unwrap();
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    assert_eq!(bells(&domain), 1);
    drop(waiter);
    assert_eq!(bells(&domain), 1, "the writer may ring others");
    drop(publisher);
    assert_eq!(bells(&domain), 0);
}

#[test]
fn boards_are_joined_and_left_by_many_at_once() {
    let domain = Domain::new();
    let buses: Vec<_> = (0..4).map(|_| domain.open(Role::Logic)).collect();
    std::thread::scope(|scope| {
        for bus in &buses {
            scope.spawn(move || {
                for _ in 0..200 {
                    let waiter = bus.waiter(Policy::Block).unwrap();
                    waiter.ringer().ring();
                    assert_eq!(waiter.wait(LONG), Wake::Rung);
                }
            });
        }
    });
    assert_eq!(bells(&domain), 0);
}

#[test]
fn robots_and_buses_have_boards_of_their_own() {
    let domain = Domain::new();
    let elsewhere = Domain::new();
    let writer = domain.open_robot("r1", Role::Bridge);
    let publisher = writer.publisher::<SensorLine>().unwrap();
    let ours = domain.open_robot("r1", Role::Logic);
    let waiters = [
        ours.waiter(Policy::Block).unwrap(),
        domain
            .open_robot("r2", Role::Logic)
            .waiter(Policy::Block)
            .unwrap(),
        elsewhere
            .open_robot("r1", Role::Logic)
            .waiter(Policy::Block)
            .unwrap(),
    ];
    assert_eq!((bells(&domain), bells(&elsewhere)), (2, 1));
    send(&publisher, 0);
    let rung = waiters
        .each_ref()
        .map(|waiter| waiter.wait(Duration::from_millis(2)));
    assert_eq!(rung, [Wake::Rung, Wake::TimedOut, Wake::TimedOut]);
}
