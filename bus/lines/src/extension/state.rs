//! `state`: what the robot is doing, twenty times a second, as far as it is known.
//!
//! ```text
//! state time_ms=81250 x_mm=400 y_mm=0 heading_deg=90 node=1,0 looks=right phase=driving
//! ```

use lager_floor::{Heading, Node, ProductId};
use lager_orders::{Mode, Pick};
use lager_wire::{Binary, LineBits};

use super::fields::{Degrees, Loads, Servos, fields};
use crate::text::Name;

fields! {
    /// What the robot is doing. `None` is not known.
    pub struct State {
        /// The robot's clock in ms since its origin.
        time_ms: u64 = "a time in ms",
        /// Where the middle of the axle is by odometry, in mm to the right of node (0, 0).
        x_mm: i32 = "a way in mm",
        /// Where the middle of the axle is by odometry, in mm up from node (0, 0).
        y_mm: i32 = "a way in mm",
        /// Where the robot looks, by odometry.
        heading_deg: Degrees = "an angle from 0 to 359 degrees",
        /// How far the axle may be from there: odometry's error grows until the next mark.
        unsure_mm: u32 = "a way from 0 to 4294967295 mm",
        /// The node last passed.
        node: Node = "a node such as 2,1",
        /// Where the robot looks along the grid.
        looks: Heading = "left, up, right or down",
        /// The node it goes to.
        next: Node = "a node such as 2,1",
        /// What it does, by the names of the phases of `nav/status`, such as `driving`.
        phase: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// Why it stands although it would drive, likewise.
        hold: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// Why it cannot go on, by the names of `nav/status`, such as `line_lost`.
        failure: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// What was expected, as the failure means it.
        failure_expected: i32 = "a number from -2147483648 to 2147483647",
        /// What was seen, likewise.
        failure_seen: i32 = "a number from -2147483648 to 2147483647",
        /// What would end the failure, or what holds the robot, likewise, such as `reset`.
        remedy: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// Who drives.
        mode: Mode = "manual or autonomous",
        /// Who picks the goods up.
        pick: Pick = "manual or auto",
        /// Whether a stop is in force.
        stopped: bool = "0 or 1",
        /// Why it was set, by the names of the causes of `link/health`, such as `ordered`.
        stop_cause: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// The part of the robot that set it, such as `comm`, which does so for a station.
        stop_by: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// Which stop it is: a resume names it.
        stop: u64 = "the number of a stop",
        /// How long ago that was, in ms.
        stop_age_ms: u64 = "a time in ms",
        /// How long after that both motors had no duty, in ms; left out where nobody has seen it.
        stood_ms: u64 = "a time in ms",
        /// The order it is on.
        order: u32 = "an order from 0 to 4294967295",
        /// The product it fetches.
        product: ProductId = "a product's number from 0 to 2147483647",
        /// Products it has delivered.
        delivered: u32 = "a number from 0 to 4294967295",
        /// What the line sensors see, the leftmost first; 1 is tape (S6).
        line_bits: LineBits = "a row of eleven digits of 0 and 1",
        /// How far the line is off, in half sensors, positive to the right (AMB-20).
        line_error: i8 = "a number from -128 to 127",
        /// How far it is to what stands in front, in cm; left out where nothing is in range.
        distance_cm: u8 = "a distance from 0 to 255 cm",
        /// Duty of the left motor, of 255.
        left_duty: u8 = "a duty from 0 to 255",
        /// Duty of the right motor, of 255.
        right_duty: u8 = "a duty from 0 to 255",
        /// The command code that the steering board carries out.
        code: Binary = "a row of eight digits of 0 and 1",
        /// Where the servos stand.
        servos: Servos = "a row of eight positions from 0 to 1023 or - with commas between",
        /// How hard the servos work.
        loads: Loads = "a row of eight loads from -1023 to 1023 with commas between",
        /// Error bits of the servos, combined.
        servo_errors: Binary = "a row of eight digits of 0 and 1",
        /// The battery in tenths of a volt.
        battery_dv: u8 = "a voltage from 0 to 255 tenths of a volt",
        /// The part of its charge that is left, in percent.
        battery_percent: u8 = "a percentage from 0 to 255",
        /// How long that lasts until the robot stands, in s, at most 65535; left out unless it falls clearly.
        battery_left_s: u16 = "a time from 0 to 65535 s",
        /// Whether the sensor board is heard.
        sensor_up: bool = "0 or 1",
        /// Whether the steering board is heard.
        steering_up: bool = "0 or 1",
        /// Packets lost from the sensor board, a lower bound.
        sensor_lost: u32 = "a number from 0 to 4294967295",
        /// Packets lost from the steering board, a lower bound.
        steering_lost: u32 = "a number from 0 to 4294967295",
        /// Samples that the robot's services have missed of each other.
        bus_lost: u64 = "a number from 0 to 18446744073709551615",
        /// Gain of the line control on the error, if it has been set since the robot was new.
        gain_p: u8 = "a gain from 0 to 255",
        /// Gain of the line control on the change of the error, likewise.
        gain_d: u8 = "a gain from 0 to 255",
    }
}
