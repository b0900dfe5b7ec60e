//! The robot's measures and the navigator's tolerances. Numbers only; nothing here decides.

use core::time::Duration;

use lager_ports::Policy;

/// What logic has to know of the robot and how much it forgives. Times are robot time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogicConfig {
    /// Speed in mm/s with both motors at the standard duty of 100 (W3).
    pub cruise_mm_per_s: f32,
    /// Speed of turning on the spot in degrees/s at that duty: 360 degrees in 12 s (W4).
    pub turn_deg_per_s: f32,
    /// How far the line sensors are ahead of the wheels' axle (P4), in mm.
    pub sensor_ahead_mm: f32,
    /// Width of the tape (E1), in mm.
    pub tape_mm: f32,
    /// Way the robot rolls on after it is told to stop, in mm.
    pub coast_mm: f32,
    /// Part of an edge by which dead reckoning may be wrong when a mark is judged.
    pub tolerance: f32,
    /// The same for a mark that a killed navigator had only begun to see.
    pub tolerance_cut_short: f32,
    /// Part of an edge after which a node that did not come is missing (AMB-49).
    pub overdue: f32,
    /// How far before a node the sensors must be at the start of a drive for its mark to be
    /// waited for, in mm. Nearer, the robot may not be straight on the line when the mark comes.
    pub run_up_mm: f32,
    /// Way driven without seeing the line after which it is lost (AMB-49), in mm.
    pub line_lost_mm: f32,
    /// How far behind a mark to both sides the line must end for the mark to be the cross bar of
    /// the delivery, in mm.
    pub bar_end_mm: f32,
    /// How far to back away from delivered goods before turning round, in mm. The sensors must
    /// come clear of the cross bar, or the turn would end on it.
    pub back_off_mm: f32,
    /// Longest way out to the place of delivery that is believed, in mm.
    pub longest_exit_mm: f32,
    /// How long to drive on without a line frame.
    pub blind_after: Duration,
    /// How long the robot stands before an interrupted turn or drop is judged or begun.
    pub settle: Duration,
    /// How long a setpoint may stay unheard of in the bridge's reports before it is given anew.
    pub unheard_setpoint: Duration,
    /// The same for a turn or a drop.
    pub unheard_one_shot: Duration,
    /// What the robot still moved, on average, between the last status of a killed navigator and
    /// the end of its order's lease.
    pub outage: Duration,
    /// How often a turn or a drop is begun anew before the robot gives up.
    pub tries: u8,
    /// How often the pick station may be passed without being found.
    pub misses: u8,
    /// How [`crate::run`] waits for samples.
    pub waiting: Policy,
    /// Whether [`crate::run`] takes up the state of its predecessor.
    pub resume: bool,
}

impl Default for LogicConfig {
    fn default() -> Self {
        Self {
            cruise_mm_per_s: 73.3,
            turn_deg_per_s: 30.0,
            sensor_ahead_mm: 160.0,
            tape_mm: 15.0,
            coast_mm: 5.0,
            tolerance: 0.25,
            tolerance_cut_short: 0.1,
            overdue: 1.3,
            run_up_mm: 60.0,
            line_lost_mm: 80.0,
            bar_end_mm: 40.0,
            back_off_mm: 60.0,
            longest_exit_mm: 20_000.0,
            blind_after: Duration::from_millis(120),
            settle: Duration::from_millis(300),
            unheard_setpoint: Duration::from_millis(300),
            unheard_one_shot: Duration::from_secs(1),
            outage: Duration::from_millis(125),
            tries: 8,
            misses: 3,
            waiting: Policy::Block,
            resume: false,
        }
    }
}
