//! The steering board's pin table. No other file knows a pin of this board (O7, P9).
//!
//! ```text
//!   port   pin  name   way     use
//!   A      0    ADC0   in      a quarter of the battery's voltage (30 k over 10 k)
//!   B      0           in      ExDe data
//!          1           out     ExDe return sync
//!          2    INT2   in      ExDe sync
//!          5-7                 ISP: MOSI, MISO, SCK
//!   C      0           out     DIR of the left driver, low = forwards
//!          1           out     DIR of the right driver, high = forwards: mirrored (W2)
//!          2-5                 JTAG: TCK, TMS, TDO, TDI
//!   D      0    RXD0   in      UART from the Pi
//!          1    TXD0   out     UART to the Pi
//!          2    RXD1   in      servos' wire, joined with TXD1, external pull-up (P10)
//!          3    TXD1   in/out  servos' wire; drives it only while the board sends
//!          6    OC2B   out     PWM of the right driver
//!          7    OC2A   out     PWM of the left driver
//! ```
//!
//! Every pin that is not listed is an input with pull-up.

use lager_avr::register::{bit, clear, get, port_a, port_b, port_c, port_d, put, set};

/// ADC input of the battery.
pub(crate) const BATTERY_INPUT: u8 = 0;

const EXDE_DATA: u8 = bit(0);
const EXDE_RETURN: u8 = bit(1);
const EXDE_SYNC: u8 = bit(2);
const ISP: u8 = 0b1110_0000;
const LEFT_DIR: u8 = bit(0);
const RIGHT_DIR: u8 = bit(1);
const JTAG: u8 = 0b0011_1100;
const SERVOS: u8 = bit(2) | bit(3);
const RIGHT_PWM: u8 = bit(6);
const LEFT_PWM: u8 = bit(7);

/// Sets every pin's direction; the motors' pins are low.
pub(crate) fn set_up() {
    put(port_d().portd(), !(LEFT_PWM | RIGHT_PWM | SERVOS));
    put(port_d().ddrd(), LEFT_PWM | RIGHT_PWM);
    put(port_a().porta(), !bit(BATTERY_INPUT));
    put(
        port_b().portb(),
        !(EXDE_DATA | EXDE_RETURN | EXDE_SYNC | ISP),
    );
    put(port_b().ddrb(), EXDE_RETURN);
    put(port_c().portc(), !(LEFT_DIR | RIGHT_DIR | JTAG));
    put(port_c().ddrc(), LEFT_DIR | RIGHT_DIR);
}

/// Sets the drivers' DIR pins.
#[inline(always)]
pub(crate) fn set_directions(left_reverse: bool, right_reverse: bool) {
    let port = port_c();
    if left_reverse {
        set(port.portc(), LEFT_DIR)
    } else {
        clear(port.portc(), LEFT_DIR)
    }
    if right_reverse {
        clear(port.portc(), RIGHT_DIR)
    } else {
        set(port.portc(), RIGHT_DIR)
    }
}

/// The level on ExDe's data wire.
#[inline(always)]
pub(crate) fn exde_data() -> bool {
    get(port_b().pinb()) & EXDE_DATA != 0
}

/// Sets ExDe's return sync wire.
#[inline(always)]
pub(crate) fn set_exde_return(high: bool) {
    let port = port_b();
    if high {
        set(port.portb(), EXDE_RETURN)
    } else {
        clear(port.portb(), EXDE_RETURN)
    }
}
