//! The bridge's configuration.

use std::path::PathBuf;

use lager_wake::Policy;
use lager_wire::RobotProfile;

use crate::buttons::ButtonsConfig;
use crate::serial::find::DEVICES;

/// The bridge's configuration.
#[derive(Clone, Debug)]
pub struct BridgeConfig {
    /// Where the boards are.
    pub ports: Ports,
    /// Speed of both ports in baud: 500 000, or 9600 for boards built with the original's UBRR
    /// 103 (U17).
    pub baud: u32,
    /// Whether to go on from the state of an earlier bridge, which a supervisor hands over.
    pub resume: bool,
    /// Whether to ask the sensor board for its raw readings as well. They cost the sensor line one
    /// packet in three.
    pub raw_line: bool,
    /// Whether to drive an original steering board, whose commands have no age limit: if this
    /// process dies, it goes on with its last command. If false, such a board only gets standby.
    pub original_boards: bool,
    /// What the boards are told of their robot. Its owner has validated it.
    pub robot: RobotProfile,
    /// The reset button and the mode switch, if the robot has them.
    pub buttons: Option<ButtonsConfig>,
    /// How to wait for orders and reports.
    pub waiting: Policy,
}

/// Where the boards are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ports {
    /// At these two serial ports. It does not matter which board is at which port: the boards say
    /// who they are (U15).
    Named([PathBuf; 2]),
    /// Somewhere among the serial devices in this folder ([`crate::serial::find`]).
    Found(PathBuf),
}

impl Default for BridgeConfig {
    fn default() -> Self {
        Self {
            ports: Ports::Found(DEVICES.into()),
            baud: 500_000,
            resume: false,
            raw_line: false,
            original_boards: false,
            robot: RobotProfile::default(),
            buttons: None,
            waiting: Policy::default(),
        }
    }
}
