//! How long a board stays in its loader, and in which state the application starts.

use std::time::Duration;

use lager_emulator::chip::{Chip, Image as ChipImage, ResetLine};
use lager_loader::{Client, Line, entry};
use lager_wire::{Callsign, Packet, PacketId, Payload, SteerCommand, Version};

use crate::support::{Bench, cycles, starts};

const ROLE: Callsign = Callsign::Steering;
/// A chip's start, and the check of a small application.
const START: Duration = Duration::from_millis(70);

/// The time until the application has started once more.
fn until_started(bench: &mut Bench, limit: Duration) -> Duration {
    let (begin, before) = (bench.now(), bench.starts());
    while bench.starts() == before {
        assert!(bench.now() - begin < limit, "it starts within {limit:?}");
        bench.run(Duration::from_millis(1));
    }
    bench.now() - begin
}

/// A board with the little application; the note of its starts is 0.
fn board(test: &str) -> Bench {
    let bench = Bench::new(ROLE, Some(&starts(ROLE, test)));
    bench.chip.set_memory(0x3F00, &[0]);
    bench
}

#[test]
fn it_waits_only_after_power_on_and_after_the_reset_button() {
    let waits = Duration::from_millis(entry::WAITS_MS.into());
    let mut bench = board("waits");
    let took = until_started(&mut bench, Duration::from_secs(3));
    assert!(took > waits && took < waits + 2 * START, "{took:?}");
    for (line, expected) in [
        (ResetLine::External, waits),
        (ResetLine::Power, waits),
        (ResetLine::BrownOut, Duration::ZERO),
    ] {
        bench.chip.reset(line);
        let took = until_started(&mut bench, Duration::from_secs(3));
        assert!(
            took > expected && took < expected + 2 * START,
            "{line:?}: {took:?}"
        );
    }
}

#[test]
fn the_application_finds_every_register_as_after_a_reset_and_the_watchdog_off() {
    let image = starts(ROLE, "registers");
    let alone = ChipImage::from_bytes(image.bytes().to_vec());
    let alone = Chip::new(&alone, 0, 1).expect("simavr knows the chip");
    alone.run_until(cycles(Duration::from_millis(80)));
    let mut bench = board("registers-behind");
    // The loader has received and sent, and waited.
    Client::find(&mut bench, Duration::from_secs(3))
        .unwrap()
        .expect("it answers");
    until_started(&mut bench, Duration::from_secs(3));
    bench.run(Duration::from_millis(1));
    let (expected, found) = (alone.memory(0x3E00, 0xE0), bench.chip.memory(0x3E00, 0xE0));
    for (index, (expected, found)) in expected.into_iter().zip(found).enumerate() {
        let address = index + 0x20;
        match address {
            // GPIOR0 has the flags, which the loader takes out of MCUSR: power-on.
            0x3E => assert_eq!(found, 0x01),
            0x54 => assert_eq!((expected, found), (0x01, 0)),
            _ => assert_eq!(found, expected, "register {address:#04x}"),
        }
    }
}

#[test]
fn a_board_that_was_told_into_its_loader_starts_once_when_nobody_comes() {
    let mut bench = board("nobody");
    until_started(&mut bench, Duration::from_secs(3));
    // As the boards' programs do it.
    bench
        .chip
        .set_memory(entry::MARK_AT, &entry::MARK.to_le_bytes());
    bench.chip.reset(ResetLine::Watchdog);
    let took = until_started(&mut bench, Duration::from_secs(12));
    let waits = Duration::from_millis(entry::WAITS_WHEN_ASKED_MS.into());
    assert!(took > waits && took < waits + 2 * START, "{took:?}");
    bench.run(Duration::from_secs(10));
    assert_eq!(
        (bench.starts(), bench.chip.resets()),
        (2, 1),
        "no further reset"
    );
    // The mark counts once, and only after a watchdog reset.
    bench.chip.reset(ResetLine::Watchdog);
    assert!(until_started(&mut bench, Duration::from_secs(3)) < 2 * START);
    bench
        .chip
        .set_memory(entry::MARK_AT, &entry::MARK.to_le_bytes());
    bench.chip.reset(ResetLine::BrownOut);
    assert!(until_started(&mut bench, Duration::from_secs(3)) < 2 * START);
}

/// A board that starts while these bytes come without a pause starts its application within 3 s, and
/// nothing is written.
fn starts_in_traffic(bench: &mut Bench, mut bytes: impl FnMut() -> u8) {
    let before = bench.chip.flash();
    let (begin, starts) = (bench.now(), bench.starts());
    while bench.starts() == starts {
        assert!(bench.now() - begin < Duration::from_secs(3));
        let burst: Vec<u8> = (0..50).map(|_| bytes()).collect();
        bench.send(&burst).unwrap();
        bench.run(Duration::from_millis(1));
    }
    assert!(bench.chip.flash() == before);
}

#[test]
fn foreign_traffic_does_not_hold_a_board() {
    let mut bench = board("packets");
    let command = SteerCommand { code: 2, seq: 0x30 };
    let packet = Packet {
        id: PacketId::new(0),
        payload: Payload::SteerCommand(command),
    };
    let mut packets = packet.encode(Version::One).into_iter().cycle();
    starts_in_traffic(&mut bench, || packets.next().unwrap());
    // Commands of the protocol without a pause: they lengthen the stay, and it has an end.
    bench.power();
    let mut commands = [0x30, 0x20, 0x50, 0x20, 0x75, 0x20].into_iter().cycle();
    starts_in_traffic(&mut bench, || commands.next().unwrap());
    random_traffic(&mut bench, 1..=5);
}

#[test]
#[ignore = "a minute"]
fn random_traffic_does_not_hold_a_board() {
    random_traffic(&mut board("random"), 1..=100);
}

fn random_traffic(bench: &mut Bench, seeds: core::ops::RangeInclusive<u64>) {
    for seed in seeds {
        bench.power();
        let mut state = seed;
        starts_in_traffic(bench, || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            // Many seeds have whole commands in them by chance; this makes them common.
            match state >> 60 {
                0 => 0x20,
                1 => 0x30,
                _ => (state >> 56) as u8,
            }
        });
    }
}
