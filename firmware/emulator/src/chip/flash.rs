//! Self-programming: the instruction SPM as the chip has it.
//!
//! ```text
//!             0x00000 .. 0x1DFFF                    0x1E000 .. 0x1FFFF
//!   SPM       the program goes on for 4.5 ms        the core is halted for 4.5 ms
//!   SPMEN     set until that is over                set until that is over
//!   RWWSB     set until RWWSRE or the next fill     as it was
//!   LPM       reads 0xFF while RWWSB is set         reads as always
//!   a fetch   hangs the core while RWWSB is set
//! ```
//!
//! simavr writes at once, from any section, whatever the lock bits say, and replaces the page
//! where the chip can only clear bits. So its own functions for SPM and LPM are not used at all.
//!
//! A page whose erasure or writing is cut off by a loss of power is torn: each bit may have changed
//! or not. After another reset it is complete, because the voltage was there.

use core::cell::{Cell, RefCell};
use core::ffi::{c_int, c_void};
use std::rc::Rc;

use simavr_ffi as ffi;

use super::queue::Event;
use super::serial::find;
use super::{Chip, FLASH, FREQUENCY, Fuses, chip, register};

const SPMEN: u8 = 0x01;
const PGERS: u8 = 0x02;
const PGWRT: u8 = 0x04;
const BLBSET: u8 = 0x08;
const RWWSRE: u8 = 0x10;
const SIGRD: u8 = 0x20;
const RWWSB: u8 = 0x40;
const SPMIE: u8 = 0x80;

/// The values of the low six bits that do something; the chip ignores all others.
const FILL: u8 = SPMEN;
const ERASE: u8 = SPMEN | PGERS;
const WRITE: u8 = SPMEN | PGWRT;
const LOCK: u8 = SPMEN | BLBSET;
const READ_AGAIN: u8 = SPMEN | RWWSRE;
const SIGNATURE: u8 = SPMEN | SIGRD;
const COMMANDS: [u8; 6] = [FILL, ERASE, WRITE, LOCK, READ_AGAIN, SIGNATURE];

/// The bit of EECR that says that the EEPROM writes.
const EEPE: u8 = 0x02;
/// Bytes of a page.
const PAGE: usize = 256;
/// The first byte of the section that cannot be read while it is written: the core is halted.
const NO_READ_WHILE_WRITE: usize = 0x1_E000;
/// An erasure or a write takes 3.7 to 4.5 ms.
const BUSY: u64 = FREQUENCY * 45 / 10_000;
/// SPM and LPM obey a command for so many cycles after it was written.
const OBEYS: u64 = 4;
/// A word that no instruction has. It lies where the program cannot fetch.
const NO_INSTRUCTION: [u8; 2] = [0xFF, 0x00];

/// simavr's numbers for the instructions SPM and LPM.
const SPM: u32 = u32::from_be_bytes(*b"fspm");
const LPM: u32 = u32::from_be_bytes(*b"flpm");

/// A page that is being erased or written; the flash has its new content already.
struct Work {
    page: usize,
    old: Vec<u8>,
    halts: bool,
}

/// The state of self-programming.
pub(super) struct Flash {
    io: *mut ffi::avr_flash_t,
    fuses: Cell<Fuses>,
    /// The words of the page buffer that the program has filled.
    buffer: RefCell<[Option<u16>; PAGE / 2]>,
    /// The command in SPMCSR, and when it was written.
    command: Cell<Option<(u8, u64)>>,
    work: RefCell<Option<Work>>,
    /// The content of the section that cannot be read now.
    hidden: RefCell<Option<Vec<u8>>>,
    life: Cell<u32>,
    refused: Cell<u64>,
}

impl Flash {
    pub(super) fn of(avr: *mut ffi::avr_t, fuses: Fuses) -> Self {
        // simavr's description of this chip has one of it.
        let io = find(avr, c"flash")
            .first()
            .expect("simavr's atmega1284p programs itself")
            .cast();
        Self {
            io,
            fuses: Cell::new(fuses),
            buffer: RefCell::new([None; PAGE / 2]),
            command: Cell::new(None),
            work: RefCell::default(),
            hidden: RefCell::default(),
            life: Cell::new(0),
            refused: Cell::new(0),
        }
    }

    /// Whether the core stands still because its own section is being written.
    pub(super) fn is_halting(&self) -> bool {
        self.work.borrow().as_ref().is_some_and(|work| work.halts)
    }

    /// A write to the EEPROM destroys the page buffer.
    pub(super) fn empty_buffer(&self) {
        *self.buffer.borrow_mut() = [None; PAGE / 2];
    }

    fn is_busy(&self) -> bool {
        self.work.borrow().is_some()
    }

    fn next_life(&self) -> u32 {
        self.life.set(self.life.get() + 1);
        self.life.get()
    }
}

impl Chip {
    /// Puts this module in the place of simavr's functions for SPM and LPM.
    pub(super) fn hook_flash(self: &Rc<Self>) {
        // SAFETY: the structure belongs to a living chip, and the chip outlives its simavr half.
        unsafe {
            let io = &raw mut (*self.flash.io).io;
            (*io).ioctl = Some(on_flash_ioctl);
            // simavr never reads the names again.
            (*io).irq_names = self.param().cast();
            let bad = (*self.avr).irq.add(ffi::AVR_CORE_BAD_OPCODE as usize);
            ffi::avr_irq_register_notify(bad, Some(on_bad_instruction), self.param());
        }
        self.take_over(register::SPMCSR, on_write_spmcsr);
        self.take_over(register::RAMPZ, on_write_rampz);
    }

    /// The content of the whole flash, as a programmer reads it.
    pub fn flash(&self) -> Vec<u8> {
        let mut content = self.flash_bytes(0, FLASH).to_vec();
        if let Some(hidden) = self.flash.hidden.borrow().as_ref() {
            content[..NO_READ_WHILE_WRITE].copy_from_slice(hidden);
        }
        content
    }

    /// The fuses, and the lock bits as they are now.
    pub fn fuses(&self) -> Fuses {
        self.flash.fuses.get()
    }

    /// Whether a page is being erased or written.
    pub fn is_programming(&self) -> bool {
        self.flash.is_busy()
    }

    /// How often the chip refused an SPM: from outside the boot section, or into a locked section.
    pub fn refused_spm(&self) -> u64 {
        self.flash.refused.get()
    }

    /// The chip has no power any more; a page that it programs is torn.
    pub(super) fn tear_page(&self) {
        let Some(work) = self.flash.work.take() else {
            return;
        };
        self.show_section();
        let page = self.flash_bytes(work.page, PAGE);
        let mut state = self.cycle() | 1;
        for (new, old) in page.iter_mut().zip(work.old) {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let changed = (state >> 56) as u8;
            *new = *new & changed | old & !changed;
        }
    }

    /// Brings self-programming into its state after a reset.
    pub(super) fn release_flash(&self) {
        self.flash.next_life();
        self.flash.work.take();
        self.flash.command.set(None);
        self.flash.empty_buffer();
        self.show_section();
    }

    /// The page is erased or written.
    pub(super) fn flash_done(&self, life: u32) {
        if self.flash.life.get() == life {
            self.flash.work.take();
            self.end_command();
        }
    }

    /// Nobody executed SPM in time.
    pub(super) fn spm_expired(&self, life: u32) {
        if self.flash.life.get() == life {
            self.end_command();
        }
    }

    fn end_command(&self) {
        self.flash.command.set(None);
        self.flash.next_life();
        let kept = self.register(register::SPMCSR) & (RWWSB | SPMIE);
        self.set_register(register::SPMCSR, kept);
    }

    fn write_spmcsr(&self, value: u8) {
        let before = self.register(register::SPMCSR);
        let command = value & !(RWWSB | SPMIE);
        let blocked = self.flash.is_busy() || self.register(register::EECR) & EEPE != 0;
        if blocked || !COMMANDS.contains(&command) {
            self.set_register(register::SPMCSR, before & !SPMIE | value & SPMIE);
            return;
        }
        self.set_register(register::SPMCSR, before & RWWSB | value & !RWWSB);
        let now = self.cycle();
        self.flash.command.set(Some((command, now)));
        let life = self.flash.next_life();
        self.schedule(now + OBEYS + 1, Event::SpmExpired { life });
    }

    /// The command that an SPM or LPM of this cycle carries out.
    fn take_command(&self, which: &[u8]) -> Option<u8> {
        let (command, at) = self.flash.command.get()?;
        if self.cycle() - at > OBEYS || !which.contains(&command) {
            return None;
        }
        self.end_command();
        Some(command)
    }

    /// The program executes SPM.
    fn spm(&self) {
        let commands = [FILL, ERASE, WRITE, LOCK, READ_AGAIN];
        let Some(command) = self.take_command(&commands) else {
            return;
        };
        let z = self.z() | u32::from(self.register(register::RAMPZ) & 1) << 16;
        let mut fuses = self.flash.fuses.get();
        let writes = [ERASE, WRITE].contains(&command);
        if self.pc() < fuses.boot_section() || writes && fuses.forbid_writing(z) {
            self.flash.refused.set(self.flash.refused.get() + 1);
            return;
        }
        match command {
            FILL => {
                let word = u16::from_le_bytes([self.register(0), self.register(1)]);
                let place = z as usize % PAGE / 2;
                // A second word for the same place is lost.
                self.flash.buffer.borrow_mut()[place].get_or_insert(word);
                self.read_again();
            }
            READ_AGAIN => {
                self.flash.empty_buffer();
                self.read_again();
            }
            LOCK => {
                fuses.program_lock(self.register(0));
                self.flash.fuses.set(fuses);
            }
            _ => self.program_page(command, z as usize & !(PAGE - 1)),
        }
    }

    fn program_page(&self, command: u8, page: usize) {
        let halts = page >= NO_READ_WHILE_WRITE;
        if !halts {
            self.hide_section();
        }
        let mut hidden = self.flash.hidden.borrow_mut();
        let content = match hidden.as_mut() {
            Some(hidden) if !halts => &mut hidden[page..page + PAGE],
            _ => self.flash_bytes(page, PAGE),
        };
        let old = content.to_vec();
        if command == ERASE {
            content.fill(0xFF);
        } else {
            let words = self.flash.buffer.replace([None; PAGE / 2]);
            for (place, word) in content.chunks_exact_mut(2).zip(words) {
                // Writing only clears bits.
                for (byte, new) in place.iter_mut().zip(word.unwrap_or(0xFFFF).to_le_bytes()) {
                    *byte &= new;
                }
            }
        }
        *self.flash.work.borrow_mut() = Some(Work { page, old, halts });
        let section = if halts { 0 } else { RWWSB };
        let bits = self.register(register::SPMCSR) | command | section;
        self.set_register(register::SPMCSR, bits);
        let life = self.flash.next_life();
        self.schedule(self.cycle() + BUSY, Event::FlashDone { life });
        // SAFETY: a plain field of a living chip. The core comes back after this instruction.
        unsafe { (*self.avr).run_cycle_count = 0 };
    }

    /// The program executes LPM or ELPM; `byte` is what simavr has read.
    fn lpm(&self, byte: &mut u8) {
        match self.take_command(&[LOCK, SIGNATURE]) {
            Some(LOCK) => *byte = self.fuses().read(self.z() as u16).unwrap_or(0xFF),
            Some(_) => {
                // SAFETY: plain fields of a living chip.
                let signature = unsafe { (*self.avr).signature };
                *byte = match self.z() {
                    z @ (0 | 2 | 4) => signature[z as usize / 2],
                    _ => 0xFF,
                };
            }
            None => {
                let high = if self.is_elpm() {
                    u32::from(self.register(register::RAMPZ) & 1) << 16
                } else {
                    0
                };
                let address = (self.z() | high) as usize;
                if address < NO_READ_WHILE_WRITE && self.flash.hidden.borrow().is_some() {
                    *byte = 0xFF;
                }
            }
        }
    }

    /// Whether the present instruction is one of ELPM's forms.
    fn is_elpm(&self) -> bool {
        let code = self.flash_bytes(self.pc() as usize, 2);
        let code = u16::from_le_bytes([code[0], code[1]]);
        code == 0x95D8 || code & 0xFE0E == 0x9006
    }

    /// Makes the section that is read while another writes unreadable.
    fn hide_section(&self) {
        let mut hidden = self.flash.hidden.borrow_mut();
        if hidden.is_none() {
            let section = self.flash_bytes(0, NO_READ_WHILE_WRITE);
            *hidden = Some(section.to_vec());
            for word in section.chunks_exact_mut(2) {
                word.copy_from_slice(&NO_INSTRUCTION);
            }
        }
    }

    fn show_section(&self) {
        if let Some(content) = self.flash.hidden.take() {
            self.flash_bytes(0, NO_READ_WHILE_WRITE)
                .copy_from_slice(&content);
        }
    }

    fn read_again(&self) {
        self.show_section();
        let bits = self.register(register::SPMCSR) & !RWWSB;
        self.set_register(register::SPMCSR, bits);
    }

    fn z(&self) -> u32 {
        u32::from(u16::from_le_bytes([self.register(30), self.register(31)]))
    }

    fn pc(&self) -> u32 {
        // SAFETY: a plain field of a living chip.
        unsafe { (*self.avr).pc }
    }

    /// simavr's flash. Each caller lets go of the slice before another one is made.
    #[allow(clippy::mut_from_ref)] // it is memory of simavr, which has no owner in Rust
    fn flash_bytes(&self, from: usize, count: usize) -> &mut [u8] {
        assert!(from + count <= FLASH);
        // SAFETY: the flash has `FLASH` bytes. The core is between two instructions or inside one
        // that has been fetched, and reads none of it now.
        unsafe { core::slice::from_raw_parts_mut((*self.avr).flash.add(from), count) }
    }
}

unsafe extern "C" fn on_flash_ioctl(
    io: *mut ffi::avr_io_t,
    ctl: u32,
    argument: *mut c_void,
) -> c_int {
    // SAFETY: the structure carries the chip's parameter in a field that simavr does not use after
    // its start; for LPM the argument is the byte read.
    unsafe {
        let chip = chip((*io).irq_names.cast());
        match ctl {
            SPM => chip.spm(),
            LPM => chip.lpm(&mut *argument.cast()),
            _ => return -1,
        }
    }
    0
}

/// The core stands still; simavr would step over the word.
unsafe extern "C" fn on_bad_instruction(_: *mut ffi::avr_irq_t, _: u32, param: *mut c_void) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { (*chip(param).avr).state = ffi::cpu_Crashed as c_int };
}

unsafe extern "C" fn on_write_spmcsr(_: *mut ffi::avr_t, _: u16, value: u8, param: *mut c_void) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.write_spmcsr(value);
}

/// The register has one bit; with more, simavr would read beyond the flash.
unsafe extern "C" fn on_write_rampz(_: *mut ffi::avr_t, _: u16, value: u8, param: *mut c_void) {
    // SAFETY: the callback was registered with `Chip::param`, and the chip still lives.
    unsafe { chip(param) }.set_register(register::RAMPZ, value & 1);
}
