// What a commissioning tells becomes sentences of its own table, in both languages, and a description to be saved.

import assert from "node:assert/strict";
import { test } from "node:test";
import { field, found, saved, steps, told, values } from "../page/commission/said.js";
import { report } from "../page/station/report.js";
import { Robot } from "../page/station/robot.js";
import { speak } from "../page/words/words.js";

test("a code with values is a sentence, also within another one, in the reader's language", async () => {
  await speak("en");
  assert.equal(told("live_boards board_up%207 board_gone"), "sensor board: build 7, steering board: not connected");
  assert.match(told("ended line_mixed 1, 2"), /stands: over bare floor .*left: 1, 2$/);
  // A reason of the table of orders.
  assert.match(told("ended drive_over"), /^the step begins anew, and the robot stands: (?!drive_over)/);
  assert.equal(told("ended_failed no such file"), "no such file");
  assert.match(field("ended_kept%20/var/lib/a%2520b%3D1/robot.toml"), /^\/var\/lib\/a%20b=1\/robot\.toml has it/);
  assert.equal(field(undefined), null);
  await speak("sv");
  assert.match(told("live_boards board_up%207 board_gone"), /^sensorkort: version 7, styrkort: inte anslutet$/);
  await speak("en");
  assert.deepEqual(values("live_battery%2011.3%2011.4"), ["11.3", "11.4"]);
});

test("the steps are those of the table, in its order", () => {
  assert.deepEqual([steps()[0], steps()[1], steps().at(-1)], ["boards", "line", "finish"]);
});

test("the lines of a commissioning replace what was told before", () => {
  const robot = new Robot("r1");
  /** @param {string} line */
  const tells = (line) => report(robot, line.split(" ")[0], line.split(" ").slice(1), 0, 0);
  tells("commission asked=3 step=line question=ask_line_floor takes=yes moves=0");
  tells("found 2 line found_polarity_low wheels found_wheels%20not%20not%20are");
  tells("kept 1 2 [wheels]");
  tells("kept 2 2   swapped = true  # as it is");
  assert.equal(robot.commission.question, "ask_line_floor");
  assert.deepEqual(found(robot.found, "line"), ["the line sensors read low over dark tape"]);
  assert.deepEqual(found(robot.found, "turn"), []);
  assert.equal(saved(robot.kept), "[wheels]\n  swapped = true  # as it is\n");
  tells("kept 1 1 [line]");
  tells("commission");
  tells("found 0");
  assert.deepEqual([saved(robot.kept), robot.commission, found(robot.found, "line")], ["[line]\n", {}, []]);
});
