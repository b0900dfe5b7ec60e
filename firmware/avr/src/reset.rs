//! Finds out why the board started, serves the watchdog, and resets the board.
//!
//! ```text
//!   running --64 ms without a kick--> watchdog interrupt: board made safe --16 ms--> reset
//!   panic   --------------------------> board made safe, cause in RAM     --16 ms--> reset
//!   order   --------------------------> board made safe, cause in RAM     --16 ms--> reset
//! ```
//!
//! Behind a bootloader the reset flags are in GPIOR0, because the loader has to clear MCUSR. Without
//! one they are in MCUSR, and GPIOR0 is 0 after every reset.
//!
//! In the interrupt and in the panic handler the board's program makes the board safe.
//!
//! The watchdog waits 64 ms and not the specified 125 ms. If a loop hangs with interrupts off, only
//! the second time-out resets the board. 2 x 125 = 250 ms would exceed 200 ms, within which the
//! motors must be off; 2 x 64 = 128 ms does not, nor do 142 ms with an oscillator that is 10 %
//! slow. With interrupts on, the first time-out switches the motors off.

use avr_device::asm::{nop, wdr};
use avr_device::interrupt;
use core::arch::asm;
use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use lager_loader::entry;
use lager_wire::{ResetCause, ResetOrder};

use crate::register::{cpu, get, put};

/// The high byte of the mark that a program leaves in RAM for the next start. The low byte is the
/// code of the cause.
const MARK_HIGH: u8 = 0x9A;

const WDCE_WDE: u8 = 0b0001_1000;
/// Interrupt and reset, 64 ms.
const BITE_AFTER_64_MS: u8 = 0b0100_1010;
/// Reset alone, 16 ms.
const RESET_AFTER_16_MS: u8 = 0b0000_1000;
/// Address of WDTCSR.
const WDTCSR: u16 = 0x60;

struct Mark(UnsafeCell<MaybeUninit<u16>>);

// SAFETY: it is accessed only with interrupts off, before a reset and once after it.
unsafe impl Sync for Mark {}

/// RAM keeps its content over a reset, and the start-up code does not clear this section.
// SAFETY: the section holds nothing else and the cell's content may be anything.
#[unsafe(link_section = ".noinit")]
static MARK: Mark = Mark(UnsafeCell::new(MaybeUninit::uninit()));

/// Starts the watchdog and returns why the board started. Call it first, with interrupts off.
pub fn start() -> ResetCause {
    let flags = get(cpu().mcusr()) | get(cpu().gpior0());
    // The watchdog cannot be changed while its reset flag is set.
    put(cpu().mcusr(), 0);
    set_watchdog(BITE_AFTER_64_MS);
    // SAFETY: only this program uses the cell; any content of the RAM after power-on is a number.
    let [code, high] = unsafe { MARK.0.get().cast::<u16>().read_volatile() }.to_le_bytes();
    mark(0);
    let left = if high == MARK_HIGH {
        ResetCause::from_code(code)
    } else {
        None
    };
    lager_control::reset_cause(flags, left)
}

/// Tells the watchdog that the main loop is alive.
#[inline(always)]
pub fn kick_watchdog() {
    wdr();
}

/// Resets the board after its main loop hung; the caller has made the board safe.
pub fn after_hang() -> ! {
    reset()
}

/// Resets the board after a panic; the caller has made the board safe.
pub fn after_panic() -> ! {
    leave(ResetCause::Panic);
    reset()
}

/// Resets the board because the Pi has told it to; the caller has made the board safe.
pub fn on_order(order: ResetOrder) -> ! {
    interrupt::disable();
    leave(ResetCause::Ordered);
    if order == ResetOrder::Loader {
        // SAFETY: the place is in RAM. It was part of the stack, to which nobody returns.
        unsafe { (entry::MARK_AT as *mut u32).write_volatile(entry::MARK) };
    }
    reset()
}

/// Whether the mark for the loader is in RAM, and removes it. Only the loader calls this.
pub fn take_loader_mark() -> bool {
    let place = entry::MARK_AT as *mut u32;
    // SAFETY: the place is in RAM, above the loader's stack; any content of it is a number.
    unsafe {
        let is_there = place.read_volatile() == entry::MARK;
        place.write_volatile(0);
        is_there
    }
}

/// Switches the watchdog off. MCUSR is clear and interrupts are off.
pub fn stop_watchdog() {
    set_watchdog(0);
}

fn leave(cause: ResetCause) {
    mark(u16::from_le_bytes([cause.code(), MARK_HIGH]));
}

fn reset() -> ! {
    interrupt::disable();
    set_watchdog(RESET_AFTER_16_MS);
    loop {
        nop();
    }
}

fn mark(value: u16) {
    // SAFETY: interrupts are off, here and at every other use.
    unsafe { MARK.0.get().cast::<u16>().write_volatile(value) };
}

/// The timed sequence: writes the new value within four cycles of WDCE. Interrupts are off.
fn set_watchdog(value: u8) {
    wdr();
    // SAFETY: two writes to the watchdog's register, which memory safety does not depend on.
    unsafe {
        asm!(
            "sts {register}, {enable}",
            "sts {register}, {value}",
            register = const WDTCSR,
            enable = in(reg) WDCE_WDE,
            value = in(reg) value,
        );
    }
}
