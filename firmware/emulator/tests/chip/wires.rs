//! Two chips and the wire between them.

use lager_emulator::chip::{Chip, Pin, ResetLine, wire};

use crate::support::{START, chip, milliseconds, noted};

/// Runs one chip after the other; only the wire keeps them together.
fn run(one: &Chip, other: &Chip, to: u64) {
    one.run_until(to);
    other.run_until(to);
}

#[test]
fn an_edge_wakes_the_other_chip_at_its_own_cycle() {
    let sender = chip("pulses.c", "edges");
    let receiver = chip("counter.c", "edges");
    let wire = wire(&sender, Pin::new('D', 4), &receiver, Pin::new('B', 2));
    wire.record();
    // The test never runs the receiver further by itself; only the edges do.
    receiver.run_until(START + milliseconds(1));
    sender.run_until(START + milliseconds(8));
    assert_eq!((wire.rises(), noted(&receiver, 1)[0]), (10, 10));
    let last = wire.take_edges().last().copied().expect("there were edges");
    assert_eq!(receiver.cycle(), last.0, "asleep until the last edge");
}

#[test]
fn a_lost_pulse_is_not_seen() {
    let sender = chip("pulses.c", "lost");
    let receiver = chip("counter.c", "lost");
    let wire = wire(&sender, Pin::new('D', 4), &receiver, Pin::new('B', 2));
    run(&sender, &receiver, START + milliseconds(1));
    wire.lose(2);
    run(&sender, &receiver, START + milliseconds(8));
    assert_eq!((wire.rises(), wire.lost()), (10, 2));
    assert_eq!(noted(&receiver, 1), [8]);
}

#[test]
fn a_chip_in_reset_lets_go_of_its_outputs() {
    let sender = chip("pulses.c", "released");
    let receiver = chip("counter.c", "released");
    let wire = wire(&sender, Pin::new('D', 4), &receiver, Pin::new('B', 2));
    wire.record();
    // In the middle of the first pulse.
    run(&sender, &receiver, START + milliseconds(5) + 100);
    assert_eq!(wire.take_edges().len(), 1);
    sender.reset(ResetLine::External);
    let edges = wire.take_edges();
    assert_eq!(edges, [(sender.cycle(), false)]);
}
