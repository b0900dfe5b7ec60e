//! [`Pin`], [`Connection`]: what a table of pins is made of.

/// A port of the ATmega1284P.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// Port A, the analogue inputs.
    A,
    /// Port B.
    B,
    /// Port C.
    C,
    /// Port D.
    D,
}

impl Port {
    /// All ports.
    pub const ALL: [Self; 4] = [Self::A, Self::B, Self::C, Self::D];

    /// The port's letter.
    pub const fn letter(self) -> char {
        match self {
            Self::A => 'A',
            Self::B => 'B',
            Self::C => 'C',
            Self::D => 'D',
        }
    }
}

/// A pin of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pin {
    /// Its port.
    pub port: Port,
    /// Its bit in the port, 0 to 7. On port A it is also the number of the analogue input.
    pub bit: u8,
}

impl Pin {
    /// The pin `bit` of a port.
    pub const fn new(port: Port, bit: u8) -> Self {
        Self { port, bit }
    }

    /// The pin's bit in its port's registers.
    pub const fn mask(self) -> u8 {
        1 << self.bit
    }

    /// The pin's number on the chip's 40-pin case (data sheet of the ATmega1284P, pin configurations).
    pub const fn on_case(self) -> u8 {
        match self.port {
            Port::A => 40 - self.bit,
            Port::B => 1 + self.bit,
            Port::C => 22 + self.bit,
            Port::D => 14 + self.bit,
        }
    }
}

/// Which way a pin works, seen from the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// An input.
    In,
    /// An input that the chip pulls up.
    InPulledUp,
    /// An output, low from reset on.
    Out,
    /// An output of the UART; pulled up before the UART is on.
    OutOfUart,
    /// An input that drives the wire only while the board sends.
    InAndOut,
    /// Left to a programmer or a debugger.
    Programmer,
}

/// The connector that a wire goes through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connector {
    /// The board's PORT 1 to PORT 4 (P8).
    Port(u8),
    /// The six-pin header of an ISP programmer.
    Isp,
}

/// What is at the other end of a board's wires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Device {
    /// Its name.
    pub name: &'static str,
    /// What somebody who connects it has to know.
    pub note: &'static str,
    /// Where it is plugged in.
    pub connector: Connector,
}

/// A row of a board's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Connection {
    /// The pin.
    pub pin: Pin,
    /// The pin's function by the data sheet, if the board uses one.
    pub function: Option<&'static str>,
    /// Which way it works.
    pub way: Way,
    /// What the wire carries.
    pub wire: &'static str,
    /// Where the wire leads.
    pub to: Device,
}

impl Connection {
    /// A row.
    pub const fn new(
        pin: Pin,
        function: Option<&'static str>,
        way: Way,
        wire: &'static str,
        to: Device,
    ) -> Self {
        Self {
            pin,
            function,
            way,
            wire,
            to,
        }
    }
}

/// What a board writes into a port's registers when it starts. A pin that is in no row is an input
/// with pull-up, so that it does not float.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// PORTx: the pulled-up inputs. Outputs are low.
    pub port: u8,
    /// DDRx: the outputs.
    pub direction: u8,
}

impl Start {
    /// The start of a port, from a board's table.
    pub const fn of(table: &[Connection], port: Port) -> Self {
        let mut start = Self {
            port: 0xFF,
            direction: 0,
        };
        let mut row = 0;
        while row < table.len() {
            let Connection { pin, way, .. } = table[row];
            if pin.port.letter() == port.letter() {
                match way {
                    Way::InPulledUp | Way::OutOfUart => {}
                    Way::In | Way::InAndOut | Way::Programmer => start.port &= !pin.mask(),
                    Way::Out => {
                        start.port &= !pin.mask();
                        start.direction |= pin.mask();
                    }
                }
            }
            row += 1;
        }
        start
    }
}
