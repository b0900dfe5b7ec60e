//! The sensor board's pin table. No other file knows a pin of this board (O7, P8).
//!
//! ```text
//!   port   pin  name   way  use
//!   A      0    ADC0   in   common output of the line multiplexer, 0..5 V, 5 V = darkest
//!          1    ADC1   in   IR ranger
//!   B      0-3         out  address of the line multiplexer, bit 0 first; 0 (leftmost) to 10
//!          4           out  enable of the line multiplexer, low = on
//!          5-7              ISP: MOSI, MISO, SCK
//!   C      2-5              JTAG: TCK, TMS, TDO, TDI
//!   D      0    RXD0   in   UART from the Pi
//!          1    TXD0   out  UART to the Pi
//!          2    INT0   in   ExDe return sync
//!          4           out  ExDe sync
//!          5           out  ExDe data
//! ```
//!
//! Every pin that is not listed is an input with pull-up.

use lager_avr::register::{bit, clear, get, port_a, port_b, port_c, port_d, put, set};

/// ADC input of the line multiplexer.
pub(crate) const LINE_INPUT: u8 = 0;
/// ADC input of the IR ranger.
pub(crate) const IR_INPUT: u8 = 1;

const ADDRESS: u8 = 0b0000_1111;
const ENABLE: u8 = bit(4);
const ISP: u8 = 0b1110_0000;
const JTAG: u8 = 0b0011_1100;
const RETURN: u8 = bit(2);
const SYNC: u8 = bit(4);
const DATA: u8 = bit(5);

/// Sets every pin's direction; ExDe is low and the multiplexer on.
pub(crate) fn set_up() {
    put(port_a().porta(), !(bit(LINE_INPUT) | bit(IR_INPUT)));
    put(port_b().portb(), !(ADDRESS | ENABLE | ISP));
    put(port_b().ddrb(), ADDRESS | ENABLE);
    put(port_c().portc(), !JTAG);
    put(port_d().portd(), !(SYNC | DATA | RETURN));
    put(port_d().ddrd(), SYNC | DATA);
}

/// Connects a line sensor to the ADC; wait until it has settled before reading it.
#[inline(always)]
pub(crate) fn select_line_sensor(channel: u8) {
    let port = port_b();
    put(port.portb(), get(port.portb()) & !ADDRESS | channel);
}

/// Sets the level on ExDe's data wire.
#[inline(always)]
pub(crate) fn set_exde_data(level: bool) {
    let port = port_d();
    if level {
        set(port.portd(), DATA);
    } else {
        clear(port.portd(), DATA);
    }
}

/// Sets the level on ExDe's sync wire.
#[inline(always)]
pub(crate) fn set_exde_sync(level: bool) {
    let port = port_d();
    if level {
        set(port.portd(), SYNC);
    } else {
        clear(port.portd(), SYNC);
    }
}
