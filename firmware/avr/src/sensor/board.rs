//! Implements `lager-control`'s traits of the sensor board.

use lager_avr::{clock, eeprom, reset, uart};
use lager_control::{Board, SensorBoard};
use lager_wire::{ResetCause, ResetOrder};

use crate::{converter, exde};

/// The board.
pub(crate) struct SensorPins {
    cause: ResetCause,
}

impl SensorPins {
    /// The board; its hardware is set up.
    pub(crate) fn new(cause: ResetCause) -> Self {
        Self { cause }
    }
}

impl Board for SensorPins {
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

impl SensorBoard for SensorPins {
    fn read_line_sensor(&mut self, channel: u8) -> u8 {
        converter::read_line_sensor(channel)
    }

    fn read_ir(&mut self) -> u16 {
        converter::read_ir()
    }

    fn exde_send(&mut self, word: u16) -> bool {
        exde::send(word)
    }

    fn exde_is_sending(&self) -> bool {
        exde::is_sending()
    }
}
