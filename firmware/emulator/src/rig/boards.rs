//! Translates the boards' pins: multiplexer and ranger to readings, motor pins to duties.
//!
//! The pins are those of `lager-pins`. That the drivers are mirrored is written here once more, as a
//! driver has it, so that a board that turns a wheel the wrong way is found out.

use core::cell::{Cell, RefCell};
use std::rc::Rc;

use lager_pins::{sensor, steering};
use lager_plant::World;

use super::Epoch;
use crate::chip::{Chip, Level, Pin, register};

/// Full scale of both boards' converters, in millivolts.
const REFERENCE: u32 = 5_000;

/// Channels of the sensor board's converter.
const LINE: u8 = sensor::LINE.bit;
const RANGER: u8 = sensor::RANGER.bit;

/// The input of a conversion of the sensor board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// A line sensor, 0 = leftmost.
    Line(u8),
    /// The IR ranger.
    Ranger,
    /// None: the multiplexer is off, or the channel is not connected.
    Nothing,
}

/// One conversion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conversion {
    /// The cycle of the sample.
    pub cycle: u64,
    /// The input that was measured.
    pub input: Input,
    /// The world's value: 8 bits for a line sensor, 10 for the ranger.
    pub reading: u16,
}

/// A change of the duties at the motor drivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorChange {
    /// The cycle of the write.
    pub cycle: u64,
    /// The duties from now on, left and right, -255 to 255.
    pub duties: [i16; 2],
}

/// The analogue inputs of the sensor board.
#[derive(Default)]
pub(super) struct SensorInputs(RefCell<Option<Vec<Conversion>>>);

impl SensorInputs {
    pub(super) fn record(&self) {
        *self.0.borrow_mut() = Some(Vec::new());
    }

    pub(super) fn take(&self) -> Vec<Conversion> {
        self.0
            .borrow_mut()
            .as_mut()
            .map(core::mem::take)
            .unwrap_or_default()
    }
}

/// Connects the sensor board's converter to the world.
pub(super) fn connect_inputs(
    chip: &Rc<Chip>,
    world: &Rc<RefCell<World>>,
    epoch: &Rc<Epoch>,
) -> Rc<SensorInputs> {
    let inputs = Rc::new(SensorInputs::default());
    let (log, world, epoch) = (Rc::clone(&inputs), Rc::clone(world), Rc::clone(epoch));
    let board = Rc::downgrade(chip);
    chip.on_conversion(move |channel, cycle| {
        let Some(board) = board.upgrade() else {
            return 0;
        };
        let mut world = world.borrow_mut();
        world.advance_to(epoch.world(cycle));
        let (input, reading, code) = match (channel, selected(&board)) {
            (LINE, Some(sensor)) => {
                let reading = world.read_line(sensor);
                // The middle of a step, so that no rounding leads to another reading.
                let code = u32::from(reading) * 4 + 2;
                (Input::Line(sensor), u16::from(reading), code)
            }
            (RANGER, _) => {
                let reading = world.read_ir();
                (Input::Ranger, reading, u32::from(reading))
            }
            _ => (Input::Nothing, 0, 0),
        };
        if let Some(log) = log.0.borrow_mut().as_mut() {
            log.push(Conversion {
                cycle,
                input,
                reading,
            });
        }
        millivolts(code)
    });
    inputs
}

/// The multiplexer's channel; `None` if it is off.
fn selected(board: &Chip) -> Option<u8> {
    if Pin::from(sensor::ENABLE).level(board) != Level::Low {
        return None;
    }
    let bit = |pin: lager_pins::Pin| u8::from(Pin::from(pin).level(board) == Level::High);
    let channel = sensor::ADDRESS
        .into_iter()
        .rev()
        .fold(0, |address, pin| address << 1 | bit(pin));
    Some(channel)
}

/// The lowest voltage that simavr's converter turns into this 10-bit code: it has 1023 steps up to
/// the reference.
fn millivolts(code: u32) -> u32 {
    (code * REFERENCE).div_ceil(1_023)
}

/// The motor drivers' inputs, as the steering board's registers set them.
#[derive(Default)]
pub(super) struct Motors {
    duties: Cell<[i16; 2]>,
    changes: RefCell<Vec<MotorChange>>,
}

impl Motors {
    pub(super) fn duties(&self) -> [i16; 2] {
        self.duties.get()
    }

    pub(super) fn take_changes(&self) -> Vec<MotorChange> {
        self.changes.take()
    }
}

/// Connects the steering board's motor outputs to the world.
pub(super) fn connect_motors(
    chip: &Rc<Chip>,
    world: &Rc<RefCell<World>>,
    epoch: &Rc<Epoch>,
) -> Rc<Motors> {
    let motors = Rc::new(Motors::default());
    let (state, world, epoch) = (Rc::clone(&motors), Rc::clone(world), Rc::clone(epoch));
    let board = Rc::downgrade(chip);
    let registers = [
        register::DDRC,
        register::PORTC,
        register::DDRD,
        register::PORTD,
        register::TCCR2A,
        register::TCCR2B,
        register::OCR2A,
        register::OCR2B,
    ];
    chip.watch(&registers, move |cycle| {
        let Some(board) = board.upgrade() else {
            return;
        };
        let duties = told(&board);
        if duties == state.duties.replace(duties) {
            return;
        }
        state
            .changes
            .borrow_mut()
            .push(MotorChange { cycle, duties });
        let mut world = world.borrow_mut();
        world.advance_to(epoch.world(cycle));
        world.set_motors(duties[0], duties[1]);
    });
    motors
}

/// Signed duties of the left and the right driver, from the board's registers.
fn told(board: &Chip) -> [i16; 2] {
    let modes = board.register(register::TCCR2A);
    let runs = board.register(register::TCCR2B) & 0x07 != 0 && modes & 0x03 == 0x03;
    let duty = |pwm: Pin, compare: u8, mode: u8| -> i16 {
        match (pwm.level(board), mode) {
            // The driver pulls its input down.
            (Level::Floating, _) => 0,
            (Level::Low, 0) => 0,
            (Level::High, 0) => 255,
            // Cleared on a match: high for the compare value plus one, of 256 counts.
            (_, 2) if runs => i16::from(board.register(compare)),
            // Set on a match.
            (_, 3) if runs => 255 - i16::from(board.register(compare)),
            // A stopped timer leaves the pin as it was. A board that stops it is wrong, so assume
            // the worst: full duty.
            _ => 255,
        }
    };
    let left = duty(steering::LEFT_PWM.into(), register::OCR2A, modes >> 6);
    let right = duty(steering::RIGHT_PWM.into(), register::OCR2B, modes >> 4 & 3);
    let signed = |duty: i16, forwards: bool| if forwards { duty } else { -duty };
    [
        signed(
            left,
            Pin::from(steering::LEFT_DIR).level(board) != Level::High,
        ),
        signed(
            right,
            Pin::from(steering::RIGHT_DIR).level(board) == Level::High,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simavr_reads_back_every_code() {
        for code in 0..1_024 {
            assert_eq!(millivolts(code) * 1_023 / REFERENCE, code);
        }
    }
}
