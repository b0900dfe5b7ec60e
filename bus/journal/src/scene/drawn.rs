//! How each topic is drawn.

use std::f64::consts::{FRAC_PI_2, PI};

use lager_floor::Heading;
use lager_sample::Tag;
use lager_topics::{
    BlockSource, BlockedWays, FailureKind, GoodState, Pose as Believed, Thought, ThoughtKind,
    Truth, WarehouseMap,
};

use super::shapes::{
    Arrow, Color, Cube, Entity, FrameTransform, Label, Lines, Log, Pose, PoseInFrame, SceneUpdate,
    Time, Vector3, at,
};

/// The frame of the warehouse.
pub const MAP: &str = "map";
/// The frame of the robot, its origin on the floor below the middle of the axle, x ahead.
pub const ROBOT: &str = "robot";
/// The same, at the place where the navigator believes the robot to be.
pub const NAVIGATOR: &str = "navigator";

/// The tape's width, in m.
const TAPE_M: f64 = 0.02;
/// Goods are cubes of this side, in m.
const GOODS_M: f64 = 0.05;
/// The size of a thing that stands on a way, in m.
const THING_M: f64 = 0.1;
/// The height of letters, in m.
const LETTERS_M: f64 = 0.06;

/// Levels of a log.
const INFO: u8 = 2;
const WARNING: u8 = 3;

/// The side of a square in m; 0 = not known.
pub fn side_m(map: &WarehouseMap) -> f64 {
    f64::from(map.side_length_cm) / 100.0
}

/// The warehouse: tape, places of goods, and where they are delivered.
pub fn map(map: &WarehouseMap, time: Time) -> SceneUpdate {
    let side = side_m(map);
    let (width, height) = (f64::from(map.width) * side, f64::from(map.height) * side);
    let mut tape = Vec::new();
    for row in 0..=map.height {
        let y = f64::from(row) * side;
        tape.extend([at(0.0, y, 0.0), at(width, y, 0.0)]);
    }
    for column in 0..=map.width {
        let x = f64::from(column) * side;
        tape.extend([at(x, 0.0, 0.0), at(x, height, 0.0)]);
    }
    let mut entity = Entity::new(MAP, "map", time);
    entity.lines.push(Lines::new(tape, TAPE_M, Color::TAPE));
    let delivery = node(map.delivery_x, map.delivery_y, side);
    entity.cubes.push(flat(delivery, THING_M, Color::DELIVERY));
    entity.texts.push(Label::new(
        at(delivery.x, delivery.y, 2.0 * LETTERS_M),
        LETTERS_M,
        "delivery".to_owned(),
    ));
    for product in map.products() {
        let Some(place) = product.side.get().map(|which| match which {
            Heading::Left => (0.0, 0.5),
            Heading::Right => (1.0, 0.5),
            Heading::Up => (0.5, 1.0),
            Heading::Down => (0.5, 0.0),
        }) else {
            continue;
        };
        let x = (f64::from(product.x) + place.0) * side;
        let y = (f64::from(product.y) + place.1) * side;
        entity
            .cubes
            .push(flat(at(x, y, 0.0), GOODS_M, Color::GOODS));
        let text = product.id.to_string();
        let above = at(x, y, 2.0 * LETTERS_M);
        entity.texts.push(Label::new(above, LETTERS_M, text));
    }
    entity.into()
}

/// The ways that are blocked, as the robot knows them.
pub fn blocks(ways: &BlockedWays, map: &WarehouseMap, time: Time) -> SceneUpdate {
    let side = side_m(map);
    let mut entity = Entity::new(MAP, "blocks", time);
    for way in ways.ways() {
        let middle = middle(way.x, way.y, way.heading, side);
        entity.cubes.push(flat(middle, THING_M, Color::BLOCKED));
        let text = match way.source.get() {
            Some(BlockSource::Person) => "blocked, says a person",
            Some(BlockSource::Sensor) | None => "blocked",
        };
        let above = at(middle.x, middle.y, 2.0 * LETTERS_M);
        entity
            .texts
            .push(Label::new(above, LETTERS_M, text.to_owned()));
    }
    entity.into()
}

/// Goods and things on the floor, where they really are.
pub fn world(truth: &Truth, side: f64, time: Time) -> SceneUpdate {
    let mut entity = Entity::new(MAP, "world", time);
    for good in truth.goods() {
        let [x, y, z] = [good.x_mm, good.y_mm, good.z_mm].map(|mm| f64::from(mm) / 1000.0);
        let color = match good.state.get() {
            Some(GoodState::Delivered) => Color::DELIVERY,
            _ => Color::GOODS,
        };
        entity.cubes.push(Cube {
            pose: Pose::new(at(x, y, z + GOODS_M / 2.0), 0.0),
            size: at(GOODS_M, GOODS_M, GOODS_M),
            color,
        });
        let above = at(x, y, z + GOODS_M + LETTERS_M);
        let text = good.id.to_string();
        entity.texts.push(Label::new(above, LETTERS_M, text));
    }
    for thing in truth.obstacles() {
        let foot = middle(thing.x, thing.y, thing.heading, side);
        entity.cubes.push(Cube {
            pose: Pose::new(at(foot.x, foot.y, THING_M), 0.0),
            size: at(THING_M, THING_M, 2.0 * THING_M),
            color: Color::THING,
        });
    }
    entity.into()
}

/// A body in each of the robot's frames.
pub fn bodies(time: Time) -> SceneUpdate {
    let body = |frame: &'static str, id: &'static str, color: Color| {
        let mut entity = Entity::new(frame, id, time);
        entity.cubes.push(Cube {
            pose: Pose::new(at(0.04, 0.0, 0.06), 0.0),
            size: at(0.22, 0.16, 0.08),
            color,
        });
        entity.arrows.push(Arrow {
            pose: Pose::new(at(0.0, 0.0, 0.12), 0.0),
            shaft_length: 0.1,
            shaft_diameter: 0.02,
            head_length: 0.06,
            head_diameter: 0.05,
            color,
        });
        entity
    };
    let robot = body(ROBOT, "robot", Color::ROBOT);
    let believed = body(NAVIGATOR, "navigator", Color::BELIEVED);
    SceneUpdate::of([robot, believed])
}

pub(super) fn pose(truth: &Truth, time: Time) -> PoseInFrame {
    in_map(truth_pose(truth), time)
}

pub(super) fn frame(truth: &Truth, time: Time) -> FrameTransform {
    moved(ROBOT, truth_pose(truth), time)
}

pub(super) fn believed(pose: Believed, time: Time) -> PoseInFrame {
    in_map(believed_pose(pose), time)
}

pub(super) fn believed_frame(pose: Believed, time: Time) -> FrameTransform {
    moved(NAVIGATOR, believed_pose(pose), time)
}

/// A service's thought. A failure, and everything that makes the robot wait, is a warning.
pub fn log(thought: &Thought, time: Time) -> Log {
    let is_failure = thought.failure.kind.get() != Some(FailureKind::None);
    let is_warning = is_failure
        || matches!(
            thought.kind.get(),
            Some(
                ThoughtKind::BoardUnheard
                    | ThoughtKind::Blind
                    | ThoughtKind::BatteryLow
                    | ThoughtKind::LinkLost
                    | ThoughtKind::Failed
            )
        );
    Log {
        timestamp: time,
        level: if is_warning { WARNING } else { INFO },
        message: thought.to_string(),
        name: thought.from.get().map_or("", |role| role.as_str()),
        file: "",
        line: 0,
    }
}

fn in_map(pose: Pose, time: Time) -> PoseInFrame {
    PoseInFrame {
        timestamp: time,
        frame_id: MAP,
        pose,
    }
}

fn moved(frame: &'static str, pose: Pose, time: Time) -> FrameTransform {
    FrameTransform {
        timestamp: time,
        parent_frame_id: MAP,
        child_frame_id: frame,
        translation: pose.position,
        rotation: pose.orientation,
    }
}

/// Where the robot really is.
pub fn truth_pose(truth: &Truth) -> Pose {
    let place = at(truth.x_mm / 1000.0, truth.y_mm / 1000.0, 0.0);
    Pose::new(place, truth.heading_rad)
}

/// Where the navigator believes the robot to be.
pub fn believed_pose(pose: Believed) -> Pose {
    let place = at(
        f64::from(pose.x_mm) / 1000.0,
        f64::from(pose.y_mm) / 1000.0,
        0.0,
    );
    // The payload counts clockwise from "up"; the viewer counts the other way, from "right".
    let angle = FRAC_PI_2 - f64::from(pose.heading_deg) * PI / 180.0;
    Pose::new(place, angle)
}

fn node(x: u8, y: u8, side: f64) -> Vector3 {
    at(f64::from(x) * side, f64::from(y) * side, 0.0)
}

/// The middle of a way from a node.
fn middle(x: u8, y: u8, heading: Tag<Heading>, side: f64) -> Vector3 {
    let (right, up) = match heading.get() {
        Some(Heading::Left) => (-0.5, 0.0),
        Some(Heading::Up) => (0.0, 0.5),
        Some(Heading::Right) => (0.5, 0.0),
        Some(Heading::Down) => (0.0, -0.5),
        None => (0.0, 0.0),
    };
    at(
        (f64::from(x) + right) * side,
        (f64::from(y) + up) * side,
        0.0,
    )
}

/// A mark on the floor.
fn flat(place: Vector3, side: f64, color: Color) -> Cube {
    Cube {
        pose: Pose::new(at(place.x, place.y, 0.002), 0.0),
        size: at(side, side, 0.004),
        color,
    }
}
