//! Feeds the decoder with bytes that are not packets.

use lager_ax12::{ErrorBits, Frame, InstructionDecoder, StatusDecoder};

/// A small fixed generator (xorshift32), so that a failing run can be repeated.
struct Noise(u32);

impl Noise {
    fn byte(&mut self) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 11) as u8
    }
}

fn count(decoder: &mut StatusDecoder, bytes: &[u8]) -> usize {
    let mut packets = 0;
    for byte in bytes {
        packets += usize::from(decoder.push(*byte).is_some());
        while decoder.pending().is_some() {
            packets += 1;
        }
    }
    packets
}

#[test]
fn a_wrong_checksum_is_counted_and_the_next_packet_is_read() {
    let good = Frame::status(2, ErrorBits::NONE, &[1, 2, 3]).unwrap();
    let mut bad = good.as_bytes().to_vec();
    bad[6] ^= 0x10;
    let mut decoder = StatusDecoder::new();
    assert_eq!(count(&mut decoder, &bad), 0);
    assert_eq!(decoder.counters().bad_checksums, 1);
    assert_eq!(count(&mut decoder, good.as_bytes()), 1);
}

#[test]
fn every_single_bit_error_is_refused() {
    let good = Frame::status(5, ErrorBits::OVERLOAD, &[0x12, 0x02, 0xFF, 0xFF, 0x01]).unwrap();
    for bit in 16..good.as_bytes().len() * 8 {
        let mut bad = good.as_bytes().to_vec();
        bad[bit / 8] ^= 1 << (bit % 8);
        let mut decoder = StatusDecoder::new();
        assert_eq!(count(&mut decoder, &bad), 0, "bit {bit}");
    }
}

#[test]
fn a_header_with_extra_ff_is_still_found() {
    let good = Frame::status(1, ErrorBits::NONE, &[]).unwrap();
    let mut decoder = StatusDecoder::new();
    let mut bytes = vec![0xFF; 7];
    bytes.extend_from_slice(good.as_bytes());
    assert_eq!(count(&mut decoder, &bytes), 1);
    assert_eq!(decoder.counters().skipped_bytes, 7);
}

#[test]
fn good_packets_swallowed_by_a_false_header_all_come_out() {
    let good = Frame::status(1, ErrorBits::NONE, &[]).unwrap();
    let mut bytes = vec![0xFF, 0xFF, 0x03, 0x12];
    for _ in 0..3 {
        bytes.extend_from_slice(good.as_bytes());
    }
    let mut decoder = StatusDecoder::new();
    assert_eq!(count(&mut decoder, &bytes), 3);
}

#[test]
fn noise_never_panics_and_a_packet_after_a_reset_is_always_read() {
    let mut noise = Noise(0x1234_5678);
    let mut decoder = InstructionDecoder::new();
    let good = Frame::ping(7);
    for _ in 0..20_000 {
        for _ in 0..noise.byte() {
            // FF comes twice as often as by chance, so that headers are common.
            let byte = noise.byte();
            decoder.push(if byte < 0x40 { 0xFF } else { byte });
        }
        decoder.reset();
        let mut found = 0;
        for byte in good.as_bytes() {
            found += usize::from(decoder.push(*byte).is_some());
        }
        assert_eq!(found, 1);
    }
}

#[test]
fn without_a_reset_noise_hides_at_most_what_it_can_announce() {
    let mut noise = Noise(99);
    let good = Frame::status(7, ErrorBits::NONE, &[]).unwrap();
    let mut decoder = StatusDecoder::new();
    for _ in 0..5_000 {
        for _ in 0..noise.byte() % 64 {
            decoder.push(noise.byte());
            while decoder.pending().is_some() {}
        }
        // A false header can claim at most 24 bytes, so the fifth packet of six bytes completes it.
        let stream: Vec<u8> = good
            .as_bytes()
            .iter()
            .copied()
            .cycle()
            .take(5 * 6)
            .collect();
        assert!(count(&mut decoder, &stream) >= 1);
    }
}
