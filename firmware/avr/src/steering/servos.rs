//! UART 1 on the servos' wire: 1 Mbit/s, half duplex, both pins on one wire (A1, A8, P10, AMB-25,
//! AMB-26).
//!
//! ```text
//!              write()                    TXC: the last stop bit has left
//!   listening --------> sending, deaf ------------------------------------> listening
//! ```
//!
//! While the board listens its transmitter is off, so the pin floats and the servos can drive the
//! wire. While it sends its receiver is off, so it does not hear itself. TXC marks the end and not
//! UDRE, because the data register is empty two bytes too early.

use avr_device::interrupt;
use lager_avr::clock;
use lager_avr::register::{bit, clear, get, put, usart1};
use lager_avr::shared::{Ring, SharedByte};

const RXC: u8 = bit(7);
const RXCIE: u8 = bit(7);
const TXCIE: u8 = bit(6);
const UDRIE: u8 = bit(5);
const RXEN: u8 = bit(4);
const TXEN: u8 = bit(3);
const TXC: u8 = bit(6);
const U2X: u8 = bit(1);
const EIGHT_BITS: u8 = 0b0000_0110;
/// 16 MHz / (8 * (1 + 1)) = 1 MHz.
const UBRR: u16 = 1;

const LISTENING: u8 = RXCIE | RXEN;
const SENDING: u8 = TXCIE | UDRIE | TXEN;

/// Holds the longest instruction packet or the longest answer.
const CAPACITY: usize = 64;

static RECEIVED: Ring<u8, CAPACITY> = Ring::new(0);
static TO_SEND: Ring<u8, CAPACITY> = Ring::new(0);
/// 1 while the board sends an instruction packet.
static BUSY: SharedByte = SharedByte::new(0);

/// Starts to listen. Interrupts are still off.
pub(crate) fn start() {
    let uart = usart1();
    put(uart.ubrr1(), UBRR);
    put(uart.ucsr1a(), U2X);
    put(uart.ucsr1c(), EIGHT_BITS);
    put(uart.ucsr1b(), LISTENING);
}

/// Sends all bytes, or none if others are still being sent.
#[inline(never)]
pub(crate) fn write(bytes: &[u8]) -> bool {
    if BUSY.get() != 0 || bytes.len() > usize::from(TO_SEND.room()) {
        return false;
    }
    BUSY.set(1);
    for byte in bytes {
        TO_SEND.push(*byte);
    }
    interrupt::free(|_| put(usart1().ucsr1b(), SENDING));
    true
}

/// The oldest byte from a servo that nobody has read.
#[inline(never)]
pub(crate) fn read() -> Option<u8> {
    RECEIVED.pop()
}

/// Takes every byte that waits. A byte comes every 160 cycles and three can wait, and this UART's
/// interrupt is the chip's last, so a longer one before it takes them, too.
#[inline(always)]
pub(crate) fn take_in_interrupt() {
    let uart = usart1();
    while get(uart.ucsr1a()) & RXC != 0 {
        RECEIVED.push(get(uart.udr1()));
        clock::wake();
    }
}

#[avr_device::interrupt(atmega1284p)]
fn USART1_RX() {
    take_in_interrupt();
}

#[avr_device::interrupt(atmega1284p)]
fn USART1_UDRE() {
    let uart = usart1();
    match TO_SEND.pop() {
        Some(byte) => {
            put(uart.udr1(), byte);
            put(uart.ucsr1a(), U2X | TXC);
        }
        None => clear(uart.ucsr1b(), UDRIE),
    }
}

#[avr_device::interrupt(atmega1284p)]
fn USART1_TX() {
    let uart = usart1();
    if get(uart.ucsr1b()) & UDRIE == 0 {
        put(uart.ucsr1b(), LISTENING);
        BUSY.set(0);
    }
}
