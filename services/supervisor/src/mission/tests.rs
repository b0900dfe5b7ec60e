//! When a mission counts as delivered, and when it is given up.

use super::*;

/// A robot that is ready and does this.
fn seen(phase: Phase, status: NavigatorStatus) -> Seen {
    let mut health = Health {
        mode: Mode::Autonomous.into(),
        mode_chosen: 1,
        ..Health::default()
    };
    (health.sensor.up, health.steering.up) = (1, 1);
    Seen {
        health: Some(health),
        status: Some(NavigatorStatus {
            phase: phase.into(),
            ..status
        }),
        queue: Some(OrderQueue::default()),
        ..Seen::default()
    }
}

fn delivered(count: u32, product: i32) -> NavigatorStatus {
    NavigatorStatus {
        delivered: count,
        product,
        ..NavigatorStatus::default()
    }
}

/// Sees to a mission of a simulated robot.
fn simulated(mission: Mission) -> Watch {
    Watch::new(mission, Helper::Nobody)
}

fn seconds(count: u64) -> Moment {
    Moment {
        robot: Duration::from_secs(count),
        ns: count * 1_000_000_000,
    }
}

/// Whether this puts the robot into autonomous mode, unless somebody has set its mode.
fn begins(act: Option<Act>) -> bool {
    match act {
        Some(Act::Ask { ask, .. }) => ask.kind == AskKind::Begin,
        _ => false,
    }
}

#[test]
fn what_is_delivered_is_counted_in_any_order_and_what_others_order_ends_no_mission() {
    let mut watch = simulated(Mission::of_station(&[3, 1, 3]));
    for (count, product) in [(0, 0), (1, 1), (2, 7), (3, 3)] {
        let seen = seen(Phase::BackingOff, delivered(count, product));
        assert!(watch.step(seconds(1), &seen).is_none());
    }
    assert_eq!(watch.mission().delivered(), [1, 7, 3]);
    // A successor goes on from there; one more look at the same is no delivery.
    let mut heir = simulated(watch.mission().clone());
    heir.step(seconds(2), &seen(Phase::BackingOff, delivered(3, 3)));
    assert_eq!(heir.mission().outcome(), None);
    heir.step(seconds(3), &seen(Phase::BackingOff, delivered(4, 3)));
    assert_eq!(heir.mission().outcome(), Some(Ok(())));
    assert_eq!(heir.mission().delivered(), [1, 7, 3, 3]);
}

#[test]
fn without_a_mission_of_its_own_it_counts_what_others_order_and_does_nothing() {
    let mut watch = Watch::new(Mission::of_others(), Helper::Person);
    for (count, product) in [(4, 9), (5, 9), (5, 9), (6, 2)] {
        let seen = seen(Phase::BackingOff, delivered(count, product));
        assert!(watch.step(seconds(1), &seen).is_none());
    }
    assert_eq!(watch.mission().delivered(), [9, 2]);
}

#[test]
fn a_person_who_has_set_the_mode_before_the_mission_began_keeps_it() {
    let mut ready = seen(Phase::WaitingForOrder, delivered(0, 0));
    let health = ready.health.as_mut().expect("health");
    (health.mode, health.mode_chosen) = (Mode::Manual.into(), 0);
    let mut watch = simulated(Mission::of_robot(&[5], 40));
    assert!(begins(watch.step(seconds(1), &ready)));
    ready.health.as_mut().expect("health").mode_chosen = 1;
    for second in 2..100 {
        assert!(!begins(watch.step(seconds(second), &ready)));
    }
    assert_eq!(watch.mission().outcome(), None);
}

#[test]
fn a_robot_that_starts_again_begins_anew_and_the_mission_of_before_is_given_up() {
    let mut mission = Mission::of_robot(&[3], 1);
    mission.begun = true;
    mission.begin_again("it starts again");
    let mut watch = simulated(mission);
    let mut ready = seen(Phase::WaitingForOrder, delivered(0, 0));
    ready.health.as_mut().expect("health").mode_chosen = 0;
    assert!(begins(watch.step(seconds(1), &ready)));
    ready.health.as_mut().expect("health").mode_chosen = 1;
    // Nothing of the mission of before is ordered.
    for second in 2..100 {
        assert!(watch.step(seconds(second), &ready).is_none());
    }
    let outcome = watch.mission().outcome();
    assert_eq!(outcome, Some(Err("it starts again")));
}

#[test]
fn an_order_of_the_robots_own_is_repeated_under_its_number_until_it_is_seen() {
    let mut watch = simulated(Mission::of_robot(&[5, 6], 40));
    let idle = seen(Phase::WaitingForOrder, delivered(0, 0));
    let ordered = |act| match act {
        Some(Act::Order(order)) => (order.id, order.product),
        other => panic!("{other:?}"),
    };
    assert_eq!(ordered(watch.step(seconds(1), &idle)), (40, 5));
    assert!(watch.step(seconds(1), &idle).is_none());
    assert_eq!(ordered(watch.step(seconds(2), &idle)), (40, 5));
    let mut heir = simulated(watch.mission().clone());
    assert_eq!(ordered(heir.step(seconds(2), &idle)), (40, 5));
    let mut taken = seen(Phase::Driving, delivered(0, 5));
    taken.status = taken.status.map(|status| NavigatorStatus {
        order_id: 40,
        ..status
    });
    assert_eq!(ordered(heir.step(seconds(2), &taken)), (41, 6));
}

#[test]
fn a_refusal_ends_the_mission_and_only_its_own_does() {
    let why = Failure::new(FailureKind::UnknownProduct, (0, 0), 0, 0);
    let refused = |product| Seen {
        refused: Some((9, product, why)),
        ..seen(Phase::WaitingForOrder, delivered(0, 0))
    };
    let mut watch = simulated(Mission::of_station(&[5]));
    watch.step(seconds(1), &refused(4));
    assert_eq!(watch.mission().outcome(), None);
    // What was refused while it was at work was another one's.
    let busy = Seen {
        refused: Some((10, 5, why)),
        ..seen(Phase::Driving, delivered(0, 5))
    };
    watch.step(seconds(2), &busy);
    assert_eq!(watch.mission().outcome(), None);
    let mut watch = simulated(Mission::of_station(&[5]));
    watch.step(seconds(1), &refused(5));
    let outcome = watch.mission().outcome();
    assert!(outcome.is_some_and(|outcome| outcome.is_err()));
}

#[test]
fn a_mission_that_nobody_orders_any_more_has_failed_but_one_that_is_stopped_waits() {
    let idle = seen(Phase::WaitingForOrder, delivered(0, 0));
    let stopped = Seen {
        health: idle.health.map(|health| Health {
            stopped: 1,
            ..health
        }),
        ..idle.clone()
    };
    let mut watch = simulated(Mission::of_station(&[5]));
    watch.step(seconds(1), &idle);
    watch.step(seconds(50), &stopped);
    watch.step(seconds(51), &idle);
    watch.step(seconds(110), &idle);
    assert_eq!(watch.mission().outcome(), None);
    watch.step(seconds(111), &idle);
    let told = watch.mission().outcome();
    assert_eq!(told, Some(Err("nobody orders [5] any more")));
}

#[test]
fn a_low_battery_that_nobody_charges_ends_the_mission_and_is_named() {
    let low = NavigatorStatus {
        hold: Hold::Battery.into(),
        x: 2,
        y: 1,
        ..NavigatorStatus::default()
    };
    let [low, charged] = [low, delivered(0, 0)].map(|status| seen(Phase::Driving, status));
    for helper in [Helper::Person, Helper::Nobody] {
        let mut watch = Watch::new(Mission::of_station(&[5]), helper);
        // A while ends with the charge.
        for (second, seen) in [(1, &low), (9, &charged), (10, &low), (19, &low)] {
            watch.step(seconds(second), seen);
            assert_eq!(watch.mission().outcome(), None, "{helper:?}");
        }
        watch.step(seconds(20), &low);
        let (outcome, hold) = (watch.mission().outcome(), watch.mission().hold());
        if helper == Helper::Person {
            assert_eq!((outcome, hold), (None, None), "somebody may come");
            continue;
        }
        let why = outcome.expect("an end").expect_err("a failure");
        assert!(why.contains("stands at crossing (2, 1)"), "{why}");
        assert_eq!(hold, Some(Hold::Battery.into()));
        assert_eq!(watch.mission().failure_kind(), None, "it would go on");
    }
}

#[test]
fn an_arm_in_the_way_ends_the_mission_unless_a_person_picks() {
    for (pick, gives_up) in [(Pick::Auto, true), (Pick::Manual, false)] {
        let held = NavigatorStatus {
            hold: Hold::Arm.into(),
            pick: pick.into(),
            ..NavigatorStatus::default()
        };
        let held = seen(Phase::Driving, held);
        let mut watch = simulated(Mission::of_station(&[5]));
        watch.step(seconds(1), &held);
        watch.step(seconds(11), &held);
        let told = watch.mission().outcome();
        assert_eq!(told.is_some(), gives_up, "{pick:?}: {told:?}");
        let hold = watch.mission().hold();
        assert_eq!(hold, gives_up.then(|| Hold::Arm.into()));
    }
}
