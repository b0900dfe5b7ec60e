//! The robot's measures and the navigator's tolerances. Numbers only; nothing here decides.

use core::time::Duration;

use lager_orders::Pick;
use lager_wake::Policy;
use lager_wire::{ArmProfile, WheelsProfile};
use serde::{Deserialize, Serialize};

/// The robot's measures, and the navigator's tolerances. Times are robot time.
///
/// Recordings have it in JSON, without the values that only [`crate::run`] uses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogicConfig {
    /// Duty at which the boards drive straight on and turn (W1, `PWM_STANDARD`), of 255. Recordings
    /// without it are of robots with 100.
    #[serde(default = "usual_duty")]
    pub duty: u8,
    /// Speed in mm/s with both motors at that duty (W3).
    pub cruise_mm_per_s: f32,
    /// Speed of turning on the spot in degrees/s at that duty: 360 degrees in 12 s (W4).
    pub turn_deg_per_s: f32,
    /// How far the line sensors are ahead of the wheels' axle (P4), in mm.
    pub sensor_ahead_mm: f32,
    /// Width of the tape (E1), in mm.
    pub tape_mm: f32,
    /// How far the robot rolls on after the command to stop, in mm.
    pub coast_mm: f32,
    /// Part of an edge by which dead reckoning may be wrong when a mark is judged.
    pub tolerance: f32,
    /// The same for a mark that a killed navigator had only begun to see.
    pub tolerance_cut_short: f32,
    /// How far, as a part of an edge, the robot drives before a node counts as missing (AMB-49).
    pub overdue: f32,
    /// How far before a node the sensors must be at the start of a drive, in mm, if the navigator
    /// waits for the node's mark. Nearer than that, the robot may not be straight on the line when
    /// the mark comes.
    pub run_up_mm: f32,
    /// How far the robot drives without seeing the line before the line counts as lost (AMB-49), in
    /// mm.
    pub line_lost_mm: f32,
    /// If the line ends within this distance behind a mark to both sides, in mm, the mark is the
    /// cross bar of the delivery.
    pub bar_end_mm: f32,
    /// How far to back away from delivered goods before turning round, in mm. The sensors must
    /// leave the cross bar, or the turn would end on it.
    pub back_off_mm: f32,
    /// Longest possible way out to the place of delivery, in mm.
    pub longest_exit_mm: f32,
    /// How far the ranger at the front sees, in cm. 0 = there is no ranger, and the robot looks
    /// along no way.
    pub ranger_cm: u8,
    /// How far the ranger is ahead of the wheels' axle, in mm.
    pub ranger_ahead_mm: f32,
    /// A thing blocks a way if it is nearer than the ranger's limit, and than the next node, by at
    /// least this, in cm (AMB-48).
    pub ranger_margin_cm: u8,
    /// The robot stops at this distance before a thing between two nodes, in cm: it must be able to
    /// turn round there.
    pub halt_cm: u8,
    /// If a thing at a node is farther away than this, in cm, there is room to turn: the body's
    /// front corners reach 192 mm from the axle, and a ranger may say 13 cm where it is 10.
    pub turn_room_cm: u8,
    /// How far the robot backs up for each missing cm, in mm; and how far at most if it has not
    /// seen what is behind it.
    pub turn_back_mm: f32,
    /// The most that it backs up to have room to turn, in mm from the node. Its sensors still reach
    /// the tape to which it turns.
    pub turn_room_mm: f32,
    /// How far behind the next node a thing may stand and still block the way to it, in mm.
    pub beyond_node_mm: f32,
    /// How old a distance may be when it arrives.
    pub ranger_lag: Duration,
    /// How long a thing between two nodes must stay to block the way.
    pub halt_patience: Duration,
    /// After this time the robot tries blocked ways again, before it calls a goal unreachable.
    pub try_again: Duration,
    /// Who picks the goods up.
    #[serde(with = "crate::entry::named")]
    pub pick: Pick,
    /// The arm's limits, and its pose for carrying (`[arm]`).
    pub arm: ArmProfile,
    /// How far a joint may be from the carry pose while the robot drives with goods, in servo
    /// units of 0.29 degrees.
    pub carry_tolerance: u16,
    /// The shoulder servo's position when the claw is around goods that stand as they should in
    /// front of the robot, in servo units.
    pub reach_shoulder: u16,
    /// The elbow servo's position for that.
    pub reach_elbow: u16,
    /// How long goods must have been in the claw before the grip counts as firm.
    pub grip_proof: Duration,
    /// How far open the claw must stay to be holding something, in servo units.
    pub held_margin: u16,
    /// Battery, in tenths of a volt, below which the robot stands at the next node; 0 = none.
    pub low_battery_decivolts: u8,
    /// How much the battery must be above that to count as charged again, in tenths of a volt.
    pub charged_by_decivolts: u8,
    /// How long the battery must be low, or charged, before that counts.
    pub battery_steady: Duration,
    /// How long the robot drives on without a line frame.
    pub blind_after: Duration,
    /// How long the robot drives on without a report of the steering board.
    pub unheard_board: Duration,
    /// How long the robot stands before it judges an interrupted turn or drop, or begins one.
    pub settle: Duration,
    /// How long a setpoint may be missing in the bridge's reports before the navigator gives it
    /// again.
    pub unheard_setpoint: Duration,
    /// The same for a turn or a drop.
    pub unheard_one_shot: Duration,
    /// How far the robot still moved, on average, after the last status of a killed navigator,
    /// until its order's lease ended.
    pub outage: Duration,
    /// How often the navigator gives an order again that the board does not carry out, before it
    /// gives up.
    pub tries: u8,
    /// How often the robot may pass the pick station without finding it.
    pub misses: u8,
    /// Whether somebody has said how this robot is built. It stands until then, as its motors may be
    /// swapped. Recordings without it are of robots that were known.
    #[serde(default = "known")]
    pub is_described: bool,
    /// How [`crate::run`] waits for samples.
    #[serde(skip)]
    pub waiting: Policy,
    /// Whether [`crate::run`] resumes from the state of an earlier logic.
    #[serde(skip)]
    pub resume: bool,
}

impl LogicConfig {
    /// How far the axle must be from a crossing tape, in mm, so that a turn does not end on it.
    pub(crate) fn nearest_turn_mm(&self) -> f32 {
        self.sensor_ahead_mm + self.tape_mm / 2.0
    }
}

const fn known() -> bool {
    true
}

fn usual_duty() -> u8 {
    WheelsProfile::default().duty
}

impl Default for LogicConfig {
    fn default() -> Self {
        Self {
            duty: usual_duty(),
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
            ranger_cm: 0,
            ranger_ahead_mm: 100.0,
            ranger_margin_cm: 10,
            halt_cm: 25,
            turn_room_cm: 13,
            turn_back_mm: 8.0,
            turn_room_mm: 25.0,
            beyond_node_mm: 100.0,
            ranger_lag: Duration::from_millis(100),
            halt_patience: Duration::from_secs(1),
            try_again: Duration::from_secs(60),
            pick: Pick::Manual,
            arm: ArmProfile::default(),
            carry_tolerance: 20,
            // 250 mm ahead of the axle.
            reach_shoulder: 311,
            reach_elbow: 488,
            grip_proof: Duration::from_secs(6),
            held_margin: 40,
            low_battery_decivolts: 100,
            charged_by_decivolts: 4,
            battery_steady: Duration::from_secs(3),
            blind_after: Duration::from_millis(120),
            unheard_board: Duration::from_millis(200),
            settle: Duration::from_millis(300),
            unheard_setpoint: Duration::from_millis(300),
            unheard_one_shot: Duration::from_secs(1),
            outage: Duration::from_millis(125),
            tries: 8,
            misses: 3,
            is_described: known(),
            waiting: Policy::Block,
            resume: false,
        }
    }
}
