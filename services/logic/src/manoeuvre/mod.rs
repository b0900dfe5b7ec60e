//! What the robot is doing: one manoeuvre at a time, each with its own state, that ends in an
//! [`Outcome`].
//!
//! ```text
//!             begin             a frame, a report, time
//!   mission ---------> manoeuvre ----------------------> Outcome ---> mission
//!                          |
//!                          +---> the command it needs now
//! ```
//!
//! A manoeuvre knows the line, its marks and the odometer. It does not know its purpose: only the
//! mission does. A new manoeuvre is a file beside this one, a variant here with its match arms, and a
//! place in the mission that begins it.

mod arm;
mod follow;
mod helm;
mod look;
mod outcome;
mod search;
mod turn;

use core::time::Duration;

use lager_topics::{Finish, Heading, NavigatorStatus, Step};
use lager_wire::{Command, LineState, WheelCommand};

pub(crate) use arm::{ArmSequence, Task};
pub(crate) use follow::{Ahead, Follow, Until};
pub(crate) use helm::{Helm, STANDBY, Senses};
pub(crate) use look::Look;
pub(crate) use outcome::Outcome;
pub(crate) use search::Search;
pub(crate) use turn::{Spot, Turn};

use crate::config::LogicConfig;
use crate::marks::Mark;
use helm::{Pause, turning_place};

/// In a status's doubt: the quarter before the one at hand ended without tape.
const FROM_BARE: u8 = 16;
/// How old a distance may be that tells whether there is room to turn.
const IN_SIGHT: Duration = Duration::from_millis(500);

/// What the robot is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Manoeuvre {
    /// It stands.
    Stand,
    /// It stands and looks whether the way ahead is open.
    Look(Look),
    /// It follows a line.
    Follow(Follow),
    /// It turns on the spot.
    Turn(Turn),
    /// It backs away from the cross bar, far enough to turn round.
    BackUp,
    /// It backs up until the odometer reads so many mm: to the node that it has just left, as a
    /// turn so near to it would end on the tape that crosses there; or away from what stands so
    /// close behind the node that a corner of the body would touch it in the turn.
    Retreat(f32),
    /// It moves the arm.
    Arm(ArmSequence),
    /// It looks for the short mark of a station that a disturbed turn may have missed.
    Search(Search),
}

impl Manoeuvre {
    /// Begins it where the robot is.
    pub(crate) fn begin(&mut self, helm: &mut Helm<'_>) {
        if let Self::Turn(turn) = self {
            let travelled_mm = helm.senses.odometer.travelled_mm;
            let most_mm = match helm.senses.free_behind {
                true => helm.config.turn_room_mm,
                false => helm.config.turn_back_mm,
            };
            let back_to_mm = (travelled_mm - missing_room_mm(helm)).max(-most_mm);
            if matches!(turn.spot, Spot::Along(_)) && travelled_mm < helm.config.nearest_turn_mm() {
                *self = Self::Retreat(helm.config.coast_mm);
            } else if turn.spot == Spot::Node && travelled_mm > back_to_mm {
                *self = Self::Retreat(back_to_mm);
            }
        }
        match self {
            Self::Stand => helm.senses.marks.clear(),
            Self::Follow(follow) => follow.begin(helm),
            Self::Turn(turn) => turn.begin(helm),
            Self::BackUp | Self::Retreat(_) | Self::Arm(_) | Self::Look(_) | Self::Search(_) => {}
        }
    }

    /// The command it needs now.
    pub(crate) fn wanted(
        &self,
        senses: &Senses,
        heading: Heading,
        config: &LogicConfig,
    ) -> Command {
        match self {
            Self::Stand | Self::Look(_) => STANDBY,
            Self::Follow(follow) => follow.wanted(senses, config),
            Self::Turn(turn) => turn.wanted(heading),
            Self::BackUp | Self::Retreat(_) => Command::Wheel(WheelCommand::ManualBackward),
            Self::Arm(arm) => arm.wanted(),
            Self::Search(search) => search.wanted(),
        }
    }

    /// Takes a line frame, and the mark that ended with it.
    pub(crate) fn see(
        &mut self,
        state: LineState,
        mark: Option<Mark>,
        helm: &mut Helm<'_>,
    ) -> Option<Outcome> {
        match self {
            Self::Follow(follow) => follow.see(state, mark, helm),
            _ => None,
        }
    }

    /// An order that runs once has ended.
    pub(crate) fn ended(&mut self, finish: Finish, helm: &mut Helm<'_>) -> Option<Outcome> {
        match self {
            Self::Turn(turn) => turn.ended(finish, helm),
            Self::Arm(arm) => arm.ended(finish, helm.now),
            Self::Search(search) => search.ended(finish, helm),
            Self::Stand | Self::Look(_) | Self::Follow(_) | Self::BackUp | Self::Retreat(_) => None,
        }
    }

    /// Goes on where time and the odometer allow it.
    pub(crate) fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Outcome> {
        match self {
            Self::Stand => None,
            Self::Look(look) => look.go_on(helm),
            Self::Follow(follow) => follow.go_on(helm),
            Self::Turn(turn) => turn.go_on(helm),
            Self::BackUp => {
                let at = turning_place(helm.senses.exit_mm, helm.config);
                (helm.senses.odometer.travelled_mm <= at).then_some(Outcome::Done)
            }
            Self::Retreat(to_mm) => {
                let travelled = helm.senses.odometer.travelled_mm;
                (travelled <= *to_mm).then_some(Outcome::Done)
            }
            Self::Arm(arm) => arm.go_on(helm),
            Self::Search(search) => search.go_on(helm),
        }
    }

    /// Takes a distance: something may stand on the way.
    pub(crate) fn range(&mut self, centimetres: u8, helm: &mut Helm<'_>) -> Option<Outcome> {
        match self {
            Self::Follow(follow) => follow.range(centimetres, helm),
            _ => None,
        }
    }

    /// The line it follows, if it does.
    pub(crate) fn line(&self) -> Option<&Follow> {
        match self {
            Self::Follow(follow) => Some(follow),
            _ => None,
        }
    }

    /// The step within it, as it is published.
    pub(crate) fn step(&self) -> Step {
        self.line().map_or(Step::Seeking, |follow| follow.step)
    }

    /// Whether it turns the wheels.
    pub(crate) fn turns_wheels(&self) -> bool {
        !matches!(self, Self::Stand | Self::Look(_) | Self::Arm(_))
    }

    /// Has it stand for a moment and judge how far it has come, if it is one that runs once.
    pub(crate) fn interrupt(&mut self) {
        match self {
            Self::Turn(turn) => turn.pause = Pause::Wanted,
            Self::Arm(arm) => arm.interrupt(),
            Self::Search(search) => search.pause = Pause::Wanted,
            _ => {}
        }
    }

    /// The board is heard again after a silence: a turn may have ended, or not.
    pub(crate) fn hear_again(&mut self) {
        match self {
            Self::Turn(turn) => (turn.pause, turn.tries) = (Pause::Wanted, 0),
            Self::Search(search) => search.pause = Pause::Wanted,
            _ => {}
        }
    }

    /// As a predecessor left it, by what it published of it; `ordered` was in force.
    pub(crate) fn restore(
        &mut self,
        step: Step,
        status: &NavigatorStatus,
        ordered: Command,
        config: &LogicConfig,
    ) {
        match self {
            Self::Follow(follow) => follow.step = step,
            Self::Turn(turn) if ordered == Command::Wheel(WheelCommand::ManualBackward) => {
                *self = Self::Retreat(match turn.spot {
                    // It ends here, and what room there is now is looked at anew.
                    Spot::Node => status.travelled_mm as f32,
                    Spot::Edge(_) | Spot::Along(_) => config.coast_mm,
                });
            }
            Self::Turn(turn) => {
                turn.tries = status.tries;
                turn.disturbed = status.doubt & 1 != 0;
                turn.from_bare = status.doubt & FROM_BARE != 0;
            }
            Self::Arm(arm) => {
                arm.restore(status.arm_attempt, status.arm_moves, status.tries, ordered);
            }
            Self::Search(search) => search.restore(status.tries, ordered),
            Self::Stand | Self::Look(_) | Self::BackUp | Self::Retreat(_) => {}
        }
    }

    /// Writes into a status what a successor needs of it.
    pub(crate) fn fill(&self, status: &mut NavigatorStatus) {
        match self {
            Self::Follow(follow) => status.step = follow.step.into(),
            Self::Turn(turn) => {
                status.tries = turn.tries;
                let from_bare = if turn.from_bare { FROM_BARE } else { 0 };
                status.doubt = u8::from(turn.disturbed) | from_bare;
            }
            Self::Arm(arm) => {
                status.tries = arm.tries;
                (status.arm_attempt, status.arm_moves) = (arm.attempt, arm.moves);
            }
            Self::Search(search) => status.tries = search.turns,
            Self::Stand | Self::Look(_) | Self::BackUp | Self::Retreat(_) => {}
        }
    }
}

/// By how much the robot must back up for its corners to pass what stands close ahead, in mm.
fn missing_room_mm(helm: &Helm<'_>) -> f32 {
    let Helm { senses, config, .. } = helm;
    let is_of_now = |(seen_at, _): &(Duration, u8)| {
        *seen_at > senses.turned_at && helm.now.saturating_sub(*seen_at) <= IN_SIGHT
    };
    let seen = senses.distance.filter(is_of_now);
    let missing_cm = seen.map_or(0, |(_, cm)| config.turn_room_cm.saturating_sub(cm));
    match config.ranger_cm {
        0 => 0.0,
        _ => f32::from(missing_cm) * config.turn_back_mm,
    }
}
