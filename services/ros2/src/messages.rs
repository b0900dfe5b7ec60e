//! The ROS 2 messages that the robot sends, as plain structs in the order of their fields.
//!
//! serde and CDR make of each the bytes that ROS 2 kilted reads (`common_interfaces` 5.5,
//! `rcl_interfaces` 2.3, `tf2_msgs` 0.41). [`RosType`] names the type and its hash (RIHS01), by which
//! other programs see that their definition is the same. `tests/ros2` compares bytes and hashes with
//! ROS 2's own. A matrix is nested rows here, which CDR writes as one array.
//!
//! Lengths are in m, angles in rad, as ROS has them (REP-103).

use serde::{Deserialize, Serialize};

/// A type of ROS 2.
pub trait RosType: Serialize {
    /// Package and name, such as `sensor_msgs` and `Range`.
    const TYPE: (&'static str, &'static str);
    /// The 32 bytes of its hash, as digits.
    const HASH: &'static str;
}

/// A message that is one on a topic, with its name and hash.
macro_rules! ros_types {
    ($($message:ident = $package:literal, $hash:literal;)*) => {
        $(impl RosType for $message {
            const TYPE: (&'static str, &'static str) = ($package, stringify!($message));
            const HASH: &'static str = $hash;
        })*

        /// The full name of each type that is sent, such as `sensor_msgs/msg/Range`, with its hash.
        pub const TYPES: &[(&str, &str)] = &[
            $((concat!($package, "/msg/", stringify!($message)), $hash),)*
        ];
    };
}

ros_types! {
    UInt8 = "std_msgs", "6138bd83d8c3569cb80a667db03cfc1629f529fee79d944c39c34e352e72f010";
    UInt16 = "std_msgs", "08a406e4b022bc22e907f985d6a9e9dd1d4fbecae573549cf49350113e7757b1";
    Range = "sensor_msgs", "b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a";
    BatteryState = "sensor_msgs", "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741";
    JointState = "sensor_msgs", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e";
    Odometry = "nav_msgs", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0";
    Path = "nav_msgs", "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b";
    OccupancyGrid = "nav_msgs", "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7";
    PoseStamped = "geometry_msgs", "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8";
    TFMessage = "tf2_msgs", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087";
    DiagnosticArray = "diagnostic_msgs", "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e";
    MarkerArray = "visualization_msgs", "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf";
    Log = "rcl_interfaces", "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac";
}

/// The hash of the service `std_srvs/srv/Trigger`.
pub const TRIGGER: &str = "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f";

/// What precedes a hash in texts of ROS: its version.
pub const RIHS01: &str = "RIHS01_";

/// `builtin_interfaces/Time`: a moment since 1970.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Time {
    /// Seconds.
    pub sec: i32,
    /// The rest in ns.
    pub nanosec: u32,
}

/// `builtin_interfaces/Duration`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Span {
    /// Seconds.
    pub sec: i32,
    /// The rest in ns.
    pub nanosec: u32,
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Header {
    /// When what the message tells was so.
    pub stamp: Time,
    /// The frame of its coordinates.
    pub frame_id: String,
}

/// A number without a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct UInt8 {
    /// The number.
    pub data: u8,
}

/// A number without a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct UInt16 {
    /// The number.
    pub data: u16,
}

/// The distance to what is ahead.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Range {
    pub header: Header,
    pub radiation_type: u8,
    pub field_of_view: f32,
    pub min_range: f32,
    pub max_range: f32,
    pub range: f32,
    pub variance: f32,
}

impl Range {
    /// The kind of a ranger with infrared light.
    pub const INFRARED: u8 = 1;
}

/// A battery; what nobody measures is not a number.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct BatteryState {
    pub header: Header,
    pub voltage: f32,
    pub temperature: f32,
    pub current: f32,
    pub charge: f32,
    pub capacity: f32,
    pub design_capacity: f32,
    pub percentage: f32,
    pub power_supply_status: u8,
    pub power_supply_health: u8,
    pub power_supply_technology: u8,
    pub present: bool,
    pub cell_voltage: Vec<f32>,
    pub cell_temperature: Vec<f32>,
    pub location: String,
    pub serial_number: String,
}

impl BatteryState {
    /// Nobody measures whether it is being charged, or how well it is.
    pub const UNKNOWN: u8 = 0;
    /// Lithium-polymer cells.
    pub const LIPO: u8 = 3;
}

/// Joints, each list in the same order. An empty list: not measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct JointState {
    pub header: Header,
    pub name: Vec<String>,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    pub effort: Vec<f64>,
}

/// `geometry_msgs/Point` and `Vector3`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Vector3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// A rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Quaternion {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub w: f64,
}

impl Default for Quaternion {
    /// None.
    fn default() -> Self {
        let (x, y, z, w) = (0.0, 0.0, 0.0, 1.0);
        Self { x, y, z, w }
    }
}

/// A place and a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Pose {
    pub position: Vector3,
    pub orientation: Quaternion,
}

/// The same with its uncertainty; all zero: not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct PoseWithCovariance {
    pub pose: Pose,
    pub covariance: [[f64; 6]; 6],
}

/// Speeds in m/s and rad/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Twist {
    pub linear: Vector3,
    pub angular: Vector3,
}

/// The same with their uncertainty; all zero: not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct TwistWithCovariance {
    pub twist: Twist,
    pub covariance: [[f64; 6]; 6],
}

/// Where the robot is, in the header's frame, and how fast, in its own.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Odometry {
    pub header: Header,
    pub child_frame_id: String,
    pub pose: PoseWithCovariance,
    pub twist: TwistWithCovariance,
}

/// A pose in a frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct PoseStamped {
    pub header: Header,
    pub pose: Pose,
}

/// A way, place by place.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Path {
    pub header: Header,
    pub poses: Vec<PoseStamped>,
}

/// The measures of a grid; `origin` is the outer corner of its first cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct MapMetaData {
    pub map_load_time: Time,
    pub resolution: f32,
    pub width: u32,
    pub height: u32,
    pub origin: Pose,
}

/// Cells by rows from the lowest y: 0 is free, 100 is occupied, -1 is not known.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct OccupancyGrid {
    pub header: Header,
    pub info: MapMetaData,
    pub data: Vec<i8>,
}

/// Where a frame is in another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Transform {
    pub translation: Vector3,
    pub rotation: Quaternion,
}

/// The same with both frames' names.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct TransformStamped {
    pub header: Header,
    pub child_frame_id: String,
    pub transform: Transform,
}

/// Frames that have moved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct TFMessage {
    pub transforms: Vec<TransformStamped>,
}

/// A fact about a part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct KeyValue {
    pub key: String,
    pub value: String,
}

/// How a part of the robot is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct DiagnosticStatus {
    pub level: u8,
    pub name: String,
    pub message: String,
    pub hardware_id: String,
    pub values: Vec<KeyValue>,
}

/// How each part of the robot is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct DiagnosticArray {
    pub header: Header,
    pub status: Vec<DiagnosticStatus>,
}

/// A colour, each part from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct ColorRGBA {
    pub r: f32,
    pub g: f32,
    pub b: f32,
    pub a: f32,
}

/// A picture on a shape.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct CompressedImage {
    pub header: Header,
    pub format: String,
    pub data: Vec<u8>,
}

/// A place in such a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct UVCoordinate {
    pub u: f32,
    pub v: f32,
}

/// A shape in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct MeshFile {
    pub filename: String,
    pub data: Vec<u8>,
}

/// A shape to be shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Marker {
    pub header: Header,
    pub ns: String,
    pub id: i32,
    pub kind: i32,
    pub action: i32,
    pub pose: Pose,
    pub scale: Vector3,
    pub color: ColorRGBA,
    pub lifetime: Span,
    pub frame_locked: bool,
    pub points: Vec<Vector3>,
    pub colors: Vec<ColorRGBA>,
    pub texture_resource: String,
    pub texture: CompressedImage,
    pub uv_coordinates: Vec<UVCoordinate>,
    pub text: String,
    pub mesh_resource: String,
    pub mesh_file: MeshFile,
    pub mesh_use_embedded_materials: bool,
}

impl Marker {
    /// Its shape is an arrow along x.
    pub const ARROW: i32 = 0;
    /// Its shape is a box.
    pub const CUBE: i32 = 1;
    /// Its shape is separate lines, two points each.
    pub const LINE_LIST: i32 = 5;
    /// Its shape is a text that turns to whoever looks.
    pub const TEXT: i32 = 9;
    /// It takes away what the topic has shown so far.
    pub const DELETE_ALL: i32 = 3;
}

/// Shapes to be shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct MarkerArray {
    pub markers: Vec<Marker>,
}

/// A line of a log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the definition of ROS says it")]
pub struct Log {
    pub stamp: Time,
    pub level: u8,
    pub name: String,
    pub msg: String,
    pub file: String,
    pub function: String,
    pub line: u32,
}

/// The request of `std_srvs/Trigger`: a structure without members has one byte on the wire.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct TriggerRequest {
    /// Without meaning.
    pub structure_needs_at_least_one_member: u8,
}

/// The answer of `std_srvs/Trigger`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TriggerResponse {
    /// Whether it is done.
    pub success: bool,
    /// What was done, or why not.
    pub message: String,
}
