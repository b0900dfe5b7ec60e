//! The transmitter of ExDe: drives `lager_exde::Transmitter` by the timer's second compare
//! interrupt.
//!
//! ```text
//!   send(word) --> bit on data --compare B--> pulse on sync --compare B--> next bit ... --> gap
//!   INT0: return sync
//! ```

use avr_device::asm::nop;
use lager_avr::clock;
use lager_avr::register::{external, get, put, timer1};
use lager_avr::shared::Shared;
use lager_exde::{Step, Transmitter, WireAction};

use crate::pins;

/// INT0 on a rising edge.
const RISING: u8 = 0b11;
const INT0_ON: u8 = 1;

/// Time from the timer's match until the interrupt reads the timer; each wait is shorter by it.
const INTERRUPT_TICKS: u16 = 5;

static TRANSMITTER: Shared<Transmitter> = Shared::new(Transmitter::new());

/// Listens for the return sync and begins the handshake. Interrupts are still off.
pub(crate) fn start() {
    put(external().eicra(), RISING);
    put(external().eimsk(), INT0_ON);
    TRANSMITTER.with(|transmitter| {
        carry_out(transmitter.advance());
        clock::arm_compare_b();
    });
}

/// Begins to send a word. `false`: the word before is not sent yet, or the other board never
/// answered.
pub(crate) fn send(word: u16) -> bool {
    TRANSMITTER.with(|transmitter| {
        let Some(step) = transmitter.start(word) else {
            return false;
        };
        carry_out(step);
        clock::arm_compare_b();
        true
    })
}

/// Whether bits of a word are still to be sent.
pub(crate) fn is_sending() -> bool {
    TRANSMITTER.with(|transmitter| transmitter.is_sending())
}

/// Sets the wires, and the timer for the step after this one.
#[inline(always)]
fn carry_out(step: Step) {
    match step.action {
        WireAction::Pulse => pins::set_exde_sync(true),
        WireAction::Place(level) => pins::set_exde_data(level),
        WireAction::Release => {
            pins::set_exde_data(false);
            clock::wake();
        }
        WireAction::Nothing => {}
    }
    match step.wait_us {
        Some(wait_us) => {
            let ticks = wait_us * clock::TICKS_PER_US - INTERRUPT_TICKS;
            put(timer1().ocr1b(), get(timer1().tcnt1()).wrapping_add(ticks));
        }
        None => clock::disarm_compare_b(),
    }
    if step.action == WireAction::Pulse {
        // A pulse is 1 us long; setting the timer has taken most of it.
        nop();
        nop();
        nop();
        nop();
        pins::set_exde_sync(false);
    }
}

#[avr_device::interrupt(atmega1284p)]
fn TIMER1_COMPB() {
    // SAFETY: this is an interrupt.
    unsafe { TRANSMITTER.in_interrupt(|transmitter| carry_out(transmitter.advance())) };
}

#[avr_device::interrupt(atmega1284p)]
fn INT0() {
    // SAFETY: this is an interrupt.
    unsafe { TRANSMITTER.in_interrupt(Transmitter::on_return) };
}
