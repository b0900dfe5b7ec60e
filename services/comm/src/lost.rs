//! Tells logic when the link is lost while the robot drives by itself.
//!
//! Logic does not count the time of the link itself. While the link is lost, comm tells it again
//! and again, so that logic's successor learns it too; and once when the link is there again. If
//! logic stands because of the link although it is there, as after a kill of this process, comm
//! tells it until it goes on.

use lager_operator::{Act, Ids, Wanted};
use lager_orders::Moment;
use lager_topics::{Hold, Input, InputKind};
use serde::{Deserialize, Serialize};

use crate::known::Known;

/// What a lost link means in autonomous mode. In manual mode the robot stands at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkLost {
    /// It goes on with its orders.
    #[default]
    GoOn,
    /// It drives to the next node and stands there until the link is there again.
    Stand,
}

/// What comm has told logic of the link.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    wanted: LinkLost,
    told: Wanted,
}

impl Standing {
    pub(crate) fn new(wanted: LinkLost) -> Self {
        let told = Wanted::default();
        Self { wanted, told }
    }

    /// What to tell logic now.
    pub(crate) fn tell(
        &mut self,
        now: Moment,
        is_up: bool,
        known: &Known,
        ids: &mut Ids,
    ) -> Option<Act> {
        let stands = known.status.is_some_and(|status| status.hold == Hold::Link);
        let kind = match is_up || self.wanted == LinkLost::GoOn {
            false => Some(InputKind::LinkLost),
            true if stands || self.told.is_pressed(InputKind::LinkLost) => {
                Some(InputKind::LinkBack)
            }
            true => None,
        };
        let press = kind.map(|kind| {
            Act::Press(Input {
                kind: kind.into(),
                ..Input::default()
            })
        });
        self.told.turn(now.ns, ids, press)
    }
}
