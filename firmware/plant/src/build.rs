//! Of which parts a robot is built and how they are connected. [`crate::make`] is how well the parts
//! are made.
//!
//! | part | as drawn | another robot, drawn from the seed |
//! |---|---|---|
//! | motors | each at the driver of its side, forwards is forwards | swapped, left or right reversed |
//! | wheels | a full turn in 12 s at a duty of 100 | 10 to 14 s |
//! | line sensors | high over dark tape | low |
//! | IR ranger | GP2Y0A21 | GP2Y0A41, GP2Y0A02 |
//! | battery | a quarter of it at the steering board | the input floats |
//! | servos | ids 1 to 8 | other ids |
//! | joints | each counts as drawn | any of them counts the other way |
//! | shoulder, elbow | two servos that face each other | one servo |
//! | horns | the middle of a servo is the joint's as drawn | up to 60 units of position beside it |
//! | ends of the joints | those of the servos | nearer |
//! | buttons | none | reset at a line, a switch or button for the mode at another, or neither |
//! | their contacts | | each pulls its line low or high, against a resistor or an open line |
//! | claw's servo | pushes with all its torque 32 units before its goal | 24 to 48 |
//!
//! A robot of another build drives only when its boards have been told of it.

use lager_ax12::table::MAX_POSITION;
use lager_orders::{Contact, Level, Levels, SwitchKind};

use crate::arm::SERVOS;
use crate::noise::Noise;

/// Time of a full turn of the robot as drawn, in s (W4).
const FULL_TURN: f64 = 12.0;
/// The shortest and the longest full turn of another robot, in s.
const FULL_TURNS: [f64; 2] = [10.0, 14.0];

/// How far a blocked servo is from its goal when it pushes with all its torque, in units of position
/// (compliance slope of the factory).
pub(crate) const SLOPE: u16 = 32;
/// The same of the claw's servo of another robot, at least and at most.
const SLOPES: [u16; 2] = [24, 48];
/// How far a horn can sit beside its place, in units of position.
const MOST_OFF: u16 = 60;
/// The ends of the joints of another robot, in the order of [`ArmBuild::JOINTS`]: the lower and the
/// upper one, each at least and at most.
const ENDS: [[[u16; 2]; 2]; 6] = [
    [[150, 350], [700, 900]],
    [[200, 285], [660, 800]],
    [[200, 285], [600, 800]],
    [[150, 350], [700, 900]],
    [[150, 350], [700, 900]],
    [[100, 150], [560, 700]],
];

/// The model of an IR ranger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ranger {
    /// Sharp GP2Y0A21YK0F.
    #[default]
    Gp2y0a21,
    /// Sharp GP2Y0A41SK0F.
    Gp2y0a41,
    /// Sharp GP2Y0A02YK.
    Gp2y0a02,
}

/// The servos of an arm. The joints and the numbers of their servos are those of [`crate::arm`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArmBuild {
    /// The id of the servo with each number; `None` where the joint has only one servo.
    pub ids: [Option<u8>; SERVOS],
    /// Whether it counts the other way; both servos of a pair do or neither.
    pub reversed: [bool; SERVOS],
    /// How much greater its position is than that of the arm as drawn, because its horn sits
    /// otherwise. Of the second servo of a pair it is as much smaller.
    pub offsets: [i16; SERVOS],
    /// The positions, as drawn, beyond which the joint of each servo cannot go.
    pub ends: [[u16; 2]; SERVOS],
    /// How far from its goal the blocked claw's servo pushes with all its torque, in units.
    pub slope: u16,
}

impl Default for ArmBuild {
    fn default() -> Self {
        Self {
            ids: core::array::from_fn(|index| Some(index as u8 + 1)),
            reversed: [false; SERVOS],
            offsets: [0; SERVOS],
            ends: [[0, MAX_POSITION]; SERVOS],
            slope: SLOPE,
        }
    }
}

/// A contact that a person closes, at a line of the Pi.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContactBuild {
    /// The line, and where the closed contact pulls it.
    pub contact: Contact,
    /// A resistor pulls the line the other way while the contact is open.
    pub has_resistor: bool,
}

impl ContactBuild {
    /// What its line shows.
    fn level(&self, is_closed: bool) -> Option<Level> {
        match is_closed {
            true => Some(self.contact.closed),
            false => self.has_resistor.then_some(self.contact.closed.other()),
        }
    }
}

/// The robot's own buttons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ButtonsBuild {
    /// The reset button.
    pub reset: Option<ContactBuild>,
    /// The mode switch or mode button.
    pub mode: Option<(ContactBuild, SwitchKind)>,
}

impl ButtonsBuild {
    /// The lines of the Pi's header that carry nothing else, from which buttons are drawn.
    const LINES: [u8; 15] = [4, 5, 6, 12, 13, 16, 17, 18, 19, 20, 21, 22, 23, 24, 27];

    /// What the Pi's lines show while these contacts, reset and mode, are closed.
    pub fn levels(&self, closed: [bool; 2]) -> Levels {
        let mode = self.mode.map(|(mode, _)| mode);
        let mut levels = Levels::default();
        for (button, is_closed) in [self.reset, mode].into_iter().zip(closed) {
            if let Some(button) = button {
                levels.set(button.contact.line, button.level(is_closed));
            }
        }
        levels
    }

    fn drawn(noise: &mut Noise) -> Self {
        let bits = noise.bits();
        let bit = |index: u32| bits >> index & 1 != 0;
        let level = |index| if bit(index) { Level::High } else { Level::Low };
        let first = (bits >> 32) as usize % Self::LINES.len();
        let step = 1 + (bits >> 48) as usize % (Self::LINES.len() - 1);
        let button = |place: usize, index: u32| ContactBuild {
            contact: Contact {
                line: Self::LINES[place % Self::LINES.len()],
                closed: level(index),
            },
            has_resistor: bit(index + 1),
        };
        let kind = match bit(4) {
            true => SwitchKind::Press,
            false => SwitchKind::Position,
        };
        // A robot in four has no reset button, and another one in four no mode switch.
        Self {
            reset: (bits >> 8 & 3 != 0).then(|| button(first, 0)),
            mode: (bits >> 10 & 3 != 0).then(|| (button(first + step, 2), kind)),
        }
    }
}

/// How a robot is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Build {
    /// Each motor hangs at the driver of the other side.
    pub swapped: bool,
    /// The motors of the left and the right side turn the other way round.
    pub reversed: [bool; 2],
    /// How fast the wheels are beside those of the robot as drawn.
    pub gear: f64,
    /// The line sensors read low over dark tape.
    pub dark_is_low: bool,
    /// The IR ranger's model.
    pub ranger: Ranger,
    /// The steering board can measure the battery.
    pub divider: bool,
    /// The arm's servos.
    pub arm: ArmBuild,
    /// The robot's own buttons, at lines of the Pi.
    pub buttons: ButtonsBuild,
}

impl Default for Build {
    fn default() -> Self {
        Self {
            swapped: false,
            reversed: [false; 2],
            gear: 1.0,
            dark_is_low: false,
            ranger: Ranger::default(),
            divider: true,
            arm: ArmBuild::default(),
            buttons: ButtonsBuild::default(),
        }
    }
}

impl Build {
    /// Another robot, the same for the same seed.
    pub fn drawn(seed: u64) -> Self {
        const STREAM: u64 = 101;
        const BUTTONS: u64 = 102;
        let mut noise = Noise::new(seed, STREAM);
        let bits = noise.bits();
        let bit = |index: u32| bits >> index & 1 != 0;
        let [fast, slow] = FULL_TURNS;
        let turn = f64::midpoint(fast, slow) + noise.spread((slow - fast) / 2.0);
        Self {
            swapped: bit(0),
            reversed: [bit(1), bit(2)],
            gear: FULL_TURN / turn,
            dark_is_low: bit(3),
            ranger: match bits >> 8 & 3 {
                0 => Ranger::Gp2y0a41,
                1 => Ranger::Gp2y0a02,
                _ => Ranger::Gp2y0a21,
            },
            divider: bit(4),
            arm: ArmBuild::drawn(&mut noise),
            buttons: ButtonsBuild::drawn(&mut Noise::new(seed, BUTTONS)),
        }
    }

    /// Time of a full turn on the spot at the standard duty, in s.
    pub fn full_turn(&self) -> f64 {
        FULL_TURN / self.gear
    }

    /// The duties of the left and the right motor, of those at the two drivers.
    pub(crate) fn motors(&self, [left, right]: [i16; 2]) -> [i16; 2] {
        let [left, right] = if self.swapped {
            [right, left]
        } else {
            [left, right]
        };
        let turned = |duty: i16, reversed| if reversed { -duty } else { duty };
        [
            turned(left, self.reversed[0]),
            turned(right, self.reversed[1]),
        ]
    }
}

impl ArmBuild {
    /// The first servo of each joint.
    const JOINTS: [usize; 6] = [0, 1, 3, 5, 6, 7];

    fn drawn(noise: &mut Noise) -> Self {
        let bits = noise.bits();
        let bit = |index: usize| bits >> index & 1 != 0;
        let mut arm = Self::default();
        for joint in Self::JOINTS {
            arm.reversed[joint] = bit(joint);
        }
        if bit(8) {
            // Eight ids in a row in any order: 0 to 253.
            let lowest = (bits >> 32 & 0xFF) as u8 % 247;
            arm.ids = core::array::from_fn(|index| Some(lowest + index as u8));
            for place in (1..SERVOS).rev() {
                arm.ids.swap(place, noise.bits() as usize % (place + 1));
            }
        }
        for (first, is_single) in [(1, bit(9)), (3, bit(10))] {
            arm.reversed[first + 1] = arm.reversed[first];
            if is_single {
                arm.ids[first + 1] = None;
            }
        }
        let mut draw = |[least, most]: [u16; 2]| least + noise.bits() as u16 % (most - least + 1);
        for (joint, [lower, upper]) in Self::JOINTS.into_iter().zip(ENDS) {
            arm.offsets[joint] = draw([0, 2 * MOST_OFF]).cast_signed() - MOST_OFF.cast_signed();
            arm.ends[joint] = [draw(lower), draw(upper)];
        }
        for first in [1, 3] {
            arm.offsets[first + 1] = -arm.offsets[first];
            let [lower, upper] = arm.ends[first];
            arm.ends[first + 1] = [MAX_POSITION - upper, MAX_POSITION - lower];
        }
        arm.slope = draw(SLOPES);
        arm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reset(build: &Build) -> Option<ContactBuild> {
        build.buttons.reset
    }

    fn mode(build: &Build) -> Option<(ContactBuild, SwitchKind)> {
        build.buttons.mode
    }

    #[test]
    fn a_closed_contact_drives_its_line_and_an_open_one_leaves_it_to_its_resistor() {
        let contact = |line, closed| Contact { line, closed };
        let buttons = ButtonsBuild {
            reset: Some(ContactBuild {
                contact: contact(17, Level::Low),
                has_resistor: false,
            }),
            mode: Some((
                ContactBuild {
                    contact: contact(27, Level::High),
                    has_resistor: true,
                },
                SwitchKind::Press,
            )),
        };
        let of = |closed| [17, 27, 5].map(|line| buttons.levels(closed).of(line));
        assert_eq!(of([false, false]), [None, Some(Level::Low), None]);
        assert_eq!(
            of([true, true]),
            [Some(Level::Low), Some(Level::High), None]
        );
    }

    #[test]
    fn a_seed_repeats_and_every_difference_occurs() {
        let builds: Vec<_> = (0..100).map(Build::drawn).collect();
        assert_eq!(builds[7], Build::drawn(7));
        for differs in [
            (|build| build.swapped) as fn(&Build) -> bool,
            |build| build.reversed[0],
            |build| build.reversed[1],
            |build| build.dark_is_low,
            |build| build.ranger != Ranger::Gp2y0a21,
            |build| !build.divider,
            |build| build.gear > 1.0,
            |build| build.arm.ids[0] != Some(1),
            |build| build.arm.ids[2].is_none(),
            |build| build.arm.ids[4].is_none(),
            |build| build.arm.reversed[0],
            |build| build.arm.reversed[1],
            |build| build.arm.reversed[3],
            |build| build.arm.reversed[5],
            |build| build.arm.reversed[6],
            |build| build.arm.reversed[7],
            |build| build.arm.offsets[0] > 0,
            |build| build.arm.offsets[1] > 0,
            |build| build.arm.offsets[7] > 0,
            |build| build.arm.slope > SLOPES[0].midpoint(SLOPES[1]),
            |build| reset(build).is_some_and(|reset| reset.contact.closed == Level::Low),
            |build| reset(build).is_some_and(|reset| reset.has_resistor),
            |build| mode(build).is_some_and(|(mode, _)| mode.contact.closed == Level::High),
            |build| mode(build).is_some_and(|(_, kind)| kind == SwitchKind::Press),
            |build| mode(build).is_some_and(|(_, kind)| kind == SwitchKind::Position),
        ] {
            let count = builds.iter().filter(|build| differs(build)).count();
            assert!((30..70).contains(&count), "{count}");
        }
        for build in builds {
            let lines = [
                reset(&build).map(|reset| reset.contact.line),
                mode(&build).map(|(mode, _)| mode.contact.line),
            ];
            assert!(lines == [None; 2] || lines[0] != lines[1], "{build:?}");
            assert!((10.0..=14.0).contains(&build.full_turn()), "{build:?}");
            let mut ids: Vec<_> = build.arm.ids.into_iter().flatten().collect();
            ids.sort_unstable();
            assert!(ids.windows(2).all(|pair| pair[0] < pair[1]), "{build:?}");
            assert!(ids.len() >= 6 && ids.last() <= Some(&253), "{build:?}");
        }
    }

    #[test]
    fn the_drivers_of_another_build_move_other_motors() {
        let build = Build {
            swapped: true,
            reversed: [true, false],
            ..Build::default()
        };
        assert_eq!(build.motors([100, 90]), [-90, 100]);
        assert_eq!(Build::default().motors([100, 90]), [100, 90]);
    }
}
