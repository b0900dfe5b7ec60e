//! Tests that `lager stop` stops the robot although the bus cannot help: the bus has no place left,
//! the bridge is frozen, the bus's files are gone, the disk is full, or everything was killed. The
//! processes are real, and the robot drives at full speed behind two ptys. Like one with real
//! boards, it begins stopped and in manual mode.

use std::fs;
use std::path::PathBuf;
use std::process::Output;
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_ports::{Bus, Subscriber};
use lager_rig::behind_ports;
use lager_stop::{StopPage, StopWord};
use lager_tests::{Domain, Running, has_ended, is_stopped, pid, wait_for};
use lager_topics::{LinkHealth, Role, SensorLine, TruthPose};
use rustix::process::{Signal, kill_process};

/// How long the test watches the motors after a stop.
const WATCHED: Duration = Duration::from_millis(400);

/// A robot behind its ports, its services, and the processes that drive it.
struct Scene {
    drives: Vec<Running>,
    up: Option<Running>,
    truth: Subscriber<TruthPose>,
    config: PathBuf,
    _body: Running,
    domain: Domain,
}

impl Scene {
    /// A robot whose wheels turn at full speed while `people` processes give it orders.
    fn driving(people: usize) -> Self {
        let domain = Domain::new();
        let [sensor, steering] =
            ["sensor.tty", "steering.tty"].map(|name| domain.folder().join(name));
        let config = domain.folder().join("robot.toml");
        let text = behind_ports(&sensor, &steering).expect("a description");
        fs::write(&config, text).expect("a configuration file");
        let body = domain.start(&["--config", config.to_str().expect("UTF-8"), "simulator"]);
        let truth = domain.observe("r1", 1.0).subscriber().expect("a topic");
        let mut scene = Self {
            drives: Vec::new(),
            up: None,
            truth,
            config,
            _body: body,
            domain,
        };
        scene.up();
        scene.drive(people);
        scene
    }

    fn up(&mut self) {
        let config = self.config.to_str().expect("UTF-8").to_owned();
        self.up = Some(self.domain.start(&["--config", &config, "up"]));
        let health = self.domain.observe("r1", 1.0);
        let mut health = health.subscriber::<LinkHealth>().expect("a topic");
        wait_for("both boards to be connected, and the robot stopped", || {
            let health = health.latest().expect("readable")?;
            (health.boards_are_ready() && health.stopped != 0).then_some(())
        });
    }

    fn drive(&mut self, people: usize) {
        wait_for("the stop to be released", || {
            let said = self.domain.run(&["resume"]);
            said.status.success().then_some(())
        });
        for _ in 0..people {
            self.drives.push(self.domain.start(&["drive", "forward"]));
            self.wait_to_move();
        }
        if people == 0 {
            return;
        }
        // So that the other processes give their orders, too.
        std::thread::sleep(Duration::from_millis(if people > 1 { 500 } else { 0 }));
        self.wait_to_move();
    }

    /// Waits until the wheels turn. If others keep a driving process from its core for longer than
    /// its order lasts, it ends with a sentence, and a new one is started.
    fn wait_to_move(&mut self) {
        wait_for("the wheels to turn", || {
            let last = self.drives.last_mut().expect("somebody drives");
            if !last.is_running() {
                *last = self.domain.start(&["drive", "forward"]);
            }
            (self.duties()? != [0, 0]).then_some(())
        });
    }

    /// The newest duties of the motors in the simulated world.
    fn duties(&mut self) -> Option<[u8; 2]> {
        let truth = self.truth.latest().expect("readable")?;
        Some([truth.left_duty, truth.right_duty])
    }

    fn stop(&self) -> (Output, Duration) {
        let start = Instant::now();
        let output = self.domain.run(&["stop"]);
        (output, start.elapsed())
    }

    /// Runs `lager stop`, and checks that its answer is true.
    fn assert_stops(&mut self, case: &str) {
        let (output, took) = self.stop();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let failed = String::from_utf8_lossy(&output.stderr).into_owned();
        println!("{case}: {} ({took:?} in all)", said.trim());
        assert!(output.status.success(), "{case}: {said}{failed}");
        assert!(said.contains("the wheels stand"), "{case}: {said}");
        self.assert_stands(case);
    }

    /// Asserts that the wheels stand although the orders are renewed.
    fn assert_stands(&mut self, case: &str) {
        while self.truth.receive().expect("readable").is_some() {}
        let end = Clock::monotonic_ns() + u64::try_from(WATCHED.as_nanos()).expect("short");
        let mut samples = 0;
        while Clock::monotonic_ns() < end || samples == 0 {
            while let Some(truth) = self.truth.receive().expect("readable") {
                assert_eq!([truth.left_duty, truth.right_duty], [0, 0], "{case}");
                samples += 1;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn bridge(&self) -> u32 {
        let up = self.up.as_ref().expect("it is up");
        wait_for("the bridge", || up.service("bridge"))
    }

    fn word(&self) -> PathBuf {
        let bus = self.domain.bus("r1", 1.0);
        let place = bus.home().expect("a place");
        place.folder_of(&bus.unit).join(StopPage::FILE)
    }

    fn end(self) {
        let Self {
            drives, up, domain, ..
        } = self;
        drop((drives, up));
        drop(domain);
    }
}

#[test]
fn it_stops_when_people_have_taken_every_writers_place() {
    let mut scene = Scene::driving(9);
    scene.assert_stops("9 lager drive");
    scene.end();
}

#[test]
fn it_stops_when_readers_have_taken_every_place() {
    let mut scene = Scene::driving(1);
    // As many observers as the bus has places, in any role: it would refuse the 65th.
    let bus = |role| Bus::open(&scene.domain.bus("r1", 1.0), role).expect("the bus opens");
    let buses = [bus(Role::Observer), bus(Role::Comm), bus(Role::Station)];
    let mut health = Vec::new();
    let mut line: Vec<Subscriber<SensorLine>> = Vec::new();
    for bus in &buses {
        while let Ok(reader) = bus.subscriber::<LinkHealth>() {
            health.push(reader);
        }
        while let Ok(reader) = bus.subscriber() {
            line.push(reader);
        }
    }
    assert!(health.len() >= 64, "{}", health.len());
    scene.assert_stops(&format!("{} readers of link/health", health.len()));
    drop((health, line, buses));
    scene.end();
}

#[test]
fn a_frozen_bridge_is_named_and_stops_the_robot_when_it_goes_on() {
    let mut scene = Scene::driving(1);
    let bridge = scene.bridge();
    // Freezes the supervisor too: it would replace the bridge before the stop's time is over.
    let up = scene.up.as_ref().expect("it is up").pid();
    for process in [up, bridge] {
        kill_process(pid(process), Signal::STOP).expect("a living process");
        wait_for("it to freeze", || is_stopped(process).then_some(()));
    }
    let (output, took) = scene.stop();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    println!("frozen: {} ({took:?} in all)", said.trim());
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("the robot may still be moving"), "{said}");
    assert!(said.contains(&bridge.to_string()), "{said}");
    kill_process(pid(bridge), Signal::CONT).expect("a living bridge");
    scene.assert_stands("after the freeze");
    scene.assert_stops("after the freeze");
    kill_process(pid(up), Signal::CONT).expect("a living supervisor");
    scene.end();
}

#[test]
fn it_stops_when_the_bus_folder_is_emptied() {
    let mut scene = Scene::driving(1);
    let place = scene.domain.bus("r1", 1.0).home().expect("a place");
    for entry in fs::read_dir(place.folder()).expect("a folder").flatten() {
        let _ = match entry.path().is_dir() {
            true => fs::remove_dir_all(entry.path()),
            false => fs::remove_file(entry.path()),
        };
    }
    // An emptied folder is a reason to stop: the bridge does so before any command comes.
    let set = wait_for("the stop word to be there again", || {
        StopWord::read(&scene.word()).ok()??.stop()
    });
    println!("emptied: stopped {set}");
    let (output, took) = scene.stop();
    let said = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    println!("emptied: {} ({took:?} in all)", said.trim());
    assert!(
        said.contains("the wheels stand") || said.contains("may still be moving"),
        "{said}"
    );
    assert_eq!(output.status.success(), said.contains("the wheels stand"));
    scene.assert_stands("emptied");
    scene.end();
}

#[test]
fn it_stops_when_the_disk_of_temporary_files_is_full() {
    let mut scene = Scene::driving(1);
    // A separate, full /tmp. It may hide the program, so descriptor 9 keeps the program open.
    let full = "exec 9<\"$1\"; shift; mount -t tmpfs -o size=4k none /tmp || exit 99; \
                head -c 9000 /dev/zero >/tmp/full 2>/dev/null; exec /proc/self/fd/9 \"$@\"";
    let start = Instant::now();
    let command = scene.domain.lager(&["stop"]);
    let output = std::process::Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", full, "sh"])
        .arg(command.get_program())
        .args(command.get_args())
        .output()
        .expect("this test needs `unshare`, of the package util-linux");
    let took = start.elapsed();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let failed = String::from_utf8_lossy(&output.stderr).into_owned();
    println!("full: {} ({took:?} in all)", said.trim());
    assert!(said.contains("the wheels stand"), "{said}{failed}");
    scene.assert_stands("full");
    scene.end();
}

#[test]
fn it_stays_stopped_when_everything_is_killed_and_started_again() {
    let mut scene = Scene::driving(1);
    scene.assert_stops("before the kill");
    let set = StopWord::read(&scene.word())
        .expect("readable")
        .expect("a file");
    let mut up = scene.up.take().expect("it is up");
    let mut processes = lager_tests::children(up.pid());
    processes.push(up.pid());
    for process in &processes {
        let _ = kill_process(pid(*process), Signal::KILL);
    }
    up.wait();
    for process in processes {
        wait_for("everything to end", || has_ended(process).then_some(()));
    }
    scene.drives.clear();
    scene.up();
    let told = StopWord::read(&scene.word())
        .expect("readable")
        .expect("a file");
    assert_eq!(told.stop(), set.stop(), "the same stop holds");
    scene.assert_stands("after the kill");
    wait_for("it to be told", || {
        let up = scene.up.as_ref().expect("it is up");
        let said = up.output() + &up.log();
        (said.contains("STOPPED by a `lager` command") && said.contains("lager resume"))
            .then_some(())
    });
    // The stop also outlives a robot that ends in order.
    drop(scene.up.take());
    let told = StopWord::read(&scene.word())
        .expect("readable")
        .expect("a file");
    assert_eq!(told.stop(), set.stop());
    scene.end();
}

#[test]
fn a_stop_word_cut_short_under_the_bridge_stops_the_robot() {
    let mut scene = Scene::driving(1);
    let file = fs::OpenOptions::new().write(true).open(scene.word());
    file.expect("a file").set_len(0).expect("a shorter file");
    // Either the bridge mends the word, or the bridge ends and its successor mends it.
    let stop = wait_for("the robot to be stopped", || {
        StopWord::read(&scene.word()).ok()??.stop()
    });
    println!("cut short: stopped {stop}");
    wait_for("the wheels to stand", || {
        (scene.duties()? == [0, 0]).then_some(())
    });
    scene.assert_stands("cut short");
    scene.assert_stops("cut short");
    scene.drives.clear();
    scene.drive(1);
    scene.end();
}

#[test]
fn a_resume_says_what_it_released() {
    let scene = Scene::driving(0);
    let say = |args: &[&str]| {
        let output = scene.domain.run(args);
        let out = String::from_utf8_lossy(&output.stdout).into_owned();
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), out, err)
    };
    let (code, out, _) = say(&["resume"]);
    assert_eq!(code, Some(0));
    assert!(out.contains("was not stopped"), "{out}");
    assert_eq!(say(&["drive", "stop"]).0, Some(0), "it is `lager stop`");
    let (code, out, _) = say(&["resume"]);
    assert_eq!(code, Some(0));
    assert!(
        out.contains("by a `lager` command") && out.contains("released"),
        "{out}"
    );
    let (code, _, err) = say(&["--name", "nobody", "stop"]);
    assert_eq!(code, Some(1));
    assert!(err.contains("has ever been up"), "{err}");
    scene.end();
}
