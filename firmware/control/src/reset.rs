//! Finds out why a board started, from what the chip and the program before it left.

use lager_wire::ResetCause;

const POWER_ON: u8 = 1 << 0;
const EXTERNAL: u8 = 1 << 1;
const BROWN_OUT: u8 = 1 << 2;
const WATCHDOG: u8 = 1 << 3;
const JTAG: u8 = 1 << 4;

/// The cause that the ATmega's reset flags (`MCUSR`) show. `left` is the cause that the program left
/// in RAM before it let the watchdog reset the board; after power-on the RAM holds nothing useful.
///
/// Flags stay set until the program clears them, so there may be several: the strongest counts.
#[must_use]
pub const fn reset_cause(flags: u8, left: Option<ResetCause>) -> ResetCause {
    if flags & POWER_ON != 0 {
        ResetCause::PowerOn
    } else if flags & BROWN_OUT != 0 {
        ResetCause::BrownOut
    } else if flags & WATCHDOG != 0 {
        match left {
            Some(cause) => cause,
            None => ResetCause::Watchdog,
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
            assert_eq!(reset_cause(flags, None), cause, "flags {flags:05b}");
        }
    }

    #[test]
    fn what_the_program_left_is_believed_only_after_the_watchdog() {
        for left in [ResetCause::Panic, ResetCause::Ordered] {
            assert_eq!(reset_cause(0b0_1000, Some(left)), left);
        }
        for (flags, cause) in [
            (0b0_0001, ResetCause::PowerOn),
            (0b0_0010, ResetCause::External),
            (0b0_0100, ResetCause::BrownOut),
            (0b0_1001, ResetCause::PowerOn),
        ] {
            assert_eq!(
                reset_cause(flags, Some(ResetCause::Panic)),
                cause,
                "flags {flags:05b}"
            );
        }
    }
}
