"""Reads a robot over its gateway: ENDPOINT, then the three files of a listener if it has some."""

import json
import sys

import lagerrobot
from lagerrobot import Robot, layouts

endpoint, *files = sys.argv[1:]
proof = dict(zip(("authority", "certificate", "key"), files))


def refused(kind, doing):
    try:
        doing()
    except kind as error:
        return str(error)
    raise AssertionError(f"{doing} was not refused")


with Robot("r1", remote=endpoint, **proof) as robot:
    lines = robot.topic("sensor/line")
    first = None
    for sample in lines:
        if first is None:
            first = sample.stamp.sequence
        assert sample.stamp.sequence == first + lines.received - 1
        assert isinstance(sample.copy(), layouts.LineFrame)
        if lines.received == 200:
            break
    assert lines.lost == 0
    kept, view = sample.copy(), sample.data
    assert view.bits == kept.bits == sample.array()["bits"][0]
    lines.receive()
    refused(lagerrobot.Released, lambda: view.bits)

    # A state comes although nothing is sent, and once.
    maps = robot.topic("nav/map")
    newest = None
    while newest is None:
        newest = maps.latest()
    size = newest.data.width, newest.data.height
    assert maps.latest() is None

    # A topic that is in no table, as it describes itself.
    weather = robot.topic("weather/now")
    print(json.dumps({"ready": True}), flush=True)
    for sample in weather:
        assert sample.array()["gusts"][0][1] == sample.data.gusts[1] == sample.data.wind + 1
        if weather.received == 10:
            break
    assert "sky=Fog" in repr(sample.data), sample
    said = refused(lagerrobot.Unread, lambda: robot.topic("no/topic"))
    assert "it sends" in said and "sensor/line" in said, said
    refused(lagerrobot.NotOperator, lambda: robot.tell("stop"))

    # Another build's layout.
    payload = layouts.TOPICS["sensor/distance"].payload
    layouts.TOPICS["sensor/distance"] = layouts.TOPICS["sensor/distance"]._replace(
        payload=layouts.LineFrame
    )
    said = refused(lagerrobot.OtherLayout, lambda: robot.topic("sensor/distance"))
    assert "another layout" in said, said
    layouts.TOPICS["sensor/distance"] = layouts.TOPICS["sensor/distance"]._replace(payload=payload)
    robot.topic("sensor/distance")
refused(lagerrobot.Unread, lines.receive)
refused(lagerrobot.NotOperator, lambda: Robot("r1", remote=endpoint, role="operator", **proof))
said = refused(lagerrobot.NoBus, lambda: Robot("r2", remote=endpoint, **proof))
assert "the robot `r2`" in said, said
said = refused(lagerrobot.NoBus, lambda: Robot("r1", remote="tls/127.0.0.1:1"))
assert "needs certificates" in said, said
said = refused(lagerrobot.NoBus, lambda: Robot("r1", remote="tcp/127.0.0.1:1"))
assert "no connection" in said, said
print(json.dumps({"map": size}), flush=True)
