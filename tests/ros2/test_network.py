"""The node in a network: robot and listener in two networks of the kernel with one cable between them, as
two machines would be."""

import json
import os
import shutil
import subprocess
import sys
import unittest

from robot import PATIENCE, Robot, domain

MAY = os.geteuid() == 0 and shutil.which("ip") is not None


def ip(*words):
    subprocess.run(["ip", *words], check=True, capture_output=True, text=True)


@unittest.skipUnless(MAY, "needs root and the program `ip`")
class Network(unittest.TestCase):
    def setUp(self):
        self.names = [f"lros{os.getpid()}{end}" for end in "ab"]
        for name in self.names:
            ip("netns", "add", name)
            self.addCleanup(ip, "netns", "del", name)
        first, second = self.names
        ip("-n", first, "link", "add", "cable", "type", "veth", "peer", "name", "cable", "netns", second)
        for number, name in enumerate(self.names, 1):
            ip("-n", name, "address", "add", f"10.99.42.{number}/24", "dev", "cable")
            for device in ("lo", "cable"):
                ip("-n", name, "link", "set", device, "up")
            # Only there are programs found by multicast.
            ip("-n", name, "route", "add", "224.0.0.0/4", "dev", "cable")
        self.robot, self.number = Robot(), domain()
        self.addCleanup(self.robot.end)

    def elsewhere(self, *words):
        """What a program of ROS 2 at the other end of the cable prints."""
        there = ["ip", "netns", "exec", self.names[1], sys.executable, "peer.py", *words]
        place = {"ROS_DOMAIN_ID": str(self.number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
        env = {**os.environ, **place}
        ran = subprocess.run(there, capture_output=True, text=True, timeout=PATIENCE, env=env)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return json.loads(ran.stdout.splitlines()[-1])

    def gateway(self, reach):
        here = ["ip", "netns", "exec", self.names[0]]
        return self.robot.gateway(self.number, "--range", reach, before=here)

    def test_with_subnet_another_machine_hears_the_robot_and_stops_it(self):
        gateway = self.gateway("subnet")
        gateway.line("everybody in the network")
        heard = self.elsewhere("listen", "/r1/odom", "nav_msgs/msg/Odometry", "5")
        self.assertGreater(heard["count"], 20)
        late = self.elsewhere("late", "/r1/map", "nav_msgs/msg/OccupancyGrid", "20")
        self.assertEqual(late["count"], 1)
        answer = self.elsewhere("call", "/r1/stop")
        self.assertTrue(answer["success"], answer)
        self.assertIn("stopped", self.robot.run("resume"))

    def test_with_localhost_no_other_machine_finds_it(self):
        self.gateway("localhost")
        seen = self.elsewhere("nodes", "6")
        self.assertNotIn("r1", seen["nodes"])
        self.assertNotIn("/r1/map", seen["topics"])


if __name__ == "__main__":
    unittest.main()
