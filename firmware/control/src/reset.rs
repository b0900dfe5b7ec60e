//! Finds out why a board started, from what the chip and the program before it left.

use lager_wire::ResetCause;

const POWER_ON: u8 = 1 << 0;
const EXTERNAL: u8 = 1 << 1;
const BROWN_OUT: u8 = 1 << 2;
const WATCHDOG: u8 = 1 << 3;
const JTAG: u8 = 1 << 4;

/// The cause that the ATmega's reset flags (`MCUSR`) show. `panicked` is the mark that a panic
/// leaves in RAM before the watchdog resets the board; after power-on the RAM holds nothing useful.
///
/// Flags stay set until the program clears them, so there may be several: the strongest counts.
#[must_use]
pub const fn reset_cause(flags: u8, panicked: bool) -> ResetCause {
    if flags & POWER_ON != 0 {
        ResetCause::PowerOn
    } else if flags & BROWN_OUT != 0 {
        ResetCause::BrownOut
    } else if flags & WATCHDOG != 0 {
        if panicked {
            ResetCause::Panic
        } else {
            ResetCause::Watchdog
        }
    } else if flags & EXTERNAL != 0 {
        ResetCause::External
    } else if flags & JTAG != 0 {
        ResetCause::Jtag
    } else {
        ResetCause::Unknown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flag_has_its_cause() {
        for (flags, cause) in [
            (0b0_0000, ResetCause::Unknown),
            (0b0_0001, ResetCause::PowerOn),
            (0b0_0010, ResetCause::External),
            (0b0_0100, ResetCause::BrownOut),
            (0b0_1000, ResetCause::Watchdog),
            (0b1_0000, ResetCause::Jtag),
        ] {
            assert_eq!(reset_cause(flags, false), cause, "flags {flags:05b}");
        }
    }

    #[test]
    fn a_panic_is_believed_only_after_the_watchdog() {
        assert_eq!(reset_cause(0b0_1000, true), ResetCause::Panic);
        for (flags, cause) in [
            (0b0_0001, ResetCause::PowerOn),
            (0b0_0010, ResetCause::External),
            (0b0_0100, ResetCause::BrownOut),
            (0b0_1001, ResetCause::PowerOn),
        ] {
            assert_eq!(reset_cause(flags, true), cause, "flags {flags:05b}");
        }
    }
}
