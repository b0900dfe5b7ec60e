//! The parts of a scene's messages, with the names of the schemas.
//!
//! Lengths are in m, angles in rad. Angles about the vertical turn counter-clockwise from +x.

use serde::Serialize;

/// A moment since 1970.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Time {
    sec: u64,
    nsec: u64,
}

impl Time {
    pub(super) const fn of_ns(unix_ns: u64) -> Self {
        Self {
            sec: unix_ns / 1_000_000_000,
            nsec: unix_ns % 1_000_000_000,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Vector3 {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

pub(super) const fn at(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

impl Quaternion {
    /// About the vertical.
    pub(super) fn turned(angle: f64) -> Self {
        let (z, w) = (angle / 2.0).sin_cos();
        Self {
            x: 0.0,
            y: 0.0,
            z,
            w,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Pose {
    pub(super) position: Vector3,
    pub(super) orientation: Quaternion,
}

impl Pose {
    pub(super) fn new(position: Vector3, angle: f64) -> Self {
        let orientation = Quaternion::turned(angle);
        Self {
            position,
            orientation,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Color {
    r: f64,
    g: f64,
    b: f64,
    a: f64,
}

impl Color {
    pub(super) const TAPE: Self = Self::rgb(0.15, 0.15, 0.15);
    pub(super) const GOODS: Self = Self::rgb(0.85, 0.6, 0.2);
    pub(super) const DELIVERY: Self = Self::rgb(0.2, 0.65, 0.35);
    pub(super) const BLOCKED: Self = Self::rgb(0.85, 0.2, 0.2);
    pub(super) const THING: Self = Self::rgb(0.45, 0.3, 0.25);
    pub(super) const ROBOT: Self = Self::rgb(0.2, 0.4, 0.85);
    pub(super) const BELIEVED: Self = Self {
        a: 0.35,
        ..Self::ROBOT
    };
    pub(super) const LETTERS: Self = Self::rgb(0.5, 0.5, 0.5);

    const fn rgb(r: f64, g: f64, b: f64) -> Self {
        Self { r, g, b, a: 1.0 }
    }
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Cube {
    pub(super) pose: Pose,
    pub(super) size: Vector3,
    pub(super) color: Color,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct Arrow {
    pub(super) pose: Pose,
    pub(super) shaft_length: f64,
    pub(super) shaft_diameter: f64,
    pub(super) head_length: f64,
    pub(super) head_diameter: f64,
    pub(super) color: Color,
}

/// Separate lines: each two points are the ends of one.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Lines {
    #[serde(rename = "type")]
    kind: u8,
    pose: Pose,
    thickness: f64,
    scale_invariant: bool,
    points: Vec<Vector3>,
    color: Color,
    colors: [Color; 0],
    indices: [u32; 0],
}

impl Lines {
    const LINE_LIST: u8 = 2;

    pub(super) fn new(points: Vec<Vector3>, thickness: f64, color: Color) -> Self {
        Self {
            kind: Self::LINE_LIST,
            pose: Pose::new(at(0.0, 0.0, 0.0), 0.0),
            thickness,
            scale_invariant: false,
            points,
            color,
            colors: [],
            indices: [],
        }
    }
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct Label {
    pose: Pose,
    billboard: bool,
    font_size: f64,
    scale_invariant: bool,
    color: Color,
    text: String,
}

impl Label {
    /// A text that turns to whoever looks, its letters so high.
    pub(super) fn new(place: Vector3, height: f64, text: String) -> Self {
        Self {
            pose: Pose::new(place, 0.0),
            billboard: true,
            font_size: height,
            scale_invariant: false,
            color: Color::LETTERS,
            text,
        }
    }
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Lifetime {
    sec: i32,
    nsec: u32,
}

/// Shapes that belong together. They replace earlier shapes with the same id.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Entity {
    timestamp: Time,
    frame_id: &'static str,
    id: &'static str,
    /// 0 is for ever.
    lifetime: Lifetime,
    frame_locked: bool,
    metadata: [(); 0],
    pub(super) arrows: Vec<Arrow>,
    pub(super) cubes: Vec<Cube>,
    spheres: [(); 0],
    cylinders: [(); 0],
    pub(super) lines: Vec<Lines>,
    triangles: [(); 0],
    pub(super) texts: Vec<Label>,
    models: [(); 0],
}

impl Entity {
    /// Without shapes yet. It moves with its frame.
    pub(super) fn new(frame: &'static str, id: &'static str, time: Time) -> Self {
        Self {
            timestamp: time,
            frame_id: frame,
            id,
            lifetime: Lifetime { sec: 0, nsec: 0 },
            frame_locked: true,
            metadata: [],
            arrows: Vec::new(),
            cubes: Vec::new(),
            spheres: [],
            cylinders: [],
            lines: Vec::new(),
            triangles: [],
            texts: Vec::new(),
            models: [],
        }
    }
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct SceneUpdate {
    deletions: [(); 0],
    entities: Vec<Entity>,
}

impl SceneUpdate {
    pub(super) fn of(entities: impl IntoIterator<Item = Entity>) -> Self {
        Self {
            deletions: [],
            entities: entities.into_iter().collect(),
        }
    }
}

impl From<Entity> for SceneUpdate {
    fn from(entity: Entity) -> Self {
        Self::of([entity])
    }
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct PoseInFrame {
    pub(super) timestamp: Time,
    pub(super) frame_id: &'static str,
    pub(super) pose: Pose,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct FrameTransform {
    pub(super) timestamp: Time,
    pub(super) parent_frame_id: &'static str,
    pub(super) child_frame_id: &'static str,
    pub(super) translation: Vector3,
    pub(super) rotation: Quaternion,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct Log {
    pub(super) timestamp: Time,
    pub(super) level: u8,
    pub(super) message: String,
    pub(super) name: &'static str,
    pub(super) file: &'static str,
    pub(super) line: u32,
}
