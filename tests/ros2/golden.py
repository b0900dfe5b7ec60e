#!/usr/bin/env python3
"""Writes services/ros2/tests/golden.txt: what ROS 2 itself makes of the messages of golden.rs, as bytes.

If a test with these bytes fails, the message is wrong, not the file: it changes only with ROS's own
definitions (tests/ros2/requirements.txt).
"""

from pathlib import Path

from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Twist, Vector3
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry, Path as Way
from rcl_interfaces.msg import Log
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import BatteryState, CompressedImage, JointState, Range
from std_msgs.msg import ColorRGBA, Header, UInt8, UInt16
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray, MeshFile, UVCoordinate

header = lambda frame: Header(stamp=Time(sec=-7, nanosec=8), frame_id=frame)
point = lambda x, y, z: Point(x=x, y=y, z=z)
pose = Pose(
    position=point(1.5, -2.5, 3.5),
    orientation=Quaternion(x=0.5, y=-0.5, z=0.5, w=-0.5),
)
stamped = PoseStamped(header=header("a"), pose=pose)


def odometry():
    one = Odometry(header=header("odom"), child_frame_id="base")
    one.pose.pose = pose
    one.pose.covariance = [float(index) for index in range(36)]
    one.twist.twist = Twist(
        linear=Vector3(x=1.0, y=2.0, z=3.0), angular=Vector3(x=4.0, y=5.0, z=6.0)
    )
    one.twist.covariance = [-float(index) for index in range(36)]
    return one


def marker():
    return Marker(
        header=header("map"),
        ns="goods",
        id=-3,
        type=9,
        action=2,
        pose=pose,
        scale=Vector3(x=0.25, y=0.5, z=0.75),
        color=ColorRGBA(r=0.125, g=0.25, b=0.5, a=1.0),
        lifetime=Duration(sec=3, nanosec=4),
        frame_locked=True,
        points=[point(1.0, 2.0, 3.0)],
        colors=[ColorRGBA(r=1.0, g=0.0, b=0.5, a=0.25)],
        texture_resource="t",
        texture=CompressedImage(header=header("i"), format="png", data=[1, 2, 3]),
        uv_coordinates=[UVCoordinate(u=0.5, v=0.75)],
        text="seven",
        mesh_resource="m",
        mesh_file=MeshFile(filename="f", data=[9]),
        mesh_use_embedded_materials=True,
    )


battery = BatteryState(
    header=header("b"),
    voltage=11.5,
    temperature=1.0,
    current=-2.0,
    charge=3.0,
    capacity=4.0,
    design_capacity=5.0,
    percentage=0.5,
    power_supply_status=1,
    power_supply_health=2,
    power_supply_technology=3,
    present=True,
    cell_voltage=[3.75, 3.875],
    cell_temperature=[20.5],
    location="slot",
    serial_number="n1",
)
status = DiagnosticStatus(
    level=b"\x02",
    name="r1: stop",
    message="stopped",
    hardware_id="r1",
    values=[KeyValue(key="k", value="vv")],
)
grid = OccupancyGrid(
    header=header("map"),
    info=MapMetaData(
        map_load_time=Time(sec=1, nanosec=2), resolution=0.125, width=2, height=3, origin=pose
    ),
    data=[-1, 0, 100, 50, -1, 7],
)
golden = {
    "UInt8": UInt8(data=200),
    "UInt16": UInt16(data=0x1234),
    "Range": Range(
        header=header("us"),
        radiation_type=1,
        field_of_view=0.5,
        min_range=0.25,
        max_range=4.0,
        range=1.125,
        variance=0.0625,
    ),
    "BatteryState": battery,
    "JointState": JointState(
        header=header("j"), name=["a", "bcd"], position=[0.5, -0.25], velocity=[], effort=[1.0]
    ),
    "Odometry": odometry(),
    "Path": Way(header=header("p"), poses=[stamped, stamped]),
    "OccupancyGrid": grid,
    "PoseStamped": stamped,
    "DiagnosticArray": DiagnosticArray(header=header("d"), status=[status]),
    "MarkerArray": MarkerArray(markers=[marker(), marker()]),
    "Log": Log(
        stamp=Time(sec=1, nanosec=2),
        level=30,
        name="r1.logic",
        msg="hej",
        file="f",
        function="g",
        line=42,
    ),
    "TriggerResponse": Trigger.Response(success=True, message="done"),
}


def without_padding(one):
    """A message's bytes. Those that fill gaps, in which Fast CDR leaves what was there, are 0, and those
    behind the end, which its estimate of the size adds, are left out."""
    made = bytearray(serialize_message(one))

    def is_it(other):
        try:
            return deserialize_message(bytes(other), type(one)) == one
        except Exception:
            return False

    def means_the_same(at, value):
        other = bytearray(made)
        other[at] = value
        return is_it(other)

    while is_it(made[:-1]):
        del made[-1]

    for at in range(4, len(made)):
        if means_the_same(at, 0) and means_the_same(at, 1):
            made[at] = 0
    return bytes(made).hex()


path = Path(__file__).parents[2] / "services/ros2/tests/golden.txt"
lines = [f"{name} {without_padding(one)}" for name, one in golden.items()]
path.write_text("\n".join(lines) + "\n")
print(f"{len(lines)} messages in {path}")
