//! Original boards: 11-byte packets, an end byte without meaning, garbage in unused payload bytes,
//! ids that go on after SYNs.

use std::time::Duration;

use lager_wire::link::{HostEvent, HostLink, HostTransmitter, Up};
use lager_wire::{
    Callsign, Centimetres, Decoder, Kind, LineState, Packet, Payload, ResetCause, Setting,
    SettingKey, SteerCommand, Version,
};

use crate::line::board;
use crate::sample::{Noise, distance, original};

const SYN_SENSOR: u8 = 0x08;
const SYN_STEERING: u8 = 0x0C;
const GARBAGE: [u8; 7] = [0x5A, 0xFF, 0x0B, 0x21, 0x00, 0x0B, 0x99];

struct Pi {
    host: HostLink,
    now: Duration,
}

impl Pi {
    fn new() -> Self {
        Self {
            host: HostLink::new(),
            now: Duration::from_secs(5),
        }
    }

    /// Takes the bytes, then lets time pass.
    fn take(&mut self, bytes: &[u8], milliseconds: u64) -> Vec<HostEvent> {
        let events = bytes
            .iter()
            .filter_map(|byte| self.host.push(*byte, self.now))
            .collect();
        self.now += Duration::from_millis(milliseconds);
        events
    }

    /// Sends SYNs from `id` on until one is answered; returns how many it sent.
    fn syns_until_up(&mut self, first: u8, mut garbage: impl FnMut(u8) -> [u8; 7]) -> (u8, Up) {
        for count in 0..20 {
            let syn = original(count, 0, first, garbage(count), 0xFF);
            let events = self.take(&syn, 100);
            if let [HostEvent::SendAck { up: Some(up) }] = events[..] {
                return (count + 1, up);
            }
            assert_eq!(events, []);
        }
        panic!("never came up");
    }
}

fn line_packet(id: u8, state: LineState) -> [u8; 11] {
    original(id, Kind::LineData.code(), state.code(), GARBAGE, 0xFF)
}

#[test]
fn an_original_board_comes_up_after_300_ms_of_syns_that_are_alike() {
    for (first, callsign) in [
        (SYN_SENSOR, Callsign::Sensor),
        (SYN_STEERING, Callsign::Steering),
    ] {
        for garbage in [[0; 7], GARBAGE, [0xFF; 7]] {
            let mut pi = Pi::new();
            let (count, up) = pi.syns_until_up(first, |_| garbage);
            // The fourth comes 300 ms after the first.
            assert_eq!(count, 4);
            let expected = Up {
                callsign,
                version: Version::Original,
                epoch: 1,
                reset: ResetCause::Unknown,
                rebooted: false,
                fresh: false,
                build: 0,
            };
            assert_eq!(up, expected);
        }
    }
}

#[test]
fn two_syns_are_not_enough_however_long_they_take() {
    let mut pi = Pi::new();
    for id in 0..2 {
        let syn = original(id, 0, SYN_SENSOR, GARBAGE, 0xFF);
        assert_eq!(pi.take(&syn, 900), []);
    }
    // The third SYN is answered. The first was held until its header came.
    let syn = original(2, 0, SYN_SENSOR, GARBAGE, 0xFF);
    assert_eq!(pi.take(&syn, 900).len(), 1);
}

#[test]
fn garbage_that_differs_from_syn_to_syn_takes_six() {
    let mut noise = Noise::new(1);
    let mut pi = Pi::new();
    let (count, up) = pi.syns_until_up(SYN_STEERING, |_| std::array::from_fn(|_| noise.byte()));
    assert_eq!(count, 6);
    assert_eq!(up.callsign, Callsign::Steering);
}

#[test]
fn ids_that_stay_the_same_in_syns_are_taken_too() {
    let mut pi = Pi::new();
    let syn = original(0, 0, SYN_SENSOR, [0; 7], 0xFF);
    for _ in 0..3 {
        assert_eq!(pi.take(&syn, 100), []);
    }
    assert_eq!(pi.take(&syn, 100).len(), 1);
}

#[test]
fn ids_run_on_across_syns_and_the_first_data_starts_the_count() {
    let mut pi = Pi::new();
    let (count, _) = pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    let mut received = 0;
    for id in count..count + 40 {
        let events = pi.take(&line_packet(id, LineState::OnLine), 12);
        received += events.len();
    }
    assert_eq!(received, 40);
    let health = pi.host.health();
    assert_eq!((health.packets, health.lost), (40, 0));

    // Three packets are lost. The next packet waits for the one after it; then the loss is counted.
    assert_eq!(pi.take(&line_packet(count + 43, LineState::OnLine), 12), []);
    assert_eq!(
        pi.take(&line_packet(count + 44, LineState::OnLine), 12)
            .len(),
        2
    );
    assert_eq!(pi.host.health().lost, 3);
    assert_eq!(pi.host.health().skipped_bytes, 0);
}

#[test]
fn what_only_the_other_board_sends_is_noise_on_an_original_line() {
    let mut pi = Pi::new();
    let (count, _) = pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    assert_eq!(pi.take(&sensor_packet(count), 12).len(), 1);
    assert_eq!(pi.take(&steering_packet(count + 1), 12), []);
    assert_eq!(pi.take(&sensor_packet(count + 2), 12).len(), 1);
    assert_eq!(pi.host.callsign(), Some(Callsign::Sensor));
    assert_eq!(pi.host.health().packets, 2);
}

#[test]
fn a_board_that_counts_from_0_after_the_ack_is_taken_too() {
    let mut pi = Pi::new();
    pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    let received: usize = (0..20)
        .map(|id| pi.take(&line_packet(id, LineState::OnLine), 12).len())
        .sum();
    assert_eq!(received, 20);
    assert_eq!(pi.host.health().lost, 0);
}

#[test]
fn a_repeated_syn_is_answered_again_in_the_same_epoch() {
    let mut pi = Pi::new();
    let (count, _) = pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    let syn = original(count, 0, SYN_SENSOR, GARBAGE, 0xFF);
    assert_eq!(pi.take(&syn, 100), [HostEvent::SendAck { up: None }]);
    assert_eq!(pi.host.health().epoch, 1);
}

#[test]
fn an_original_board_that_reboots_is_a_new_epoch_without_loss() {
    let mut pi = Pi::new();
    let (count, _) = pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    for id in count..count + 20 {
        pi.take(&line_packet(id, LineState::OnLine), 12);
    }
    let (syns, up) = pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    assert!((3..=4).contains(&syns), "{syns}");
    assert!(up.rebooted);
    assert_eq!(up.epoch, 2);
    let health = pi.host.health();
    assert_eq!((health.lost, health.packets, health.reboots), (0, 0, 1));
}

fn steering_packet(id: u8) -> [u8; 11] {
    original(id, Kind::SteerData.code(), 1, GARBAGE, 0x00)
}

fn sensor_packet(id: u8) -> [u8; 11] {
    match id % 2 {
        0 => line_packet(id, LineState::OnLine),
        _ => original(id, Kind::Distance.code(), 80, GARBAGE, 0xFF),
    }
}

#[test]
fn a_running_original_board_is_known_by_what_it_sends() {
    for callsign in [Callsign::Sensor, Callsign::Steering] {
        let packet = match callsign {
            Callsign::Sensor => sensor_packet,
            _ => steering_packet,
        };
        let mut pi = Pi::new();
        // The Pi starts to listen in the middle of a packet.
        let mut stream = packet(9)[4..].to_vec();
        let mut up_after = None;
        for id in 10..60 {
            stream.extend(packet(id));
            for event in pi.take(&std::mem::take(&mut stream), 12) {
                match event {
                    HostEvent::Up(up) => {
                        assert_eq!(up.callsign, callsign);
                        assert_eq!((up.version, up.rebooted), (Version::Original, false));
                        assert_eq!(up_after.replace(id), None);
                    }
                    HostEvent::Packet(_) => assert!(up_after.is_some()),
                    other => panic!("{other:?}"),
                }
            }
        }
        // 300 ms are 25 packets.
        assert_eq!(up_after, Some(35));
        assert_eq!(pi.host.health().lost, 0);
        assert_eq!(pi.host.health().packets, 24);
    }
}

#[test]
fn fewer_than_eight_ids_in_a_row_show_nothing() {
    let mut pi = Pi::new();
    pi.take(&[], 400);
    for round in 0..30_u8 {
        for step in 0..7 {
            let id = round.wrapping_mul(9).wrapping_add(step);
            assert_eq!(pi.take(&line_packet(id, LineState::OnLine), 1), []);
        }
    }
    assert!(!pi.host.is_up());
}

#[test]
fn a_running_version_one_board_is_never_taken_for_an_original_one() {
    // The board's packets look like original ones; only the check value shows the difference.
    let mut pi = Pi::new();
    for id in 0..200 {
        let bytes = distance(id, 80).encode(Version::One);
        assert_eq!(pi.take(&bytes, 12), []);
    }
    assert!(!pi.host.is_up());
}

/// If a bridge is delayed for longer than the system keeps bytes, it reads on in a damaged packet.
#[test]
fn a_hole_in_what_a_version_one_board_sends_does_not_make_it_an_original_one() {
    let mut pi = Pi::new();
    for id in 0..50 {
        assert_eq!(pi.take(&distance(id, 80).encode(Version::One), 12), []);
    }
    pi.take(&[], 400);
    for id in 50..53 {
        let mut damaged = distance(id, 80).encode(Version::One);
        damaged[5] ^= 0x10;
        assert_eq!(pi.take(&damaged, 0), []);
    }
    for id in 53..100 {
        assert_eq!(pi.take(&distance(id, 80).encode(Version::One), 12), []);
    }
    assert!(!pi.host.is_up());
}

#[test]
fn a_version_one_board_that_was_taken_for_an_original_one_is_asked_again() {
    let mut pi = Pi::new();
    let mut id = 0;
    while !pi.host.is_up() {
        pi.take(&sensor_packet(id), 12);
        id += 1;
    }
    assert_eq!(pi.host.version(), Some(Version::Original));
    let mut asked = Vec::new();
    for id in id..id + 3 {
        asked.extend(pi.take(&distance(id, 80).encode(Version::One), 12));
    }
    assert!(asked.contains(&HostEvent::Silent), "{asked:?}");
    assert_eq!(pi.host.poll(pi.now), Some(HostEvent::SendSyn));
}

#[test]
fn an_end_that_fits_the_check_value_by_chance_does_not_hide_an_original_board() {
    // Distances for which the end byte 0xFF is the right check value, for every id.
    let fitting =
        |id: u8| (0..=u8::MAX).find(|cm| distance(id, *cm).encode(Version::One)[10] == 0xFF);
    assert!((0..16).filter(|id| fitting(*id).is_some()).count() >= 8);
    let mut pi = Pi::new();
    let mut up = false;
    for id in 0..100 {
        let cm = fitting(id % 16).unwrap_or(80);
        let bytes = distance(id, cm).encode(Version::Original);
        for event in pi.take(&bytes, 12) {
            up |= matches!(event, HostEvent::Up(up) if up.version == Version::Original);
        }
    }
    assert!(up);
}

#[test]
fn no_version_one_handshake_ends_like_an_original_one() {
    for sign in [Callsign::Raspi, Callsign::Sensor, Callsign::Steering] {
        for reset in ResetCause::ALL {
            let mut link = board(sign, *reset);
            let syn = link.poll(0).unwrap();
            assert_ne!(syn[10], 0xFF, "{sign:?} {reset:?}");
            // The same for a board that has been up before.
            let mut pi = HostTransmitter::new();
            for byte in pi.ack(Version::One).into_iter().chain(pi.syn()) {
                link.push(byte, 0);
            }
            let syn = link.poll(0).unwrap();
            assert_eq!(syn[5], 1);
            assert_ne!(syn[10], 0xFF, "{sign:?} {reset:?}, asked again");
        }
    }
}

#[test]
fn a_version_one_board_in_place_of_an_original_one_is_believed_at_once() {
    let mut pi = Pi::new();
    let (count, _) = pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    for id in count..count + 20 {
        pi.take(&line_packet(id, LineState::OnLine), 12);
    }
    let syn = board(Callsign::Sensor, ResetCause::PowerOn)
        .poll(0)
        .unwrap();
    let events = pi.take(&syn, 1);
    assert!(matches!(
        events[..],
        [HostEvent::SendAck { up: Some(up) }] if up.version == Version::One && !up.rebooted
    ));
}

#[test]
fn an_original_board_that_falls_silent_is_asked_again() {
    let mut pi = Pi::new();
    pi.syns_until_up(SYN_SENSOR, |_| GARBAGE);
    assert_eq!(pi.host.poll(pi.now), None);
    let due = pi.host.next_due();
    assert_eq!(pi.host.poll(due), Some(HostEvent::Silent));
    assert_eq!(pi.host.poll(due), Some(HostEvent::SendSyn));
    assert_eq!(pi.host.poll(due), None);
}

#[test]
fn the_answer_to_an_original_board_is_the_originals() {
    let mut transmitter = HostTransmitter::new();
    assert_eq!(
        transmitter.ack(Version::Original),
        [0x00, 0x0B, 0x05, 0, 0, 0, 0, 0, 0, 0, 0xFF]
    );
    let command = Payload::SteerCommand(SteerCommand { code: 9, seq: 77 });
    assert_eq!(
        transmitter.encode(command),
        Some([0x40, 0x0B, 9, 0, 0, 0, 0, 0, 0, 0, 0xFF])
    );
    // An original board knows no settings. The refused packet uses no number.
    let setting = Payload::Setting(Setting {
        key: SettingKey::GainP,
        seq: 0,
        value: 2,
    });
    assert_eq!(transmitter.encode(setting), None);
    assert_eq!(transmitter.encode(command).unwrap()[0], 0x41);
}

#[test]
fn packets_of_4_to_11_bytes_are_read_by_their_length() {
    let mut decoder = Decoder::new(Version::Original);
    let mut received = Vec::new();
    for id in 0..64_u8 {
        let length = 4 + id % 8;
        let mut bytes = vec![0x20 | (id % 16), length, id];
        bytes.resize(usize::from(length) - 1, 0xEE);
        bytes.push(!id);
        assert_eq!(
            Packet::decode(&bytes, Version::Original),
            Ok(distance(id, id))
        );
        received.extend(bytes.iter().filter_map(|byte| decoder.push(*byte)));
    }
    assert_eq!(received.len(), 64);
    for (id, packet) in (0..).zip(received) {
        assert_eq!(packet.payload, Payload::Distance(Centimetres(id)));
    }
    for length in [0, 1, 2, 3, 12, 255] {
        let mut bytes = [0; 11];
        bytes[1] = length;
        assert!(Packet::decode(&bytes, Version::Original).is_err());
    }
}

#[test]
fn kinds_that_the_original_does_not_have_are_refused() {
    for kind in 6..16 {
        let bytes = original(0, kind, 1, [0; 7], 0xFF);
        assert!(Packet::decode(&bytes, Version::Original).is_err());
    }
}

#[test]
fn ten_megabytes_of_noise_bring_no_board_up() {
    let mut noise = Noise::new(8);
    let mut host = HostLink::new();
    for index in 0..10_000_000_u64 {
        let now = Duration::from_micros(index * 20);
        assert_eq!(host.push(noise.byte(), now), None, "byte {index}");
        while let Some(event) = host.poll(now) {
            assert_eq!(event, HostEvent::SendSyn);
        }
    }
    // The first whole SYN after it is answered.
    let syn = board(Callsign::Sensor, ResetCause::PowerOn)
        .poll(0)
        .unwrap();
    let answered = syn
        .iter()
        .filter_map(|byte| host.push(*byte, Duration::from_secs(300)))
        .count();
    assert_eq!(answered, 1);
}
