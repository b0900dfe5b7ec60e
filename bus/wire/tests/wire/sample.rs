//! Packets for the tests, and a small generator of reproducible noise.

use lager_wire::{
    ArmData, BoardStatus, Callsign, Centimetres, Handshake, LineBits, LineReading, LineState,
    PACKET_LENGTH, Packet, PacketId, Payload, ResetCause, ResetOrder, Setting, SettingKey,
    SettingReply, SettingStatus, SteerCommand, SteerData, SteerFlags, SynAck, Version,
};

/// Marsaglia's xorshift64*: the same bytes on every machine.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn number(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.number().to_le_bytes()[7]
    }

    /// True once in `times`.
    pub(crate) fn once_in(&mut self, times: u64) -> bool {
        (self.number() >> 11).is_multiple_of(times)
    }
}

pub(crate) fn packet(id: u8, payload: Payload) -> Packet {
    let id = PacketId::new(id);
    Packet { id, payload }
}

pub(crate) fn distance(id: u8, centimetres: u8) -> Packet {
    packet(id, Payload::Distance(Centimetres(centimetres)))
}

/// An original board's packet: garbage in payload bytes without meaning, and any end byte.
pub(crate) fn original(id: u8, kind: u8, first: u8, garbage: [u8; 7], end: u8) -> [u8; 11] {
    let mut bytes = [0; PACKET_LENGTH];
    bytes[0] = (id & 0x0F) | (kind << 4);
    bytes[1] = 11;
    bytes[2] = first;
    bytes[3..10].copy_from_slice(&garbage);
    bytes[10] = end;
    bytes
}

/// Several payloads of every kind of version 1: ends of ranges and values between.
pub(crate) fn payloads() -> Vec<Payload> {
    let mut payloads = Vec::new();
    for kind in SynAck::ALL {
        for sign in [Callsign::Raspi, Callsign::Sensor, Callsign::Steering] {
            for reset in [ResetCause::Unknown, ResetCause::BrownOut, ResetCause::Jtag] {
                payloads.push(Payload::Handshake(Handshake {
                    kind: *kind,
                    sign,
                    version: Version::One,
                    reset,
                    was_up: reset == ResetCause::BrownOut,
                    build: reset.code().into(),
                }));
            }
        }
    }
    payloads.extend(ResetOrder::ALL.iter().copied().map(Payload::Reset));
    payloads.extend(LineState::ALL.iter().copied().map(Payload::Line));
    payloads.extend([0, 11, 37, 80, 255].map(|cm| Payload::Distance(Centimetres(cm))));
    payloads.extend([0, 0x7FF, 0x070, 0x555].map(|bits| Payload::RawLine(LineBits::new(bits))));
    for (sensor, lowest, reading, highest) in [(0, 0, 0, 0), (10, 0, 255, 255), (5, 11, 11, 190)] {
        payloads.push(Payload::LineReading(LineReading {
            sensor,
            reading,
            lowest,
            highest,
            tells_apart: highest - lowest >= 40,
        }));
    }
    for (code, seq) in [(1, 0), (3, 255), (7, 11), (0xFB, 85), (0, 170)] {
        payloads.push(Payload::SteerCommand(SteerCommand { code, seq }));
    }
    for (code, fill, line_error) in [(0, 0, 0), (3, 100, -10), (11, 255, 10), (0xF9, 11, 1)] {
        payloads.push(Payload::SteerData(SteerData {
            code,
            left_duty: fill,
            right_duty: !fill,
            flags: SteerFlags(fill),
            line_error,
            finished_seq: fill,
            servo_errors: fill,
            battery_decivolts: !fill,
        }));
    }
    for (key, seq, value) in [
        (SettingKey::GainP, 0, 2),
        (SettingKey::GainD, 255, -1),
        (SettingKey::RawLine, 11, i16::MIN),
        (SettingKey::Calibrate, 1, i16::MAX),
        (SettingKey::ArmTorqueLimit, 9, 1_023),
        (SettingKey::ArmDropWrist, 10, 0),
        (SettingKey::ArmProfile, 12, 255),
        (SettingKey::SteeringDuty, 13, 140),
        (SettingKey::Sensors, 14, 7),
    ] {
        payloads.push(Payload::Setting(Setting { key, seq, value }));
        for status in SettingStatus::ALL {
            payloads.push(Payload::SettingReply(SettingReply {
                key,
                seq,
                value,
                status: *status,
            }));
        }
    }
    for (servo, errors, position, load) in [(1, 0, 0, 0), (8, 0x7F, 1023, -1023), (4, 32, 511, 11)]
    {
        payloads.push(Payload::ArmData(ArmData {
            servo,
            errors,
            position,
            load,
            decivolts: 112,
            celsius: 41,
        }));
    }
    for fill in [0, 11, 100, 255] {
        payloads.push(Payload::BoardStatus(BoardStatus {
            reset: ResetCause::Watchdog,
            bad_packets: fill,
            lost_packets: fill,
            refused: !fill,
            exde_errors: fill,
            servo_timeouts: 0,
            load_percent: fill.min(100),
            longest_loop_100us: 50,
        }));
    }
    payloads
}
