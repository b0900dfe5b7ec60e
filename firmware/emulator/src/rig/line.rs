//! The cable between a board and the Pi, in chip time.
//!
//! ```text
//!   Pi --write--> bytes back to back at the Pi's rate --> RXD0
//!   Pi <--take--- bytes with the cycle their frame ended <-- TXD0
//! ```
//! Nothing waits for a reader: when the buffer is full, further bytes to the Pi are lost.

use core::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;

use lager_pty::PI_BUFFER;

use crate::chip::{Chip, FREQUENCY, UsartId, sampled};

/// Bits of a frame: 8N1.
const FRAME: f64 = 10.0;

/// Largest difference of two baud rates: 8N1 tolerates it with an exact sampler.
const TOLERANCE: f64 = 0.04;

/// One cable.
pub(super) struct PiLine {
    /// Cycles of one of the Pi's bits.
    bit: f64,
    free: Cell<f64>,
    cut: Cell<bool>,
    /// Cycles of a bit of the board's last frame, if the Pi cannot read that rate.
    foreign_bit: Cell<Option<u64>>,
    arrived: RefCell<VecDeque<(u64, u8)>>,
    written: RefCell<Option<Vec<(u64, u8)>>>,
}

impl PiLine {
    pub(super) fn connect(chip: &Rc<Chip>, baud: u32) -> Rc<Self> {
        let line = Rc::new(Self {
            bit: FREQUENCY as f64 / f64::from(baud),
            free: Cell::new(0.0),
            cut: Cell::new(false),
            foreign_bit: Cell::new(None),
            arrived: RefCell::default(),
            written: RefCell::new(None),
        });
        let end = Rc::clone(&line);
        chip.on_sent(UsartId::Zero, move |sent| {
            let is_foreign = (sent.bit as f64 / end.bit - 1.0).abs() > TOLERANCE;
            end.foreign_bit.set(is_foreign.then_some(sent.bit));
            let mut arrived = end.arrived.borrow_mut();
            if !end.cut.get() && arrived.len() < PI_BUFFER {
                let (byte, _) = sampled(sent.byte, sent.bit as f64, end.bit);
                arrived.push_back((sent.to, byte));
            }
        });
        line
    }

    pub(super) fn write(&self, chip: &Chip, now: u64, bytes: &[u8]) {
        for &byte in bytes {
            let start = self.free.get().max(now as f64);
            self.free.set(start + FRAME * self.bit);
            if !self.cut.get() {
                if let Some(written) = self.written.borrow_mut().as_mut() {
                    written.push((self.free.get() as u64, byte));
                }
                chip.send_to(UsartId::Zero, start.ceil() as u64, byte, self.bit);
            }
        }
    }

    pub(super) fn record(&self) {
        *self.written.borrow_mut() = Some(Vec::new());
    }

    pub(super) fn take_written(&self) -> Vec<(u64, u8)> {
        let mut written = self.written.borrow_mut();
        written.as_mut().map(core::mem::take).unwrap_or_default()
    }

    pub(super) fn take(&self, now: u64) -> Vec<(u64, u8)> {
        let mut arrived = self.arrived.borrow_mut();
        let count = arrived.partition_point(|(at, _)| *at <= now);
        arrived.drain(..count).collect()
    }

    /// Cycles of one byte.
    pub(super) fn byte_cycles(&self) -> u64 {
        (FRAME * self.bit).round() as u64
    }

    pub(super) fn foreign_baud(&self) -> Option<u32> {
        Some((FREQUENCY / self.foreign_bit.get()?.max(1)) as u32)
    }

    pub(super) fn cut(&self, cut: bool) {
        self.cut.set(cut);
    }
}
