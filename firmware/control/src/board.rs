//! The board's hardware as traits, which the decisions of both boards use.
//!
//! Decisions never name a pin (O7): a chip or the simulator implements these traits by moving bits
//! and bytes, and decides nothing. No call waits for anything outside; reading a sensor takes as
//! long as its conversion.

use lager_wire::{ResetCause, ResetOrder};

/// How many bytes of EEPROM the boards use.
pub const EEPROM_LENGTH: u8 = 192;

/// What both boards have: a clock, the UART to the Pi, a watchdog.
pub trait Board {
    /// Microseconds since the board's start, wrapping.
    fn now_us(&self) -> u32;

    /// The oldest received byte that nobody has read.
    fn uart_read(&mut self) -> Option<u8>;

    /// Queues all bytes for the Pi, or none; returns whether it did.
    fn uart_write(&mut self, bytes: &[u8]) -> bool;

    /// Whether the last stop bit of everything queued has left the board.
    fn uart_idle(&self) -> bool;

    /// Why the board started.
    fn reset_cause(&self) -> ResetCause;

    /// Resets the board; a chip does not return from it. The caller has made the board safe.
    fn reset(&mut self, order: ResetOrder);

    /// Tells the watchdog that the loop is alive.
    fn kick_watchdog(&mut self);

    /// A byte of the EEPROM, 0..[`EEPROM_LENGTH`]; 255 if nothing was ever written there. The
    /// boards read only before their first write.
    fn eeprom_read(&self, address: u8) -> u8;

    /// Begins to write a byte of the EEPROM, which keeps it without power. `false`: nothing
    /// happens, because the write before still runs (some milliseconds).
    fn eeprom_write(&mut self, address: u8, value: u8) -> bool;
}

/// The sensor board: line sensors, IR ranger, the transmitter of ExDe.
pub trait SensorBoard: Board {
    /// One line sensor, 0 = leftmost ..= 10 = rightmost; a high value is tape (S6). The caller
    /// reads them in order, so a board can prepare the next one.
    fn read_line_sensor(&mut self, channel: u8) -> u8;

    /// The IR ranger's voltage, 0..=1023 for 0..5 V.
    fn read_ir(&mut self) -> u16;

    /// Begins to send a word to the steering board; interrupts send its bits. `false`: nothing
    /// happens, because another word is under way or the steering board has never answered.
    fn exde_send(&mut self, word: u16) -> bool;

    /// Whether bits of a word are still to be sent.
    fn exde_is_sending(&self) -> bool;
}

/// The steering board: two motor drivers, the arm's servos, the receiver of ExDe.
pub trait SteeringBoard: Board {
    /// Sets both motor drivers.
    fn set_motors(&mut self, left: Motor, right: Motor);

    /// The oldest unread word, and the time at which its last bit came.
    fn exde_word(&mut self) -> Option<(u16, u32)>;

    /// Whether a word is half received; always `false` on a board that receives whole words.
    fn exde_is_receiving(&self) -> bool {
        false
    }

    /// Words lost to missing pulses plus disturbing pulses; stays at 255.
    fn exde_errors(&self) -> u8;

    /// Queues all bytes for the servos, or none; returns whether it did. The board mutes the echo
    /// (AMB-26).
    fn servo_write(&mut self, bytes: &[u8]) -> bool;

    /// The oldest byte from a servo that nobody has read.
    fn servo_read(&mut self) -> Option<u8>;

    /// The battery in tenths of a volt, 0 = unknown.
    fn battery_decivolts(&mut self) -> u8;
}

/// Duties of both sides, left first.
pub(crate) type Motors = (Motor, Motor);

/// The order to one motor driver. "Forward" is the robot's direction: the drivers are mirrored, and
/// only the board knows which level of a DIR pin means forward (W2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Motor {
    /// Duty, 0..=255 of full power.
    pub duty: u8,
    /// Whether this side's wheels turn backwards.
    pub reverse: bool,
}

impl Motor {
    /// Standing still.
    pub const OFF: Self = Self {
        duty: 0,
        reverse: false,
    };

    /// Driving the robot forwards.
    #[must_use]
    pub const fn forward(duty: u8) -> Self {
        Self {
            duty,
            reverse: false,
        }
    }

    /// Driving the robot backwards.
    #[must_use]
    pub const fn backward(duty: u8) -> Self {
        Self {
            duty,
            reverse: true,
        }
    }
}
