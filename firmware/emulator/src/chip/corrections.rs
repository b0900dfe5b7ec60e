//! Corrects simavr's peripherals where they differ from the chip.
//!
//! - **ADC**: simavr converts in 24 of the converter's clocks, and in 168 the first time: it waits
//!   eleven times as long as it has already waited. The chip needs 13 and 25.
//! - **Watchdog**: while interrupts are off, simavr raises its interrupt again and again. The chip
//!   resets at the second time-out.
//! - **EEPROM**: simavr writes in no time. The chip takes 3.4 ms and sets EEPE meanwhile.
//! - **Interrupts** whose flag is set before they are enabled never come. On the chip they come at
//!   once.
//! - **External interrupts** set their flag at a low level, which is their mode after a reset. On
//!   the chip a level never sets the flag.
//! - **Timers** write their compare outputs into the PORT register, over the program's own bits. On
//!   the chip they only override the pin. So the connection is cut.

use core::cell::Cell;
use core::ffi::{c_int, c_void};
use std::rc::Rc;

use simavr_ffi as ffi;

use super::queue::Event;
use super::run::WDRF;
use super::serial::find;
use super::{Chip, EEPROM, FREQUENCY, chip, register};

/// The watchdog's vector.
pub(super) const WATCHDOG_VECTOR: u8 = 8;

/// Bits of WDTCSR.
const WDIF: u8 = 0x80;
const WDE: u8 = 0x08;
/// Bits of EECR.
const EERE: u8 = 0x01;
const EEPE: u8 = 0x02;
const EEMPE: u8 = 0x04;
/// An EEPROM byte is erased and written in 3.4 ms.
const EEPROM_WRITE: u64 = FREQUENCY * 34 / 10_000;

/// simavr's number for the instruction WDR.
const WATCHDOG_RESET: u32 = u32::from_be_bytes(*b"wdtr");
/// simavr's number for the question which lines belong to a register's bits.
const LINES_OF_PIN: u32 = u32::from_be_bytes(*b"iogr");

type Ioctl = unsafe extern "C" fn(*mut ffi::avr_io_t, u32, *mut c_void) -> c_int;

/// simavr's structures of the corrected peripherals.
pub(super) struct Peripherals {
    adc: *mut ffi::avr_adc_t,
    watchdog: *mut ffi::avr_watchdog_t,
    eeprom: *mut ffi::avr_eeprom_t,
    timers: Vec<*mut ffi::avr_timer_t>,
    original_ioctl: Cell<Option<Ioctl>>,
    watchdog_life: Cell<u32>,
    watchdog_fed: Cell<u64>,
    eeprom_life: Cell<u32>,
    eeprom_busy: Cell<bool>,
}

impl Peripherals {
    pub(super) fn of(avr: *mut ffi::avr_t) -> Self {
        let one = |kind| {
            // simavr's description of this chip names one of each.
            *find(avr, kind)
                .first()
                .expect("simavr's atmega1284p has this peripheral")
        };
        Self {
            adc: one(c"adc").cast(),
            watchdog: one(c"watchdog").cast(),
            eeprom: one(c"eeprom").cast(),
            timers: find(avr, c"timer")
                .into_iter()
                .map(|io| io.cast())
                .collect(),
            original_ioctl: Cell::new(None),
            watchdog_life: Cell::new(0),
            watchdog_fed: Cell::new(0),
            eeprom_life: Cell::new(0),
            eeprom_busy: Cell::new(false),
        }
    }

    pub(super) fn eeprom(&self) -> &[u8] {
        // SAFETY: simavr allocated this many bytes for the chip's EEPROM, and nobody writes them
        // while the slice exists.
        unsafe { core::slice::from_raw_parts((*self.eeprom).eeprom, EEPROM) }
    }

    pub(super) fn set_eeprom(&self, from: usize, content: &[u8]) {
        let count = content.len().min(EEPROM.saturating_sub(from));
        // SAFETY: as above, and `from + count` is inside the EEPROM.
        unsafe {
            let place = (*self.eeprom).eeprom.add(from.min(EEPROM));
            core::ptr::copy_nonoverlapping(content.as_ptr(), place, count);
        }
    }
}

impl Chip {
    pub(super) fn hook_corrections(self: &Rc<Self>) {
        let param = self.param();
        // SAFETY: the lines and structures belong to a living chip, the callbacks have simavr's
        // signatures, and the chip outlives its simavr half.
        unsafe {
            let trigger = (*self.peripherals.adc)
                .io
                .irq
                .add(ffi::ADC_IRQ_OUT_TRIGGER as usize);
            ffi::avr_irq_register_notify(trigger, Some(on_convert), param);
            let watchdog = &raw mut (*self.peripherals.watchdog).io;
            self.peripherals.original_ioctl.set((*watchdog).ioctl);
            (*watchdog).ioctl = Some(on_watchdog_ioctl);
            // simavr never reads the names again.
            (*watchdog).irq_names = param.cast();
        }
        self.take_over(register::EECR, on_write_eecr);
        self.take_over(register::EICRA, on_write_eicra);
        for address in register::MASKS {
            self.take_over(address, on_write_mask);
        }
    }

    /// Brings the peripherals into their state after a reset by simavr.
    pub(super) fn release_peripherals(&self) {
        let own = &self.peripherals;
        own.watchdog_life.set(own.watchdog_life.get() + 1);
        own.eeprom_life.set(own.eeprom_life.get() + 1);
        own.eeprom_busy.set(false);
        for &timer in &own.timers {
            // SAFETY: a timer of a living chip; simavr ignores a connection that does not exist,
            // and makes the connections again at each reset.
            unsafe {
                for (index, compare) in (*timer).comp.iter().enumerate() {
                    let mut request: ffi::avr_ioport_getirq_t = core::mem::zeroed();
                    request.bit = compare.com_pin;
                    if request.bit.reg() == 0
                        || ffi::avr_ioctl(self.avr, LINES_OF_PIN, (&raw mut request).cast()) <= 0
                    {
                        continue;
                    }
                    let output = (*timer)
                        .io
                        .irq
                        .add(ffi::TIMER_IRQ_OUT_COMP as usize + index);
                    ffi::avr_unconnect_irq(output, request.irq[0]);
                }
            }
        }
    }

    /// simavr's watchdog has raised its interrupt.
    pub(super) fn watchdog_fired(&self) {
        let own = &self.peripherals;
        let life = own.watchdog_life.get() + 1;
        own.watchdog_life.set(life);
        if self.register(register::WDTCSR) & WDE != 0 {
            // SAFETY: a plain field of a living chip's watchdog.
            let period = unsafe { (*own.watchdog).cycle_count };
            self.schedule(self.cycle() + period, Event::WatchdogAgain { life });
        }
    }

    /// A second time-out has passed: if the interrupt still waits, the chip resets.
    pub(super) fn watchdog_again(&self, life: u32) {
        let own = &self.peripherals;
        if own.watchdog_life.get() != life {
            return;
        }
        let bits = self.register(register::WDTCSR);
        // SAFETY: plain fields of a living chip's watchdog.
        let (waits, period) = unsafe {
            let watchdog = own.watchdog;
            ((*watchdog).watchdog.pending() != 0, (*watchdog).cycle_count)
        };
        if !waits || bits & WDIF == 0 || bits & WDE == 0 {
            return;
        }
        let due = own.watchdog_fed.get() + period;
        if due > self.cycle() {
            self.schedule(due, Event::WatchdogAgain { life });
        } else {
            self.reset_with(WDRF);
        }
    }

    pub(super) fn eeprom_done(&self, life: u32) {
        let own = &self.peripherals;
        if own.eeprom_life.get() == life {
            own.eeprom_busy.set(false);
            self.set_register(register::EECR, self.register(register::EECR) & !EEPE);
        }
    }

    fn write_eecr(&self, value: u8) {
        let own = &self.peripherals;
        if own.eeprom_busy.get() {
            // During a write the chip can neither write nor read.
            self.write_through(register::EECR, value & !(EERE | EEPE | EEMPE));
            self.set_register(register::EECR, self.register(register::EECR) | EEPE);
            return;
        }
        let writes = self.register(register::EECR) & EEMPE != 0 && value & EEPE != 0;
        self.write_through(register::EECR, value);
        if writes {
            let life = own.eeprom_life.get() + 1;
            own.eeprom_life.set(life);
            own.eeprom_busy.set(true);
            self.flash.empty_buffer();
            self.set_register(register::EECR, self.register(register::EECR) | EEPE);
            self.schedule(self.cycle() + EEPROM_WRITE, Event::EepromDone { life });
        }
    }

    /// simavr has started a conversion and asks for the voltage.
    fn convert(&self, channel: u8) {
        let millivolts = self
            .on_conversion
            .borrow()
            .as_ref()
            .map_or(0, |voltage| voltage(channel, self.cycle()));
        let prescale = self.register(register::ADCSRA) & 7;
        // SAFETY: the converter of a living chip; its line for the channel exists.
        unsafe {
            let adc = self.peripherals.adc;
            ffi::avr_raise_irq((*adc).io.irq.add(usize::from(channel & 7)), millivolts);
            // simavr multiplies this by eleven to get the rest of the conversion.
            (*adc).current_prescale = 1 << prescale.max(1);
        }
    }
}

unsafe extern "C" fn on_convert(_: *mut ffi::avr_irq_t, value: u32, param: *mut c_void) {
    // The channel is in the topmost of simavr's packed fields.
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.convert((value >> 19) as u8);
}

unsafe extern "C" fn on_watchdog_ioctl(
    io: *mut ffi::avr_io_t,
    ctl: u32,
    argument: *mut c_void,
) -> c_int {
    // SAFETY: the watchdog's structure carries the chip's parameter in a field that simavr does not
    // use after its start; the original function is stored.
    unsafe {
        let chip = chip((*io).irq_names.cast());
        if ctl == WATCHDOG_RESET {
            chip.peripherals.watchdog_fed.set(chip.cycle());
        }
        chip.peripherals
            .original_ioctl
            .get()
            .map_or(-1, |original| original(io, ctl, argument))
    }
}

unsafe extern "C" fn on_write_eicra(_: *mut ffi::avr_t, _: u16, value: u8, param: *mut c_void) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    let chip = unsafe { chip(param) };
    let modes = chip.register(register::EICRA);
    let levels = (0..3).filter(|interrupt| modes >> (2 * interrupt) & 3 == 0);
    let flags = levels.fold(0, |flags, interrupt| flags | 1 << interrupt);
    chip.set_register(register::EIFR, chip.register(register::EIFR) & !flags);
    chip.write_through(register::EICRA, value);
}

unsafe extern "C" fn on_write_mask(
    _: *mut ffi::avr_t,
    address: u16,
    value: u8,
    param: *mut c_void,
) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    let chip = unsafe { chip(param) };
    chip.write_through(address as u8, value);
    chip.raise_waiting(address as u8);
}

unsafe extern "C" fn on_write_eecr(_: *mut ffi::avr_t, _: u16, value: u8, param: *mut c_void) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.write_eecr(value);
}
