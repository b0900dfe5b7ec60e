// The model: what a station's lines make of a robot, and how the page asks.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Pace } from "../page/station/pace.js";
import { quantile } from "../page/station/quantile.js";
import { fields, note, report } from "../page/station/report.js";
import { Robot } from "../page/station/robot.js";
import { choose, named, shown } from "../page/station/chosen.js";

/** A robot to which these lines were told at these times of the page's clock, in ms. */
function told(...lines) {
  const robot = new Robot("r1");
  for (const [now, line] of lines) {
    const [word, ...rest] = line.split(" ");
    report(robot, word, rest, now, 1_000_000 + now);
  }
  return robot;
}

test("fields are the words with a sign, and a value may be empty", () => {
  assert.deepEqual(fields(["mode=manual", "looks=", "x_mm=-4"]), { mode: "manual", looks: "", x_mm: "-4" });
});

test("each line that tells what is so now replaces what was so before", () => {
  const robot = told(
    [0, "route 2 0,0"], [0, "route 2 1 0 1 1"], [0, "gone 2 7 9"], [0, "blocked 1 1 0 up 42"], [0, "obstacles 2 0 0 up 1 1 right"],
    [0, "queue 2 11 7 12 9"], [0, "truth 10 20 90 7"], [0, "sensors 100 20 200 1 7 7 7 0"],
  );
  assert.deepEqual(robot.route, [[1, 0], [1, 1]]);
  assert.deepEqual([...robot.gone], ["7", "9"]);
  assert.deepEqual([...robot.blocked], [["1 0 up", 42]]);
  assert.deepEqual(robot.placed, ["0 0 up", "1 1 right"]);
  assert.deepEqual(robot.queue, [{ order: "11", product: "7" }, { order: "12", product: "9" }]);
  assert.deepEqual(robot.truth, { x: 10, y: 20, heading: 90, carrying: "7" });
  assert.deepEqual(robot.sensors, [{ reading: 100, lowest: 20, highest: 200, both: true }, { reading: 7, lowest: 7, highest: 7, both: false }]);
  assert.deepEqual(robot.events, []);
});

test("a line that an object inherits its name from tells nothing", () => {
  assert.deepEqual(told([0, "constructor 1 2"], [0, "toString"]), told());
});

test("where it was stays when it is not known any more, and how far it may be from there grows with the faster wheel", () => {
  const robot = told([0, "state x_mm=400 y_mm=0 heading_deg=90 unsure_mm=5"], [1_000, "state left_duty=40 right_duty=100"], [3_000, "state left_duty=0 right_duty=0"]);
  assert.deepEqual(robot.pose, { x: 400, y: 0, heading: 90, unsure: 5 });
  // A second at 100, which came at its end, and two seconds at 0.
  assert.equal(robot.strayed, 100);
  assert.equal(robot.mayHaveDriven(10_000), 0);
  report(robot, "state", ["x_mm=1", "y_mm=2"], 4_000, 0);
  assert.equal(robot.strayed, 0);
});

test("a robot that is not heard is not taken to drive on for ever", () => {
  const robot = told([0, "state left_duty=10 right_duty=7"]);
  assert.equal(robot.mayHaveDriven(2_000), 20);
  assert.equal(robot.mayHaveDriven(3_600_000), 600);
});

test("the last minute keeps what is known as numbers, and what is not as none", () => {
  const robot = told([5, "latency 900 3 10"], [7, "state battery_dv=117 line_error=-3 sensor_lost=2 bus_lost=1"]);
  const { at, battery, line_error: error, lost, x, path_p50: p50 } = robot.past[0];
  assert.deepEqual({ at, battery, error, lost, x }, { at: 7, battery: 11.7, error: -3, lost: 3, x: null });
  assert.equal(p50, robot.latency.p50);
  for (let now = 0; now < 3_000; now++) report(robot, "state", [], now, now);
  assert.equal(robot.total, 3_001);
  assert.ok(robot.past.length >= 1_200 && robot.past.length <= 1_400, `${robot.past.length}`);
});

/** What a page keeps of a robot, whose clock goes `speed` times as fast as the station's: it stands still from `from` to `to`. */
function stalled(speed, from, to) {
  const robot = new Robot("r1");
  for (let at = 0; at <= 10_000; at += 50) {
    const now = at >= from && at < to ? to : at + 3;
    // The station tells its time to a page that says that it is there.
    if (at % 1_000 === 0 && now !== to) robot.pace.station(at);
    report(robot, "state", [`time_ms=${70_000 + at * speed}`, `x_mm=${at}`, "y_mm=0"], now, now);
    if (at === 5_500) report(robot, "event", ["stopped", "0", "0", "1", "1"], now, now);
  }
  return robot;
}

test("in a page that stood still the strips and the log have the times at which it was so", () => {
  for (const speed of [1, 4, 0.5]) {
    const robot = stalled(speed, 3_400, 7_900);
    for (const { at, x } of robot.past) assert.ok(Math.abs(at - x) <= 300, `${at}, ${x}`);
    assert.ok(Math.abs(robot.events[0].at - 5_500) <= 300, `${robot.events[0].at}`);
  }
  // What comes as usual counts as it comes.
  assert.deepEqual(stalled(1, 0, 0).past.map(({ at, x }) => at - x), Array(201).fill(3));
});

test("a robot that was not heard, and a clock that was set, are not taken for a page that stood still", () => {
  const pace = new Pace();
  const hear = (ms, at) => (pace.robot(ms, at), pace.waited);
  const told = (ms, at) => (pace.station(at), hear(ms, at));
  for (let at = 0; at < 5_000; at += 1_000) told(at + 20, at);
  // The station is heard, the robot is not; then it begins anew.
  for (let at = 5_000; at < 9_000; at += 1_000) pace.station(at);
  assert.deepEqual([hear(9_020, 9_000), told(9_060, 9_040), told(10_000, 10_000), told(10, 11_000), told(1_010, 12_000)], [0, 0, 0, 0, 0]);
  // The station's clock is set back, and forth.
  assert.deepEqual([told(2_010, 4_000), told(3_010, 5_000), told(4_010, 900_000), told(5_010, 901_000)], [0, 0, 0, 0]);
  assert.equal(hear(null, 950_000), 0);
});

test("a stop's age is told, its moment is kept", () => {
  assert.equal(told([50, "state stop_age_ms=2000"]).stoppedSince, 1_000_050 - 2_000);
  assert.equal(told([50, "state stopped=0"]).stoppedSince, null);
});

test("a robot is stale without a connection, without a word or without a state", () => {
  const robot = told([1_000, "state mode=manual"]);
  Object.assign(robot, { connected: true, heard: 1_000 });
  assert.equal(robot.isStale(1_400), false);
  assert.equal(robot.isStale(1_501), true);
  assert.equal(Object.assign(robot, { heard: 2_000 }).isStale(2_000), true);
  assert.equal(Object.assign(robot, { connected: false }).isStale(1_400), true);
});

test("a thought has the values that came right before it, and nothing else has them", () => {
  const kept = { thinks: null, events: [], happened: (entry) => kept.events.push(entry) };
  const lines = ["thinks kind=node_passed node=2,1", "event mode 0 0 -", "thinks kind=order_waits", "thought It waits.", "thought Alone.", "because misread x y", "thought No."];
  for (const line of lines) {
    const [word, ...rest] = line.split(" ");
    note(kept, word, rest, 7);
  }
  assert.deepEqual(kept.events.map(({ kind, values }) => [kind, values]), [
    ["event", null], ["thought", { kind: "order_waits" }], ["thought", null], ["thought", { because: "misread x y" }],
  ]);
});

test("what is told later stands where it happened, and the oldest goes first", () => {
  const robot = new Robot("r1");
  for (const at of [10, 30, 20, 20]) robot.happened({ at, kind: "event", words: [String(robot.events.length)], values: null });
  assert.deepEqual(robot.events.map(({ at, words }) => [at, words[0]]), [[10, "0"], [20, "2"], [20, "3"], [30, "1"]]);
  for (let at = 100; at < 1_200; at++) robot.happened({ at, kind: "event", words: [], values: null });
  assert.equal(robot.events.length, 1_000);
  assert.equal(robot.events.at(-1).at, 1_199);
});

test("a time that a part of the frames did not exceed lies within its bucket and below the longest", () => {
  // Bucket 40 is from 229.376 to 262.144 us, bucket 60 from 7 340 to 8 389 us.
  assert.equal(quantile(0.5, [40, 100], 1_000), 246);
  assert.equal(quantile(0.99, [40, 100], 1_000), 262);
  assert.equal(quantile(0.99, [40, 99, 60, 1], 9_000), 262);
  assert.equal(quantile(1, [40, 99, 60, 1], 9_000), 8_389);
  // Nothing took longer than the longest, which a bucket's end may be beyond.
  assert.equal(quantile(1, [40, 3], 230), 230);
  assert.equal(quantile(0.99, [89, 1], 123_456), 123_456);
  assert.equal(quantile(0.5, [], 12), 12);
});

test("the address says which robot is shown, and nobody else takes its place", () => {
  const link = { robots: new Map([["r1", new Robot("r1")], ["r2", new Robot("r2")]]) };
  assert.equal(named(), null);
  assert.equal(shown(link).name, "r1");
  location.search = "?r2";
  assert.equal(shown(link).name, "r2");
  location.search = "?r%C3%A5";
  assert.equal(named(), "rå");
  assert.equal(shown(link), null);
  globalThis.history = { replaceState: (_state, _title, address) => (location.search = address) };
  choose("rå");
  assert.equal(location.search, "?r%C3%A5");
  location.search = "";
});

test("the link gives orders, settles each answer once, and keeps what was refused", async () => {
  // What is said once a second would keep the test alive.
  globalThis.setInterval = () => 0;
  const sent = [];
  globalThis.localStorage = { getItem: () => null };
  location.href = "http://127.0.0.1/?r1";
  globalThis.WebSocket = class {
    static OPEN = 1;
    readyState = 1;
    bufferedAmount = 0;
    send(line) {
      sent.push(line);
    }
  };
  const { Link } = await import("../page/station/link.js");
  const link = new Link();
  assert.deepEqual(await link.ask("stop", "r1"), { refused: "lost", unsent: true });
  link.socket.onopen();
  link.socket.onmessage({ data: "you panel-3 driver\nabout r1 connected=1 speaks=1 driver=- age_ms=0\nfrom r1 state mode=manual\n" });
  assert.deepEqual([link.me, link.mayDrive, link.robots.get("r1").state.mode], ["panel-3", true, "manual"]);
  const [stop, take, order] = [link.ask("stop", "r1"), link.ask("take", "r1"), link.ask("warehouse", null, "{}")];
  assert.deepEqual(sent, ["stop r1 2", "take r1 3", "warehouse 4 {}"]);
  for (const line of ["answer 3 refused ask_driver eva", "answer 2 stopped 10", "answer 2 stopped 99", "answer 4 done saved; kept"]) link.hear(line);
  assert.deepEqual(await stop, { stopped: 10 });
  assert.deepEqual(await take, { refused: "ask_driver eva", isUnknown: false });
  assert.deepEqual(await order, { done: true, told: "saved; kept" });
  // One that is refused as often as it is given is kept once.
  link.noted("r1", { refused: "ask_driver eva" });
  assert.deepEqual(link.robots.get("r1").events.map(({ kind, words }) => [kind, ...words]), [["refused", "ask_driver eva"]]);
});
