//! Where the robot is and how it moves: pose, odometry, frames and the way ahead.
//!
//! The robot believes what it counts from the marks of the warehouse; a simulated one is told as it
//! really is as well. Speeds are in the robot's own frame, as `nav_msgs/Odometry` wants them: ahead is
//! x whichever way the robot looks.

use std::collections::VecDeque;
use std::time::Duration;

use lager_journal::{drawn, shapes};
use lager_topics::{NavigatorStatus, Phase, Route, Truth, WarehouseMap};

use crate::messages::{
    Odometry, Path, Pose, PoseStamped, PoseWithCovariance, Quaternion, TFMessage, Transform,
    TransformStamped, Twist, TwistWithCovariance, Vector3,
};
use crate::parts::wrapped;
use crate::told::{Calendar, Frames, Measures};

/// Over how long a speed is the mean. The way is told in whole mm every 50 ms.
const WINDOW: Duration = Duration::from_millis(400);

impl From<shapes::Pose> for Pose {
    fn from(pose: shapes::Pose) -> Self {
        let shapes::Quaternion { x, y, z, w } = pose.orientation;
        Self {
            position: pose.position.into(),
            orientation: Quaternion { x, y, z, w },
        }
    }
}

impl From<shapes::Vector3> for Vector3 {
    fn from(shapes::Vector3 { x, y, z }: shapes::Vector3) -> Self {
        Self { x, y, z }
    }
}

impl From<Pose> for Transform {
    fn from(pose: Pose) -> Self {
        Self {
            translation: pose.position,
            rotation: pose.orientation,
        }
    }
}

/// What the navigator's status tells of where the robot is.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// Where it is on the map.
    pub pose: PoseStamped,
    /// The same with its speed.
    pub odometry: Odometry,
    /// The frame of the robot.
    pub frames: TFMessage,
}

/// The believed poses of the last moments, from which speeds are made.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// When, where in m, and the heading in rad, not wrapped.
    seen: VecDeque<(u64, [f64; 2], f64)>,
}

impl Motion {
    /// Takes a status. `None` while nobody knows where the robot is.
    pub fn take(
        &mut self,
        status: &NavigatorStatus,
        map: &WarehouseMap,
        (calendar, at_ns): (Calendar, u64),
        frames: &Frames,
    ) -> Option<Moved> {
        let is_lost = matches!(
            status.phase.get(),
            None | Some(Phase::Lost | Phase::WaitingForMap)
        );
        let Some(believed) = status.pose(map).filter(|_| !is_lost) else {
            self.seen.clear();
            return None;
        };
        let pose = Pose::from(drawn::believed_pose(believed));
        let twist = self.twist(at_ns, &pose);
        let header = calendar.header(at_ns, frames.map());
        let stamped = PoseStamped { header, pose };
        Some(Moved {
            odometry: odometry(&stamped, (frames.odom(), frames.base()), twist),
            frames: moved(&stamped, frames.odom(), frames.base()),
            pose: stamped,
        })
    }

    /// The mean speed of the last moments.
    fn twist(&mut self, at_ns: u64, pose: &Pose) -> Twist {
        let place = [pose.position.x, pose.position.y];
        let heading = 2.0 * pose.orientation.z.atan2(pose.orientation.w);
        // A clock that went back, or a long silence: what was before tells no speed.
        let is_old = |then_ns: u64| at_ns.saturating_sub(then_ns) > WINDOW.as_nanos() as u64;
        if self
            .seen
            .back()
            .is_some_and(|(then_ns, ..)| *then_ns >= at_ns)
        {
            self.seen.clear();
        }
        while self
            .seen
            .front()
            .is_some_and(|(then_ns, ..)| is_old(*then_ns))
        {
            self.seen.pop_front();
        }
        let heading = match self.seen.back() {
            Some((_, _, last)) => last + wrapped(heading - last),
            None => heading,
        };
        self.seen.push_back((at_ns, place, heading));
        let (Some(first), true) = (self.seen.front(), self.seen.len() > 1) else {
            return Twist::default();
        };
        let seconds = (at_ns - first.0) as f64 / 1e9;
        let [dx, dy] = [place[0] - first.1[0], place[1] - first.1[1]];
        // Its own frame of the middle of that time.
        let (sin, cos) = f64::midpoint(heading, first.2).sin_cos();
        let mut twist = Twist::default();
        twist.linear.x = (dx * cos + dy * sin) / seconds;
        twist.angular.z = (heading - first.2) / seconds;
        twist
    }
}

/// Where a simulated robot really is: its pose with its speed, and its frame.
pub fn truth(
    truth: &Truth,
    (calendar, at_ns): (Calendar, u64),
    frames: &Frames,
) -> (Odometry, TFMessage) {
    let header = calendar.header(at_ns, frames.map());
    let pose = drawn::truth_pose(truth).into();
    let stamped = PoseStamped { header, pose };
    let [left, right] = [truth.left_mm_per_s, truth.right_mm_per_s].map(|mm| f64::from(mm) / 1e3);
    let mut twist = Twist::default();
    twist.linear.x = f64::midpoint(left, right);
    twist.angular.z = (right - left) / (lager_plant::body::TRACK / 1e3);
    let odometry = odometry(&stamped, (frames.map(), frames.truth()), twist);
    (odometry, moved(&stamped, frames.map(), frames.truth()))
}

fn odometry(stamped: &PoseStamped, (frame, child): (String, String), twist: Twist) -> Odometry {
    let mut header = stamped.header.clone();
    header.frame_id = frame;
    Odometry {
        header,
        child_frame_id: child,
        pose: PoseWithCovariance {
            pose: stamped.pose,
            ..PoseWithCovariance::default()
        },
        twist: TwistWithCovariance {
            twist,
            ..TwistWithCovariance::default()
        },
    }
}

fn moved(stamped: &PoseStamped, frame: String, child_frame_id: String) -> TFMessage {
    let mut header = stamped.header.clone();
    header.frame_id = frame;
    let transform = stamped.pose.into();
    let moved = TransformStamped {
        header,
        child_frame_id,
        transform,
    };
    TFMessage {
        transforms: vec![moved],
    }
}

/// The frames that never move.
pub fn fixed(
    measures: &Measures,
    (calendar, at_ns): (Calendar, u64),
    frames: &Frames,
) -> TFMessage {
    let ahead = |mm: f32| Transform {
        translation: Vector3 {
            x: f64::from(mm) / 1e3,
            ..Vector3::default()
        },
        ..Transform::default()
    };
    let transforms = [
        (frames.map(), frames.odom(), Transform::default()),
        (
            frames.base(),
            frames.ranger(),
            ahead(measures.ranger_ahead_mm),
        ),
        (frames.base(), frames.line(), ahead(measures.line_ahead_mm)),
    ];
    let transforms = transforms.map(|(frame, child_frame_id, transform)| TransformStamped {
        header: calendar.header(at_ns, frame),
        child_frame_id,
        transform,
    });
    TFMessage {
        transforms: transforms.into(),
    }
}

/// The nodes that the robot means to pass, each looking to the next one.
pub fn path(
    route: &Route,
    map: &WarehouseMap,
    (calendar, at_ns): (Calendar, u64),
    frames: &Frames,
) -> Path {
    let header = calendar.header(at_ns, frames.map());
    let side = drawn::side_m(map);
    let places: Vec<_> = route
        .nodes()
        .iter()
        .map(|node| shapes::at(f64::from(node.x) * side, f64::from(node.y) * side, 0.0))
        .collect();
    let mut angle = 0.0;
    let poses = places.iter().enumerate().map(|(index, place)| {
        if let Some(next) = places.get(index + 1) {
            angle = (next.y - place.y).atan2(next.x - place.x);
        }
        PoseStamped {
            header: header.clone(),
            pose: shapes::Pose::new(*place, angle).into(),
        }
    });
    Path {
        poses: poses.collect(),
        header,
    }
}

#[cfg(test)]
mod tests {
    use lager_floor::Heading;

    use super::*;

    fn map() -> WarehouseMap {
        WarehouseMap {
            width: 4,
            height: 3,
            side_length_cm: 40,
            ..WarehouseMap::default()
        }
    }

    /// The speed told after a second of driving at 200 mm/s.
    fn driven(heading: Heading) -> Moved {
        let mut motion = Motion::default();
        let mut last = None;
        for step in 0..20 {
            let status = NavigatorStatus {
                x: 2,
                y: 1,
                heading: heading.into(),
                phase: Phase::Driving.into(),
                travelled_mm: step * 10,
                ..NavigatorStatus::default()
            };
            let at_ns = 1_000_000_000 + step as u64 * 50_000_000;
            let at = (Calendar::new(0), at_ns);
            last = motion.take(&status, &map(), at, &Frames::of("r1"));
        }
        last.expect("it knows where it is")
    }

    #[test]
    fn ahead_is_x_whichever_way_it_looks() {
        for heading in Heading::ALL {
            let moved = driven(heading);
            let twist = moved.odometry.twist.twist;
            assert!(
                (twist.linear.x - 0.2).abs() < 0.002,
                "{heading:?} {twist:?}"
            );
            assert!(twist.linear.y == 0.0 && twist.angular.z.abs() < 1e-9);
            let Quaternion { x, y, z, w } = moved.pose.pose.orientation;
            assert!((x * x + y * y + z * z + w * w - 1.0).abs() < 1e-9);
            assert_eq!(moved.odometry.child_frame_id, "r1/base_link");
            assert_eq!(moved.odometry.header.frame_id, "r1/odom");
        }
        let up = driven(Heading::Up).pose.pose.position;
        assert!(
            (up.x - 0.8).abs() < 1e-9 && (up.y - 0.59).abs() < 1e-9,
            "{up:?}"
        );
    }

    #[test]
    fn a_robot_that_turns_on_the_spot_has_no_speed_ahead() {
        let mut motion = Motion::default();
        let mut twist = Twist::default();
        for step in 0..20 {
            let status = NavigatorStatus {
                heading: Heading::Down.into(),
                phase: Phase::Turning.into(),
                turned_deg: -(step as i16) * 2,
                ..NavigatorStatus::default()
            };
            let at = (Calendar::new(0), 1 + step * 50_000_000);
            let moved = motion.take(&status, &map(), at, &Frames::of("r1"));
            twist = moved.expect("a place").odometry.twist.twist;
        }
        assert!(
            (twist.angular.z - 40f64.to_radians()).abs() < 0.01,
            "{twist:?}"
        );
        assert_eq!(twist.linear.x, 0.0);
    }

    #[test]
    fn a_lost_robot_has_no_place() {
        let status = NavigatorStatus {
            phase: Phase::Lost.into(),
            ..NavigatorStatus::default()
        };
        let at = (Calendar::new(0), 1);
        let told = Motion::default().take(&status, &map(), at, &Frames::of("r1"));
        assert_eq!(told, None);
    }

    #[test]
    fn a_way_looks_along_itself() {
        let mut route = Route {
            length: 3,
            ..Route::default()
        };
        for (node, place) in route.nodes.iter_mut().zip([(0, 0), (0, 1), (1, 1)]) {
            (node.x, node.y) = place;
        }
        let path = path(&route, &map(), (Calendar::new(0), 1), &Frames::of("r1"));
        let up = path.poses[0].pose.orientation;
        assert!((up.z - 0.5f64.sqrt()).abs() < 1e-9, "{up:?}");
        assert_eq!(path.poses[1].pose.orientation, Quaternion::default());
        assert_eq!(path.poses[2].pose.position.y, 0.4);
    }
}
