"""A listener of another origin: Cyclone DDS, with the types of tf written down here, since nobody packs
`tf2_msgs` for Python. Prints one line of JSON: the frames that never move, and each frame that does.

foreign.py DOMAIN SECONDS
"""

import json
import os
import sys
import time

os.environ["CYCLONEDDS_URI"] = """
<CycloneDDS><Domain>
  <General>
    <Interfaces><NetworkInterface name="lo"/></Interfaces>
    <AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <Peers><Peer address="127.0.0.1"/></Peers>
  </Discovery>
</Domain></CycloneDDS>"""

from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


def main(domain, seconds):
    participant = DomainParticipant(int(domain))
    reliable = Policy.Reliability.Reliable(duration(seconds=1))
    topic = lambda name: Topic(participant, name, TFMessage)
    lasting = Qos(reliable, Policy.Durability.TransientLocal, Policy.History.KeepLast(10))
    fixed = DataReader(participant, topic("rt/tf_static"), qos=lasting)
    moving = DataReader(participant, topic("rt/tf"), qos=Qos(reliable, Policy.History.KeepLast(100)))
    frames, moved = {}, {}
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        for reader, into in ((fixed, frames), (moving, moved)):
            for message in reader.take(100):
                for one in message.transforms:
                    stamp = one.header.stamp
                    place, turn = one.transform.translation, one.transform.rotation
                    into.setdefault(one.child_frame_id, []).append(
                        {
                            "in": one.header.frame_id,
                            "ns": stamp.sec * 1_000_000_000 + stamp.nanosec,
                            "place": [place.x, place.y, place.z],
                            "turn": [turn.x, turn.y, turn.z, turn.w],
                        }
                    )
        time.sleep(0.02)
    print(json.dumps({"fixed": frames, "moved": moved}))


main(*sys.argv[1:])
