//! The Pi's lines for the robot's buttons (B1, E14), as the wiring page proposes them. The
//! configuration decides: `[buttons]` names the lines that a robot really has.

/// A button of the robot, between a line of the Pi and ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Button {
    /// The key of `[buttons]` that names its line.
    pub key: &'static str,
    /// Its name.
    pub name: &'static str,
    /// The number of the Pi's GPIO, which is also the line's offset on its chip.
    pub line: u8,
    /// The line's pin on the Pi's 40-pin header.
    pub header: u8,
    /// The nearest ground pin on that header.
    pub ground: u8,
}

/// The GPIO chip of a Pi 3.
pub const CHIP: &str = "/dev/gpiochip0";

/// Both buttons.
pub const BUTTONS: [Button; 2] = [
    Button {
        key: "reset",
        name: "Reset button",
        line: 17,
        header: 11,
        ground: 9,
    },
    Button {
        key: "switch",
        name: "Mode switch",
        line: 27,
        header: 13,
        ground: 14,
    },
];
