"""What a program may write, and mypy must accept."""

from typing import Optional

from lagerrobot import Bag, Robot
from lagerrobot.layouts import LineFrame, LineState


def on_the_line(robot: Robot) -> int:
    count = 0
    for sample in robot.topic("sensor/line"):
        frame: LineFrame = sample.copy()
        bits: int = sample.data.bits
        if frame.state == LineState.OnLine and bits and sample.stamp.sequence > 9:
            count += 1
    return count


def farthest(path: str) -> float:
    with Bag(path) as bag:
        poses = bag.topic("truth/pose")
        return max(sample.data.x_mm for sample in poses) + poses.lost


def fetch(product: int) -> str:
    with Robot("r1", role="operator") as robot:
        return robot.tell("fetch", product)


def afar(endpoint: str) -> int:
    with Robot("r1", remote=endpoint) as robot:
        frame: Optional[LineFrame] = None
        for sample in robot.topic("sensor/line"):
            frame = sample.copy()
            break
        return frame.bits if frame else 0
