//! Actions that move the robot.

use lager_orders::Mode;
use lager_stop::Stop;
use lager_topics::{Finish, Outcome, Refusal, Role, StopCause};

use super::{done, ended, extended, in_force, pass};
use crate::robot::Robot;

#[test]
fn a_drive_holds_as_long_as_it_is_renewed() {
    let mut robot = extended(Mode::Manual);
    let said = robot.hears(&["do 1 drive 2 150"]);
    assert_eq!(said, ["[steers 2]"], "done is what the board does");
    assert_eq!(in_force(&mut robot), ["done 1"]);
    for number in 2..10 {
        assert_eq!(pass(&mut robot, 100), [""; 0]);
        let renewal = format!("do {number} drive 2 150");
        assert_eq!(robot.hears(&[&renewal]), [""; 0]);
        assert_eq!(in_force(&mut robot), [format!("done {number}")]);
    }
    assert_eq!(pass(&mut robot, 140), [""; 0]);
    let said = pass(&mut robot, 10);
    assert_eq!(said[0], "[steers 1]", "its time is over");
    assert!(said[1].starts_with("thought the time"), "{said:?}");
    assert_eq!(pass(&mut robot, 1_000), [""; 0]);
    // Another command takes its place, and standing is one.
    robot.hears(&["do 10 drive 2 150"]);
    let said = robot.hears(&["do 11 drive 4 150"]);
    let replaced = "refused 10 another command has taken its place";
    assert_eq!(said, ["[steers 4]", replaced]);
    in_force(&mut robot);
    assert_eq!(
        robot.hears(&["do 12 drive 1 150"]),
        ["[steers 1]", "done 12"]
    );
}

#[test]
fn a_drive_has_the_speed_that_it_says_and_a_renewal_keeps_it() {
    let mut robot = extended(Mode::Manual);
    let steered = |robot: &Robot| robot.steered.map(|(_, code)| code);
    // 0x12 is slowly forward to the board.
    assert_eq!(robot.hears(&["do 1 drive 2 slow 150"]), ["[steers 18]"]);
    assert_eq!(in_force(&mut robot), ["done 1"]);
    assert_eq!(pass(&mut robot, 100), [""; 0]);
    assert_eq!(robot.hears(&["do 2 drive 2 slow 150"]), [""; 0]);
    assert_eq!(in_force(&mut robot), ["done 2"]);
    assert_eq!(pass(&mut robot, 100), [""; 0]);
    assert_eq!(steered(&robot), Some(0x12), "what was renewed");
    // Another speed is another command, and none is left over from the one before.
    assert_eq!(robot.hears(&["do 3 drive 2 middle 150"]), ["[steers 34]"]);
    assert_eq!(
        robot.hears(&["do 4 drive 2 150"]),
        [
            "[steers 2]",
            "refused 3 another command has taken its place"
        ]
    );
    assert_eq!(in_force(&mut robot), ["done 4"]);
    let said = pass(&mut robot, 150);
    assert_eq!(said[0], "[steers 1]", "its time is over");
}

#[test]
fn a_drive_ends_with_the_link_and_is_refused_where_logic_steers() {
    let mut robot = extended(Mode::Manual);
    robot.hears(&["do 1 drive 2 1000"]);
    assert_eq!(robot.disconnect(), ["[steers 1]"]);
    assert_eq!(robot.pass(500), [""; 0]);

    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 1 drive 2 100"]);
    assert!(
        said[0].starts_with("refused 1 somebody else steers"),
        "{said:?}"
    );
    // To let it stand as well, which logic would not heed.
    let said = robot.hears(&["do 3 drive 1 100"]);
    assert!(
        said[0].starts_with("refused 3 somebody else steers"),
        "{said:?}"
    );
    assert_eq!(robot.steered, None);
    robot.mode(Mode::Manual);
    robot.health.blocked = Refusal::BoardSilent.into();
    robot.told();
    let said = robot.hears(&["do 4 drive 2 100"]);
    let why = "refused 4 forward is not possible now: the steering board";
    assert!(said[0].starts_with(why), "{said:?}");
}

#[test]
fn a_turn_and_a_step_of_the_arm_are_done_when_they_have_ended() {
    let mut robot = extended(Mode::Manual);
    assert_eq!(robot.hears(&["do 1 drive 8 100"]), ["[steers 8]"]);
    assert_eq!(in_force(&mut robot), [""; 0]);
    assert_eq!(pass(&mut robot, 500), [""; 0], "it needs no renewal");
    let said = ended(&mut robot, Finish::Done);
    assert_eq!(said, ["done 1", "styrcomm"]);
    robot.hears(&["do 2 arm F3"]);
    let said = ended(&mut robot, Finish::Aborted);
    assert!(
        said[0].starts_with("refused 2 in was cut short"),
        "{said:?}"
    );
    // Where the bridge does not say why it was refused, the board has.
    robot.hears(&["do 3 arm F3"]);
    assert_eq!(ended(&mut robot, Finish::Refused), [""; 0]);
    let said = pass(&mut robot, 50);
    assert!(
        said[0].starts_with("refused 3 in is refused by"),
        "{said:?}"
    );
}

#[test]
fn nothing_undoes_a_stop_that_comes_with_it_or_after_it() {
    let mut robot = extended(Mode::Manual);
    let said = robot.hears(&["do 1 resume 7", "do 2 drive 2 100", "stop 3"]);
    assert_eq!(said[0], "[stops]");
    assert!(said[1].starts_with("refused 1 a stop has come"), "{said:?}");
    assert!(said[2].starts_with("refused 2 a stop has come"), "{said:?}");

    // A stop that comes while a release is under way is another one than the release names.
    let [older, newer] = [1_000, 2_000].map(|at_ns| {
        let stop = Stop::new(Role::Operator, StopCause::Ordered, at_ns);
        stop.word()
    });
    robot.health.stopped = 1;
    robot.health.stop_word = older;
    robot.told();
    let said = robot.hears(&[&format!("do 4 resume {older}")]);
    assert_eq!(said, ["[asks Resume]"]);
    let (id, ask) = robot.asked.expect("a request");
    assert_eq!(ask.stop_word, older);
    assert_eq!(robot.hears(&["stop 5"]), ["[stops]"]);
    robot.health.stop_word = newer;
    robot.told();
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Refused));
    let why = "refused 4 a newer stop is set (it was ordered); look at the robot";
    let said = robot.done();
    assert!(said[0].starts_with(why), "{said:?}");
    // What names another one than is in force is not even asked.
    let said = robot.hears(&[&format!("do 6 resume {older}")]);
    assert!(said[0].starts_with("refused 6 a newer stop"), "{said:?}");
    // Nor does a new connection end it.
    robot.hears(&[&format!("do 7 resume {newer}")]);
    let (id, _) = robot.asked.expect("a request");
    robot.disconnect();
    robot.connect();
    assert_eq!(robot.hears(&["lager 1 station", "stop 1"])[0], "[stops]");
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    assert_eq!(robot.done(), [""; 0]);
}
