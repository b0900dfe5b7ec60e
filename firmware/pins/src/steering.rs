//! The steering board's pins (P9).

use crate::both;
use crate::pin::{Connection, Connector, Device, Pin, Port, Way};

/// A quarter of the battery's voltage, an analogue input.
pub const BATTERY: Pin = Pin::new(Port::A, 0);
/// ExDe data.
pub const EXDE_DATA: Pin = Pin::new(Port::B, 0);
/// ExDe return sync.
pub const EXDE_RETURN: Pin = Pin::new(Port::B, 1);
/// ExDe sync.
pub const EXDE_SYNC: Pin = Pin::new(Port::B, 2);
/// DIR of the left driver, low = forwards.
pub const LEFT_DIR: Pin = Pin::new(Port::C, 0);
/// DIR of the right driver, high = forwards, because the drivers are mirrored (W2).
pub const RIGHT_DIR: Pin = Pin::new(Port::C, 1);
/// PWM of the left driver.
pub const LEFT_PWM: Pin = Pin::new(Port::D, 7);
/// PWM of the right driver.
pub const RIGHT_PWM: Pin = Pin::new(Port::D, 6);

const LEFT_DRIVER: Device = Device {
    name: "Left motor driver",
    note: "10 kΩ from PWM to ground",
    connector: Connector::Port(1),
};
const RIGHT_DRIVER: Device = Device {
    name: "Right motor driver",
    note: "10 kΩ from PWM to ground",
    connector: Connector::Port(1),
};
const DIVIDER: Device = Device {
    name: "Battery divider",
    note: "30 kΩ and 10 kΩ",
    connector: Connector::Port(1),
};
/// The servos' bus (P10, A1).
pub const SERVOS: Device = Device {
    name: "Arm: AX-12 servos",
    note: "one wire, 10 kΩ to 5 V",
    connector: Connector::Port(4),
};
/// The other board.
pub const SENSOR: Device = Device {
    name: "Sensor board",
    note: "ExDe, and ground",
    connector: Connector::Port(3),
};

/// Every connected pin of this board.
pub const TABLE: [Connection; 19] = [
    Connection::new(LEFT_DIR, None, Way::Out, "DIR, low = forwards", LEFT_DRIVER),
    Connection::new(LEFT_PWM, Some("OC2A"), Way::Out, "PWM", LEFT_DRIVER),
    Connection::new(
        RIGHT_DIR,
        None,
        Way::Out,
        "DIR, high = forwards",
        RIGHT_DRIVER,
    ),
    Connection::new(RIGHT_PWM, Some("OC2B"), Way::Out, "PWM", RIGHT_DRIVER),
    Connection::new(
        BATTERY,
        Some("ADC0"),
        Way::In,
        "voltage, a quarter",
        DIVIDER,
    ),
    Connection::new(
        Pin::new(Port::D, 2),
        Some("RXD1"),
        Way::In,
        "servos' wire",
        SERVOS,
    ),
    Connection::new(
        Pin::new(Port::D, 3),
        Some("TXD1"),
        Way::InAndOut,
        "servos' wire",
        SERVOS,
    ),
    both::TCK,
    both::TMS,
    both::TDO,
    both::TDI,
    both::MOSI,
    both::MISO,
    both::SCK,
    both::RXD0,
    both::TXD0,
    Connection::new(EXDE_DATA, None, Way::In, "ExDe data", SENSOR),
    Connection::new(EXDE_SYNC, Some("INT2"), Way::In, "ExDe sync", SENSOR),
    Connection::new(EXDE_RETURN, None, Way::Out, "ExDe return sync", SENSOR),
];
