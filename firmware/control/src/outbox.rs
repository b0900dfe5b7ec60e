//! Holds encoded packets until the UART's queue has room.
//!
//! An encoded packet already has its number. If the board dropped it when the UART is full, the Pi
//! would count it as lost. So it waits here, in order.

use heapless::Deque;
use lager_wire::PACKET_LENGTH;

use crate::Board;

/// The most packets that one pass of a loop makes.
const CAPACITY: usize = 4;

/// Encoded packets that wait for the UART.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outbox {
    packets: Deque<[u8; PACKET_LENGTH], CAPACITY>,
}

impl Outbox {
    pub(crate) const fn new() -> Self {
        Self {
            packets: Deque::new(),
        }
    }

    /// Whether the UART has taken everything.
    pub(crate) fn is_empty(&self) -> bool {
        self.packets.is_empty()
    }

    /// Hands a packet to the UART, or puts it behind the packets that wait already. A caller sends
    /// at most four packets at a time, and only into an empty box.
    pub(crate) fn send(&mut self, board: &mut impl Board, packet: [u8; PACKET_LENGTH]) {
        if self.packets.is_empty() && board.uart_write(&packet) {
            return;
        }
        let stored = self.packets.push_back(packet).is_ok();
        debug_assert!(stored, "a loop made more packets than the outbox holds");
    }

    /// Hands over as many packets as the UART takes.
    pub(crate) fn flush(&mut self, board: &mut impl Board) {
        while let Some(packet) = self.packets.front() {
            if !board.uart_write(packet) {
                return;
            }
            self.packets.pop_front();
        }
    }
}
