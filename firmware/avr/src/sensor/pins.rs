//! The sensor board's pins as its program moves them. `lager-pins` has their table, and no other file
//! of this program knows a pin (O7, P8).

use lager_avr::register::{clear, get, port_a, port_b, port_c, port_d, put, set};
use lager_pins::sensor::{ADDRESS, EXDE_DATA, EXDE_SYNC, LINE, RANGER, TABLE};
use lager_pins::{Port, Start};

/// ADC input of the line multiplexer.
pub(crate) const LINE_INPUT: u8 = LINE.bit;
/// ADC input of the IR ranger.
pub(crate) const IR_INPUT: u8 = RANGER.bit;

/// The address pins are the lowest bits of their port, in order, so an address is written as it is.
const ADDRESS_MASK: u8 = {
    let mut mask = 0;
    let mut bit = 0;
    while bit < ADDRESS.len() {
        assert!(ADDRESS[bit].bit as usize == bit && matches!(ADDRESS[bit].port, Port::B));
        mask |= ADDRESS[bit].mask();
        bit += 1;
    }
    mask
};
const DATA: u8 = EXDE_DATA.mask();
const SYNC: u8 = EXDE_SYNC.mask();
const _: () = assert!(matches!((LINE.port, RANGER.port), (Port::A, Port::A)));
const _: () = assert!(matches!(
    (EXDE_DATA.port, EXDE_SYNC.port),
    (Port::D, Port::D)
));

const A: Start = Start::of(&TABLE, Port::A);
const B: Start = Start::of(&TABLE, Port::B);
const C: Start = Start::of(&TABLE, Port::C);
const D: Start = Start::of(&TABLE, Port::D);

/// Sets every pin's direction; ExDe is low and the multiplexer on.
pub(crate) fn set_up() {
    // From reset on every pin is an input.
    const { assert!(A.direction == 0 && C.direction == 0) };
    put(port_a().porta(), A.port);
    put(port_b().portb(), B.port);
    put(port_b().ddrb(), B.direction);
    put(port_c().portc(), C.port);
    put(port_d().portd(), D.port);
    put(port_d().ddrd(), D.direction);
}

/// Connects a line sensor to the ADC; wait until it has settled before reading it.
#[inline(always)]
pub(crate) fn select_line_sensor(channel: u8) {
    let port = port_b();
    put(port.portb(), get(port.portb()) & !ADDRESS_MASK | channel);
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
