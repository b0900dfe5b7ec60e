//! The commissioning of the robot: one at a time, an answer only to what is asked, and nothing late.

use lager_lines::extension::Report;
use lager_orders::Mode;

use super::{extended, pass};
use crate::robot::Robot;

/// The process tells this.
fn tells(robot: &mut Robot, line: &str) {
    let report = Report::read(line).expect("a report").expect("a right one");
    robot.conversation.commission_told(report);
}

/// A robot whose commissioning asks this as number 3.
fn asks(how: &str) -> Robot {
    let mut robot = extended(Mode::Manual);
    assert_eq!(
        robot.hears(&["do 1 commission begin"]),
        ["[commission begin]", "done 1"]
    );
    tells(&mut robot, &format!("commission asked=3 step=turn {how}"));
    robot
}

/// What the station was told of it since the last look.
fn told(robot: &mut Robot) -> Vec<String> {
    pass(robot, 100);
    let mut shown = core::mem::take(&mut robot.shown);
    shown.retain(|line| {
        ["commission", "found", "kept"]
            .iter()
            .any(|word| line.starts_with(word))
    });
    shown
}

#[test]
fn an_answer_counts_only_for_what_is_asked() {
    let mut robot = asks("question=ask_turn takes=yes moves=0");
    for (words, answer) in [
        ("answer 2 yes", "refused 2 the robot asks for it again"),
        ("answer 4 yes", "refused 3 the robot asks for it again"),
        (
            "begin",
            "refused 4 there are too many requests at a time; try again",
        ),
        (
            "undo",
            "refused 5 there are too many requests at a time; try again",
        ),
        (
            "restart",
            "refused 6 there are too many requests at a time; try again",
        ),
    ] {
        let number = answer.split(' ').nth(1).expect("a number");
        let said = robot.hears(&[&format!("do {number} commission {words}")]);
        assert_eq!(said, [answer]);
    }
    let said = robot.hears(&["do 7 commission answer 3 yes"]);
    assert_eq!(said, ["[commission answer 3 yes]", "done 7"]);
    // While something must happen first, nothing is an answer.
    tells(&mut robot, "commission step=turn");
    assert_eq!(
        robot.hears(&["do 8 commission answer 3 yes"]),
        ["refused 8 the robot asks for it again"]
    );
}

#[test]
fn where_none_is_at_work_nothing_but_a_beginning_is_taken() {
    let mut robot = extended(Mode::Manual);
    for (number, words) in (1..).zip(["here", "stand", "quit", "answer 0 yes"]) {
        let said = robot.hears(&[&format!("do {number} commission {words}")]);
        let refused = format!("refused {number} the robot's service commission is not running");
        assert!(said[0].starts_with(&refused), "{said:?}");
    }
    assert_eq!(
        robot.hears(&["do 9 commission undo"]),
        ["[commission undo]", "done 9"]
    );
    robot.conversation.commission_over(None);
    assert_eq!(
        robot.hears(&["do 10 commission restart"]),
        ["[commission restart]", "done 10"]
    );
    robot.conversation.commission_over(None);
    assert_eq!(
        robot.hears(&["do 11 commission begin"]),
        ["[commission begin]", "done 11"]
    );
}

#[test]
fn what_may_move_the_robot_is_refused_when_it_comes_late_and_an_end_is_not() {
    let mut robot = asks("question=ask_turn takes=yes moves=0");
    for (number, words) in [(2, "answer 3 yes"), (3, "here")] {
        let said = robot.hears(&[&format!("do {number} late 201 commission {words}")]);
        assert!(
            said[0].starts_with(&format!("refused {number} came 201 ms late")),
            "{said:?}"
        );
    }
    let said = robot.hears(&["do 4 late 200 commission answer 3 yes"]);
    assert_eq!(said, ["[commission answer 3 yes]", "done 4"]);
    assert_eq!(
        robot.given_ns,
        robot.now.ns - 200_000_000,
        "its age is handed on"
    );
    let said = robot.hears(&[
        "do 5 late 60000 commission stand",
        "do 6 late 60000 commission quit",
    ]);
    assert_eq!(
        said,
        [
            "[commission stand]",
            "done 5",
            "[commission quit]",
            "done 6"
        ]
    );
}

#[test]
fn a_lost_link_makes_it_stand_and_a_silent_station_is_lost_as_soon_as_while_somebody_drives() {
    let mut robot = asks("question=ask_turn_round takes=yes moves=1");
    robot.done();
    assert!(
        !robot.pass(140).contains(&"[hangs up]".into()),
        "150 ms are allowed"
    );
    let said = robot.pass(40);
    assert!(
        said.ends_with(&["[commission stand]".into(), "[hangs up]".into()]),
        "{said:?}"
    );
}

#[test]
fn each_station_is_told_how_far_it_is_and_how_it_ended() {
    let mut robot = extended(Mode::Manual);
    assert_eq!(told(&mut robot), ["commission", "found 0"]);
    robot.hears(&["do 1 commission begin"]);
    tells(
        &mut robot,
        "commission asked=1 step=boards question=ask_boards takes=yes moves=0",
    );
    tells(&mut robot, "found 1 line found_polarity_low");
    let now = [
        "commission asked=1 step=boards question=ask_boards takes=yes moves=0",
        "found 1 line found_polarity_low",
    ];
    assert_eq!(told(&mut robot), now);
    assert_eq!(told(&mut robot), [""; 0], "nothing is new");
    robot.disconnect();
    robot.connect();
    robot.hears(&["lager 1 station"]);
    assert_eq!(told(&mut robot), now);
    tells(&mut robot, "kept 1 2 [wheels]");
    tells(&mut robot, "kept 2 2 swapped = true");
    tells(&mut robot, "commission ended=ended_kept%20robot.toml");
    robot.conversation.commission_over(None);
    assert_eq!(
        told(&mut robot),
        [
            "commission ended=ended_kept%20robot.toml",
            "kept 1 2 [wheels]",
            "kept 2 2 swapped = true"
        ]
    );
}

#[test]
fn one_that_ends_without_a_word_was_broken_off() {
    let mut robot = asks("question=ask_turn takes=yes moves=0");
    told(&mut robot);
    robot.conversation.commission_over(None);
    assert_eq!(
        told(&mut robot),
        ["commission ended=not_running%20commission"]
    );
}
