//! Ten megabytes of noise, by the rules of both versions.
//!
//! The decoder has a fixed size and cannot allocate, so it cannot grow. These tests show that it
//! never panics, that little noise passes, and that it finds the next packet at once.

use lager_wire::{Decoder, Packet, PacketId, Payload, SteerCommand, Version};

use crate::sample::{Noise, distance};

const MEGABYTES_10: usize = 10_000_000;

/// Noise that is as similar to packets as possible: mostly bytes that are headers and lengths.
fn hostile(noise: &mut Noise) -> u8 {
    match noise.number() >> 61 {
        0 | 1 => 11,
        2 => 0,
        3 => noise.byte() & 0x0F,
        4 => noise.byte() & 0x5F,
        5 => 0xFF,
        _ => noise.byte(),
    }
}

fn packets_in_noise(version: Version, seed: u64, byte: fn(&mut Noise) -> u8) -> u32 {
    let mut noise = Noise::new(seed);
    let mut decoder = Decoder::new(version);
    let mut passed = 0;
    for _ in 0..MEGABYTES_10 {
        passed += u32::from(decoder.push(byte(&mut noise)).is_some());
    }
    assert_eq!(decoder.counters().packets, passed);
    let skipped = decoder.counters().skipped_bytes;
    assert!(usize::try_from(skipped).unwrap() <= MEGABYTES_10);
    passed
}

#[test]
fn noise_hardly_ever_passes_as_a_version_one_packet() {
    // Expected number: 10 of 16 kinds, 1 of 256 lengths and 1 of 256 check values leave 95 windows
    // in 10 MB; rules on the content leave far less than one.
    assert_eq!(packets_in_noise(Version::One, 1, Noise::byte), 0);
    let like_packets = packets_in_noise(Version::One, 2, hostile);
    println!("version 1: {like_packets} packets in 10 MB of hostile noise");
    assert!(like_packets < 1_000, "{like_packets}");
}

#[test]
fn noise_seldom_passes_as_an_original_packet() {
    // Without a check value there is only structure: a few packets per megabyte pass. A link
    // believes none of them before eight consecutive ids.
    let plain = packets_in_noise(Version::Original, 3, Noise::byte);
    println!("original: {plain} packets in 10 MB of noise");
    assert!(plain < 300, "{plain}");
    // Hostile noise is full of original packets. Here the decoder must only survive it.
    let like_packets = packets_in_noise(Version::Original, 4, hostile);
    println!("original: {like_packets} packets in 10 MB of hostile noise");
}

#[test]
fn the_first_version_one_packet_behind_noise_is_accepted() {
    let mut noise = Noise::new(5);
    let mut decoder = Decoder::new(Version::One);
    for round in 0..20_000 {
        let length = noise.number() % 40;
        for _ in 0..length {
            decoder.push(noise.byte());
        }
        let sent = distance(round as u8, 37);
        let received: Vec<_> = sent
            .encode(Version::One)
            .into_iter()
            .filter_map(|byte| decoder.push(byte))
            .collect();
        assert_eq!(received, [sent], "round {round}");
    }
}

#[test]
fn behind_noise_at_most_one_original_packet_is_missed() {
    let mut noise = Noise::new(6);
    for round in 0..20_000 {
        let mut decoder = Decoder::new(Version::Original);
        for _ in 0..noise.number() % 200 {
            decoder.push(noise.byte());
        }
        let first = noise.byte();
        let sent: Vec<_> = (0..6)
            .map(|n| distance(first.wrapping_add(n), 37))
            .collect();
        let received: Vec<_> = sent
            .iter()
            .flat_map(|packet| packet.encode(Version::Original))
            .filter_map(|byte| decoder.push(byte))
            .collect();
        // All packets that were sent are received, from the second on at least. Packets made from
        // noise may stand before them.
        assert!(
            received.ends_with(&sent[1..]),
            "round {round}: {received:?}"
        );
    }
}

#[test]
fn a_decoder_that_is_in_step_gives_an_original_packet_at_its_last_byte() {
    let mut decoder = Decoder::new(Version::Original);
    for id in 0..40 {
        let bytes = distance(id, 80).encode(Version::Original);
        let (last, rest) = bytes.split_last().unwrap();
        for byte in rest {
            let held = decoder.push(*byte);
            // Only the first packet waits, for the header of the second.
            assert_eq!(held.is_some(), id == 1 && held == Some(distance(0, 80)));
        }
        assert_eq!(decoder.push(*last).is_some(), id > 0);
    }
    assert_eq!(decoder.counters().packets, 40);
    assert_eq!(decoder.counters().skipped_bytes, 0);
}

#[test]
fn a_lost_byte_costs_an_original_board_one_packet() {
    for cut in 0..11 {
        let mut decoder = Decoder::new(Version::Original);
        let mut received = Vec::new();
        for id in 0..20 {
            let bytes = distance(id, 80).encode(Version::Original);
            for (index, byte) in bytes.into_iter().enumerate() {
                if id == 7 && index == cut {
                    continue;
                }
                received.extend(decoder.push(byte));
            }
        }
        let ids: Vec<_> = received.iter().map(|packet| packet.id.get()).collect();
        let missing = (0..16).filter(|id| !ids.contains(id)).count();
        assert!(missing <= 1, "byte {cut} lost: {ids:?}");
        assert_eq!(ids.last(), Some(&(19 % 16)));
    }
}

/// What a stop leaves on the line: the driver drops its queue, perhaps in the middle of a packet,
/// and standby follows, again and again.
///
/// If a cut command lacks only its check value, the standby's first byte may be the right one. Then
/// the command is complete, as it was given, and the next standby ends it.
#[test]
fn a_standby_behind_a_command_cut_in_two_is_taken() {
    for code in 1..=11 {
        for (id, seq) in (0..16).flat_map(|id| (1..=255).map(move |seq| (id, seq))) {
            let packet = |id: u8, code: u8, seq: u8| Packet {
                id: PacketId::new(id),
                payload: Payload::SteerCommand(SteerCommand { code, seq }),
            };
            let cut = packet(id, code, seq).encode(Version::One);
            let next = seq.wrapping_add(1).max(1);
            let (standby, again) = (packet(id + 1, 1, next), packet(id + 2, 1, next));
            let first = standby.encode(Version::One);
            for sent in 0..cut.len() {
                let mut decoder = Decoder::new(Version::One);
                let line = cut[..sent].iter().copied().chain(first);
                let line = line.chain(again.encode(Version::One));
                let taken: Vec<_> = line.filter_map(|byte| decoder.push(byte)).collect();
                let completed = sent + 1 == cut.len() && cut[sent] == first[0];
                let before = match completed {
                    true => packet(id, code, seq),
                    false => standby,
                };
                assert_eq!(taken, [before, again], "{sent} bytes of command {code}");
            }
        }
    }
}
