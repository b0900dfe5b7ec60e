"""A program of ROS 2 that starts, does one thing, prints one line of JSON and ends.

late TOPIC TYPE SECONDS   subscribes as for a map; tells how many messages came, and their hashes
listen TOPIC TYPE SECONDS subscribes reliably; tells how many messages came
call SERVICE [SECONDS]    waits for the service, calls it once at once, tells the answer
nodes                     tells which nodes there are
"""

import hashlib
import json
import sys
import time

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from std_srvs.srv import Trigger

from types_ import named

LASTING = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


def late(node, topic, kind, seconds):
    came = []
    node.create_subscription(named(kind), topic, came.append, LASTING)
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
        if came:
            # A second one would come at once.
            end = min(end, time.monotonic() + 0.5)
    hashes = [hashlib.sha256(serialize_message(one)).hexdigest() for one in came]
    return {"count": len(came), "hashes": hashes}


def listen(node, topic, kind, seconds):
    came = []
    node.create_subscription(named(kind), topic, came.append, 10)
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
        if len(came) == 1:
            print("listens", flush=True)
    return {"count": len(came)}


def call(node, service, seconds="10"):
    client = node.create_client(Trigger, service)
    if not client.wait_for_service(float(seconds)):
        return {"found": False}
    began = time.monotonic()
    asked = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, asked, timeout_sec=float(seconds))
    answer = asked.result() if asked.done() else None
    took = time.monotonic() - began
    if answer is None:
        return {"found": True, "answered": False, "took": took}
    return {
        "found": True,
        "answered": True,
        "took": took,
        "success": answer.success,
        "message": answer.message,
    }


def nodes(node, seconds="4"):
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)
    return {
        "nodes": [name for name, _ in node.get_node_names_and_namespaces()],
        "topics": [name for name, _ in node.get_topic_names_and_types()],
    }


if __name__ == "__main__":
    rclpy.init()
    peer = Node("peer")
    print(json.dumps(globals()[sys.argv[1]](peer, *sys.argv[2:])))
    peer.destroy_node()
    rclpy.shutdown()
