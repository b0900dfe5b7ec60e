//! What both boards have in common: the programmers' pins and the line to the Pi.

use crate::pin::{Connection, Connector, Device, Pin, Port, Way};

const JTAG: Device = Device {
    name: "JTAG",
    note: "programmer or debugger",
    connector: Connector::Port(2),
};
const ISP: Device = Device {
    name: "ISP programmer",
    note: "and RESET, pin 9 of the case",
    connector: Connector::Isp,
};
/// One for each board (P6).
pub(crate) const CABLE: Device = Device {
    name: "USB serial cable",
    note: "5 V levels",
    connector: Connector::Port(4),
};

pub(crate) const TCK: Connection = Connection::new(
    Pin::new(Port::C, 2),
    Some("TCK"),
    Way::Programmer,
    "TCK",
    JTAG,
);
pub(crate) const TMS: Connection = Connection::new(
    Pin::new(Port::C, 3),
    Some("TMS"),
    Way::Programmer,
    "TMS",
    JTAG,
);
pub(crate) const TDO: Connection = Connection::new(
    Pin::new(Port::C, 4),
    Some("TDO"),
    Way::Programmer,
    "TDO",
    JTAG,
);
pub(crate) const TDI: Connection = Connection::new(
    Pin::new(Port::C, 5),
    Some("TDI"),
    Way::Programmer,
    "TDI",
    JTAG,
);
pub(crate) const MOSI: Connection = Connection::new(
    Pin::new(Port::B, 5),
    Some("MOSI"),
    Way::Programmer,
    "MOSI",
    ISP,
);
pub(crate) const MISO: Connection = Connection::new(
    Pin::new(Port::B, 6),
    Some("MISO"),
    Way::Programmer,
    "MISO",
    ISP,
);
pub(crate) const SCK: Connection = Connection::new(
    Pin::new(Port::B, 7),
    Some("SCK"),
    Way::Programmer,
    "SCK",
    ISP,
);
pub(crate) const RXD0: Connection = Connection::new(
    Pin::new(Port::D, 0),
    Some("RXD0"),
    Way::InPulledUp,
    "from the Pi",
    CABLE,
);
pub(crate) const TXD0: Connection = Connection::new(
    Pin::new(Port::D, 1),
    Some("TXD0"),
    Way::OutOfUart,
    "to the Pi",
    CABLE,
);
