//! The two ways in which this program ends. The board has no motors to stop.

use avr_device::interrupt;
use core::panic::PanicInfo;
use lager_avr::reset;

#[avr_device::interrupt(atmega1284p)]
fn WDT() {
    reset::after_hang();
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    interrupt::disable();
    reset::after_panic();
}
