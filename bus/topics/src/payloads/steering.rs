//! What the steering board is told and what it reports: `steering/command`, `steering/state`.

use super::SERVO_UNKNOWN;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// On whose behalf a command is given.
    pub enum Origin {
        /// The navigator.
        Logic = 0,
        /// A person, or a script in a person's place.
        Operator = 1,
    }
}

coded! {
    /// What an order asks of the bridge.
    pub enum OrderKind {
        /// Carry out `code`.
        Drive = 0,
        /// Stop now and stay stopped until resumed.
        Stop = 1,
    }
}

coded! {
    /// How an order ended.
    pub enum Finish {
        /// Nothing has ended yet.
        None = 0,
        /// It was carried out.
        Done = 1,
        /// It was cut short.
        Aborted = 2,
        /// It was not begun.
        Refused = 3,
    }
}

payload! {
    /// An order to the arbiter in the bridge.
    pub struct SteeringOrder: 8 bytes {
        /// The same id renews the lease, a new id executes.
        pub id: u32,
        /// Who gives it.
        pub origin: Tag<Origin>,
        /// What is asked.
        pub kind: Tag<OrderKind>,
        /// The firmware's command code; without meaning for a stop.
        pub code: u8,
        /// 1 while logic stands at a pick station and lets the operator move the arm.
        pub arm_granted: u8,
    }
}

payload! {
    /// The steering board's report, with the arm's servos as last heard.
    pub struct SteeringReport: 56 bytes {
        /// Which life of the link to the board this came from.
        pub link_epoch: u32,
        /// The order that ended last.
        pub finished_id: u32,
        /// The order the board is on.
        pub current_id: u32,
        /// Who gave the order that ended last.
        pub finished_origin: Tag<Origin>,
        /// Who gave the order the board is on.
        pub current_origin: Tag<Origin>,
        /// How the last order ended.
        pub finish: Tag<Finish>,
        /// The command code the board reports.
        pub code: u8,
        /// Duty of the left motor, 0..=255.
        pub left_duty: u8,
        /// Duty of the right motor, 0..=255.
        pub right_duty: u8,
        /// The board's flags as on the wire.
        pub flags: u8,
        /// Line error in half sensor steps, positive = the line is to the right.
        pub line_error: i8,
        /// Error bits of the servos, combined.
        pub servo_errors: u8,
        /// Battery in tenths of a volt, 0 = unknown.
        pub battery_decivolts: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 2],
        /// Position 0..=1023 of servo n at index n - 1, `0xFFFF` = not heard yet.
        pub servo_position: [u16; 8] = [SERVO_UNKNOWN; 8],
        /// Load -1023..=1023 of servo n at index n - 1.
        pub servo_load: [i16; 8],
    }
}
