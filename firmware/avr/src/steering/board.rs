//! Implements `lager-control`'s traits of the steering board.

use lager_avr::{clock, eeprom, reset, uart};
use lager_control::{Board, Motor, SteeringBoard};
use lager_wire::{ResetCause, ResetOrder};

use crate::{battery, exde, motors, servos};

/// The board.
pub(crate) struct SteeringPins {
    cause: ResetCause,
}

impl SteeringPins {
    /// The board; its hardware is set up.
    pub(crate) fn new(cause: ResetCause) -> Self {
        Self { cause }
    }
}

impl Board for SteeringPins {
    fn now_us(&self) -> u32 {
        clock::now_us()
    }

    fn uart_read(&mut self) -> Option<u8> {
        uart::read()
    }

    fn uart_write(&mut self, bytes: &[u8]) -> bool {
        uart::write(bytes)
    }

    fn uart_idle(&self) -> bool {
        uart::is_idle()
    }

    fn reset_cause(&self) -> ResetCause {
        self.cause
    }

    fn reset(&mut self, order: ResetOrder) {
        reset::on_order(order);
    }

    fn kick_watchdog(&mut self) {
        reset::kick_watchdog();
    }

    fn eeprom_read(&self, address: u8) -> u8 {
        eeprom::read(address.into())
    }

    fn eeprom_write(&mut self, address: u8, value: u8) -> bool {
        eeprom::write(address.into(), value)
    }
}

impl SteeringBoard for SteeringPins {
    fn set_motors(&mut self, left: Motor, right: Motor) {
        motors::set(left, right);
    }

    fn exde_word(&mut self) -> Option<(u16, u32)> {
        exde::word()
    }

    fn exde_is_receiving(&self) -> bool {
        exde::is_receiving()
    }

    fn exde_errors(&self) -> u8 {
        exde::errors()
    }

    fn servo_write(&mut self, bytes: &[u8]) -> bool {
        servos::write(bytes)
    }

    fn servo_read(&mut self) -> Option<u8> {
        servos::read()
    }

    fn battery_decivolts(&mut self) -> u8 {
        battery::decivolts()
    }
}
