//! Tests of `bag play --verify`. Recordings are of missions with things in the way, whose navigator
//! is killed. A navigator in another process must repeat each decision; each difference is named.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use lager_journal::{
    Counts, Damage, EnvelopeSchema, Journal, Learnt, Message, Start, Times, Visit, Walk,
};
use lager_sample::{Description, Field, Stamp, Topic, describe};
use lager_tests::{Domain, Running, pid, wait_for};
use lager_topics::{MissionEvent, NavInputs, NavStatus, SteeringCommand, SteeringReport};
use rustix::process::{Signal, kill_process};
use serde_json::{Value, json};

use crate::{end, recorder, said};

/// How many missions are recorded and verified: 1 in `tests/run`, more in `tests/soak`.
fn missions() -> u64 {
    let asked = std::env::var("LAGER_SOAK_VERIFY").ok();
    asked.and_then(|asked| asked.parse().ok()).unwrap_or(1)
}

/// The output and the exit code of `bag play --verify --json` for a recording.
fn verified(domain: &Domain, file: &str, with: &[&str]) -> (Value, Option<i32>) {
    let args = [&["bag", "--json", "play", "--verify", file], with].concat();
    let output = domain.run(&args);
    let told = serde_json::from_slice(&output.stdout);
    let told = told.unwrap_or_else(|error| panic!("{error}: {}", said(&output)));
    (told, output.status.code())
}

/// Records missions as [`record_mission`] does until a recording has all of the inputs: a recorder
/// that others keep from its core misses some. Even then, all that it has must be the same again.
fn record_all_of_a_mission(domain: &Domain, seed: u64, things: &str, file: &str) -> (Value, u64) {
    for _ in 0..10 {
        let killed = record_mission(domain, seed, things, file);
        let (told, code) = verified(domain, file, &[]);
        if !told["first"].is_null() {
            let kept = std::env::temp_dir().join(format!("lager-differs-{seed}.mcap"));
            fs::copy(domain.folder().join(file), &kept).expect("a copy");
            panic!("seed {seed}: {told:#}; {} has it", kept.display());
        }
        let gaps = told["gaps"].as_array().expect("a list");
        if gaps.is_empty() {
            assert_eq!(
                (code, &told["identical"]),
                (Some(0), &Value::Bool(true)),
                "{told:#}"
            );
            return (told, killed);
        }
        assert_eq!(
            (code, &told["identical"]),
            (Some(1), &Value::Bool(false)),
            "{told:#}"
        );
        assert!(gaps.iter().all(|gap| gap["why"] == "missing"), "{told:#}");
        println!("seed {seed}: inputs are missing, which is told: {gaps:?}");
        fs::remove_file(domain.folder().join(file)).expect("a file");
    }
    panic!("this machine is too busy to record a mission");
}

/// Records a mission with `things` things that come and go. Logic and bridge are killed in turn, in
/// each mission at other moments. Returns the number of kills of logic.
fn record_mission(domain: &Domain, seed: u64, things: &str, file: &str) -> u64 {
    let recorder = recorder(domain, &[file]);
    let seed_text = seed.to_string();
    // If all its ways are blocked, the robot waits for 10 s instead of a minute.
    let config = domain.folder().join("robot.toml");
    fs::write(&config, "[logic]\ntry_again_s = 10\n").expect("a file");
    let config = config.to_str().expect("a path in UTF-8");
    let mut up = domain.start(&[
        "--config",
        config,
        "up",
        "--headless",
        "--no-station",
        "--mission",
        "1",
        "--obstacles",
        things,
        "--speed",
        "4",
        "--exit-when-done",
        "--json",
        "--seed",
        &seed_text,
    ]);
    let mut killed = 0;
    for (count, service) in ["logic", "bridge"].iter().cycle().take(4).enumerate() {
        let pause = 900 + (seed * 811 + count as u64 * 617) % 1_500;
        let over = Instant::now() + Duration::from_millis(pause);
        wait_for("the moment of the kill", || {
            (Instant::now() > over || !up.is_running()).then_some(())
        });
        if !kill(&up, service) {
            break;
        }
        killed += u64::from(*service == "logic");
    }
    let code = up.wait();
    // A mission that the robot gave up is fine too, if it can be verified.
    assert!(matches!(code, Some(0 | 3)), "{code:?}\n{}", up.log());
    let told = end(recorder);
    println!(
        "seed {seed}: exit {code:?}, logic killed {killed} times, {} s",
        told["seconds"]
    );
    killed
}

/// Kills a service of the robot, if it runs; returns whether it did.
fn kill(up: &Running, service: &str) -> bool {
    let victim = up.service(service);
    victim.is_some_and(|victim| kill_process(pid(victim), Signal::KILL).is_ok())
}

/// A change of a message for [`rewrite`]: it may change the value, and returns whether the message
/// is written at all.
type Change<'a> = &'a mut dyn FnMut(&str, &mut Value) -> bool;

/// Writes a recording again, with changes that a recorder would never make.
fn rewrite(from: &Path, to: &Path, change: Change<'_>) {
    struct Rewriter<'a> {
        change: Change<'a>,
        journal: Journal,
        channels: BTreeMap<u16, lager_journal::Channel>,
    }
    impl Visit for Rewriter<'_> {
        fn message(&mut self, message: &Message<'_>) {
            let mut value: Value = serde_json::from_slice(message.data).expect("JSON");
            if !(self.change)(&message.topic.name, &mut value) {
                return;
            }
            let schema = EnvelopeSchema {
                name: message.topic.schema.to_string(),
                text: message.topic.schema_text.clone(),
            };
            let channel = *self.channels.entry(message.channel).or_insert_with(|| {
                let added = self.journal.topic(&message.topic.name, &schema);
                added.expect("a topic")
            });
            let data = serde_json::to_vec(&value).expect("JSON");
            let written = self.journal.write(channel, message.times, 0, &data);
            written.expect("a message");
        }

        fn note(&mut self, _name: &str, _texts: &BTreeMap<String, String>) {}

        fn damage(&mut self, damage: Damage) {
            panic!("{damage}");
        }
    }
    let start = Start {
        robot: "r1".to_owned(),
        ..Start::default()
    };
    let mut rewriter = Rewriter {
        change,
        journal: Journal::begin(&start).expect("a file"),
        channels: BTreeMap::new(),
    };
    let mut walk = Walk::knowing(Learnt::default());
    walk.feed(&fs::read(from).expect("a readable file"), &mut rewriter);
    walk.finish(&mut rewriter);
    write(rewriter.journal, to);
}

/// Ends a recording and writes it to the disk.
fn write(mut journal: Journal, to: &Path) {
    let mut bytes = Vec::new();
    journal.flush().expect("a chunk");
    journal.take(&mut bytes);
    bytes.append(&mut journal.end(&Counts::new()).expect("an end"));
    fs::write(to, bytes).expect("a file");
}

#[test]
fn a_recording_of_an_older_version_is_read_and_says_that_it_is_one() {
    // The form of `nav/inputs` at the time when an entry itself described what a person had done.
    let report = describe(&SteeringReport::MAKE);
    let before = format!(
        "ToldInputs{{first:u64,commands:Sent{{epoch:u64,next:u64}},statuses:Sent,events:Sent,\
         text_left:u32,text_used:u16,text_kind:TextKind<None,Began,Map>,entries_used:u8,\
         reports_used:u8,reserved:[u8;7],entries:[Told{{time_ns:u64,number:u64,product:i32,\
         proof:u32,command_id:u32,kind:ToldKind<None,Tick,Line,Distance,Steering,Map,Order,Cancel,\
         MoveUp,ClearQueue,PickupDone,Pick,DrivenByHand,Reset,Placed,Way,Link,Mode,Renewed,\
         Repeated,Goods>,value:u8,flag:u8,x:u8,y:u8,heading:Heading<Left,Up,Right,Down>,code:u8,\
         arm_granted:u8,reserved:[u8;4]}};24],reports:[{report};8],text:[[u8;32];16]}}"
    );
    let layout = Description::parse(&before).expect("a layout");
    assert_eq!(layout.size(), 1992);
    let mut journal = Journal::begin(&Start::default()).expect("a file");
    let channel = journal.topic(NavInputs::NAME, &EnvelopeSchema::of(&layout));
    let channel = channel.expect("a topic");
    let sample = json!({
        "stamp": Stamp::default(), "lost": 0, "dropped": 0,
        "payload": layout.read(&[0; 1992]).expect("a sample"),
    });
    let sample = serde_json::to_vec(&sample).expect("JSON");
    let written = journal.write(channel, Times { log: 1, publish: 1 }, 0, &sample);
    written.expect("a message");
    let domain = Domain::new();
    write(journal, &domain.folder().join("before.mcap"));

    for read in ["info", "check"] {
        let output = domain.run(&["bag", read, "before.mcap"]);
        assert!(output.status.success(), "{}", said(&output));
    }
    for play in [&["--verify"][..], &["--topic", NavInputs::NAME]] {
        let output = domain.run(&[&["bag", "play", "before.mcap"], play].concat());
        let text = said(&output);
        assert_eq!(output.status.code(), Some(1), "{text}");
        let older = "nav/inputs was recorded by another version of lager";
        assert!(text.contains(older), "{text}");
    }
    domain.assert_clean();
}

#[test]
fn missions_with_kills_and_things_in_the_way_are_identical() {
    let (mut inputs, mut compared, mut unexplained) = (0, 0, 0);
    for seed in 1..=missions() {
        let domain = Domain::new();
        let (told, killed) = record_all_of_a_mission(&domain, seed, "2", "tour.mcap");
        // The supervisor also restarts a logic that was held up for too long.
        assert!(told["navigators"].as_u64() > Some(killed), "{told:#}");
        assert!(told["inputs"].as_u64() > Some(1_000), "{told:#}");
        for topic in ["commands", "statuses", "events"] {
            let of = |what: &str| told[topic][what].as_u64().expect("a number");
            // A busy machine loses some of the samples.
            assert!(of("same") * 2 > of("sent"), "{topic}: {told:#}");
            compared += of("same");
            unexplained += of("unexplained");
        }
        inputs += told["inputs"].as_u64().expect("inputs");
        domain.assert_clean();
    }
    println!(
        "{} missions identical: {inputs} inputs, {compared} samples compared, {unexplained} samples \
         of the last moments before a kill not",
        missions()
    );
}

#[test]
fn what_is_not_as_it_was_is_named() {
    let domain = Domain::new();
    // With nothing in its way it drives, and so gives orders that another constant changes.
    let (told, _) = record_all_of_a_mission(&domain, 77, "0", "tour.mcap");
    let lives = told["navigators"].as_u64().expect("a number");
    let tour = domain.folder().join("tour.mcap");
    let written = domain.folder().join("other.mcap");

    // A navigator with another constant.
    let with = ["--with", "sensor_ahead_mm=140.0"];
    let (told, code) = verified(&domain, "tour.mcap", &with);
    assert_eq!(code, Some(1), "{told:#}");
    let command = &told["first_command"];
    assert_ne!(command["expected"], command["got"], "{told:#}");
    assert!(command["robot_time_ns"].as_u64() > Some(0), "{told:#}");
    let first = told["first"]["at_ns"].as_u64().expect("a number");
    assert!(command["at_ns"].as_u64() >= Some(first), "{told:#}");
    let output = domain.run(&[&["bag", "play", "--verify", "tour.mcap"], &with[..]].concat());
    let text = said(&output);
    assert!(
        text.contains("the first command that differs is at "),
        "{text}"
    );
    let expected = format!(
        "expected {}, got {}",
        command["expected"].as_str().expect("a text"),
        command["got"].as_str().expect("a text")
    );
    assert!(text.contains(&expected), "{text}");
    // The same value of the constant changes nothing, and an unknown name is refused.
    let (told, code) = verified(&domain, "tour.mcap", &["--with", "sensor_ahead_mm=160.0"]);
    assert_eq!(code, Some(0), "{told:#}");
    let wrong = domain.run(&["bag", "play", "--verify", "tour.mcap", "--with", "sensor=1"]);
    assert_eq!(wrong.status.code(), Some(2), "{}", said(&wrong));

    // Changes one sample of each topic.
    for (topic, field, key) in [
        (SteeringCommand::NAME, "code", "first_command"),
        (NavStatus::NAME, "travelled_mm", "first"),
        (MissionEvent::NAME, "product", "first"),
    ] {
        let mut left = 5;
        rewrite(&tour, &written, &mut |name, message| {
            if name == topic {
                left -= 1;
                if left == 0 {
                    let value = &mut message["payload"][field];
                    *value = (value.as_i64().expect("a number") + 1).into();
                }
            }
            true
        });
        assert!(left <= 0, "{topic} has too few samples");
        let (told, code) = verified(&domain, "other.mcap", &[]);
        assert_eq!(code, Some(1), "{topic}: {told:#}");
        assert_eq!(told[key]["topic"], topic, "{told:#}");
        assert_ne!(told[key]["expected"], told[key]["got"], "{told:#}");
    }

    // One input is changed or removed: only what follows the next navigator's start is proved.
    let mut seen = 0;
    rewrite(&tour, &written, &mut |name, _| {
        seen += u32::from(name == NavInputs::NAME);
        !(name == NavInputs::NAME && seen == 40)
    });
    let (told, code) = verified(&domain, "other.mcap", &[]);
    assert_eq!(code, Some(1), "{told:#}");
    assert_eq!(told["identical"], false, "{told:#}");
    assert_eq!(told["gaps"].as_array().map(Vec::len), Some(1), "{told:#}");
    assert_eq!(told["gaps"][0]["samples"], 1, "{told:#}");
    assert!(told["gaps"][0]["inputs"].as_u64() > Some(0), "{told:#}");
    assert_eq!(told["navigators"].as_u64(), Some(lives), "{told:#}");
    assert!(told["first"].is_null(), "{told:#}");
    let text = said(&domain.run(&["bag", "play", "--verify", "other.mcap"]));
    assert!(
        text.contains("1 samples of nav/inputs are missing"),
        "{text}"
    );

    let mut was_changed = false;
    rewrite(&tour, &written, &mut |name, message| {
        let entries = message["payload"]["entries"].as_array_mut();
        for entry in entries.into_iter().flatten() {
            if name == NavInputs::NAME && entry["kind"] == "DrivenByHand" && !was_changed {
                entry["number"] = 123_456_789_012_345_u64.into();
                was_changed = true;
            }
        }
        true
    });
    assert!(was_changed);
    let (told, code) = verified(&domain, "other.mcap", &[]);
    assert_eq!(code, Some(1), "{told:#}");
    assert!(!told["first"].is_null(), "{told:#}");

    // A recording without the inputs proves nothing.
    rewrite(&tour, &written, &mut |name, _| name != NavInputs::NAME);
    let output = domain.run(&["bag", "play", "--verify", "other.mcap"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said(&output).contains("it has no nav/inputs"),
        "{}",
        said(&output)
    );
    domain.assert_clean();
}

#[test]
fn a_recording_from_the_middle_is_proved_from_the_next_navigator_on() {
    let domain = Domain::new();
    let mission = ["--mission", "1", "--speed", "4"];
    let up = domain.start(&[&["up", "--headless", "--no-station"], &mission[..]].concat());
    let observer = domain.observe("r1", 1.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
        let status = status.latest().expect("readable")?;
        (status.frames > 200).then_some(())
    });
    let recorder = recorder(&domain, &["middle.mcap"]);
    let inputs = |recorder: &Running| {
        let said = recorder.output();
        let progress: Value = serde_json::from_str(said.lines().last()?).ok()?;
        let topics = progress["topics"].as_array()?;
        let told = topics
            .iter()
            .find(|topic| topic["topic"] == NavInputs::NAME)?;
        told["received"].as_u64()
    };
    let before = wait_for("inputs", || inputs(&recorder).filter(|count| *count > 5));
    assert!(kill(&up, "logic"));
    wait_for("inputs of the next one", || {
        inputs(&recorder).filter(|count| *count > before + 20)
    });
    end(recorder);
    drop((up, status, observer));
    let (told, code) = verified(&domain, "middle.mcap", &[]);
    assert_eq!(code, Some(1), "{told:#}");
    assert_eq!(told["gaps"][0]["why"], "begun before", "{told:#}");
    assert_eq!(told["navigators"], 1, "{told:#}");
    assert!(told["inputs"].as_u64() > Some(50), "{told:#}");
    assert!(told["first"].is_null(), "{told:#}");
    let text = said(&domain.run(&["bag", "play", "--verify", "middle.mcap"]));
    assert!(
        text.contains("identical as far as it can be verified"),
        "{text}"
    );
    assert!(text.contains("begun before the recording"), "{text}");
    domain.assert_clean();
}
