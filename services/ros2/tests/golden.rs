//! The bytes of each message are those that ROS 2 itself makes of the same values: `golden.txt`, which
//! `tests/ros2/golden.py` writes. If a test here fails, do not change that file.

use std::collections::BTreeMap;

use lager_ros2::messages::*;
use rustdds::CDRSerializerAdapter;
use rustdds::no_key::SerializerAdapter;
use serde::Serialize;

fn header(frame_id: &str) -> Header {
    Header {
        stamp: Time {
            sec: -7,
            nanosec: 8,
        },
        frame_id: frame_id.to_owned(),
    }
}

const fn vector(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

const POSE: Pose = Pose {
    position: vector(1.5, -2.5, 3.5),
    orientation: Quaternion {
        x: 0.5,
        y: -0.5,
        z: 0.5,
        w: -0.5,
    },
};

fn stamped() -> PoseStamped {
    PoseStamped {
        header: header("a"),
        pose: POSE,
    }
}

/// A matrix whose elements count by rows.
fn counting(sign: f64) -> [[f64; 6]; 6] {
    std::array::from_fn(|row| std::array::from_fn(|column| sign * (6 * row + column) as f64))
}

fn marker() -> Marker {
    Marker {
        header: header("map"),
        ns: "goods".into(),
        id: -3,
        kind: Marker::TEXT,
        action: 2,
        pose: POSE,
        scale: vector(0.25, 0.5, 0.75),
        color: ColorRGBA {
            r: 0.125,
            g: 0.25,
            b: 0.5,
            a: 1.0,
        },
        lifetime: Span { sec: 3, nanosec: 4 },
        frame_locked: true,
        points: vec![vector(1.0, 2.0, 3.0)],
        colors: vec![ColorRGBA {
            r: 1.0,
            g: 0.0,
            b: 0.5,
            a: 0.25,
        }],
        texture_resource: "t".into(),
        texture: CompressedImage {
            header: header("i"),
            format: "png".into(),
            data: vec![1, 2, 3],
        },
        uv_coordinates: vec![UVCoordinate { u: 0.5, v: 0.75 }],
        text: "seven".into(),
        mesh_resource: "m".into(),
        mesh_file: MeshFile {
            filename: "f".into(),
            data: vec![9],
        },
        mesh_use_embedded_materials: true,
    }
}

/// The bytes of a message as they are sent, with the four that name the encoding.
fn bytes<M: Serialize>(message: &M) -> String {
    let body = CDRSerializerAdapter::<M>::to_bytes(message).expect("a message");
    let head = [0, 1, 0, 0];
    let bytes = head.iter().chain(&body);
    bytes.map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn each_message_is_what_ros_itself_would_send() {
    let golden: BTreeMap<&str, &str> = include_str!("golden.txt")
        .lines()
        .filter_map(|line| line.split_once(' '))
        .collect();
    let mut compared = 0;
    let mut check = |name: &str, ours: String| {
        assert_eq!(ours, golden[name], "{name}");
        compared += 1;
    };
    check("UInt8", bytes(&UInt8 { data: 200 }));
    check("UInt16", bytes(&UInt16 { data: 0x1234 }));
    let range = Range {
        header: header("us"),
        radiation_type: Range::INFRARED,
        field_of_view: 0.5,
        min_range: 0.25,
        max_range: 4.0,
        range: 1.125,
        variance: 0.0625,
    };
    check("Range", bytes(&range));
    let battery = BatteryState {
        header: header("b"),
        voltage: 11.5,
        temperature: 1.0,
        current: -2.0,
        charge: 3.0,
        capacity: 4.0,
        design_capacity: 5.0,
        percentage: 0.5,
        power_supply_status: 1,
        power_supply_health: 2,
        power_supply_technology: BatteryState::LIPO,
        present: true,
        cell_voltage: vec![3.75, 3.875],
        cell_temperature: vec![20.5],
        location: "slot".into(),
        serial_number: "n1".into(),
    };
    check("BatteryState", bytes(&battery));
    let joints = JointState {
        header: header("j"),
        name: vec!["a".into(), "bcd".into()],
        position: vec![0.5, -0.25],
        velocity: Vec::new(),
        effort: vec![1.0],
    };
    check("JointState", bytes(&joints));
    let odometry = Odometry {
        header: header("odom"),
        child_frame_id: "base".into(),
        pose: PoseWithCovariance {
            pose: POSE,
            covariance: counting(1.0),
        },
        twist: TwistWithCovariance {
            twist: Twist {
                linear: vector(1.0, 2.0, 3.0),
                angular: vector(4.0, 5.0, 6.0),
            },
            covariance: counting(-1.0),
        },
    };
    check("Odometry", bytes(&odometry));
    let path = Path {
        header: header("p"),
        poses: vec![stamped(), stamped()],
    };
    check("Path", bytes(&path));
    let grid = OccupancyGrid {
        header: header("map"),
        info: MapMetaData {
            map_load_time: Time { sec: 1, nanosec: 2 },
            resolution: 0.125,
            width: 2,
            height: 3,
            origin: POSE,
        },
        data: vec![-1, 0, 100, 50, -1, 7],
    };
    check("OccupancyGrid", bytes(&grid));
    check("PoseStamped", bytes(&stamped()));
    let diagnostics = DiagnosticArray {
        header: header("d"),
        status: vec![DiagnosticStatus {
            level: 2,
            name: "r1: stop".into(),
            message: "stopped".into(),
            hardware_id: "r1".into(),
            values: vec![KeyValue {
                key: "k".into(),
                value: "vv".into(),
            }],
        }],
    };
    check("DiagnosticArray", bytes(&diagnostics));
    let markers = MarkerArray {
        markers: vec![marker(), marker()],
    };
    check("MarkerArray", bytes(&markers));
    let log = Log {
        stamp: Time { sec: 1, nanosec: 2 },
        level: 30,
        name: "r1.logic".into(),
        msg: "hej".into(),
        file: "f".into(),
        function: "g".into(),
        line: 42,
    };
    check("Log", bytes(&log));
    let answer = TriggerResponse {
        success: true,
        message: "done".into(),
    };
    check("TriggerResponse", bytes(&answer));
    assert_eq!(compared, golden.len());
}
