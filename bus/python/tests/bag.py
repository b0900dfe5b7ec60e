"""Reads a recording: FILE; prints what each topic has, as JSON."""

import asyncio
import ctypes
import json
import sys

import lagerrobot
from lagerrobot import Bag, layouts


def refused(kind, doing):
    try:
        doing()
    except kind as error:
        return str(error)
    raise AssertionError(f"{doing} was not refused")


async def count(reader):
    return [(sample.stamp.epoch, sample.stamp.sequence) async for sample in reader]


def newest_words(bag):
    return bag.topic("noise/now").latest().copy().words


path = sys.argv[1]
read = {}
with Bag(path) as bag:
    for topic, messages in bag.topics.items():
        reader = bag.topic(topic)
        last = None
        for sample in reader:
            last = sample
            assert bytes(sample.copy()) == bytes(sample.data)
        assert reader.received == messages, topic
        missing = bag.missing(topic)
        read[topic] = {"received": reader.received, "lost": reader.lost, "missing": missing}
        # The end gives the last one back, as the next one would.
        refused(lagerrobot.Released, last.copy)

    # What lies in a sample is as on the bus: enums are numbers, lists are as long as in memory.
    lines = bag.topic("sensor/line")
    first, second = lines.receive().copy(), lines.receive()
    assert isinstance(first, layouts.LineFrame) and first.state in list(layouts.LineState)
    assert "read-only" in refused(AttributeError, lambda: setattr(second.data, "bits", 1))
    assert second.array()["bits"][0] == second.data.bits
    newest = bag.topic("truth/pose").latest()
    assert len(newest.data.goods) == 256 and newest.data.goods[0].id > 0
    assert ctypes.sizeof(newest.copy()) == len(bytes(newest.data))
    # One that is in no table has its layout in the file.
    for noise in bag.topic("noise/now"):
        assert noise.data.number == noise.stamp.sequence
    assert [len(noise) for noise in newest_words(bag)] == [32] * 4
    # Two at once, and as they come.
    both = zip(bag.topic("sensor/line"), bag.topic("steering/state"))
    assert all(line.stamp.writer == state.stamp.writer for line, state in both)
    numbers = asyncio.run(count(bag.topic("sensor/line")))
    assert numbers == sorted(numbers) and len(numbers) == read["sensor/line"]["received"]
    # Another build's.
    stamp, odd = layouts.Stamp(), {"new": 1}
    said = refused(lagerrobot.OtherLayout, lambda: lagerrobot._bag.fill(stamp, odd, "sensor/line"))
    assert "another build" in said and "sequence" in said
    said = refused(lagerrobot.Unread, lambda: bag.topic("sensor/lime"))
    assert "it has " in said and "noise/now" in said, said
refused(lagerrobot.Unread, lines.receive)
refused(lagerrobot.Unread, lambda: bag.topic("sensor/line"))
refused(lagerrobot.NoRecording, lambda: Bag(path + ".none"))
said = refused(lagerrobot.NoRecording, lambda: Bag(__file__))
assert "no whole recording" in said, said
print(json.dumps(read))
