// How each state of a robot looks, and what is said of it.

import assert from "node:assert/strict";
import { test } from "node:test";
import { SHAPES, age, causeOf, face } from "../page/bar/face.js";
import { Robot } from "../page/station/robot.js";

const NOW = 100_000;
const LINK = { open: true, me: "panel-1", tries: 1, closed: null, now: () => Date.now() };

/** A robot that is heard now and has this state. */
const robot = (state = {}, more = {}) => Object.assign(new Robot("r1"), { connected: true, speaks: true, heard: NOW, stated: NOW, state: { x_mm: "0", phase: "waiting_for_order", mode: "autonomous", ...state } }, more);

const seen = new Set();
const look = (one, link = LINK) => {
  const shown = face(link, one, NOW);
  seen.add(shown.look);
  return shown;
};

test("a page that is not connected yet says so", () => {
  const shown = look(null, { open: false, me: null, tries: 0, closed: null, now: () => Date.now() });
  assert.equal(shown.look, "none");
  assert.ok(shown.said);
});

test("who has opened the page without a robot is told that, or that the one that is asked for is not here", () => {
  assert.match(look(null).said, /No robot has connected/);
  location.search = "?r7";
  assert.equal(look(null).said, "r7 is not here");
  location.search = "";
});

test("one that speaks only the document's language has no picture", () => {
  assert.equal(look(robot({}, { speaks: false })).look, "none");
});

test("what is old is not said as if it were so", () => {
  const state = { phase: "driving", next: "2,1", product: "7" };
  for (const shown of [
    look(robot(state, { heard: NOW - 12_000 })),
    look(robot(state, { stated: NOW - 12_000 })),
    look(robot({ ...state, stopped: "1", failure: "line_lost" }, { heard: NOW - 12_000, connected: false })),
  ]) {
    assert.equal(shown.look, "unheard");
    assert.ok(shown.since && shown.since.includes("12 s"), shown.since);
    assert.ok(shown.chip.includes("12 s"), shown.chip);
  }
  assert.equal(look(robot(state, { connected: false, heard: NOW - 12_000 })).isDeaf, true);
});

test("without the station it says why, and nothing of the robot is true", () => {
  assert.equal(look(robot(), { ...LINK, open: false }).look, "unheard");
  assert.equal(look(null, { ...LINK, open: false }).look, "unheard");
  const why = look(robot(), { ...LINK, open: false, closed: "no_token" }).said;
  assert.ok(why && why !== "no_token");
});

test("a stop is above all else, with who, since when, and the proof that the wheels stand", () => {
  const state = { stopped: "1", stop_cause: "ordered", stop_by: "comm", left_duty: "0", right_duty: "0", stood_ms: "10", sensor_up: "0", product: "7" };
  const at = Date.now() - 3_500;
  const asked = { at: at + 100, kind: "asked", words: ["eva", "stop"], values: null };
  const shown = look(robot(state, { stoppedSince: at, events: [asked] }));
  assert.equal(shown.look, "stopped");
  assert.equal(shown.said, "STOPPED");
  assert.match(shown.since, /3 s/);
  assert.match(shown.by, /eva/);
  assert.match(shown.proof, /10 ms/);
  assert.match(shown.more, /7/);
  // Who asked for another stop has not asked for this one.
  assert.doesNotMatch(look(robot(state, { stoppedSince: at, events: [{ ...asked, at: at - 60_000 }] })).by, /eva/);
  assert.notEqual(look(robot({ ...state, left_duty: "9" })).proof, shown.proof);
  assert.equal(look(robot({ ...state, left_duty: undefined })).proof, null);
  const battery = robot({ stopped: "1", stop_cause: "watchdog" });
  assert.equal(look(battery).by, causeOf(battery));
});

test("a board that is not heard is told before what it would have told", () => {
  for (const state of [{ sensor_up: "0" }, { steering_up: "0" }, { hold: "blind" }, { hold: "unheard" }]) {
    const shown = look(robot({ ...state, x_mm: undefined, failure: "line_lost" }));
    assert.equal(shown.look, "board", JSON.stringify(state));
    assert.match(shown.chip, /board is not heard/);
  }
  // What holds it says it already.
  assert.equal(look(robot({ sensor_up: "0", hold: "blind" })).more.includes("the sensor board"), false);
});

test("one that does not know where it is looks lost, but for one that waits for its map", () => {
  assert.equal(look(robot({ x_mm: undefined })).look, "lost");
  assert.equal(look(robot({ x_mm: undefined })).chip, "place unknown");
  assert.notEqual(look(robot({ x_mm: undefined, phase: "waiting_for_map" })).look, "lost");
});

test("one that needs a person says what would help", () => {
  const shown = look(robot({ failure: "line_lost", remedy: "reset", node: "2,1" }));
  assert.equal(shown.look, "needs");
  assert.equal(shown.remedy, "reset");
  assert.ok(shown.more.length > 10);
  assert.equal(look(robot({ phase: "stuck" })).look, "needs");
  // To resume and to change the mode are buttons of their own.
  for (const remedy of ["none", "resume", "mode"]) assert.equal(look(robot({ remedy })).look, "waits", remedy);
});

test("by hand, waiting and driving are told apart", () => {
  assert.equal(look(robot({ mode: "manual" })).look, "hand");
  // What logic would do it does not do.
  assert.equal(look(robot({ mode: "manual", phase: "driving", next: "2,1", product: "7" })).said, "driven by hand, was to fetch 7");
  assert.equal(look(robot()).look, "waits");
  assert.equal(look(robot({ phase: "picking", failure: "not_felt" })).look, "waits");
  const shown = look(robot({ phase: "driving", next: "2,1", product: "7" }));
  assert.equal(shown.look, "drives");
  assert.match(shown.said, /\(2, 1\).*7/);
});

test("an age does not dance", () => {
  assert.deepEqual([-5, 0, 999, 12_900, 60_000, 7_300_000].map(age), ["0 s", "0 s", "0 s", "12 s", "1 min", "2 h"]);
});

test("each look was seen", () => {
  assert.deepEqual([...seen].sort(), Object.keys(SHAPES).sort());
});
