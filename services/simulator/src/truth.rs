//! The simulated world as a sample of `truth/pose`, and the world back from a sample.

use core::time::Duration;

use lager_floor::{Edge, Node};
use lager_plant::{Good, GoodState, Pose, Snapshot, Standing, WorldState};
use lager_topics as topics;

/// The sample for the true state `truth`.
pub fn message(truth: &Snapshot) -> topics::Truth {
    let world = &truth.world;
    let mut message = topics::Truth {
        time_ns: world.time.as_nanos() as u64,
        x_mm: world.pose.x,
        y_mm: world.pose.y,
        heading_rad: world.pose.heading,
        left_mm_per_s: world.wheel_speeds[0] as f32,
        right_mm_per_s: world.wheel_speeds[1] as f32,
        carrying: truth.carrying.unwrap_or(-1),
        left_duty: truth.duties[0].unsigned_abs().min(255) as u8,
        right_duty: truth.duties[1].unsigned_abs().min(255) as u8,
        servo_position: world.servo_positions,
        battery_charge: world.battery_charge as f32,
        collisions: world.collisions,
        reset_closed: world.closed[0].into(),
        mode_closed: world.closed[1].into(),
        lines_low: world.levels.low,
        lines_high: world.levels.high,
        ..topics::Truth::default()
    };
    for (place, good) in message.goods.iter_mut().zip(&world.goods) {
        *place = topics::TruthGood {
            id: good.id,
            x_mm: good.position[0] as f32,
            y_mm: good.position[1] as f32,
            z_mm: good.position[2] as f32,
            state: match good.state {
                GoodState::Shelf => topics::GoodState::Shelf,
                GoodState::Held => topics::GoodState::Held,
                GoodState::Lying => topics::GoodState::Lying,
                GoodState::Delivered => topics::GoodState::Delivered,
            }
            .into(),
            ..topics::TruthGood::default()
        };
    }
    for (place, stands) in message.obstacles.iter_mut().zip(&world.obstacles) {
        let Node { x, y } = stands.edge.from;
        *place = topics::TruthObstacle {
            x,
            y,
            heading: stands.edge.heading().into(),
            by_chance: stands.by_chance.into(),
        };
    }
    message.obstacle_count = world.obstacles.len().min(message.obstacles.len()) as u16;
    message.good_count = world.goods.len().min(message.goods.len()) as u16;
    message
}

/// The world in a sample. Goods in a state that this build does not know are left out, so they stay
/// where the warehouse has them.
pub fn world_state(message: &topics::Truth) -> WorldState {
    let goods = message.goods().iter().filter_map(|good| {
        Some(Good {
            id: good.id,
            position: [good.x_mm, good.y_mm, good.z_mm].map(f64::from),
            state: match good.state.get()? {
                topics::GoodState::Shelf => GoodState::Shelf,
                topics::GoodState::Held => GoodState::Held,
                topics::GoodState::Lying => GoodState::Lying,
                topics::GoodState::Delivered => GoodState::Delivered,
            },
        })
    });
    let obstacles = message.obstacles().iter().filter_map(|stands| {
        Some(Standing {
            edge: Edge::leaving(Node::new(stands.x, stands.y), stands.heading.get()?)?,
            by_chance: stands.by_chance != 0,
        })
    });
    WorldState {
        time: Duration::from_nanos(message.time_ns),
        pose: Pose {
            x: message.x_mm,
            y: message.y_mm,
            heading: message.heading_rad,
        },
        wheel_speeds: [message.left_mm_per_s, message.right_mm_per_s].map(f64::from),
        servo_positions: message.servo_position.map(|position| position.min(1_023)),
        goods: goods.collect(),
        battery_charge: f64::from(message.battery_charge),
        collisions: message.collisions,
        obstacles: obstacles.collect(),
        closed: [message.reset_closed, message.mode_closed].map(|closed| closed != 0),
        levels: message.levels(),
    }
}

#[cfg(test)]
mod tests {
    use lager_floor::Heading;

    use super::*;

    #[test]
    fn a_world_survives_its_message() {
        let good = |id, state| Good {
            id,
            position: [1.5, -2.0, 25.0],
            state,
        };
        let world = WorldState {
            time: Duration::from_millis(12_345),
            pose: Pose {
                x: 100.25,
                y: -3.0,
                heading: 1.5,
            },
            wheel_speeds: [73.0, -20.5],
            servo_positions: [1, 2, 3, 4, 5, 6, 7, 1_023],
            goods: vec![
                good(7, GoodState::Shelf),
                good(8, GoodState::Held),
                good(9, GoodState::Lying),
                good(10, GoodState::Delivered),
            ],
            battery_charge: 0.625,
            collisions: 3,
            obstacles: vec![
                Standing {
                    edge: Edge::of(Node::new(1, 2), Heading::Down),
                    by_chance: true,
                },
                Standing {
                    edge: Edge::of(Node::new(0, 0), Heading::Left),
                    by_chance: false,
                },
            ],
            closed: [true, false],
            levels: topics::Levels {
                low: 1 << 17,
                high: 1 << 27,
            },
        };
        let truth = Snapshot {
            world: world.clone(),
            duties: [-100, 120],
            carrying: Some(8),
        };
        let message = message(&truth);
        assert_eq!(world_state(&message), world);
        assert_eq!((message.left_duty, message.right_duty), (100, 120));
        assert_eq!(message.carrying, 8);
    }
}
