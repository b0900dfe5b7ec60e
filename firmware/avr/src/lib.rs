//! What the programs of both boards share: the clock, the UART to the Pi, EEPROM, reset and
//! watchdog, sleep.
//!
//! ```text
//!   lager-control   decides                     tested on the host
//!   -------------------------------------------------------------
//!   sensor, steering  pins, ADC, PWM, ExDe      registers, interrupts
//!   this library      clock, UART 0, reset
//! ```
//!
//! These crates only move bits. All decisions are in `lager-control` and below, where the host
//! tests them. Interrupts never nest and share data through [`shared::Shared`] alone.

#![no_std]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

pub mod clock;
pub mod eeprom;
pub mod memory;
pub mod register;
pub mod reset;
pub mod shared;
pub mod uart;
