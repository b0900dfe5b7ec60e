//! `[serial]`: the cables to the boards.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use lager_bridge::Ports;
use lager_bridge::serial::find::DEVICES;

use super::section::section;

/// The baud rates of the boards: today's, and the original's (UBRR 103).
pub const BAUD_RATES: [u32; 2] = [500_000, 9_600];

section! {
    "serial"
    /// The cables to the boards. Without names of ports, the robot listens to each serial device
    /// (ttyUSB*, ttyACM*) that nobody uses, until both boards have said who they are. It writes to
    /// none that has not spoken as a board.
    pub struct SerialSection {
        /// The ports of the boards, both or none; it does not matter which board is at which port.
        pub sensor: Option<PathBuf> = None,
        pub steering: Option<PathBuf> = None,
        /// The folder with the serial devices, or with links to those of this robot.
        pub devices: PathBuf = DEVICES.into(),
        /// Baud rate of both: 500000, or 9600 for boards of the original build.
        pub baud: u32 = BAUD_RATES[0],
        /// Whether the sensor board also sends which of its eleven sensors see tape, for the view
        /// *Line* and for programs. Unset, it does at 500000 Bd, where these bits make a frame
        /// 0.2 ms later, and not at 9600 Bd, where they would take 11 ms.
        pub raw_line: Option<bool> = None,
        /// Whether to drive an original steering board. Its commands have no age limit. Boards of
        /// this project stop the wheels within 200 ms whatever dies; an original board goes on with
        /// its last command until the bridge, or its power switch, makes it stand. If false, the
        /// bridge only makes such a board stand.
        pub original_boards: bool = false,
    }
}

impl SerialSection {
    /// The ports that the configuration names; `None` if the boards have to be found.
    pub fn named(&self) -> Option<[PathBuf; 2]> {
        Some([self.sensor.clone()?, self.steering.clone()?])
    }

    /// Where the boards are.
    pub fn ports(&self) -> Ports {
        let found = || Ports::Found(self.devices.clone());
        self.named().map_or_else(found, Ports::Named)
    }

    /// The ports, for what stands for the boards at them.
    pub fn links(&self) -> Result<[PathBuf; 2]> {
        self.named()
            .context("[serial] has to name the ports at which the boards are simulated")
    }

    /// Whether the sensor board is to send its raw readings.
    pub fn tells_raw_line(&self) -> bool {
        self.raw_line.unwrap_or(self.baud == BAUD_RATES[0])
    }

    /// Refuses cables that cannot be used. The error is a sentence.
    pub fn validate(&self) -> Result<()> {
        if !BAUD_RATES.contains(&self.baud) {
            let [usual, slow] = BAUD_RATES;
            bail!(
                "[serial] baud is {}; boards are built for {usual}, or for {slow} as the original ones",
                self.baud
            );
        }
        if self.sensor.is_some() != self.steering.is_some() {
            bail!(
                "[serial] names the port of one board only; name both, or none, and the robot finds them"
            );
        }
        Ok(())
    }
}
