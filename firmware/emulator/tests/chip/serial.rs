//! The USARTs behave as the datasheet says.

use std::cell::RefCell;
use std::rc::Rc;

use lager_emulator::chip::{Chip, Sent, UsartId};

use crate::support::{START, chip, milliseconds, noted};

/// Cycles of a bit and of a byte at 500 000 Bd.
const BIT: u64 = 32;
const BYTE: u64 = 320;

fn listen(chip: &Chip, usart: UsartId) -> Rc<RefCell<Vec<Sent>>> {
    let sent: Rc<RefCell<Vec<Sent>>> = Rc::default();
    let log = Rc::clone(&sent);
    chip.on_sent(usart, move |frame| log.borrow_mut().push(frame));
    sent
}

fn send(chip: &Chip, bytes: &[u8]) {
    for (index, &byte) in bytes.iter().enumerate() {
        let from = chip.cycle() + index as u64 * BYTE;
        chip.send_to(UsartId::Zero, from, byte, BIT as f64);
    }
}

#[test]
fn a_byte_takes_ten_bits_and_leaves_when_its_last_stop_bit_is_over() {
    let chip = chip("uart.c", "leaves");
    let sent = listen(&chip, UsartId::Zero);
    chip.run_until(START + milliseconds(1));
    let sent = sent.borrow();
    // The program wrote 0x99 while the transmitter was off, as it is after a reset.
    let bytes: Vec<_> = sent.iter().map(|frame| frame.byte).collect();
    assert_eq!(bytes, [0x11, 0x22]);
    assert_eq!(sent[0].to - sent[0].from, BYTE);
    assert_eq!(sent[1].from, sent[0].to, "back to back");
    assert_eq!(sent[1].to - sent[1].from, BYTE);
    assert_eq!(sent[0].bit, BIT);
}

#[test]
fn a_byte_is_received_in_the_middle_of_its_stop_bit() {
    let chip = chip("uart.c", "received");
    chip.run_until(START + milliseconds(1));
    let sent = listen(&chip, UsartId::Zero);
    let from = chip.cycle() + 100;
    chip.send_to(UsartId::Zero, from, 0x41, BIT as f64);
    chip.run_until(from + milliseconds(1));
    let sent = sent.borrow();
    assert_eq!(sent[0].byte, 0x42);
    // Nine bits and ten sixteenths of one, eight cycles of entry from sleep, three of the jump at
    // the vector, and the handler's first instructions.
    let answered = sent[0].from - from - (9 * BIT + 20);
    assert!((11..60).contains(&answered), "{answered} cycles");
}

#[test]
fn the_fourth_unread_byte_destroys_the_third() {
    let chip = chip("overrun.c", "four");
    chip.run_until(START + milliseconds(1));
    send(&chip, &[1, 2, 3, 4]);
    chip.run_until(chip.cycle() + milliseconds(4));
    assert_eq!(chip.overruns(UsartId::Zero), 1);
    let data_overrun = 0x08;
    assert_eq!(noted(&chip, 7), [3, 0, 1, 0, 2, data_overrun, 4]);
}

#[test]
fn three_unread_bytes_are_kept() {
    let chip = chip("overrun.c", "three");
    chip.run_until(START + milliseconds(1));
    send(&chip, &[1, 2, 3]);
    chip.run_until(chip.cycle() + milliseconds(4));
    assert_eq!(chip.overruns(UsartId::Zero), 0);
    assert_eq!(noted(&chip, 7), [3, 0, 1, 0, 2, 0, 3]);
}

#[test]
fn a_byte_at_another_speed_is_a_framing_error() {
    let chip = chip("overrun.c", "speed");
    chip.run_until(START + milliseconds(1));
    chip.send_to(UsartId::Zero, chip.cycle(), 0x55, 16_000_000.0 / 9_600.0);
    chip.run_until(chip.cycle() + milliseconds(4));
    let framing_error = 0x10;
    assert_eq!(noted(&chip, 3), [1, framing_error, 0]);
}

#[test]
fn interrupts_come_again_while_their_level_holds() {
    let chip = chip("levels.c", "levels");
    chip.run_until(START + milliseconds(1) / 2);
    // Both bytes arrive before the program turns on its interrupts.
    send(&chip, &[7, 8]);
    chip.run_until(START + milliseconds(3));
    assert_eq!(noted(&chip, 4), [5, 2, 7, 8]);
}

#[test]
fn a_board_hears_itself_on_a_shared_wire_unless_it_mutes_its_receiver() {
    let chip = chip("duplex.c", "duplex");
    chip.tie(UsartId::One);
    let sent = listen(&chip, UsartId::One);
    chip.run_until(START + milliseconds(1));
    assert_eq!(sent.borrow().len(), 3);
    assert_eq!(sent.borrow()[0].to - sent.borrow()[0].from, 160, "1 Mbit/s");
    assert_eq!(noted(&chip, 3), [2, 1, 3]);
}
