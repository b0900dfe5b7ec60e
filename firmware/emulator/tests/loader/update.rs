//! A board gets a new image.

use std::time::Duration;

use lager_loader::{
    BOOT_SECTION, Client, Image, Line, LoaderError, PAGE, UpdateError, ask, enter, fuses, update,
    write,
};
use lager_wire::{BUILD, Callsign, ResetCause};

use crate::support::{Bench, image, other};

const BOARDS: [Callsign; 2] = [Callsign::Sensor, Callsign::Steering];
const LONG: Duration = Duration::from_secs(5);

fn other_board(board: Callsign) -> Callsign {
    if board == Callsign::Sensor {
        Callsign::Steering
    } else {
        Callsign::Sensor
    }
}

/// The application's part of a board's flash.
fn application(bench: &Bench) -> Vec<u8> {
    bench.chip.flash()[..BOOT_SECTION as usize].to_vec()
}

#[test]
fn a_running_board_gets_an_image_and_tells_its_number() {
    for role in BOARDS {
        let image = image(role);
        let mut bench = Bench::new(role, Some(&image));
        let up = ask(&mut bench, LONG).unwrap().expect("it runs");
        assert_eq!((up.callsign, up.build), (role, BUILD));
        assert_eq!(up.reset, ResetCause::PowerOn, "through the loader");
        let eeprom: Vec<u8> = (0..=255).cycle().take(4_096).collect();
        bench.chip.set_eeprom(&eeprom);
        let before = bench.boot_section();
        update(&mut bench, &image, |_| ()).unwrap();
        assert_eq!(application(&bench)[..image.bytes().len()], *image.bytes());
        assert!(bench.boot_section() == before);
        assert!(bench.chip.eeprom(4_096) == eeprom, "settings stay");
        let up = ask(&mut bench, LONG).unwrap().expect("it runs");
        assert_eq!(up.reset, ResetCause::Ordered);
        assert_eq!(bench.chip.refused_spm(), 0);
    }
}

#[test]
fn a_board_without_an_application_waits_for_one() {
    let role = Callsign::Steering;
    let mut bench = Bench::new(role, None);
    bench.run(Duration::from_secs(20));
    assert!(ask(&mut bench, LONG).unwrap().is_none());
    update(&mut bench, &image(role), |_| ()).unwrap();
}

#[test]
fn the_image_of_the_other_board_is_refused_before_anything_is_erased() {
    for role in BOARDS {
        let wrong = image(other_board(role));
        let own = image(role);
        for application_before in [Some(&own), None] {
            let mut bench = Bench::new(role, application_before);
            let before = bench.chip.flash();
            let told = match update(&mut bench, &wrong, |_| ()) {
                Err(error @ UpdateError::OtherBoard { image, board }) => {
                    assert_eq!((image, board), (wrong.role(), role));
                    error.to_string()
                }
                end => panic!("{end:?}"),
            };
            assert!(
                told.contains("sensor") && told.contains("steering"),
                "{told}"
            );
            // A program that does not look at roles, as avrdude.
            let waits = enter(&mut bench, role);
            assert!(waits.is_ok(), "{waits:?}");
            let mut client = Client::find(&mut bench, LONG).unwrap().unwrap();
            for (address, page) in [(0, 0..256), (256, 256..512), (512, 512..700)] {
                let refused = client.write_page(address, &wrong.bytes()[page]);
                assert!(
                    matches!(refused, Err(LoaderError::Refused { .. })),
                    "{refused:?}"
                );
            }
            assert!(bench.chip.flash() == before);
        }
    }
}

#[test]
fn pages_of_the_boot_section_are_refused_and_an_image_of_the_full_size_is_not() {
    let role = Callsign::Sensor;
    let mut bench = Bench::new(role, None);
    let before = bench.boot_section();
    // Each page begins with its own number.
    let mut bytes = vec![0; BOOT_SECTION as usize];
    for (number, page) in bytes.chunks_mut(PAGE).enumerate() {
        page[..2].copy_from_slice(&(number as u16).to_le_bytes());
    }
    let image = Image::from_bytes(crate::support::stamped(bytes, role, 1)).unwrap();
    write(&mut bench, &image, |_| ()).unwrap();
    assert!(application(&bench) == *image.bytes());
    bench.power();
    let mut client = Client::find(&mut bench, LONG).unwrap().unwrap();
    assert!(client.is_whole().unwrap());
    client.write_page(0, &image.bytes()[..PAGE]).unwrap();
    for address in (BOOT_SECTION..0x2_0000).step_by(PAGE) {
        let refused = client.write_page(address, &[0; PAGE]);
        assert!(
            matches!(refused, Err(LoaderError::Refused { .. })),
            "{refused:?}"
        );
    }
    assert!(bench.boot_section() == before);
    assert_eq!(bench.chip.refused_spm(), 0, "it does not even try");
}

#[test]
fn commands_of_an_isp_programmer_are_answered_and_change_nothing() {
    let image = image(Callsign::Sensor);
    let mut bench = Bench::new(Callsign::Sensor, Some(&image));
    let before = bench.chip.flash();
    Client::find(&mut bench, LONG)
        .unwrap()
        .expect("after power-on");
    for (order, expected) in [
        // Extended address, erasure of the chip, and something unknown.
        ([0x4D, 0x00, 0x01, 0x00], 0),
        ([0xAC, 0x80, 0x00, 0x00], 0),
        ([0x99, 0x99, 0x99, 0x99], 0),
        ([0x50, 0x00, 0x00, 0x00], 0xF7),
        ([0x58, 0x08, 0x00, 0x00], 0x92),
        ([0x50, 0x08, 0x00, 0x00], 0xFC),
        ([0x58, 0x00, 0x00, 0x00], 0xEF),
    ] {
        bench.take();
        bench
            .send(&[0x56, order[0], order[1], order[2], order[3], 0x20])
            .unwrap();
        bench.run(Duration::from_millis(2));
        assert_eq!(bench.take(), [0x14, expected, 0x10], "{order:02x?}");
    }
    // A command that there is not, and one without its end.
    for (bytes, answer) in [
        ([0x4E, 0x20].as_slice(), [0x14, 0x12].as_slice()),
        (&[0x30, 0x99], &[0x15]),
    ] {
        bench.send(bytes).unwrap();
        bench.run(Duration::from_millis(2));
        assert_eq!(bench.take(), answer);
    }
    assert!(bench.chip.flash() == before);
}

#[test]
fn success_is_told_only_by_the_image_that_was_written() {
    let role = Callsign::Sensor;
    let image = image(role);
    // Its header says another build number than its program.
    let bytes = crate::support::stamped(image.bytes().to_vec(), role, BUILD + 1);
    let wrong = Image::from_bytes(bytes).unwrap();
    let mut bench = Bench::new(role, Some(&image));
    match update(&mut bench, &wrong, |_| ()) {
        Err(UpdateError::OtherBuild { expected, told, .. }) => {
            assert_eq!((expected, told), (BUILD + 1, BUILD));
        }
        end => panic!("{end:?}"),
    }
    // This one never says anything.
    let silent = other(&image, 7);
    match update(&mut bench, &silent, |_| ()) {
        Err(UpdateError::NotStarted(7, board)) => assert_eq!(board, role),
        end => panic!("{end:?}"),
    }
}

#[test]
fn the_fuses_are_those_of_the_readme() {
    let readme = include_str!("../../../avr/README.md");
    let told = |name: &str| {
        let row = readme
            .lines()
            .find_map(|line| line.strip_prefix(&format!("| {name} | 0x")));
        let digits = row.and_then(|row| row.get(..2)).expect("the table has it");
        u8::from_str_radix(digits, 16).expect("it is a number")
    };
    for role in BOARDS {
        let fuses = Bench::new(role, None).chip.fuses();
        let found = [fuses.low, fuses.high, fuses.extended, fuses.lock];
        assert_eq!(found, ["low", "high", "extended", "lock"].map(told));
        assert_eq!(
            found,
            [fuses::LOW, fuses::HIGH, fuses::EXTENDED, fuses::LOCK]
        );
    }
    // `lager board flash` writes these, so no document has commands of its own.
    assert!(!readme.contains("fuse:w:"));
}
