//! The half-duplex wire of the AX-12 servos.
//!
//! ```text
//!   TXD1 --.-- wire --> servos of the world        a byte counts when its stop bit is over
//!   RXD1 --'   wire <-- their answers, at 1 Mbit/s after the return delay
//! ```
//! RXD1 and TXD1 are joined, so a board that does not mute its receiver hears its own bytes. Bytes
//! at a speed other than the servos' are noise to them.

use core::cell::{Cell, RefCell};
use core::time::Duration;
use std::rc::{Rc, Weak};

use lager_plant::World;

use super::Epoch;
use crate::chip::{Chip, FREQUENCY, Sent, UsartId};

/// Cycles of one bit at 1 Mbit/s, and of one byte.
const BIT: u64 = FREQUENCY / 1_000_000;
const BYTE: u64 = 10 * BIT;
/// Tag of the alarm for an answer's next byte.
const ANSWER: u32 = 1;

/// A byte on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoByte {
    /// The cycle in which its stop bit ended or will end.
    pub cycle: u64,
    /// Whether the board sent it; otherwise a servo did.
    pub from_board: bool,
    /// The byte.
    pub byte: u8,
}

/// The servos' wire.
pub struct ServoWire {
    chip: Weak<Chip>,
    world: Rc<RefCell<World>>,
    epoch: Rc<Epoch>,
    /// The cycle the alarm is set to.
    armed: Cell<u64>,
    strange: Cell<u64>,
    tap: RefCell<Option<Vec<ServoByte>>>,
}

/// Connects the steering board's second USART to the servos.
pub(super) fn connect(
    chip: &Rc<Chip>,
    world: &Rc<RefCell<World>>,
    epoch: &Rc<Epoch>,
) -> Rc<ServoWire> {
    let wire = Rc::new(ServoWire {
        chip: Rc::downgrade(chip),
        world: Rc::clone(world),
        epoch: Rc::clone(epoch),
        armed: Cell::new(u64::MAX),
        strange: Cell::new(0),
        tap: RefCell::new(None),
    });
    chip.tie(UsartId::One);
    let end = Rc::clone(&wire);
    chip.on_sent(UsartId::One, move |sent| end.transmit(sent));
    let end = Rc::clone(&wire);
    chip.on_alarm(move |tag, cycle| {
        if tag == ANSWER {
            end.answer(cycle);
        }
    });
    wire
}

impl ServoWire {
    /// Records every byte from now on.
    pub fn record(&self) {
        *self.tap.borrow_mut() = Some(Vec::new());
    }

    /// The bytes recorded since the last call.
    pub fn take(&self) -> Vec<ServoByte> {
        self.tap
            .borrow_mut()
            .as_mut()
            .map(core::mem::take)
            .unwrap_or_default()
    }

    /// Bytes that the board sent at a speed other than the servos'.
    pub fn strange_bytes(&self) -> u64 {
        self.strange.get()
    }

    fn transmit(&self, sent: Sent) {
        self.note(sent.to, true, sent.byte);
        if sent.bit != BIT {
            self.strange.set(self.strange.get() + 1);
            return;
        }
        let mut world = self.world.borrow_mut();
        world.advance_to(self.epoch.world(sent.to));
        let from = self.epoch.world(sent.from);
        world.servos().transmit(from, &[sent.byte]);
        drop(world);
        self.arm();
    }

    /// Sets the alarm to the start bit of the next byte of an answer.
    fn arm(&self) {
        let Some(at) = self.world.borrow().next_servo_byte() else {
            return;
        };
        let start = self.epoch.cycle(at).saturating_sub(BYTE);
        if let Some(chip) = self.chip.upgrade()
            && self.armed.replace(start) != start
        {
            chip.alarm(start, ANSWER);
        }
    }

    /// Sends the answer's next byte, unless the board has written over the answer since.
    fn answer(&self, cycle: u64) {
        if cycle < self.armed.get() {
            return;
        }
        self.armed.set(u64::MAX);
        let at = self.world.borrow().next_servo_byte();
        let begins = at.filter(|at| self.epoch.cycle(*at).saturating_sub(BYTE) <= cycle);
        if let (Some(at), Some(chip)) = (begins, self.chip.upgrade())
            && let Some(byte) = self.receive(at)
        {
            self.note(cycle + BYTE, false, byte);
            chip.send_to(UsartId::One, cycle, byte, BIT as f64);
        }
        self.arm();
    }

    fn receive(&self, at: Duration) -> Option<u8> {
        self.world.borrow_mut().servos().receive(at)
    }

    fn note(&self, cycle: u64, from_board: bool, byte: u8) {
        if let Some(tap) = self.tap.borrow_mut().as_mut() {
            tap.push(ServoByte {
                cycle,
                from_board,
                byte,
            });
        }
    }
}
