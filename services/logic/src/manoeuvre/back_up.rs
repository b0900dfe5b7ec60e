//! Driving straight back until the odometer reads so many mm: away from the cross bar, to turn
//! round, or to where there is room for a turn.

use core::time::Duration;

use lager_topics::{Heading, NavigatorStatus};
use lager_wire::{Command, WheelCommand};

use super::behaviour::Behaviour;
use super::helm::{Helm, Senses};
use super::turn::{Spot, Turn};
use crate::config::LogicConfig;
use crate::outcome::Outcome;

/// How old a distance may be that tells whether there is room to turn.
const IN_SIGHT: Duration = Duration::from_millis(500);
/// Driving back.
const BACKWARD: Command = Command::Wheel(WheelCommand::ManualBackward);

/// A drive straight back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BackUp {
    /// What the odometer reads at its end, in mm.
    to_mm: f32,
    /// What it ends in.
    then: Outcome,
}

impl BackUp {
    /// A drive back that is a phase's own.
    pub(crate) fn to(to_mm: f32) -> Self {
        let then = Outcome::Done;
        Self { to_mm, then }
    }

    /// What must come before a turn here: away from what stands so close behind the node that a
    /// corner of the body would touch it; away from the node ahead, as a turn so near to it would
    /// end on the tape that crosses there; or, for the same reason, instead of the turn to the node
    /// that the robot has just left.
    pub(super) fn before(turn: &Turn, helm: &Helm<'_>) -> Option<Self> {
        let travelled_mm = helm.senses.odometer.travelled_mm;
        let (nearest_mm, coast_mm) = (helm.config.nearest_turn_mm(), helm.config.coast_mm);
        let most_mm = match helm.senses.free_behind {
            true => helm.config.turn_room_mm,
            false => helm.config.turn_back_mm,
        };
        let room_at_mm = (travelled_mm - missing_room_mm(helm)).max(-most_mm);
        match turn.spot {
            Spot::Along(_) if travelled_mm < nearest_mm => Some(Self::to(coast_mm)),
            Spot::Along(length_mm) => {
                // A way out may be so short that there is no place between both.
                let farthest_mm = (length_mm - nearest_mm).max(nearest_mm + 2.0 * coast_mm);
                (travelled_mm > farthest_mm).then_some(Self {
                    to_mm: farthest_mm - coast_mm,
                    then: Outcome::Ready,
                })
            }
            Spot::Node if travelled_mm > room_at_mm => Some(Self {
                to_mm: room_at_mm,
                then: Outcome::Ready,
            }),
            _ => None,
        }
    }

    /// The same as a predecessor left it, which had `ordered` this in place of the turn.
    pub(super) fn kept(
        turn: &Turn,
        status: &NavigatorStatus,
        ordered: Command,
        config: &LogicConfig,
    ) -> Option<Self> {
        let at_mm = status.travelled_mm as f32;
        (ordered == BACKWARD).then(|| match turn.spot {
            Spot::Along(_) if at_mm < config.nearest_turn_mm() => Self::to(config.coast_mm),
            // It ends here, and what room there is now is looked at anew.
            _ => Self {
                to_mm: at_mm,
                then: Outcome::Ready,
            },
        })
    }
}

impl Behaviour for BackUp {
    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        BACKWARD
    }

    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Outcome> {
        (helm.senses.odometer.travelled_mm <= self.to_mm).then_some(self.then)
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
