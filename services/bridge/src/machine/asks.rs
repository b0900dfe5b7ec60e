//! Requests: to change the mode, to release a stop, to set values of the boards, to have them told how
//! the robot is built, to listen to its buttons, and to restart the boards.
//!
//! They stand apart because an answer may have to wait for a board or for the stop word, and the
//! core's turns go on meanwhile. One request is under way at a time.

use core::time::Duration;

use lager_orders::lease::LATEST_MOVE_NS;
use lager_orders::{Mode, Moment};
use lager_topics::{Ask, AskKind, BridgeAnswer, Outcome, Part, ProfileState};
use lager_wire::{Callsign, Command, SettingKey, Version, WheelCommand};

use super::effect::Notice;
use super::{Asked, BridgeCore};
use crate::frames::ServoTable;
use crate::settings::{self, Progress};

impl BridgeCore {
    /// Begins to carry out a request.
    pub fn ask(&mut self, now: Moment, ask: &Ask) {
        use Asked::Answered;
        self.wake(now.robot);
        // A request that lets the robot move comes in time or has no effect.
        let lets_move = match ask.kind.get() {
            Some(AskKind::Resume | AskKind::Begin) => true,
            Some(AskKind::SetMode) => ask.mode.get() == Some(Mode::Autonomous),
            _ => false,
        };
        let is_stale = now.ns.abs_diff(ask.issued_ns) > LATEST_MOVE_NS;
        self.asked = Some(match (ask.kind.get(), ask.mode.get()) {
            // The sender or this process was held up, and nobody waits for the effect any more.
            (kind, _) if ask.is_over(now.ns) || (lets_move && is_stale) => {
                self.say(Notice::Late(kind));
                Answered(Outcome::Late)
            }
            (Some(AskKind::SetMode), Some(mode)) => {
                self.say(Notice::ModeSet(mode));
                self.arbiter.set_mode(mode);
                Answered(Outcome::Done)
            }
            (Some(AskKind::Begin), _) => {
                if !self.arbiter.is_mode_chosen() {
                    self.say(Notice::ModeSet(Mode::Autonomous));
                    self.arbiter.set_mode(Mode::Autonomous);
                }
                Answered(Outcome::Done)
            }
            // Nobody would see that the robot goes on when its boards come back.
            (Some(AskKind::Resume), _) if self.is_lent => Answered(Outcome::NoBoard),
            // It releases only the stop that the request names.
            (Some(AskKind::Resume), _) => match self.stop {
                Some(stop) if stop.word() == ask.stop_word => {
                    self.due.release = Some(stop);
                    Asked::Releasing
                }
                Some(_) => Answered(Outcome::Refused),
                None => Answered(Outcome::Done),
            },
            (Some(AskKind::SetGains), _) => {
                let gains = [ask.gain_p.into(), ask.gain_d.into()];
                self.set(now.robot, &[SettingKey::GainP, SettingKey::GainD], &gains)
            }
            // The thresholds would come from whatever the robot drives over.
            (Some(AskKind::Calibrate), _) if self.is_under_way() => Answered(Outcome::UnderWay),
            // "Done" means that it has begun; `link/health` reports its end.
            (Some(AskKind::Calibrate), _) => self.set(now.robot, &[SettingKey::Calibrate], &[1]),
            (Some(AskKind::Uncalibrate), _) if self.is_under_way() => Answered(Outcome::UnderWay),
            (Some(AskKind::Uncalibrate), _) => self.set(now.robot, &[SettingKey::Calibrate], &[2]),
            (Some(AskKind::Restart), _) => Answered(self.restart(ask)),
            (Some(AskKind::Describe), _) => self.describe(now.robot, ask),
            (Some(AskKind::Listen), _) => self.listen(now.robot, ask),
            (Some(AskKind::SetMode), None) | (None, _) => Answered(Outcome::Refused),
        });
    }

    /// Tells a board to restart, unless the robot moves.
    fn restart(&mut self, ask: &Ask) -> Outcome {
        let boards = [Callsign::Sensor, Callsign::Steering];
        let Some(board) = ask.board.get().filter(|board| boards.contains(board)) else {
            return Outcome::Refused;
        };
        if self.is_under_way() {
            return Outcome::UnderWay;
        }
        match (self.boards.version(board), self.boards.place(board)) {
            (Some(Version::One), Some(place)) if !self.may_move() => {
                self.due.restart[place] = true;
                Outcome::Done
            }
            // An original board knows no such order.
            (Some(_), _) => Outcome::Refused,
            (None, _) => Outcome::NoBoard,
        }
    }

    /// Has a board told how its part of the robot is built, unless the robot moves.
    fn describe(&mut self, now: Duration, ask: &Ask) -> Asked {
        let Some(part) = ask.part.get() else {
            return Asked::Answered(Outcome::Refused);
        };
        if self.is_under_way() {
            return Asked::Answered(Outcome::UnderWay);
        }
        let version = match self.boards.version(part.board()) {
            None => return Asked::Answered(Outcome::NoBoard),
            // An original board knows no settings.
            Some(Version::Original) => return Asked::Answered(Outcome::Refused),
            Some(version) => version,
        };
        // Whoever tries a description goes on to try it while the robot moves by it.
        if self.profiles.renew(now, part, ask) {
            return Asked::Describing(part);
        }
        let before = self.profiles.states();
        if self.may_move() || !self.profiles.describe(now, part, ask, version) {
            return Asked::Answered(Outcome::Refused);
        }
        self.heed_profiles(before);
        self.described(part);
        Asked::Describing(part)
    }

    /// Another description of a part is told.
    fn described(&mut self, part: Part) {
        if part == Part::Arm {
            // Other servos may stand there now, and none of these has been heard.
            self.servos = ServoTable::default();
        }
        self.due.health = true;
    }

    /// Takes back the descriptions that nobody tries any more, whatever the robot does: it stands
    /// until its boards have accepted the former ones.
    pub(super) fn take_back_trials(&mut self, now: Duration) {
        let before = self.profiles.states();
        let over = self.profiles.lapse(now);
        if !over.is_empty() {
            self.heed_profiles(before);
            over.into_iter().for_each(|part| self.described(part));
        }
    }

    /// Whether logic drives the robot now.
    fn is_under_way(&self) -> bool {
        self.may_move() && self.arbiter.mode() == Mode::Autonomous
    }

    /// Whether wheels or arm move by an order in force.
    fn may_move(&self) -> bool {
        let standby = Command::Wheel(WheelCommand::Standby);
        let mut running = self.arbiter.current().into_iter();
        running.any(|(_, command)| command != standby) && !self.arbiter.is_stopped()
    }

    /// The answer, once it is known and its content is in force.
    pub fn answer(&mut self) -> Option<BridgeAnswer> {
        let Some(Asked::Answered(outcome)) = self.asked else {
            return None;
        };
        self.asked = None;
        let gain = |key| {
            let value = self.settings.in_force(key).unwrap_or(0);
            u8::try_from(value).unwrap_or(0)
        };
        let mut answer = BridgeAnswer {
            outcome: outcome.into(),
            mode: self.arbiter.mode().into(),
            stopped: self.arbiter.is_stopped().into(),
            gain_p: gain(SettingKey::GainP),
            gain_d: gain(SettingKey::GainD),
            ..BridgeAnswer::default()
        };
        self.listener.fill(&mut answer);
        Some(answer)
    }

    /// The result of [`Effect::Release`](super::Effect::Release): the word is clear, or it has a
    /// newer stop, which is handed in separately.
    pub fn released(&mut self, is_clear: bool) {
        if is_clear {
            self.stop = None;
            self.arbiter.resume_from_stop();
        }
        if core::mem::take(&mut self.starts) {
            return self.started(is_clear);
        }
        self.asked = Some(Asked::Answered(match is_clear {
            true => Outcome::Done,
            false => Outcome::Refused,
        }));
    }

    /// Sends settings to their board.
    fn set(&mut self, now: Duration, keys: &'static [SettingKey], values: &[i16]) -> Asked {
        let is_calibration = keys == [SettingKey::Calibrate];
        let board = match is_calibration {
            true => Callsign::Sensor,
            false => Callsign::Steering,
        };
        match self.boards.version(board) {
            None => return Asked::Answered(Outcome::NoBoard),
            // An original board knows no settings.
            Some(Version::Original) => return Asked::Answered(Outcome::Refused),
            Some(Version::One) => (),
        }
        for (key, value) in keys.iter().zip(values) {
            self.settings.want(now, *key, *value);
        }
        let until = now + settings::LONGEST;
        Asked::Setting { keys, until }
    }

    /// Checks whether a board has sent the answer for which a request waits.
    pub(super) fn hear_answer(&mut self, now: Duration) {
        if let Some(Asked::Describing(part)) = self.asked {
            self.asked = Some(Asked::Answered(match self.profiles.state(part) {
                ProfileState::Telling => return,
                ProfileState::Accepted => Outcome::Done,
                ProfileState::Refused => Outcome::Refused,
                ProfileState::NoBoard | ProfileState::Unanswered => Outcome::NoBoard,
            }));
        }
        let Some(Asked::Setting { keys, until }) = self.asked else {
            return;
        };
        let slowest = keys
            .iter()
            .map(|key| self.settings.progress(*key))
            .max_by_key(|progress| match progress {
                Progress::Accepted => 0,
                Progress::Refused => 1,
                Progress::Unanswered => 2,
                Progress::Pending => 3,
            });
        let outcome = match slowest {
            Some(Progress::Pending) if now < until => return,
            Some(Progress::Accepted) => Outcome::Done,
            Some(Progress::Refused) => Outcome::Refused,
            _ => Outcome::NoBoard,
        };
        if outcome == Outcome::Done && keys == [SettingKey::Calibrate] {
            match self.settings.in_force(SettingKey::Calibrate) {
                Some(2) => self.calibration.break_off(),
                _ => self.calibration.begin(),
            }
            self.due.health = true;
        }
        self.asked = Some(Asked::Answered(outcome));
    }
}

#[cfg(test)]
mod tests {
    use lager_topics::{Origin, SteeringOrder};
    use lager_wire::{Packet, Payload, ResetOrder};

    use super::super::tests::{FOLLOW, IDLE, STEERING, at, core, options, report, sensor_up, turn};
    use super::*;
    use crate::arbiter::Gate;
    use crate::machine::Effect;

    #[test]
    fn a_board_is_told_to_restart_once_and_only_while_the_robot_stands() {
        let mut core = core();
        let ask = |core: &mut BridgeCore, millis: u64, board: Callsign| {
            let ask = Ask {
                issued_ns: at(millis).ns,
                lifetime_ms: 500,
                board: board.into(),
                kind: AskKind::Restart.into(),
                ..Ask::default()
            };
            core.ask(at(millis), &ask);
            let mut restarts = 0;
            while let Some(effect) = core.next(at(millis)) {
                if let Effect::Write(write) = effect {
                    let packet = Packet::decode(&write.packet, Version::One).expect("a packet");
                    restarts += usize::from(packet.payload == Payload::Reset(ResetOrder::Restart));
                    assert_eq!(write.place, STEERING);
                }
            }
            let outcome = core.answer().and_then(|answer| answer.outcome.get());
            (outcome, restarts)
        };
        let stands = (Some(Outcome::Done), 1);
        assert_eq!(ask(&mut core, 1_002, Callsign::Steering), stands);
        let absent = (Some(Outcome::NoBoard), 0);
        assert_eq!(ask(&mut core, 1_002, Callsign::Sensor), absent);
        let refused = (Some(Outcome::Refused), 0);
        assert_eq!(ask(&mut core, 1_002, Callsign::Raspi), refused);

        sensor_up(&mut core, 1_003);
        let order = SteeringOrder {
            id: 1,
            origin: Origin::Operator.into(),
            code: Command::Wheel(FOLLOW).code(),
            ..SteeringOrder::default()
        };
        let now = at(1_004);
        assert!(
            core.order(now.robot, now.robot, Duration::ZERO, &order)
                .is_some()
        );
        turn(&mut core, 1_004);
        assert_eq!(ask(&mut core, 1_005, Callsign::Steering), refused);
    }

    #[test]
    fn a_description_is_tried_only_while_the_robot_stands() {
        let mut tried = options().robot;
        tried.steering.wheels.swapped = true;
        let ask = |core: &mut BridgeCore, millis: u64| {
            let ask = Ask {
                issued_ns: at(millis).ns,
                lifetime_ms: 500,
                ..Ask::describe(Part::Steering, &tried)
            };
            core.ask(at(millis), &ask);
            turn(core, millis);
            core.answer().and_then(|answer| answer.outcome.get())
        };
        let mut core = core();
        sensor_up(&mut core, 1_001);
        let order = SteeringOrder {
            id: 1,
            origin: Origin::Operator.into(),
            code: Command::Wheel(FOLLOW).code(),
            ..SteeringOrder::default()
        };
        let now = at(1_002);
        assert!(
            core.order(now.robot, now.robot, Duration::ZERO, &order)
                .is_some()
        );
        turn(&mut core, 1_002);
        assert_eq!(ask(&mut core, 1_003), Some(Outcome::Refused));
        assert_eq!(core.profiles.wheels(), Gate::Open, "it goes on as it was");

        let long_after = 1_300;
        report(&mut core, long_after, IDLE);
        turn(&mut core, long_after);
        assert_eq!(ask(&mut core, long_after), None, "the board has to answer");
        assert_eq!(core.profiles.wheels(), Gate::Held);
    }

    #[test]
    fn boards_are_not_reset_nor_calibrated_while_they_drive_and_what_is_unknown_is_refused() {
        let mut core = core();
        let mut outcome = |millis: u64, kind| {
            let ask = Ask {
                issued_ns: at(millis).ns,
                lifetime_ms: 500,
                kind,
                mode: Mode::Autonomous.into(),
                ..Ask::default()
            };
            core.ask(at(millis), &ask);
            turn(&mut core, millis);
            let order = SteeringOrder {
                id: 1,
                origin: Origin::Logic.into(),
                code: Command::Wheel(FOLLOW).code(),
                ..SteeringOrder::default()
            };
            core.order(at(millis).robot, at(millis).robot, Duration::ZERO, &order);
            core.answer().map(|answer| answer.outcome)
        };
        assert_eq!(
            outcome(1_002, AskKind::SetMode.into()),
            Some(Outcome::Done.into())
        );
        assert_eq!(
            outcome(1_003, AskKind::Calibrate.into()),
            Some(Outcome::UnderWay.into())
        );
        let unknown = lager_sample::Tag::from_raw(77);
        assert_eq!(outcome(1_004, unknown), Some(Outcome::Refused.into()));
    }
}
