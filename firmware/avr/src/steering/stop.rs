//! The two ways in which this program ends: the main loop hangs, or the program panics. Both stop
//! the motors first.

use avr_device::interrupt;
use core::panic::PanicInfo;
use lager_avr::reset;

use crate::motors;

#[avr_device::interrupt(atmega1284p)]
fn WDT() {
    motors::off();
    reset::after_hang();
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    interrupt::disable();
    motors::off();
    reset::after_panic();
}
