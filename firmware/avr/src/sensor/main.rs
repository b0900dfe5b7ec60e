//! The sensor board's program: `lager_control::SensorUnit` on its chip.

#![no_std]
#![no_main]
#![feature(abi_avr_interrupt)]

mod board;
mod converter;
mod exde;
mod pins;
mod stop;

use avr_device::interrupt;
use lager_avr::shared::StaticCell;
use lager_avr::{clock, reset, uart};
use lager_control::{SensorConfig, SensorUnit};
use lager_wire::Callsign;

use board::SensorPins;

lager_avr::image_header!(Callsign::Sensor);

static UNIT: StaticCell<SensorUnit> = StaticCell::new();

#[avr_device::entry]
fn main() -> ! {
    let cause = reset::start();
    pins::set_up();
    clock::start();
    uart::start();
    converter::start();
    exde::start();
    // SAFETY: everything that the interrupts use is set up, and no lock is held.
    unsafe { interrupt::enable() };

    let mut board = SensorPins::new(cause);
    // SAFETY: `main` runs once.
    let unit = unsafe { UNIT.fill(SensorUnit::new(&board, SensorConfig::FAST)) };
    loop {
        let due_us = unit.step(&mut board);
        clock::sleep_until(due_us);
    }
}
