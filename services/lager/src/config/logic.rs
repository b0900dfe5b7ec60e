//! `[logic]`: what the navigator has to be told of the robot that it drives.

use std::ops::RangeInclusive;

use anyhow::{Result, bail};
use lager_logic::LogicConfig;
use lager_wire::SERVO_MAX;
use serde::{Deserialize, Serialize};

/// Robots that dead reckoning can follow, in mm/s: slower ones are overtaken by its time-outs,
/// faster ones pass a mark between two frames.
const CRUISES_MM_PER_S: RangeInclusive<f32> = 10.0..=1_000.0;

/// Where line sensors can be, in mm ahead of the axle: nearer than the tape's width the axle is on
/// a node as soon as they see it, and farther than the smallest square's side they are past the
/// next one.
const SENSORS_AHEAD_MM: RangeInclusive<f32> = 20.0..=400.0;
/// The same for turns on the spot, in degrees per second.
const TURNS_DEG_PER_S: RangeInclusive<f32> = 5.0..=180.0;
/// The same for the tape's width: wider, a crossing is no mark any more.
const TAPES_MM: RangeInclusive<f32> = 5.0..=50.0;
/// The same for the ranger's place.
const RANGERS_AHEAD_MM: RangeInclusive<f32> = 0.0..=400.0;
/// `[logic]`: the measures dead reckoning needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LogicSection {
    /// Speed in mm/s when both motors run at the standard duty of 100.
    pub cruise_mm_per_s: f32,
    /// How far the line sensors are ahead of the wheels' axle, in mm.
    pub sensor_ahead_mm: f32,
    /// Degrees per second of a turn on the spot at that duty.
    pub turn_deg_per_s: f32,
    /// Width of the tape, in mm.
    pub tape_mm: f32,
    /// How far the ranger is ahead of the wheels' axle, in mm.
    pub ranger_ahead_mm: f32,
    /// Battery, in tenths of a volt, below which the robot stands at the next crossing; 0 = none.
    pub low_battery_decivolts: u8,
    /// How far the ranger sees, in cm; 0 = there is none, and no way is looked at.
    pub ranger_cm: u8,
    /// After how many seconds ways that were found blocked are tried again.
    pub try_again_s: u32,
    /// The shoulder's servo when the claw is around goods in front of the robot, in units of 0.29
    /// degrees.
    pub reach_shoulder: u16,
    /// The elbow's servo for that.
    pub reach_elbow: u16,
    /// Who picks the goods up; none = as usual with the body ([`Config::pick`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pick: Option<PickBy>,
}

impl LogicSection {
    /// Refuses a robot that the navigator could not drive, with a sentence.
    pub fn validate(&self) -> Result<()> {
        // Not a number is in no range.
        for (key, value, range) in [
            ("cruise_mm_per_s", self.cruise_mm_per_s, CRUISES_MM_PER_S),
            ("sensor_ahead_mm", self.sensor_ahead_mm, SENSORS_AHEAD_MM),
            ("turn_deg_per_s", self.turn_deg_per_s, TURNS_DEG_PER_S),
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

/// Who picks the goods up: `lager_topics::Pick` as a word of the configuration and of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum PickBy {
    /// A person moves the arm and says when it is done.
    Manual,
    /// The robot, by itself.
    Auto,
}

impl PickBy {
    /// As it stands in the file.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Manual => "manual",
            Self::Auto => "auto",
        }
    }
}

impl From<PickBy> for lager_topics::Pick {
    fn from(pick: PickBy) -> Self {
        match pick {
            PickBy::Manual => Self::Manual,
            PickBy::Auto => Self::Auto,
        }
    }
}

impl Default for LogicSection {
    fn default() -> Self {
        let config = LogicConfig::default();
        Self {
            cruise_mm_per_s: config.cruise_mm_per_s,
            sensor_ahead_mm: config.sensor_ahead_mm,
            turn_deg_per_s: config.turn_deg_per_s,
            tape_mm: config.tape_mm,
            ranger_ahead_mm: config.ranger_ahead_mm,
            low_battery_decivolts: config.low_battery_decivolts,
            ranger_cm: 80,
            try_again_s: config.try_again.as_secs() as u32,
            reach_shoulder: config.reach_shoulder,
            reach_elbow: config.reach_elbow,
            pick: None,
        }
    }
}
