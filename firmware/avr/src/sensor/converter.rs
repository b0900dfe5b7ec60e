//! The ADC: converts eleven line sensors through one input, in turn, then the IR ranger (S5, S8).
//!
//! ```text
//!   sensor n   |-- sample --|------- convert, 13 us -------|-- sample n + 1 --| ... | IR ranger
//!   multiplexer              \ n + 1 settles meanwhile ----/
//!   program                                                 | judges n while n + 1 is converted
//! ```
//!
//! The ranger is converted after the last sensor in every pass, so a pass that needs it does not
//! wait.
//!
//! The clock of 1 MHz is faster than the datasheet allows for ten bits. Eight bits are exact, which
//! the line sensors need; the IR ranger's own noise is larger than the other two.

use avr_device::asm::delay_cycles;
use lager_avr::register::{adc, bit, get, put};

use crate::pins;

const ADEN: u8 = bit(7);
const ADSC: u8 = bit(6);
/// clk/16 = 1 MHz.
const PRESCALER_16: u8 = 0b100;
const ON: u8 = ADEN | PRESCALER_16;
const START: u8 = ON | ADSC;
/// Reference AVCC.
const AVCC: u8 = bit(6);
/// The upper eight bits in one register.
const LEFT_ADJUST: u8 = bit(5);

const LINE: u8 = AVCC | LEFT_ADJUST | pins::LINE_INPUT;
const IR: u8 = AVCC | pins::IR_INPUT;
/// Number of line sensors.
const CHANNELS: u8 = 11;
/// The converter needs one of its clocks to start and one and a half to sample; then the input may
/// change.
const SAMPLING_CYCLES: u32 = 42;

/// Switches the ADC on, with the first line sensor selected.
pub(crate) fn start() {
    let adc = adc();
    put(adc.didr0(), bit(pins::LINE_INPUT) | bit(pins::IR_INPUT));
    put(adc.admux(), LINE);
    put(adc.adcsra(), ON);
    pins::select_line_sensor(0);
    // The first conversion also sets the converter up and takes 25 clocks.
    put(adc.adcsra(), START);
    wait();
}

/// Reads a line sensor. The caller reads them in order: the first call starts a chain of
/// conversions, and each call starts the next one, which runs while the caller judges this reading.
pub(crate) fn read_line_sensor(channel: u8) -> u8 {
    if channel == 0 {
        put(adc().admux(), LINE);
        begin(0);
    }
    wait();
    let next = channel + 1;
    if next < CHANNELS {
        // The reading stays in the register until the next conversion ends.
        begin(next);
        return reading();
    }
    let last = reading();
    put(adc().admux(), IR);
    put(adc().adcsra(), START);
    last
}

/// The eight bits of a line sensor.
fn reading() -> u8 {
    (get(adc().adc()) >> 8) as u8
}

/// Starts to convert the selected sensor, and selects the next one as soon as the input is sampled.
fn begin(channel: u8) {
    put(adc().adcsra(), START);
    delay_cycles(SAMPLING_CYCLES);
    let next = channel + 1;
    pins::select_line_sensor(if next < CHANNELS { next } else { 0 });
}

/// The IR ranger, converted after the last line sensor.
pub(crate) fn read_ir() -> u16 {
    wait();
    get(adc().adc())
}

/// Waits until the running conversion ends, which takes only the converter's own time.
fn wait() {
    while get(adc().adcsra()) & ADSC != 0 {}
}
