//! The receiver of ExDe: drives `lager_exde::Receiver` by a pin interrupt and a timer.
//!
//! ```text
//!   INT2, sync rises --> sample data, restart the silence --> word complete --> WORDS
//!   compare B: silence --> perhaps a pulse on return sync
//! ```

use avr_device::asm::delay_cycles;
use lager_avr::clock;
use lager_avr::register::{external, get, put, timer1};
use lager_avr::shared::{Ring, Shared};
use lager_exde::{Receiver, Timing};

use crate::{pins, servos};

/// INT2 on a rising edge.
const RISING: u8 = 0b11 << 4;
const INT2_ON: u8 = 1 << 2;

const TIMING: Timing = Timing::STANDARD;

/// The receiver, and the timer's value at the last pulse.
struct Listener {
    receiver: Receiver,
    last: u16,
}

static LISTENER: Shared<Listener> = Shared::new(Listener {
    receiver: Receiver::new(),
    last: 0,
});
/// Words and the timer's values at their last bits; the main loop reads them long before the timer
/// wraps.
static WORDS: Ring<(u16, u16), 4> = Ring::new((0, 0));

/// Listens for sync.
pub(crate) fn start() {
    put(external().eicra(), RISING);
    put(external().eimsk(), INT2_ON);
}

/// The oldest unread word, and the time of its last bit.
pub(crate) fn word() -> Option<(u16, u32)> {
    let (word, ticks) = WORDS.pop()?;
    let ago = clock::ticks().wrapping_sub(ticks) / clock::TICKS_PER_US;
    Some((word, clock::now_us().wrapping_sub(u32::from(ago))))
}

/// Whether a word is half received.
pub(crate) fn is_receiving() -> bool {
    LISTENER.with(|listener| listener.receiver.is_midway())
}

/// The number of errors that the receiver has counted.
pub(crate) fn errors() -> u8 {
    LISTENER.with(|listener| listener.receiver.errors())
}

#[avr_device::interrupt(atmega1284p)]
fn INT2() {
    let data = pins::exde_data();
    let now = get(timer1().tcnt1());
    let hear = |listener: &mut Listener| {
        let since_us = now.wrapping_sub(listener.last) / clock::TICKS_PER_US;
        listener.last = now;
        put(
            timer1().ocr1b(),
            now.wrapping_add(TIMING.idle_us * clock::TICKS_PER_US),
        );
        clock::arm_compare_b();
        if let Some(word) = listener.receiver.on_sync(data, since_us) {
            WORDS.push((word, now));
            clock::wake();
        }
    };
    // SAFETY: this is an interrupt.
    unsafe { LISTENER.in_interrupt(hear) };
    servos::take_in_interrupt();
}

#[avr_device::interrupt(atmega1284p)]
fn TIMER1_COMPB() {
    clock::disarm_compare_b();
    // SAFETY: this is an interrupt.
    if unsafe { LISTENER.in_interrupt(|listener| listener.receiver.on_silence()) } {
        pins::set_exde_return(true);
        delay_cycles(14);
        pins::set_exde_return(false);
    }
}
