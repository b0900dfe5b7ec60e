//! What robots are told, and when.

use lager_station::{CommandRefused, Doing, FetchRefused, Robot};
use lager_wire::OperatorCommand;

use crate::transcript::{connected, product, say, warehouse, written};

/// A robot that has asked about its warehouse and waits to be told what to fetch.
fn idle() -> Robot {
    let mut robot = connected();
    for (line, answer) in [
        ("sidelength", "sidelength 40"),
        ("karta", "karta 4 3 0 0"),
        ("prodlist", "prodlist 2 7 1 0 down 12 0 1 left"),
        ("fetchprod", ""),
    ] {
        assert_eq!(say(&mut robot, line), answer);
    }
    assert_eq!(robot.doing(), Doing::Idle);
    robot
}

fn by_hand() -> Robot {
    let mut robot = connected();
    assert_eq!(say(&mut robot, "styrcomm"), "");
    robot
}

fn give(robot: &mut Robot, code: u8) -> Result<String, CommandRefused> {
    let command = OperatorCommand::from_code(code).expect("a command");
    robot.command(command).map(written)
}

#[test]
fn a_product_is_fetched_picked_by_hand_and_delivered() {
    let mut robot = idle();
    assert_eq!(
        robot.fetch(product(7)).map(written),
        Ok("fetchprod 7".into())
    );
    assert_eq!(
        (robot.doing(), robot.told()),
        (Doing::Fetching, Some(product(7)))
    );
    assert_eq!(robot.fetch(product(12)).map(written), Ok(String::new()));

    assert_eq!(say(&mut robot, "set_robot 1 0"), "");
    assert_eq!(say(&mut robot, "set_heading right"), "");
    assert_eq!(robot.node().map(|node| (node.x, node.y)), Some((1, 0)));
    assert_eq!(robot.picked_up(), Err(CommandRefused::NotPicking));

    assert_eq!(say(&mut robot, "armcomm"), "");
    assert_eq!(robot.doing(), Doing::Picking);
    assert_eq!(give(&mut robot, 0xF4), Ok("armcomm 11110100".into()));
    assert_eq!(
        give(&mut robot, 0xF9),
        Ok(String::new()),
        "it has not asked again"
    );
    assert_eq!(robot.picked_up().map(written), Ok(String::new()));
    assert_eq!(say(&mut robot, "armcomm"), "armcomm 11111001");
    assert_eq!(say(&mut robot, "armcomm"), "pickup_done");
    assert_eq!(robot.doing(), Doing::Fetching);

    assert_eq!(say(&mut robot, "fetchprod"), "fetchprod 12");
    assert_eq!(robot.queue().count(), 0);
}

#[test]
fn what_is_not_known_yet_is_answered_when_it_is() {
    let mut robot = Robot::default();
    robot.connected();
    assert_eq!(say(&mut robot, "karta"), "");
    let line = robot.set_warehouse(&warehouse()).map(written);
    assert_eq!(line, Ok("karta 4 3 0 0".into()));
    assert_eq!(
        say(&mut robot, "prodlis"),
        "prodlis 2 7 1 0 down 12 0 1 left"
    );
}

#[test]
fn commands_are_given_one_at_a_time_in_their_order() {
    let mut robot = by_hand();
    assert_eq!(give(&mut robot, 2), Ok("styrcomm 00000010".into()));
    for code in [8, 0xF3, 6] {
        assert_eq!(give(&mut robot, code), Ok(String::new()));
    }
    assert_eq!(say(&mut robot, "styrcomm"), "styrcomm 00001000");
    assert_eq!(say(&mut robot, "styrcomm"), "armcomm 11110011");
    assert_eq!(say(&mut robot, "armcomm"), "styrcomm 00000110");
    assert_eq!(say(&mut robot, "styrcomm"), "");
}

#[test]
fn commands_that_wait_are_bounded() {
    let mut robot = by_hand();
    assert_eq!(give(&mut robot, 2), Ok("styrcomm 00000010".into()));
    for _ in 0..Robot::MOST_COMMANDS {
        assert_eq!(give(&mut robot, 6), Ok(String::new()));
    }
    assert_eq!(give(&mut robot, 6), Err(CommandRefused::Full));
    assert_eq!(robot.commands().count(), Robot::MOST_COMMANDS);
    assert_eq!(
        CommandRefused::Full.to_string(),
        "32 commands wait already; wait until the robot has taken some, or stop it"
    );
}

#[test]
fn a_stop_is_the_next_thing_that_the_robot_is_told_and_the_last_one() {
    let mut robot = by_hand();
    assert_eq!(give(&mut robot, 2), Ok("styrcomm 00000010".into()));
    for _ in 0..Robot::MOST_COMMANDS {
        assert_eq!(give(&mut robot, 6), Ok(String::new()));
    }
    assert_eq!(
        robot.stop().map(|(_, line)| written(line)),
        Ok(String::new())
    );
    assert_eq!(say(&mut robot, "styrcomm"), "styrcomm 00000001");
    assert_eq!(say(&mut robot, "styrcomm"), "");
    assert_eq!(
        robot.stop().map(|(_, line)| written(line)),
        Ok("styrcomm 00000001".into()),
        "it is asked for"
    );
}

#[test]
fn a_stop_has_a_lane_of_its_own_where_the_extension_is_spoken() {
    let mut robot = connected();
    assert_eq!(
        robot.stop(),
        Err(CommandRefused::NotAsked),
        "nobody can be told"
    );
    assert_eq!(say(&mut robot, "lager 1 r1"), "");
    assert_eq!(robot.name().map(|name| name.as_str()), Some("r1"));
    assert_eq!(
        robot.stop().map(|(_, line)| written(line)),
        Ok("stop 1".into())
    );

    assert_eq!(say(&mut robot, "styrcomm"), "");
    assert_eq!(give(&mut robot, 2), Ok("styrcomm 00000010".into()));
    assert_eq!(give(&mut robot, 6), Ok(String::new()));
    assert_eq!(
        robot.stop().map(|(_, line)| written(line)),
        Ok("stop 2".into()),
        "without being asked"
    );
    assert_eq!(robot.commands().count(), 0);
}

#[test]
fn no_old_command_moves_the_robot_later() {
    for leave in ["fetchprod", "karta", "disconnect"] {
        let mut robot = by_hand();
        assert_eq!(give(&mut robot, 2), Ok("styrcomm 00000010".into()));
        assert_eq!(give(&mut robot, 6), Ok(String::new()));
        if leave == "disconnect" {
            robot.disconnected();
            assert_eq!(give(&mut robot, 6), Err(CommandRefused::NotAsked));
            robot.connected();
        } else {
            say(&mut robot, leave);
            assert_eq!(
                give(&mut robot, 6),
                Err(CommandRefused::NotAsked),
                "{leave}"
            );
        }
        assert_eq!(say(&mut robot, "styrcomm"), "", "{leave}");
    }
}

#[test]
fn what_was_picked_is_forgotten_with_the_pick() {
    let mut robot = connected();
    assert_eq!(say(&mut robot, "armcomm"), "");
    assert_eq!(give(&mut robot, 0xF1), Ok("armcomm 11110001".into()));
    assert_eq!(robot.picked_up().map(written), Ok(String::new()));
    assert_eq!(say(&mut robot, "styrcomm"), "", "it was switched to manual");
    assert_eq!(say(&mut robot, "armcomm"), "");
}

#[test]
fn a_stop_forgets_that_the_goods_were_picked_up() {
    for hello in [None, Some("lager 1 r1")] {
        let mut robot = connected();
        hello.map(|hello| say(&mut robot, hello));
        assert_eq!(say(&mut robot, "armcomm"), "");
        assert_eq!(give(&mut robot, 0xF1), Ok("armcomm 11110001".into()));
        assert_eq!(give(&mut robot, 0xF9), Ok(String::new()));
        assert_eq!(robot.picked_up().map(written), Ok(String::new()));
        let stopped = robot.stop().map(|(_, line)| written(line));
        let next = say(&mut robot, "armcomm");
        match hello {
            None => assert_eq!(next, "styrcomm 00000001"),
            Some(_) => assert_eq!((stopped, next), (Ok("stop 1".into()), String::new())),
        }
        assert_eq!(say(&mut robot, "armcomm"), "", "it does not drive off");
    }
}

#[test]
fn a_new_question_takes_the_place_of_the_one_that_was_held() {
    let mut robot = idle();
    assert_eq!(say(&mut robot, "styrcomm"), "", "it was switched to manual");
    assert_eq!(
        robot.fetch(product(7)).map(written),
        Ok(String::new()),
        "nobody asks for it"
    );
    assert_eq!(give(&mut robot, 3), Ok("styrcomm 00000011".into()));
    assert_eq!(say(&mut robot, "fetchprod"), "fetchprod 7");
}

#[test]
fn telemetry_comes_while_a_question_is_held_and_answers_nothing() {
    let mut robot = idle();
    for line in [
        "thought jag väntar",
        "set_robot 0 0",
        "set_heading up",
        "state x_mm=5",
    ] {
        assert_eq!(say(&mut robot, line), "", "{line}");
    }
    assert_eq!(
        robot.thought().map(|text| text.as_str()),
        Some("jag väntar")
    );
    assert_eq!(robot.looks().map(|looks| looks.as_str()), Some("up"));
    let state = robot.shown().state.as_ref().expect("a state");
    assert_eq!(state.value.x_mm, Some(5));
    assert_eq!(
        robot.fetch(product(12)).map(written),
        Ok("fetchprod 12".into())
    );
}

#[test]
fn a_product_that_may_not_have_arrived_is_told_again() {
    let mut robot = idle();
    assert_eq!(
        robot.fetch(product(7)).map(written),
        Ok("fetchprod 7".into())
    );
    robot.disconnected();
    assert_eq!(robot.queue().collect::<Vec<_>>(), [product(7)]);
    robot.connected();
    assert_eq!(say(&mut robot, "fetchprod"), "fetchprod 7");

    assert_eq!(say(&mut robot, "set_robot 1 0"), "", "it is on its way");
    robot.disconnected();
    robot.connected();
    assert_eq!(say(&mut robot, "fetchprod"), "");
}

#[test]
fn each_product_waits_once_and_is_taken_out() {
    let mut robot = connected();
    let unknown = product(8);
    assert_eq!(
        robot.fetch(unknown),
        Err(FetchRefused::Unknown { product: unknown })
    );
    assert_eq!(robot.fetch(product(7)), Ok(None));
    assert_eq!(robot.fetch(product(12)), Ok(None));
    let twice = FetchRefused::Ordered {
        product: product(7),
    };
    assert_eq!(robot.fetch(product(7)), Err(twice.clone()));
    assert!(robot.cancel(product(7)));
    assert!(!robot.cancel(product(7)));
    assert_eq!(robot.queue().collect::<Vec<_>>(), [product(12)]);
    // Nor while the robot is on its way for it, as far as its questions tell.
    assert_eq!(robot.fetch(product(7)), Ok(None));
    assert_eq!(say(&mut robot, "fetchprod"), "fetchprod 12");
    assert_eq!(
        robot.fetch(product(12)).unwrap_err().to_string(),
        "goods 12 are ordered already"
    );
    assert_eq!(say(&mut robot, "fetchprod"), "fetchprod 7");
    assert_eq!(robot.fetch(product(7)), Err(twice));
}
