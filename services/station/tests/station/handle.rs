//! What other threads do with the station, over real sockets.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_lines::command::read_wheels;
use lager_orders::{Action, Mode};
use lager_plant::Warehouse;
use lager_station::{Handle, Reply, Saving, Saying, Subscription, Wish, WishRefused};

use crate::sockets::{Peer, Running, WATCHDOG};
use crate::transcript::{product, warehouse};

fn r1() -> Name {
    Name::new("r1").expect("a name")
}

/// A robot that speaks the extension.
fn extended(station: &Running) -> Peer<TcpStream> {
    let mut robot = station.robot();
    assert_eq!(robot.asks("lager 1 r1"), "lager 1 lager");
    robot
}

/// Waits until the station has this of the robot.
fn wait_for<R>(handle: &Handle, what: impl Fn(&lager_station::View) -> Option<R>) -> R {
    let start = Instant::now();
    let mut seen = 0;
    loop {
        let robots = handle.robots();
        if let Some(found) = robots.iter().find(|one| one.name == r1()).and_then(&what) {
            return found;
        }
        assert!(start.elapsed() < WATCHDOG, "{robots:?}");
        seen = handle.wait(seen, Duration::from_millis(100));
    }
}

#[test]
fn an_action_is_awaited_and_a_stop_confirmed() {
    let station = Running::new();
    let mut robot = extended(&station);
    let handle = &station.handle;
    let asked = handle
        .act(&r1(), Action::Mode(Mode::Manual))
        .expect("asked");
    assert_eq!(robot.hears().as_deref(), Some("do 1 mode manual"));
    assert_eq!(asked.wait(Duration::ZERO), None);
    robot.says(b"done 1\n");
    assert_eq!(asked.wait(WATCHDOG), Some(Reply::Done));

    let stopped = handle.stop(&r1()).expect("told").expect("confirmed");
    assert_eq!(robot.hears().as_deref(), Some("stop 2"));
    robot.says(b"stopped 2 17\n");
    assert_eq!(
        stopped.wait(WATCHDOG),
        Some(Reply::Stopped { after_ms: 17 })
    );

    let asked = handle.act(&r1(), Action::Calibrate).expect("asked");
    drop(robot);
    assert_eq!(asked.wait(WATCHDOG), Some(Reply::Lost));
}

#[test]
fn a_driver_is_named_and_the_robot_stands_when_he_is_gone() {
    let station = Running::new();
    let mut robot = extended(&station);
    let handle = &station.handle;
    let anna = handle.take_wheel(&r1(), "anna").expect("the seat is free");
    let refused = handle.take_wheel(&r1(), "bo").expect_err("it is taken");
    assert!(refused.to_string().starts_with("anna drives"), "{refused}");
    let driver = wait_for(handle, |view| view.driver.clone());
    assert_eq!(driver, "anna");
    let driven = anna
        .drive(read_wheels("2").expect("a code"))
        .expect("asked");
    assert_eq!(robot.hears().as_deref(), Some("do 1 drive 00000010 150"));
    robot.says(b"refused 1 forward is refused: it rains\n");
    let why = driven.wait(WATCHDOG);
    assert!(matches!(&why, Some(Reply::Refused(why)) if why.as_str().ends_with("it rains")));
    drop(anna);
    assert_eq!(robot.hears().as_deref(), Some("do 2 drive 00000001 150"));
    handle.take_wheel(&r1(), "bo").expect("the seat is free");
}

#[test]
fn a_driver_who_falls_silent_is_found_while_nothing_else_happens() {
    let station = Running::new();
    let mut robot = extended(&station);
    let anna = station.handle.take_wheel(&r1(), "anna").expect("free");
    anna.drive(read_wheels("3").expect("a code"))
        .expect("asked");
    assert_eq!(robot.hears().as_deref(), Some("do 1 drive 00000011 150"));
    assert_eq!(robot.hears().as_deref(), Some("do 2 drive 00000001 150"));
    assert!(anna.stay().is_err());
}

#[test]
fn states_come_with_their_age_and_events_to_whoever_has_subscribed() {
    let station = Running::new();
    let handle = &station.handle;
    let news = handle.subscribe();
    let mut robot = extended(&station);
    robot.says(b"state x_mm=400\nevent next_node 1 0 - -\nthought hej\nstate x_mm=410\n");
    let view = wait_for(handle, |view| {
        let state = view.shown.state.as_ref()?;
        (state.value.x_mm == Some(410)).then(|| view.clone())
    });
    assert!(view.is_extended);
    let age = |handle: &Handle| {
        let view = handle.robots().pop().expect("a robot");
        view.shown.state.expect("a state").age(view.now)
    };
    let before = age(handle);
    std::thread::sleep(Duration::from_millis(20));
    assert!(age(handle) >= before + Duration::from_millis(20));

    let told = [(); 2].map(|()| news.next(WATCHDOG).expect("news"));
    assert!(told.iter().all(|news| news.robot == r1()));
    assert!(matches!(told[0].told, Saying::Event(_)), "{told:?}");
    assert!(matches!(&told[1].told, Saying::Thought(text) if text.as_str() == "hej"));
    assert_eq!(news.next(Duration::ZERO), None);

    // Whoever comes later can have what was said before, with its time.
    let later = handle.recall();
    let recalled = [(); 2].map(|()| later.next(WATCHDOG).expect("news"));
    assert_eq!(recalled, told);
    assert!(recalled[0].at < handle.now());
    assert_eq!(later.next(Duration::ZERO), None);

    // One that takes nothing loses, is told how much, and keeps nobody waiting.
    let thoughts = b"thought tick\n".repeat(Subscription::MOST + 10);
    robot.says(&thoughts);
    assert_eq!(robot.asks("karta"), "karta 4 3 0 0");
    assert_eq!(news.lost(), 10);
    let late = handle.recall();
    for _ in 0..Subscription::KEPT {
        assert!(late.next(Duration::ZERO).is_some());
    }
    assert_eq!(late.next(Duration::ZERO), None);
}

#[test]
fn goods_that_a_robot_has_seen_to_be_gone_are_not_ordered_from_it() {
    let station = Running::new();
    let handle = &station.handle;
    let mut robot = extended(&station);
    let fetch = |number| handle.wish(&r1(), Wish::Fetch(product(number)));
    robot.says(b"gone 1 7\nstate product=12\n");
    wait_for(handle, |view| view.shown.state.as_ref().map(drop));
    let why = |refused: Result<(), WishRefused>| refused.expect_err("it is refused").to_string();
    assert_eq!(
        why(fetch(7)),
        "goods 7 are not in their place, as robot r1 has seen; put them back and \
         say that they are there"
    );
    assert_eq!(why(fetch(12)), "goods 12 are ordered already");
    robot.says(b"gone 0\nstate product=12\n");
    wait_for(handle, |view| {
        let gone = view.shown.gone.as_ref()?;
        (gone.value.total() == 0).then_some(())
    });
    fetch(7).expect("it is back");
}

/// What a page is told of a warehouse that is saved, as one sentence.
fn told(saving: &Saving) -> String {
    let told: Vec<_> = saving.told().map(|told| told.to_string()).collect();
    told.join("; ")
}

#[test]
fn who_saves_a_warehouse_is_told_what_a_robot_does_that_knows_another_one() {
    let station = Running::new();
    let handle = &station.handle;
    let save = |warehouse: &Warehouse| {
        let saving = handle.set_warehouse(warehouse.clone()).expect("it can be");
        assert_eq!(saving.wait(WATCHDOG), Some(Ok(())));
        let sentence = told(&saving);
        let saved = format!(
            "saved in {}",
            station.folder().join("warehouse.toml").display()
        );
        assert!(sentence.starts_with(&saved), "{sentence}");
        sentence[saved.len()..].to_owned()
    };
    let mut changed = warehouse();
    changed.products.pop();
    assert_eq!(save(&changed), "", "there is no robot");

    let mut robot = extended(&station);
    for (query, answer) in [
        ("sidelength", "sidelength 40"),
        ("karta", "karta 4 3 0 0"),
        ("prodlis", "prodlis 1 7 1 0 down"),
    ] {
        assert_eq!(robot.asks(query), answer);
    }
    assert_eq!(save(&changed), "; r1 uses it");
    changed.side_length_cm = 60;
    assert_eq!(
        save(&changed),
        "; r1 still uses the earlier floor, until it is put on the delivery node and \
         started again"
    );
    robot.says(b"truth 0 0 90 -\n");
    wait_for(handle, |view| view.shown.truth.as_ref().map(drop));
    assert_eq!(
        save(&changed),
        "; r1 is simulated and still drives in the earlier warehouse, until it is \
         started again"
    );
}

#[test]
fn a_real_robot_asks_for_goods_that_have_changed() {
    let station = Running::new();
    let mut robot = extended(&station);
    for query in ["sidelength", "karta", "prodlis"] {
        robot.asks(query);
    }
    let mut changed = warehouse();
    changed.products.pop();
    let saving = station.handle.set_warehouse(changed).expect("it can be");
    let sentence = told(&saving);
    assert!(
        sentence.ends_with("; r1 is told where the goods are"),
        "{sentence}"
    );
    assert_eq!(robot.hears(), None, "it is to connect anew");
    let mut robot = extended(&station);
    assert_eq!(robot.asks("prodlis"), "prodlis 1 7 1 0 down");
}
