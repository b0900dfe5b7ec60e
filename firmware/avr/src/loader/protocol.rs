//! Serves the Pi: takes a command after the other and carries it out.
//!
//! Pages of the boot section are refused. So are all pages until page 0 has come with the header of
//! an image for this board; then nothing has been erased yet.

use lager_avr::eeprom;
use lager_avr::register::{bit, cpu, get, put, usart0};
use lager_avr::{reset, uart};
use lager_loader::{BOOT_SECTION, Header, PAGE, stk};
use lager_wire::Callsign;

use crate::stay::Stay;
use crate::{application, flash};

const RXC: u8 = bit(7);
const TXC: u8 = bit(6);
const UDRE: u8 = bit(5);
/// Frame error and overrun.
const ERRORS: u8 = bit(4) | bit(3);
const RXEN_TXEN: u8 = bit(4) | bit(3);

/// Watchdog reset, external reset and power-on in MCUSR.
const WDRF: u8 = bit(3);
const EXTRF: u8 = bit(1);
const PORF: u8 = bit(0);

/// The chip has so many bytes of flash.
const FLASH_END: u32 = 0x2_0000;

/// A command that did not come whole. Nobody gets an answer.
struct Broken;

pub(crate) struct Loader {
    role: Callsign,
    /// The reset flags that the application gets.
    cause: u8,
    stay: Stay,
    /// Where the next page is, in bytes.
    at: u32,
    /// Whether page 0 of an image for this board has been written.
    accepted: bool,
}

/// Runs the loader; `is_asked`: the application wants it to wait.
pub(crate) fn run(role: Callsign, cause: u8, is_asked: bool) -> ! {
    let may_wait = is_asked || cause & (PORF | EXTRF) != 0;
    if !may_wait && application::is_whole(role) {
        application::start(cause);
    }
    let uart = usart0();
    put(uart.ubrr0(), uart::UBRR);
    put(uart.ucsr0b(), RXEN_TXEN);
    let mut loader = Loader {
        role,
        cause,
        stay: Stay::new(is_asked),
        at: 0,
        accepted: false,
    };
    let mut page = [0; PAGE];
    loop {
        // A command that broke off is forgotten.
        let _ = loader.serve(&mut page);
    }
}

/// Whether the watchdog reset the chip because the application asked for the loader.
pub(crate) fn is_asked(cause: u8) -> bool {
    // The mark is removed in any case.
    reset::take_loader_mark() && cause & WDRF != 0
}

impl Loader {
    /// Takes in a command and carries it out.
    fn serve(&mut self, page: &mut [u8; PAGE]) -> Result<(), Broken> {
        let mut command = self.first_byte();
        let count = loop {
            match command {
                stk::GET_SYNC
                | stk::ENTER_PROGRAMMING
                | stk::LEAVE_PROGRAMMING
                | stk::READ_SIGNATURE => break 0,
                stk::GET_PARAMETER => break 1,
                stk::LOAD_ADDRESS => break 2,
                stk::WRITE_PAGE | stk::READ_PAGE => break 3,
                stk::UNIVERSAL => break 4,
                stk::SET_DEVICE => break 20,
                stk::SET_DEVICE_EXTENDED => break usize::from(self.byte()?.saturating_sub(1)),
                _ => {
                    // Noise, unless the end of a command follows.
                    let next = self.byte()?;
                    if next == stk::EOP {
                        send(stk::INSYNC);
                        send(stk::UNKNOWN);
                        return Ok(());
                    }
                    command = next;
                }
            }
        };
        self.fill(page, count)?;
        let [a0, a1, memory, ..] = *page;
        let mut length = 0;
        if matches!(command, stk::WRITE_PAGE | stk::READ_PAGE) {
            length = usize::from(u16::from_be_bytes([a0, a1]));
            let is_memory = memory == stk::FLASH || memory == stk::EEPROM;
            // No page of this chip is empty or longer.
            if length == 0 || length > PAGE || !is_memory {
                return Err(Broken);
            }
            if command == stk::WRITE_PAGE {
                self.fill(page, length)?;
            }
        }
        if self.byte()? != stk::EOP {
            send(stk::NO_SYNC);
            return Err(Broken);
        }
        send(stk::INSYNC);
        self.stay.on_command();
        match command {
            stk::GET_PARAMETER => self.tell_parameter(a0),
            stk::LOAD_ADDRESS => self.at = u32::from(u16::from_le_bytes([a0, a1])) << 1,
            // An erasure of the chip is answered and not done, as pages are erased one by one.
            stk::UNIVERSAL => send(match (a0, a1) {
                (0x50, 0x00) => flash::fuse(0),
                (0x58, 0x00) => flash::fuse(1),
                (0x50, 0x08) => flash::fuse(2),
                (0x58, 0x08) => flash::fuse(3),
                _ => 0,
            }),
            stk::READ_SIGNATURE => {
                let [s0, s1, s2] = stk::SIGNATURE;
                send(s0);
                send(s1);
                send(s2);
            }
            stk::WRITE_PAGE => {
                self.stay.on_page();
                let bytes = &page[..length];
                if memory == stk::EEPROM {
                    self.write_eeprom(bytes);
                } else if self.takes(page) {
                    flash::write_page(self.at, bytes);
                } else {
                    send(stk::FAILED);
                    return Ok(());
                }
            }
            stk::READ_PAGE => {
                self.stay.on_page();
                self.read_page(length, memory);
            }
            _ => {}
        }
        put(usart0().ucsr0a(), TXC);
        send(stk::OK);
        if command == stk::LEAVE_PROGRAMMING {
            while get(usart0().ucsr0a()) & TXC == 0 {}
            self.leave();
        }
        Ok(())
    }

    /// Reads so many bytes of a command.
    #[inline(never)]
    fn fill(&mut self, page: &mut [u8; PAGE], count: usize) -> Result<(), Broken> {
        for place in page.iter_mut().take(count) {
            *place = self.byte()?;
        }
        Ok(())
    }

    fn tell_parameter(&mut self, which: u8) {
        send(match which {
            stk::parameter::MAJOR => stk::VERSION[0],
            stk::parameter::MINOR => stk::VERSION[1],
            stk::parameter::ROLE => self.role.code(),
            stk::parameter::WHOLE => application::is_whole(self.role).into(),
            _ => stk::parameter::OTHER,
        });
    }

    fn write_eeprom(&self, bytes: &[u8]) {
        let mut address = self.at as u16;
        for byte in bytes {
            // A byte that is there already is not written again.
            if read_eeprom(address) != *byte {
                eeprom::write(address, *byte);
            }
            address = address.wrapping_add(1);
        }
    }

    fn read_page(&mut self, length: usize, memory: u8) {
        let mut at = self.at;
        for _ in 0..length {
            send(if memory == stk::EEPROM {
                read_eeprom(at as u16)
            } else if at < FLASH_END {
                flash::read(at)
            } else {
                0xFF
            });
            at += 1;
        }
    }

    /// Whether a page may be written to the flash.
    fn takes(&mut self, page: &[u8; PAGE]) -> bool {
        if self.at == 0 {
            let bytes = page[Header::AT as usize..].first_chunk();
            self.accepted =
                bytes.is_some_and(|bytes| application::header(self.role, bytes).is_some());
        }
        self.accepted && self.at < BOOT_SECTION && self.at as u8 == 0
    }

    /// The first byte of a command, however long that takes.
    fn first_byte(&mut self) -> u8 {
        loop {
            self.stay.on_byte();
            if let Ok(byte) = self.byte() {
                return byte;
            }
        }
    }

    /// The next byte of a command.
    #[inline(never)]
    fn byte(&mut self) -> Result<u8, Broken> {
        loop {
            self.stay.look();
            if self.stay.is_over() {
                self.leave();
            }
            let status = get(usart0().ucsr0a());
            if status & RXC != 0 {
                self.stay.on_byte();
                let byte = get(usart0().udr0());
                return if status & ERRORS == 0 {
                    Ok(byte)
                } else {
                    Err(Broken)
                };
            }
            if self.stay.is_gap() {
                return Err(Broken);
            }
        }
    }

    /// Starts the application, or stays if there is none.
    #[inline(never)]
    fn leave(&mut self) {
        if application::is_whole(self.role) {
            application::start(self.cause);
        }
        self.stay.for_ever();
    }
}

#[inline(never)]
fn send(byte: u8) {
    while get(usart0().ucsr0a()) & UDRE == 0 {}
    put(usart0().udr0(), byte);
}

/// Reads a byte when the last write has ended.
fn read_eeprom(address: u16) -> u8 {
    while eeprom::is_writing() {}
    eeprom::read(address)
}

/// Takes the reset flags out of MCUSR.
pub(crate) fn take_cause() -> u8 {
    let cause = get(cpu().mcusr());
    put(cpu().mcusr(), 0);
    cause
}
