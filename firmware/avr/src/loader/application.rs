//! The application: whether it is whole, and how it starts.

use core::arch::asm;

use lager_avr::register::{cpu, put, timer1, usart0};
use lager_loader::{CRC_TABLE, Header};
use lager_wire::Callsign;

use crate::flash;

/// The flag in UCSR0A that a written 1 clears.
const TXC: u8 = 1 << 6;

/// In the boot section, because a table in RAM would overwrite what the application left there.
#[unsafe(link_section = ".progmem.data")]
static TABLE: [u32; 256] = CRC_TABLE;

/// The header in these bytes, if it is that of an image for this board.
#[inline(never)]
pub(crate) fn header(role: Callsign, bytes: &[u8; Header::LENGTH]) -> Option<Header> {
    Header::read(bytes).filter(|header| header.role == role)
}

/// Whether there is a whole application for this board.
#[inline(never)]
pub(crate) fn is_whole(role: Callsign) -> bool {
    let table = TABLE.as_ptr() as u16;
    let mut bytes = [0; Header::LENGTH];
    let mut at = Header::AT;
    for place in &mut bytes {
        *place = flash::read(at);
        at += 1;
    }
    header(role, &bytes).is_some_and(|header| {
        header.fits(flash::read, |crc, byte| {
            let entry = u16::from(crc as u8 ^ byte) << 2;
            crc >> 8 ^ flash::read_word(table.wrapping_add(entry))
        })
    })
}

/// Starts the application as a reset would, with every register as after one. It finds the reset
/// flags in GPIOR0, because the watchdog can be switched off only while MCUSR is clear.
pub(crate) fn start(cause: u8) -> ! {
    let uart = usart0();
    put(uart.ucsr0b(), 0);
    put(uart.ucsr0a(), TXC);
    put(uart.ubrr0(), 0);
    let timer = timer1();
    put(timer.tccr1b(), 0);
    put(timer.ocr1a(), 0);
    put(timer.tcnt1(), 0);
    put(timer.tifr1(), 0xFF);
    put(cpu().gpior0(), cause);
    // SAFETY: the application is whole, and begins at 0 as after a reset. The stack is not used any more.
    unsafe {
        asm!(
            "out 0x3b, r1",
            "out 0x3f, r1",
            "ldi r24, 0xff",
            "out 0x3d, r24",
            "ldi r24, 0x40",
            "out 0x3e, r24",
            "jmp 0",
            options(noreturn),
        )
    }
}
