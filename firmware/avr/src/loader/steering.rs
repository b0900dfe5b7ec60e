//! The steering board's bootloader.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

mod application;
mod flash;
mod protocol;
mod start;
mod stay;

use lager_avr::reset;
use lager_wire::Callsign;

/// The first instructions jump here, with interrupts off.
#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    let cause = protocol::take_cause();
    reset::stop_watchdog();
    let is_asked = protocol::is_asked(cause);
    protocol::run(Callsign::Steering, cause, is_asked)
}
