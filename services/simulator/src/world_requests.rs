//! Requests to change the simulated world as a person's hands would: translates them from the bus
//! into the plant's terms, and the result back.
//!
//! The emulator's service answers the same requests, so this is apart from the shell.

use lager_floor::{Edge, Node, Place};
use lager_home::Clock;
use lager_plant::scene::pose_at;
use lager_plant::{Hand, HandsOff, Warehouse};
use lager_topics::{Outcome, WorldAnswer, WorldAsk, WorldAskKind, WorldRefusal};

/// The change of the world for a request.
///
/// # Errors
/// The answer, if the request came too late or the warehouse has no such place.
pub fn wish(warehouse: &Warehouse, ask: &WorldAsk) -> Result<Hand, WorldAnswer> {
    if ask.is_over(Clock::monotonic_ns()) {
        return Err(WorldAnswer {
            outcome: Outcome::Late.into(),
            ..WorldAnswer::default()
        });
    }
    let wanted = || {
        let at = Place::new(Node::new(ask.x, ask.y), ask.heading.get()?);
        match ask.kind.get()? {
            WorldAskKind::Place => pose_at(warehouse, at).map(Hand::Place),
            WorldAskKind::Put => edge(warehouse, at).map(Hand::Put),
            WorldAskKind::Take => edge(warehouse, at).map(Hand::Take),
            WorldAskKind::Lift => Some(Hand::Lift),
            WorldAskKind::Hold => Some(Hand::Hold(ask.x)),
            WorldAskKind::Bring => Some(Hand::Bring(ask.x, u16::from(ask.y) * 4)),
            WorldAskKind::Fill => Some(Hand::Fill(ask.x != 0)),
            WorldAskKind::Press => Some(Hand::Press(ask.x, ask.y != 0)),
            WorldAskKind::Shift => Some(Hand::Shift(i16::from(ask.x) - 128)),
        }
    };
    wanted().ok_or_else(|| refused(WorldRefusal::NoPlace))
}

/// The answer to the result of a change.
pub fn answer(tried: Result<(), HandsOff>) -> WorldAnswer {
    match tried {
        Ok(()) => WorldAnswer {
            outcome: Outcome::Done.into(),
            ..WorldAnswer::default()
        },
        Err(HandsOff::NoEdge) => refused(WorldRefusal::NoPlace),
        Err(HandsOff::NoRoom) => refused(WorldRefusal::NoRoom),
        Err(HandsOff::RobotThere) => refused(WorldRefusal::RobotThere),
        Err(HandsOff::NothingThere) => refused(WorldRefusal::NothingThere),
        Err(HandsOff::Full) => refused(WorldRefusal::Full),
    }
}

fn refused(refusal: WorldRefusal) -> WorldAnswer {
    WorldAnswer {
        outcome: Outcome::Refused.into(),
        refusal: refusal.into(),
        ..WorldAnswer::default()
    }
}

/// The edge that begins at this place's node in its direction, if the warehouse has it.
fn edge(warehouse: &Warehouse, at: Place) -> Option<Edge> {
    let inside = |node: Node| node.x <= warehouse.size.x && node.y <= warehouse.size.y;
    Edge::leaving(at.node, at.heading).filter(|edge| inside(edge.from) && inside(edge.to))
}
