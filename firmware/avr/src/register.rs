//! Access to whole registers by their names in the datasheet, and the peripherals that own them.
//!
//! Bits have the names of the datasheet too; each module defines those that it uses.

use avr_device::atmega1284p as chip;
use avr_device::generic::{Readable, Reg, RegisterSpec, Writable};
use core::ops::{BitAnd, BitOr, Not};

macro_rules! peripherals {
    ($($(#[$meta:meta])* $name:ident: $block:ident,)*) => {
        $(
            $(#[$meta])*
            #[inline(always)]
            #[must_use]
            pub fn $name() -> chip::$block {
                // SAFETY: two owners of a peripheral are unsound only if each relies on being
                // alone. Here none does: each peripheral belongs to one module, which guards the
                // data that it shares with its interrupts, and bits of ports are changed in one
                // instruction.
                unsafe { chip::$block::steal() }
            }
        )*
    };
}

peripherals! {
    /// Analog to digital converter.
    adc: ADC,
    /// Self-programming.
    boot_load: BOOT_LOAD,
    /// Sleep and reset flags.
    cpu: CPU,
    /// The EEPROM.
    eeprom: EEPROM,
    /// Pin interrupts.
    external: EXINT,
    /// Port A.
    port_a: PORTA,
    /// Port B.
    port_b: PORTB,
    /// Port C.
    port_c: PORTC,
    /// Port D.
    port_d: PORTD,
    /// Timer 1, the clock.
    timer1: TC1,
    /// Timer 2, the motors' PWM.
    timer2: TC2,
    /// UART 0, to the Pi.
    usart0: USART0,
    /// UART 1, to the servos.
    usart1: USART1,
}

/// Reads a register.
#[inline(always)]
pub fn get<R: Readable>(register: &Reg<R>) -> R::Ux {
    register.read().bits()
}

/// Writes a whole register.
#[inline(always)]
pub fn put<R: Writable>(register: &Reg<R>, bits: R::Ux) {
    // SAFETY: every value written in this crate consists of bits that the datasheet defines, and no
    // register of this chip can break memory safety: there is no DMA and no memory mapping.
    let _ = unsafe { register.write_with_zero(|w| w.bits(bits)) };
}

/// Sets the bits of `mask`. For a port this is one instruction, so no interrupt can come between.
#[inline(always)]
pub fn set<R>(register: &Reg<R>, mask: R::Ux)
where
    R: Readable + Writable + RegisterSpec,
    R::Ux: BitOr<Output = R::Ux>,
{
    put(register, get(register) | mask);
}

/// Clears the bits of `mask`. For a port this is one instruction, so no interrupt can come between.
#[inline(always)]
pub fn clear<R>(register: &Reg<R>, mask: R::Ux)
where
    R: Readable + Writable + RegisterSpec,
    R::Ux: BitAnd<Output = R::Ux> + Not<Output = R::Ux>,
{
    put(register, get(register) & !mask);
}

/// The mask of one bit.
#[must_use]
pub const fn bit(number: u8) -> u8 {
    1 << number
}
