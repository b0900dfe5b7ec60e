//! The loan of the ports to whoever works on the boards.

use lager_bridge::loan::BORROWER;
use lager_bridge::serial::SerialPort;
use lager_home::Lock;
use lager_stop::StopWord;
use lager_topics::{Health, Outcome, Role, StopCause};

use crate::harness::{Robot, wait_until};

impl Robot {
    /// Somebody works on the boards until the lock is dropped.
    fn borrow(&self) -> Lock {
        let bus = self.isolation.open(Role::Operator);
        bus.home().lock(bus.unit(), BORROWER).expect("the boards")
    }

    /// Both ports, as somebody else opens them.
    fn open_both(&self) -> Option<[SerialPort; 2]> {
        let open = |path| SerialPort::open(path, self.bridge_config.baud).ok();
        Some([open(self.sensor.path())?, open(self.steering.path())?])
    }
}

fn are_up(health: &Health) -> bool {
    health.sensor.up == 1 && health.steering.up == 1
}

#[test]
fn a_stopped_robot_lends_its_ports_and_has_them_again_when_the_borrower_is_gone() {
    let mut robot = Robot::up();
    let borrowed = robot.borrow();
    // Somebody else's stop is none of the borrower's.
    robot.hands.stop();
    let stopped = |health: &Health| health.stop_cause.get();
    robot.hands.wait_for_health("the stop", |health| {
        stopped(health) == Some(StopCause::Ordered)
    });
    assert!(robot.open_both().is_none(), "the bridge has them");
    let stop = StopWord::set(&robot.hands.stop_word, Role::Operator, StopCause::BoardWork);
    let stop = stop.expect("a file");
    let mut ports = None;
    wait_until("the ports are free", || {
        ports = robot.open_both();
        ports.is_some()
    });
    let rested = robot.hands.stop_told().rested();
    assert_eq!(rested.map(|(of, _)| of), Some(stop), "the wheels stood");
    robot
        .hands
        .wait_for_health("the boards are gone", |health| {
            health.sensor.up == 0 && health.steering.up == 0
        });
    // Nobody would see that the robot goes on when its boards come back.
    let answer = robot.hands.resume();
    assert_eq!(answer.outcome.get(), Some(Outcome::NoBoard));
    assert_eq!(answer.stopped, 1);
    drop(ports);
    drop(borrowed);
    let health = robot.hands.wait_for_health("the boards are back", are_up);
    assert_eq!(stopped(&health), Some(StopCause::BoardWork));
    let answer = robot.hands.resume();
    assert_eq!(
        (answer.outcome.get(), answer.stopped),
        (Some(Outcome::Done), 0)
    );
    assert!(robot.open_both().is_none(), "the bridge has them again");
}

#[test]
fn a_bridge_that_starts_meanwhile_leaves_the_ports_alone() {
    let mut robot = Robot::up();
    let borrowed = robot.borrow();
    robot.bridge.take().expect("a bridge").stop();
    let ports = robot.open_both().expect("free ports");
    robot.start();
    robot.hands.wait_for_health("the next bridge", |health| {
        health.sensor.up == 0 && health.sensor.port == lager_topics::BoardHealth::UNKNOWN
    });
    drop(ports);
    // The borrower opens and closes them as it likes.
    for _ in 0..50 {
        assert!(robot.open_both().is_some());
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    drop(borrowed);
    robot.hands.wait_for_health("the boards", are_up);
}
