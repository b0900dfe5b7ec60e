//! Keeps settings without power: two copies in EEPROM, each with a check value.
//!
//! ```text
//!   address   0        1         2 .. 2+N    2+N          the second copy the same, 32 later
//!             layout   counter   settings    CRC-8 over everything before it
//!
//!   save: layout = 255 --> counter, settings, CRC --> layout      into the older copy
//! ```
//!
//! A copy is valid if its layout and its check value are right; of two valid ones the later counter
//! wins. A save clears the layout byte first and writes it last, so that a save that is cut off
//! leaves the other copy valid. The chip needs some milliseconds for a byte: every step hands over
//! at most one, and nothing waits. Each store of a board has a [`Place`] of its own.
//!
//! What was in force before the last save can be had back. Then both copies hold it, so that having
//! it back twice changes nothing.

use lager_wire::checksum;

use crate::Board;

/// The layout of the settings. A program with another layout starts with its defaults.
const LAYOUT: u8 = 1;
/// What an erased EEPROM holds.
const ERASED: u8 = 0xFF;
/// Where the second copy begins, from a store's beginning.
const SECOND: u8 = 32;
/// The most bytes of settings, so that a copy with layout, counter and check value fits its half.
const LONGEST: usize = 12;
/// A copy of the longest settings.
const COPY: usize = LONGEST + 3;

/// Where a store begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Place {
    /// What the board has learnt or a person has set: thresholds or gains.
    Settings = 0,
    /// What the Pi has told of the robot.
    Robot = 2 * SECOND,
    /// How much the motors differ, which only the steering board learns.
    Sides = 4 * SECOND,
}

const _: () = assert!(Place::Sides as u8 + 2 * SECOND == crate::EEPROM_LENGTH);

/// A running save: the copy's bytes, and the index of the next one.
#[derive(Debug, Clone)]
struct Save {
    copy: [u8; COPY],
    next: u8,
}

/// The settings in EEPROM, `N` bytes.
#[derive(Debug, Clone)]
pub(crate) struct Store<const N: usize> {
    /// The settings in force in EEPROM, or in force when the save is done.
    kept: Option<[u8; N]>,
    /// What was in force before that.
    before: Option<[u8; N]>,
    /// The same settings are saved once more when the save is done.
    twice: bool,
    counter: u8,
    place: Place,
    /// The address that the next save writes to.
    slot: u8,
    save: Option<Save>,
}

impl<const N: usize> Store<N> {
    /// Opens the store. Also returns the settings that it found, if any are valid.
    pub(crate) fn load(board: &impl Board, place: Place) -> (Self, Option<[u8; N]>) {
        const { assert!(N <= LONGEST) };
        let base = place as u8;
        let first = read(board, base);
        let second = read(board, base + SECOND);
        let second_wins = match (&first, &second) {
            (Some((first, _)), Some((second, _))) => second.wrapping_sub(*first) < 128,
            (None, Some(_)) => true,
            (_, None) => false,
        };
        let (newest, older) = match second_wins {
            true => (second, first),
            false => (first, second),
        };
        let kept = newest.map(|(_, settings)| settings);
        let store = Self {
            kept,
            before: older.map(|(_, settings)| settings),
            twice: false,
            counter: newest.map_or(0, |(counter, _)| counter),
            place,
            slot: if second_wins || newest.is_none() {
                base
            } else {
                base + SECOND
            },
            save: None,
        };
        (store, kept)
    }

    /// Begins to save; settings that the EEPROM holds already are not written again.
    pub(crate) fn save(&mut self, settings: [u8; N]) {
        if self.kept == Some(settings) {
            return;
        }
        if self.save.is_none() {
            self.before = self.kept;
        }
        self.twice = false;
        self.begin(settings);
    }

    /// Begins to save what was in force before the last save, and returns it; `usual` is what was in
    /// force before the first one.
    pub(crate) fn restore(&mut self, usual: [u8; N]) -> [u8; N] {
        let Some(kept) = self.kept else {
            return usual;
        };
        let before = self.before.unwrap_or(usual);
        self.before = Some(before);
        if before != kept {
            self.twice = true;
            self.begin(before);
        }
        before
    }

    fn begin(&mut self, settings: [u8; N]) {
        if self.save.is_none() {
            self.counter = self.counter.wrapping_add(1);
        }
        let mut copy = [0; COPY];
        copy[0] = LAYOUT;
        copy[1] = self.counter;
        copy[2..2 + N].copy_from_slice(&settings);
        copy[2 + N] = checksum(&copy[..2 + N]);
        self.kept = Some(settings);
        self.save = Some(Save { copy, next: 0 });
    }

    /// Hands over the next byte if a save runs and the EEPROM is free.
    pub(crate) fn poll(&mut self, board: &mut impl Board) {
        let Some(save) = &mut self.save else { return };
        let last = N as u8 + 3;
        let (address, value) = match save.next {
            0 => (0, ERASED),
            next if next == last => (0, LAYOUT),
            next => (next, save.copy[usize::from(next)]),
        };
        if !board.eeprom_write(self.slot + address, value) {
            return;
        }
        save.next += 1;
        if save.next > last {
            let base = self.place as u8;
            self.slot = base + (base + SECOND - self.slot);
            self.save = None;
            if core::mem::take(&mut self.twice)
                && let Some(kept) = self.kept
            {
                self.begin(kept);
            }
        }
    }

    /// The settings in force in EEPROM, or in force when the save is done; `None` if there were
    /// never any.
    pub(crate) fn kept(&self) -> Option<[u8; N]> {
        self.kept
    }

    /// Whether a save is under way.
    pub(crate) fn is_saving(&self) -> bool {
        self.save.is_some()
    }
}

/// The counter and the settings of the copy at `slot`, if it is valid.
fn read<const N: usize>(board: &impl Board, slot: u8) -> Option<(u8, [u8; N])> {
    let mut copy = [0; COPY];
    for (byte, address) in copy.iter_mut().zip(slot..).take(N + 3) {
        *byte = board.eeprom_read(address);
    }
    let counts = copy[0] == LAYOUT && copy[2 + N] == checksum(&copy[..2 + N]);
    let settings = copy[2..].first_chunk().copied()?;
    counts.then_some((copy[1], settings))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lager_wire::{ResetCause, ResetOrder};

    /// An EEPROM that accepts every `slow`-th write.
    struct Chip {
        bytes: [u8; crate::EEPROM_LENGTH as usize],
        slow: usize,
        asked: usize,
        writes: usize,
    }

    impl Chip {
        fn erased() -> Self {
            Self {
                bytes: [ERASED; crate::EEPROM_LENGTH as usize],
                slow: 1,
                asked: 0,
                writes: 0,
            }
        }
    }

    impl Board for Chip {
        fn now_us(&self) -> u32 {
            0
        }
        fn uart_read(&mut self) -> Option<u8> {
            None
        }
        fn uart_write(&mut self, _: &[u8]) -> bool {
            false
        }
        fn uart_idle(&self) -> bool {
            true
        }
        fn reset_cause(&self) -> ResetCause {
            ResetCause::Unknown
        }
        fn reset(&mut self, _: ResetOrder) {}
        fn kick_watchdog(&mut self) {}
        fn eeprom_read(&self, address: u8) -> u8 {
            self.bytes[usize::from(address)]
        }
        fn eeprom_write(&mut self, address: u8, value: u8) -> bool {
            self.asked += 1;
            let takes = self.asked.is_multiple_of(self.slow);
            if takes {
                self.writes += 1;
                self.bytes[usize::from(address)] = value;
            }
            takes
        }
    }

    fn loaded(chip: &Chip) -> Option<[u8; 3]> {
        Store::load(chip, Place::Settings).1
    }

    fn finish(store: &mut Store<3>, chip: &mut Chip) {
        while store.is_saving() {
            store.poll(chip);
        }
    }

    #[test]
    fn the_stores_do_not_touch_each_other() {
        let mut chip = Chip::erased();
        for round in 0..4 {
            for place in [Place::Settings, Place::Robot, Place::Sides] {
                let settings = [round, place as u8, 7];
                let (mut store, before) = Store::load(&chip, place);
                let kept = [round.wrapping_sub(1), place as u8, 7];
                assert_eq!(before, (round > 0).then_some(kept));
                store.save(settings);
                finish(&mut store, &mut chip);
            }
        }
    }

    #[test]
    fn an_erased_eeprom_holds_nothing() {
        assert_eq!(loaded(&Chip::erased()), None);
    }

    #[test]
    fn what_was_saved_is_loaded_however_slow_the_eeprom_is() {
        for slow in [1, 3] {
            let mut chip = Chip::erased();
            chip.slow = slow;
            for round in 0..600_u16 {
                let settings = [round as u8, (round >> 8) as u8, 255];
                let (mut store, _) = Store::load(&chip, Place::Settings);
                store.save(settings);
                finish(&mut store, &mut chip);
                assert_eq!(loaded(&chip), Some(settings), "round {round}");
            }
        }
    }

    #[test]
    fn a_save_cut_off_anywhere_leaves_the_one_before() {
        for cut in 0..=7 {
            let mut chip = Chip::erased();
            let (mut store, _) = Store::load(&chip, Place::Settings);
            for settings in [[1, 2, 3], [4, 5, 6], [7, 8, 9]] {
                store.save(settings);
                finish(&mut store, &mut chip);
            }
            store.save([9, 9, 9]);
            for _ in 0..cut {
                store.poll(&mut chip);
            }
            let expected = if cut < 7 { [7, 8, 9] } else { [9, 9, 9] };
            assert_eq!(loaded(&chip), Some(expected), "cut after {cut}");
        }
    }

    #[test]
    fn a_damaged_copy_gives_way_to_the_other() {
        let mut chip = Chip::erased();
        let (mut store, _) = Store::load(&chip, Place::Settings);
        for settings in [[1, 2, 3], [4, 5, 6]] {
            store.save(settings);
            finish(&mut store, &mut chip);
        }
        let whole = chip.bytes;
        for slot in [0, SECOND] {
            for byte in 0..6 {
                for bit in 0..8 {
                    chip.bytes = whole;
                    chip.bytes[usize::from(slot + byte)] ^= 1 << bit;
                    let other = if slot == 0 { [4, 5, 6] } else { [1, 2, 3] };
                    assert_eq!(loaded(&chip), Some(other), "slot {slot} byte {byte}");
                }
            }
        }
    }

    #[test]
    fn the_same_settings_are_not_written_again() {
        let mut chip = Chip::erased();
        let (mut store, _) = Store::load(&chip, Place::Settings);
        store.save([1, 2, 3]);
        finish(&mut store, &mut chip);
        let (mut store, _) = Store::load(&chip, Place::Settings);
        store.save([1, 2, 3]);
        assert!(!store.is_saving());
        assert_eq!(chip.writes, 7);
    }

    #[test]
    fn what_was_before_a_save_comes_back_and_stays_however_often_it_is_asked_for() {
        const USUAL: [u8; 3] = [9, 9, 9];
        for (saves, before) in [
            (&[[1, 2, 3]][..], USUAL),
            (&[[1, 2, 3], [4, 5, 6]], [1, 2, 3]),
            (&[[1, 2, 3], [4, 5, 6], [7, 8, 9]], [4, 5, 6]),
        ] {
            // Also while the last save is under way, and when the board has restarted since.
            for (is_whole, restarts) in [(true, false), (false, false), (true, true)] {
                let mut chip = Chip::erased();
                let (mut store, _) = Store::load(&chip, Place::Settings);
                for (number, settings) in saves.iter().enumerate() {
                    store.save(*settings);
                    if is_whole || number + 1 < saves.len() {
                        finish(&mut store, &mut chip);
                    } else {
                        store.poll(&mut chip);
                    }
                }
                if restarts {
                    store = Store::load(&chip, Place::Settings).0;
                }
                for _ in 0..3 {
                    assert_eq!(store.restore(USUAL), before);
                    store.poll(&mut chip);
                    assert_eq!(store.restore(USUAL), before);
                    finish(&mut store, &mut chip);
                    assert_eq!(loaded(&chip), Some(before), "{saves:?}");
                    store = Store::load(&chip, Place::Settings).0;
                }
            }
        }
        let (mut store, _) = Store::load(&Chip::erased(), Place::Settings);
        assert_eq!(store.restore(USUAL), USUAL);
        assert!(!store.is_saving(), "nothing was ever saved");
    }

    #[test]
    fn settings_changed_during_a_save_are_saved_in_its_place() {
        let mut chip = Chip::erased();
        let (mut store, _) = Store::load(&chip, Place::Settings);
        store.save([1, 2, 3]);
        finish(&mut store, &mut chip);
        store.save([4, 5, 6]);
        store.poll(&mut chip);
        store.poll(&mut chip);
        store.save([7, 8, 9]);
        finish(&mut store, &mut chip);
        assert_eq!(loaded(&chip), Some([7, 8, 9]));
        store.save([1, 1, 1]);
        store.poll(&mut chip);
        assert_eq!(
            loaded(&chip),
            Some([7, 8, 9]),
            "the older copy is the one written"
        );
    }
}
