//! The decoder's packets depend on the bytes alone, not on how reads split them.

use lager_wire::{Decoder, DecoderCounters, Packet, Version};
use proptest::prelude::*;

use crate::sample::{packet, payloads};

/// The packets of a version-1 stream, read as a whole: at every place the first eleven bytes are a
/// packet, or one byte is noise.
fn read_whole(stream: &[u8]) -> (Vec<Packet>, u32) {
    let (mut packets, mut skipped, mut rest) = (Vec::new(), 0, stream);
    while rest.len() >= 11 {
        match Packet::decode(&rest[..11], Version::One) {
            Ok(packet) => {
                packets.push(packet);
                rest = &rest[11..];
            }
            Err(_) => {
                skipped += 1;
                rest = &rest[1..];
            }
        }
    }
    (packets, skipped)
}

/// Feeds the stream in reads of the given lengths, and looks at the decoder between them as a
/// service does.
fn read_in_parts(
    version: Version,
    stream: &[u8],
    lengths: &[usize],
) -> (Vec<Packet>, DecoderCounters) {
    let mut decoder = Decoder::new(version);
    let (mut packets, mut rest) = (Vec::new(), stream);
    for length in lengths.iter().cycle() {
        if rest.is_empty() {
            break;
        }
        let (part, later) = rest.split_at(rest.len().min(*length));
        packets.extend(part.iter().filter_map(|byte| decoder.push(*byte)));
        decoder = decoder.clone();
        rest = later;
    }
    (packets, *decoder.counters())
}

/// Pieces of a stream: whole packets, cut packets, damaged packets, noise.
fn stream(version: Version) -> impl Strategy<Value = Vec<u8>> {
    let kinds = payloads();
    let good = (0..kinds.len(), 0..16_u8)
        .prop_map(move |(index, id)| packet(id, kinds[index]).encode(version).to_vec());
    let cut = (good.clone(), 0..11_usize).prop_map(|(mut bytes, length)| {
        bytes.truncate(length);
        bytes
    });
    let damaged = (good.clone(), 0..88_usize).prop_map(|(mut bytes, bit)| {
        bytes[bit / 8] ^= 1 << (bit % 8);
        bytes
    });
    let noise = prop::collection::vec(prop_oneof![any::<u8>(), Just(11_u8), 0..0x60_u8], 0..30);
    prop::collection::vec(
        prop_oneof![4 => good, 1 => cut, 1 => damaged, 1 => noise],
        0..20,
    )
    .prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn version_one_byte_by_byte_is_the_same_as_the_stream_as_a_whole(
        stream in stream(Version::One),
        lengths in prop::collection::vec(1..40_usize, 1..10),
    ) {
        let (packets, skipped) = read_whole(&stream);
        let (received, counters) = read_in_parts(Version::One, &stream, &lengths);
        prop_assert_eq!(&received, &packets);
        prop_assert_eq!(counters.packets as usize, packets.len());
        // Bytes that are still buffered were neither returned nor skipped.
        prop_assert!(counters.skipped_bytes >= skipped);
        prop_assert!(counters.skipped_bytes as usize + 11 * packets.len() <= stream.len());
    }

    #[test]
    fn an_original_stream_reads_the_same_in_any_parts(
        stream in stream(Version::Original),
        lengths in prop::collection::vec(1..40_usize, 1..10),
    ) {
        let whole = read_in_parts(Version::Original, &stream, &[stream.len().max(1)]);
        prop_assert_eq!(read_in_parts(Version::Original, &stream, &lengths), whole);
    }

    #[test]
    fn any_bytes_are_a_packet_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..20)) {
        for version in [Version::Original, Version::One] {
            if let Ok(packet) = Packet::decode(&bytes, version) {
                prop_assert!(bytes.len() >= 4 && bytes.len() <= 11);
                let again = packet.encode(version);
                prop_assert_eq!(Packet::decode(&again, version), Ok(packet));
                if version == Version::One {
                    prop_assert_eq!(&again[..], &bytes[..]);
                }
            }
        }
    }
}
