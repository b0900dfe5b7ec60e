//! Runs a chip: instructions, sleep, entry of interrupts, resets.
//!
//! ```text
//!            horizon reached
//!   .------------------------------ back to the caller
//!   |  held in reset: the clock jumps to its end, then the program starts
//!   |  own events due --> simavr's timers due --> asleep: the clock jumps to the next of both
//!   '--- an interrupt is entered, or instructions run up to the next event <--' awake
//! ```
//! simavr's own loop is not used: it calls `usleep` when the program sleeps, and then counts one
//! cycle too many. Nothing here waits.

use core::ffi::c_int;

use simavr_ffi as ffi;

use super::pins;
use super::queue::Event;
use super::{Chip, FREQUENCY, ResetLine, avr_run_one, chip, register};

/// Time from a reset's cause to the first instruction: 65 ms and 14 cycles, as the fuses say (a
/// crystal, slowly rising power).
const START_UP: u64 = FREQUENCY * 65 / 1_000 + 14;
/// Cycles from an interrupt's acceptance to the first instruction at its vector: the core pushes
/// the two bytes of the program counter (datasheet, interrupt response time).
const ENTRY: u64 = 4;
/// Additional cycles if the core slept.
const ENTRY_FROM_SLEEP: u64 = 4;

/// Bits of MCUSR.
const PORF: u8 = 0x01;
const EXTRF: u8 = 0x02;
const BORF: u8 = 0x04;
pub(super) const WDRF: u8 = 0x08;

impl Chip {
    /// Runs until the cycle count is at least `horizon`, and at most one instruction further.
    pub fn run_until(&self, horizon: u64) {
        if self.running.replace(true) {
            return;
        }
        while self.cycle() < horizon {
            self.advance(horizon);
        }
        self.running.set(false);
    }

    /// Runs a chip that lags up to `cycle`. A chip that is running already goes on by itself.
    pub(crate) fn catch_up(&self, cycle: u64) {
        if self.cycle() < cycle {
            self.run_until(cycle);
        }
    }

    /// The cycle of the chip's next action of its own: now, unless it sleeps or is in reset.
    pub fn next_action(&self) -> u64 {
        let now = self.cycle();
        if let Some(until) = self.held_until.get() {
            return until.min(self.queue.next()).max(now);
        }
        if self.core_works() {
            return now;
        }
        // SAFETY: the head of simavr's list of timers is null or a slot inside the chip.
        let timer = unsafe {
            let head = (*self.avr).cycle_timers.timer;
            if head.is_null() {
                u64::MAX
            } else {
                (*head).when
            }
        };
        timer.min(self.queue.next()).max(now)
    }

    /// Resets the chip now, by its reset pin, its supply, power or its watchdog.
    pub fn reset(&self, line: ResetLine) {
        let flag = match line {
            ResetLine::Power => PORF,
            ResetLine::External => EXTRF,
            ResetLine::BrownOut => BORF,
            ResetLine::Watchdog => WDRF,
        };
        self.reset_with(flag);
    }

    /// Resets the chip and sets this flag in MCUSR; power clears the others.
    pub(super) fn reset_with(&self, flag: u8) {
        if flag & (PORF | BORF) != 0 {
            self.tear_page();
        }
        let kept = match flag {
            PORF => 0,
            _ => self.register(register::MCUSR),
        };
        self.set_register(register::MCUSR, kept | flag);
        self.reset_core();
        self.resets.set(self.resets.get() + 1);
        self.begin_reset(0);
    }

    /// Makes simavr report every reset, also its own.
    pub(super) fn hook_reset(self: &std::rc::Rc<Self>) {
        // SAFETY: zero is a valid value of every field of this C structure.
        let mut hook: Box<ffi::avr_io_t> = Box::new(unsafe { core::mem::zeroed() });
        hook.kind = c"emulator".as_ptr();
        hook.reset = Some(on_reset);
        // simavr never reads this field of our hook.
        hook.irq_names = self.param().cast();
        let hook = Box::into_raw(hook);
        self.reset_hook.set(hook);
        // SAFETY: the hook lives until the chip is dropped.
        unsafe { ffi::avr_register_io(self.avr, hook) };
    }

    /// Puts an event into the queue.
    pub(super) fn schedule(&self, at: u64, event: Event) {
        self.queue.push(at, event);
        // A running program must stop at the event.
        let ahead = at.saturating_sub(self.cycle());
        // SAFETY: plain fields of a living chip.
        unsafe {
            let count = &raw mut (*self.avr).run_cycle_count;
            *count = (*count).min(ahead);
        }
    }

    /// Resets the lines of the chip. Its program starts `delay` cycles after the usual time.
    pub(super) fn begin_reset(&self, delay: u64) {
        self.held_until.set(Some(self.cycle() + START_UP + delay));
        self.asleep.set(false);
        self.interrupts.forget(self.cycle());
        self.release_peripherals();
        self.release_ports();
        self.release_flash();
        pins::release(&self.wires.borrow());
        self.tell_watcher();
    }

    fn advance(&self, horizon: u64) {
        let now = self.cycle();
        if self.queue.next() <= now {
            self.happen(now);
            return;
        }
        let limit = horizon.min(self.queue.next());
        if let Some(until) = self.held_until.get() {
            self.set_cycle(limit.min(until));
            if until <= limit {
                self.start_program();
            }
            return;
        }
        // A limit of one makes the core return after any instruction that sets a timer; otherwise
        // simavr would count the whole span again from there.
        // SAFETY: the chip lives, and no reference into it is held across the call.
        let to_timer = unsafe {
            (*self.avr).run_cycle_limit = 1;
            ffi::avr_cycle_timer_process(self.avr)
        };
        if let Some(at) = self.reset_seen.take() {
            // simavr's watchdog resets by itself and starts the cycle count at 0.
            self.set_cycle(at);
            self.resets.set(self.resets.get() + 1);
            self.begin_reset(0);
            return;
        }
        // A timer may have put an event into our queue.
        let limit = horizon.min(self.queue.next());
        if self.core_works() {
            if !self.enter_interrupt() {
                self.run_instructions(to_timer.min(limit.saturating_sub(now)));
            }
        } else {
            // Asleep, crashed or halted by SPM: only time passes, also for the watchdog.
            let next = now + to_timer.max(1);
            let then = next.min(limit).max(now);
            self.set_cycle(then);
            if self.core_state() == ffi::cpu_Sleeping as c_int {
                self.slept.set(self.slept.get() + then - now);
            }
        }
    }

    /// Lets simavr enter a due interrupt; returns whether it did.
    fn enter_interrupt(&self) -> bool {
        // SAFETY: plain fields of a living chip; the call keeps no reference of ours.
        unsafe {
            if (*self.avr).interrupt_state == 0 {
                return false;
            }
            let depth = (*self.avr).interrupts.running_ptr;
            ffi::avr_service_interrupts(self.avr);
            if (*self.avr).interrupts.running_ptr <= depth {
                return false;
            }
            let from = (*self.avr).cycle;
            (*self.avr).cycle += if self.asleep.take() {
                ENTRY + ENTRY_FROM_SLEEP
            } else {
                ENTRY
            };
            let running = (*self.avr).interrupts.running[usize::from(depth)];
            self.interrupts
                .entered((*running).vector, depth, from, (*self.avr).cycle);
            true
        }
    }

    /// Runs instructions for at least `count` cycles, or fewer if an event comes up.
    fn run_instructions(&self, count: u64) {
        // SAFETY: the chip lives; callbacks reach it only through shared references and raw
        // pointers, as this function does.
        unsafe {
            let depth = (*self.avr).interrupts.running_ptr;
            (*self.avr).run_cycle_count = count.max(1);
            let next = avr_run_one(self.avr);
            (*self.avr).pc = next;
            let left = (*self.avr).interrupts.running_ptr;
            if left < depth {
                self.interrupts.left(left, (*self.avr).cycle);
            }
        }
        let state = self.core_state();
        if state == ffi::cpu_Sleeping as c_int {
            self.asleep.set(true);
        } else if state == ffi::cpu_Running as c_int {
            self.asleep.set(false);
        } else if state == ffi::cpu_Crashed as c_int {
            self.crashes.set(self.crashes.get() + 1);
        }
    }

    fn happen(&self, now: u64) {
        let Some(event) = self.queue.pop(now) else {
            return;
        };
        match event {
            Event::Sent { usart, life } => self.frame_sent(usart, life),
            Event::StartBit { usart, byte, bit } => self.frame_begins(usart, byte, bit),
            Event::Received { usart, life } => self.frame_received(usart, life),
            Event::WatchdogAgain { life } => self.watchdog_again(life),
            Event::EepromDone { life } => self.eeprom_done(life),
            Event::SpmExpired { life } => self.spm_expired(life),
            Event::FlashDone { life } => self.flash_done(life),
            Event::Alarm { tag } => {
                if let Some(action) = self.on_alarm.borrow().as_ref() {
                    action(tag, now);
                }
            }
        }
    }

    /// The reset has ended: the program starts with every register at its initial value.
    fn start_program(&self) {
        self.reset_core();
        self.held_until.set(None);
        self.release_peripherals();
        self.release_ports();
        pins::refresh(&self.wires.borrow());
    }

    /// Resets the core as simavr does, but keeps the cycle count.
    fn reset_core(&self) {
        let at = self.cycle();
        // SAFETY: the chip lives and is between two instructions.
        unsafe { ffi::avr_reset(self.avr) };
        self.reset_seen.set(None);
        self.set_cycle(at);
    }

    fn set_cycle(&self, cycle: u64) {
        // SAFETY: a plain field of a living chip.
        unsafe { (*self.avr).cycle = cycle };
    }

    /// Whether the core executes instructions.
    fn core_works(&self) -> bool {
        self.core_state() == ffi::cpu_Running as c_int && !self.flash.is_halting()
    }

    fn core_state(&self) -> c_int {
        // SAFETY: a plain field of a living chip.
        unsafe { (*self.avr).state }
    }
}

unsafe extern "C" fn on_reset(io: *mut ffi::avr_io_t) {
    // SAFETY: the hook carries the chip's parameter in a field simavr does not use.
    let chip = unsafe { chip((*io).irq_names.cast()) };
    chip.reset_seen.set(Some(chip.cycle()));
}
