// What is changed in the warehouse before it is saved, and how others write a warehouse.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Edits, delivered, moved, named, placed, removed, resized, wrongFloor, wrongGoods } from "../page/setup/edits.js";
import { readFile, readGoods, readMap, wrongDrawing } from "../page/setup/written.js";
import { LIMITS } from "../page/setup/limits.js";

const HALL = { size: [2, 2], side_length_cm: 50, delivery: [2, 0], product: [{ id: 7, square: [1, 1], side: "right" }] };
/** Edits of the hall that the station keeps. */
function edits() {
  const made = new Edits();
  made.kept(HALL);
  return made;
}

test("each change has its name, and can be undone and done again", () => {
  const made = edits();
  assert.equal(made.undoes, null);
  const changes = [
    [(now) => resized(now, [3, 2]), ["change_size", 3, 2]],
    [(now) => placed(now, [0, 1], "up"), ["change_placed", 8]],
    [(now) => moved(now, 8, [2, 0], "left"), ["change_moved", 8]],
    [(now) => named(now, 8, " belts "), ["change_named", 8]],
    [(now) => delivered(now, [0, 2]), ["change_delivery", "0, 2"]],
    [(now) => removed(now, 7), ["change_removed", 7]],
    [(now) => removed(resized(now, [2, 2]), 8), ["change_all"]],
  ];
  for (const [change, name] of changes) {
    assert.equal(made.change(change(made.now)), true);
    assert.deepEqual(made.undoes, name);
  }
  assert.equal(made.unsaved, changes.length);
  while (made.undoes) made.undo();
  assert.deepEqual([made.now, made.unsaved], [HALL, 0]);
  while (made.redoes) made.redo();
  assert.deepEqual(made.now, { size: [2, 2], side_length_cm: 50, delivery: [0, 2], product: [] });
  assert.equal(made.change({ ...made.now, product: undefined }), false, "it is no other one");
});

test("changes are counted from what is saved, also back and on another way", () => {
  const made = edits();
  for (const x of [3, 4, 5]) made.change(resized(made.now, [x, 2]));
  made.saved(made.now);
  assert.equal(made.unsaved, 0);
  made.undo();
  made.undo();
  assert.equal(made.unsaved, 2);
  made.change(resized(made.now, [9, 2]));
  assert.equal(made.unsaved, 3);
  assert.equal(made.redoes, null);
  // Somebody goes on while it is saved.
  const sent = made.now;
  made.change(resized(made.now, [8, 2]));
  made.saved(sent);
  assert.equal(made.unsaved, 1);
  made.discard();
  assert.deepEqual([made.now.size, made.unsaved], [[9, 2], 0]);
});

test("what somebody else has saved replaces nothing that is not saved here", () => {
  const made = edits();
  const other = resized(HALL, [4, 4]);
  assert.equal(made.kept(other), false);
  assert.deepEqual([made.now, made.unsaved], [other, 0]);
  made.change(resized(made.now, [5, 5]));
  assert.equal(made.kept(HALL), true);
  assert.deepEqual([made.now.size, made.unsaved], [[5, 5], 1]);
  made.discard();
  assert.deepEqual([made.now, made.unsaved], [HALL, 0]);
  made.undo();
  assert.deepEqual(made.now.size, [5, 5]);
});

test("a floor keeps to the limits, and its delivery to its corner", () => {
  assert.deepEqual(resized(HALL, [0, LIMITS.squares + 1]), { ...HALL, size: [1, LIMITS.squares], delivery: [1, 0] });
  assert.equal(wrongFloor(HALL), null);
  assert.equal(wrongFloor({ ...HALL, side_length_cm: LIMITS.leastSideCm - 1 })[0], "side_limits");
  const product = [{ id: 1, name: "a", square: [0, 0], side: "up" }, { id: 1, square: [0, 1], side: "up" }, { id: 2, name: "a", square: [1, 0], side: "up" }, { id: 3, square: [2, 0], side: "up" }];
  assert.deepEqual(wrongGoods({ ...HALL, product }), [null, ["duplicate", 1], ["same_name", "a"], ["outside", 3]]);
});

test("a warehouse is read as files and strings have it, and what is none is refused", () => {
  assert.deepEqual(readFile('{ "size": [3, 2], "side_length_cm": 40, "exit": { "curve": "left" } }'), { size: [3, 2], side_length_cm: 40, exit: { curve: "left" }, delivery: [0, 0], product: [] });
  for (const text of ["", "null", "7", "[]", "{}", '{"size":[0,1],"side_length_cm":40}', '{"size":[2,2],"side_length_cm":40,"product":[{"id":1,"square":[0,0],"side":"north"}]}']) assert.equal(readFile(text), null, text);
  assert.deepEqual(readMap("4, 3,0,3"), { size: [4, 3], delivery: [0, 3] });
  for (const text of ["4,3,0", "4,3,0,3,1", "4,3,0,-3", "4,3,0,x", ",,,"]) assert.equal(readMap(text), null, text);
  assert.deepEqual(readGoods("7,1,0,3;8,2,1,0;"), { product: [{ id: 7, square: [1, 0], side: "down" }, { id: 8, square: [2, 1], side: "left" }] });
  for (const part of ["7,1,0,4", "7,1,0", "7,1,0,3,1", "7,-1,0,3"]) assert.deepEqual(readGoods(`8,2,1,0;${part}`), { wrong: part });
  assert.equal(wrongDrawing(HALL), null);
  assert.deepEqual(wrongDrawing({ ...HALL, delivery: [1, 0] }), ["no_corner", "1, 0"]);
  assert.deepEqual(wrongDrawing({ ...HALL, size: [0, 2], delivery: [0, 0] }), ["no_warehouse"]);
});
