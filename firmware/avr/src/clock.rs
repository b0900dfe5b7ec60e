//! The board's clock: microseconds since the start, and sleep until something happens.
//!
//! ```text
//!   timer 1   clk/8, half a microsecond a tick, free running
//!     overflow    every 32.768 ms, carried into the clock
//!     compare A   ends the sleep when the main loop is wanted
//!     compare B   left to the board's ExDe
//! ```

use avr_device::interrupt;

use crate::register::{bit, cpu, get, put, timer1};
use crate::shared::{Shared, SharedByte};

const TOV: u8 = bit(0);
const OCF_A: u8 = bit(1);
const OCF_B: u8 = bit(2);
const CS_8: u8 = 0b010;
const SLEEP_ENABLE_IDLE: u8 = 0b0000_0001;

/// Ticks of the timer in one microsecond.
pub const TICKS_PER_US: u16 = 2;

/// Microseconds of one round of the timer.
const ROUND_US: u32 = 1 << 15;
/// The longest sleep that the compare unit can time; for more, the caller sleeps again.
const LONGEST_US: u32 = 30_000;
/// A time nearer than this would pass before the compare unit is set.
const SHORTEST_US: u32 = 6;

/// Microseconds at the timer's last overflow.
static BASE_US: Shared<u32> = Shared::new(0);
/// 1 after an interrupt with news for the main loop.
static EVENT: SharedByte = SharedByte::new(0);

/// Starts the clock. Interrupts are still off.
pub fn start() {
    let timer = timer1();
    put(timer.tccr1a(), 0);
    put(timer.tccr1b(), CS_8);
    put(timer.timsk1(), TOV | OCF_A);
    put(cpu().smcr(), SLEEP_ENABLE_IDLE);
}

/// Microseconds since [`start`], wrapping.
#[inline(never)]
pub fn now_us() -> u32 {
    BASE_US.with(|base_us| {
        let timer = timer1();
        let ticks = get(timer.tcnt1());
        // An overflow may still wait for its interrupt.
        let carried = get(timer.tifr1()) & TOV != 0 && ticks < 1 << 15;
        let base_us = if carried {
            base_us.wrapping_add(ROUND_US)
        } else {
            *base_us
        };
        base_us.wrapping_add(u32::from(ticks >> 1))
    })
}

/// The timer's ticks, half a microsecond each, wrapping after 32 ms.
#[inline(always)]
pub fn ticks() -> u16 {
    interrupt::free(|_| get(timer1().tcnt1()))
}

/// Interrupts call this when they have news for the main loop.
#[inline(always)]
pub fn wake() {
    EVENT.set(1);
}

/// Sleeps until something happens or the clock reads `due_us`. Returns early after a long sleep.
pub fn sleep_until(due_us: u32) {
    if EVENT.get() != 0 {
        EVENT.set(0);
        return;
    }
    let left_us = due_us.wrapping_sub(now_us());
    if !(SHORTEST_US..1 << 31).contains(&left_us) {
        return;
    }
    let ticks = 2 * left_us.min(LONGEST_US) as u16;
    interrupt::free(|_| {
        let timer = timer1();
        put(timer.ocr1a(), get(timer.tcnt1()).wrapping_add(ticks));
        put(timer.tifr1(), OCF_A);
    });
    loop {
        interrupt::disable();
        if EVENT.get() != 0 {
            EVENT.set(0);
            // SAFETY: no lock is held here.
            unsafe { interrupt::enable() };
            return;
        }
        // SAFETY: `sei` delays interrupts by one instruction, so an event after the check above
        // ends the sleep. No lock is held. `nop` gives a waiting interrupt one more instruction
        // before the next `cli`: simavr needs it, the chip does not.
        unsafe { core::arch::asm!("sei", "sleep", "nop") };
    }
}

/// Enables the interrupt of compare B for the time that was just set; a past match is cleared. Call
/// it with interrupts off.
#[inline(always)]
pub fn arm_compare_b() {
    put(timer1().tifr1(), OCF_B);
    put(timer1().timsk1(), TOV | OCF_A | OCF_B);
}

/// Disables the interrupt of compare B. Call it with interrupts off.
#[inline(always)]
pub fn disarm_compare_b() {
    put(timer1().timsk1(), TOV | OCF_A);
}

/// Private, because only the interrupt vectors may call them.
mod handlers {
    use super::*;

    #[avr_device::interrupt(atmega1284p)]
    fn TIMER1_OVF() {
        // SAFETY: this is an interrupt.
        unsafe { BASE_US.in_interrupt(|base_us| *base_us = base_us.wrapping_add(ROUND_US)) };
    }

    #[avr_device::interrupt(atmega1284p)]
    fn TIMER1_COMPA() {
        wake();
    }
}
