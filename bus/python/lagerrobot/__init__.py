"""Reads the bus of a Lagerrobot, and recordings of it, from Python.

    from lagerrobot import Robot

    with Robot("r1") as robot:
        for sample in robot.topic("sensor/line"):
            print(sample.stamp.sequence, sample.data.state)  # 0: on the line

A sample lies in shared memory and is not copied. It lives until the next one is taken;
`sample.copy()` keeps its payload. `Bag("tour.mcap")` reads a recording in the same way, up to its
end. `Robot("r1", role="operator")` may also give commands. `lagerrobot.layouts` has the payloads and
their enums.
"""

from ._bag import Bag
from ._errors import (
    BusError,
    NoBus,
    NoRecording,
    NotOperator,
    OtherLayout,
    OtherVersion,
    Refused,
    Released,
    Unread,
)
from ._reader import Reader, Sample
from ._robot import Robot

__all__ = [
    "Bag",
    "BusError",
    "NoBus",
    "NoRecording",
    "NotOperator",
    "OtherLayout",
    "OtherVersion",
    "Reader",
    "Refused",
    "Released",
    "Robot",
    "Sample",
    "Unread",
]
