//! `[buttons]`: the robot's own reset button and mode switch, as GPIO lines.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, bail};
use lager_bridge::buttons::ButtonsConfig;
use lager_orders::{Buttons, Contact, Level, SwitchKind};

use super::section::section;

/// The paths of chips, without their numbers.
const CHIPS: &str = "/dev/gpiochip";
/// The longest `debounce_ms`.
const LONGEST_DEBOUNCE_MS: u64 = 500;

section! {
    "buttons"
    /// The robot's own reset button and mode switch.
    pub struct ButtonsSection {
        /// The GPIO chip of the lines, such as /dev/gpiochip0. Unset, there are no buttons.
        /// `lager commission` finds all of this out.
        pub chip: Option<PathBuf> = None,
        /// The line of the reset button, by its offset. It says that the robot stands on the
        /// delivery node, looking into the warehouse.
        pub reset: Option<u8> = None,
        /// Where the pressed reset button pulls its line: "low", to ground, or "high", to 3.3 V.
        pub reset_closed: Level = Level::Low,
        /// Whether a press of reset at the delivery node also ends the stop with which real boards
        /// start, so that nobody needs a shell. If the robot did not know that it stands there,
        /// the second press does. A stop that a person or a fault has set stays.
        pub reset_starts: bool = true,
        /// The line of the mode switch or mode button.
        pub switch: Option<u8> = None,
        /// The same of the pressed mode button, or of the switch that stands at autonomous.
        pub switch_closed: Level = Level::Low,
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
            reset: contact(self.reset, self.reset_closed),
            switch: contact(self.switch, self.switch_closed),
            switch_kind: self.switch_kind,
            reset_starts: self.reset_starts,
            debounce: Duration::from_millis(self.debounce_ms),
        })
    }

    /// The buttons, as commissioning finds them out.
    pub fn commissioned(&self) -> Buttons {
        let mode = contact(self.switch, self.switch_closed);
        Buttons {
            chip: self.chip.as_deref().map_or(0, chip_number),
            reset: contact(self.reset, self.reset_closed),
            mode: mode.map(|mode| (mode, self.switch_kind)),
        }
    }

    /// Takes over what commissioning has found out. Where it has found nothing new, a chip with
    /// another name stays.
    pub fn take_commissioned(&mut self, found: &Buttons) {
        if *found == self.commissioned() {
            return;
        }
        let Buttons { chip, reset, mode } = *found;
        let usual = Self::default();
        let has_line = reset.is_some() || mode.is_some();
        self.chip = has_line.then(|| format!("{CHIPS}{chip}").into());
        self.reset = reset.map(|reset| reset.line);
        self.reset_closed = reset.map_or(usual.reset_closed, |reset| reset.closed);
        self.switch = mode.map(|(mode, _)| mode.line);
        self.switch_closed = mode.map_or(usual.switch_closed, |(mode, _)| mode.closed);
        self.switch_kind = mode.map_or(usual.switch_kind, |(_, kind)| kind);
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

fn contact(line: Option<u8>, closed: Level) -> Option<Contact> {
    line.map(|line| Contact { line, closed })
}

/// The number of a chip; 0 if its path has none.
fn chip_number(path: &Path) -> u8 {
    let name = path.to_str().and_then(|path| path.strip_prefix(CHIPS));
    name.and_then(|number| number.parse().ok()).unwrap_or(0)
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

    #[test]
    fn what_commissioning_finds_out_is_what_the_section_says_afterwards() {
        let contact = |line, closed| Contact { line, closed };
        let found = Buttons {
            chip: 4,
            reset: Some(contact(17, Level::High)),
            mode: Some((contact(27, Level::Low), SwitchKind::Press)),
        };
        let mut section = ButtonsSection {
            debounce_ms: 35,
            ..ButtonsSection::default()
        };
        section.take_commissioned(&found);
        assert_eq!(section.commissioned(), found);
        assert_eq!(section.chip, Some("/dev/gpiochip4".into()));
        assert_eq!(section.debounce_ms, 35, "what is not found out stays");
        section.take_commissioned(&Buttons::default());
        let none = ButtonsSection {
            debounce_ms: 35,
            ..ButtonsSection::default()
        };
        assert_eq!(section, none);
        // A person has named the chip otherwise, and nothing else was found out.
        let named = ButtonsSection {
            chip: Some("/dev/header".into()),
            reset: Some(5),
            ..none
        };
        let mut same = named.clone();
        same.take_commissioned(&named.commissioned());
        assert_eq!(same, named);
    }
}
