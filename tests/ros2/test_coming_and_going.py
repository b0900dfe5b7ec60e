"""Late listeners, nodes that end, and memory."""

import os
import signal
import subprocess
import sys
import time
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from std_srvs.srv import Trigger

from robot import Robot, domain, peer, until
from test_topics import Listener

LATE = 50
# RustDDS's lease, and 2 s.
LEASE = 52.0
# What the short form allows; tests/ros2/memory measures for as long as it is told.
GROWTH_KB = 3_000


def resident_kb(process):
    status = Path(f"/proc/{process.child.pid}/status").read_text()
    [line] = [line for line in status.splitlines() if line.startswith("VmRSS")]
    return int(line.split()[1])


class ComingAndGoing(unittest.TestCase):
    def test_each_late_listener_gets_the_map_exactly_once(self):
        robot, number = Robot(), domain()
        robot.gateway(number)
        robot.up.line("drives from")
        # A robot that stands finds no way blocked, so its map stays.
        robot.run("stop")
        with ThreadPoolExecutor(3) as three:
            one = lambda _: peer(number, "late", "/r1/map", "nav_msgs/msg/OccupancyGrid", 20)
            came = list(three.map(one, range(LATE)))
        robot.end()
        self.assertEqual([one["count"] for one in came], [1] * LATE)
        self.assertEqual(len({one["hashes"][0] for one in came}), 1)

    def test_a_node_that_ends_is_gone_at_once_and_a_killed_one_after_its_lease(self):
        robot, number = Robot(), domain()
        listener = Listener(number)
        node = listener.node
        shown = lambda: "r1" in node.get_node_names() and node.count_publishers("/r1/range")
        gone = lambda: "r1" not in node.get_node_names() and not node.count_publishers("/r1/range")
        stop = node.create_client(Trigger, "/r1/stop")
        for how in (signal.SIGINT, signal.SIGTERM):
            gateway = robot.gateway(number)
            listener.spin(found=lambda: shown() and stop.service_is_ready())
            self.assertEqual(gateway.end(how), 0)
            began = time.monotonic()
            listener.spin(found=lambda: gone() and not stop.service_is_ready())
            took = time.monotonic() - began
            print(f"gone {took:.2f} s after {how.name}", file=sys.stderr)
            # Its lease is 50 s: this was its word.
            self.assertLess(took, LEASE / 2)
        # A fresh program sees no ghost.
        self.assertNotIn("r1", peer(number, "nodes", 3)["nodes"])
        gateway = robot.gateway(number)
        listener.spin(found=shown)
        gateway.end(signal.SIGKILL)
        began = time.monotonic()
        until("the lease's end", lambda: listener.spin(0.2) and gone(), LEASE + 30)
        print(f"gone {time.monotonic() - began:.0f} s after SIGKILL", file=sys.stderr)
        listener.end()
        robot.end()

    def test_a_second_node_of_the_same_robot_is_refused(self):
        robot, number = Robot(), domain()
        robot.gateway(number)
        ran = subprocess.run(
            [*robot.lager, "gateway", "--ros2", "--domain", str(number)],
            capture_output=True,
            text=True,
            timeout=60,
        )
        self.assertEqual(ran.returncode, 4, ran)
        self.assertIn("already runs", ran.stderr)
        robot.end()

    def test_memory_does_not_grow_beside_a_listener_that_is_frozen(self):
        robot, number = Robot(), domain()
        gateway = robot.gateway(number)
        env = {**os.environ, "ROS_DOMAIN_ID": str(number)}
        reader = subprocess.Popen(
            [sys.executable, "peer.py", "listen", "/r1/odom", "nav_msgs/msg/Odometry", "1000"],
            env=env,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.assertEqual(reader.stdout.readline().strip(), "listens")
        time.sleep(10)
        before = resident_kb(gateway)
        reader.send_signal(signal.SIGSTOP)
        time.sleep(30)
        grown = resident_kb(gateway) - before
        reader.kill()
        reader.wait()
        robot.end()
        print(f"memory grew by {grown} kB in 30 s from {before} kB", file=sys.stderr)
        self.assertLess(grown, GROWTH_KB)


if __name__ == "__main__":
    unittest.main()
