//! What the bridge is told at start.

use std::path::PathBuf;

use lager_ports::Policy;
use lager_wire::ArmProfile;

use crate::buttons::ButtonsConfig;

/// What the bridge is told at start.
#[derive(Clone, Debug)]
pub struct BridgeConfig {
    /// The ports of the sensor board and of the steering board. Given the wrong way round the
    /// robot works all the same: the boards tell who they are (U15).
    pub ports: [PathBuf; 2],
    /// Speed of both ports in baud: 500 000, or 9600 for boards built with the original's UBRR
    /// 103 (U17).
    pub baud: u32,
    /// Take up the state of an earlier life of the bridge, which a supervisor hands over.
    pub resume: bool,
    /// Ask the sensor board for its raw readings besides the line's state. They cost the sensor
    /// line one packet in three.
    pub raw_line: bool,
    /// Drive an original steering board, whose commands have no age limit: if this process dies,
    /// it goes on with what it was told last. Else such a board is told standby only.
    pub original_boards: bool,
    /// What the arm may do, as the steering board is told. Its owner has validated it.
    pub arm: ArmProfile,
    /// The reset button and the mode switch, where the robot has any.
    pub buttons: Option<ButtonsConfig>,
    /// How to wait for orders and reports.
    pub waiting: Policy,
}

impl Default for BridgeConfig {
    fn default() -> Self {
        Self {
            ports: [
                PathBuf::from("/dev/lager-sensor"),
                PathBuf::from("/dev/lager-steering"),
            ],
            baud: 500_000,
            resume: false,
            raw_line: false,
            original_boards: false,
            arm: ArmProfile::default(),
            buttons: None,
            waiting: Policy::default(),
        }
    }
}
