//! Tests that a simulated robot stands, stopped, when it is put into the warehouse that was saved.

use std::fs;

use lager_orders::Mode;
use lager_ports::Subscriber;
use lager_stop::{Stop, StopWord};
use lager_tests::{Domain, Running, wait_for};
use lager_topics::{LinkHealth, NavStatus};
use rustix::process::Signal;

use crate::{interrupt, service, start, wait_until_up};

const HALL: &str = "size = [2, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 2\nsquare = [1, 1]\nside = \"right\"\n";

/// Has `up` put the robot into the warehouse that is saved, as its own station does.
fn renew(up: &Running) {
    up.signal(Signal::USR1);
}

/// The stop of the robot, whether a bridge runs or not.
fn stop_of(domain: &Domain) -> Option<Stop> {
    let word = StopWord::read(&domain.bus_folder().join("r1/stop"));
    word.expect("readable")?.stop()
}

#[test]
fn a_robot_that_gets_another_world_stands_whatever_happens_meanwhile() {
    let domain = Domain::new();
    let saved = domain.folder().join("hall.toml");
    let save = |text: &str| fs::write(&saved, text).expect("a file");
    save(HALL);
    let file = saved.to_string_lossy().into_owned();
    let args = [
        "up",
        "--headless",
        "--listen",
        "127.0.0.1:0",
        "--warehouse",
        &file,
        "--mission",
        "2",
    ];
    let mut up = start(&domain, &args);

    // Somebody has made the file unfit since the station has looked: it stands where it is.
    let logic = service(&mut up, "logic", None);
    assert_eq!(stop_of(&domain), None);
    // `up` hears of an order a moment after the robot.
    let kept = domain.bus_folder().join(".state/r1/orders.toml");
    wait_for("the order to be kept", || {
        let text = fs::read_to_string(&kept).ok()?;
        text.contains("product = 2").then_some(())
    });
    save("size = [2, 2");
    renew(&up);
    wait_for("the reason", || {
        let told = up.output();
        told.contains("goes on with what it had: ").then_some(())
    });
    let first = stop_of(&domain).expect("it is stopped");
    assert_eq!(
        up.service("logic"),
        Some(logic),
        "nothing was started again"
    );

    // A person has stopped it, two people ask at once, and goods 2 are no more.
    domain.done(&["stop"]);
    save(&HALL.replace("id = 2", "id = 5").replace("[0, 0]", "[2, 0]"));
    let bridge = service(&mut up, "bridge", None);
    renew(&up);
    renew(&up);
    service(&mut up, "bridge", Some(bridge));
    wait_until_up(&domain, &mut up);
    let observer = domain.observe("r1", 1.0);
    let mut health: Subscriber<LinkHealth> = observer.subscriber().expect("a topic");
    let mut status: Subscriber<NavStatus> = observer.subscriber().expect("a topic");
    let said = wait_for("the bridge", || health.latest().expect("readable"));
    assert_eq!(said.stopped, 1, "{said:?}");
    // Once a person releases the stop, it takes orders as at its first start.
    wait_for("the mode", || {
        let said = health.latest().expect("readable")?;
        assert_eq!(said.stopped, 1);
        (said.mode == Mode::Autonomous).then_some(())
    });
    wait_for("its place", || {
        let status = status.latest().expect("readable")?;
        ((status.x, status.y) == (2, 0)).then_some(())
    });
    assert!(
        up.output().contains("the order for goods 2 is dropped"),
        "{}",
        up.output()
    );
    // Nobody who has released the stop of before releases this one.
    assert_ne!(stop_of(&domain), Some(first));
    drop((health, status, observer));

    // `up` dies in the middle of it: the next one stands, too.
    domain.done(&["resume"]);
    wait_for("the resume", || stop_of(&domain).is_none().then_some(()));
    renew(&up);
    wait_for("the stop", || stop_of(&domain));
    up.signal(Signal::KILL);
    up.wait();
    let mut up = start(&domain, &args[..6]);
    assert!(stop_of(&domain).is_some());
    interrupt(&mut up, 0);
}

#[test]
fn a_robot_that_cannot_get_another_world_is_stopped_and_says_why() {
    let domain = Domain::new();
    let mut up = start(
        &domain,
        &["up", "--headless", "--mission", "1", "--exit-when-done"],
    );
    renew(&up);
    wait_for("the reason", || {
        up.output()
            .contains("goes on with what it had: ")
            .then_some(())
    });
    assert!(stop_of(&domain).is_some());
    interrupt(&mut up, 3);
}
