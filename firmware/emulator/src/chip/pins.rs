//! Pins, and wires from a pin of one chip to a pin of another, made of simavr's IRQ connections.
//!
//! ```text
//!   driving chip's pin --notify: the other chip catches up, edges are counted, faults--.
//!                      '--connected IRQ--> other chip's pin: INTx, PIN register <------'
//! ```
//! A chip in reset drives nothing; its wires then read low, because the receivers pull them down.

use core::cell::{Cell, RefCell};
use core::ffi::c_void;
use std::rc::{Rc, Weak};

use simavr_ffi as ffi;

use super::Chip;

/// A pin of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pin {
    /// The port's letter, 'A' to 'D'.
    pub port: char,
    /// The bit in the port.
    pub bit: u8,
}

/// The level of a pin as seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Not driven by the chip; its pull-up does not count.
    Floating,
    /// Driven low.
    Low,
    /// Driven high.
    High,
}

impl From<lager_pins::Pin> for Pin {
    fn from(pin: lager_pins::Pin) -> Self {
        Self::new(pin.port.letter(), pin.bit)
    }
}

impl Pin {
    /// A pin by its datasheet name, as `Pin::new('D', 5)` for PD5.
    pub const fn new(port: char, bit: u8) -> Self {
        Self { port, bit }
    }

    /// Address of PINx; DDRx and PORTx follow it.
    fn base(self) -> u8 {
        0x20 + 3 * (self.port as u8 - b'A')
    }

    /// How the chip drives the pin, without its PWM output.
    pub fn level(self, chip: &Chip) -> Level {
        let bit = |offset| chip.register(self.base() + offset) >> self.bit & 1 == 1;
        match (bit(1), bit(2)) {
            (false, _) => Level::Floating,
            (true, false) => Level::Low,
            (true, true) => Level::High,
        }
    }

    fn irq(self, chip: &Chip) -> *mut ffi::avr_irq_t {
        let request = u32::from_be_bytes([b'i', b'o', b'g', self.port as u8]);
        // SAFETY: the chip lives; simavr returns null for a pin that it does not know.
        unsafe { ffi::avr_io_getirq(chip.avr, request, i32::from(self.bit)) }
    }
}

/// A wire; tests use it to lose pulses and to record edges.
pub struct Wire {
    to: Weak<Chip>,
    from: Weak<Chip>,
    source: *mut ffi::avr_irq_t,
    target: *mut ffi::avr_irq_t,
    level: Cell<bool>,
    lose: Cell<u64>,
    rises: Cell<u64>,
    lost: Cell<u64>,
    edges: RefCell<Option<Vec<(u64, bool)>>>,
}

/// The wires a chip drives and the wires that drive it.
#[derive(Default)]
pub(super) struct Wires {
    driven: Vec<Rc<Wire>>,
    driving: Vec<Rc<Wire>>,
}

impl Wire {
    /// How often the wire rose, lost pulses included.
    pub fn rises(&self) -> u64 {
        self.rises.get()
    }

    /// How many of these pulses were lost.
    pub fn lost(&self) -> u64 {
        self.lost.get()
    }

    /// Loses the next `count` pulses.
    pub fn lose(&self, count: u64) {
        self.lose.set(count);
    }

    /// Records every edge with its cycle from now on.
    pub fn record(&self) {
        *self.edges.borrow_mut() = Some(Vec::new());
    }

    /// The edges recorded since the last call.
    pub fn take_edges(&self) -> Vec<(u64, bool)> {
        let mut edges = self.edges.borrow_mut();
        edges.as_mut().map(core::mem::take).unwrap_or_default()
    }

    /// Notes a change of the level. Returns whether it reaches the other chip.
    fn passes(&self, high: bool) -> bool {
        let (Some(from), Some(to)) = (self.from.upgrade(), self.to.upgrade()) else {
            return false;
        };
        let cycle = from.cycle();
        if let Some(edges) = self.edges.borrow_mut().as_mut() {
            edges.push((cycle, high));
        }
        if high {
            self.rises.set(self.rises.get() + 1);
            if self.lose.get() > 0 {
                self.lose.set(self.lose.get() - 1);
                self.lost.set(self.lost.get() + 1);
                return false;
            }
        }
        self.level.set(high);
        to.catch_up(cycle);
        true
    }
}

/// Joins two chips' pins.
pub fn wire(
    from: &Rc<Chip>,
    source: impl Into<Pin>,
    to: &Rc<Chip>,
    target: impl Into<Pin>,
) -> Rc<Wire> {
    let (source, target): (Pin, Pin) = (source.into(), target.into());
    let wire = Rc::new(Wire {
        to: Rc::downgrade(to),
        from: Rc::downgrade(from),
        source: source.irq(from),
        target: target.irq(to),
        level: Cell::new(false),
        lose: Cell::new(0),
        rises: Cell::new(0),
        lost: Cell::new(0),
        edges: RefCell::new(None),
    });
    // SAFETY: both lines belong to living chips. Both chips keep the wire, so it lives as long as
    // either can call back.
    unsafe {
        let param = Rc::as_ptr(&wire).cast_mut().cast();
        ffi::avr_irq_register_notify(wire.source, Some(on_edge), param);
        ffi::avr_connect_irq(wire.source, wire.target);
    }
    from.wires.borrow_mut().driven.push(Rc::clone(&wire));
    to.wires.borrow_mut().driving.push(Rc::clone(&wire));
    wire
}

/// A chip in reset stops driving its outputs.
pub(super) fn release(wires: &Wires) {
    for wire in &wires.driven {
        // SAFETY: the line belongs to a living chip.
        unsafe { ffi::avr_raise_irq(wire.source, 0) };
    }
}

/// A chip that starts sees the levels on its inputs.
pub(super) fn refresh(wires: &Wires) {
    for wire in &wires.driving {
        if wire.from.upgrade().is_some() {
            // SAFETY: the line belongs to a living chip.
            unsafe { ffi::avr_raise_irq(wire.target, u32::from(wire.level.get())) };
        }
    }
}

unsafe extern "C" fn on_edge(irq: *mut ffi::avr_irq_t, value: u32, param: *mut c_void) {
    // SAFETY: the parameter is a wire that both its chips keep; simavr calls us before it follows
    // the connection, and does not follow it when the flag is set.
    unsafe {
        let wire: &Wire = &*param.cast_const().cast();
        // simavr forgets the level that it stored itself at a reset.
        let high = value & 1 == 1;
        if wire.level.get() != high && !wire.passes(high) {
            (*irq).flags |= ffi::IRQ_FLAG_NTF_STOP as u8;
        }
    }
}
