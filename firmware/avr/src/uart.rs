//! UART 0, the line to the Pi. Interrupts serve both directions, so that everything else goes on
//! meanwhile (S4).
//!
//! ```text
//!   RXC  --> RECEIVED --> read()          a byte is lost when the queue is full; the check tells
//!   write() --> TO_SEND --> UDRE          all of a packet or nothing
//!   TXC  --> idle                         the last stop bit has left
//! ```

use avr_device::interrupt;

use crate::clock;
use crate::register::{bit, get, put, set, usart0};
use crate::shared::{Ring, SharedByte};

const RXCIE: u8 = bit(7);
const TXCIE: u8 = bit(6);
const UDRIE: u8 = bit(5);
const RXEN: u8 = bit(4);
const TXEN: u8 = bit(3);
const TXC: u8 = bit(6);
const EIGHT_BITS: u8 = 0b0000_0110;

/// 16 MHz / (16 * baud) - 1: exact at 500 000 Bd, 0.16 % fast at 9600.
pub const UBRR: u16 = if cfg!(feature = "baud-9600") { 103 } else { 1 };

/// How many bytes can wait in each direction: five packets.
const CAPACITY: usize = 64;

static RECEIVED: Ring<u8, CAPACITY> = Ring::new(0);
static TO_SEND: Ring<u8, CAPACITY> = Ring::new(0);
/// 1 from the first queued byte to the last stop bit.
static SENDING: SharedByte = SharedByte::new(0);

/// Always on; only the interrupt that asks for bytes is switched.
const ON: u8 = RXCIE | TXCIE | RXEN | TXEN;

/// Starts both directions. Interrupts are still off.
pub fn start() {
    let uart = usart0();
    put(uart.ubrr0(), UBRR);
    put(uart.ucsr0a(), 0);
    put(uart.ucsr0c(), EIGHT_BITS);
    put(uart.ucsr0b(), ON);
}

/// The oldest received byte that nobody has read.
#[inline(never)]
pub fn read() -> Option<u8> {
    RECEIVED.pop()
}

/// Queues all bytes or none; returns whether it did.
#[inline(never)]
pub fn write(bytes: &[u8]) -> bool {
    // The interrupt only takes bytes out, so there stays enough room.
    if bytes.len() > usize::from(TO_SEND.room()) {
        return false;
    }
    SENDING.set(1);
    for byte in bytes {
        TO_SEND.push(*byte);
        // The first byte leaves while the others are queued.
        interrupt::free(|_| set(usart0().ucsr0b(), UDRIE));
    }
    true
}

/// Whether the last stop bit of everything queued has left.
pub fn is_idle() -> bool {
    SENDING.get() == 0
}

/// Private, because only the interrupt vectors may call them.
mod handlers {
    use super::*;

    #[avr_device::interrupt(atmega1284p)]
    fn USART0_RX() {
        RECEIVED.push(get(usart0().udr0()));
        clock::wake();
    }

    #[avr_device::interrupt(atmega1284p)]
    fn USART0_UDRE() {
        let uart = usart0();
        if let Some(byte) = TO_SEND.pop() {
            put(uart.udr0(), byte);
            // A late byte may find TXC set by the byte before; clear it.
            put(uart.ucsr0a(), TXC);
        }
        if TO_SEND.is_empty() {
            put(uart.ucsr0b(), ON);
        }
    }

    #[avr_device::interrupt(atmega1284p)]
    fn USART0_TX() {
        if TO_SEND.is_empty() {
            SENDING.set(0);
            clock::wake();
        }
    }
}
