// A view whose script comes when somebody opens it.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Later } from "../page/parts/later.js";

/** A view, as much as `Later` asks of it, and what is said while it comes. */
function opened(fetches) {
  const view = { hidden: false, inert: false };
  const parts = { said: { textContent: "" }, again: { toggleAttribute() {} } };
  const later = new Later(view, fetches, (made) => made);
  return { view, later, open: () => later.open(parts) };
}
/** Until what was fetched has come. */
const come = () => new Promise((resolve) => {
  setTimeout(resolve);
});

test("what somebody wants of a view is done once, when the view takes the hand", async () => {
  const { view, later, open } = opened(async () => "made");
  const seen = [];
  later.once((made) => seen.push(made, view.inert));
  assert.equal(open(), null);
  await come();
  // The script is there, and the view is still as it was.
  assert.deepEqual([seen, view.inert], [[], true]);
  assert.equal(open(), "made");
  assert.deepEqual(seen, ["made", false]);
  open();
  later.once((made) => seen.push(`${made} again`));
  assert.deepEqual(seen, ["made", false, "made again"]);
});

test("of a view that was left before its script came, it is done when somebody opens it again", async () => {
  const { view, later, open } = opened(async () => "made");
  open();
  view.hidden = true;
  await come();
  assert.equal(open(), null);
  const seen = [];
  later.once(() => seen.push(view.inert));
  assert.deepEqual(seen, []);
  view.hidden = false;
  open();
  assert.deepEqual(seen, [false]);
});
