//! Drives straight back to a reading of the odometer: away from the cross bar, to turn round, or to
//! a place with room for a turn.

use core::time::Duration;

use lager_floor::Heading;
use lager_topics::NavigatorStatus;
use lager_wire::{Command, WheelCommand};

use super::behaviour::Behaviour;
use super::helm::{Helm, Senses};
use super::turn::{Spot, Turn};
use crate::config::LogicConfig;
use crate::ending::Ending;

/// How old a distance may be to show whether there is room to turn.
const IN_SIGHT: Duration = Duration::from_millis(500);
/// Driving back.
const BACKWARD: Command = Command::Wheel(WheelCommand::ManualBackward);

/// A drive straight back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BackUp {
    /// The odometer's reading at its end, in mm.
    to_mm: f32,
    /// Its ending.
    then: Ending,
}

impl BackUp {
    /// A drive back that is the phase's own manoeuvre.
    pub(crate) fn to(to_mm: f32) -> Self {
        let then = Ending::Done;
        Self { to_mm, then }
    }

    /// The drive back that a turn here needs first. A thing so close behind the node would touch a
    /// corner of the body. A turn so near to the node ahead would end on the tape that crosses
    /// there. For the same reason a drive back may replace the turn to the node that the robot has
    /// just left.
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
                // A way out may be so short that it has no place between both.
                let farthest_mm = (length_mm - nearest_mm).max(nearest_mm + 2.0 * coast_mm);
                (travelled_mm > farthest_mm).then_some(Self {
                    to_mm: farthest_mm - coast_mm,
                    then: Ending::Ready,
                })
            }
            Spot::Node if travelled_mm > room_at_mm => Some(Self {
                to_mm: room_at_mm,
                then: Ending::Ready,
            }),
            _ => None,
        }
    }

    /// The same, as an earlier navigator left it; its order `ordered` stood in place of the turn.
    pub(super) fn kept(
        turn: &Turn,
        status: &NavigatorStatus,
        ordered: Command,
        config: &LogicConfig,
    ) -> Option<Self> {
        let at_mm = status.travelled_mm as f32;
        (ordered == BACKWARD).then(|| match turn.spot {
            Spot::Along(_) if at_mm < config.nearest_turn_mm() => Self::to(config.coast_mm),
            // It ends here, and the room is checked again.
            _ => Self {
                to_mm: at_mm,
                then: Ending::Ready,
            },
        })
    }
}

impl Behaviour for BackUp {
    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        BACKWARD
    }

    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        (helm.senses.odometer.travelled_mm <= self.to_mm).then_some(self.then)
    }
}

/// How far the robot must back up so that its corners pass a thing close ahead, in mm.
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
