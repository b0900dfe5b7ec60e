//! Settings on their way to the boards: the bridge sends each until the board answers, and again to
//! a board that has restarted and forgotten it.
//!
//! It is pure. It stands apart from the main loop because it deals with time: attempts, answers
//! that fit no question, boards that come back. It knows nothing of ports and requests.

use core::time::Duration;

use lager_topics::Health;
use lager_wire::{Callsign, Setting, SettingKey, SettingReply, SettingStatus};

/// How long a board may take to answer before the bridge asks again.
pub(crate) const RETRY: Duration = Duration::from_millis(60);

/// How often a board is asked.
pub(crate) const TRIES: u8 = 4;

/// Longest time from [`Settings::want`] to a result, if the board's link is up.
pub const LONGEST: Duration = RETRY.saturating_mul(TRIES as u32);

/// The progress of a wish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nobody has a wish, or it is on its way.
    Pending,
    /// The board has taken it.
    Accepted,
    /// The board has refused it and keeps the value it had.
    Refused,
    /// The board has not answered.
    Unanswered,
}

/// One setting.
#[derive(Clone, Copy, Debug)]
struct Slot {
    key: SettingKey,
    wanted: i16,
    /// The value that the board has taken; the bridge sends it again after the board's restart.
    kept: Option<i16>,
    /// The value that the board last reported as in force.
    in_force: Option<i16>,
    seq: u8,
    tries: u8,
    next_try: Option<Duration>,
    progress: Progress,
}

/// All settings of both boards.
#[derive(Clone, Debug)]
pub struct Settings {
    slots: [Slot; 4],
    last_seq: u8,
}

impl Default for Settings {
    fn default() -> Self {
        let slot = |key| Slot {
            key,
            wanted: 0,
            kept: None,
            in_force: None,
            seq: 0,
            tries: 0,
            next_try: None,
            progress: Progress::Pending,
        };
        Self {
            slots: [
                slot(SettingKey::GainP),
                slot(SettingKey::GainD),
                slot(SettingKey::RawLine),
                slot(SettingKey::Calibrate),
            ],
            last_seq: 0,
        }
    }
}

/// The board a setting belongs to.
fn home(key: SettingKey) -> Callsign {
    match key {
        SettingKey::RawLine | SettingKey::Calibrate => Callsign::Sensor,
        _ => Callsign::Steering,
    }
}

impl Settings {
    /// Takes over the gains that were set in an earlier bridge.
    pub fn resume(&mut self, kept: &Health) {
        for (key, gain) in [
            (SettingKey::GainP, kept.gain_p),
            (SettingKey::GainD, kept.gain_d),
        ] {
            if gain >= 0 {
                self.keep(key, gain);
            }
        }
    }

    /// Writes the settings' part of `link/health`: all that [`Settings::resume`] needs.
    pub fn fill(&self, health: &mut Health) {
        let kept = |key| self.find(key).and_then(|slot| slot.kept);
        let gain = |key| kept(key).unwrap_or(Health::NEVER_SET);
        health.gain_p = gain(SettingKey::GainP);
        health.gain_d = gain(SettingKey::GainD);
    }

    /// Wishes a value. It replaces an earlier wish for the same key.
    pub fn want(&mut self, now: Duration, key: SettingKey, value: i16) {
        self.start(now, key, value);
    }

    /// Sets a value that a board gets whenever it comes up, from the next time on.
    pub fn keep(&mut self, key: SettingKey, value: i16) {
        if let Some(slot) = self.slot(key) {
            slot.kept = Some(value);
        }
    }

    /// A board has come up: it gets again what it had taken. Open wishes are over.
    pub fn board_up(&mut self, now: Duration, board: Callsign) {
        for index in 0..self.slots.len() {
            let slot = &mut self.slots[index];
            if home(slot.key) != board {
                continue;
            }
            if slot.next_try.take().is_some() {
                slot.progress = Progress::Unanswered;
            }
            if let Some(value) = slot.kept {
                let key = slot.key;
                self.start(now, key, value);
            }
        }
    }

    /// The setting to send to `board` now. Ask until it returns nothing.
    pub fn poll(&mut self, now: Duration, board: Callsign) -> Option<Setting> {
        for slot in self.slots.iter_mut().filter(|slot| home(slot.key) == board) {
            if slot.next_try.is_none_or(|due| due > now) {
                continue;
            }
            if slot.tries == TRIES {
                slot.next_try = None;
                slot.progress = Progress::Unanswered;
                continue;
            }
            slot.tries += 1;
            slot.next_try = Some(now + RETRY);
            return Some(Setting {
                key: slot.key,
                seq: slot.seq,
                value: slot.wanted,
            });
        }
        None
    }

    /// When [`Settings::poll`] next has something to do for `board`.
    pub fn next_due(&self, board: Callsign) -> Option<Duration> {
        self.slots
            .iter()
            .filter(|slot| home(slot.key) == board)
            .filter_map(|slot| slot.next_try)
            .min()
    }

    /// A board has answered. Returns whether the bridge was waiting for this answer. Any other
    /// answer changes nothing: it is a repetition, or the end of a calibration whose beginning was
    /// already answered.
    pub fn answer(&mut self, reply: &SettingReply) -> bool {
        let Some(slot) = self.slot(reply.key) else {
            return false;
        };
        if slot.next_try.is_none() || slot.seq != reply.seq {
            return false;
        }
        slot.next_try = None;
        slot.in_force = Some(reply.value);
        if reply.status == SettingStatus::Accepted {
            slot.progress = Progress::Accepted;
            // A calibration is done once, and not again after a restart.
            if slot.key != SettingKey::Calibrate {
                slot.kept = Some(slot.wanted);
            }
        } else {
            slot.progress = Progress::Refused;
        }
        true
    }

    /// The progress of the last wish for a key.
    pub fn progress(&self, key: SettingKey) -> Progress {
        self.find(key)
            .map_or(Progress::Unanswered, |slot| slot.progress)
    }

    /// The value that a board last reported as in force.
    pub fn in_force(&self, key: SettingKey) -> Option<i16> {
        self.find(key)?.in_force
    }

    fn start(&mut self, now: Duration, key: SettingKey, value: i16) {
        self.last_seq = self.last_seq.wrapping_add(1);
        let seq = self.last_seq;
        let Some(slot) = self.slot(key) else {
            return;
        };
        slot.wanted = value;
        slot.seq = seq;
        slot.tries = 0;
        slot.next_try = Some(now);
        slot.progress = Progress::Pending;
    }

    fn find(&self, key: SettingKey) -> Option<&Slot> {
        self.slots.iter().find(|slot| slot.key == key)
    }

    fn slot(&mut self, key: SettingKey) -> Option<&mut Slot> {
        self.slots.iter_mut().find(|slot| slot.key == key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    fn reply(to: &Setting, status: SettingStatus) -> SettingReply {
        SettingReply {
            key: to.key,
            seq: to.seq,
            value: to.value,
            status,
        }
    }

    #[test]
    fn a_setting_is_sent_until_it_is_answered() {
        let mut settings = Settings::default();
        settings.want(ms(0), SettingKey::GainP, 5);
        let first = settings.poll(ms(0), Callsign::Steering).unwrap();
        assert_eq!((first.key, first.value), (SettingKey::GainP, 5));
        assert_eq!(settings.poll(ms(59), Callsign::Steering), None);
        assert_eq!(settings.next_due(Callsign::Steering), Some(ms(60)));
        assert_eq!(settings.next_due(Callsign::Sensor), None);
        assert_eq!(settings.poll(ms(60), Callsign::Sensor), None);
        assert_eq!(settings.poll(ms(60), Callsign::Steering), Some(first));
        assert!(settings.answer(&reply(&first, SettingStatus::Accepted)));
        assert!(!settings.answer(&reply(&first, SettingStatus::Accepted)));
        assert_eq!(settings.progress(SettingKey::GainP), Progress::Accepted);
        assert_eq!(settings.in_force(SettingKey::GainP), Some(5));
        assert_eq!(settings.next_due(Callsign::Steering), None);
        assert_eq!(settings.poll(ms(500), Callsign::Steering), None);
    }

    #[test]
    fn a_silent_board_is_given_up_after_four_tries() {
        let mut settings = Settings::default();
        settings.want(ms(0), SettingKey::Calibrate, 1);
        let sent = (0..=300)
            .filter(|now| settings.poll(ms(*now), Callsign::Sensor).is_some())
            .count();
        assert_eq!(sent, 4);
        assert_eq!(
            settings.progress(SettingKey::Calibrate),
            Progress::Unanswered
        );
    }

    #[test]
    fn an_answer_to_an_earlier_question_is_passed_over() {
        let mut settings = Settings::default();
        settings.want(ms(0), SettingKey::GainP, 5);
        let old = settings.poll(ms(0), Callsign::Steering).unwrap();
        settings.want(ms(1), SettingKey::GainP, 6);
        assert!(!settings.answer(&reply(&old, SettingStatus::Accepted)));
        assert_eq!(settings.progress(SettingKey::GainP), Progress::Pending);
        assert_eq!(
            settings
                .poll(ms(1), Callsign::Steering)
                .map(|setting| setting.value),
            Some(6)
        );
    }

    #[test]
    fn a_refused_value_leaves_the_one_before_to_be_told_after_a_restart() {
        let mut settings = Settings::default();
        settings.want(ms(0), SettingKey::GainD, 3);
        let sent = settings.poll(ms(0), Callsign::Steering).unwrap();
        settings.answer(&reply(&sent, SettingStatus::Accepted));
        settings.want(ms(10), SettingKey::GainD, 300);
        let sent = settings.poll(ms(10), Callsign::Steering).unwrap();
        settings.answer(&SettingReply {
            value: 3,
            ..reply(&sent, SettingStatus::OutOfRange)
        });
        assert_eq!(settings.progress(SettingKey::GainD), Progress::Refused);
        assert_eq!(settings.in_force(SettingKey::GainD), Some(3));

        settings.board_up(ms(20), Callsign::Sensor);
        assert_eq!(settings.poll(ms(20), Callsign::Steering), None);
        settings.board_up(ms(30), Callsign::Steering);
        let again = settings.poll(ms(30), Callsign::Steering).unwrap();
        assert_eq!((again.key, again.value), (SettingKey::GainD, 3));
    }

    #[test]
    fn gains_outlive_the_bridge_and_those_never_set_stay_so() {
        let mut settings = Settings::default();
        let mut health = Health::default();
        settings.want(ms(0), SettingKey::GainD, 0);
        let sent = settings.poll(ms(0), Callsign::Steering).unwrap();
        settings.fill(&mut health);
        assert_eq!(health, Health::default(), "the board has not answered");
        settings.answer(&reply(&sent, SettingStatus::Accepted));
        settings.fill(&mut health);
        assert_eq!((health.gain_p, health.gain_d), (Health::NEVER_SET, 0));

        let mut settings = Settings::default();
        settings.resume(&health);
        assert_eq!(settings.poll(ms(0), Callsign::Steering), None);
        settings.board_up(ms(5), Callsign::Steering);
        let told = settings.poll(ms(5), Callsign::Steering).unwrap();
        assert_eq!((told.key, told.value), (SettingKey::GainD, 0));
        assert_eq!(settings.poll(ms(5), Callsign::Steering), None);
    }

    #[test]
    fn a_restart_in_the_middle_of_a_calibration_ends_it() {
        let mut settings = Settings::default();
        settings.want(ms(0), SettingKey::Calibrate, 1);
        assert!(settings.poll(ms(0), Callsign::Sensor).is_some());
        settings.board_up(ms(10), Callsign::Sensor);
        assert_eq!(
            settings.progress(SettingKey::Calibrate),
            Progress::Unanswered
        );
        assert_eq!(settings.poll(ms(100), Callsign::Sensor), None);
    }
}
