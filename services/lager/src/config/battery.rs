//! The section `[battery]`: whether the steering board can measure the battery.

use super::section::section;

section! {
    "battery"
    /// The battery's voltage at the steering board, which is told at every start.
    pub struct BatterySection {
        /// Whether a divider (30 kOhm over 10 kOhm) takes a quarter of the battery's voltage to the
        /// board's input. Without one the input floats, and its voltage means nothing. Unset, real
        /// boards have none, and a simulated or emulated robot has one.
        pub divider: Option<bool> = None,
    }
}
