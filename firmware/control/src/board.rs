//! What a board must offer to the code that decides.
//!
//! The traits stand apart so that decisions never name a pin (O7). Implementations move bits and
//! bytes and decide nothing. No call waits for anything from outside; reading a sensor takes as
//! long as its conversion.

use lager_wire::ResetCause;

/// How many bytes of EEPROM the boards use.
pub const EEPROM_LENGTH: u8 = 64;

/// What both boards have: a clock, the UART to the Pi, a watchdog.
pub trait Board {
    /// Microseconds since the board's start, wrapping.
    fn now_us(&self) -> u32;

    /// The oldest byte received from the Pi and not yet read.
    fn uart_read(&mut self) -> Option<u8>;

    /// Queues bytes to the Pi, all of them or none; whether they were queued.
    fn uart_write(&mut self, bytes: &[u8]) -> bool;

    /// Whether everything queued has left the board to its last stop bit.
    fn uart_idle(&self) -> bool;

    /// Why the board started.
    fn reset_cause(&self) -> ResetCause;

    /// Tells the watchdog that the loop is alive.
    fn kick_watchdog(&mut self);

    /// A byte of the EEPROM, 0..[`EEPROM_LENGTH`]; 255 where nothing was ever written. Asked for
    /// before the first write only.
    fn eeprom_read(&self, address: u8) -> u8;

    /// Begins to write a byte of the EEPROM, which keeps it without power; `false`, and nothing
    /// happens, while the one before is being written (some milliseconds).
    fn eeprom_write(&mut self, address: u8, value: u8) -> bool;
}

/// The sensor board: line sensors, IR ranger, the sending end of ExDe.
pub trait SensorBoard: Board {
    /// One line sensor, 0 = leftmost ..= 10 = rightmost; a high value is tape (S6). They are read
    /// in order, so a board may prepare the next one.
    fn read_line_sensor(&mut self, channel: u8) -> u8;

    /// The IR ranger, 0..=1023 for 0..5 V.
    fn read_ir(&mut self) -> u16;

    /// Begins to send a word to the steering board; it goes on beside everything else. `false`, and
    /// nothing happens, while another is under way or nobody has answered yet.
    fn exde_send(&mut self, word: u16) -> bool;

    /// Whether bits of a word are still to be sent.
    fn exde_is_sending(&self) -> bool;
}

/// The steering board: two motor drivers, the arm's servos, the receiving end of ExDe.
pub trait SteeringBoard: Board {
    /// Sets both motor drivers.
    fn set_motors(&mut self, left: Motor, right: Motor);

    /// The oldest word received and not yet read, and when its last bit came.
    fn exde_word(&mut self) -> Option<(u16, u32)>;

    /// Whether some bits of a word have come and others are still to come; never where words come
    /// whole.
    fn exde_is_receiving(&self) -> bool {
        false
    }

    /// Words lost to missing pulses, and disturbing pulses; stays at 255.
    fn exde_errors(&self) -> u8;

    /// Queues bytes to the servos, all or none; whether they were queued. The board mutes the echo
    /// (AMB-26).
    fn servo_write(&mut self, bytes: &[u8]) -> bool;

    /// The oldest byte a servo sent and not yet read.
    fn servo_read(&mut self) -> Option<u8>;

    /// The battery in tenths of a volt, 0 = unknown.
    fn battery_decivolts(&mut self) -> u8;
}

/// What one motor driver is to do. Forward is the robot's, not the driver's: the drivers are
/// mirrored, and which level of a DIR pin that means is the board's knowledge (W2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Motor {
    /// Duty, 0..=255 of full.
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
