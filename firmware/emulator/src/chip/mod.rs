//! One ATmega1284P: simavr's core and timers, corrected where simavr differs from the chip.
//!
//! ```text
//!   simavr                               here
//!   ------------------------------------ ------------------------------------------------------
//!   core, timers, INT, ports, watchdog   as they are
//!   USART                                replaced: `usart` (machine), `serial` (registers)
//!   ADC takes 24 of its clocks           13, and 25 the first time                 `corrections`
//!   interrupts start in no time          4 cycles, 8 from sleep                    `run`
//!   sleep waits with usleep, 1 too long  jumps to the next event, exact            `run`
//!   reset sets the clock to 0, no delay  the clock goes on, 65 ms start-up         `run`
//!   PWM output overwrites PORT           cut off; motors are read from registers   `corrections`
//!   EEPROM writes in no time             3.4 ms                                    `corrections`
//!   watchdog never resets with I clear   it does, at the second time-out           `corrections`
//!   enabling an interrupt whose flag     raises it                                 `corrections`
//!     is set does nothing
//!   SPM writes at once, anywhere        4.5 ms, boot section only, lock bits     `flash`
//! ```
//!
//! A caller drives a chip by [`Chip::run_until`]; the chip never waits and reads no clock. Its
//! cycle count begins when power comes on and never goes back, not even at a reset. In the SAFETY
//! comments, a living chip is a [`Chip`] that has not been dropped.
#![allow(unsafe_code)] // simavr is C; every block says why it is sound.

mod access;
mod corrections;
mod flash;
mod fuses;
mod handlers;
mod image;
mod interrupts;
mod pins;
mod queue;
mod run;
mod serial;
mod usart;
mod usarts;

use core::cell::{Cell, RefCell};
use core::ffi::{c_char, c_int, c_void};
use std::rc::Rc;

use simavr_ffi as ffi;

pub use fuses::{FLASH, Fuses};
pub use image::{EEPROM, Image, ImageError};
pub use interrupts::{InterruptStatistics, VectorStatistics};
pub use pins::{Level, Pin, Wire, wire};
pub use serial::Sent;
pub(crate) use usart::sampled;
pub use usarts::UsartId;

use corrections::Peripherals;
use interrupts::Interrupts;
use queue::Queue;
use serial::Ports;

/// Cycles in a second: the crystal of both boards.
pub const FREQUENCY: u64 = 16_000_000;

/// Why a chip starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetLine {
    /// Power comes on.
    Power,
    /// The reset pin.
    External,
    /// The supply voltage fell.
    BrownOut,
    /// The watchdog.
    Watchdog,
}

/// Addresses of the ATmega1284P's registers that this crate uses, in the data space.
pub(crate) mod register {
    pub(crate) const DDRC: u8 = 0x27;
    pub(crate) const PORTC: u8 = 0x28;
    pub(crate) const DDRD: u8 = 0x2A;
    pub(crate) const PORTD: u8 = 0x2B;
    /// EIMSK, PCICR and TIMSK0 to TIMSK3, which enable interrupts.
    pub(crate) const MASKS: [u8; 6] = [0x3D, 0x68, 0x6E, 0x6F, 0x70, 0x71];
    pub(crate) const EIFR: u8 = 0x3C;
    pub(crate) const EICRA: u8 = 0x69;
    pub(crate) const EECR: u8 = 0x3F;
    pub(crate) const MCUSR: u8 = 0x54;
    pub(crate) const SPMCSR: u8 = 0x57;
    pub(crate) const RAMPZ: u8 = 0x5B;
    pub(crate) const WDTCSR: u8 = 0x60;
    pub(crate) const ADCSRA: u8 = 0x7A;
    pub(crate) const TCCR2A: u8 = 0xB0;
    pub(crate) const TCCR2B: u8 = 0xB1;
    pub(crate) const OCR2A: u8 = 0xB3;
    pub(crate) const OCR2B: u8 = 0xB4;
}

/// Called after the program wrote to a watched register, with the cycle.
type OnWrite = Box<dyn Fn(u64)>;
/// Called for a conversion with the ADC's channel and the cycle; returns the input in millivolts.
type OnConversion = Box<dyn Fn(u8, u64) -> u32>;
/// Called for an alarm of [`Chip::alarm`] with its tag and the cycle.
type OnAlarm = Box<dyn Fn(u32, u64)>;

/// A register's handler of simavr, which ours has replaced.
struct Original {
    address: u8,
    write: ffi::avr_io_write_t,
    param: *mut c_void,
}

/// One chip. It is single-threaded, and everything in it is reached by shared references, because
/// simavr calls back while it runs.
pub struct Chip {
    avr: *mut ffi::avr_t,
    peripherals: Peripherals,
    flash: flash::Flash,
    reset_hook: Cell<*mut ffi::avr_io_t>,
    queue: Queue,
    ports: Ports,
    interrupts: Interrupts,
    originals: RefCell<Vec<Original>>,
    watched: RefCell<Vec<u8>>,
    on_write: RefCell<Option<OnWrite>>,
    on_conversion: RefCell<Option<OnConversion>>,
    on_alarm: RefCell<Option<OnAlarm>>,
    wires: RefCell<pins::Wires>,
    running: Cell<bool>,
    held_until: Cell<Option<u64>>,
    reset_seen: Cell<Option<u64>>,
    resets: Cell<u64>,
    crashes: Cell<u64>,
    asleep: Cell<bool>,
    slept: Cell<u64>,
}

unsafe extern "C" {
    /// simavr's core: runs one instruction, or as many as fit before the next timer. Its header is
    /// private, the function is not.
    fn avr_run_one(avr: *mut ffi::avr_t) -> u32;
    /// The allocator of simavr's own structures.
    fn free(memory: *mut c_void);
}

impl Chip {
    /// A chip with `image` in its flash, and with its fuses. Power comes on at cycle 0; the program starts `delay`
    /// cycles after the usual start-up time. `noise` fills its RAM, which has random content after
    /// power-on.
    ///
    /// # Errors
    /// simavr was built without this chip.
    pub fn new(image: &Image, delay: u64, noise: u64) -> Result<Rc<Self>, ImageError> {
        silence();
        let fuses = image.fuses.unwrap_or_default();
        // SAFETY: the name is a C string; the result is checked before use.
        let avr = unsafe { ffi::avr_make_mcu_by_name(c"atmega1284p".as_ptr()) };
        if avr.is_null() {
            return Err(ImageError::NoChip);
        }
        // SAFETY: `avr` is a fresh chip that nobody else has.
        unsafe {
            (*avr).frequency = FREQUENCY as u32;
            ffi::avr_init(avr);
            (*avr).vcc = 5_000;
            (*avr).avcc = 5_000;
            (*avr).aref = 5_000;
            (*avr).reset_pc = fuses.start();
            (*avr).set_log(0);
        }
        let chip = Rc::new(Self {
            avr,
            peripherals: Peripherals::of(avr),
            flash: flash::Flash::of(avr, fuses),
            reset_hook: Cell::new(core::ptr::null_mut()),
            queue: Queue::default(),
            ports: Ports::of(avr),
            interrupts: Interrupts::default(),
            originals: RefCell::default(),
            watched: RefCell::default(),
            on_write: RefCell::default(),
            on_conversion: RefCell::default(),
            on_alarm: RefCell::default(),
            wires: RefCell::default(),
            running: Cell::new(false),
            held_until: Cell::new(None),
            reset_seen: Cell::new(None),
            resets: Cell::new(0),
            crashes: Cell::new(0),
            asleep: Cell::new(false),
            slept: Cell::new(0),
        });
        chip.fill(image, noise);
        chip.hook_reset();
        chip.hook_serial();
        chip.hook_interrupts();
        chip.hook_corrections();
        chip.hook_flash();
        chip.begin_reset(delay);
        Ok(chip)
    }

    /// Cycles since power came on.
    pub fn cycle(&self) -> u64 {
        // SAFETY: a plain field; `avr` lives as long as the chip.
        unsafe { (*self.avr).cycle }
    }

    /// The value of the data space at `address`, without the side effects of a read.
    pub fn register(&self, address: u8) -> u8 {
        // SAFETY: the data space is larger than 256 bytes.
        unsafe { *(*self.avr).data.add(usize::from(address)) }
    }

    /// How often the chip was reset, power-on not counted.
    pub fn resets(&self) -> u64 {
        self.resets.get()
    }

    /// How often the core met an invalid instruction and stood still until its reset.
    pub fn crashes(&self) -> u64 {
        self.crashes.get()
    }

    /// Whether the chip is in reset or starting up.
    pub fn is_held(&self) -> bool {
        self.held_until.get().is_some()
    }

    /// Cycles the core has slept since power came on.
    pub fn slept(&self) -> u64 {
        self.slept.get()
    }

    /// The interrupts so far: how often, how long, how late.
    pub fn interrupts(&self) -> InterruptStatistics {
        self.interrupts.statistics(self.cycle())
    }

    /// Sets the interrupts' statistics to zero.
    pub fn clear_interrupts(&self) {
        self.interrupts.clear(self.cycle());
    }

    /// Calls `action` with the cycle after each write of the program to one of `addresses`, and
    /// after each reset.
    pub fn watch(self: &Rc<Self>, addresses: &[u8], action: impl Fn(u64) + 'static) {
        *self.on_write.borrow_mut() = Some(Box::new(action));
        for &address in addresses {
            self.take_over(address, on_watched);
            self.watched.borrow_mut().push(address);
        }
    }

    /// Sets the function that gives the voltage at an ADC channel, in millivolts.
    pub fn on_conversion(&self, action: impl Fn(u8, u64) -> u32 + 'static) {
        *self.on_conversion.borrow_mut() = Some(Box::new(action));
    }

    /// Sets the receiver of alarms.
    pub fn on_alarm(&self, action: impl Fn(u32, u64) + 'static) {
        *self.on_alarm.borrow_mut() = Some(Box::new(action));
    }

    /// Sets an alarm: the receiver gets `tag` at this cycle, or at once if it is past. Alarms
    /// survive resets.
    pub fn alarm(&self, at: u64, tag: u32) {
        self.schedule(at, queue::Event::Alarm { tag });
    }

    fn fill(&self, image: &Image, noise: u64) {
        // SAFETY: an image's pieces lie inside the flash, and `avr_loadcode` copies them; the data
        // space has `ramend` + 1 bytes.
        unsafe {
            for (address, bytes) in &image.flash {
                let mut bytes = bytes.clone();
                ffi::avr_loadcode(
                    self.avr,
                    bytes.as_mut_ptr(),
                    bytes.len() as u32,
                    *address as u32,
                );
            }
            (*self.avr).codeend = (*self.avr).flashend;
            let mut state = noise | 1;
            for address in 0x100..=usize::from((*self.avr).ramend) {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                *(*self.avr).data.add(address) = (state >> 56) as u8;
            }
        }
        for (address, bytes) in &image.eeprom {
            self.peripherals.set_eeprom(*address, bytes);
        }
    }

    /// Puts `handler` in place of a register's write handler, and keeps the original.
    fn take_over(self: &Rc<Self>, address: u8, handler: WriteHandler) {
        let taken = |original: &Original| original.address == address;
        if self.originals.borrow().iter().any(taken) {
            return;
        }
        // SAFETY: the address is that of an I/O register; the table has an entry for each. The chip
        // outlives its simavr half, so the pointer stays valid.
        unsafe {
            let place = &raw mut (*self.avr).io[usize::from(address) - 32].w;
            self.originals.borrow_mut().push(Original {
                address,
                write: (*place).c,
                param: (*place).param,
            });
            (*place).c = Some(handler);
            (*place).param = self.param();
        }
    }

    /// Handles a write as simavr itself does.
    fn write_through(&self, address: u8, value: u8) {
        let original = self
            .originals
            .borrow()
            .iter()
            .find(|original| original.address == address)
            .and_then(|original| Some((original.write?, original.param)));
        // SAFETY: the handler and its parameter were registered together by simavr for this
        // chip; without a handler simavr stores the value.
        unsafe {
            match original {
                Some((write, param)) => write(self.avr, u16::from(address), value, param),
                None => *(*self.avr).data.add(usize::from(address)) = value,
            }
        }
    }

    fn set_register(&self, address: u8, value: u8) {
        // SAFETY: the data space is larger than 256 bytes.
        unsafe { *(*self.avr).data.add(usize::from(address)) = value };
    }

    /// Calls the watcher of registers, because one may have changed.
    fn tell_watcher(&self) {
        if let Some(action) = self.on_write.borrow().as_ref() {
            action(self.cycle());
        }
    }

    /// The parameter that simavr passes to our callbacks.
    fn param(self: &Rc<Self>) -> *mut c_void {
        Rc::as_ptr(self).cast_mut().cast()
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        // SAFETY: nobody runs the chip any more; simavr frees its own memory in it, then the chip
        // itself and the reset hook, which was made by `Box::into_raw`.
        unsafe {
            ffi::avr_terminate(self.avr);
            let hook = self.reset_hook.get();
            if !hook.is_null() {
                drop(Box::from_raw(hook));
            }
            free(self.avr.cast());
        }
    }
}

/// simavr's write handler of a register.
type WriteHandler = unsafe extern "C" fn(*mut ffi::avr_t, u16, u8, *mut c_void);

/// The chip behind a callback's parameter.
///
/// # Safety
/// `param` comes from [`Chip::param`], and the chip still lives.
unsafe fn chip<'chip>(param: *mut c_void) -> &'chip Chip {
    // SAFETY: by this function's contract; only shared references to a chip exist.
    unsafe { &*param.cast_const().cast() }
}

unsafe extern "C" fn on_watched(_: *mut ffi::avr_t, address: u16, value: u8, param: *mut c_void) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    let chip = unsafe { chip(param) };
    chip.write_through(address as u8, value);
    chip.tell_watcher();
}

/// Silences simavr, which writes to stdout and stderr; this crate notices its errors otherwise.
fn silence() {
    unsafe extern "C" fn quiet(
        _: *mut ffi::avr_t,
        _: c_int,
        _: *const c_char,
        _: *mut ffi::__va_list_tag,
    ) {
    }
    // SAFETY: the signature is simavr's; setting the same function again changes nothing.
    unsafe { ffi::avr_global_logger_set(Some(quiet)) };
}
