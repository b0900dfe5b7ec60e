//! One person drives, anybody stops.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use tungstenite::Message;

use crate::scene::{Running, WATCHDOG};

#[test]
fn a_stop_counts_however_much_is_said_and_a_flood_of_them_closes_the_page() {
    let panel = Running::new();
    let robot = panel.robot("r1");
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    for number in 0..5_000 {
        let line = match number {
            ..200 => format!("keep r1 {number}"),
            _ => format!("stop r1 {number}"),
        };
        if page.0.send(Message::text(line)).is_err() {
            break;
        }
    }
    while page.line("answer ").is_some() {}
    let stops = || {
        let told = robot.0.lock().unwrap();
        told.iter().filter(|line| line.starts_with("stop ")).count()
    };
    let end = Instant::now() + WATCHDOG;
    while stops() == 0 {
        assert!(Instant::now() < end, "no stop has come");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_stop_that_the_robot_has_and_does_not_answer_is_not_told_as_refused() {
    let panel = Running::new();
    let mut robot = TcpStream::connect(panel.station).unwrap();
    writeln!(robot, "lager 1 r1").unwrap();
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    page.say("stop r1 1");
    let mut told = BufReader::new(robot).lines().map_while(Result::ok);
    assert!(told.any(|line| line.starts_with("stop ")));
    drop(told);
    assert_eq!(
        page.line("answer 1").unwrap(),
        "answer 1 lost the robot does not answer"
    );
}

#[test]
fn what_moves_a_robot_or_how_it_drives_is_its_drivers_while_there_is_one() {
    let panel = Running::new();
    let robot = panel.robot("r1");
    let (mut anna, mut bo) = (panel.own_page(), panel.own_page());
    anna.line("about r1 connected=1 speaks=1").unwrap();
    anna.say("take r1 1");
    assert_eq!(anna.line("answer 1").unwrap(), "answer 1 done");
    let hers = [
        "resume 7",
        "mode manual",
        "pick auto",
        "picked",
        "picked force",
        "reset",
        "place 0 0 right",
        "gains 2 2",
        "calibrate",
    ];
    // His clock runs fast, so nothing comes late.
    for (number, action) in (1..).zip(hers) {
        bo.say(&format!("do r1 {number} {number}000 {action}"));
        let answer = bo.line(&format!("answer {number}")).unwrap();
        assert!(
            answer.contains("drives the robot; ask first"),
            "{action}: {answer}"
        );
    }
    assert_eq!(robot.told(), [""; 0]);
    for (number, action) in (20..).zip(["order 5 1", "cancel 5", "obstacle put 0 0 up"]) {
        bo.say(&format!("do r1 {number} {number}000 {action}"));
        assert_eq!(
            bo.line(&format!("answer {number}")).unwrap(),
            format!("answer {number} done")
        );
    }
    // Without a driver they are anybody's; but nobody takes a robot by hand without its wheel.
    anna.say("free r1 2");
    assert_eq!(anna.line("answer 2").unwrap(), "answer 2 done");
    bo.say("do r1 29 29000 mode manual");
    assert_eq!(
        bo.line("answer 29").unwrap(),
        "answer 29 refused take the wheel first"
    );
    for (number, action) in (30..).zip(hers.into_iter().filter(|action| *action != "mode manual")) {
        bo.say(&format!("do r1 {number} {number}000 {action}"));
        assert_eq!(
            bo.line(&format!("answer {number}")).unwrap(),
            format!("answer {number} done")
        );
    }
}

#[test]
fn what_moves_a_robot_is_refused_when_it_was_held_up_on_the_way() {
    let panel = Running::new();
    let robot = panel.robot("r1");
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    page.say("take r1 1");
    assert_eq!(page.line("answer 1").unwrap(), "answer 1 done");
    // The page's clock counts from when it was opened: what it says here was never quicker.
    page.say("here 10000");
    page.say("do r1 2 10010 drive 2");
    assert_eq!(page.line("answer 2").unwrap(), "answer 2 done");
    // It comes at the same moment as one that was said half a second later, so it lay somewhere.
    page.say("do r1 3 9500 drive 4");
    let answer = page.line("answer 3").unwrap();
    assert!(
        answer.starts_with("answer 3 refused came ") && answer.contains(" ms late"),
        "{answer}"
    );
    for (number, action) in (10..).zip(["arm F1", "picked", "reset", "place 0 0 up"]) {
        page.say(&format!("do r1 {number} 9500 {action}"));
        let answer = page.line(&format!("answer {number}")).unwrap();
        assert!(answer.contains(" ms late"), "{action}: {answer}");
    }
    // To stand it is never too late, and what moves nothing may take its time.
    page.say("do r1 5 1 drive 1");
    assert_eq!(page.line("answer 5").unwrap(), "answer 5 done");
    page.say("do r1 6 9500 gains 2 2");
    assert_eq!(page.line("answer 6").unwrap(), "answer 6 done");
    let told = robot.told();
    assert_eq!(
        told,
        ["drive 00000010 150", "drive 00000001 150", "gains 2 2"]
    );
}

#[test]
fn the_wheel_is_handed_over_when_its_driver_says_so() {
    let panel = Running::new();
    let _robot = panel.robot("r1");
    let (mut anna, mut bo, mut cy) = (panel.own_page(), panel.own_page(), panel.own_page());
    anna.line("about r1 connected=1 speaks=1").unwrap();
    anna.say("take r1 1");
    assert_eq!(anna.line("answer 1").unwrap(), "answer 1 done");
    let named = anna
        .line("about r1 connected=1 speaks=1 driver=panel-")
        .unwrap();
    bo.say("keep r1 1");
    assert!(
        bo.line("answer 1")
            .unwrap()
            .contains("take the wheel first")
    );

    // Anna is asked and keeps it.
    bo.say("take r1 2");
    let asked = anna.line(&format!(
        "{} asks=panel-",
        named.split(" uses").next().unwrap()
    ));
    assert!(asked.is_some());
    cy.say("take r1 1");
    assert!(
        cy.line("answer 1")
            .unwrap()
            .contains("has asked for the wheel before")
    );
    anna.say("keep r1 2");
    assert_eq!(anna.line("answer 2").unwrap(), "answer 2 done");
    assert!(bo.line("answer 2").unwrap().ends_with("keeps the wheel"));

    // She is asked again and hands it over; whoever did not ask does not come between.
    bo.say("take r1 3");
    anna.line(&format!(
        "{} asks=panel-",
        named.split(" uses").next().unwrap()
    ))
    .unwrap();
    anna.say("free r1 3");
    assert_eq!(bo.line("answer 3").unwrap(), "answer 3 done");

    // A driver whose page is gone has handed over, too; so has one whose asker is gone nobody to
    // ask.
    cy.say("take r1 2");
    bo.line("about r1 connected=1 speaks=1 driver=panel-2 asks=panel-3")
        .unwrap();
    drop(bo);
    assert_eq!(cy.line("answer 2").unwrap(), "answer 2 done");
    anna.say("take r1 4");
    cy.line("about r1 connected=1 speaks=1 driver=panel-3 asks=panel-1")
        .unwrap();
    drop(anna);
    let alone = |line: &str| line.contains("driver=panel-3") && !line.contains("asks=");
    while !alone(&cy.line("about r1").unwrap()) {}
}

#[test]
fn a_person_is_called_as_he_wants_and_no_two_open_pages_alike() {
    let panel = Running::new();
    let own = format!("http://{}", panel.host());
    let page = |name| panel.page_of(name, &own, &panel.cookie()).unwrap();
    let mut anna = page("%C3%85sa");
    assert_eq!(anna.line("you").unwrap(), crate::you("Åsa driver"));
    assert_eq!(
        page("%C3%85sa").line("you").unwrap(),
        crate::you("Åsa-2 driver")
    );
    assert_eq!(
        page("panel-1").line("you").unwrap(),
        crate::you("panel-3 driver")
    );
}
