// The view of signals, without what it draws: its figures by time, the time that is shown, the histogram.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Columns, GAP_MS, KEPT_MS, rowsOf } from "../page/signals/figures.js";
import { Span } from "../page/signals/span.js";
import { Frames } from "../page/station/quantile.js";

const NOTHING = { line_error: null, left_duty: null, right_duty: null, distance_cm: null, battery: null, path_p50: null, path_p99: null, lost: null };

/** Columns of rows at these times with these figures. */
function columns(...rows) {
  const all = new Columns();
  for (const [at, figures] of rows) all.push({ ...NOTHING, at, ...figures });
  return all;
}

test("a row of the station's table has its figures by their heads, and texts with commas count as one cell", () => {
  const read = rowsOf("unix_time_s,node,battery_V,left_duty_of_255,servos_of_1023,lost_packets");
  assert.deepEqual(read('1795858440.035,"0,1",11.8,,"1,2,3",5'), { ...NOTHING, at: 1_795_858_440_035, battery: 11.8, lost: 5 });
});

test("figures are in the units that are shown", () => {
  const { of } = columns([0, { line_error: -3, left_duty: 255, distance_cm: 40 }]);
  assert.deepEqual([of.line_error, of.left_duty, of.distance_cm, of.battery], [[-1.5], [100], [40], [null]]);
});

test("where nothing was heard a gap stays, and what came out of order counts once", () => {
  const { at, of } = columns([0, { battery: 12 }], [50, { battery: 11 }], [50, { battery: 9 }], [50 + GAP_MS + 1, { battery: 10 }]);
  assert.deepEqual(at, [0, 50, 51, 51 + GAP_MS]);
  assert.deepEqual(of.battery, [12, 11, null, 10]);
});

test("losses are those of the last second, and a count that begins anew is none", () => {
  const { of } = columns([0, { lost: 7 }], [500, { lost: 9 }], [1_000, { lost: 9 }], [1_600, { lost: 10 }], [2_000, { lost: 0 }]);
  assert.deepEqual(of.lost_in_1s, [0, 2, 2, 1, 0]);
});

test("losses are counted by the minute, the last one last", () => {
  const minutes = columns([0, { lost: 0 }], [1_000, { lost: 2 }], [2_000, { lost: 3 }], [61_000, { lost: 3 }], [61_500, { lost: 8 }]).lostByMinute(62_000);
  assert.equal(minutes.length, KEPT_MS / 60_000);
  assert.deepEqual(minutes.slice(-2), [3, 5]);
});

test("what is older than ten minutes goes, and what stays is counted as before", () => {
  const all = new Columns();
  for (let at = 0; at <= KEPT_MS + 60_000; at += 1_000) {
    all.push({ ...NOTHING, at, lost: at / 1_000 });
    all.cut();
  }
  assert.ok(all.at[0] >= 30_000 && all.at[0] <= 60_000, `${all.at[0]}`);
  assert.equal(all.of.lost.length, all.at.length);
  assert.equal(all.of.lost_in_1s.at(-1), 1);
});

test("the last while moves on until it is held, and goes on from now", () => {
  const span = new Span();
  assert.deepEqual(span.range(100_000), { from: 40_000, to: 100_000 });
  span.pause(100_000);
  assert.deepEqual(span.range(112_000), { from: 40_000, to: 100_000 });
  span.choose(30_000);
  assert.deepEqual(span.range(112_000), { from: 70_000, to: 100_000 });
  span.pause(112_000);
  assert.deepEqual(span.range(112_000), { from: 82_000, to: 112_000 });
});

test("a part is shown until one goes back, and never what is to come", () => {
  const span = new Span();
  span.zoom(100_000, { from: 50_000, to: 60_000 });
  span.zoom(110_000, { from: 52_000, to: 54_000 });
  span.zoom(110_000, { from: 53_000, to: 53_001 });
  assert.deepEqual(span.range(110_000), { from: 52_000, to: 54_000 });
  span.back();
  span.back();
  span.back();
  assert.deepEqual(span.range(110_000), { from: 40_000, to: 100_000 });
  span.grow(110_000, 0.5, 100_000);
  assert.deepEqual(span.range(110_000), { from: 70_000, to: 100_000 });
  span.grow(110_000, 100, null);
  assert.deepEqual(span.range(110_000), { from: 110_000 - KEPT_MS, to: 110_000 });
});

test("the histogram has all frames that were told, once", () => {
  const frames = new Frames();
  frames.add(700, [0, 3, 40, 99, 45, 1]);
  frames.add(700, [0, 3, 40, 99, 45, 1]);
  frames.add(0, []);
  frames.add(2_000_000, [40, 1, 89, 2]);
  const { from, counts } = frames.steps();
  assert.equal(counts.reduce((sum, count) => sum + count), 106);
  assert.equal(from.length, counts.length);
  assert.equal(from.at(-1), 2_000_000);
  assert.ok(from.every((at, index) => index === 0 || at > from[index - 1]));
  assert.ok(frames.quantile(0.5) < 700);
});

test("a percentile of all frames has ten of them beyond it", () => {
  const frames = new Frames();
  frames.add(900, [40, 9_998, 45, 1]);
  assert.equal(frames.quantile(0.999), null);
  assert.ok(frames.quantile(0.99) < 300);
  frames.add(1_000, [45, 1]);
  assert.ok(frames.quantile(0.999) < 300);
  assert.equal(frames.longest, 1_000);
});
