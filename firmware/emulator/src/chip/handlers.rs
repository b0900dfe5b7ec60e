//! simavr calls these functions when the program uses a USART's registers or leaves its interrupt.

use core::ffi::c_void;
use std::rc::Rc;

use simavr_ffi as ffi;

use super::usarts::{UBRRH, UBRRL, UCSRA, UCSRB, UCSRC, UDR, UsartId};
use super::{Chip, WriteHandler, chip};

impl Chip {
    /// Replaces simavr's handlers of the USARTs' registers.
    pub(super) fn hook_serial(self: &Rc<Self>) {
        for usart in UsartId::BOTH {
            let port = self.ports.port(usart);
            let param = self.param();
            // SAFETY: the addresses are those of I/O registers, the callbacks have simavr's
            // signatures, and the chip outlives its simavr half.
            unsafe {
                let io =
                    |offset: u8| &raw mut (*self.avr).io[usize::from(usart.base() + offset) - 32];
                for (offset, read, write) in [
                    (
                        UCSRA,
                        Some(on_read_status as ReadHandler),
                        Some(on_write_status as WriteHandler),
                    ),
                    (UCSRB, None, Some(on_write_control as WriteHandler)),
                    (UCSRC, None, None),
                    (UBRRL, None, None),
                    (UBRRH, None, None),
                    (
                        UDR,
                        Some(on_read_data as ReadHandler),
                        Some(on_write_data as WriteHandler),
                    ),
                ] {
                    (*io(offset)).r.c = read;
                    (*io(offset)).r.param = param;
                    (*io(offset)).w.c = write;
                    (*io(offset)).w.param = param;
                }
                for vector in port.vectors() {
                    let irq = &raw mut (*vector).irq[ffi::AVR_INT_IRQ_RUNNING as usize];
                    ffi::avr_irq_register_notify(irq, Some(on_running), param);
                }
            }
        }
    }
}

type ReadHandler = unsafe extern "C" fn(*mut ffi::avr_t, u16, *mut c_void) -> u8;

unsafe extern "C" fn on_read_status(_: *mut ffi::avr_t, address: u16, param: *mut c_void) -> u8 {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.register(address as u8)
}

unsafe extern "C" fn on_write_status(
    _: *mut ffi::avr_t,
    address: u16,
    value: u8,
    param: *mut c_void,
) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.write_status(UsartId::of(address), value);
}

unsafe extern "C" fn on_write_control(
    _: *mut ffi::avr_t,
    address: u16,
    value: u8,
    param: *mut c_void,
) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.write_control(UsartId::of(address), value);
}

unsafe extern "C" fn on_read_data(_: *mut ffi::avr_t, address: u16, param: *mut c_void) -> u8 {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.read_data(UsartId::of(address))
}

unsafe extern "C" fn on_write_data(
    _: *mut ffi::avr_t,
    address: u16,
    value: u8,
    param: *mut c_void,
) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.write_data(UsartId::of(address), value);
}

/// An interrupt of a USART was entered (1) or left (0).
unsafe extern "C" fn on_running(_: *mut ffi::avr_irq_t, value: u32, param: *mut c_void) {
    if value == 0 {
        // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
        let chip = unsafe { chip(param) };
        for usart in UsartId::BOTH {
            chip.sync(usart);
        }
    }
}
