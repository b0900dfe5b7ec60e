//! What every message needs: the robot's frames, its measures, and ROS time.

use std::time::Duration;

use lager_battery::Pack;

use crate::messages::{Header, Time};

/// What the configuration says of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    /// The least and the greatest distance that the ranger tells, in cm.
    pub ranger_cm: (u8, u8),
    /// How far the ranger is ahead of the axle, in mm.
    pub ranger_ahead_mm: f32,
    /// How far the line sensors are ahead of the axle, in mm.
    pub line_ahead_mm: f32,
    /// The battery.
    pub pack: Pack,
}

/// The names of a robot's frames. Each begins with the robot's name, so that two robots are in one
/// tree, and none with a slash, which tf2 refuses.
///
/// ```text
///   r1/map ──> r1/odom ──> r1/base_link ──> r1/ranger
///      |                        '─────────> r1/line
///      '─────> r1/ground_truth    only of a simulated robot
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(String);

impl Frames {
    /// Of the node with that name.
    pub fn of(node: &str) -> Self {
        Self(node.to_owned())
    }

    /// The node's name.
    pub fn robot(&self) -> &str {
        &self.0
    }

    /// The warehouse: origin at node (0, 0), x to the right and y up.
    pub fn map(&self) -> String {
        self.named("map")
    }

    /// Where the way began, for programs that ask for it: the same as the map, since the robot counts
    /// its way from marks of the map.
    pub fn odom(&self) -> String {
        self.named("odom")
    }

    /// The robot as the navigator believes it to stand: the middle of the axle on the floor, x ahead.
    pub fn base(&self) -> String {
        self.named("base_link")
    }

    /// The same as it really stands.
    pub fn truth(&self) -> String {
        self.named("ground_truth")
    }

    /// The IR ranger, looking along x.
    pub fn ranger(&self) -> String {
        self.named("ranger")
    }

    /// The middle of the line sensors.
    pub fn line(&self) -> String {
        self.named("line")
    }

    fn named(&self, frame: &str) -> String {
        format!("{}/{frame}", self.0)
    }
}

/// ROS time for the stamps of the bus.
///
/// A stamp of the bus is in ns of `CLOCK_MONOTONIC`, and ROS wants ns since 1970. The difference is
/// measured at the start and stays, so that no two messages change their order. It is measured again
/// each second, and when somebody has set the machine's calendar by more than [`STEP`], the new one
/// holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Calendar {
    offset_ns: i64,
}

/// A change of the calendar that is followed.
const STEP: Duration = Duration::from_millis(50);

impl Calendar {
    /// With that difference.
    pub const fn new(offset_ns: i64) -> Self {
        Self { offset_ns }
    }

    /// What is added to a stamp.
    pub const fn offset_ns(self) -> i64 {
        self.offset_ns
    }

    /// Looks at the difference that is measured now. Returns whether the calendar was set.
    pub fn look(&mut self, offset_ns: i64) -> bool {
        let is_set = u128::from(self.offset_ns.abs_diff(offset_ns)) > STEP.as_nanos();
        if is_set {
            self.offset_ns = offset_ns;
        }
        is_set
    }

    /// A stamp's time in ns since 1970.
    pub const fn unix_ns(self, stamp_ns: u64) -> u64 {
        stamp_ns.saturating_add_signed(self.offset_ns)
    }

    /// A stamp's time in ROS.
    pub fn time(self, stamp_ns: u64) -> Time {
        let unix_ns = self.unix_ns(stamp_ns);
        Time {
            // ROS has room until 2038.
            sec: i32::try_from(unix_ns / 1_000_000_000).unwrap_or(i32::MAX),
            nanosec: (unix_ns % 1_000_000_000) as u32,
        }
    }

    /// The header of a message in that frame.
    pub fn header(self, stamp_ns: u64, frame_id: String) -> Header {
        Header {
            stamp: self.time(stamp_ns),
            frame_id,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_the_robots_name_and_no_slash_before_it() {
        let frames = Frames::of("r2");
        assert_eq!(frames.map(), "r2/map");
        assert_eq!(frames.base(), "r2/base_link");
    }

    #[test]
    fn a_stamp_becomes_a_date_and_small_drifts_change_nothing() {
        let mut calendar = Calendar::new(1_700_000_000_000_000_000);
        assert_eq!(
            calendar.time(1_500_000_000),
            Time {
                sec: 1_700_000_001,
                nanosec: 500_000_000
            }
        );
        assert!(!calendar.look(1_700_000_000_040_000_000));
        assert_eq!(calendar.time(0).nanosec, 0);
        assert!(calendar.look(1_700_000_001_000_000_000));
        assert_eq!(calendar.time(0).sec, 1_700_000_001);
    }
}
