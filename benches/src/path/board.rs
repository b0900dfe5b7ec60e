//! A board as the path needs it: one end of a cable, one end of a link, and the floor it stands on.
//!
//! Apart from the robot because it knows nothing of who is at the other end. It decides nothing:
//! what is sent and when, the measurement says.

use lager_topics::{MapProduct, Side, WarehouseMap};
use lager_wire::link::BoardLink;
use lager_wire::{Callsign, Payload, ResetCause};

use super::cable::Cable;
use super::pace::now_ns;
use crate::error::BenchError;

/// How long a board waits for the next byte of a packet, in us. The bridge writes packets whole,
/// but a process that is put to sleep may be cut off in one.
const GAP_US: u32 = 50_000;

/// One board: its end of the wire and its end of the link.
pub(super) struct Board {
    pub(super) cable: Cable,
    pub(super) link: BoardLink,
}

impl Board {
    /// A board that has just been switched on.
    pub(super) fn new(sign: Callsign) -> Result<Self, BenchError> {
        Ok(Self {
            cable: Cable::new()?,
            link: BoardLink::new(sign, ResetCause::PowerOn, GAP_US),
        })
    }

    /// Sends a handshake if one is due.
    pub(super) fn shake_hands(&mut self) -> Result<(), BenchError> {
        match self.link.poll(now_us()) {
            Some(syn) => self.cable.write(&syn),
            None => Ok(()),
        }
    }

    /// Sends data, if the link is up.
    pub(super) fn send(&mut self, payload: Payload) -> Result<(), BenchError> {
        match self.link.encode(payload) {
            Some(packet) => self.cable.write(&packet),
            None => Ok(()),
        }
    }

    /// Takes what has come and is not a command.
    pub(super) fn drain(&mut self) -> Result<(), BenchError> {
        let mut buffer = [0; 256];
        loop {
            let count = self.cable.read(&mut buffer)?;
            if count == 0 {
                return Ok(());
            }
            for byte in &buffer[..count] {
                self.link.push(*byte, now_us());
            }
        }
    }
}

/// One square with a product on the edge along which the robot looks: no turn, no crossing.
pub(super) fn map() -> WarehouseMap {
    let mut map = WarehouseMap {
        width: 1,
        height: 1,
        side_length_cm: 50,
        product_count: 1,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: 1,
        side: Side::Down.into(),
        ..MapProduct::default()
    };
    map
}

/// A board's clock: microseconds that wrap.
pub(super) fn now_us() -> u32 {
    (now_ns() / 1_000) as u32
}
