//! The sensor board's pins (P8).

use crate::both;
use crate::pin::{Connection, Connector, Device, Pin, Port, Way};

/// Common output of the line multiplexer, an analogue input.
pub const LINE: Pin = Pin::new(Port::A, 0);
/// The IR ranger, an analogue input.
pub const RANGER: Pin = Pin::new(Port::A, 1);
/// Address of the line multiplexer, bit 0 first.
pub const ADDRESS: [Pin; 4] = [
    Pin::new(Port::B, 0),
    Pin::new(Port::B, 1),
    Pin::new(Port::B, 2),
    Pin::new(Port::B, 3),
];
/// Enables the line multiplexer, low = on.
pub const ENABLE: Pin = Pin::new(Port::B, 4);
/// ExDe return sync.
pub const EXDE_RETURN: Pin = Pin::new(Port::D, 2);
/// ExDe sync.
pub const EXDE_SYNC: Pin = Pin::new(Port::D, 4);
/// ExDe data.
pub const EXDE_DATA: Pin = Pin::new(Port::D, 5);

const MULTIPLEXER: Device = Device {
    name: "Line sensors",
    note: "11, behind a multiplexer",
    connector: Connector::Port(1),
};
const IR_RANGER: Device = Device {
    name: "IR ranger",
    note: "GP2Y0A21 or GP2Y0A41",
    connector: Connector::Port(4),
};
/// The other board.
pub const STEERING: Device = Device {
    name: "Steering board",
    note: "ExDe, and ground",
    connector: Connector::Port(3),
};

/// Every connected pin of this board.
pub const TABLE: [Connection; 19] = [
    Connection::new(LINE, Some("ADC0"), Way::In, "reading", MULTIPLEXER),
    Connection::new(ADDRESS[0], None, Way::Out, "address bit 0", MULTIPLEXER),
    Connection::new(ADDRESS[1], None, Way::Out, "address bit 1", MULTIPLEXER),
    Connection::new(ADDRESS[2], None, Way::Out, "address bit 2", MULTIPLEXER),
    Connection::new(ADDRESS[3], None, Way::Out, "address bit 3", MULTIPLEXER),
    Connection::new(ENABLE, None, Way::Out, "enable, low = on", MULTIPLEXER),
    Connection::new(RANGER, Some("ADC1"), Way::In, "distance", IR_RANGER),
    both::TCK,
    both::TMS,
    both::TDO,
    both::TDI,
    both::MOSI,
    both::MISO,
    both::SCK,
    both::RXD0,
    both::TXD0,
    Connection::new(EXDE_DATA, None, Way::Out, "ExDe data", STEERING),
    Connection::new(EXDE_SYNC, None, Way::Out, "ExDe sync", STEERING),
    Connection::new(
        EXDE_RETURN,
        Some("INT0"),
        Way::In,
        "ExDe return sync",
        STEERING,
    ),
];
