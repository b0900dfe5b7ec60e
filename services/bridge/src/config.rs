//! What the bridge is told at start.

use std::path::PathBuf;

use lager_ports::Policy;

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
            waiting: Policy::default(),
        }
    }
}
