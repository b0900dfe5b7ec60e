//! The motors' PWM: timer 2 with 8 bits at 7.8 kHz, so a new duty acts within 128 us (W1, AMB-23).
//!
//! A fast PWM makes a pulse of one tick even at duty 0. So a standing motor's output is
//! disconnected from the timer, and the port holds its pin low.

use avr_device::interrupt;
use lager_avr::register::{put, timer2};
use lager_control::Motor;

use crate::pins;

const FAST_PWM: u8 = 0b0000_0011;
const CS_8: u8 = 0b010;
const LEFT_CONNECTED: u8 = 0b1000_0000;
const RIGHT_CONNECTED: u8 = 0b0010_0000;

/// Starts the timer with both outputs disconnected.
pub(crate) fn start() {
    put(timer2().tccr2a(), FAST_PWM);
    put(timer2().tccr2b(), CS_8);
}

/// Switches both motors off at once.
pub(crate) fn off() {
    put(timer2().tccr2a(), FAST_PWM);
}

/// Sets both drivers together.
pub(crate) fn set(left: Motor, right: Motor) {
    let connected = |motor: Motor, output| if motor.duty > 0 { output } else { 0 };
    let outputs = connected(left, LEFT_CONNECTED) | connected(right, RIGHT_CONNECTED);
    interrupt::free(|_| {
        pins::set_directions(left.reverse, right.reverse);
        put(timer2().ocr2a(), left.duty);
        put(timer2().ocr2b(), right.duty);
        put(timer2().tccr2a(), FAST_PWM | outputs);
    });
}
