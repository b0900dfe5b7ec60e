"""Plots a mission from a recording.

    lager bag record --wait tour.mcap &
    lager up --headless --mission 1 --exit-when-done
    python mission.py tour.mcap mission.png

Needs matplotlib, and the package with recordings: pip install './bus/python[bag]' matplotlib
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection

from lagerrobot import Bag
from lagerrobot.layouts import EventKind, GoodState, Heading, Phase

# Phases in which the robot does the same for a person who looks, each with its colour.
DOING = {
    "waits": (
        "0.88",
        {Phase.WaitingForMap, Phase.WaitingForOrder, Phase.Halted, Phase.Stuck, Phase.Lost},
    ),
    "drives": ("tab:blue", {Phase.Driving, Phase.Approaching, Phase.Exiting, Phase.Returning}),
    "turns": (
        "tab:cyan",
        {Phase.Turning, Phase.Positioning, Phase.Leaving, Phase.TurningRound, Phase.TurningBack},
    ),
    "handles goods": ("tab:orange", {Phase.Picking, Phase.Dropping, Phase.BackingOff}),
    "looks": ("tab:purple", {Phase.Looking}),
}
EVENTS = {EventKind.InPosition: "at the goods", EventKind.ItemDelivered: "delivered"}
MIDDLE = {Heading.Left: (0, 0.5), Heading.Right: (1, 0.5), Heading.Up: (0.5, 1), Heading.Down: (0.5, 0)}


def read(path):
    """What the plot needs, as lists; times are in s since the robot's first report."""
    with Bag(path) as bag:
        start = next(iter(bag.topic("steering/state"))).stamp.publish_time_ns
        seconds = lambda sample: (sample.stamp.publish_time_ns - start) / 1e9
        found = {"robot": bag.robot, "missing": sum(map(bag.missing, bag.topics))}
        found["samples"] = sum(bag.topics.values())
        found["map"] = bag.topic("nav/map").latest().copy()
        poses = bag.topic("truth/pose")
        found["pose"] = [(seconds(s), s.data.x_mm / 1e3, s.data.y_mm / 1e3) for s in poses]
        reports = bag.topic("steering/state")
        found["duty"] = [
            (seconds(s), s.data.left_duty / 2.55, s.data.right_duty / 2.55) for s in reports
        ]
        distances = bag.topic("sensor/distance")
        found["distance"] = [
            (seconds(s), s.data.distance_cm if s.data.distance_cm != 255 else float("nan"))
            for s in distances
        ]
        found["phase"] = [(seconds(s), s.data.phase) for s in bag.topic("nav/status")]
        found["event"] = [(seconds(s), s.data.kind) for s in bag.topic("mission/event")]
        # From a sensor frame's bytes to the order that it caused, in us; renewals repeat an order.
        found["path"], given = [], set()
        for order in bag.topic("steering/command"):
            if order.stamp.cause_topic and order.data.id not in given:
                given.add(order.data.id)
                took = order.stamp.publish_time_ns - order.stamp.source_time_ns
                found["path"].append((seconds(order), took / 1e3))
        world = bag.topic("truth/pose").latest().data
        found["goods"] = [
            (good.id, good.x_mm / 1e3, good.y_mm / 1e3, good.state)
            for good in list(world.goods)[: world.good_count]
        ]
    return found


def at(found, moment):
    """Where the robot was then."""
    return min(found["pose"], key=lambda pose: abs(pose[0] - moment))[1:]


def draw_map(axes, found, figure):
    warehouse, side = found["map"], found["map"].side_length_cm / 100
    for row in range(warehouse.height + 1):
        axes.plot([0, warehouse.width * side], [row * side] * 2, color="0.8", lw=5, zorder=0)
    for column in range(warehouse.width + 1):
        axes.plot([column * side] * 2, [0, warehouse.height * side], color="0.8", lw=5, zorder=0)
    for product in list(warehouse.products)[: warehouse.product_count]:
        right, up = MIDDLE[product.side]
        x, y = (product.x + right) * side, (product.y + up) * side
        axes.plot(x, y, "s", color="tab:orange", ms=9, zorder=1)
        axes.annotate(
            str(product.id), (x, y), xytext=(-14, 6), textcoords="offset points", color="tab:orange"
        )
    for product, x, y, state in found["goods"]:
        if state == GoodState.Delivered:
            axes.plot(x, y, "s", color="tab:green", ms=9, zorder=3)
            note = {"xytext": (0, 8), "textcoords": "offset points", "ha": "center"}
            axes.annotate(str(product), (x, y), color="tab:green", **note)
    points = [(x, y) for _, x, y in found["pose"]]
    way = LineCollection(list(zip(points, points[1:])), cmap="viridis", lw=2, zorder=2)
    way.set_array([moment for moment, *_ in found["pose"]])
    axes.add_collection(way)
    figure.colorbar(way, ax=axes, label="time (s)", location="bottom", shrink=0.8)
    for moment, kind in found["event"]:
        if kind in EVENTS:
            x, y = at(found, moment)
            axes.plot(x, y, "o", mfc="white", mec="black", ms=6, zorder=4)
            axes.annotate(
                EVENTS[kind], (x, y), xytext=(12, 18), textcoords="offset points",
                arrowprops={"arrowstyle": "-", "color": "0.4"},
            )
    axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", title="Where it drove")
    axes.margins(0.12)


def draw_phases(axes, found):
    drawn = set()
    ends = [moment for moment, _ in found["phase"][1:]] + [found["phase"][-1][0]]
    for (moment, phase), end in zip(found["phase"], ends):
        doing = next(name for name, (_, phases) in DOING.items() if phase in phases)
        label = None if doing in drawn else doing
        axes.axvspan(moment, end, color=DOING[doing][0], lw=0, label=label)
        drawn.add(doing)
    axes.set(yticks=[], title="What it did")
    axes.legend(ncols=5, loc="upper center", bbox_to_anchor=(0.5, -0.1), frameon=False, fontsize=8)


def draw(found, path):
    figure = plt.figure(figsize=(12, 6.5), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=[1, 1.35])
    draw_map(left.subplots(), found, left)
    heights = {"height_ratios": [0.5, 1, 1, 1]}
    phases, duty, distance, latency = right.subplots(4, 1, sharex=True, gridspec_kw=heights)
    draw_phases(phases, found)
    times = [moment for moment, *_ in found["duty"]]
    duty.plot(times, [left for _, left, _ in found["duty"]], lw=0.8, label="left")
    duty.plot(times, [right for _, _, right in found["duty"]], lw=0.8, label="right")
    duty.set(ylabel="duty (%)", title="Motors")
    duty.legend(loc="upper right", fontsize=8)
    distance.plot(*zip(*found["distance"]), lw=1.5, color="tab:purple")
    title = "What is in front (nothing within 80 cm: no line)"
    distance.set(ylabel="distance (cm)", title=title, ylim=(0, 80))
    latency.semilogy(*zip(*found["path"]), ".", ms=2, color="tab:gray")
    title = "From a sensor frame to the order it caused"
    latency.set(ylabel="time (us)", xlabel="time (s)", title=title)
    for moment, kind in found["event"]:
        if kind in EVENTS:
            for axes in (phases, duty, distance, latency):
                axes.axvline(moment, color="black", lw=0.7, ls=":")
    samples, missing = found["samples"], found["missing"]
    figure.suptitle(f"A mission of {found['robot']}: {samples} samples, {missing} missing")
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    draw(read(sys.argv[1]), sys.argv[2])
