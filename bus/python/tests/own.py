"""Reads a topic that is in no table as it describes itself: FOLDER of the bus. The test has it open."""

import json
import sys

import lagerrobot
from lagerrobot import Robot, _described


def refused(kind, doing):
    try:
        doing()
    except kind as error:
        return str(error)
    raise AssertionError(f"{doing} was not refused")


# Whatever somebody writes there, it is a layout or is refused.
text = "A{from:[B{c:u16,d:T<X,7=None>,e:u8};2],f:B,g:T,h:[T;2],i:u8,j:f64}"
made = _described.layout(text)
assert [name for name, _ in made._fields_] == ["from_", "f", "g", "h", "i", "j"], made
assert made.dtype().itemsize == 24 and made._enums_["g"].None_ == 7, made
for wrong in ["", "A", "A{", "A{}", "A{b:C}", "A{b:u8", "A{b:u8}}", "A{b:[u8;0]}", "u8", "T<X>"]:
    refused(_described.NotReadable, lambda: _described.layout(wrong))
for wrong in ["A{b:u8,c:u16}", "A{b:T<256=X>}", "A{b:" + "[" * 20, "A{b:[u64;99999999999999999999]}"]:
    refused(_described.NotReadable, lambda: _described.layout(wrong))

with Robot("r1", bus=sys.argv[1]) as robot:
    said = refused(lagerrobot.Unread, lambda: robot.topic("weather/then"))
    assert "nobody has one open" in said, said
    weather = robot.topic("weather/now")
    print(json.dumps({"ready": True}), flush=True)
    for sample in weather:
        wind, sky = sample.data.wind, sample.data.sky
        assert sample.array()["gusts"][0][1] == sample.data.gusts[1] == wind + 1
        method = sample.data.copy
        if sample.stamp.sequence == 9:
            break
    assert "sky=Fog" in repr(sample.data), sample
    kept = sample.copy()
    print(json.dumps({"received": weather.received, "lost": weather.lost}), flush=True)
    assert (kept.wind, kept.sky, kept.from_) == (wind, sky, 90), kept
    weather.receive()
    # Also a method that somebody has kept ends with its sample.
    refused(lagerrobot.Released, method)
