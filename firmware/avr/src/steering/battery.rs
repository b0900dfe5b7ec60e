//! The battery's voltage: the ADC converts again and again, and a reader takes the newest reading.

use lager_avr::register::{adc, bit, get, put};

use crate::pins;

/// On, started, free running, clk/128: one reading every 104 us.
const FREE_RUNNING: u8 = bit(7) | bit(6) | bit(5) | 0b111;
/// Reference AVCC, the upper eight bits in one register.
const AVCC_LEFT_ADJUST: u8 = bit(6) | bit(5);

/// Starts the readings.
pub(crate) fn start() {
    let adc = adc();
    put(adc.didr0(), bit(pins::BATTERY_INPUT));
    put(adc.admux(), AVCC_LEFT_ADJUST | pins::BATTERY_INPUT);
    put(adc.adcsra(), FREE_RUNNING);
}

/// The battery in tenths of a volt: 20 V at full scale.
pub(crate) fn decivolts() -> u8 {
    let reading = get(adc().adc()) >> 8;
    (reading * 25 / 32) as u8
}
