//! `[buttons]`: the robot's own reset button and mode switch, as GPIO lines.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail};
use lager_bridge::buttons::{ButtonsConfig, SwitchKind};

use super::section::section;

/// The longest `debounce_ms`.
const LONGEST_DEBOUNCE_MS: u64 = 500;

section! {
    "buttons"
    /// The robot's own reset button and mode switch.
    pub struct ButtonsSection {
        /// The GPIO chip of the lines, such as /dev/gpiochip0. A closed contact pulls a line to
        /// ground. Unset, there are no buttons.
        pub chip: Option<PathBuf> = None,
        /// The line of the reset button, by its offset. It says that the robot stands on the
        /// delivery node, looking into the warehouse.
        pub reset: Option<u32> = None,
        /// Whether a press of reset at the delivery node also ends the stop with which real boards
        /// start, so that nobody needs a shell. If the robot did not know that it stands there,
        /// the second press does. A stop that a person or a fault has set stays.
        pub reset_starts: bool = true,
        /// The line of the mode switch or mode button.
        pub switch: Option<u32> = None,
        /// What it is: "position", a switch that stays where it is moved (open is manual, closed is
        /// autonomous), or "press", a button that springs back and toggles the mode. A switch is
        /// the default because everybody can see the mode by it.
        pub switch_kind: SwitchKind = SwitchKind::Position,
        /// For how many ms a contact must be steady, at most 500.
        pub debounce_ms: u64 = 20,
    }
}

impl ButtonsSection {
    /// The lines for the bridge, if there are any.
    pub fn lines(&self) -> Option<ButtonsConfig> {
        Some(ButtonsConfig {
            chip: self.chip.clone()?,
            reset: self.reset,
            switch: self.switch,
            switch_kind: self.switch_kind,
            reset_starts: self.reset_starts,
            debounce: Duration::from_millis(self.debounce_ms),
        })
    }

    /// Refuses lines that cannot work.
    ///
    /// # Errors
    /// The sentence names the key.
    pub fn validate(&self) -> Result<()> {
        let has_line = self.reset.is_some() || self.switch.is_some();
        if self.chip.is_some() != has_line {
            bail!(
                "[buttons] needs a chip and the line of a button on it: reset, switch or both; or none of them"
            );
        }
        if has_line && self.reset == self.switch {
            bail!("[buttons] reset and switch are the same line; each has one of its own");
        }
        if self.debounce_ms > LONGEST_DEBOUNCE_MS {
            bail!(
                "[buttons] debounce_ms is {}; at most {LONGEST_DEBOUNCE_MS} can be felt",
                self.debounce_ms
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_button_has_a_chip_and_a_line_of_its_own() {
        let chip = Some(PathBuf::from("/dev/gpiochip0"));
        let section = |chip: &Option<PathBuf>, reset, switch| ButtonsSection {
            chip: chip.clone(),
            reset,
            switch,
            ..ButtonsSection::default()
        };
        for (good, reset, switch) in [
            (&None, None, None),
            (&chip, Some(5), None),
            (&chip, Some(5), Some(6)),
        ] {
            assert!(section(good, reset, switch).validate().is_ok());
        }
        for (bad, reset, switch) in [
            (&None, Some(5), None),
            (&chip, None, None),
            (&chip, Some(5), Some(5)),
        ] {
            let error = section(bad, reset, switch).validate().expect_err("refused");
            assert!(error.to_string().contains("[buttons]"), "{error}");
        }
        assert_eq!(section(&None, None, None).lines(), None);
        let lines = section(&chip, Some(5), Some(6)).lines().expect("lines");
        assert_eq!(lines.debounce, Duration::from_millis(20));
    }
}
