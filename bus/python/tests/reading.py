"""Reads what the test publishes, in step with it: FOLDER, then the number of frames."""

import asyncio
import json
import sys

import lagerrobot
from lagerrobot import Robot, layouts

folder, frames = sys.argv[1], int(sys.argv[2])


def told(expected):
    line = sys.stdin.readline().strip()
    assert line == expected, line


def say(**what):
    print(json.dumps(what), flush=True)


def refused(kind, doing):
    try:
        doing()
    except kind as error:
        return str(error)
    raise AssertionError(f"{doing} was not refused")


async def one(reader):
    async for sample in reader:
        return sample.copy()


with Robot("r1", bus=folder) as robot:
    reader = robot.topic("sensor/line")
    say(ready=True)

    # A paced stream, to its last number.
    for sample in reader:
        assert sample.data.link_epoch == sample.stamp.sequence
        if sample.stamp.sequence == frames - 1:
            break
    say(received=reader.received, lost=reader.lost)

    # More at once than the queue holds.
    told("burst")
    last = None
    while (sample := reader.receive()) is not None:
        last = sample.stamp.sequence
    say(received=reader.received, lost=reader.lost, last=last)

    # Views, copies, and what must not be done.
    told("four more")
    sample = reader.receive()
    view, kept = sample.data, sample.copy()
    assert view.bits == kept.bits == sample.array()["bits"][0]
    assert view.state == layouts.LineState.FourWay and "state=FourWay" in repr(view)
    assert "read-only" in refused(AttributeError, lambda: setattr(view, "bits", 1))
    reader.receive()
    said = refused(lagerrobot.Released, lambda: view.bits)
    assert "sensor/line" in said and "copy()" in said, said
    refused(lagerrobot.Released, lambda: sample.data.bits)
    refused(lagerrobot.Released, sample.copy)
    assert kept.link_epoch == frames + 1000
    assert asyncio.run(one(reader)).link_epoch == frames + 1002
    assert reader.latest().data.link_epoch == frames + 1003
    assert reader.latest() is None

    # A state for a late joiner, with what is inside it.
    products = robot.topic("nav/map")
    say(late=True)
    told("map")
    newest = products.latest()
    assert newest.data.products[1].id == 7 and len(newest.data.products) == 256
    inner = newest.data.products[1]
    assert newest.array()["products"]["id"][0][1] == 7
    newest.release()
    refused(lagerrobot.Released, lambda: inner.id)
    refused(lagerrobot.Unread, lambda: robot.topic("sensor/lime"))

    # Another build's layout: the same type with another hash.
    ours = layouts.DistanceFrame._hash_
    layouts.DistanceFrame._hash_ = 0x1234
    said = refused(lagerrobot.OtherLayout, lambda: robot.topic("sensor/distance"))
    assert f"{ours:016x}" in said and f"{0x1234:016x}" in said, said
    layouts.DistanceFrame._hash_ = ours
    robot.topic("sensor/distance")
refused(lagerrobot.Unread, reader.receive)
refused(lagerrobot.NoBus, lambda: Robot("r1", bus=folder + "/nowhere"))
say(done=True)
