//! The `foxglove.*` schemas as JSON Schema, for the four kinds of message that a scene has.
//!
//! The fields, their kinds and the list of required ones are those of the published schemas
//! (`@foxglove/schemas` 2.1.0), without the descriptions. A test compares them by CRC.

use serde_json::{Map, Value, json};

/// A message's kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Shapes that are put into the picture, changed, or taken out of it.
    SceneUpdate,
    /// A place in one frame of coordinates.
    PoseInFrame,
    /// Where one frame of coordinates is in another.
    FrameTransform,
    /// A line of a log.
    Log,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 4] = [
        Self::SceneUpdate,
        Self::PoseInFrame,
        Self::FrameTransform,
        Self::Log,
    ];

    /// The schema's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SceneUpdate => "foxglove.SceneUpdate",
            Self::PoseInFrame => "foxglove.PoseInFrame",
            Self::FrameTransform => "foxglove.FrameTransform",
            Self::Log => "foxglove.Log",
        }
    }

    /// The JSON Schema.
    pub fn schema(self) -> Value {
        let name = self.name();
        match self {
            Self::SceneUpdate => {
                let deletion = object(
                    "foxglove.SceneEntityDeletion",
                    [
                        ("timestamp", time()),
                        (
                            "type",
                            choice("foxglove.SceneEntityDeletionType", &["MATCHING_ID", "ALL"]),
                        ),
                        ("id", text()),
                    ],
                );
                object(
                    name,
                    [("deletions", list(deletion)), ("entities", list(entity()))],
                )
            }
            Self::PoseInFrame => object(
                name,
                [
                    ("timestamp", time()),
                    ("frame_id", text()),
                    ("pose", pose()),
                ],
            ),
            Self::FrameTransform => object(
                name,
                [
                    ("timestamp", time()),
                    ("parent_frame_id", text()),
                    ("child_frame_id", text()),
                    ("translation", vector3()),
                    ("rotation", quaternion()),
                ],
            ),
            Self::Log => {
                let levels = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
                object(
                    name,
                    [
                        ("timestamp", time()),
                        ("level", choice("foxglove.LogLevel", &levels)),
                        ("message", text()),
                        ("name", text()),
                        ("file", text()),
                        ("line", natural()),
                    ],
                )
            }
        }
    }
}

fn entity() -> Value {
    let pair = object(
        "foxglove.KeyValuePair",
        [("key", text()), ("value", text())],
    );
    let duration = json!({
        "type": "object", "title": "duration",
        "properties": {"sec": {"type": "integer"}, "nsec": nanoseconds()},
    });
    object(
        "foxglove.SceneEntity",
        [
            ("timestamp", time()),
            ("frame_id", text()),
            ("id", text()),
            ("lifetime", duration),
            ("frame_locked", truth()),
            ("metadata", list(pair)),
            ("arrows", list(arrow())),
            ("cubes", list(solid("foxglove.CubePrimitive"))),
            ("spheres", list(solid("foxglove.SpherePrimitive"))),
            ("cylinders", list(cylinder())),
            ("lines", list(line())),
            ("triangles", list(triangles())),
            ("texts", list(label())),
            ("models", list(model())),
        ],
    )
}

fn arrow() -> Value {
    object(
        "foxglove.ArrowPrimitive",
        [
            ("pose", pose()),
            ("shaft_length", number()),
            ("shaft_diameter", number()),
            ("head_length", number()),
            ("head_diameter", number()),
            ("color", color()),
        ],
    )
}

fn solid(title: &str) -> Value {
    object(
        title,
        [("pose", pose()), ("size", vector3()), ("color", color())],
    )
}

fn cylinder() -> Value {
    object(
        "foxglove.CylinderPrimitive",
        [
            ("pose", pose()),
            ("size", vector3()),
            ("bottom_scale", number()),
            ("top_scale", number()),
            ("color", color()),
        ],
    )
}

fn line() -> Value {
    let kinds = ["LINE_STRIP", "LINE_LOOP", "LINE_LIST"];
    object(
        "foxglove.LinePrimitive",
        [
            ("type", choice("foxglove.LineType", &kinds)),
            ("pose", pose()),
            ("thickness", number()),
            ("scale_invariant", truth()),
            ("points", list(point3())),
            ("color", color()),
            ("colors", list(color())),
            ("indices", list(natural())),
        ],
    )
}

fn triangles() -> Value {
    object(
        "foxglove.TriangleListPrimitive",
        [
            ("pose", pose()),
            ("points", list(point3())),
            ("color", color()),
            ("colors", list(color())),
            ("indices", list(natural())),
        ],
    )
}

fn label() -> Value {
    object(
        "foxglove.TextPrimitive",
        [
            ("pose", pose()),
            ("billboard", truth()),
            ("font_size", number()),
            ("scale_invariant", truth()),
            ("color", color()),
            ("text", text()),
        ],
    )
}

fn model() -> Value {
    object(
        "foxglove.ModelPrimitive",
        [
            ("pose", pose()),
            ("scale", vector3()),
            ("color", color()),
            ("override_color", truth()),
            ("url", text()),
            ("media_type", text()),
            (
                "data",
                json!({"type": "string", "contentEncoding": "base64"}),
            ),
        ],
    )
}

fn pose() -> Value {
    object(
        "foxglove.Pose",
        [("position", vector3()), ("orientation", quaternion())],
    )
}

fn vector3() -> Value {
    object(
        "foxglove.Vector3",
        ["x", "y", "z"].map(|name| (name, number())),
    )
}

fn point3() -> Value {
    object(
        "foxglove.Point3",
        ["x", "y", "z"].map(|name| (name, number())),
    )
}

fn quaternion() -> Value {
    object(
        "foxglove.Quaternion",
        ["x", "y", "z", "w"].map(|name| (name, number())),
    )
}

fn color() -> Value {
    object(
        "foxglove.Color",
        ["r", "g", "b", "a"].map(|name| (name, number())),
    )
}

fn time() -> Value {
    json!({
        "type": "object", "title": "time",
        "properties": {"sec": natural(), "nsec": nanoseconds()},
    })
}

fn nanoseconds() -> Value {
    json!({"type": "integer", "minimum": 0, "maximum": 999_999_999})
}

fn natural() -> Value {
    json!({"type": "integer", "minimum": 0})
}

fn number() -> Value {
    json!({"type": "number"})
}

fn text() -> Value {
    json!({"type": "string"})
}

fn truth() -> Value {
    json!({"type": "boolean"})
}

fn list(items: Value) -> Value {
    json!({"type": "array", "items": items})
}

/// Numbers from 0 with names.
fn choice(title: &str, names: &[&str]) -> Value {
    let each = names.iter().enumerate();
    let each = each.map(|(code, name)| json!({"title": name, "const": code}));
    json!({"title": title, "oneOf": each.collect::<Vec<_>>()})
}

/// An object that has all of these fields.
fn object<const N: usize>(title: &str, fields: [(&str, Value); N]) -> Value {
    let required: Vec<&str> = fields.iter().map(|(name, _)| *name).collect();
    let fields = fields.into_iter();
    let properties: Map<String, Value> = fields.map(|(name, of)| (name.to_owned(), of)).collect();
    json!({"title": title, "type": "object", "properties": properties, "required": required})
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Members in the order of their names, no blanks.
    fn sorted(value: &Value) -> String {
        match value {
            Value::Object(members) => {
                let mut members: Vec<_> = members.iter().collect();
                members.sort_by_key(|(name, _)| *name);
                let each = members.iter();
                let each = each.map(|(name, value)| format!("{:?}:{}", name, sorted(value)));
                format!("{{{}}}", each.collect::<Vec<_>>().join(","))
            }
            Value::Array(items) => {
                let items: Vec<_> = items.iter().map(sorted).collect();
                format!("[{}]", items.join(","))
            }
            other => other.to_string(),
        }
    }

    /// The CRCs are of the published schemas without `description` and `$comment`, as Python's
    /// `json.dumps(schema, sort_keys=True, separators=(",", ":"))` writes them.
    #[test]
    fn each_schema_is_the_published_one() {
        for (kind, crc) in [
            (Kind::SceneUpdate, 0xec1c543b),
            (Kind::PoseInFrame, 0x27a43ac0),
            (Kind::FrameTransform, 0x5e3d83af),
            (Kind::Log, 0x7324ef54),
        ] {
            let text = sorted(&kind.schema());
            assert_eq!(crc32fast::hash(text.as_bytes()), crc, "{text}");
        }
    }
}
