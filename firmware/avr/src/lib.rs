//! The part that both boards' programs share: clock, UART to the Pi, EEPROM, reset and watchdog,
//! sleep.
//!
//! ```text
//!   lager-control   decides                     tested on the host
//!   -------------------------------------------------------------
//!   sensor, steering  pins, ADC, PWM, ExDe      registers, interrupts
//!   this library      clock, UART 0, reset
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
