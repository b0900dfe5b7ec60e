//! The steering board's pins as its program moves them. `lager-pins` has their table, and no other
//! file of this program knows a pin (O7, P9).

use lager_avr::register::{clear, get, port_a, port_b, port_c, port_d, put, set};
use lager_pins::steering::{BATTERY, LEFT_DIR, LEFT_PWM, RIGHT_DIR, RIGHT_PWM, TABLE};
use lager_pins::{Port, Start, steering};

/// ADC input of the battery.
pub(crate) const BATTERY_INPUT: u8 = BATTERY.bit;

const LEFT: u8 = LEFT_DIR.mask();
const RIGHT: u8 = RIGHT_DIR.mask();
const EXDE_DATA: u8 = steering::EXDE_DATA.mask();
const EXDE_RETURN: u8 = steering::EXDE_RETURN.mask();

/// The ports that the functions below use, and the outputs of timer 2, which cannot be moved.
const _: () = {
    assert!(matches!(BATTERY.port, Port::A));
    assert!(matches!(steering::EXDE_DATA.port, Port::B));
    assert!(matches!(steering::EXDE_RETURN.port, Port::B));
    assert!(matches!(
        (LEFT_DIR.port, RIGHT_DIR.port),
        (Port::C, Port::C)
    ));
    assert!(matches!((LEFT_PWM.port, LEFT_PWM.bit), (Port::D, 7)));
    assert!(matches!((RIGHT_PWM.port, RIGHT_PWM.bit), (Port::D, 6)));
};

const A: Start = Start::of(&TABLE, Port::A);
const B: Start = Start::of(&TABLE, Port::B);
const C: Start = Start::of(&TABLE, Port::C);
const D: Start = Start::of(&TABLE, Port::D);

/// Sets every pin's direction; the motors' pins are low.
pub(crate) fn set_up() {
    // From reset on every pin is an input.
    const { assert!(A.direction == 0) };
    put(port_d().portd(), D.port);
    put(port_d().ddrd(), D.direction);
    put(port_a().porta(), A.port);
    put(port_b().portb(), B.port);
    put(port_b().ddrb(), B.direction);
    put(port_c().portc(), C.port);
    put(port_c().ddrc(), C.direction);
}

/// Sets the drivers' DIR pins.
#[inline(always)]
pub(crate) fn set_directions(left_reverse: bool, right_reverse: bool) {
    let port = port_c();
    if left_reverse {
        set(port.portc(), LEFT)
    } else {
        clear(port.portc(), LEFT)
    }
    if right_reverse {
        clear(port.portc(), RIGHT)
    } else {
        set(port.portc(), RIGHT)
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
