//! `memcpy`, `memmove` and `memset`, which the compiler's code calls.
//!
//! The compiler's own versions take 1.2 kB of flash and 10 cycles a byte, because they are made for
//! wide machines. These here are loops of four instructions, with 8 cycles a byte for a copy.

use core::arch::asm;
use core::ffi::c_void;

/// Copies `length` bytes upwards.
///
/// # Safety
/// As C's `memcpy`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn memcpy(
    to: *mut c_void,
    from: *const c_void,
    length: usize,
) -> *mut c_void {
    if length > 0 {
        // SAFETY: by the caller's promise both areas hold `length` bytes.
        unsafe {
            asm!(
                "2:",
                "ld {byte}, Z+",
                "st X+, {byte}",
                "sbiw {left}, 1",
                "brne 2b",
                byte = out(reg) _,
                left = inout(reg_iw) length => _,
                inout("Z") from => _,
                inout("X") to => _,
            );
        }
    }
    to
}

/// Copies `length` bytes between areas that may overlap.
///
/// # Safety
/// As C's `memmove`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn memmove(
    to: *mut c_void,
    from: *const c_void,
    length: usize,
) -> *mut c_void {
    if (to as usize) <= from as usize {
        // SAFETY: a copy upwards never overwrites what it still has to read.
        return unsafe { memcpy(to, from, length) };
    }
    if length > 0 {
        // SAFETY: by the caller's promise both areas hold `length` bytes; a copy downwards never
        // overwrites what it still has to read.
        unsafe {
            asm!(
                "2:",
                "ld {byte}, -Z",
                "st -X, {byte}",
                "sbiw {left}, 1",
                "brne 2b",
                byte = out(reg) _,
                left = inout(reg_iw) length => _,
                inout("Z") from.wrapping_byte_add(length) => _,
                inout("X") to.wrapping_byte_add(length) => _,
            );
        }
    }
    to
}

/// Sets `length` bytes.
///
/// # Safety
/// As C's `memset`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn memset(to: *mut c_void, value: i16, length: usize) -> *mut c_void {
    if length > 0 {
        // SAFETY: by the caller's promise the area holds `length` bytes.
        unsafe {
            asm!(
                "2:",
                "st X+, {byte}",
                "sbiw {left}, 1",
                "brne 2b",
                byte = in(reg) value as u8,
                left = inout(reg_iw) length => _,
                inout("X") to => _,
            );
        }
    }
    to
}
