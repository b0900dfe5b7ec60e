// The missions' view, without what it draws: what past orders teach, and which orders move one in the queue.

import assert from "node:assert/strict";
import { test } from "node:test";
import { learn, left, waits } from "../page/missions/legs.js";
import { matches, ups } from "../page/missions/reorder.js";
import { Jobs } from "../page/station/jobs.js";

/** Ten seconds to the goods, twenty to pick them up, thirty to bring them, five to come back; more for each crossing. */
function fetched() {
  const jobs = new Jobs();
  const event = (at, ...words) => jobs.take({ at, kind: "event", words: words.map(String), values: null });
  const thought = (at, values) => jobs.take({ at, kind: "thought", words: [], values });
  const fetch = (from, order, product, crossings) => {
    event(from, "getting_item", 0, 0, order, product);
    for (let node = 1; node <= crossings; node++) event(from + 4_000 * node, "next_node", node, 0, order, product);
    event(from + 6_000 + 4_000 * crossings, "in_position", 0, 0, order, product);
    thought(from + 26_000 + 4_000 * crossings, { kind: "has_goods", product });
    event(from + 48_000 + 8_000 * crossings, "item_delivered", 0, 0, order, product);
    thought(from + 53_000 + 8_000 * crossings, { kind: "is_back", product: "0" });
  };
  fetch(0, 7, "1", 1);
  // The station tells it again on a new connection.
  fetch(0, 7, "1", 1);
  fetch(1_000_000, 8, "2", 3);
  event(2_000_000, "getting_item", 0, 0, 9, "1");
  return jobs;
}

const far = (product) => ({ 1: 1, 2: 3, 5: 2 })[product];

test("what is told a second time is the same order", () => {
  assert.deepEqual(fetched().done.map(({ product }) => product), ["2", "1"]);
});

test("a thought that names no goods is of no order", () => {
  const jobs = new Jobs();
  jobs.take({ at: 0, kind: "thought", words: [], values: { kind: "has_goods" } });
  assert.equal(jobs.now, null);
});

test("the time that is left is learned from what was delivered, and what takes longer than ever has none", () => {
  const jobs = fetched();
  const known = learn(jobs.done, far);
  const leftAfter = (ms) => left(jobs.now, known, 2_000_000 + ms);
  assert.deepEqual([0, 10_000, 60_000].map(leftAfter), [56_000, 46_000, null]);
});

test("unknown goods take as long as others and the way between; without a known way there is no time from there on", () => {
  const known = learn(fetched().done, far);
  const second = 56_000 + 5_000 + 72_000;
  assert.deepEqual(waits(56_000, ["2", "5", "6", "1"], known, true), [second, second + 5_000 + 64_000, null, null]);
  assert.deepEqual(waits(0, ["1"], learn([], far), false), [null]);
});

test("an order is moved with the fewest orders", () => {
  for (const [order, before, wanted] of [["c", "a", ["c", "c"]], ["a", null, ["b", "c", "d"]], ["a", "c", ["b"]], ["b", "b", []], ["b", "c", []], ["x", "a", []]]) {
    assert.deepEqual(ups(["a", "b", "c", "d"], order, before), wanted, `${order} before ${before}`);
  }
});

test("a whole number or name counts before a part of one", () => {
  const goods = [{ id: 1, name: "Cable ties" }, { id: 2, name: "Cable" }, { id: 21 }];
  const found = (text) => matches(goods, text).map(({ id }) => id);
  assert.deepEqual([found("2"), found("cable"), found("TIES"), found("bolts")], [[2], [2], [1], []]);
});
