//! Requests: changes of the mode, the release of a stop, and settings of the boards.
//!
//! It is apart because an answer may have to wait for a board, and the loop must turn meanwhile.

use lager_topics::{Answer, Ask, AskKind, Outcome};
use lager_wire::{Callsign, SettingKey, Version};

use super::Core;
use crate::settings::{self, Progress, Settings};

impl Core<'_> {
    /// Answers one request.
    pub(super) fn answer(&mut self, ask: &Ask) -> Answer {
        let outcome = match (ask.kind.get(), ask.mode.get()) {
            (Some(AskKind::SetMode), Some(mode)) => {
                tracing::info!(?mode, "the mode is set");
                self.arbiter.set_mode(mode);
                Outcome::Done
            }
            (Some(AskKind::Resume), _) => {
                tracing::info!("resumed");
                self.arbiter.resume_from_stop();
                Outcome::Done
            }
            (Some(AskKind::SetGains), _) => self.set(
                Callsign::Steering,
                &[
                    (SettingKey::GainP, ask.gain_p.into()),
                    (SettingKey::GainD, ask.gain_d.into()),
                ],
            ),
            // Done means that it has begun; its end is told in the log.
            (Some(AskKind::Calibrate), _) => {
                self.set(Callsign::Sensor, &[(SettingKey::Calibrate, 1)])
            }
            (Some(AskKind::ResetBoards), _) => {
                tracing::warn!(
                    "the boards cannot be restarted from here: the protocol has no packet for it; \
                     press the button on the board or switch its power off and on"
                );
                Outcome::Refused
            }
            (Some(AskKind::SetMode), None) | (None, _) => Outcome::Refused,
        };
        // What is answered is in force, and seen to be.
        self.flush();
        let gain = |key| {
            let value = self.settings.in_force(key).unwrap_or(0);
            u8::try_from(value).unwrap_or(0)
        };
        Answer {
            outcome: outcome.into(),
            mode: self.arbiter.mode().into(),
            stopped: self.arbiter.is_stopped().into(),
            gain_p: gain(SettingKey::GainP),
            gain_d: gain(SettingKey::GainD),
            ..Answer::default()
        }
    }

    /// Sends settings to a board and turns the loop until it has answered.
    fn set(&mut self, board: Callsign, wishes: &[(SettingKey, i16)]) -> Outcome {
        match self.boards.version(board) {
            None => return Outcome::NoBoard,
            // An original board knows no settings.
            Some(Version::Original) => return Outcome::Refused,
            Some(Version::One) => (),
        }
        let start = self.clock.now();
        for (key, value) in wishes {
            self.settings.want(start, *key, *value);
        }
        self.flush();
        let progress = |settings: &Settings| {
            let of = |(key, _): &(SettingKey, i16)| settings.progress(*key);
            wishes.iter().map(of).max_by_key(|progress| match progress {
                Progress::Accepted => 0,
                Progress::Refused => 1,
                Progress::Unanswered => 2,
                Progress::Pending => 3,
            })
        };
        while progress(&self.settings) == Some(Progress::Pending)
            && self.clock.now() < start + settings::LONGEST
        {
            self.wait();
            self.take_events();
            self.take_orders();
            self.flush();
        }
        match progress(&self.settings) {
            Some(Progress::Accepted) => Outcome::Done,
            Some(Progress::Refused) => Outcome::Refused,
            _ => Outcome::NoBoard,
        }
    }
}
