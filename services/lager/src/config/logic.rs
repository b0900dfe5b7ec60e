//! `[logic]`: the measures of the robot that the navigator drives.

use std::ops::RangeInclusive;

use anyhow::{Result, bail};
use lager_logic::LogicConfig;
use lager_orders::Pick;
use lager_wire::SERVO_MAX;

use super::section::section;

/// The speeds that dead reckoning can follow, in mm/s. The time-outs are too short for a slower
/// robot, and a faster one passes a mark between two frames.
const CRUISES_MM_PER_S: RangeInclusive<f32> = 10.0..=1_000.0;

/// Where line sensors can be, in mm ahead of the axle. If they were nearer than the tape's width,
/// the axle would be on a node as soon as they see it. If they were farther than the smallest
/// square's side, they would be past the next node.
const SENSORS_AHEAD_MM: RangeInclusive<f32> = 20.0..=400.0;
/// The same for the tape's width: on wider tape a crossing is not a mark any more.
const TAPES_MM: RangeInclusive<f32> = 5.0..=50.0;
/// The same for the ranger's place.
const RANGERS_AHEAD_MM: RangeInclusive<f32> = 0.0..=400.0;
/// The board measures up to 20 V, and five full cells have 21 V.
const MOST_CELLS: u8 = 4;

section! {
    "logic"
    /// The measures of the robot that the navigator drives.
    pub struct LogicSection {
        /// Speed in mm/s when both motors run at the duty of [wheels].
        pub cruise_mm_per_s: f32 = LogicConfig::default().cruise_mm_per_s,
        /// How far the line sensors are ahead of the wheels' axle, in mm.
        pub sensor_ahead_mm: f32 = LogicConfig::default().sensor_ahead_mm,
        /// Width of the tape, in mm.
        pub tape_mm: f32 = LogicConfig::default().tape_mm,
        /// How far the ranger at the front is ahead of the wheels' axle, in mm.
        pub ranger_ahead_mm: f32 = LogicConfig::default().ranger_ahead_mm,
        /// Battery in tenths of a volt. Below this the robot stands at the next crossing until the
        /// battery is charged or a person has put the robot down again. 0 = never.
        pub low_battery_decivolts: u8 = LogicConfig::default().low_battery_decivolts,
        /// How many lithium cells in series the battery has, from 1 to 4. From that and its voltage
        /// the robot tells its charge in percent. 0 = the battery is another one, and the robot
        /// tells only its voltage.
        pub battery_cells: u8 = 3,
        /// How far the ranger at the front sees, in cm: from 11 to 255. 0 = there is no ranger, and
        /// the robot looks along no way. A thing blocks a way if it is at least 10 cm nearer than
        /// this distance and than the next crossing.
        pub ranger_cm: u8 = 80,
        /// After how many seconds the robot tries blocked ways again, before it calls a goal
        /// unreachable.
        pub try_again_s: u32 = LogicConfig::default().try_again.as_secs() as u32,
        /// The positions of shoulder and elbow when the claw is around goods that stand as they
        /// should in front of the robot, in units of 0.29 degrees. A robot that picks by itself
        /// moves them there.
        pub reach_shoulder: u16 = LogicConfig::default().reach_shoulder,
        pub reach_elbow: u16 = LogicConfig::default().reach_elbow,
        /// Who picks the goods up: "manual" (a person moves the arm and says when it is done) or
        /// "auto" (the robot by itself). Unset, it is "manual" on real boards without `--script`,
        /// and "auto" everywhere else.
        pub pick: Option<Pick> = None,
    }
}

impl LogicSection {
    /// Refuses a robot that the navigator could not drive. The error is a sentence.
    pub fn validate(&self) -> Result<()> {
        // Not a number is in no range.
        for (key, value, range) in [
            ("cruise_mm_per_s", self.cruise_mm_per_s, CRUISES_MM_PER_S),
            ("sensor_ahead_mm", self.sensor_ahead_mm, SENSORS_AHEAD_MM),
            ("tape_mm", self.tape_mm, TAPES_MM),
            ("ranger_ahead_mm", self.ranger_ahead_mm, RANGERS_AHEAD_MM),
        ] {
            if !range.contains(&value) {
                bail!(
                    "[logic] {key} is {value}; it must be from {} to {}: measure it on the robot, or leave the key out",
                    range.start(),
                    range.end()
                );
            }
        }
        if self.battery_cells > MOST_CELLS {
            bail!(
                "[logic] battery_cells is {}; it must be from 1 to {MOST_CELLS}, as the board measures up to 20 V, or 0 where the battery has no lithium cells",
                self.battery_cells
            );
        }
        for (key, value) in [
            ("reach_shoulder", self.reach_shoulder),
            ("reach_elbow", self.reach_elbow),
        ] {
            if value > SERVO_MAX {
                bail!(
                    "[logic] {key} is {value}; a servo's position is from 0 to {SERVO_MAX}: step the arm to the goods with `lager arm`, and look with `lager topic echo steering/state`"
                );
            }
        }
        let margin = LogicConfig::default().ranger_margin_cm;
        if (1..=margin).contains(&self.ranger_cm) {
            bail!(
                "[logic] ranger_cm is {}; it must be from {} to {}, since the last {margin} cm of what it sees block no way, or 0 where there is no ranger",
                self.ranger_cm,
                margin + 1,
                u8::MAX
            );
        }
        Ok(())
    }
}
