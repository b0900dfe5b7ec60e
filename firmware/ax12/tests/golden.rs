//! Encodes and decodes published packets byte for byte. If a test here fails, do not change the
//! test.

mod vectors;

use lager_ax12::{
    BROADCAST_ID, Decoder, EncodeError, ErrorBits, Frame, Instruction, InstructionDecoder,
    MAX_FRAME, StatusDecoder, table,
};
use vectors::VECTORS;

fn published(meaning: &str) -> &'static [u8] {
    VECTORS
        .iter()
        .find(|vector| vector.meaning.contains(meaning))
        .expect("a published packet")
        .bytes
}

#[test]
fn every_published_packet_decodes_to_one_packet() {
    for vector in VECTORS {
        let mut decoder = InstructionDecoder::new();
        for byte in &vector.bytes[..vector.bytes.len() - 1] {
            assert_eq!(
                decoder.push(*byte),
                None,
                "{} ({})",
                vector.meaning,
                vector.source
            );
        }
        let packet = decoder
            .push(*vector.bytes.last().unwrap())
            .expect(vector.meaning);
        assert_eq!(packet.id, vector.bytes[2]);
        assert_eq!(packet.code, vector.bytes[4]);
        assert_eq!(packet.parameters, &vector.bytes[5..vector.bytes.len() - 1]);
    }
}

#[test]
fn every_published_packet_encodes_to_its_bytes() {
    for vector in VECTORS {
        let parameters = &vector.bytes[5..vector.bytes.len() - 1];
        let frame = if vector.status {
            Frame::status(vector.bytes[2], ErrorBits(vector.bytes[4]), parameters)
        } else if let Some(instruction) = Instruction::from_code(vector.bytes[4]) {
            Frame::instruction(vector.bytes[2], instruction, parameters)
        } else {
            assert!(vector.meaning.contains("not AX-12"), "{}", vector.meaning);
            continue;
        };
        assert_eq!(
            frame.unwrap().as_bytes(),
            vector.bytes,
            "{} ({})",
            vector.meaning,
            vector.source
        );
    }
}

#[test]
fn published_answers_are_status_packets() {
    let mut answers = 0;
    for vector in VECTORS.iter().filter(|vector| !vector.reply.is_empty()) {
        let frame = Frame::status(vector.reply[2], ErrorBits::NONE, &[]).unwrap();
        assert_eq!(frame.as_bytes(), vector.reply);
        let mut decoder = StatusDecoder::new();
        let packet = vector.reply.iter().fold(None, |_, byte| {
            decoder
                .push(*byte)
                .map(|packet| (packet.id, packet.errors(), packet.parameters.len()))
        });
        assert_eq!(packet, Some((vector.bytes[2], ErrorBits::NONE, 0)));
        answers += 1;
    }
    assert_eq!(answers, 2);
}

#[test]
fn the_named_constructors_make_the_published_packets() {
    assert_eq!(Frame::ping(1).as_bytes(), published("PING id1"));
    assert_eq!(
        Frame::write(1, 0x0C, &[0x64, 0xAA]).unwrap().as_bytes(),
        published("checksum worked example")
    );
    assert_eq!(
        Frame::write(BROADCAST_ID, table::ID, &[1])
            .unwrap()
            .as_bytes(),
        published("WRITE broadcast")
    );
    assert_eq!(
        Frame::action(BROADCAST_ID).as_bytes(),
        published("ACTION broadcast")
    );
    assert_eq!(
        Frame::read(1, table::MODEL_NUMBER_L, 3).as_bytes(),
        published("Ex. 6")
    );
    assert_eq!(
        Frame::write(0, table::BAUD_RATE, &[table::BAUD_1_MBIT])
            .unwrap()
            .as_bytes(),
        published("Ex. 8")
    );
    assert_eq!(
        Frame::reg_write(1, table::GOAL_POSITION_L, &1023_u16.to_le_bytes())
            .unwrap()
            .as_bytes(),
        published("Ex. 19")
    );
    assert_eq!(
        Frame::write(1, table::GOAL_POSITION_L, &205_u16.to_le_bytes())
            .unwrap()
            .as_bytes(),
        published("goal position 0x0CD")
    );
    assert_eq!(
        Frame::write(0, table::PUNCH_L, &0x40_u16.to_le_bytes())
            .unwrap()
            .as_bytes(),
        published("Ex. 20")
    );
    assert_eq!(
        Frame::sync_write(
            table::GOAL_POSITION_L,
            &[
                (0, &[0x10, 0x00, 0x50, 0x01]),
                (1, &[0x20, 0x02, 0x60, 0x03]),
                (2, &[0x30, 0x00, 0x70, 0x01]),
                (3, &[0x20, 0x02, 0x80, 0x03]),
            ]
        )
        .unwrap()
        .as_bytes(),
        published("Ex. 5")
    );
}

#[test]
fn the_control_table_is_the_originals() {
    assert_eq!(table::TORQUE_ENABLE, 24);
    assert_eq!(table::GOAL_POSITION_L, 30);
    assert_eq!(table::GOAL_SPEED_L, 32);
    assert_eq!(table::TORQUE_LIMIT_L, 34);
    assert_eq!(table::PRESENT_POSITION_L, 36);
    assert_eq!(table::PRESENT_LOAD_L, 40);
    assert_eq!(table::PRESENT_VOLTAGE, 42);
    assert_eq!(table::MOVING, 46);
    assert_eq!(usize::from(table::PUNCH_H) + 1, table::LENGTH);
}

#[test]
fn loads_and_speeds_keep_their_sign() {
    assert_eq!(table::signed(0), 0);
    assert_eq!(table::signed(0x03FF), 1023);
    assert_eq!(table::signed(0x0400), 0);
    assert_eq!(table::signed(0x07FF), -1023);
    for value in -1023..=1023 {
        assert_eq!(table::signed(table::unsigned(value)), value);
    }
    assert_eq!(table::signed(table::unsigned(-5000)), -1023);
}

#[test]
fn every_instruction_code_comes_back() {
    let known: Vec<u8> = (0..=255)
        .filter(|code| Instruction::from_code(*code).is_some())
        .collect();
    assert_eq!(known, [1, 2, 3, 4, 5, 6, 7, 0x0C, 0x0D, 0x83, 0x84]);
    for code in known {
        assert_eq!(Instruction::from_code(code).unwrap().code(), code);
    }
}

#[test]
fn the_longest_packet_fits_and_one_byte_more_is_refused() {
    let values = [7; MAX_FRAME];
    let longest = MAX_FRAME - 7;
    let frame = Frame::write(3, 0, &values[..longest]).unwrap();
    assert_eq!(frame.as_bytes().len(), MAX_FRAME);
    let mut decoder = InstructionDecoder::new();
    let mut found = 0;
    for byte in frame.as_bytes() {
        found += usize::from(decoder.push(*byte).is_some());
    }
    assert_eq!(found, 1);
    assert_eq!(
        Frame::write(3, 0, &values[..=longest]),
        Err(EncodeError::TooLong {
            length: MAX_FRAME + 1
        })
    );
    let eight: Vec<(u8, &[u8])> = (1..=8).map(|id| (id, &values[..6])).collect();
    assert_eq!(
        Frame::sync_write(30, &eight).unwrap().as_bytes().len(),
        MAX_FRAME
    );
    assert_eq!(
        Frame::sync_write(30, &[(1, &[1, 2]), (9, &[1])]),
        Err(EncodeError::UnevenValues { id: 9 })
    );
}

#[test]
fn a_decoder_of_another_size_has_its_own_limit() {
    let frame = Frame::status(4, ErrorBits::NONE, &[0; 3]).unwrap();
    let mut small = Decoder::<8>::new();
    let mut exact = Decoder::<9>::new();
    let mut found = (0, 0);
    for byte in frame.as_bytes() {
        found.0 += u8::from(small.push(*byte).is_some());
        found.1 += u8::from(exact.push(*byte).is_some());
    }
    assert_eq!(found, (0, 1));
}
