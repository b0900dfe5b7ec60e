//! Command codes: the conversion table and the three text forms.

use std::collections::BTreeSet;

use lager_wire::{
    ArmCommand, Binary, CodeTextError, Command, OperatorArm, OperatorCommand, Packet, Payload,
    Speed, SteerCommand, Version, WheelCommand, parse_code,
};

use crate::sample::{original, packet};

#[test]
fn the_conversion_table_is_the_agreed_one() {
    let table = [
        (1, 1),
        (2, 2),
        (3, 3),
        (4, 4),
        (5, 5),
        (6, 6),
        (7, 9),
        (8, 8),
        (9, 11),
    ];
    for (operator, firmware) in table {
        let command = OperatorCommand::from_code(operator).unwrap();
        assert_eq!(command.code(), operator);
        assert_eq!(command.firmware().code(), firmware, "{command:?}");
    }
    for code in 0xF1..=0xFA {
        let command = OperatorCommand::from_code(code).unwrap();
        assert_eq!(command.code(), code);
        assert_eq!(command.firmware().code(), code);
    }
    assert_eq!(
        OperatorCommand::Right(Speed::Full).firmware(),
        Command::Wheel(WheelCommand::ManualRight)
    );
    assert_eq!(
        OperatorCommand::RightDiag.firmware(),
        Command::Wheel(WheelCommand::RightDiag)
    );
}

#[test]
fn the_conversion_is_injective_and_gives_no_quarter_turn_and_no_drop() {
    let firmware: BTreeSet<u8> = OperatorCommand::ALL
        .iter()
        .map(|command| command.firmware().code())
        .collect();
    assert_eq!(firmware.len(), OperatorCommand::ALL.len());
    for kept in [7, 10, 0xFB] {
        assert!(!firmware.contains(&kept), "{kept}");
    }
}

#[test]
fn the_speed_is_the_high_nibble_of_what_a_person_holds() {
    let speeds = [(Speed::Full, 0), (Speed::Slow, 0x10), (Speed::Middle, 0x20)];
    for command in OperatorCommand::ALL {
        assert_eq!(command.speed(), Speed::Full);
        let full = command.firmware();
        for (speed, high) in speeds {
            assert_eq!(Speed::from_word(speed.as_str()), Some(speed));
            let Some(slower) = command.at(speed) else {
                assert!(![2, 4, 6, 7].contains(&command.code()), "{command:?}");
                continue;
            };
            assert_eq!(
                (slower.code(), slower.name()),
                (command.code(), command.name())
            );
            assert_eq!(slower.speed(), speed);
            assert_eq!(slower.firmware().code(), full.code() | high, "{slower:?}");
            let (Command::Wheel(wheel), Command::Wheel(full)) = (slower.firmware(), full) else {
                panic!("it moves the wheels: {slower:?}");
            };
            assert_eq!((wheel.at_full(), wheel.speed()), (full, speed));
            assert!(!wheel.is_one_shot());
        }
    }
}

#[test]
fn undefined_codes_are_no_commands() {
    let operator: Vec<u8> = (0..=u8::MAX)
        .filter(|code| OperatorCommand::from_code(*code).is_some())
        .collect();
    let firmware: Vec<u8> = (0..=u8::MAX)
        .filter(|code| Command::from_code(*code).is_some())
        .collect();
    let slower = [0x12, 0x14, 0x16, 0x19, 0x22, 0x24, 0x26, 0x29];
    assert_eq!(operator, (1..=9).chain(0xF1..=0xFA).collect::<Vec<u8>>());
    let wheels = (1..=11).chain(slower);
    assert_eq!(firmware, wheels.chain(0xF1..=0xFB).collect::<Vec<u8>>());
    for code in firmware {
        assert_eq!(Command::from_code(code).unwrap().code(), code);
    }
    assert_eq!(OperatorArm::new(ArmCommand::Drop), None);
}

#[test]
fn turns_of_a_fixed_angle_and_arm_steps_run_once() {
    let once: Vec<u8> = (0..=u8::MAX)
        .filter(|code| Command::from_code(*code).is_some_and(Command::is_one_shot))
        .collect();
    let expected: Vec<u8> = [7, 8, 10, 11].into_iter().chain(0xF1..=0xFB).collect();
    assert_eq!(once, expected);
}

#[test]
fn names_lead_back_to_their_commands() {
    for command in OperatorCommand::ALL {
        let found = match command {
            OperatorCommand::Arm(_) => OperatorCommand::arm(command.name()),
            _ => OperatorCommand::wheel(command.name()),
        };
        assert_eq!(found, Some(command));
    }
    assert_eq!(OperatorCommand::wheel("squeeze"), None);
    assert_eq!(OperatorCommand::arm("drop"), None);
}

#[test]
fn a_code_reads_the_same_from_all_three_forms() {
    for code in 0..=u8::MAX {
        assert_eq!(parse_code(&Binary(code).to_string()), Ok(code));
        assert_eq!(parse_code(&format!("{code}")), Ok(code));
        assert_eq!(parse_code(&format!("{code:#x}")), Ok(code));
        assert_eq!(parse_code(&format!("0X{code:02X}")), Ok(code));
    }
    assert_eq!(Binary(7).to_string(), "00000111");
}

#[test]
fn only_eight_digits_of_0_and_1_are_binary() {
    assert_eq!(parse_code("00000111"), Ok(7));
    assert_eq!(parse_code("111"), Ok(111));
    assert_eq!(parse_code("00000112"), Ok(112));
    assert_eq!(parse_code("000000111"), Ok(111));
}

#[test]
fn what_is_no_code_is_explained() {
    use CodeTextError::{Empty, NotADigit, TooLarge};
    let cases = [
        ("", Empty),
        ("0x", Empty),
        ("256", TooLarge),
        ("0x100", TooLarge),
        ("99999999999999999999", TooLarge),
        ("11111111111", TooLarge),
        (
            "F1",
            NotADigit {
                found: 'F',
                position: 0,
            },
        ),
        (
            "0xG1",
            NotADigit {
                found: 'G',
                position: 2,
            },
        ),
        (
            "-1",
            NotADigit {
                found: '-',
                position: 0,
            },
        ),
        (
            "1 ",
            NotADigit {
                found: ' ',
                position: 1,
            },
        ),
        (
            "3000x",
            NotADigit {
                found: 'x',
                position: 4,
            },
        ),
        (
            "å",
            NotADigit {
                found: 'å',
                position: 0,
            },
        ),
    ];
    for (text, error) in cases {
        assert_eq!(parse_code(text), Err(error), "{text:?}");
        assert!(error.to_string().contains("binary"), "{error}");
    }
}

#[test]
fn an_original_command_may_be_a_number_or_eight_characters() {
    let text: [u8; 7] = *b"0001001";
    let bytes = original(3, 4, b'0', text, 0x42);
    let command = Payload::SteerCommand(SteerCommand { code: 9, seq: 0 });
    assert_eq!(
        Packet::decode(&bytes, Version::Original),
        Ok(packet(3, command))
    );
    // Any other payload is the number in its first byte; the rest does not matter.
    let bytes = original(3, 4, 9, *b"0001012", 0x42);
    assert_eq!(
        Packet::decode(&bytes, Version::Original),
        Ok(packet(3, command))
    );
    assert_eq!(
        packet(3, command).encode(Version::Original),
        [0x43, 11, 9, 0, 0, 0, 0, 0, 0, 0, 0xFF]
    );
}

#[test]
fn an_undefined_code_reaches_the_board_which_counts_it() {
    let command = SteerCommand { code: 0x0C, seq: 1 };
    assert_eq!(command.command(), None);
    let sent = packet(0, Payload::SteerCommand(command));
    assert_eq!(
        Packet::decode(&sent.encode(Version::One), Version::One),
        Ok(sent)
    );
}
