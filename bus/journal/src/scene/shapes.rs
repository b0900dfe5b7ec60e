//! The parts of a scene's messages, with the names of the schemas.
//!
//! Lengths are in m, angles in rad. Angles about the vertical turn counter-clockwise from +x.

use serde::Serialize;

/// A moment since 1970.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Time {
    /// Seconds.
    pub sec: u64,
    /// The rest in ns.
    pub nsec: u64,
}

impl Time {
    /// That many ns since 1970.
    pub const fn of_ns(unix_ns: u64) -> Self {
        Self {
            sec: unix_ns / 1_000_000_000,
            nsec: unix_ns % 1_000_000_000,
        }
    }
}

/// A place, or lengths along the axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Vector3 {
    /// To the right, or ahead.
    pub x: f64,
    /// Up on the map, or to the left.
    pub y: f64,
    /// Off the floor.
    pub z: f64,
}

/// A place.
pub const fn at(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

/// A rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quaternion {
    /// Of the axis; 0 here, as everything turns about the vertical.
    pub x: f64,
    /// Of the axis; 0 here.
    pub y: f64,
    /// The sine of half the angle.
    pub z: f64,
    /// The cosine of half the angle.
    pub w: f64,
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

/// A place and a direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pose {
    /// The place.
    pub position: Vector3,
    /// The direction.
    pub orientation: Quaternion,
}

impl Pose {
    /// The pose at `position`, turned by `angle` about the vertical.
    pub fn new(position: Vector3, angle: f64) -> Self {
        let orientation = Quaternion::turned(angle);
        Self {
            position,
            orientation,
        }
    }
}

/// A colour, each part from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Color {
    /// Red.
    pub r: f64,
    /// Green.
    pub g: f64,
    /// Blue.
    pub b: f64,
    /// 0 is clear.
    pub a: f64,
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

/// A box.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cube {
    /// Its middle.
    pub pose: Pose,
    /// Its sides.
    pub size: Vector3,
    /// Its colour.
    pub color: Color,
}

/// An arrow along x.
#[derive(Clone, Debug, Serialize)]
pub struct Arrow {
    /// Its foot.
    pub pose: Pose,
    /// Without the head.
    pub shaft_length: f64,
    /// How thick it is.
    pub shaft_diameter: f64,
    /// Of the head alone.
    pub head_length: f64,
    /// How thick the head is.
    pub head_diameter: f64,
    /// Its colour.
    pub color: Color,
}

/// Separate lines: each two points are the ends of one.
#[derive(Clone, Debug, Serialize)]
pub struct Lines {
    #[serde(rename = "type")]
    kind: u8,
    pose: Pose,
    /// How thick the lines are.
    pub thickness: f64,
    scale_invariant: bool,
    /// The ends, two for each line.
    pub points: Vec<Vector3>,
    /// Their colour.
    pub color: Color,
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

/// A text that turns to whoever looks.
#[derive(Clone, Debug, Serialize)]
pub struct Label {
    /// Where it stands.
    pub pose: Pose,
    billboard: bool,
    /// The height of its letters.
    pub font_size: f64,
    scale_invariant: bool,
    /// Its colour.
    pub color: Color,
    /// The text.
    pub text: String,
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
pub struct Entity {
    timestamp: Time,
    /// The frame of its coordinates.
    pub frame_id: &'static str,
    /// Its name.
    pub id: &'static str,
    /// 0 is for ever.
    lifetime: Lifetime,
    frame_locked: bool,
    metadata: [(); 0],
    /// Arrows.
    pub arrows: Vec<Arrow>,
    /// Boxes.
    pub cubes: Vec<Cube>,
    spheres: [(); 0],
    cylinders: [(); 0],
    /// Lines.
    pub lines: Vec<Lines>,
    triangles: [(); 0],
    /// Texts.
    pub texts: Vec<Label>,
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

/// Shapes to be shown in place of earlier ones with the same ids.
#[derive(Clone, Debug, Serialize)]
pub struct SceneUpdate {
    deletions: [(); 0],
    /// The shapes.
    pub entities: Vec<Entity>,
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

/// A line of a log.
#[derive(Clone, Debug, Serialize)]
pub struct Log {
    /// When it was said.
    pub timestamp: Time,
    /// 2 tells, 3 warns.
    pub level: u8,
    /// The sentence.
    pub message: String,
    /// Who says it.
    pub name: &'static str,
    /// Empty: it is not said of a program's text.
    pub file: &'static str,
    /// 0.
    pub line: u32,
}
