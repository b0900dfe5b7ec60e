//! Playing: the same samples on another robot's name, and never onto a robot.

use std::fs;

use lager_ports::Cause;
use lager_tests::{Domain, wait_for};
use lager_topics::{LineFrame, SensorLine, Topic};
use rustix::process::Signal;

use crate::{Seen, done, end, guest, read, recorder, said};

/// Records three hundred lines of robot `r1`, which somebody sends who has gone afterwards.
fn recorded(domain: &Domain) -> Seen {
    let bus = guest(domain);
    let lines = bus.publisher::<SensorLine>().expect("a topic");
    let recorder = recorder(domain, &["lines.mcap"]);
    // The recorder finds this writer when it next looks.
    std::thread::sleep(std::time::Duration::from_millis(100));
    for packet in 0..300_u16 {
        let line = LineFrame {
            packet_id: packet as u8,
            ..LineFrame::default()
        };
        lines.send(Cause::OWN, line).expect("a sample");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    end(recorder);
    let seen = read(&domain.folder().join("lines.mcap"));
    assert_eq!(seen.messages.len(), 300);
    seen
}

#[test]
fn another_robots_name_hears_the_same_samples() {
    let domain = Domain::new();
    let first = recorded(&domain);
    for (stamps, file) in [("new", "new.mcap"), ("recorded", "same.mcap")] {
        let recorder = recorder(&domain, &["--name", "r2", file]);
        let play = [
            "--name",
            "r2",
            "bag",
            "play",
            "lines.mcap",
            "--stamps",
            stamps,
        ];
        let told = done(&domain, &play);
        assert!(
            told.contains("300 samples played onto robot `r2`"),
            "{told}"
        );
        end(recorder);
        let second = read(&domain.folder().join(file));
        assert_eq!(second.messages.len(), 300, "{stamps}");
        for (first, second) in first.messages.iter().zip(&second.messages) {
            assert_eq!((&first.0, &first.3), (&second.0, &second.3));
            assert_eq!(first.1.sequence, second.1.sequence);
            assert_eq!(first.1 == second.1, stamps == "recorded");
        }
    }
    // Only what was asked for, and nothing where nothing is.
    let some = [
        "--name",
        "r2",
        "bag",
        "play",
        "lines.mcap",
        "--from",
        "0.1",
        "--to",
        "0.2",
    ];
    let told = done(&domain, &some);
    let played: u64 = told
        .split(' ')
        .next()
        .and_then(|n| n.parse().ok())
        .expect("a number");
    assert!((1..300).contains(&played), "{told}");
    let none = domain.run(&["bag", "play", "lines.mcap", "--from", "1000"]);
    assert_eq!(none.status.code(), Some(1), "{}", said(&none));
    let wrong = domain.run(&["bag", "play", "lines.mcap", "--topic", "nav/map"]);
    assert_eq!(wrong.status.code(), Some(2), "{}", said(&wrong));
    assert!(
        said(&wrong).contains("it has sensor/line"),
        "{}",
        said(&wrong)
    );
    domain.assert_clean();
}

#[test]
fn a_recording_is_not_played_onto_a_robot_or_beside_its_writer() {
    let domain = Domain::new();
    recorded(&domain);
    let play = ["bag", "play", "lines.mcap"];
    let place = domain.bus("r1", 1.0).place().expect("the bus's folder");
    let robot = "r1".parse().expect("a name");

    let up = place.lock_name(&robot).expect("the name is free");
    let refused = domain.run(&play);
    assert_eq!(refused.status.code(), Some(4), "{}", said(&refused));
    assert!(said(&refused).contains("already up"), "{}", said(&refused));
    drop(up);
    let bridge = place
        .lock(&robot, lager_topics::Role::Bridge)
        .expect("no bridge runs");
    let refused = domain.run(&play);
    assert_eq!(refused.status.code(), Some(4), "{}", said(&refused));
    drop(bridge);

    let bus = guest(&domain);
    let lines = bus.publisher::<SensorLine>().expect("a topic");
    let refused = domain.run(&play);
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    let told = format!("{} of robot `r1` is written by guest", SensorLine::NAME);
    assert!(said(&refused).contains(&told), "{}", said(&refused));
    drop((lines, bus));

    let mut player = domain.start(&["bag", "play", "lines.mcap", "--loop"]);
    wait_for("the player to have the name", || {
        fs::exists(domain.bus_folder().join("r1/bridge.lock"))
            .ok()?
            .then_some(())
    });
    for robot in [&["up", "--headless"][..], &["bridge"]] {
        let refused = domain.run(robot);
        assert_eq!(
            refused.status.code(),
            Some(4),
            "{robot:?}: {}",
            said(&refused)
        );
    }
    player.signal(Signal::INT);
    assert_eq!(player.wait(), Some(0), "{}", player.log());
    domain.assert_clean();
}
