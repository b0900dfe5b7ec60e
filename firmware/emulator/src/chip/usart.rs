//! One USART of the ATmega1284P as the datasheet describes it, as a machine without a clock.
//!
//! simavr's own USART counts eleven bits a byte for every frame, shows a byte when it is written
//! and not when it has left, hides overruns in a queue of 64 bytes, and starts with the transmitter
//! on. So this machine has its registers; only the interrupt vectors stay simavr's.
//!
//! ```text
//!  UDR --> buffer --> shift register --> TXD        one byte waits while one is sent
//!  RXD --> shift register --> buffer, 2 bytes --> UDR
//!              '-- a third byte stays here until the next start bit destroys it: DOR
//! ```
//! Times are in cycles of the chip. The machine knows no register addresses and no interrupts.

use std::collections::VecDeque;

/// Bits of UCSRnA.
pub(crate) mod status {
    pub(crate) const RXC: u8 = 0x80;
    pub(crate) const TXC: u8 = 0x40;
    pub(crate) const UDRE: u8 = 0x20;
    pub(crate) const FE: u8 = 0x10;
    pub(crate) const DOR: u8 = 0x08;
    pub(crate) const U2X: u8 = 0x02;
    pub(crate) const MPCM: u8 = 0x01;
}

/// Bits of UCSRnB.
pub(crate) mod control {
    pub(crate) const RXCIE: u8 = 0x80;
    pub(crate) const TXCIE: u8 = 0x40;
    pub(crate) const UDRIE: u8 = 0x20;
    pub(crate) const RXEN: u8 = 0x10;
    pub(crate) const TXEN: u8 = 0x08;
    pub(crate) const UCSZ2: u8 = 0x04;
}

/// How many bytes the receive buffer holds, beside the shift register.
const BUFFER: usize = 2;

/// A frame's shape and speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Format {
    /// Cycles of one bit.
    pub(crate) bit: u64,
    data_bits: u64,
    parity_bits: u64,
    stop_bits: u64,
}

impl Format {
    /// The format in the registers UCSRnA, B, C and UBRRn.
    pub(crate) fn of_registers(ucsra: u8, ucsrb: u8, ucsrc: u8, ubrr: u16) -> Self {
        let per_tick = if ucsra & status::U2X == 0 { 16 } else { 8 };
        let nine = ucsrb & control::UCSZ2 != 0;
        Self {
            bit: per_tick * (u64::from(ubrr & 0x0FFF) + 1),
            data_bits: if nine {
                9
            } else {
                5 + u64::from(ucsrc >> 1 & 3)
            },
            parity_bits: u64::from(ucsrc & 0x20 != 0),
            stop_bits: 1 + u64::from(ucsrc & 0x08 != 0),
        }
    }

    /// Cycles from the start bit's edge to the last stop bit's end.
    pub(crate) fn frame(&self) -> u64 {
        (1 + self.data_bits + self.parity_bits + self.stop_bits) * self.bit
    }

    /// Cycles from the start bit's edge until the receiver has judged the first stop bit, by the
    /// last of the three samples in its middle.
    pub(crate) fn reception(&self) -> u64 {
        (1 + self.data_bits + self.parity_bits) * self.bit + self.bit * 10 / 16
    }
}

/// How a receiver of 8N1 with `bit` cycles a bit reads a byte sent with `sent_bit`: the value, and
/// whether the stop bit was missing.
pub(crate) fn sampled(byte: u8, sent_bit: f64, bit: f64) -> (u8, bool) {
    let level = |position: u32| {
        let at = (f64::from(position) + 0.5) * bit / sent_bit;
        match at as u64 {
            0 => false,
            place @ 1..=8 => byte >> (place - 1) & 1 == 1,
            _ => true,
        }
    };
    let value = (0..8).fold(0, |value, bit| value | u8::from(level(bit + 1)) << bit);
    (value, !level(9))
}

/// A received byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Received {
    byte: u8,
    framing_error: bool,
    overrun: bool,
}

/// The USART's state.
#[derive(Clone, Debug, Default)]
pub(crate) struct Usart {
    sending: Option<u8>,
    waiting: Option<u8>,
    receiving: Option<Received>,
    held: Option<Received>,
    buffer: VecDeque<Received>,
    overrun: bool,
    overruns: u64,
}

impl Usart {
    /// The program writes UDR with the transmitter on. Returns whether a frame starts now.
    pub(crate) fn write(&mut self, byte: u8) -> bool {
        if self.sending.is_none() {
            self.sending = Some(byte);
            return true;
        }
        // With UDRE clear the chip ignores the write.
        self.waiting.get_or_insert(byte);
        false
    }

    /// A frame has left. Returns its byte, and the byte whose frame starts now.
    pub(crate) fn sent(&mut self) -> (Option<u8>, Option<u8>) {
        let byte = self.sending.take();
        self.sending = self.waiting.take();
        (byte, self.sending)
    }

    /// A frame begins on RXD.
    pub(crate) fn start_bit(&mut self, byte: u8, framing_error: bool) {
        if self.held.take().is_some() {
            self.overrun = true;
            self.overruns += 1;
        }
        self.receiving = Some(Received {
            byte,
            framing_error,
            overrun: core::mem::take(&mut self.overrun),
        });
    }

    /// The frame on RXD is complete.
    pub(crate) fn received(&mut self) {
        self.held = self.receiving.take();
        self.fill();
    }

    /// The program reads UDR.
    pub(crate) fn read(&mut self) -> u8 {
        let byte = self.buffer.pop_front().map_or(0, |received| received.byte);
        self.fill();
        byte
    }

    /// The receiver is switched off: the frame under way and the buffer are lost.
    pub(crate) fn stop_receiver(&mut self) {
        self.receiving = None;
        self.held = None;
        self.buffer.clear();
        self.overrun = false;
    }

    /// The chip is reset.
    pub(crate) fn reset(&mut self) {
        *self = Self {
            overruns: self.overruns,
            ..Self::default()
        };
    }

    /// RXC, UDRE, FE and DOR as in UCSRnA. TXC is not here: its interrupt handling keeps it.
    pub(crate) fn status(&self) -> u8 {
        let mut bits = 0;
        if self.waiting.is_none() {
            bits |= status::UDRE;
        }
        if let Some(oldest) = self.buffer.front() {
            bits |= status::RXC;
            if oldest.framing_error {
                bits |= status::FE;
            }
            if oldest.overrun {
                bits |= status::DOR;
            }
        }
        bits
    }

    /// Whether a frame is under way on TXD.
    pub(crate) fn is_sending(&self) -> bool {
        self.sending.is_some()
    }

    /// Bytes lost since power came on, because the program did not read them in time.
    pub(crate) fn overruns(&self) -> u64 {
        self.overruns
    }

    fn fill(&mut self) {
        if self.buffer.len() < BUFFER
            && let Some(received) = self.held.take()
        {
            self.buffer.push_back(received);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 8N1 at 500 000 Bd: U2X off, UBRR 1.
    fn eight_n_one() -> Format {
        Format::of_registers(0, 0, 0x06, 1)
    }

    fn receive(usart: &mut Usart, byte: u8) {
        usart.start_bit(byte, false);
        usart.received();
    }

    #[test]
    fn a_frame_is_as_long_as_its_bits() {
        assert_eq!(eight_n_one().frame(), 320, "10 bits of 32 cycles");
        // 1 Mbit/s with U2X, as on the servos' wire.
        assert_eq!(Format::of_registers(status::U2X, 0, 0x06, 1).frame(), 160);
        // 8E2: parity and a second stop bit.
        assert_eq!(Format::of_registers(0, 0, 0x2E, 1).frame(), 12 * 32);
        assert_eq!(Format::of_registers(0, 0, 0x06, 103).frame(), 16_640);
        // Nine bits, and the stop bit up to the last sample in its middle.
        assert_eq!(eight_n_one().reception(), 9 * 32 + 20);
    }

    #[test]
    fn one_byte_waits_while_one_is_sent_and_a_third_is_ignored() {
        let mut usart = Usart::default();
        assert!(usart.write(1));
        assert_eq!(usart.status(), status::UDRE);
        assert!(!usart.write(2));
        assert_eq!(usart.status(), 0);
        assert!(!usart.write(3));
        assert_eq!(usart.sent(), (Some(1), Some(2)));
        assert_eq!(usart.sent(), (Some(2), None));
        assert!(!usart.is_sending());
    }

    #[test]
    fn three_bytes_wait_for_the_program_and_the_fourth_destroys_the_third() {
        let mut usart = Usart::default();
        for byte in 1..=3 {
            receive(&mut usart, byte);
        }
        assert_eq!(usart.overruns(), 0);
        receive(&mut usart, 4);
        assert_eq!(usart.overruns(), 1);
        assert_eq!(usart.status() & status::DOR, 0, "the oldest is sound");
        assert_eq!(usart.read(), 1);
        assert_eq!(usart.read(), 2);
        assert_eq!(usart.status(), status::RXC | status::UDRE | status::DOR);
        assert_eq!(usart.read(), 4);
        assert_eq!(usart.status(), status::UDRE);
    }

    #[test]
    fn a_receiver_switched_off_forgets() {
        let mut usart = Usart::default();
        receive(&mut usart, 1);
        usart.start_bit(2, false);
        usart.stop_receiver();
        usart.received();
        assert_eq!(usart.status(), status::UDRE);
    }

    #[test]
    fn a_byte_of_the_wrong_speed_is_another_byte() {
        for byte in 0..=255 {
            assert_eq!(sampled(byte, 32.0, 32.0), (byte, false));
            // 8N1 tolerates 2 %.
            assert_eq!(sampled(byte, 32.64, 32.0), (byte, false));
        }
        // A sender at 9600 Bd still sends its start bit when this receiver expects the stop bit.
        assert_eq!(sampled(0xA5, 1_666.7, 32.0), (0, true));
    }
}
