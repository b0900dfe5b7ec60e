//! Whole missions with noise on the steering board's cable in the middle of turns.
//!
//! Dead reckoning lives on what the board reports: without reports nothing says how far a turn has
//! gone. The mission must be delivered all the same. Of the seeds 1 to 1 500 six did not on
//! 2026-11-24: in four the claw closed on nothing five times (474, 1051, 1097, 1488), one robot did
//! not see the mark of its pick station (318), and one put the goods down beside the delivery
//! station (194).

use std::time::Duration;

use lager_plant::Warehouse;
use lager_plant::noise::Noise;
use lager_simulator::Wire;
use lager_topics::Phase;

use super::{TICK, Whole};
use crate::config::Config;

/// The stream of noise that chooses the attacks.
const STREAM: u64 = 77;
/// Virtual time in which a disturbed mission must be over.
const LIMIT: Duration = Duration::from_secs(1_200);

/// Missions that ended on a wrong line, stuck or with nothing in the claw as long as logic drove
/// on without reports: 23 of the 1 500 from 100 on.
const ONCE_LOST: [u64; 13] = [
    390, 418, 471, 588, 663, 665, 666, 722, 796, 834, 851, 881, 934,
];

/// What happens to the cable.
#[derive(Clone, Copy, Debug)]
enum Trouble {
    /// Of 1000 bytes to the Pi so many arrive wrong.
    ToPi(u64),
    /// This many bytes of noise reach the board each millisecond.
    ToBoard(u64),
    /// Both at once.
    Both(u64, u64),
    /// Nothing gets through in either direction.
    Cut,
}

/// Trouble on the steering cable, in pieces, from somewhere in one turn on.
#[derive(Debug)]
struct Attack {
    trouble: Trouble,
    /// Which turn of the mission, from 0, and from when after its begin.
    turn: u64,
    from: Duration,
    /// How long a piece lasts, how long it pauses, and how many pieces there are.
    lasts: Duration,
    pauses: Duration,
    pieces: u32,
    noise: Noise,
}

impl Attack {
    fn new(seed: u64) -> Self {
        let mut noise = Noise::new(seed, STREAM);
        let mut pick = |below: u64| noise.bits() % below;
        let wrong = |choice: u64| [20, 100, 300, 1_000][choice as usize];
        let strange = |choice: u64| [1, 5, 20, 45][choice as usize];
        let trouble = match pick(4) {
            0 => Trouble::ToPi(wrong(pick(4))),
            1 => Trouble::ToBoard(strange(pick(4))),
            2 => Trouble::Both(wrong(pick(4)), strange(pick(4))),
            _ => Trouble::Cut,
        };
        let ms = Duration::from_millis;
        Self {
            trouble,
            turn: pick(8),
            from: ms(pick(3_000)),
            lasts: ms([20, 60, 140, 200, 400, 900, 1_500][pick(7) as usize] + pick(50)),
            pauses: ms(50 + pick(500)),
            pieces: 1 + pick(6) as u32,
            noise,
        }
    }

    /// Whether the cable is in trouble so long after the turn has begun.
    fn is_on(&self, since: Duration) -> bool {
        let Some(since) = since.checked_sub(self.from) else {
            return false;
        };
        let piece = (self.lasts + self.pauses).as_micros();
        let (number, within) = (since.as_micros() / piece, since.as_micros() % piece);
        number < u128::from(self.pieces) && within < self.lasts.as_micros()
    }

    /// Disturbs the next tick.
    fn disturb(&mut self, whole: &mut Whole) {
        let (wrong, strange) = match self.trouble {
            Trouble::ToPi(wrong) => (wrong, 0),
            Trouble::ToBoard(strange) => (0, strange),
            Trouble::Both(wrong, strange) => (wrong, strange),
            Trouble::Cut => return whole.robot.cut(Wire::Steering, true),
        };
        if wrong > 0 {
            let mut bytes = Vec::new();
            whole.robot.advance_to(whole.now + TICK);
            whole.robot.read(Wire::Steering, &mut bytes);
            for byte in &mut bytes {
                if self.noise.bits() % 1_000 < wrong {
                    *byte = self.noise.bits() as u8;
                }
            }
            whole.robot.disturb_pi(Wire::Steering, &bytes);
        }
        let bytes: Vec<u8> = (0..strange).map(|_| self.noise.bits() as u8).collect();
        whole.robot.write(Wire::Steering, &bytes);
    }
}

fn is_turn(phase: Option<Phase>) -> bool {
    use Phase::{Leaving, Positioning, Turning, TurningRound};
    matches!(phase, Some(Turning | Positioning | Leaving | TurningRound))
}

/// How a mission with one attack ends.
fn attacked(seed: u64) -> Result<(), String> {
    let name = ["small", "large", "curved"][seed as usize % 3];
    let warehouse = Warehouse::builtin(name).expect("built in");
    let mission = [warehouse.products[seed as usize % warehouse.products.len()].id];
    let mut whole =
        Whole::new(&Config::default(), &warehouse, &mission, seed, 0).expect("a valid world");
    let mut attack = Attack::new(seed);
    let (mut turns, mut turning, mut begun) = (0, false, None);
    loop {
        assert!(whole.now < LIMIT, "{name} {seed}: {attack:?} never ended");
        let turns_now = is_turn(whole.navigator.status().phase.get());
        if turns_now && !turning {
            if turns == attack.turn {
                begun = Some(whole.now);
            }
            turns += 1;
        }
        turning = turns_now;
        whole.robot.cut(Wire::Steering, false);
        if begun.is_some_and(|begun| attack.is_on(whole.now - begun)) {
            attack.disturb(&mut whole);
        }
        if let Some(outcome) = whole.turn() {
            return outcome.map_err(|why| format!("{name} {seed}: {why}: {attack:?}"));
        }
    }
}

#[test]
fn a_mission_survives_noise_in_the_middle_of_its_turns() {
    for seed in ONCE_LOST.into_iter().chain(1..=24) {
        assert_eq!(attacked(seed), Ok(()));
    }
}
