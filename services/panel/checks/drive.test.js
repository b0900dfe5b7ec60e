// Which gamepads are believed: what they say drives a robot.

import assert from "node:assert/strict";
import { test } from "node:test";

let now = 0;
let pads = [];
const heard = {};
globalThis.addEventListener = (name, act) => (heard[name] = act);
Object.defineProperty(globalThis, "navigator", { value: { getGamepads: () => pads }, configurable: true });
const { Pads } = await import("../page/drive/pads.js");

const [FORWARD, BACK, LEFT] = [2, 4, 6];
/** An entry of the browser's list with its stick at these places, and the buttons of the cross that are pressed. */
const pad = (axes = [0, 0], { pressed = [], id = "pad", mapping = "standard", timestamp = now, connected = true } = {}) => ({
  id, mapping, connected, timestamp, axes, buttons: Array.from({ length: 16 }, (_, button) => ({ pressed: pressed.includes(button) })),
});
/** Some time later these are there: what they say. */
function later(all, ms = 600, entry = reader) {
  now += ms;
  pads = all();
  return entry.read();
}
let reader;
const anew = () => {
  reader = new Pads(() => now);
};

test("a pad that was seen at rest says codes of the wheels by its stick and by its cross", () => {
  anew();
  assert.equal(later(() => [pad()]), null);
  assert.equal(later(() => [pad()]), null);
  assert.equal(later(() => [pad([0, -1])], 50), FORWARD);
  assert.equal(later(() => [pad([0, 1])], 50), BACK);
  assert.equal(later(() => [pad([-0.4, 0.4])], 50), null);
  assert.equal(later(() => [pad([0, 0], { pressed: [14] })], 50), LEFT);
});

test("one that comes with its stick at an end drives nothing before it has rested", () => {
  anew();
  for (let look = 0; look < 5; look++) assert.equal(later(() => [pad([0, -1])]), null);
  assert.equal(later(() => [pad()]), null);
  assert.equal(later(() => [pad([0, -1])], 50), FORWARD);
});

test("one that is unplugged says nothing, and is new when it comes back", () => {
  anew();
  later(() => [pad()]);
  later(() => [pad()]);
  assert.equal(later(() => [pad([0, -1])], 50), FORWARD);
  assert.equal(later(() => [null], 50), null);
  assert.equal(later(() => [pad([0, -1])]), null);
  anew();
  later(() => [pad()]);
  later(() => [pad()]);
  assert.equal(later(() => [pad([0, -1], { connected: false })], 50), null);
  heard.gamepaddisconnected({ gamepad: { index: 0 } });
  assert.equal(later(() => [pad([0, -1])]), null);
});

test("an entry that a dead radio left behind is not believed", () => {
  anew();
  later(() => [pad(), pad([0, 0], { id: "other" })]);
  later(() => [pad(), pad([0, 0], { id: "other" })]);
  const dead = pad([0, -1]);
  assert.equal(later(() => [dead, pad([0, 0], { id: "other" })], 50), FORWARD);
  assert.equal(later(() => [dead, pad([0, 0], { id: "other" })], 400), null);
  // Its second entry counts, the first one does not, whatever it says.
  anew();
  later(() => [pad()]);
  later(() => [pad()]);
  later(() => [pad(), pad()]);
  later(() => [pad(), pad()]);
  assert.equal(later(() => [pad([0, -1]), pad()], 50), null);
  assert.equal(later(() => [pad(), pad([0, -1])], 50), FORWARD);
});

test("who speaks goes on speaking, and another one does not talk into it", () => {
  anew();
  const both = (one, other) => () => [pad(one), pad(other, { id: "other" })];
  later(both([0, 0], [0, 0]));
  later(both([0, 0], [0, 0]));
  assert.equal(later(both([0, 0], [0, -1]), 50), FORWARD);
  assert.equal(later(both([0, 1], [0, -1]), 50), FORWARD);
  // Its end is one, before the other one counts.
  assert.equal(later(both([0, 1], [0, 0]), 50), null);
  assert.equal(later(both([0, 1], [0, 0]), 50), BACK);
});

test("a list without entries, and one of another kind, say nothing", () => {
  anew();
  assert.equal(later(() => []), null);
  later(() => [pad([0, 0], { mapping: "" })]);
  later(() => [pad([0, 0], { mapping: "" })]);
  assert.equal(later(() => [pad([0, -1], { mapping: "" })], 50), null);
});

test("a shoulder button turns the speed once a press, on a pad that is believed", () => {
  anew();
  const turned = (pressed, ms = 50) => {
    later(() => [pad([0, 0], { pressed })], ms);
    return reader.turned;
  };
  assert.equal(turned([5], 600), 0);
  assert.equal(turned([5], 600), 0);
  assert.equal(turned([]), 0);
  assert.equal(turned([5]), 1);
  assert.equal(turned([5]), 0);
  assert.equal(turned([4]), -1);
  assert.equal(turned([4, 5]), 0);
  // One that came with its stick at an end is not believed.
  anew();
  for (const pressed of [[], [], [5]]) later(() => [pad([0, -1], { pressed })]);
  assert.equal(reader.turned, 0);
});

test("a speed is the middle one at first, is kept, and goes no further than its ends", async () => {
  const kept = new Map();
  globalThis.localStorage = { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value) };
  const { Speed } = await import("../page/drive/speed.js");
  let changes = 0;
  const made = () => {
    const steps = ["slow", "middle", "full"].map((step) => [step, { addEventListener() {}, setAttribute(name, value) { this[name] = value; } }]);
    return new Speed(new Map(steps), () => changes++);
  };
  const speed = made();
  assert.equal(speed.said, " middle");
  for (const [way, said] of [[-1, " slow"], [-1, " slow"], [0, " slow"], [1, " middle"], [1, ""], [1, ""]]) {
    speed.turn(way);
    assert.equal(speed.said, said);
  }
  assert.equal(changes, 3);
  const pressed = [...speed.buttons.values()].map((button) => button["aria-pressed"]);
  assert.deepEqual(pressed, ["false", "false", "true"]);
  assert.equal(made().said, "");
  kept.set("speed", "warp");
  assert.equal(made().said, " middle");
});
