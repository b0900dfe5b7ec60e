//! Tests goods that a person picks up step by step, in the document's language: the robot drives to
//! them by itself, asks for one step of the arm after the other, and delivers what is in its claw.
//!
//! The test is the external computer. As a person would, it looks at the arm to choose the next
//! step, and it speaks the document's grammar alone.

use std::fs;
use std::io::BufReader;
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

use lager_ports::Subscriber;
use lager_tests::{Domain, wait_for};
use lager_topics::{GoodState, SERVO_UNKNOWN, SteeringState, TruthPose};
use lager_wire::servo::{BASE, ELBOW, SHOULDER};

use crate::WAREHOUSE;
use crate::scene::{Peer, WATCHDOG};

/// How near a joint can come: a step is three units of a servo's position.
const NEAR: i32 = 2;
/// The arm's positions with the claw around goods in their place, and for carrying them.
const REACH: (u16, u16) = (311, 488);
const CARRY: (u16, u16, u16) = (512, 600, 400);

/// The arm as a person beside it sees it.
struct Arm {
    reports: Subscriber<SteeringState>,
    positions: [u16; 8],
}

impl Arm {
    /// The position of a servo, after its report of the step that has ended.
    fn position(&mut self, servo: usize) -> u16 {
        wait_for("the servo to report", || {
            while let Some(report) = self.reports.receive().expect("readable") {
                for (known, heard) in self.positions.iter_mut().zip(report.servo_position) {
                    if heard != SERVO_UNKNOWN {
                        *known = heard;
                    }
                }
            }
            Some(self.positions[servo]).filter(|position| *position != SERVO_UNKNOWN)
        })
    }
}

/// The robot while it asks for steps of its arm.
struct Asking {
    robot: Peer<TcpStream>,
    arm: Arm,
}

impl Asking {
    /// Answers a question for a step, and waits for the next one.
    fn step(&mut self, code: &str) {
        self.robot.says(&format!("armcomm {code}"));
        assert_eq!(self.robot.waits_for(&["armcomm"]), "armcomm");
    }

    /// Steps a joint until it is at `to`.
    fn bring(&mut self, servo: usize, [raise, lower]: [&str; 2], to: u16) {
        // No report has the position of a servo before its first step.
        self.step(raise);
        for _ in 0..400 {
            let missing = i32::from(to) - i32::from(self.arm.position(servo));
            match missing {
                _ if missing > NEAR => self.step(raise),
                _ if missing < -NEAR => self.step(lower),
                _ => return,
            }
        }
        panic!("servo {servo} does not come to {to}");
    }

    /// Gives an answer that the robot refuses with `why`, after which it asks again. If logic
    /// refuses, the robot may ask before the refusal comes.
    fn is_refused(&mut self, answer: &str, why: &str) {
        self.robot.says(answer);
        let (mut is_told, mut asks) = (false, false);
        while !(is_told && asks) {
            let line = self.robot.hears().expect("the conversation goes on");
            is_told |= line.starts_with("thought ") && line.contains(why);
            assert!(!(asks && line == "armcomm"), "it asks twice for {answer:?}");
            asks |= line == "armcomm";
        }
    }
}

#[test]
fn goods_are_picked_up_by_steps_of_the_arm_and_delivered() {
    let domain = Domain::among_others();
    let file = domain.folder().join("warehouse.toml");
    fs::write(&file, WAREHOUSE).expect("a file");
    let warehouse = file.to_str().expect("UTF-8");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let station = listener.local_addr().expect("an address").to_string();
    let up = domain.start(&[
        "up",
        "--headless",
        "--speed",
        "2",
        "--warehouse",
        warehouse,
        "--station",
        &station,
    ]);
    let (stream, _) = listener.accept().expect("it connects");
    stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    domain.done(&["pick", "manual"]);
    let bus = domain.observe("r1", 2.0);
    let arm = Arm {
        reports: bus.subscriber().expect("a topic"),
        positions: [SERVO_UNKNOWN; 8],
    };
    let mut truth = bus.subscriber::<TruthPose>().expect("a topic");
    let mut asking = Asking {
        robot: Peer(BufReader::new(stream)),
        arm,
    };
    let questions = ["sidelength", "karta", "prodlis", "fetchprod", "styrcomm"];
    loop {
        let answer = match asking.robot.waits_for(&questions).as_str() {
            "sidelength" => "sidelength 50",
            "karta" => "karta 2 2 0 0",
            "prodlis" => "prodlis 3 1 0 0 left 2 1 0 down 3 1 1 right",
            "fetchprod" => break,
            // The robot may ask before it is in autonomous mode.
            _ => continue,
        };
        asking.robot.says(answer);
    }
    asking.robot.says("fetchprod 2");
    assert_eq!(asking.robot.waits_for(&["armcomm"]), "armcomm");

    // Answers that the robot refuses, with their reasons.
    asking.is_refused("pickup_done", "claw");
    asking.is_refused("armcomm FB", "column 9");
    asking.is_refused("styrcomm 2", "autonomous");

    // Every step that exists. The gripper turns there and back, the arm to either side.
    for step in ["F1", "F2", "F7", "F8"] {
        asking.step(step);
    }
    let picked = [0_i16, 21, -21, 42, -42].into_iter().any(|aim| {
        let (base, shoulder, elbow) = CARRY;
        asking.bring(BASE, ["F7", "F8"], base.saturating_add_signed(aim));
        asking.step("FA");
        asking.bring(ELBOW, ["F4", "F3"], REACH.1);
        asking.bring(SHOULDER, ["F5", "F6"], REACH.0);
        asking.step("F9");
        asking.bring(SHOULDER, ["F5", "F6"], shoulder);
        asking.bring(ELBOW, ["F4", "F3"], elbow);
        asking.bring(BASE, ["F7", "F8"], base);
        // Goods that are gripped badly slip out within seconds.
        std::thread::sleep(Duration::from_secs(4));
        let truth = truth.latest().expect("readable").expect("it tells");
        let held = truth.goods.iter().find(|good| good.id == 2);
        held.is_some_and(|good| good.state == GoodState::Held)
    });
    assert!(picked, "the goods stay on their shelf");
    asking.robot.says("pickup_done");
    assert_eq!(asking.robot.waits_for(&["fetchprod"]), "fetchprod");
    wait_for("`up` to tell of it", || {
        up.output().contains("DELIVERED goods 2").then_some(())
    });
    drop((asking, truth, bus, up));
    domain.assert_clean();
}
