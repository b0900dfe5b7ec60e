//! The steering board's program: `lager_control::SteeringUnit` on its chip.

#![no_std]
#![no_main]
#![feature(abi_avr_interrupt)]

mod battery;
mod board;
mod exde;
mod motors;
mod pins;
mod servos;
mod stop;

use avr_device::interrupt;
use lager_avr::shared::StaticCell;
use lager_avr::{clock, reset, uart};
use lager_control::{SteeringConfig, SteeringUnit};
use lager_wire::Callsign;

use board::SteeringPins;

lager_avr::image_header!(Callsign::Steering);

static UNIT: StaticCell<SteeringUnit> = StaticCell::new();

#[avr_device::entry]
fn main() -> ! {
    let cause = reset::start();
    pins::set_up();
    clock::start();
    uart::start();
    servos::start();
    motors::start();
    exde::start();
    battery::start();
    // SAFETY: everything that the interrupts use is set up, and no lock is held.
    unsafe { interrupt::enable() };

    let mut board = SteeringPins::new(cause);
    // SAFETY: `main` runs once.
    let unit = unsafe { UNIT.fill(SteeringUnit::new(&board, SteeringConfig::default())) };
    loop {
        let due_us = unit.step(&mut board);
        clock::sleep_until(due_us);
    }
}
