//! After start-up the bridge allocates nothing: neither in its readers nor in its main loop.
//!
//! It is a program of its own because it replaces the allocator.

#[path = "bridge/harness/mod.rs"]
mod harness;

use lager_rig::allocations::{Counting, exempt_this_thread, of_all_threads};
use lager_topics::Finish;

use harness::{FOLLOW, LEFT_PERP, Robot, logic};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How many samples the bridge has sent on each of its topics.
fn published(robot: &mut Robot) -> [u64; 4] {
    let hands = &mut robot.hands;
    hands.line.look();
    hands.distance.look();
    hands.state.look();
    hands.health.look();
    [
        hands.line.sent,
        hands.distance.sent,
        hands.state.sent,
        hands.health.sent,
    ]
}

#[test]
fn nothing_is_allocated_per_frame_or_order() {
    exempt_this_thread();
    let mut robot = Robot::autonomous();
    // Once through everything, so that whatever is made on first use is made.
    let drive = |robot: &mut Robot, first: u32| {
        for id in first..first + 3 {
            robot
                .hands
                .give_until(logic(id, FOLLOW), "it drives", |hands| {
                    hands.line.look();
                    hands
                        .state
                        .look()
                        .is_some_and(|state| state.current_id == id && state.left_duty == 100)
                });
        }
        let turn = logic(first + 3, LEFT_PERP);
        robot.hands.give_until(turn, "the turn is done", |hands| {
            hands.line.look();
            hands.state.look().is_some_and(|state| {
                state.finished_id == first + 3 && state.finish.get() == Some(Finish::Done)
            })
        });
    };
    drive(&mut robot, 1);

    let before = published(&mut robot);
    let already = of_all_threads();
    for round in 1..=4 {
        drive(&mut robot, round * 10);
    }
    let allocations = of_all_threads() - already;
    let after = published(&mut robot);
    let samples: u64 = after
        .iter()
        .zip(before)
        .map(|(after, before)| after - before)
        .sum();
    assert!(samples > 300, "frames were flowing");
    assert_eq!(allocations, 0, "over {samples} samples");

    // The counter counts: a thread of the bridge's kind that allocates is seen.
    let already = of_all_threads();
    std::thread::spawn(|| drop(std::hint::black_box(vec![0_u8; 100])))
        .join()
        .unwrap();
    assert!(of_all_threads() > already);
}
