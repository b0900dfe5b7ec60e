//! The part that both boards' programs share: clock, UART to the Pi, EEPROM, reset and watchdog,
//! sleep.
//!
//! ```text
//!   lager-control   decides                     tested on the host
//!   -------------------------------------------------------------
//!   sensor, steering  pins, ADC, PWM, ExDe      registers, interrupts
//!   this library      clock, UART 0, reset
//!   loader            its own programs: one for each board, in the boot section
//! ```
//!
//! These crates only move bits. All decisions are in `lager-control` and in the crates that it
//! uses; the host tests them. Interrupts never nest, and share data only through
//! [`shared::Shared`].

#![no_std]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

pub mod clock;
pub mod eeprom;
pub mod memory;
pub mod register;
pub mod reset;
pub mod shared;
pub mod uart;

pub use lager_loader::Header;

/// Puts the header of a board's image behind its vectors, where its bootloader looks for it. The
/// linker puts the vectors of the start files first into this section.
#[macro_export]
macro_rules! image_header {
    ($role:expr) => {
        // SAFETY: the start files have jumped before it, and nothing else is in this section.
        #[used]
        #[unsafe(link_section = ".vectors")]
        static HEADER: [u8; $crate::Header::LENGTH] = $crate::Header::of($role);
    };
}
