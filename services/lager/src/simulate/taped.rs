//! What the boards have sent is recorded and played to another bridge and navigator: the same
//! inputs must give the same commands, byte for byte.

use std::collections::VecDeque;
use std::time::Duration;

use lager_plant::Warehouse;

use super::{TICK, Whole};
use crate::config::Config;

/// Bytes on a wire: when, which of the two, and what.
type Bytes = (Duration, usize, Vec<u8>);

/// Both wires of a robot, in both directions.
#[derive(Debug, Default)]
pub(super) struct Tape {
    from_boards: Vec<Bytes>,
    to_boards: Vec<Bytes>,
    /// What is heard in place of the boards.
    plays: Option<VecDeque<Bytes>>,
    /// What the ranger told last, in cm.
    distance_cm: Option<u8>,
}

impl Tape {
    /// A tape that plays what another one has recorded of the boards.
    fn of(recorded: &Self) -> Self {
        Self {
            plays: Some(recorded.from_boards.iter().cloned().collect()),
            ..Self::default()
        }
    }

    pub(super) fn read(&mut self, now: Duration, place: usize, bytes: &mut Vec<u8>) {
        if let Some(plays) = &mut self.plays {
            bytes.clear();
            let is_it = |(at, wire, _): &mut Bytes| (*at, *wire) == (now, place);
            while let Some((_, _, played)) = plays.pop_front_if(is_it) {
                bytes.extend(played);
            }
        }
        if !bytes.is_empty() {
            self.from_boards.push((now, place, bytes.clone()));
        }
    }

    pub(super) fn measured(&mut self, cm: u8) {
        self.distance_cm = Some(cm).filter(|cm| *cm != u8::MAX);
    }

    pub(super) fn distance_cm(&self) -> Option<u8> {
        self.distance_cm
    }

    pub(super) fn wrote(&mut self, now: Duration, place: usize, packet: &[u8]) {
        self.to_boards.push((now, place, packet.to_vec()));
    }
}

#[test]
fn the_same_recorded_inputs_give_byte_identical_commands_twice() {
    let warehouse = Warehouse::builtin("curved").expect("built in");
    let mission: Vec<i32> = warehouse.products.iter().take(2).map(|p| p.id).collect();
    let robot =
        |seed| Whole::new(&Config::default(), &warehouse, &mission, seed, 3).expect("a robot");
    let mut first = robot(7);
    let failure = first.run(Duration::from_secs(1_200));
    assert_eq!(failure, None);
    assert!(first.tape.to_boards.len() > 4_000, "a whole mission");
    for _ in 0..2 {
        // Another robot in another place: nothing of it is heard.
        let mut again = robot(8);
        again.tape = Tape::of(&first.tape);
        while again.now < first.now {
            again.turn();
        }
        let different = (first.tape.to_boards.iter().zip(&again.tape.to_boards))
            .find(|(one, other)| one != other);
        assert_eq!(different, None);
        assert_eq!(first.tape.to_boards.len(), again.tape.to_boards.len());
        assert_eq!(first.tape.from_boards, again.tape.from_boards);
    }
}

#[test]
fn one_byte_that_comes_otherwise_is_seen_in_the_commands() {
    let warehouse = Warehouse::builtin("small").expect("built in");
    let mut first = Whole::new(&Config::default(), &warehouse, &[1], 7, 0).expect("a robot");
    first.run(Duration::from_secs(20));
    let mut tape = Tape::of(&first.tape);
    let plays = tape.plays.as_mut().expect("it plays");
    // A second of silence of the steering board stops the robot.
    let silence = Duration::from_secs(8)..Duration::from_secs(9);
    plays.retain(|(at, place, _)| *place != 1 || !silence.contains(at));
    let mut again = Whole::new(&Config::default(), &warehouse, &[1], 7, 0).expect("a robot");
    again.tape = tape;
    while again.now + TICK < first.now {
        again.turn();
    }
    assert_ne!(first.tape.to_boards, again.tape.to_boards);
}
