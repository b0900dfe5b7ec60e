//! The arm's profile on its way to the steering board: sent value by value, put in force as a
//! whole, verified, and sent again to a board that has come up.
//!
//! ```text
//!            board up            every value and the check value taken
//!   no board --------> telling ----------------------------------------> accepted
//!                       ^  |  '---> refused: the board does not take one
//!             5 seconds |  v no answer, four times
//!                    unanswered
//! ```
//!
//! One value is on its way at a time: a board's queue holds five packets, and at 9600 Bd a command
//! to the wheels must not wait for twenty-five. Until the board has accepted the profile, the
//! arbiter keeps the arm still, because the board cannot keep limits that it does not know.
//!
//! It is pure. It stands apart from the other settings because it is one thing in many packets, and
//! no request changes it while the robot runs.

use core::time::Duration;

use lager_topics::ArmProfileState;
use lager_wire::{ArmProfile, Setting, SettingKey, SettingReply, SettingStatus, Version};

use crate::settings::{RETRY, TRIES};

/// How long the bridge waits before it tries a board again that does not answer.
const PAUSE: Duration = Duration::from_secs(5);

/// The profile and how much of it the board has taken.
#[derive(Clone, Debug)]
pub struct ProfileTeller {
    values: [u16; ArmProfile::VALUES],
    state: ArmProfileState,
    /// How many values the board has taken; the check value comes after the last.
    taken: usize,
    seq: u8,
    tries: u8,
    next_try: Option<Duration>,
}

impl ProfileTeller {
    /// Sends `profile`, which its owner has validated, to every board that comes up.
    pub fn new(profile: &ArmProfile) -> Self {
        Self {
            values: profile.values(),
            state: ArmProfileState::NoBoard,
            taken: 0,
            seq: 0,
            tries: 0,
            next_try: None,
        }
    }

    /// The steering board has come up and gets everything. An original board knows no profile.
    pub fn board_up(&mut self, now: Duration, version: Version) {
        self.board_down();
        if version == Version::One {
            self.state = ArmProfileState::Telling;
            self.taken = 0;
            self.ask_next(now);
        }
    }

    /// The steering board is not up any more.
    pub fn board_down(&mut self) {
        self.state = ArmProfileState::NoBoard;
        self.next_try = None;
    }

    /// The setting to send now, if any.
    pub fn poll(&mut self, now: Duration) -> Option<Setting> {
        if self.next_try.is_none_or(|due| due > now) {
            return None;
        }
        if self.tries == TRIES {
            self.state = ArmProfileState::Unanswered;
            self.tries = 0;
            self.next_try = Some(now + PAUSE);
            return None;
        }
        self.tries += 1;
        self.next_try = Some(now + RETRY);
        Some(Setting {
            key: self.key(),
            seq: self.seq,
            value: self.value(),
        })
    }

    /// When [`ProfileTeller::poll`] next has something to do.
    pub fn next_due(&self) -> Option<Duration> {
        self.next_try
    }

    /// The board has answered. Returns whether the bridge was waiting for this answer.
    pub fn answer(&mut self, now: Duration, reply: &SettingReply) -> bool {
        if self.next_try.is_none() || reply.key != self.key() || reply.seq != self.seq {
            return false;
        }
        if reply.status != SettingStatus::Accepted || reply.value != self.value() {
            self.state = ArmProfileState::Refused;
            self.next_try = None;
        } else if self.taken == self.values.len() {
            self.state = ArmProfileState::Accepted;
            self.next_try = None;
        } else {
            self.state = ArmProfileState::Telling;
            self.taken += 1;
            self.ask_next(now);
        }
        true
    }

    /// The progress.
    pub fn state(&self) -> ArmProfileState {
        self.state
    }

    fn ask_next(&mut self, now: Duration) {
        self.seq = self.seq.wrapping_add(1);
        self.tries = 0;
        self.next_try = Some(now);
    }

    fn key(&self) -> SettingKey {
        ArmProfile::key(self.taken).unwrap_or(SettingKey::ArmProfile)
    }

    fn value(&self) -> i16 {
        match self.values.get(self.taken) {
            Some(value) => value.cast_signed(),
            None => ArmProfile::check(&self.values),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    fn accepted(to: &Setting) -> SettingReply {
        SettingReply {
            key: to.key,
            seq: to.seq,
            value: to.value,
            status: SettingStatus::Accepted,
        }
    }

    fn up() -> ProfileTeller {
        let mut teller = ProfileTeller::new(&ArmProfile::default());
        assert_eq!(teller.poll(ms(0)), None, "nobody is there");
        teller.board_up(ms(0), Version::One);
        teller
    }

    #[test]
    fn every_value_is_told_once_and_then_put_in_force() {
        let mut teller = up();
        let mut told = Vec::new();
        while let Some(setting) = teller.poll(ms(0)) {
            assert_eq!(teller.state(), ArmProfileState::Telling);
            assert_eq!(teller.poll(ms(0)), None, "one at a time");
            assert!(teller.answer(ms(0), &accepted(&setting)));
            assert!(!teller.answer(ms(0), &accepted(&setting)), "once");
            told.push(setting);
        }
        assert_eq!(teller.state(), ArmProfileState::Accepted);
        assert_eq!(teller.next_due(), None);
        let values = ArmProfile::default().values();
        assert_eq!(told.len(), values.len() + 1);
        for (index, setting) in told.iter().take(values.len()).enumerate() {
            assert_eq!(ArmProfile::index(setting.key), Some(index));
            assert_eq!(setting.value, values[index].cast_signed());
        }
        let last = told.last().expect("a check value");
        assert_eq!(last.key, SettingKey::ArmProfile);
        assert_eq!(last.value, ArmProfile::check(&values));
    }

    #[test]
    fn a_board_that_does_not_answer_is_asked_again_and_said_to_be_silent() {
        let mut teller = up();
        let asked: Vec<u64> = (0..6_000)
            .filter(|now| teller.poll(ms(*now)).is_some())
            .collect();
        assert_eq!(asked[..5], [0, 60, 120, 180, 5_240]);
        assert_eq!(teller.state(), ArmProfileState::Unanswered);
        let setting = teller.poll(ms(11_000)).expect("it goes on asking");
        teller.answer(ms(11_000), &accepted(&setting));
        assert_eq!(teller.state(), ArmProfileState::Telling);
    }

    #[test]
    fn what_the_board_does_not_take_is_refused_whatever_its_words() {
        for (status, off_by) in [
            (SettingStatus::OutOfRange, 0),
            (SettingStatus::NotHere, 0),
            (SettingStatus::Accepted, 1),
        ] {
            let mut teller = up();
            let setting = teller.poll(ms(0)).expect("the first value");
            let reply = SettingReply {
                value: setting.value - off_by,
                status,
                ..accepted(&setting)
            };
            assert!(teller.answer(ms(0), &reply));
            assert_eq!(teller.state(), ArmProfileState::Refused);
            assert_eq!(teller.poll(ms(5_000)), None);
        }
    }

    #[test]
    fn a_board_that_comes_up_again_is_told_from_the_beginning() {
        let mut teller = up();
        for _ in 0..7 {
            let setting = teller.poll(ms(0)).expect("a value");
            teller.answer(ms(0), &accepted(&setting));
        }
        teller.board_down();
        assert_eq!(teller.state(), ArmProfileState::NoBoard);
        teller.board_up(ms(9), Version::One);
        let setting = teller.poll(ms(9)).expect("the first value");
        assert_eq!(ArmProfile::index(setting.key), Some(0));
        teller.board_up(ms(20), Version::Original);
        assert_eq!(teller.state(), ArmProfileState::NoBoard);
        assert_eq!(teller.poll(ms(20)), None);
    }
}
