//! After start-up the bridge allocates nothing: neither in its readers nor in its main loop.
//!
//! It is a program of its own because it replaces the allocator.
#![allow(unsafe_code, reason = "an allocator cannot be had otherwise")]

#[path = "bridge/harness/mod.rs"]
mod harness;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use lager_topics::Finish;

use harness::{FOLLOW, LEFT_PERP, Robot, logic};

static COUNTING: AtomicBool = AtomicBool::new(false);
static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

struct Counting;

fn count() {
    if COUNTING.load(Ordering::Relaxed) && !harness::is_exempt() {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
    }
}

// SAFETY: every call is handed to the system's allocator unchanged; counting touches only
// atomics and a thread-local without a destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps `alloc`'s contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

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
    harness::exempt();
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
    COUNTING.store(true, Ordering::Relaxed);
    for round in 1..=4 {
        drive(&mut robot, round * 10);
    }
    COUNTING.store(false, Ordering::Relaxed);
    let allocations = ALLOCATIONS.load(Ordering::Relaxed);
    let after = published(&mut robot);
    let samples: u64 = after
        .iter()
        .zip(before)
        .map(|(after, before)| after - before)
        .sum();
    assert!(samples > 300, "frames were flowing");
    assert_eq!(allocations, 0, "over {samples} samples");

    // The counter counts: a thread of the bridge's kind that allocates is seen.
    ALLOCATIONS.store(0, Ordering::Relaxed);
    COUNTING.store(true, Ordering::Relaxed);
    std::thread::spawn(|| drop(std::hint::black_box(vec![0_u8; 100])))
        .join()
        .unwrap();
    COUNTING.store(false, Ordering::Relaxed);
    assert!(ALLOCATIONS.load(Ordering::Relaxed) > 0);
}
