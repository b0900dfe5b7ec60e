//! One serial line between a board and the Pi, in both directions, at the baud rate.
//!
//! ```text
//!   Pi --write--> [byte, arrives at t] [..] --> board     every byte takes 10 bits (8N1)
//!   Pi <--read--- [byte, arrives at t] [..] <-- board     queued whole or not at all
//! ```
//! A board gets a byte at the end of the byte's last bit. The Pi's UART passes its bytes on when
//! the line falls idle, so bytes that a board queued in one piece reach the Pi in one piece.
//! Nothing waits for a reader: bytes that the Pi does not read in time are lost, as on a real port
//! that nobody has opened.

use std::collections::VecDeque;

use lager_pty::PI_BUFFER;

/// The number of bytes that the board can queue.
const BOARD_QUEUE: u64 = 64;

/// A serial line.
#[derive(Clone, Debug)]
pub(crate) struct Uart {
    byte_ns: u64,
    to_board: VecDeque<(u64, u8)>,
    to_board_free_ns: u64,
    to_pi: VecDeque<(u64, u8)>,
    to_pi_free_ns: u64,
    /// The pieces that have not wholly arrived; the board queued each at once.
    pieces: VecDeque<Piece>,
    cut: bool,
    dropped: u64,
}

/// The time during which the bits of one piece are on the line.
#[derive(Clone, Copy, Debug)]
struct Piece {
    begin_ns: u64,
    end_ns: u64,
}

impl Uart {
    pub(crate) fn new(baud: u32) -> Self {
        Self {
            byte_ns: 10 * 1_000_000_000 / u64::from(baud),
            to_board: VecDeque::new(),
            to_board_free_ns: 0,
            to_pi: VecDeque::new(),
            to_pi_free_ns: 0,
            pieces: VecDeque::new(),
            cut: false,
            dropped: 0,
        }
    }

    /// Bytes that the Pi sends.
    pub(crate) fn write(&mut self, now: u64, bytes: &[u8]) {
        for &byte in bytes {
            self.to_board_free_ns = self.to_board_free_ns.max(now) + self.byte_ns;
            if self.cut {
                self.dropped += 1;
            } else {
                self.to_board.push_back((self.to_board_free_ns, byte));
            }
        }
    }

    /// The Pi reads what has arrived, except for a piece that is still arriving.
    pub(crate) fn read(&mut self, now: u64, into: &mut Vec<u8>) {
        let until = self
            .next_piece(now)
            .map_or(now, |piece| now.min(piece.begin_ns));
        while let Some(&(at, byte)) = self.to_pi.front()
            && at <= until
        {
            into.push(byte);
            self.to_pi.pop_front();
        }
    }

    /// The board queues bytes, all of them or none.
    pub(crate) fn queue(&mut self, now: u64, bytes: &[u8]) -> bool {
        let waiting = self
            .to_pi_free_ns
            .saturating_sub(now)
            .div_ceil(self.byte_ns);
        if waiting + bytes.len() as u64 > BOARD_QUEUE {
            return false;
        }
        let begin_ns = self.to_pi_free_ns.max(now);
        self.to_pi_free_ns = begin_ns;
        for &byte in bytes {
            self.to_pi_free_ns += self.byte_ns;
            self.deliver(self.to_pi_free_ns, byte);
        }
        let end_ns = self.to_pi_free_ns;
        self.pieces.push_back(Piece { begin_ns, end_ns });
        true
    }

    /// Adds bytes on the way to the Pi that no board sent: noise on the cable.
    pub(crate) fn disturb_pi(&mut self, now: u64, bytes: &[u8]) {
        for &byte in bytes {
            let place = self.to_pi.partition_point(|(at, _)| *at <= now);
            if !self.cut {
                self.to_pi.insert(place, (now, byte));
            }
        }
    }

    /// The oldest byte that has arrived at the board.
    pub(crate) fn receive(&mut self, now: u64) -> Option<u8> {
        let &(at, byte) = self.to_board.front()?;
        (at <= now).then(|| {
            self.to_board.pop_front();
            byte
        })
    }

    /// Whether all queued bytes have left the board.
    pub(crate) fn is_idle(&self, now: u64) -> bool {
        self.to_pi_free_ns <= now
    }

    /// The next time after `now` at which the board notices something: a byte, or the end of its
    /// transmission.
    pub(crate) fn next_event(&self, now: u64) -> u64 {
        let byte = self.to_board.iter().map(|(at, _)| *at).find(|at| *at > now);
        let sent = (self.to_pi_free_ns > now).then_some(self.to_pi_free_ns);
        byte.unwrap_or(u64::MAX).min(sent.unwrap_or(u64::MAX))
    }

    /// The time when the next piece will have wholly arrived at the Pi.
    pub(crate) fn next_end(&mut self, now: u64) -> Option<u64> {
        self.next_piece(now).map(|piece| piece.end_ns)
    }

    /// The next piece that has not wholly arrived at the Pi; removes those that have.
    fn next_piece(&mut self, now: u64) -> Option<Piece> {
        while self.pieces.front().is_some_and(|piece| piece.end_ns <= now) {
            self.pieces.pop_front();
        }
        self.pieces.front().copied()
    }

    /// The board starts again: its queue, and all bytes sent to it until now, are lost.
    pub(crate) fn restart_board(&mut self, now: u64) {
        let byte_ns = self.byte_ns;
        self.to_board.retain(|(at, _)| *at > now);
        // The byte in the shift register is lost with the rest.
        self.to_pi.retain(|(at, _)| *at <= now);
        self.to_pi_free_ns = self.to_pi_free_ns.min(now + byte_ns);
        self.pieces.clear();
    }

    /// Cuts or mends the cable; bytes on their way at a cut are lost.
    pub(crate) fn set_cut(&mut self, cut: bool, now: u64) {
        self.cut = cut;
        if cut {
            self.to_board.retain(|(at, _)| *at <= now);
            self.to_pi.retain(|(at, _)| *at <= now);
        }
    }

    /// The number of bytes lost because a reader, room or the cable was missing.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    fn deliver(&mut self, at: u64, byte: u8) {
        if self.cut || self.to_pi.len() >= PI_BUFFER {
            self.dropped += 1;
        } else {
            self.to_pi.push_back((at, byte));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 500 000 Bd: 20 microseconds a byte.
    const BYTE: u64 = 20_000;

    fn read(uart: &mut Uart, now: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        uart.read(now, &mut bytes);
        bytes
    }

    #[test]
    fn bytes_arrive_one_after_the_other() {
        let mut uart = Uart::new(500_000);
        uart.write(1_000, &[1, 2]);
        assert_eq!(uart.next_event(1_000), 1_000 + BYTE);
        assert_eq!(uart.receive(1_000 + BYTE - 1), None);
        assert_eq!(uart.receive(1_000 + BYTE), Some(1));
        assert_eq!(uart.receive(1_000 + BYTE), None);
        assert_eq!(uart.receive(1_000 + 2 * BYTE), Some(2));
    }

    #[test]
    fn the_pi_gets_a_piece_when_all_of_it_has_arrived() {
        let mut uart = Uart::new(500_000);
        assert!(uart.queue(0, &[7, 8, 9]));
        assert!(uart.queue(0, &[1, 2]));
        assert!(!uart.is_idle(5 * BYTE - 1) && uart.is_idle(5 * BYTE));
        assert!(read(&mut uart, 3 * BYTE - 1).is_empty());
        assert_eq!(read(&mut uart, 5 * BYTE - 1), [7, 8, 9]);
        assert_eq!(read(&mut uart, 5 * BYTE), [1, 2]);
        assert!(uart.pieces.is_empty(), "a robot may stand for days");
    }

    #[test]
    fn the_original_baud_rate_takes_eleven_milliseconds_a_packet() {
        let mut uart = Uart::new(9_600);
        assert!(uart.queue(0, &[0; 11]));
        assert!(!uart.is_idle(11_400_000) && uart.is_idle(11_460_000));
    }

    #[test]
    fn a_full_queue_takes_all_or_nothing() {
        let mut uart = Uart::new(500_000);
        for _ in 0..5 {
            assert!(uart.queue(0, &[1; 11]));
        }
        assert!(!uart.queue(0, &[1; 11]));
        assert!(uart.queue(2 * BYTE, &[1; 11]), "two bytes have left");
        assert_eq!(read(&mut uart, u64::MAX).len(), 66);
    }

    #[test]
    fn what_nobody_fetches_is_lost_and_nothing_waits() {
        let mut uart = Uart::new(500_000);
        let mut now = 0;
        for _ in 0..1_000 {
            assert!(uart.queue(now, &[1; 11]));
            now += 11 * BYTE;
        }
        assert_eq!(read(&mut uart, now).len(), PI_BUFFER);
        assert_eq!(uart.dropped(), 11_000 - PI_BUFFER as u64);
    }

    #[test]
    fn a_cut_cable_carries_nothing() {
        let mut uart = Uart::new(500_000);
        uart.write(0, &[1, 2]);
        uart.set_cut(true, BYTE);
        uart.write(BYTE, &[3]);
        assert!(uart.queue(BYTE, &[4]));
        assert_eq!(uart.receive(u64::MAX), Some(1));
        assert_eq!(uart.receive(u64::MAX), None);
        assert!(read(&mut uart, u64::MAX).is_empty());
        uart.set_cut(false, 10 * BYTE);
        assert!(uart.queue(10 * BYTE, &[5]));
        assert_eq!(read(&mut uart, u64::MAX), [5]);
    }
}
