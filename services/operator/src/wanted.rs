//! [`Wanted`]: one order that is wanted until the robot shows it, for programs that give one order
//! after the other, as a mission does.

use lager_topics::{Input, InputKind};

use crate::ids::Ids;
use crate::orders::{Act, REPEAT};

/// The order, and when it was given last.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    given: Option<(Act, u64)>,
}

impl Wanted {
    /// The thing to do now, in ns of real time, if `wanted` is given: at once, and then every 250
    /// ms. A press and a request get a new number each time.
    pub fn turn(&mut self, now_ns: u64, ids: &mut Ids, wanted: Option<Act>) -> Option<Act> {
        let before = self.given.take();
        let act = wanted?;
        let at = before.filter(|(given, _)| *given == act).map(|(_, at)| at);
        if let Some(at) = at.filter(|at| now_ns.saturating_sub(*at) < REPEAT) {
            self.given = Some((act, at));
            return None;
        }
        self.given = Some((act.clone(), now_ns));
        let mut id = || ids.fresh(now_ns);
        Some(match act {
            Act::Press(input) => Act::Press(Input { id: id(), ..input }),
            Act::Ask { ask, .. } => Act::Ask { id: id(), ask },
            Act::AskWorld { ask, .. } => Act::AskWorld { id: id(), ask },
            Act::Order(_) => act,
        })
    }

    /// Whether this press was given last.
    pub fn is_pressed(&self, kind: InputKind) -> bool {
        matches!(&self.given, Some((Act::Press(input), _)) if input.kind == kind)
    }
}
