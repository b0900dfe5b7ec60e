//! The low-latency flag of a serial driver: without it some USB adapters collect received bytes for
//! 16 ms.
//!
//! This file stands apart because only here the bridge needs `unsafe`: the two requests
//! `TIOCGSERIAL` and `TIOCSSERIAL` have no safe wrapper. Drivers without the flag, such as pseudo
//! terminals, stay as they are.
#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_uchar, c_uint, c_ulong, c_ushort};
use std::os::fd::OwnedFd;

use rustix::ioctl::{Getter, Opcode, Setter, ioctl};

const TIOCGSERIAL: Opcode = 0x541E;
const TIOCSSERIAL: Opcode = 0x541F;
const ASYNC_LOW_LATENCY: c_int = 1 << 13;

/// `struct serial_struct` of the kernel's `linux/serial.h`.
#[repr(C)]
#[derive(Clone, Copy)]
struct SerialStruct {
    kind: c_int,
    line: c_int,
    port: c_uint,
    irq: c_int,
    flags: c_int,
    xmit_fifo_size: c_int,
    custom_divisor: c_int,
    baud_base: c_int,
    close_delay: c_ushort,
    io_type: c_char,
    reserved_char: [c_char; 1],
    hub6: c_int,
    closing_wait: c_ushort,
    closing_wait2: c_ushort,
    iomem_base: *mut c_uchar,
    iomem_reg_shift: c_ushort,
    port_high: c_uint,
    iomap_base: c_ulong,
}

/// Asks the driver for low latency. Returns whether it is in force.
pub(super) fn request(fd: &OwnedFd) -> bool {
    // SAFETY: TIOCGSERIAL writes one `serial_struct` to its argument, and `SerialStruct` has that
    // layout and accepts any bit pattern.
    let current = unsafe { ioctl(fd, Getter::<TIOCGSERIAL, SerialStruct>::new()) };
    let Ok(mut settings) = current else {
        return false;
    };
    if settings.flags & ASYNC_LOW_LATENCY != 0 {
        return true;
    }
    settings.flags |= ASYNC_LOW_LATENCY;
    // SAFETY: TIOCSSERIAL reads one `serial_struct` from its argument; this one is what the driver
    // reported, with one flag more that any user may set.
    unsafe { ioctl(fd, Setter::<TIOCSSERIAL, SerialStruct>::new(settings)) }.is_ok()
}
