//! Lines that are not in the grammar, each with the sentence that says what belongs there.

use std::fmt::Display;

use lager_lines::conversation::{RobotLine, StationLine};
use lager_lines::gag::{Answer, Request};
use lager_lines::strings::{Goods, read_map};

/// Reads each line and compares what is said against it.
fn check<T, E: Display>(read: impl Fn(&str) -> Result<T, E>, lines: &[(&str, String)]) {
    for (line, expected) in lines {
        match read(line) {
            Ok(_) => panic!("{line:?} was read"),
            Err(error) => assert_eq!(error.to_string(), *expected, "{line:?}"),
        }
    }
}

fn ends(column: usize, wanted: &str) -> String {
    format!("column {column}: the line ends, but {wanted} belongs here")
}

fn nothing(column: usize, wanted: &str) -> String {
    format!("column {column}: nothing stands here, but {wanted} belongs here")
}

fn word(column: usize, found: &str, wanted: &str) -> String {
    format!("column {column}: {found:?} stands here, but {wanted} belongs here")
}

/// A delivery in a warehouse of 4 x 3 squares.
fn no_corner(column: usize, delivery: &str) -> String {
    format!(
        "column {column}: the delivery is at {delivery}, which is no corner of the floor; \
         its corners are (0, 0), (0, 3), (4, 0) and (4, 3)"
    )
}

fn no_squares(column: usize, size: &str) -> String {
    format!("column {column}: the size is {size} squares; each must be from 1 to 99")
}

fn not_of_arm(column: usize, code: u8) -> String {
    format!(
        "column {column}: {code} is no code of the arm; \
         it has 241 to 250, F1 to FA in hexadecimal"
    )
}

fn not_of_wheels(column: usize, code: u8) -> String {
    format!("column {column}: {code} is no code of the wheels; they have 1 to 9")
}

fn no_code(column: usize, why: &str) -> String {
    format!(
        "column {column}: {why}; \
         write eight binary digits, a decimal number or 0x and hexadecimal"
    )
}

fn no_label(column: usize, label: &str) -> String {
    format!(
        "column {column}: {label} cannot stand for a product; it must have a character \
         and neither comma, semicolon, line break nor a blank at its ends"
    )
}

const TWICE: &str = "goods 7 are listed twice; all goods need a number of their own";
const BUCKET: &str = "a bucket from 0 to 89, above the one before it";
const FRAMES: &str = "how many frames it holds, 1 to 999999";
const END: &str = "the end of the line";
const PRODUCT: &str = "a product's number from 0 to 2147483647";
const NUMBER: &str = "a number from 0 to 4294967295";
const WAY: &str = "left, up, right or down";
const X: &str = "an x from 0 to 255";
const Y: &str = "a y from 0 to 255";
const NAME: &str = "a name of 1 to 32 of a-z, 0-9, - and _";
const CM: &str = "a side of 40 to 500 cm";
const LEASE: &str = "a time from 1 to 1000 ms";
const SPEED: &str = "slow, middle, full or a time from 1 to 1000 ms";
const NO_SPEED: &str = "a time from 1 to 1000 ms (only 2, 4, 6 and 7 have a speed)";
const SQUARE_X: &str = "the x of its square, 0 to 255";
const SERVOS: &str = "a row of eight positions from 0 to 1023 or - with commas between";
const NEW_FIELD: &str = "a field that has not been given yet";
const ANGLE: &str = "an angle from 0 to 359 degrees";
const END_OF_PRODUCT: &str = "the end of the product behind its side";
const END_OF_MAP: &str = "the end of the map behind its fourth number";
const TEXT: &str = "a text without a line break";
const COUNT: &str = "the number of the products that follow";
const DELIVERY_Y: &str = "the y of the delivery, 0 to 255";
const WIDTH: &str = "a width of 1 to 99 squares";
const SIDE: &str = "a side from 0 to 3";
const VERSION: &str = "a version from 1 to 255";
const REQUEST: &str = "one of sidelength, karta, prodlis, prodlist, fetchprod, armcomm, styrcomm, \
                       thought, set_robot and set_heading";
const ANSWER: &str = "one of sidelength, karta, prodlis, prodlist, fetchprod, armcomm, styrcomm \
                      and pickup_done";
const ACTION: &str = "one of order, cancel, first, up, clear, back, mode, resume, reset, place, \
                      picked, pick, drive, arm, gains, calibrate, restart, horn, obstacle and \
                      commission";
const EVENT: &str = "one of in_position, getting_item, item_delivered, next_node, refused, \
                     pickup_refused, failed, way_blocked, stopped, resumed, mode, asked, ended, restarted, \
                     link_lost and link_back";

#[test]
fn requests_that_are_none() {
    for (line, column, found) in [
        ("", 1, ""),
        ("  \t", 4, ""),
        ("Karta", 1, "Karta"),
        ("kärta", 1, "kärta"),
        ("karta,", 1, "karta,"),
        ("  prodlista", 3, "prodlista"),
        ("thoughts x", 1, "thoughts"),
        ("\u{a0}karta", 1, "\u{a0}karta"),
        ("karta\0", 1, "karta\0"),
        ("pickup_done", 1, "pickup_done"),
        (
            "12345678901234567890123456789",
            1,
            "123456789012345678901234",
        ),
    ] {
        let expected = match found {
            "" => ends(column, REQUEST),
            found => word(column, found, REQUEST),
        };
        check(Request::read, &[(line, expected.clone())]);
        check(RobotLine::read, &[(line, expected)]);
    }
    check(
        Request::read,
        &[
            ("karta 1", word(7, "1", END)),
            ("prodlis prodlis", word(9, "prodlis", END)),
            ("set_robot", ends(10, X)),
            ("set_robot 1", ends(12, Y)),
            ("set_robot 1 ", ends(13, Y)),
            ("set_robot 256 0", word(11, "256", X)),
            ("set_robot 0 -1", word(13, "-1", Y)),
            ("set_robot +1 0", word(11, "+1", X)),
            ("set_robot 1,2", word(11, "1,2", X)),
            ("set_robot 1 2 3", word(15, "3", END)),
            ("set_heading", ends(12, WAY)),
            ("set_heading Up", word(13, "Up", WAY)),
            ("set_heading up down", word(16, "down", END)),
            ("thought två\rrader", word(12, "\rrader", TEXT)),
        ],
    );
}

#[test]
fn answers_that_are_none() {
    let lines = [
        ("kartan 1 1 0 0", word(1, "kartan", ANSWER)),
        ("set_robot 1 1", word(1, "set_robot", ANSWER)),
        ("sidelength", ends(11, CM)),
        ("sidelength 39", word(12, "39", CM)),
        ("sidelength 501", word(12, "501", CM)),
        ("sidelength 65536", word(12, "65536", CM)),
        ("sidelength 40cm", word(12, "40cm", CM)),
        ("sidelength 40.5", word(12, "40.5", CM)),
        ("sidelength 40 50", word(15, "50", END)),
        ("karta", ends(6, WIDTH)),
        ("karta 4 3 0", ends(12, Y)),
        ("karta 10000 10000 0 0", word(7, "10000", WIDTH)),
        ("karta 0 0 0 0", no_squares(7, "0 x 0")),
        ("karta  0 5 0 5", no_squares(8, "0 x 5")),
        ("karta 4 3 4 2", no_corner(11, "(4, 2)")),
        ("karta 4 3\t 5 3", no_corner(12, "(5, 3)")),
        ("karta 4 3 0 0 0", word(15, "0", END)),
        ("karta 4,3,0,0", word(7, "4,3,0,0", WIDTH)),
        ("prodlis", ends(8, COUNT)),
        ("prodlist -1", word(10, "-1", COUNT)),
        ("prodlis 1", ends(10, PRODUCT)),
        ("prodlis 65535 1 0 0 up", ends(23, PRODUCT)),
        ("prodlis 0 1 0 0 up", word(11, "1", END)),
        ("prodlis 1 1 0 0", ends(16, WAY)),
        ("prodlis 1 1 0 0 3", word(17, "3", WAY)),
        ("prodlis 1 1 0 0 up 2 0 0 up", word(20, "2", END)),
        ("prodlis 1 skruv 0 0 up", word(11, "skruv", PRODUCT)),
        (
            "prodlis 1 2147483648 0 0 up",
            word(11, "2147483648", PRODUCT),
        ),
        ("prodlis 1 1 256 0 up", word(13, "256", X)),
        (
            "prodlis 3 7 0 0 up 8 0 0 up 7 1 1 left",
            format!("column 29: {TWICE}"),
        ),
        ("fetchprod", ends(10, PRODUCT)),
        ("fetchprod -1", word(11, "-1", PRODUCT)),
        (
            "fetchprod 99999999999999999999",
            word(11, "99999999999999999999", PRODUCT),
        ),
        ("armcomm", no_code(8, "the command code is empty")),
        ("armcomm 1", not_of_arm(9, 1)),
        ("armcomm FB", not_of_arm(9, 251)),
        ("armcomm F0", not_of_arm(9, 240)),
        ("armcomm F1 F2", word(12, "F2", END)),
        ("styrcomm 0", not_of_wheels(10, 0)),
        ("styrcomm 10", not_of_wheels(10, 10)),
        ("styrcomm  F1", not_of_wheels(11, 241)),
        (
            "styrcomm fram",
            no_code(10, "'f' at character 1 is not a digit of a command code"),
        ),
        (
            "styrcomm 300",
            no_code(10, "the command code is larger than 255"),
        ),
        ("pickup_done 7", word(13, "7", END)),
    ];
    check(Answer::read, &lines);
    check(StationLine::read, &lines);
}

#[test]
fn strings_that_are_none() {
    check(
        read_map,
        &[
            ("", ends(1, WIDTH)),
            ("4,3,0", ends(6, DELIVERY_Y)),
            ("4,,0,0", nothing(3, "a height of 1 to 99 squares")),
            ("4,3,0,", ends(7, DELIVERY_Y)),
            ("4 3 0 0", word(1, "4 3 0 0", WIDTH)),
            ("4,3,0,0,0", word(9, "0", END_OF_MAP)),
            ("300,3,0,0", word(1, "300", WIDTH)),
            ("0,3,0,0", no_squares(1, "0 x 3")),
            ("4, 3, 1,0", no_corner(7, "(1, 0)")),
        ],
    );
    check(
        Goods::read,
        &[
            ("7", ends(2, SQUARE_X)),
            ("7,1,0", ends(6, SIDE)),
            ("7,1,0,4", word(7, "4", SIDE)),
            ("7,1,0,up", word(7, "up", SIDE)),
            ("7,1,0,3,9", word(9, "9", END_OF_PRODUCT)),
            ("7,256,0,3", word(3, "256", SQUARE_X)),
            ("å,1,,3", nothing(5, "the y of its square, 0 to 255")),
            ("7,1,0,3;;8,1,0,3", nothing(9, SQUARE_X)),
            ("7,1,0,3;8", ends(10, SQUARE_X)),
            ("7,1,0,3; ,1,0,3", no_label(10, r#""""#)),
            ("a\rb,1,0,3", no_label(1, r#""a\rb""#)),
        ],
    );
    let twice = Goods::read("7,1,0,3;07,1,0,2").expect("goods");
    let error = twice.products().expect_err("one number twice");
    assert_eq!(error.to_string(), TWICE);
}

#[test]
fn lines_of_the_station_that_are_none() {
    check(
        StationLine::read,
        &[
            ("lager", ends(6, VERSION)),
            ("lager 0 x", word(7, "0", VERSION)),
            ("lager 1", ends(8, NAME)),
            ("lager 1 R1", word(9, "R1", NAME)),
            ("lager 1 r1 r2", word(12, "r2", "a time in ms")),
            ("lager 1 r1 7 8", word(14, "8", END)),
            (
                "do 1 resume",
                ends(12, "the number of the stop, as the state tells it"),
            ),
            (
                "do 1 late x clear",
                word(11, "x", "a time from 0 to 4294967295 ms"),
            ),
            ("do", ends(3, NUMBER)),
            ("do x clear", word(4, "x", NUMBER)),
            ("do 1", ends(5, ACTION)),
            ("do 1 stop", word(6, "stop", ACTION)),
            ("do 1 order 4", ends(13, PRODUCT)),
            ("do 1 order -1 7", word(12, "-1", NUMBER)),
            ("do 1 clear 4", word(12, "4", END)),
            ("do 1 mode auto", word(11, "auto", "manual or autonomous")),
            (
                "do 1 picked up",
                word(13, "up", "force or the end of the line"),
            ),
            ("do 1 drive 2", ends(13, LEASE)),
            ("do 1 drive 2 0", word(14, "0", LEASE)),
            ("do 1 drive 2 1001", word(14, "1001", LEASE)),
            ("do 1 drive 2 quick 150", word(14, "quick", SPEED)),
            ("do 1 drive 2 slow", ends(18, LEASE)),
            (
                "do 1 drive 2 150 slow",
                word(18, "slow", "the end of the line"),
            ),
            ("do 1 drive 3 slow 150", word(14, "slow", NO_SPEED)),
            ("do 1 drive 1 full 150", word(14, "full", NO_SPEED)),
            ("do 1 drive 10 100", not_of_wheels(12, 10)),
            ("do 1 arm 2", not_of_arm(10, 2)),
            ("do 1 gains 256 0", word(12, "256", "a gain from 0 to 255")),
            ("do 1 obstacle 1 2 up", word(15, "1", "put or take")),
            ("do 1 obstacle put 1 2", ends(22, WAY)),
            ("do 1 place 1 2", ends(15, WAY)),
        ],
    );
}

#[test]
fn lines_of_the_robot_that_are_none() {
    check(
        RobotLine::read,
        &[
            ("stopped 1", ends(10, "a time from 0 to 4294967295 ms")),
            ("done", ends(5, NUMBER)),
            ("done 1 2", word(8, "2", END)),
            ("refused x", word(9, "x", NUMBER)),
            ("state x_mm", word(7, "x_mm", "a field such as x_mm=400")),
            ("state x_mm=", ends(12, "a way in mm")),
            ("state x_mm= y_mm=0", nothing(12, "a way in mm")),
            ("state x_mm=4.0", word(12, "4.0", "a way in mm")),
            ("state x_mm=+4", word(12, "+4", "a way in mm")),
            ("state x_mm=1 x_mm=1", word(14, "x_mm", NEW_FIELD)),
            ("state heading_deg=360", word(19, "360", ANGLE)),
            ("state node=1", word(12, "1", "a node such as 2,1")),
            ("state looks=north", word(13, "north", WAY)),
            ("state stopped=2", word(15, "2", "0 or 1")),
            (
                "state line_bits=0101",
                word(17, "0101", "a row of eleven digits of 0 and 1"),
            ),
            (
                "state code=9",
                word(12, "9", "a row of eight digits of 0 and 1"),
            ),
            ("state servos=1,2", word(14, "1,2", SERVOS)),
            ("route", ends(6, "their number from 0 to 4294967295")),
            ("route 1 1 0 2 0", word(13, "2", END)),
            ("route 2 1", ends(10, Y)),
            ("blocked 1 2 0", ends(14, WAY)),
            ("queue 1 4", ends(10, PRODUCT)),
            ("queue 1 x 4", word(9, "x", "an order from 0 to 4294967295")),
            ("event", ends(6, EVENT)),
            ("event lunch 1 0 - -", word(7, "lunch", EVENT)),
            ("event failed 1 0", ends(17, NUMBER)),
            ("event failed 1 0 -", ends(19, PRODUCT)),
            ("latency", ends(8, "a time from 0 to 4294967295 us")),
            ("latency 1 90 1", word(11, "90", BUCKET)),
            ("latency 1 7 2 7 1", word(15, "7", BUCKET)),
            ("latency 1 7", ends(12, FRAMES)),
            ("latency 1 7 0", word(13, "0", FRAMES)),
            ("latency 1 7 1000000", word(13, "1000000", FRAMES)),
            ("truth 1 2 360 -", word(11, "360", ANGLE)),
            ("truth 1 2 3", ends(12, PRODUCT)),
            ("sensors", ends(8, "a reading from 0 to 255")),
            (
                "sensors 1 2 256",
                word(13, "256", "a reading from 0 to 255"),
            ),
            ("sensors 1 2 3 2", word(15, "2", "0 or 1")),
            ("sensors 1 2 3 1", ends(16, "a reading from 0 to 255")),
        ],
    );
}
