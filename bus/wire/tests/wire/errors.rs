//! Every error of one, two or three bits in a version-1 packet is refused.
//!
//! The test tries all 88 bits of the packet, those of kind and length too. The window is always
//! eleven bytes and the check value covers all of it, so an error that changes the kind is found
//! too.

use lager_wire::{Callsign, Decoder, Handshake, Packet, Payload, ResetCause, SynAck, Version};

use crate::sample::{packet, payloads};

const BITS: usize = 88;

/// Calls `check` with every packet that differs from `good` in one to three bits.
fn for_each_error(good: [u8; 11], mut check: impl FnMut(&[u8; 11], [usize; 3])) -> usize {
    let mut tried = 0;
    let mut bytes = good;
    let flip = |bytes: &mut [u8; 11], bit: usize| bytes[bit / 8] ^= 1 << (bit % 8);
    // A bit position of BITS stands for "no further error".
    for a in 0..BITS {
        flip(&mut bytes, a);
        for b in (a + 1..BITS).chain([BITS]) {
            if b == BITS {
                check(&bytes, [a, BITS, BITS]);
                tried += 1;
                continue;
            }
            flip(&mut bytes, b);
            for c in (b + 1..BITS).chain([BITS]) {
                if c < BITS {
                    flip(&mut bytes, c);
                }
                check(&bytes, [a, b, c]);
                tried += 1;
                if c < BITS {
                    flip(&mut bytes, c);
                }
            }
            flip(&mut bytes, b);
        }
        flip(&mut bytes, a);
    }
    assert_eq!(bytes, good);
    tried
}

#[test]
fn every_error_of_up_to_three_bits_is_refused_in_every_kind_of_packet() {
    for (number, payload) in (0_u8..).zip(payloads()) {
        // Handshakes carry id 0. The others are tried with many ids.
        let id = match payload {
            Payload::Handshake(_) => 0,
            _ => number.wrapping_mul(7),
        };
        let sent = packet(id, payload);
        let tried = for_each_error(sent.encode(Version::One), |bytes, bits| {
            assert!(
                Packet::decode(bytes, Version::One).is_err(),
                "{sent:?} with bits {bits:?} flipped passes as {bytes:02x?}"
            );
        });
        // 88 single, 3828 double and 109736 triple errors.
        assert_eq!(tried, 113_652);
    }
}

#[test]
fn the_decoder_gives_nothing_for_a_damaged_packet_alone() {
    let syn = Payload::Handshake(Handshake {
        kind: SynAck::Syn,
        sign: Callsign::Sensor,
        version: Version::One,
        reset: ResetCause::PowerOn,
        was_up: false,
        build: 1,
    });
    let steer = payloads()
        .into_iter()
        .find(|payload| matches!(payload, Payload::SteerCommand(_)))
        .unwrap();
    for payload in [syn, steer] {
        let good = packet(0, payload).encode(Version::One);
        for_each_error(good, |bytes, bits| {
            let mut decoder = Decoder::new(Version::One);
            let mut packets = bytes.iter().filter_map(|byte| decoder.push(*byte));
            assert_eq!(packets.next(), None, "{bits:?}");
        });
    }
}

/// After a damaged packet the window moves over its rest and into the next packets, and a window
/// that begins in the middle may fit by chance. The decoder must return exactly the packets that
/// were sent.
#[test]
fn a_damaged_packet_between_good_ones_costs_only_itself() {
    for payload in payloads() {
        let before = packet(4, payload);
        let damaged = packet(5, payload).encode(Version::One);
        let after = [packet(6, payload), packet(7, payload)];
        for_each_error(damaged, |bytes, bits| {
            if bits[2] != BITS {
                return;
            }
            let mut decoder = Decoder::new(Version::One);
            let stream = [
                before.encode(Version::One),
                *bytes,
                after[0].encode(Version::One),
                after[1].encode(Version::One),
            ];
            let mut received = stream
                .iter()
                .flatten()
                .filter_map(|byte| decoder.push(*byte));
            assert_eq!(received.next(), Some(before), "{payload:?} {bits:?}");
            assert_eq!(received.next(), Some(after[0]), "{payload:?} {bits:?}");
            assert_eq!(received.next(), Some(after[1]), "{payload:?} {bits:?}");
            assert_eq!(received.next(), None, "{payload:?} {bits:?}");
        });
    }
}

#[test]
fn bytes_without_a_meaning_must_be_zero() {
    // Gives the bytes a right check value, so that only the rule about the content is left.
    let refit = |mut bytes: [u8; 11]| {
        let fits = |end: &u8| {
            let mut with_end = bytes;
            with_end[10] = *end;
            !matches!(
                Packet::decode(&with_end, Version::One),
                Err(lager_wire::DecodeError::Crc { .. })
            )
        };
        bytes[10] = (0..=u8::MAX).find(fits).unwrap();
        bytes
    };
    let mut tried = 0;
    for payload in payloads() {
        let first_unused = match payload {
            Payload::Handshake(_) => 6,
            Payload::Line(_) | Payload::Distance(_) => 1,
            Payload::RawLine(_) | Payload::Reset(_) => 2,
            Payload::SteerCommand(_) => 4,
            Payload::Setting(_) => 6,
            Payload::SettingReply(_) | Payload::LineReading(_) => 5,
            Payload::SteerData(_) | Payload::ArmData(_) | Payload::BoardStatus(_) => 8,
        };
        for index in first_unused..8 {
            let mut bytes = packet(0, payload).encode(Version::One);
            bytes[2 + index] = 0x10;
            assert!(
                Packet::decode(&refit(bytes), Version::One).is_err(),
                "{payload:?} with payload byte {index} set"
            );
            tried += 1;
        }
    }
    assert!(tried > 100);
}
