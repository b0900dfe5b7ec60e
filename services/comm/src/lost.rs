//! What a lost link means to a robot that drives by itself.
//!
//! Logic keeps no time of the link: it is told again and again while the link is lost, so that its
//! successor learns of it too, and once when the link is there again. Where it stands for the link
//! all the same, as after a kill of this process, it is told until it goes on.

use lager_topics::{Hold, Input, InputKind};

use crate::ids::Ids;
use crate::known::Known;
use crate::moment::Moment;

/// In ns of real time: how often logic is told the same.
const REPEAT: u64 = 250_000_000;

/// What a lost link means in autonomous mode. In manual mode the robot stands at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkLost {
    /// It goes on with its orders.
    #[default]
    GoOn,
    /// It ends the edge and stands at the node until the link is there again.
    Stand,
}

/// What logic has been told of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing {
    wanted: LinkLost,
    /// What was told last, and when.
    told: Option<(InputKind, u64)>,
}

impl Standing {
    pub(crate) const fn new(wanted: LinkLost) -> Self {
        Self { wanted, told: None }
    }

    /// What logic is to be told now.
    pub(crate) fn tell(
        &mut self,
        now: Moment,
        is_up: bool,
        known: &Known,
        ids: &mut Ids,
    ) -> Option<Input> {
        let told = self.told.map(|(kind, _)| kind);
        let stands = known.status.is_some_and(|status| status.hold == Hold::Link);
        let kind = match is_up || self.wanted == LinkLost::GoOn {
            false => InputKind::LinkLost,
            true if stands || told == Some(InputKind::LinkLost) => InputKind::LinkBack,
            true => return None,
        };
        let is_fresh = |(_, at)| now.ns.saturating_sub(at) < REPEAT;
        if told == Some(kind) && self.told.is_some_and(is_fresh) {
            return None;
        }
        self.told = Some((kind, now.ns));
        Some(Input {
            kind: kind.into(),
            id: ids.fresh(now),
            ..Input::default()
        })
    }
}
