//! The start by the reset button: a press at the delivery node ends the stop of a fresh start.
//!
//! Real boards start stopped. A person who has put the robot down and has no shell presses reset
//! (B1), and that stop ends:
//!
//! ```text
//!   the stop in force     a person's, a fault's, or the configuration forbids it -> it stays
//!   the press             from before the stop, or late                          -> it stays
//!   boards and logic      one of them is silent                                  -> it stays
//!   logic's place         not the delivery node                                  -> it stays, and
//!                           the press is a reset: the next one starts the robot
//!   otherwise             the stop ends, if its word still stands there
//! ```
//! The press decides at its own moment, and nothing waits for a board that comes later. It stands
//! apart from the requests because nobody waits for an answer: a thought tells people what has come
//! of the press.

use lager_orders::Moment;
use lager_stop::Stop;
use lager_topics::{InputKind, NavigatorStatus, Phase, ThoughtKind};
use lager_wire::Callsign;

use super::BridgeCore;
use super::effect::Notice;

/// A press of the reset button.
#[derive(Clone, Copy, Debug)]
pub struct ResetPress<'a> {
    /// When, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
    /// Whether the configuration lets a press end a stop.
    pub may_start: bool,
    /// The state that logic has just published; `None` if logic is silent.
    pub status: Option<&'a NavigatorStatus>,
}

impl BridgeCore {
    /// Takes a press of reset, and returns what logic is told of it.
    pub fn press_reset(&mut self, now: Moment, press: &ResetPress<'_>) -> InputKind {
        let Some(stop) = self.stop else {
            return InputKind::ResetPressed;
        };
        match self.why_not(now, stop, press) {
            Some(why) => {
                self.say(Notice::Reset(why));
                InputKind::ResetPressed
            }
            None => {
                self.due.release = Some(stop);
                self.starts = true;
                InputKind::StartPressed
            }
        }
    }

    /// Why the press does not end the stop in force.
    fn why_not(&self, now: Moment, stop: Stop, press: &ResetPress<'_>) -> Option<ThoughtKind> {
        let ends = stop.is_of_fresh_start() && press.may_start && press.at_ns > stop.at_ns();
        if !ends || self.parking.is_some() {
            return Some(ThoughtKind::ResetKeepsStop);
        }
        let is_silent = self.boards.version(Callsign::Sensor).is_none()
            || self.arbiter.board_objection(now.robot).is_some();
        match press.status {
            None => Some(ThoughtKind::ResetUnheard),
            Some(_) if is_silent => Some(ThoughtKind::ResetUnheard),
            Some(status) if status.phase == Phase::WaitingForMap => {
                Some(ThoughtKind::ResetWithoutMap)
            }
            Some(status) if status.at_start == 0 => Some(ThoughtKind::ResetElsewhere),
            Some(_) => None,
        }
    }

    /// The press has ended the stop, or a newer stop has come.
    pub(super) fn started(&mut self, is_clear: bool) {
        self.say(Notice::Reset(match is_clear {
            true => ThoughtKind::StartedByReset,
            false => ThoughtKind::ResetKeepsStop,
        }));
    }
}

#[cfg(test)]
mod tests {
    use lager_orders::Mode;
    use lager_topics::{Role, StopCause};

    use super::super::tests::{IDLE, at, core, report, sensor_up, turn};
    use super::super::{BridgeCore, Effect};
    use super::*;
    use crate::events::PortEvent;

    /// When the robot was started, and pressed, in ms.
    const STARTED: u64 = 900;
    const PRESSED: u64 = 1_010;

    fn fresh() -> Stop {
        Stop::new(Role::Supervisor, StopCause::FreshStart, at(STARTED).ns)
    }

    /// Logic stands on the delivery node.
    fn at_start() -> NavigatorStatus {
        NavigatorStatus {
            phase: Phase::WaitingForOrder.into(),
            at_start: 1,
            ..NavigatorStatus::default()
        }
    }

    /// A robot with both boards up, stopped.
    fn stopped(stop: Stop) -> BridgeCore {
        let mut core = core();
        sensor_up(&mut core, 1_002);
        core.stop(stop);
        turn(&mut core, 1_003);
        report(&mut core, PRESSED, IDLE);
        turn(&mut core, PRESSED);
        core
    }

    fn press(status: Option<&NavigatorStatus>) -> ResetPress<'_> {
        ResetPress {
            at_ns: at(PRESSED).ns,
            may_start: true,
            status,
        }
    }

    /// What comes of a press: what logic is told, and what people are told. The stop word is
    /// `word`.
    fn comes(
        core: &mut BridgeCore,
        press: &ResetPress<'_>,
        word: Stop,
    ) -> (InputKind, Option<ThoughtKind>) {
        let kind = core.press_reset(at(PRESSED), press);
        let mut told = None;
        core.decide(at(PRESSED).robot);
        while let Some(effect) = core.next(at(PRESSED)) {
            match effect {
                Effect::Release(stop) => core.released(stop == word),
                Effect::Say(Notice::Reset(what)) => told = Some(what),
                Effect::PublishHealth { .. } => core.health_told(),
                _ => {}
            }
        }
        (kind, told)
    }

    #[test]
    fn a_press_at_the_delivery_node_ends_the_stop_of_a_fresh_start_and_moves_nothing() {
        let mut core = stopped(fresh());
        let status = at_start();
        let (kind, told) = comes(&mut core, &press(Some(&status)), fresh());
        assert_eq!(kind, InputKind::StartPressed);
        assert_eq!(told, Some(ThoughtKind::StartedByReset));
        assert!(!core.arbiter.is_stopped());
        assert_eq!((core.mode(), core.arbiter.current()), (Mode::Manual, None));
        // The next press is a reset and nothing else.
        let (kind, told) = comes(&mut core, &press(Some(&status)), fresh());
        assert_eq!((kind, told), (InputKind::ResetPressed, None));
    }

    #[test]
    fn a_stop_of_a_person_or_a_fault_stays_and_so_does_one_that_may_not_be_ended() {
        let status = at_start();
        let others = [
            (Role::Operator, StopCause::Ordered),
            (Role::Operator, StopCause::FreshStart),
            (Role::Supervisor, StopCause::Ordered),
            (Role::Bridge, StopCause::BoardResets),
            (Role::Bridge, StopCause::StateLost),
            (Role::Bridge, StopCause::WordRemoved),
        ];
        let others = others.map(|(role, cause)| Stop::new(role, cause, at(STARTED).ns));
        for stop in others {
            let mut core = stopped(stop);
            let (kind, told) = comes(&mut core, &press(Some(&status)), stop);
            assert_eq!(kind, InputKind::ResetPressed, "{stop}");
            assert_eq!(told, Some(ThoughtKind::ResetKeepsStop), "{stop}");
            assert!(core.arbiter.is_stopped(), "{stop}");
        }
        let mut core = stopped(fresh());
        let forbidden = ResetPress {
            may_start: false,
            ..press(Some(&status))
        };
        let (_, told) = comes(&mut core, &forbidden, fresh());
        assert_eq!(told, Some(ThoughtKind::ResetKeepsStop));
        // A press from before the stop does not mean it.
        let earlier = ResetPress {
            at_ns: at(STARTED).ns,
            ..press(Some(&status))
        };
        let (_, told) = comes(&mut core, &earlier, fresh());
        assert_eq!(told, Some(ThoughtKind::ResetKeepsStop));
        assert!(core.arbiter.is_stopped());
    }

    #[test]
    fn a_stop_that_a_person_sets_at_the_same_moment_wins() {
        let status = at_start();
        let newer = Stop::new(Role::Operator, StopCause::Ordered, at(PRESSED).ns);
        // It stands in the word when the bridge comes to release the first one.
        let mut core = stopped(fresh());
        let (_, told) = comes(&mut core, &press(Some(&status)), newer);
        assert_eq!(told, Some(ThoughtKind::ResetKeepsStop));
        assert!(core.arbiter.is_stopped());
        // It has come before.
        let mut core = stopped(fresh());
        core.stop(newer);
        let (kind, told) = comes(&mut core, &press(Some(&status)), newer);
        assert_eq!(kind, InputKind::ResetPressed);
        assert_eq!(told, Some(ThoughtKind::ResetKeepsStop));
        assert!(core.arbiter.is_stopped());
    }

    #[test]
    fn a_robot_whose_place_or_boards_are_not_known_stays_stopped_and_says_why() {
        let elsewhere = NavigatorStatus {
            at_start: 0,
            ..at_start()
        };
        let lost = NavigatorStatus {
            phase: Phase::Lost.into(),
            ..elsewhere
        };
        let mapless = NavigatorStatus {
            phase: Phase::WaitingForMap.into(),
            ..elsewhere
        };
        for (status, why) in [
            (None, ThoughtKind::ResetUnheard),
            (Some(&elsewhere), ThoughtKind::ResetElsewhere),
            (Some(&lost), ThoughtKind::ResetElsewhere),
            (Some(&mapless), ThoughtKind::ResetWithoutMap),
        ] {
            let mut core = stopped(fresh());
            // Logic hears of the press, and stands on the delivery node from then on.
            let (kind, told) = comes(&mut core, &press(status), fresh());
            assert_eq!((kind, told), (InputKind::ResetPressed, Some(why)));
            assert!(core.arbiter.is_stopped());
        }
        let status = at_start();
        for place in [0, 1] {
            let mut core = stopped(fresh());
            core.port(at(PRESSED), place, PortEvent::Silent);
            let (_, told) = comes(&mut core, &press(Some(&status)), fresh());
            assert_eq!(told, Some(ThoughtKind::ResetUnheard), "port {place}");
            assert!(core.arbiter.is_stopped());
            // Nothing waits for the board: when it is back, the robot still stands.
            core.port(at(PRESSED), place, PortEvent::SendSyn);
            turn(&mut core, PRESSED + 1);
            assert!(core.arbiter.is_stopped());
        }
    }
}
