"""Gives commands to the robot r1: FOLDER of the bus, then the program `lager`."""

import sys

import lagerrobot
from lagerrobot import Robot

folder, lager = sys.argv[1:]


def refused(kind, doing):
    try:
        doing()
    except kind as error:
        return str(error)
    raise AssertionError(f"{doing} was not refused")


with Robot("r1", bus=folder, lager=lager) as robot:
    said = refused(lagerrobot.NotOperator, lambda: robot.tell("stop"))
    assert "operator" in said, said
refused(lagerrobot.NotOperator, lambda: Robot("r1", bus=folder, role="bridge"))

with Robot("r1", bus=folder, role="operator", lager=lager) as robot:
    health = robot.topic("link/health")
    robot.tell("stop")
    for sample in health:
        if sample.data.stopped:
            break
    robot.tell("resume")
    for sample in health:
        if not sample.data.stopped:
            break
    # What lager refuses has its sentence, and what is no command is not given to it.
    said = refused(lagerrobot.Refused, lambda: robot.tell("mode", "sideways"))
    assert "sideways" in said, said
    said = refused(lagerrobot.Refused, lambda: robot.tell("up"))
    assert "no command" in said, said
with Robot("r1", bus=folder, role="operator", lager="/nowhere/lager") as robot:
    said = refused(lagerrobot.Refused, lambda: robot.tell("stop"))
    assert "there is no program `/nowhere/lager`" in said, said
    assert "cargo install --path services/lager" in said, said
