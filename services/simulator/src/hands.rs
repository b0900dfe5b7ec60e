//! What a person's hands would do in the world: requests from the bus in terms of the plant.
//!
//! Apart from the shell because the emulator's service has the same requests to answer.

use lager_plant::scene::pose_at;
use lager_plant::{Edge, HandsOff, Pose, Warehouse};
use lager_ports::Clock;
use lager_topics::{Heading, Outcome, WorldAnswer, WorldAsk, WorldAskKind, WorldRefusal};

/// Something that hands can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// Take the robot up and put it here, at rest.
    Place(Pose),
    /// Put a thing on this edge.
    Put(Edge),
    /// Take the thing on this edge away.
    Take(Edge),
}

/// What a request wants of the world.
///
/// # Errors
/// What to answer: it came too late, or the warehouse has no such place.
pub fn wish(warehouse: &Warehouse, ask: &WorldAsk) -> Result<Wish, WorldAnswer> {
    if ask.is_over(Clock::monotonic_ns()) {
        return Err(WorldAnswer {
            outcome: Outcome::Late.into(),
            ..WorldAnswer::default()
        });
    }
    let wanted = match ask.kind.get() {
        Some(WorldAskKind::Place) => place(warehouse, ask).map(Wish::Place),
        Some(WorldAskKind::Put) => edge(warehouse, ask).map(Wish::Put),
        Some(WorldAskKind::Take) => edge(warehouse, ask).map(Wish::Take),
        None => None,
    };
    wanted.ok_or_else(|| refused(WorldRefusal::NoPlace))
}

/// What is answered to a wish that was tried.
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

fn place(warehouse: &Warehouse, ask: &WorldAsk) -> Option<Pose> {
    let quarters = match ask.heading.get()? {
        Heading::Right => 0,
        Heading::Up => 1,
        Heading::Left => 2,
        Heading::Down => 3,
    };
    pose_at(warehouse, [ask.x, ask.y], quarters)
}

/// The edge that leaves the node towards the heading.
fn edge(warehouse: &Warehouse, ask: &WorldAsk) -> Option<Edge> {
    let (x, y) = (ask.x, ask.y);
    let to = match ask.heading.get()? {
        Heading::Right => [x.checked_add(1)?, y],
        Heading::Up => [x, y.checked_add(1)?],
        Heading::Left => [x.checked_sub(1)?, y],
        Heading::Down => [x, y.checked_sub(1)?],
    };
    let inside = |node: [u8; 2]| node[0] <= warehouse.size[0] && node[1] <= warehouse.size[1];
    Edge::between([x, y], to).filter(|edge| inside(edge.from) && inside(edge.to))
}
