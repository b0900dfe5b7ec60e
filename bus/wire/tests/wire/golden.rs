//! Fixed bytes. If a test here fails, do not change the test: robots in the field and recordings
//! use these bytes.
//!
//! Source of the original's bytes: `packet.h` of the technical documentation, appendix B.1,
//! compiled with avr-gcc 5.4.0 for the ATmega1284P (with and without -fshort-enums) and with gcc
//! for x86-64; all three give the same bytes. Source of the check value: Greg Cook's CRC
//! catalogue, CRC-8/AUTOSAR.

use lager_wire::{
    ArmData, BoardStatus, Callsign, Centimetres, DecodeError, END, Handshake, Kind, LineBits,
    LineReading, LineState, MIN_LENGTH, PACKET_LENGTH, PAYLOAD_LENGTH, Packet, PacketId, Payload,
    ResetCause, ResetOrder, Setting, SettingKey, SettingReply, SettingStatus, SteerCommand,
    SteerData, SteerFlags, SynAck, Version,
};

use crate::sample::{packet, payloads};

/// The first byte of a header, by type and id. The second is always 0x0b.
const HEADERS: [[u8; 16]; 6] = [
    [
        0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0a, 0x0b, 0x0c, 0x0d, 0x0e,
        0x0f,
    ],
    [
        0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x18, 0x19, 0x1a, 0x1b, 0x1c, 0x1d, 0x1e,
        0x1f,
    ],
    [
        0x20, 0x21, 0x22, 0x23, 0x24, 0x25, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x2b, 0x2c, 0x2d, 0x2e,
        0x2f,
    ],
    [
        0x30, 0x31, 0x32, 0x33, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x3b, 0x3c, 0x3d, 0x3e,
        0x3f,
    ],
    [
        0x40, 0x41, 0x42, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x4a, 0x4b, 0x4c, 0x4d, 0x4e,
        0x4f,
    ],
    [
        0x50, 0x51, 0x52, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x5a, 0x5b, 0x5c, 0x5d, 0x5e,
        0x5f,
    ],
];

/// Handshake bytes: synack, callsign, byte.
const HANDSHAKES: [(u8, u8, u8); 8] = [
    (0, 0, 0x00),
    (0, 1, 0x04),
    (0, 2, 0x08),
    (0, 3, 0x0c),
    (1, 0, 0x01),
    (1, 1, 0x05),
    (1, 2, 0x09),
    (1, 3, 0x0d),
];

fn syn(sign: Callsign, version: Version, reset: ResetCause) -> Payload {
    Payload::Handshake(Handshake {
        kind: SynAck::Syn,
        sign,
        version,
        reset,
        was_up: false,
        build: 0,
    })
}

#[test]
fn sizes_are_the_originals() {
    assert_eq!(PACKET_LENGTH, 11);
    assert_eq!(PAYLOAD_LENGTH, 8);
    assert_eq!(MIN_LENGTH, 4);
    assert_eq!(END, 0xFF);
}

#[test]
fn enums_have_the_originals_codes() {
    let states = [
        LineState::OnLine,
        LineState::NotOnLine,
        LineState::LeftOfLine,
        LineState::RightOfLine,
        LineState::StationToLeft,
        LineState::StationToRight,
        LineState::FourWay,
        LineState::DropStation,
    ];
    let kinds = [
        Kind::Handshake,
        Kind::LineData,
        Kind::Distance,
        Kind::RawLine,
        Kind::SteerCommand,
        Kind::SteerData,
        Kind::Setting,
        Kind::SettingReply,
        Kind::ArmData,
        Kind::BoardStatus,
        Kind::LineReading,
        Kind::Reset,
    ];
    let signs = [
        Callsign::Error,
        Callsign::Raspi,
        Callsign::Sensor,
        Callsign::Steering,
    ];
    for code in 0..=u8::MAX {
        let index = usize::from(code);
        assert_eq!(LineState::from_code(code), states.get(index).copied());
        assert_eq!(Kind::from_code(code), kinds.get(index).copied());
        assert_eq!(Callsign::from_code(code), signs.get(index).copied());
    }
}

#[test]
fn all_96_headers() {
    for (kind, headers) in HEADERS.iter().enumerate() {
        let kind = Kind::from_code(u8::try_from(kind).unwrap()).unwrap();
        for (id, first) in (0..).zip(headers) {
            let mut encoded = 0;
            for payload in payloads().into_iter().filter(|p| p.kind() == kind) {
                for version in [Version::Original, Version::One] {
                    let sent = packet(id, payload);
                    let bytes = sent.encode(version);
                    assert_eq!(bytes[..2], [*first, 0x0b], "{sent:?}");
                    let read = Packet::decode(&bytes, version).unwrap();
                    assert_eq!(read.id.get(), id);
                    assert_eq!(read.payload.kind(), kind);
                    encoded += 1;
                }
            }
            assert!(encoded > 0, "{kind:?} has no sample");
        }
    }
}

#[test]
fn all_8_handshake_bytes() {
    for (synack, sign, byte) in HANDSHAKES {
        let handshake = Handshake {
            kind: SynAck::from_code(synack).unwrap(),
            sign: Callsign::from_code(sign).unwrap(),
            version: Version::Original,
            reset: ResetCause::Unknown,
            was_up: false,
            build: 0,
        };
        assert_eq!(handshake.byte(), byte);
        let sent = packet(0, Payload::Handshake(handshake));
        let bytes = sent.encode(Version::Original);
        assert_eq!(bytes, [0, 11, byte, 0, 0, 0, 0, 0, 0, 0, 0xff]);
        assert_eq!(Packet::decode(&bytes, Version::Original), Ok(sent));
    }
}

#[test]
fn full_size_packets_of_the_original() {
    let cases: [(Packet, [u8; 11]); 3] = [
        (
            packet(15, Payload::Line(LineState::FourWay)),
            [0x1f, 0x0b, 0x06, 0, 0, 0, 0, 0, 0, 0, 0xff],
        ),
        (
            packet(1, Payload::Distance(Centimetres(37))),
            [0x21, 0x0b, 0x25, 0, 0, 0, 0, 0, 0, 0, 0xff],
        ),
        (
            packet(
                0,
                syn(Callsign::Sensor, Version::Original, ResetCause::Unknown),
            ),
            [0x00, 0x0b, 0x08, 0, 0, 0, 0, 0, 0, 0, 0xff],
        ),
    ];
    for (packet, bytes) in cases {
        assert_eq!(packet.encode(Version::Original), bytes);
        assert_eq!(Packet::decode(&bytes, Version::Original), Ok(packet));
    }
}

#[test]
fn version_one_packets() {
    // The payload bytes follow this project's wire description. The last byte is CRC-8/AUTOSAR of
    // the ten before it, computed bit by bit with an independent routine.
    let asking_again = Handshake {
        kind: SynAck::Syn,
        sign: Callsign::Steering,
        version: Version::One,
        reset: ResetCause::Watchdog,
        was_up: true,
        build: 0x1234,
    };
    let cases: [(Packet, [u8; 11]); 14] = [
        (
            packet(0, syn(Callsign::Sensor, Version::One, ResetCause::PowerOn)),
            [0x00, 0x0b, 0x08, 1, 1, 0, 0, 0, 0, 0, 0x09],
        ),
        (
            packet(0, Payload::Handshake(asking_again)),
            [0x00, 0x0b, 0x0c, 1, 4, 1, 0x34, 0x12, 0, 0, 0xdc],
        ),
        (
            packet(
                5,
                Payload::Setting(Setting {
                    key: SettingKey::ArmTorqueLimit,
                    seq: 5,
                    value: 700,
                }),
            ),
            [0x65, 0x0b, 16, 5, 0xbc, 2, 0xef, 0xfa, 0, 0, 0xe9],
        ),
        (
            packet(15, Payload::Line(LineState::FourWay)),
            [0x1f, 0x0b, 6, 0, 0, 0, 0, 0, 0, 0, 0x56],
        ),
        (
            packet(1, Payload::Distance(Centimetres(37))),
            [0x21, 0x0b, 37, 0, 0, 0, 0, 0, 0, 0, 0x0c],
        ),
        (
            packet(2, Payload::RawLine(LineBits::new(0x401))),
            [0x32, 0x0b, 0x01, 0x04, 0, 0, 0, 0, 0, 0, 0xd4],
        ),
        (
            packet(3, Payload::SteerCommand(SteerCommand { code: 3, seq: 7 })),
            [0x43, 0x0b, 3, 7, 0xfc, 0xf8, 0, 0, 0, 0, 0x59],
        ),
        (
            packet(
                4,
                Payload::SteerData(SteerData {
                    code: 3,
                    left_duty: 104,
                    right_duty: 96,
                    flags: SteerFlags::ARM_LOCKED.with(SteerFlags::EXDE_OK),
                    line_error: -2,
                    finished_seq: 6,
                    servo_errors: 0x80,
                    battery_decivolts: 118,
                }),
            ),
            [0x54, 0x0b, 3, 104, 96, 12, 0xfe, 6, 0x80, 118, 0xbe],
        ),
        (
            packet(
                5,
                Payload::Setting(Setting {
                    key: SettingKey::GainD,
                    seq: 1,
                    value: -300,
                }),
            ),
            [0x65, 0x0b, 2, 1, 0xd4, 0xfe, 0xfd, 0xfe, 0, 0, 0x09],
        ),
        (
            packet(
                6,
                Payload::SettingReply(SettingReply {
                    key: SettingKey::GainP,
                    seq: 1,
                    value: 2,
                    status: SettingStatus::OutOfRange,
                }),
            ),
            [0x76, 0x0b, 1, 1, 2, 0, 1, 0, 0, 0, 0x2e],
        ),
        (
            packet(
                7,
                Payload::ArmData(ArmData {
                    servo: 8,
                    errors: 0x20,
                    position: 512,
                    load: -256,
                    decivolts: 115,
                    celsius: 38,
                }),
            ),
            [0x87, 0x0b, 8, 0x20, 0, 2, 0, 0xff, 115, 38, 0x72],
        ),
        (
            packet(
                8,
                Payload::BoardStatus(BoardStatus {
                    reset: ResetCause::BrownOut,
                    bad_packets: 1,
                    lost_packets: 2,
                    refused: 3,
                    exde_errors: 4,
                    servo_timeouts: 5,
                    load_percent: 60,
                    longest_loop_100us: 7,
                }),
            ),
            [0x98, 0x0b, 3, 1, 2, 3, 4, 5, 60, 7, 0x65],
        ),
        (
            packet(
                9,
                Payload::LineReading(LineReading {
                    sensor: 10,
                    reading: 120,
                    lowest: 30,
                    highest: 200,
                    tells_apart: true,
                }),
            ),
            [0xa9, 0x0b, 10, 120, 30, 200, 1, 0, 0, 0, 0xd0],
        ),
        (
            packet(2, Payload::Reset(ResetOrder::Loader)),
            [0xb2, 0x0b, 2, 0xfd, 0, 0, 0, 0, 0, 0, 0x98],
        ),
    ];
    for (packet, bytes) in cases {
        assert_eq!(packet.encode(Version::One), bytes, "{packet:?}");
        assert_eq!(Packet::decode(&bytes, Version::One), Ok(packet));
    }
}

#[test]
fn every_packet_reads_back_as_it_was_written() {
    for payload in payloads() {
        for id in 0..16 {
            let sent = packet(id, payload);
            assert_eq!(
                Packet::decode(&sent.encode(Version::One), Version::One),
                Ok(sent)
            );
        }
    }
}

#[test]
fn measurements_out_of_range_are_sent_saturated() {
    let data = |servo, position, load| ArmData {
        servo,
        errors: 0,
        position,
        load,
        decivolts: 0,
        celsius: 0,
    };
    let sent = packet(0, Payload::ArmData(data(1, u16::MAX, i16::MIN))).encode(Version::One);
    let read = Packet::decode(&sent, Version::One).unwrap();
    assert_eq!(read.payload, Payload::ArmData(data(1, 1023, -1023)));

    let sent = packet(0, Payload::ArmData(data(9, 0, 0))).encode(Version::One);
    assert_eq!(
        Packet::decode(&sent, Version::One),
        Err(DecodeError::Payload {
            kind: Kind::ArmData,
            index: 0,
            found: 9
        })
    );
}

#[test]
fn lost_packets_are_counted_modulo_16() {
    let missing = |last, id| PacketId::new(id).missing_since(PacketId::new(last));
    assert_eq!(missing(3, 4), 0);
    assert_eq!(missing(15, 0), 0);
    assert_eq!(missing(3, 7), 3);
    assert_eq!(missing(14, 1), 2);
    assert_eq!(missing(5, 5), 15);
    assert_eq!(PacketId::new(15).next(), PacketId::new(16));
}

#[test]
fn the_leftmost_sensor_is_bit_10() {
    assert!(LineBits::new(0x400).sensor(0));
    assert!(LineBits::new(0x001).sensor(10));
    assert!(!LineBits::new(0xFFFF).sensor(11));
    assert_eq!(LineBits::new(0xFFFF), LineBits(0x7FF));
}

#[test]
fn an_error_shows_what_was_found() {
    let good = packet(1, Payload::Distance(Centimetres(37))).encode(Version::One);
    let mut crc = good;
    crc[10] ^= 1;
    let mut kind = good;
    kind[0] = 0xC0;
    let mut length = good;
    length[1] = 10;
    let found = |bytes: &[u8]| Packet::decode(bytes, Version::One).unwrap_err();
    assert_eq!(
        found(&crc),
        DecodeError::Crc {
            computed: good[10],
            found: good[10] ^ 1
        }
    );
    assert_eq!(found(&kind), DecodeError::Kind { code: 12 });
    assert_eq!(found(&length), DecodeError::Length { found: 10 });
    assert_eq!(found(&good[..10]), DecodeError::Size { have: 10, need: 11 });
    assert_eq!(found(&[]), DecodeError::Size { have: 0, need: 4 });
    assert!(found(&crc).to_string().contains("damaged"));
}
