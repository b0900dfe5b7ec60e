//! The two ways this program ends. The board moves nothing that would have to be stopped.

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
