//! The inputs of the benches, made once and shared, so that every candidate and its baseline see
//! the same bytes. Nothing is measured here.

use lager_wire::{
    Centimetres, LineState, Packet, PacketId, Payload, SteerData, SteerFlags, Version,
};

/// A second of what the two boards send: line and distance in turn, and the steering board's
/// reports, as version-1 packets.
#[must_use]
pub fn a_second_of_packets() -> Vec<Packet> {
    let states = [
        LineState::OnLine,
        LineState::LeftOfLine,
        LineState::RightOfLine,
        LineState::FourWay,
    ];
    (0..200_u8)
        .flat_map(|number| {
            let id = PacketId::new(number % 16);
            let sensor = if number % 2 == 0 {
                Payload::Line(states[usize::from(number / 2) % states.len()])
            } else {
                Payload::Distance(Centimetres(number))
            };
            let report = Payload::SteerData(SteerData {
                code: 3,
                left_duty: number,
                right_duty: 200 - number,
                flags: SteerFlags(SteerFlags::EXDE_OK.0),
                line_error: 2,
                finished_seq: number,
                servo_errors: 0,
                battery_decivolts: 111,
            });
            [sensor, report].map(|payload| Packet { id, payload })
        })
        .collect()
}

/// The same as one stream of bytes.
#[must_use]
pub fn a_second_of_bytes() -> Vec<u8> {
    a_second_of_packets()
        .iter()
        .flat_map(|packet| packet.encode(Version::One))
        .collect()
}
