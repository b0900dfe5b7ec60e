"""A mission as a program of ROS 2 sees it: where the robot drove, on which floor, by which frames."""

import json
import math
import subprocess
import sys
import unittest
from pathlib import Path

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from robot import Robot, domain, until
from test_topics import LIGHT, Listener, ns

DRAWN = Path(__file__).parents[2] / "target/ros2/mission.svg"
LASTING = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# How far the robot may be from where it believes to be, in m, and how far its speed from the true one,
# as a part of that, half of the time: at a mark it learns better, which looks like a jerk.
OFF, OFF_SPEED = 0.08, 0.05


def cell(grid, x, y):
    """The value of the cell of a place, as ROS defines it."""
    info = grid.info
    column = math.floor((x - info.origin.position.x) / info.resolution)
    row = math.floor((y - info.origin.position.y) / info.resolution)
    inside = 0 <= column < info.width and 0 <= row < info.height
    return grid.data[row * info.width + column] if inside else -1


def draw(grid, marks, poses, path):
    """The mission as a picture, y up."""
    info = grid.info
    size = 600 / max(info.width, info.height)
    at = lambda x, y: (
        (x - info.origin.position.x) / info.resolution * size,
        (info.height - (y - info.origin.position.y) / info.resolution) * size,
    )
    shades = {-1: "#ddd", 0: "#fff", 100: "#888"}
    parts = ['<svg xmlns="http://www.w3.org/2000/svg" width="640" height="640">']
    for index, value in enumerate(grid.data):
        x, y = index % info.width * size, (info.height - 1 - index // info.width) * size
        place = f'x="{x:.1f}" y="{y:.1f}" width="{size:.1f}" height="{size:.1f}"'
        parts.append(f'<rect {place} fill="{shades[value]}"/>')
    for mark in marks.markers:
        if mark.text:
            x, y = at(mark.pose.position.x, mark.pose.position.y)
            parts.append(f'<text x="{x:.1f}" y="{y:.1f}" fill="#a60">{mark.text}</text>')
    way = " ".join("{:.1f},{:.1f}".format(*at(x, y)) for x, y in poses)
    parts.append(f'<polyline points="{way}" fill="none" stroke="#36c" stroke-width="2"/></svg>')
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(parts))


class Mission(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot, cls.domain = Robot(mission="1"), domain()
        cls.robot.gateway(cls.domain)
        listener = cls.listener = Listener(cls.domain)
        hear = listener.hear
        for topic, kind, qos in (
            ("/r1/map", "nav_msgs/msg/OccupancyGrid", LASTING),
            ("/r1/markers/floor", "visualization_msgs/msg/MarkerArray", LASTING),
            ("/r1/path", "nav_msgs/msg/Path", LASTING),
            ("/r1/pose", "geometry_msgs/msg/PoseStamped", LIGHT),
            ("/r1/odom", "nav_msgs/msg/Odometry", LIGHT),
            ("/r1/ground_truth", "nav_msgs/msg/Odometry", LIGHT),
            ("/rosout", "rcl_interfaces/msg/Log", LIGHT),
        ):
            hear(topic, kind, qos)
        cls.foreign = subprocess.Popen(
            [sys.executable, "foreign.py", str(cls.domain), "20"],
            stdout=subprocess.PIPE,
            text=True,
        )
        is_done = lambda: any("DELIVERED" in line for line in cls.robot.up.lines)
        # It needs 50 s of its own time.
        until("the delivery", lambda: listener.spin(0.5) and is_done(), 200)
        cls.frames = json.loads(cls.foreign.communicate()[0].splitlines()[-1])

    @classmethod
    def tearDownClass(cls):
        cls.listener.end()
        cls.robot.end()

    def heard(self, topic):
        return self.listener.heard[topic]

    def test_the_robot_drives_where_the_map_is_free_and_the_picture_shows_it(self):
        [grid] = self.heard("/r1/map")
        poses = [(one.pose.position.x, one.pose.position.y) for one in self.heard("/r1/pose")]
        self.assertGreater(len(poses), 500)
        draw(grid, self.heard("/r1/markers/floor")[-1], poses, DRAWN)
        cells = [cell(grid, x, y) for x, y in poses]
        self.assertNotIn(100, cells)
        self.assertGreater(cells.count(0), 400)
        nodes = [one.pose.position for path in self.heard("/r1/path") for one in path.poses]
        self.assertTrue(nodes)
        for node in nodes:
            self.assertEqual(cell(grid, node.x, node.y), 0)
        self.assertTrue(set(grid.data) <= {-1, 0, 100})

    def test_ros_hears_what_logic_thinks(self):
        said = [one.msg for one in self.heard("/rosout") if one.name == "r1.logic"]
        self.assertTrue([one for one in said if "delivered" in one], said)

    def test_odometry_is_near_the_truth_in_place_and_in_speed_whichever_way_it_drives(self):
        truth = {ns(one.header.stamp): one for one in self.heard("/r1/ground_truth")}
        times = sorted(truth)
        looks, off = {}, []
        window = 400_000_000
        for odom in self.heard("/r1/odom"):
            at = ns(odom.header.stamp)
            near = [then for then in times if at - window <= then <= at]
            if len(near) < 15:
                continue
            last = truth[near[-1]]
            there, here = last.pose.pose.position, odom.pose.pose.position
            off.append(math.hypot(there.x - here.x, there.y - here.y))
            speeds = [truth[then].twist.twist for then in near]
            even = max(one.linear.x for one in speeds) - min(one.linear.x for one in speeds) < 0.02
            # It follows a tape, and so it always turns a little to and fro.
            turns = abs(sum(one.angular.z for one in speeds)) / len(speeds)
            if even and speeds[0].linear.x > 0.05 and turns < 0.1:
                mean = sum(one.linear.x for one in speeds) / len(speeds)
                turn = odom.pose.pose.orientation
                look = round(math.degrees(2 * math.atan2(turn.z, turn.w))) % 360
                wrong = abs(odom.twist.twist.linear.x - mean) / mean
                looks.setdefault(look, []).append(wrong)
            self.assertLess(abs(odom.twist.twist.linear.y), 0.02)
        off.sort()
        print(f"odometry is {off[len(off) // 2] * 1e3:.0f} mm off, half of the time", file=sys.stderr)
        self.assertLess(off[len(off) // 2], OFF)
        often = {look: sorted(wrong) for look, wrong in looks.items() if len(wrong) > 20}
        self.assertGreaterEqual(len(often), 2, looks.keys())
        for look, wrong in often.items():
            self.assertLess(wrong[len(wrong) // 2], OFF_SPEED, look)

    def test_a_listener_of_another_origin_gets_the_whole_tree_of_frames(self):
        fixed, moved = self.frames["fixed"], self.frames["moved"]
        parents = {child: came[0]["in"] for child, came in {**fixed, **moved}.items()}
        self.assertEqual(
            parents,
            {
                "r1/odom": "r1/map",
                "r1/ranger": "r1/base_link",
                "r1/line": "r1/base_link",
                "r1/base_link": "r1/odom",
                "r1/ground_truth": "r1/map",
            },
        )
        self.assertEqual([len(came) for came in fixed.values()], [1, 1, 1])
        self.assertEqual(fixed["r1/line"][0]["place"], [0.16, 0.0, 0.0])
        self.assertGreater(len(moved["r1/base_link"]), 100)
        odom = {ns(one.header.stamp): one.pose.pose for one in self.heard("/r1/odom")}
        same = [one for one in moved["r1/base_link"] if one["ns"] in odom]
        self.assertGreater(len(same), 50)
        for one in same:
            pose = odom[one["ns"]]
            self.assertEqual(one["place"][:2], [pose.position.x, pose.position.y])
            self.assertEqual(one["turn"][2:], [pose.orientation.z, pose.orientation.w])


if __name__ == "__main__":
    unittest.main()
