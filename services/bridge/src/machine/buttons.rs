//! The robot's own buttons: what comes of a touch, and the time in which somebody finds out how they
//! are connected.
//!
//! ```text
//!                 a request to listen, in manual mode
//!   a touch acts ------------------------------------> it does nothing, and the lines are told
//!                <-----------------------------------
//!                 nobody has asked for `trial_ms`, or the robot is autonomous
//! ```
//! A stop needs no button, so everybody can stop the robot meanwhile.

use core::time::Duration;

use lager_orders::{Mode, Moment};
use lager_topics::{Ask, BridgeAnswer, ButtonLines, InputKind, NavigatorStatus, Outcome};

use super::effect::Notice;
use super::{Asked, BridgeCore, ResetPress};
use crate::buttons::{Told, Touch};

/// Who listens to the buttons' lines.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Listener {
    /// Until when.
    until: Option<Duration>,
    told: Told,
}

impl Listener {
    pub(super) const fn next_due(&self) -> Option<Duration> {
        self.until
    }

    /// Writes what the lines show.
    pub(super) fn fill(&self, answer: &mut BridgeAnswer) {
        let is_heard = self.until.is_some();
        answer.button_lines = match is_heard {
            true => self.told.state.into(),
            false => ButtonLines::Unread.into(),
        };
        if is_heard {
            answer.button_chip = self.told.chip;
            answer.lines_low = self.told.levels.low;
            answer.lines_high = self.told.levels.high;
        }
    }
}

impl BridgeCore {
    /// Takes what a person has done with a button at `at_ns`, and returns what logic is told of it;
    /// nothing if it came too late or does not count now. `status` is what logic has just published.
    pub fn touch(
        &mut self,
        now: Moment,
        (touch, at_ns): (Touch, u64),
        reset_starts: bool,
        status: Option<&NavigatorStatus>,
    ) -> Option<InputKind> {
        if self.is_listened_to() {
            return None;
        }
        if touch.is_late(at_ns, now.ns) {
            self.say(Notice::LateTouch(touch, at_ns.abs_diff(now.ns) / 1_000_000));
            return None;
        }
        Some(match touch {
            Touch::Reset => {
                let press = ResetPress {
                    at_ns,
                    may_start: reset_starts,
                    status,
                };
                self.press_reset(now, &press)
            }
            Touch::Switched(mode) => self.switch(mode),
            Touch::Toggled => self.switch(self.arbiter.mode().other()),
        })
    }

    /// Somebody moved the switch to `mode`, or pressed the mode button.
    pub(super) fn switch(&mut self, mode: Mode) -> InputKind {
        if self.arbiter.mode() != mode {
            self.say(Notice::Pressed(mode));
        }
        self.arbiter.set_mode(mode);
        match mode {
            Mode::Manual => InputKind::SwitchedToManual,
            Mode::Autonomous => InputKind::SwitchedToAutonomous,
        }
    }

    /// Whether somebody finds out how the buttons are connected, so that they do nothing.
    pub const fn is_listened_to(&self) -> bool {
        self.listener.until.is_some()
    }

    /// What the lines show now.
    pub const fn hear_lines(&mut self, told: Told) {
        self.listener.told = told;
    }

    /// Begins to listen, or goes on.
    pub(super) fn listen(&mut self, now: Duration, ask: &Ask) -> Asked {
        if self.arbiter.mode() != Mode::Manual {
            return Asked::Answered(Outcome::UnderWay);
        }
        if !self.is_listened_to() {
            self.listener.told = Told::default();
            self.say(Notice::Listened(true));
        }
        let span = Duration::from_millis(ask.trial_ms.into());
        self.listener.until = Some(now + span.min(Ask::TRIAL));
        Asked::Answered(Outcome::Done)
    }

    /// The buttons count again when nobody listens any more, or when somebody lets logic drive.
    pub(super) fn end_listening(&mut self, now: Duration) {
        let is_manual = self.arbiter.mode() == Mode::Manual;
        let is_over = |until: Duration| until <= now || !is_manual;
        if self
            .listener
            .until
            .take_if(|until| is_over(*until))
            .is_some()
        {
            self.say(Notice::Listened(false));
        }
    }
}

#[cfg(test)]
mod tests {
    use lager_orders::Levels;
    use lager_topics::AskKind;

    use super::super::tests::{at, core, turn};
    use super::*;

    /// What a request to listen is answered.
    fn listens(core: &mut BridgeCore, millis: u64) -> BridgeAnswer {
        let ask = Ask {
            issued_ns: at(millis).ns,
            lifetime_ms: 500,
            ..Ask::listen()
        };
        core.ask(at(millis), &ask);
        turn(core, millis);
        core.answer().expect("it is answered at once")
    }

    fn sets(core: &mut BridgeCore, millis: u64, mode: Mode) {
        let ask = Ask {
            issued_ns: at(millis).ns,
            lifetime_ms: 500,
            kind: AskKind::SetMode.into(),
            mode: mode.into(),
            ..Ask::default()
        };
        core.ask(at(millis), &ask);
        turn(core, millis);
        core.answer().expect("it is answered at once");
    }

    fn presses(core: &mut BridgeCore, millis: u64, touch: Touch) -> Option<InputKind> {
        let now = at(millis);
        let kind = core.touch(now, (touch, now.ns), true, None);
        turn(core, millis);
        kind
    }

    #[test]
    fn buttons_do_nothing_while_somebody_listens_and_count_again_when_he_is_gone() {
        let mut core = core();
        let answer = listens(&mut core, 1_002);
        assert_eq!(answer.outcome, Outcome::Done);
        assert_eq!(answer.button_lines, ButtonLines::Unread);
        let levels = Levels { low: 2, high: 4 };
        core.hear_lines(Told {
            state: ButtonLines::Read,
            chip: 3,
            levels,
        });
        let answer = listens(&mut core, 1_100);
        assert_eq!(answer.button_lines, ButtonLines::Read);
        assert_eq!((answer.button_chip, answer.levels()), (3, levels));
        for touch in [
            Touch::Reset,
            Touch::Toggled,
            Touch::Switched(Mode::Autonomous),
        ] {
            assert_eq!(presses(&mut core, 5_000, touch), None);
        }
        assert_eq!(core.mode(), Mode::Manual);
        // He died at 1.1 s.
        assert_eq!(presses(&mut core, 6_099, Touch::Toggled), None);
        turn(&mut core, 6_100);
        assert!(!core.is_listened_to());
        let told = presses(&mut core, 6_101, Touch::Toggled);
        assert_eq!(told, Some(InputKind::SwitchedToAutonomous));
    }

    #[test]
    fn nobody_listens_while_logic_may_drive() {
        let mut core = core();
        sets(&mut core, 1_002, Mode::Autonomous);
        let answer = listens(&mut core, 1_003);
        assert_eq!(answer.outcome, Outcome::UnderWay);
        let told = presses(&mut core, 1_004, Touch::Switched(Mode::Manual));
        assert_eq!(told, Some(InputKind::SwitchedToManual));
        assert_eq!(listens(&mut core, 1_005).outcome, Outcome::Done);
        // Somebody lets logic drive, and can take the wheel from it by the robot's own switch.
        sets(&mut core, 1_006, Mode::Autonomous);
        let told = presses(&mut core, 1_007, Touch::Switched(Mode::Manual));
        assert_eq!(told, Some(InputKind::SwitchedToManual));
    }
}
