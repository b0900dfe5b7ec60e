//! Tests of playing: the same samples under another robot's name, and never onto a real robot.

use std::fs;

use lager_ports::{Bus, Cause};
use lager_sample::Topic;
use lager_tests::{Domain, wait_for};
use lager_topics::{
    DistanceFrame, LineFrame, NavMap, Role, SensorDistance, SensorLine, WarehouseMap,
};
use rustix::process::Signal;

use crate::{NoiseNow, Noisy, Seen, done, end, guest, info, must_be_right, read, recorder, said};

/// Records 300 lines of robot `r1`, published by a program that has ended.
fn recorded(domain: &Domain) -> Seen {
    let bus = guest(domain);
    let lines = bus.publisher::<SensorLine>().expect("a topic");
    let recorder = recorder(domain, &["lines.mcap"]);
    // The recorder finds this writer at its next look.
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
    // Plays only the chosen part, and fails if there is nothing in it.
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
    let place = domain.bus("r1", 1.0).home().expect("the bus's folder");
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

/// The time from the first sample's publication to the last one's, in ns.
fn lasted(seen: &Seen) -> u64 {
    let at = |message: Option<&(_, lager_sample::Stamp, _, _)>| {
        let (_, stamp, ..): &(String, lager_sample::Stamp, u64, serde_json::Value) =
            message.expect("a message");
        stamp.publish_time_ns
    };
    at(seen.messages.last()) - at(seen.messages.first())
}

#[test]
fn a_rate_stretches_a_recording_or_presses_it() {
    let domain = Domain::new();
    let first = lasted(&recorded(&domain));
    let mut played = Vec::new();
    for (rate, file) in [("0.5", "slow.mcap"), ("100", "fast.mcap")] {
        let recorder = recorder(&domain, &["--name", "r2", file]);
        let play = ["--name", "r2", "bag", "play", "lines.mcap", "--rate", rate];
        let told = done(&domain, &play);
        assert!(told.contains("300 samples played"), "{told}");
        end(recorder);
        played.push(lasted(&read(&domain.folder().join(file))));
    }
    // A sample is never played before its time, but the first one may be played late.
    let late = 100_000_000;
    assert!(played[0] + late >= 2 * first, "{first} {played:?}");
    assert!(played[1] < played[0], "{first} {played:?}");
    for rate in ["0", "-1", "101", "fast"] {
        let wrong = domain.run(&["bag", "play", "lines.mcap", "--rate", rate]);
        assert_eq!(wrong.status.code(), Some(2), "{rate}: {}", said(&wrong));
    }
    domain.assert_clean();
}

#[test]
fn only_the_topics_that_are_asked_for_are_played() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let lines = bus.publisher::<SensorLine>().expect("a topic");
    let distances = bus.publisher::<SensorDistance>().expect("a topic");
    let both = recorder(&domain, &["both.mcap"]);
    // The recorder finds these writers at its next look.
    std::thread::sleep(std::time::Duration::from_millis(100));
    for _ in 0..50 {
        let sent = lines.send(Cause::OWN, LineFrame::default());
        sent.expect("a sample");
        let sent = distances.send(Cause::OWN, DistanceFrame::default());
        sent.expect("a sample");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    end(both);
    drop((lines, distances, bus));
    assert_eq!(read(&domain.folder().join("both.mcap")).messages.len(), 100);
    let listener = recorder(&domain, &["--name", "r2", "lines.mcap"]);
    let play = [
        "--name",
        "r2",
        "bag",
        "play",
        "both.mcap",
        "--topic",
        "sensor/line",
    ];
    let told = done(&domain, &play);
    assert!(told.contains("50 samples played"), "{told}");
    end(listener);
    let heard = read(&domain.folder().join("lines.mcap"));
    assert_eq!(heard.messages.len(), 50);
    let is_line = |topic: &str| topic == SensorLine::NAME;
    assert!(heard.messages.iter().all(|(topic, ..)| is_line(topic)));
    domain.assert_clean();
}

#[test]
fn a_loop_plays_the_same_again_until_somebody_ends_it() {
    let domain = Domain::new();
    let first = recorded(&domain);
    let listener = recorder(&domain, &["--name", "r2", "again.mcap"]);
    let play = [
        "--name",
        "r2",
        "bag",
        "play",
        "lines.mcap",
        "--loop",
        "--rate",
        "2",
    ];
    let mut player = domain.start(&play);
    wait_for("the third time", || {
        let output = listener.output();
        let progress: serde_json::Value = serde_json::from_str(output.lines().last()?).ok()?;
        let received = progress["topics"][0]["received"].as_u64()?;
        (received > 650).then_some(())
    });
    player.signal(Signal::INT);
    assert_eq!(player.wait(), Some(0), "{}", player.log());
    end(listener);
    let again = read(&domain.folder().join("again.mcap"));
    for message in &again.messages {
        // One writer continues, so that no reader takes the repetition for a loss.
        let sequence = message.1.sequence as usize;
        let of_then = &first.messages[sequence % 300];
        assert_eq!(message.3, of_then.3, "sample {sequence}");
    }
    let last = again.messages.last().expect("samples");
    assert_eq!(last.1.epoch, again.messages[0].1.epoch);
    assert!(last.1.sequence > 600, "{}", last.1.sequence);
    domain.assert_clean();
}

#[test]
fn somebodys_own_topic_is_played_to_those_who_have_it_open() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let listener = recorder(&domain, &["--topic", "noise/now", "noise.mcap"]);
    noisy.meet(&listener);
    (0..100).for_each(|_| noisy.send());
    end(listener);
    drop((noisy, bus));
    let kept = read(&domain.folder().join("noise.mcap"));

    let play = ["--name", "r2", "bag", "play", "noise.mcap", "--rate", "50"];
    let alone = domain.run(&play);
    assert_eq!(alone.status.code(), Some(1), "{}", said(&alone));
    assert!(
        said(&alone).contains("somebody has open"),
        "{}",
        said(&alone)
    );

    let bus = Bus::open(&domain.bus("r2", 1.0), Role::Guest).expect("the bus opens");
    let mut heard = bus.subscriber::<NoiseNow>().expect("a topic");
    let mut player = domain.start(&[&play[..], &["--stamps", "recorded"]].concat());
    for (_, stamp, _, payload) in &kept.messages {
        let noise = wait_for("the sample", || {
            heard.receive().expect("readable").map(|noise| {
                assert_eq!(noise.stamp(), stamp);
                *noise
            })
        });
        assert_eq!(serde_json::to_value(noise).expect("JSON"), *payload);
    }
    assert_eq!(player.wait(), Some(0), "{}", player.log());
    assert_eq!(heard.lost(), 0);
    drop((heard, bus));
    domain.assert_clean();
}

#[test]
fn every_part_and_every_later_begin_says_what_held_before() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let maps = bus.publisher::<NavMap>().expect("a topic");
    let lines = bus.publisher::<SensorLine>().expect("a topic");
    let args = ["--topic", "nav/map", "--topic", "sensor/line"];
    let whole = recorder(&domain, &[&args[..], &["whole.mcap"]].concat());
    let parts = recorder(
        &domain,
        &[&args[..], &["--split-time", "0.5", "part.mcap"]].concat(),
    );
    let mut map = WarehouseMap::default();
    (map.width, map.height) = (7, 5);
    maps.send(Cause::OWN, map).expect("a sample");
    wait_for("the third file", || {
        lines
            .send(Cause::OWN, LineFrame::default())
            .expect("a sample");
        std::thread::sleep(std::time::Duration::from_millis(5));
        let third = domain.folder().join("part-002.mcap");
        third.is_file().then_some(())
    });
    let told = end(parts);
    end(whole);
    drop((maps, lines, bus));
    for (part, file) in told["files"].as_array().expect("files").iter().enumerate() {
        let file = file.as_str().expect("a name");
        must_be_right(&domain, file);
        let info = info(&domain, file);
        let topics = info["topics"].as_array().expect("topics");
        let map = topics.iter().find(|topic| topic["topic"] == NavMap::NAME);
        let map = map.expect("the map");
        assert_eq!(map["messages"], 1, "{info}");
        assert_eq!(map["repeated"], u64::from(part > 0), "{info}");
    }

    let bus = Bus::open(&domain.bus("r2", 1.0), Role::Guest).expect("the bus opens");
    let mut heard = bus.subscriber::<NavMap>().expect("a topic");
    let play = ["--name", "r2", "bag", "play", "whole.mcap", "--from", "0.4"];
    let mut player = domain.start(&play);
    let map = wait_for("the map", || {
        heard.receive().expect("readable").map(|map| *map)
    });
    assert_eq!((map.width, map.height), (7, 5));
    assert_eq!(player.wait(), Some(0), "{}", player.log());
    assert_eq!(heard.lost(), 0);
    assert!(
        heard.receive().expect("readable").is_none(),
        "it comes once"
    );
    // After the end of the recording no sample is valid any more.
    let late = [
        "--name",
        "r2",
        "bag",
        "play",
        "whole.mcap",
        "--from",
        "1000",
    ];
    let none = domain.run(&late);
    assert_eq!(none.status.code(), Some(1), "{}", said(&none));
    drop((heard, bus));
    domain.assert_clean();
}

/// Even between close samples the player looks for new readers and gives them the valid ones.
#[test]
fn who_comes_while_samples_are_played_hears_at_once_what_holds() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let maps = bus.publisher::<NavMap>().expect("a topic");
    let lines = bus.publisher::<SensorLine>().expect("a topic");
    let recorder = recorder(&domain, &["whole.mcap"]);
    // The recorder finds these writers at its next look.
    std::thread::sleep(std::time::Duration::from_millis(100));
    let mut map = WarehouseMap::default();
    (map.width, map.height) = (7, 5);
    maps.send(Cause::OWN, map).expect("a sample");
    for _ in 0..2_000 {
        lines
            .send(Cause::OWN, LineFrame::default())
            .expect("a sample");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    end(recorder);
    drop((maps, lines, bus));

    let bus = Bus::open(&domain.bus("r2", 1.0), Role::Guest).expect("the bus opens");
    let mut lines = bus.subscriber::<SensorLine>().expect("a topic");
    // It lasts more than 10 s, with a sample every 5 ms.
    let play = ["--name", "r2", "bag", "play", "whole.mcap", "--rate", "0.2"];
    let mut player = domain.start(&play);
    let mut line = || lines.receive().expect("readable").map(|_| ());
    wait_for("a line", &mut line);
    let mut heard = bus.subscriber::<NavMap>().expect("a topic");
    let map = wait_for("the map", || {
        heard.receive().expect("readable").map(|map| *map)
    });
    assert_eq!((map.width, map.height), (7, 5));
    // The map came while samples are still played.
    while line().is_some() {}
    wait_for("a line after it", &mut line);
    player.signal(Signal::INT);
    assert_eq!(player.wait(), Some(130), "{}", player.log());
    drop((heard, lines, bus));
    domain.assert_clean();
}
