"""What a plain program of ROS 2 sees of the robot: topics, types, hashes, qualities, and contents."""

import json
import math
import subprocess
import time
import unittest

import rclpy
from rclpy.context import Context
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from robot import PATIENCE, Process, Robot, domain, offset_ns, peer, until
from table import BEST_EFFORT, LASTING, RELIABLE, topics
from types_ import named

# Nobody packs this type for Python; test_tf reads it.
FOREIGN = "tf2_msgs/msg/TFMessage"
LIGHT = QoSProfile(
    depth=1000,
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)
OFFERED = {
    BEST_EFFORT: ("BEST_EFFORT", "VOLATILE"),
    RELIABLE: ("RELIABLE", "VOLATILE"),
    LASTING: ("RELIABLE", "TRANSIENT_LOCAL"),
}


def quality(reliability, durability):
    return QoSProfile(
        depth=10,
        reliability=ReliabilityPolicy[reliability],
        durability=DurabilityPolicy[durability],
    )


class Listener:
    """A node of ROS 2 in a domain."""

    def __init__(self, number):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=number)
        self.node = Node("listener", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.heard = {}

    def hear(self, topic, kind, qos=LIGHT, **more):
        came = self.heard.setdefault(topic, [])
        return self.node.create_subscription(named(kind), topic, came.append, qos, **more)

    def spin(self, seconds=None, found=None):
        """Spins for some seconds, or until `found` returns something."""
        end = time.monotonic() + (seconds or PATIENCE)
        while True:
            self.executor.spin_once(timeout_sec=0.05)
            result = found() if found else time.monotonic() >= end
            if result:
                return result
            assert time.monotonic() < end, "the listener waited in vain"

    def end(self):
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def ns(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def messages(one):
    """Every message inside a message, itself included."""
    yield one
    for name in one.get_fields_and_field_types():
        value = getattr(one, name)
        for inner in value if isinstance(value, list) else [value]:
            if hasattr(inner, "get_fields_and_field_types"):
                yield from messages(inner)


class Topics(unittest.TestCase):
    """One robot that drives a mission in a warehouse that is not square."""

    @classmethod
    def setUpClass(cls):
        cls.robot = Robot(mission="1")
        cls.domain = domain()
        cls.gateway = cls.robot.gateway(cls.domain)
        cls.listener = Listener(cls.domain)
        cls.robot.up.line("drives from")

    @classmethod
    def tearDownClass(cls):
        cls.listener.end()
        cls.robot.end()

    def test_types_hashes_and_qualities_are_those_of_the_readme_and_of_ros_itself(self):
        node = self.listener.node
        for topic, kind, wanted in topics():
            with self.subTest(topic):
                found = lambda: [
                    one
                    for one in node.get_publishers_info_by_topic(topic)
                    if one.node_name == "r1"
                ]
                [info] = self.listener.spin(found=found)
                self.assertEqual(info.topic_type, kind)
                offered = (info.qos_profile.reliability.name, info.qos_profile.durability.name)
                self.assertEqual(offered, OFFERED[wanted])
                if kind == FOREIGN:
                    continue
                own = node.create_publisher(named(kind), "/own" + topic, 1)
                [mine] = self.listener.spin(
                    found=lambda: node.get_publishers_info_by_topic("/own" + topic)
                )
                self.assertEqual(info.topic_type_hash.version, 1)
                self.assertEqual(info.topic_type_hash, mine.topic_type_hash)
                node.destroy_publisher(own)
        shown = {name for name, _ in node.get_publisher_names_and_types_by_node("r1", "/")}
        self.assertEqual(shown, {topic for topic, _, _ in topics()})

    def test_every_sample_of_the_bus_is_heard_once_and_found_again_by_its_stamp(self):
        heard = Listener(self.domain)
        heard.hear("/r1/range", "sensor_msgs/msg/Range")
        echo = Process([*self.robot.lager, "topic", "echo", "sensor/distance", "--json"])
        heard.spin(found=lambda: len(heard.heard["/r1/range"]) > 50 and len(echo.lines) > 50)
        heard.spin(found=lambda: len(heard.heard["/r1/range"]) > 350)
        echo.end()
        offset = offset_ns(self.gateway)
        told = [json.loads(line) for line in echo.lines if line.startswith("{")]
        told = [one for one in told if "payload" in one]
        numbers = [one["sequence"] for one in told]
        self.assertEqual(numbers, list(range(numbers[0], numbers[-1] + 1)))
        bus = [(one["source_time_ns"] + offset, one["payload"]["distance_cm"]) for one in told]
        came = [(ns(one.header.stamp), one.range) for one in heard.heard["/r1/range"]]
        heard.end()
        # Of samples that the bridge read at once, all have the same time.
        first, last = max(bus[0][0], came[0][0]), min(bus[-1][0], came[-1][0])
        inside = lambda all: [one for one in all if first < one[0] < last]
        bus, came = inside(bus), inside(came)
        self.assertGreater(len(bus), 200)
        self.assertEqual([at for at, _ in came], [at for at, _ in bus])
        for (_, told), (_, cm) in zip(came, bus):
            true = math.inf if cm > 80 else cm / 100
            self.assertTrue(told == true or abs(told - true) < 1e-6, (cm, told))

    def test_a_message_means_what_ros_says(self):
        listener = self.listener
        for topic, kind, wanted in topics():
            if kind != FOREIGN:
                listener.hear(topic, kind, quality(*OFFERED[wanted]))
        listener.spin(found=lambda: all(listener.heard.values()))
        heard = {topic: came[-1] for topic, came in listener.heard.items()}
        frames = {"r1/map", "r1/odom", "r1/base_link", "r1/ranger", "r1/line", "r1/ground_truth"}
        for topic, message in heard.items():
            for part in messages(message):
                kind = type(part).__name__
                if kind == "Header":
                    # A marker has a second one inside, of a picture that it does not have.
                    if part.frame_id or "markers" not in topic:
                        self.assertIn(part.frame_id, frames, topic)
                if kind == "Quaternion":
                    norm = math.sqrt(part.x**2 + part.y**2 + part.z**2 + part.w**2)
                    self.assertLess(abs(norm - 1), 1e-3, (topic, part))
        wall = time.time_ns()
        for topic in ("range", "battery_state", "joint_states", "pose", "odom", "ground_truth"):
            last = listener.heard[f"/r1/{topic}"][-1]
            self.assertLess(abs(ns(last.header.stamp) - wall), 1e9 + 6e10, topic)
        for marker in heard["/r1/markers/floor"].markers:
            self.assertEqual((marker.texture_resource, marker.mesh_file.filename), ("", ""))
        reach = heard["/r1/range"]
        self.assertEqual(reach.variance, 0.0)
        self.assertLess(reach.min_range, reach.max_range)
        battery = heard["/r1/battery_state"]
        self.assertTrue(0 <= battery.percentage <= 1 and battery.present)
        self.assertTrue(math.isnan(battery.current))
        self.assertEqual(len(heard["/r1/joint_states"].name), 6)
        odom = heard["/r1/odom"]
        self.assertEqual((odom.header.frame_id, odom.child_frame_id), ("r1/odom", "r1/base_link"))
        self.assertEqual(odom.twist.twist.linear.y, 0.0)

    def test_a_stamp_is_of_now(self):
        heard = Listener(self.domain)
        late = []
        kind = named("sensor_msgs/msg/Range")
        note = lambda one: late.append(abs(time.time_ns() - ns(one.header.stamp)))
        heard.node.create_subscription(kind, "/r1/range", note, LIGHT)
        heard.spin(found=lambda: len(late) > 100)
        heard.end()
        self.assertLess(sorted(late)[50], 1e9)

    def test_diagnostics_say_what_is_lost_and_what_is_well(self):
        self.listener.hear("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        came = self.listener.heard["/diagnostics"]
        self.listener.spin(found=lambda: len(came) > 1)
        parts = {status.name: status for status in came[-1].status}
        for part in ("sensor board", "steering board", "stop", "navigator"):
            self.assertEqual(parts[f"r1: {part}"].level, b"\x00", parts[f"r1: {part}"])
        losses = {one.key: one.value for one in parts["r1: losses"].values}
        self.assertRegex(losses["sensor/line"], r"^read \d{2,}, lost 0, sent \d{2,}, refused 0$")

    def test_each_mix_of_qualities_is_served_or_refused_aloud(self):
        for topic, kind, wanted in topics():
            if kind == FOREIGN:
                continue
            refused, mixes = [], []
            listener = Listener(self.domain)
            offered = OFFERED[wanted]
            for reliability in ("BEST_EFFORT", "RELIABLE"):
                for durability in ("VOLATILE", "TRANSIENT_LOCAL"):
                    mix = (reliability, durability)
                    note = lambda event, mix=mix: refused.append((mix, event.total_count))
                    listener.node.create_subscription(
                        named(kind),
                        topic,
                        lambda _: None,
                        quality(*mix),
                        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=note),
                    )
                    fits = all(
                        ask == "BEST_EFFORT" or ask == "VOLATILE" or ask == offer
                        for ask, offer in zip(mix, offered)
                    )
                    mixes += [] if fits else [(mix, 1)]
            listener.spin(found=lambda: len(refused) >= len(mixes))
            listener.spin(0.3)
            listener.end()
            with self.subTest(topic):
                self.assertEqual(sorted(refused), sorted(mixes))
                said = [line for line in self.gateway.lines if f"listens to {topic} " in line]
                self.assertLessEqual(len(said), 1 if mixes else 0, said)
        # RustDDS forgets some of many events that come at once.
        said = [line for line in self.gateway.lines if "gets nothing: it is" in line]
        self.assertGreater(len(said), 3, self.gateway.lines)

    def test_the_gateway_writes_nothing_to_the_bus(self):
        listed = self.robot.run("topic", "list").split()
        names = [one.removeprefix("lager/r1/") for one in listed if one.startswith("lager/r1/")]
        self.assertIn("steering/command", names)
        readers = 0
        for name in names:
            told = self.robot.run("topic", "info", name)
            self.assertNotIn("written by gateway", told)
            readers += "read    by gateway" in told
        self.assertGreaterEqual(readers, 10)

    def test_sockets_hear_the_loopback_alone(self):
        ports = [7400 + 250 * self.domain + more for more in (0, 1)]
        shown = subprocess.run(["ss", "-Hanup"], capture_output=True, text=True).stdout
        pid = f"pid={self.gateway.child.pid},"
        own = [line.split()[3] for line in shown.splitlines() if pid in line]
        listening = [one for one in own if int(one.rsplit(":", 1)[1]) // 250 == ports[0] // 250]
        self.assertTrue(listening, shown)
        for socket in listening:
            self.assertIn("%lo:", socket)


class Places(unittest.TestCase):
    """Domains, and two robots in one."""

    def test_the_variable_of_ros_chooses_the_domain_and_the_gateway_says_it(self):
        robot, number = Robot(), domain()
        other = domain()
        gateway = robot.gateway(None, env={"ROS_DOMAIN_ID": str(number)})
        self.assertIn(f"domain {number}, range LOCALHOST", gateway.line("is the node"))
        self.assertIn("r1", peer(number, "nodes", 3)["nodes"])
        self.assertNotIn("r1", peer(other, "nodes", 3)["nodes"])
        robot.end()

    def test_two_robots_are_in_one_domain_and_each_obeys_for_itself(self):
        first = Robot("r1")
        second = Robot("r-2", folder=first.folder)
        number = domain()
        for robot in (first, second):
            robot.gateway(number)
        seen = peer(number, "nodes", 3)
        self.assertTrue({"r1", "r_2"} <= set(seen["nodes"]), seen)
        self.assertTrue({"/r1/map", "/r_2/map"} <= set(seen["topics"]), seen)
        answer = peer(number, "call", "/r_2/stop")
        self.assertTrue(answer["success"], answer)
        self.assertIn("stopped", second.run("resume"))
        second.end()
        until("the first robot drives on", lambda: not first.up.line("drives from") is None)
        first.end()


if __name__ == "__main__":
    unittest.main()
