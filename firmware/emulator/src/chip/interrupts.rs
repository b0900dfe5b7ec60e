//! Measures interrupts: how often, how long and how late they run, per vector and together.
//!
//! An interrupt's lateness is the time from the cycle in which its flag rises (while it is enabled)
//! to the cycle of the first instruction at its vector.

use core::cell::RefCell;
use core::ffi::c_void;
use std::rc::Rc;

use simavr_ffi as ffi;

use super::{Chip, chip};

/// Vectors of the ATmega1284P, reset included.
const VECTORS: usize = 35;

/// The figures of one vector, in cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct VectorStatistics {
    /// The vector's number; 0 is the reset.
    pub vector: u8,
    /// How often it was entered.
    pub count: u64,
    /// The longest time from its flag to its first instruction.
    pub worst_latency: u64,
    /// The longest time from the core's acceptance to the end.
    pub longest: u64,
    /// The sum of all times from acceptance to end.
    pub total: u64,
}

/// The figures of all interrupts since power came on, or since they were cleared.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct InterruptStatistics {
    /// Cycles measured.
    pub cycles: u64,
    /// Cycles spent in interrupts, from acceptance to end.
    pub in_interrupts: u64,
    /// The longest time from any flag to the first instruction.
    pub worst_latency: u64,
    /// The vectors that were entered.
    pub vectors: Vec<VectorStatistics>,
}

impl InterruptStatistics {
    /// The share of time spent in interrupts, 0 to 1.
    pub fn share(&self) -> f64 {
        self.in_interrupts as f64 / self.cycles.max(1) as f64
    }
}

/// Entered interrupts nest at most as deep as there are vectors.
#[derive(Clone, Debug)]
struct State {
    since: u64,
    raised: [Option<u64>; VECTORS],
    vectors: [VectorStatistics; VECTORS],
    entered: Vec<(u8, u64)>,
    in_interrupts: u64,
}

impl Default for State {
    fn default() -> Self {
        Self {
            since: 0,
            raised: [None; VECTORS],
            vectors: [VectorStatistics::default(); VECTORS],
            entered: Vec::new(),
            in_interrupts: 0,
        }
    }
}

/// The figures, while they are collected.
#[derive(Debug, Default)]
pub(super) struct Interrupts(RefCell<State>);

impl Interrupts {
    fn raised(&self, vector: u8, cycle: u64) {
        if let Some(place) = self.0.borrow_mut().raised.get_mut(usize::from(vector)) {
            *place = Some(cycle);
        }
    }

    /// An interrupt was taken back before the core entered it.
    pub(super) fn dropped(&self, vector: u8) {
        if let Some(place) = self.0.borrow_mut().raised.get_mut(usize::from(vector)) {
            *place = None;
        }
    }

    /// The core accepted an interrupt at `from`; its first instruction runs at `to`.
    pub(super) fn entered(&self, vector: u8, depth: u8, from: u64, to: u64) {
        let mut state = self.0.borrow_mut();
        let place = usize::from(vector).min(VECTORS - 1);
        let raised = state.raised[place].take().unwrap_or(from);
        let numbers = &mut state.vectors[place];
        numbers.vector = vector;
        numbers.count += 1;
        numbers.worst_latency = numbers.worst_latency.max(to.saturating_sub(raised));
        state.entered.truncate(usize::from(depth));
        state.entered.push((vector, from));
    }

    /// The program left interrupts, so that only `depth` are still entered.
    pub(super) fn left(&self, depth: u8, cycle: u64) {
        let mut state = self.0.borrow_mut();
        while state.entered.len() > usize::from(depth) {
            let Some((vector, from)) = state.entered.pop() else {
                return;
            };
            let took = cycle.saturating_sub(from);
            let numbers = &mut state.vectors[usize::from(vector).min(VECTORS - 1)];
            numbers.total += took;
            numbers.longest = numbers.longest.max(took);
            if state.entered.is_empty() {
                state.in_interrupts += took;
            }
        }
    }

    /// The chip was reset: no interrupt is raised or entered any more.
    pub(super) fn forget(&self, cycle: u64) {
        self.left(0, cycle);
        self.0.borrow_mut().raised = [None; VECTORS];
    }

    pub(super) fn clear(&self, cycle: u64) {
        let mut state = self.0.borrow_mut();
        state.since = cycle;
        state.vectors = [VectorStatistics::default(); VECTORS];
        state.in_interrupts = 0;
    }

    pub(super) fn statistics(&self, cycle: u64) -> InterruptStatistics {
        let state = self.0.borrow();
        let vectors: Vec<_> = state
            .vectors
            .iter()
            .filter(|vector| vector.count > 0)
            .copied()
            .collect();
        InterruptStatistics {
            cycles: cycle - state.since,
            in_interrupts: state.in_interrupts,
            worst_latency: vectors
                .iter()
                .map(|vector| vector.worst_latency)
                .max()
                .unwrap_or(0),
            vectors,
        }
    }
}

impl Chip {
    /// Makes simavr report when the flag of an enabled interrupt rises.
    pub(super) fn hook_interrupts(self: &Rc<Self>) {
        // SAFETY: the table names the vectors of a living chip; the callback has simavr's
        // signature, and the chip outlives its simavr half.
        unsafe {
            let count = usize::from((*self.avr).interrupts.vector_count);
            for index in 0..count {
                let vector = (*self.avr).interrupts.vector[index];
                let irq = &raw mut (*vector).irq[0];
                ffi::avr_irq_register_notify(irq, Some(on_pending), self.param());
            }
        }
    }
}

/// A vector's flag rose (1), or its interrupt was entered or taken back (0).
unsafe extern "C" fn on_pending(irq: *mut ffi::avr_irq_t, value: u32, param: *mut c_void) {
    if value == 0 {
        return;
    }
    // SAFETY: registered with the chip's own parameter, on the first of a vector's two lines;
    // simavr numbers them by vector.
    unsafe {
        let chip = chip(param);
        let vector = ((*irq).irq >> 8) as u8;
        if chip.is_enabled(vector) {
            chip.interrupts.raised(vector, chip.cycle());
        }
        if vector == super::corrections::WATCHDOG_VECTOR {
            chip.watchdog_fired();
        }
    }
}

impl Chip {
    fn is_enabled(&self, number: u8) -> bool {
        self.vectors().any(|vector| {
            // SAFETY: the table names the vectors of a living chip.
            unsafe { (*vector).vector == number && self.bit((*vector).enable) }
        })
    }

    /// Raises the interrupts that a write to `address` enabled although their flags were set
    /// before. The chip does that; simavr raises an interrupt only when its flag rises.
    pub(super) fn raise_waiting(&self, address: u8) {
        for vector in self.vectors() {
            // SAFETY: the table names the vectors of a living chip; raising a pending one does
            // nothing.
            unsafe {
                let (enable, raised) = ((*vector).enable, (*vector).raised);
                let concerned = enable.reg() as u8 == address && raised.reg() != 0;
                if concerned && self.bit(enable) && self.bit(raised) {
                    ffi::avr_raise_interrupt(self.avr, vector);
                }
            }
        }
    }

    fn vectors(&self) -> impl Iterator<Item = *mut ffi::avr_int_vector_t> {
        let avr = self.avr;
        // SAFETY: a plain field of a living chip.
        let count = usize::from(unsafe { (*avr).interrupts.vector_count });
        // SAFETY: the table has `count` vectors.
        (0..count).map(move |index| unsafe { (*avr).interrupts.vector[index] })
    }

    fn bit(&self, place: ffi::avr_regbit_t) -> bool {
        self.register(place.reg() as u8) >> place.bit() & 1 == 1
    }
}
