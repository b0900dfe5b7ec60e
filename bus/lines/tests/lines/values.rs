//! The values that lines carry, and what cannot be one.

use lager_floor::{Heading, Node, ProductId};
use lager_lines::command::{CommandError, read_arm, read_wheels};
use lager_lines::strings::Good;
use lager_lines::{Name, NameError, Text, TextError, TooLong, to_line};
use lager_orders::Wheels;
use lager_wire::{CodeTextError, OperatorCommand};

#[test]
fn texts_have_no_line_breaks_and_names_few_characters() {
    assert_eq!(
        Text::new("två\nrader"),
        Err(TextError::LineBreak { column: 4 })
    );
    assert_eq!(Text::new("\r"), Err(TextError::LineBreak { column: 1 }));
    assert_eq!(
        Text::new("\u{1b}[31m").map(|text| text.to_string()),
        Ok("\u{1b}[31m".into())
    );
    assert_eq!(Name::new(""), Err(NameError::Length { length: 0 }));
    assert_eq!(
        Name::new("a".repeat(33)),
        Err(NameError::Length { length: 33 })
    );
    let found = 'å';
    assert_eq!(
        Name::new("robot-å"),
        Err(NameError::Character { column: 7, found })
    );
    assert_eq!(
        Name::new("r-1_x").map(|name| name.to_string()),
        Ok("r-1_x".into())
    );
}

#[test]
fn labels_of_goods_do_not_break_their_string() {
    let square = Node { x: 0, y: 0 };
    for label in ["", "a,b", "a;b", "a\nb", " a", "a\t"] {
        let error = Good::new(label, square, Heading::Left).expect_err(label);
        assert_eq!(error.label, label);
    }
    let named = Good::new("röda skruvar", square, Heading::Left).expect("a label");
    assert_eq!((named.label(), named.id()), ("röda skruvar", None));
    let numbered = Good::new("12", square, Heading::Left).expect("a label");
    assert_eq!(numbered.id(), ProductId::new(12));
}

#[test]
fn every_code_is_read_in_each_form_and_no_other_code_in_any() {
    for code in 0..=255_u8 {
        let command = OperatorCommand::from_code(code);
        let mut forms = vec![
            format!("{code}"),
            format!("{code:08b}"),
            format!("0x{code:X}"),
            format!("0X{code:02x}"),
        ];
        if code >= 0xF0 {
            forms.push(format!("{code:X}"));
            forms.push(format!("{code:x}"));
        }
        for text in forms {
            let wheels = read_wheels(&text).map(OperatorCommand::from);
            let arm = read_arm(&text).map(OperatorCommand::Arm);
            match command {
                Some(OperatorCommand::Arm(_)) => {
                    assert_eq!(arm.ok(), command, "{text}");
                    assert_eq!(wheels, Err(CommandError::NotOfWheels { code }), "{text}");
                }
                Some(_) => {
                    assert_eq!(wheels.ok(), command, "{text}");
                    assert_eq!(arm, Err(CommandError::NotOfArm { code }), "{text}");
                }
                None => {
                    assert_eq!(wheels, Err(CommandError::NotOfWheels { code }), "{text}");
                    assert_eq!(arm, Err(CommandError::NotOfArm { code }), "{text}");
                }
            }
        }
    }
}

#[test]
fn what_has_no_form_is_no_code() {
    let not = |found, position| CommandError::Text(CodeTextError::NotADigit { found, position });
    for (text, error) in [
        ("", CommandError::Text(CodeTextError::Empty)),
        ("0x", CommandError::Text(CodeTextError::Empty)),
        ("256", CommandError::Text(CodeTextError::TooLarge)),
        ("0x100", CommandError::Text(CodeTextError::TooLarge)),
        ("111110011", CommandError::Text(CodeTextError::TooLarge)),
        ("E1", not('E', 0)),
        ("FG", not('F', 0)),
        ("FA1", not('F', 0)),
        ("F", not('F', 0)),
        ("-1", not('-', 0)),
        ("+1", not('+', 0)),
        ("1.0", not('.', 1)),
        ("٣", not('٣', 0)),
    ] {
        assert_eq!(read_wheels(text).map(|_| ()), Err(error), "{text:?}");
        assert_eq!(read_arm(text).map(|_| ()), Err(error), "{text:?}");
    }
}

#[test]
fn a_command_of_the_arm_is_none_of_the_wheels() {
    for command in OperatorCommand::ALL {
        let is_of_arm = matches!(command, OperatorCommand::Arm(_));
        assert_eq!(Wheels::new(command).is_none(), is_of_arm, "{command:?}");
    }
}

#[test]
fn what_does_not_fit_in_a_line_is_refused_with_its_length() {
    let text = "å".repeat(512);
    assert_eq!(to_line(&text).map(|line| line.len()), Ok(1025));
    assert_eq!(to_line(&format!("{text}!")), Err(TooLong { length: 1025 }));
    assert_eq!(
        to_line(&format!("{text}!"))
            .expect_err("too long")
            .to_string(),
        "this would be a line of 1025 bytes; at most 1024 are allowed, so say less"
    );
}
