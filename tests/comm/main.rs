//! Tests of the robot and the external computer as processes. The test plays either side and shares
//! no code with them: it follows the grammar alone.

mod answers_at_once;
mod bad;
mod by_arm;
mod extended;
mod full;
mod gag;
mod heir;
mod killed;
mod late;
mod lost;
mod peers;
mod proved;
mod scene;

use std::fs;
use std::io::BufReader;
use std::os::unix::net::UnixStream;

use lager_tests::{Domain, Running, pid, wait_for};
use lager_topics::{EventKind, MissionEvent};
use rustix::process::{Signal, kill_process};

use crate::scene::{Peer, Scene, WATCHDOG};

#[test]
fn a_cut_link_makes_the_robot_stand_and_it_connects_again() {
    let mut scene = Scene::new();
    let robot = scene.drive(false);
    drop(robot);
    scene.wait_until_it_stands();
    let mut robot = scene.robot();
    assert_eq!(robot.hears().as_deref(), Some("lager 1 r1"));
    robot.waits_for(&["styrcomm"]);
    assert_eq!(scene.duties().unwrap_or_default(), (0, 0));
}

#[test]
fn a_station_that_falls_silent_makes_the_robot_stand() {
    let mut scene = Scene::new();
    let mut robot = scene.drive(true);
    // From here on the peer says nothing, but the connection stays open.
    scene.wait_until_it_stands();
    while robot.hears().is_some() {}
    let mut robot = scene.robot();
    robot.waits_for(&["styrcomm"]);
}

#[test]
fn a_comm_that_is_killed_makes_the_robot_stand_and_its_successor_asks_again() {
    let mut scene = Scene::new();
    let _robot = scene.drive(false);
    let comm = scene.up.service("comm").expect("it runs");
    kill_process(pid(comm), Signal::KILL).expect("it runs");
    scene.wait_until_it_stands();
    let mut robot = scene.robot();
    robot.waits_for(&["styrcomm"]);
    assert_eq!(scene.duties().unwrap_or_default(), (0, 0));
}

#[test]
fn a_stop_is_confirmed_and_stays() {
    let mut scene = Scene::new();
    // If the machine is held up, the robot loses the link and stands for that reason; then the test
    // tries again.
    let (mut robot, stopped) = loop {
        let mut robot = scene.drive(true);
        robot.says("stop 7");
        if let Some(stopped) = robot.hears_answering(&["stopped"]) {
            break (robot, stopped);
        }
        scene.domain.done(&["resume"]);
    };
    assert!(stopped.starts_with("stopped 7 "), "{stopped}");
    scene.wait_until_it_stands();
    let why = loop {
        robot.says("styrcomm 2");
        let line = robot.hears_answering(&["thought forward is not possible now", "styrcomm"]);
        // The robot had asked for its warehouse before the command came.
        if line.as_deref() != Some("styrcomm") {
            break line;
        }
    };
    assert!(why.is_none_or(|why| why.contains("the robot is stopped")));
    assert_eq!(scene.duties().unwrap_or_default(), (0, 0));
}

/// A file with the warehouse of robot and station.
pub(crate) const WAREHOUSE: &str = "size = [2, 2]
side_length_cm = 50

[[product]]
id = 1
square = [0, 0]
side = \"left\"

[[product]]
id = 2
square = [1, 0]
side = \"down\"

[[product]]
id = 3
square = [1, 1]
side = \"right\"
";

#[test]
fn a_gag_at_a_station_has_goods_fetched() {
    let domain = Domain::among_others();
    let file = domain.folder().join("warehouse.toml");
    fs::write(&file, WAREHOUSE).expect("a file");
    let gag = domain.folder().join("gag");
    let [file, socket] = [&file, &gag].map(|path| path.to_str().expect("UTF-8"));
    let station = domain.start(&[
        "station",
        "--listen",
        "127.0.0.1:0",
        "--warehouse",
        file,
        "--gag",
        socket,
    ]);
    let address = wait_for("the station", || {
        let said = station.output();
        let address = said.strip_prefix("robots connect to ")?.split(',').next()?;
        said.contains('\n').then(|| address.to_owned())
    });
    let up = domain.start(&[
        "up",
        "--headless",
        "--station",
        &address,
        "--speed",
        "4",
        "--warehouse",
        file,
        "--mission",
        "1",
    ]);
    let bus = domain.observe("r1", 4.0);
    let mut events = bus.subscriber::<MissionEvent>().expect("a topic");
    let mut delivered = move |product| {
        wait_for("a delivery", || {
            let event = events.receive().expect("readable")?;
            let is_it = event.kind == EventKind::ItemDelivered;
            (is_it && event.product == product).then_some(())
        });
    };
    delivered(1);

    let stream = UnixStream::connect(&gag).expect("it listens");
    stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    let mut gag = Peer(BufReader::new(stream));
    // Before the GaG came, the station had answered the robot's questions by itself.
    let mut fetches = |product| loop {
        let questions = ["sidelength", "karta", "prodlis", "armcomm", "fetchprod"];
        let answer = match gag.waits_for(&questions).as_str() {
            "sidelength" => "sidelength 50",
            "karta" => "karta 2 2 0 0",
            "prodlis" => "prodlis 3 1 0 0 left 2 1 0 down 3 1 1 right",
            // A simulated robot picks by itself.
            "armcomm" => continue,
            _ => {
                gag.says(&format!("fetchprod {product}"));
                break;
            }
        };
        gag.says(answer);
    };
    fetches(2);
    delivered(2);
    fetches(3);
    wait_for("the order to reach logic", || {
        let listed = domain.run(&["queue"]);
        let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
        listed.contains("goods 3").then_some(())
    });
    // The order survives the death of comm; the robot asks again after its delivery.
    let comm = up.service("comm").expect("it runs");
    kill_process(pid(comm), Signal::KILL).expect("it runs");
    delivered(3);
    fetches(1);
}

/// A station of its own, for robots that are told its address.
fn station(domain: &Domain, fetch: &[&str]) -> (Running, String) {
    station_at(domain, "127.0.0.1:0", fetch)
}

pub(crate) fn station_at(domain: &Domain, at: &str, fetch: &[&str]) -> (Running, String) {
    let file = domain.folder().join("warehouse.toml");
    fs::write(&file, WAREHOUSE).expect("a file");
    // A station that is killed leaves its socket behind.
    let gag = domain.folder().join("gag");
    let [file, gag] = [&file, &gag].map(|path| path.to_str().expect("UTF-8"));
    let mut args = vec!["station", "--listen", at, "--warehouse", file];
    args.extend(["--gag", gag, "--no-panel"]);
    for order in fetch {
        args.extend(["--fetch", order]);
    }
    let station = domain.start(&args);
    let address = wait_for("the station", || {
        let said = station.output();
        let address = said.strip_prefix("robots connect to ")?.split(',').next()?;
        said.contains('\n').then(|| address.to_owned())
    });
    (station, address)
}

#[test]
fn two_robots_of_one_station_deliver_though_both_are_killed() {
    let domain = Domain::among_others();
    let (_station, address) = station(&domain, &["r1=2", "r2=3,1"]);
    let file = domain.folder().join("warehouse.toml");
    let file = file.to_str().expect("UTF-8");
    let robot = |name| {
        domain.start(&[
            "--name",
            name,
            "up",
            "--headless",
            "--speed",
            "2",
            "--warehouse",
            file,
            "--station",
            &address,
        ])
    };
    let (first, mut second) = (robot("r1"), robot("r2"));
    let said = |robot: &Running, words: &str| robot.output().contains(words);
    wait_for("both to be under way", || {
        (said(&first, "drives from") && said(&second, "drives from")).then_some(())
    });
    // Both robots have orders at the same time.
    assert!(!said(&first, "DELIVERED") && !said(&second, "DELIVERED"));
    // Kills the services of one robot that talk to the station and move it.
    for service in ["comm", "bridge", "logic"] {
        let process = first.service(service).expect("it runs");
        kill_process(pid(process), Signal::KILL).expect("it runs");
    }
    // Kills all of the other robot. It starts again at the place of delivery, and the station gives
    // it the orders that it has not given yet.
    kill_process(pid(second.pid()), Signal::KILL).expect("it runs");
    second.wait();
    let second = robot("r2");
    wait_for("what the station told the first", || {
        said(&first, "DELIVERED goods 2").then_some(())
    });
    wait_for("what it told the second", || {
        said(&second, "DELIVERED goods 1").then_some(())
    });
    assert!(!said(&first, "goods 3") && !said(&second, "goods 2"));
}

#[test]
fn a_second_robot_joins_the_station_of_the_first_or_says_why_not() {
    let domain = Domain::among_others();
    let up = |name, warehouse| {
        let args = ["--name", name, "up", "--headless", "--warehouse", warehouse];
        let up = domain.start(&args);
        let told = wait_for("it to tell of its station", || {
            let told = up.output() + &up.log();
            let line = told
                .lines()
                .find(|line| line.contains("external computer"))?;
            Some(line.to_owned())
        });
        wait_for("it to have its warehouse", || {
            up.output().contains("drives from").then_some(())
        });
        (up, told)
    };
    let (first, told) = up("r1", "small");
    assert!(told.contains("listens at 127.0.0.1:"), "{told}");
    let has_usual = told.contains("listens at 127.0.0.1:7420");
    let (second, told) = up("r2", "small");
    // If another program has the usual port, each robot has a station of its own.
    assert_eq!(told.contains("that of robot `r1`"), has_usual, "{told}");
    assert_eq!(second.service("station").is_none(), has_usual);
    let (third, told) = up("r3", "curved");
    let has_own = told.contains("since 127.0.0.1:7420 is not free");
    assert!(has_own || !has_usual, "{told}");

    // A killed station has a successor at the same address.
    let station = first.service("station").expect("it runs");
    kill_process(pid(station), Signal::KILL).expect("it runs");
    wait_for("its successor", || {
        first.service("station").filter(|next| *next != station)
    });
    drop((third, second, first));
    domain.assert_clean();
}
