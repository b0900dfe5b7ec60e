//! The wiring page and its drawing are those that the tables make, and the tables fit the chip.

use std::path::Path;

use lager_pins::{Connection, Pin, Port, Start, Way, page, pi, sensor, steering};

const BOARDS: [(&str, &[Connection]); 2] =
    [("sensor", &sensor::TABLE), ("steering", &steering::TABLE)];

#[test]
fn the_page_and_the_drawing_are_made_from_the_tables() {
    let firmware = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    for (path, expected) in page::files(firmware).expect("a page with its places") {
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        let command = page::COMMAND;
        assert!(
            found == expected,
            "{} is not what the tables of pins make; `{command}` makes it again",
            path.display()
        );
    }
}

#[test]
fn the_drawing_has_every_wire_of_the_tables() {
    let drawing = page::drawing();
    for (board, table) in BOARDS {
        for row in table {
            let Pin { port, bit } = row.pin;
            let pin = format!(">P{}{bit}</tspan>", port.letter());
            assert!(drawing.contains(&pin), "{board}: {pin}");
            let wire = row.wire.trim_start_matches("ExDe ");
            assert!(
                drawing.contains(&format!(">{wire}</text>")),
                "{board}: {wire}"
            );
        }
    }
    // Longer words would reach over their places.
    for row in BOARDS.iter().flat_map(|(_, table)| *table) {
        let (wire, note) = (row.wire.chars().count(), row.to.note.chars().count());
        assert!(wire <= 20 && note <= 30, "{row:?}");
    }
    let pins = drawing.matches("\"name\">P").count();
    assert_eq!(pins, sensor::TABLE.len() + steering::TABLE.len());
    for button in pi::BUTTONS {
        assert!(drawing.contains(&format!(">GPIO {}</tspan>", button.line)));
    }
}

/// The alternate functions of the ATmega1284P's pins that the boards use (data sheet, alternate port
/// functions).
const FUNCTIONS: [(&str, Port, u8); 17] = [
    ("ADC0", Port::A, 0),
    ("ADC1", Port::A, 1),
    ("INT2", Port::B, 2),
    ("MOSI", Port::B, 5),
    ("MISO", Port::B, 6),
    ("SCK", Port::B, 7),
    ("TCK", Port::C, 2),
    ("TMS", Port::C, 3),
    ("TDO", Port::C, 4),
    ("TDI", Port::C, 5),
    ("RXD0", Port::D, 0),
    ("TXD0", Port::D, 1),
    ("INT0", Port::D, 2),
    ("RXD1", Port::D, 2),
    ("TXD1", Port::D, 3),
    ("OC2B", Port::D, 6),
    ("OC2A", Port::D, 7),
];

#[test]
fn each_pin_is_connected_once_and_has_the_function_that_the_chip_gives_it() {
    for (board, table) in BOARDS {
        for (place, row) in table.iter().enumerate() {
            let again = table[..place].iter().any(|other| other.pin == row.pin);
            assert!(!again, "{board}: {:?} has two rows", row.pin);
            let Some(function) = row.function else {
                continue;
            };
            let place = (function, row.pin.port, row.pin.bit);
            assert!(FUNCTIONS.contains(&place), "{board}: {place:?}");
        }
    }
    let mut on_case: Vec<u8> = Port::ALL
        .into_iter()
        .flat_map(|port| (0..8).map(move |bit| Pin::new(port, bit).on_case()))
        .collect();
    on_case.sort_unstable();
    // Supply, ground, reset and crystal have the other eight.
    let expected = (1..=8).chain(14..=29).chain(33..=40);
    assert!(on_case.into_iter().eq(expected));
}

#[test]
fn each_wire_between_the_boards_has_an_output_at_one_end_and_an_input_at_the_other() {
    let of_sensor: Vec<_> = sensor::TABLE
        .iter()
        .filter(|row| row.to == sensor::STEERING)
        .collect();
    let of_steering: Vec<_> = steering::TABLE
        .iter()
        .filter(|row| row.to == steering::SENSOR)
        .collect();
    assert_eq!((of_sensor.len(), of_steering.len()), (3, 3));
    for row in of_sensor {
        let other = of_steering.iter().find(|other| other.wire == row.wire);
        let ways = other.map(|other| (row.way, other.way));
        assert!(
            matches!(ways, Some((Way::Out, Way::In) | (Way::In, Way::Out))),
            "{}: {ways:?}",
            row.wire
        );
    }
}

#[test]
fn a_board_starts_with_its_outputs_low_and_pulls_up_what_nothing_is_connected_with() {
    // Registers of the images that drove the first robots.
    let start = |table: &[Connection]| {
        Port::ALL.map(|port| {
            let Start { port, direction } = Start::of(table, port);
            (port, direction)
        })
    };
    let expected = [
        (0b1111_1100, 0),
        (0, 0b0001_1111),
        (0b1100_0011, 0),
        (0b1100_1011, 0b0011_0000),
    ];
    assert_eq!(start(&sensor::TABLE), expected);
    let expected = [
        (0b1111_1110, 0),
        (0b0001_1000, 0b0000_0010),
        (0b1100_0000, 0b0000_0011),
        (0b0011_0011, 0b1100_0000),
    ];
    assert_eq!(start(&steering::TABLE), expected);
}
