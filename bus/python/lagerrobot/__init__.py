"""Reads the bus of a Lagerrobot from Python.

    from lagerrobot import Robot

    with Robot("r1") as robot:
        for sample in robot.topic("sensor/line"):
            print(sample.stamp.sequence, sample.data.bits)

A sample lies in shared memory and is not copied. It lives until the next one is taken;
`sample.copy()` keeps its payload. `lagerrobot.layouts` has the payloads and their enums.
"""

from ._errors import BusError, NoBus, OtherLayout, OtherVersion, Released, Unread
from ._reader import Reader, Sample
from ._robot import Robot

__all__ = [
    "BusError",
    "NoBus",
    "OtherLayout",
    "OtherVersion",
    "Reader",
    "Released",
    "Robot",
    "Sample",
    "Unread",
]
