// The map's parts that draw nothing: the grid, where labels stand, and what a click does.

import assert from "node:assert/strict";
import { test } from "node:test";
import { carries, stacks, turnOf } from "../page/map/goods.js";
import { again, ends, meant, nearest, nextTo, oneName, way } from "../page/map/grid.js";
import { free, meets } from "../page/map/labels.js";
import { offers } from "../page/map/offers.js";
import { blockedFor, nextOf } from "../page/map/ways.js";
import { above } from "../page/missions/arm.js";
import { hatch } from "../page/parts/svg.js";
import { Robot } from "../page/station/robot.js";

const SIDE = 400;
const WAREHOUSE = { size: [3, 2], side_length_cm: 40, delivery: [0, 0], product: [{ id: 7, name: "Nails", square: [1, 0], side: "down" }] };
const PARCEL = { id: "7", x: 600, y: 150, size: 100 };
const scene = (more) => ({ warehouse: WAREHOUSE, side: SIDE, scale: 1, parcels: [PARCEL], isPlacing: false, ...more });

test("a way has the same name from both of its ends", () => {
  assert.deepEqual(way("1 0 up", SIDE).middle, [400, 200]);
  assert.deepEqual(ends("1 0 up"), ["1,0", "1,1"]);
  assert.equal(oneName("1 1 down"), "1 0 up");
  assert.equal(oneName("1 0 up"), "1 0 up");
  assert.equal(oneName("2 1 left"), "1 1 right");
  assert.equal(way("1 0 nowhere", SIDE).to, undefined);
});

test("a point means the goods, the crossing or the way that is there, and off the floor nothing", () => {
  const at = (point, more) => meant(point, scene(more));
  assert.deepEqual(at([620, 110]), { kind: "good", id: "7", at: [600, 150] });
  assert.deepEqual(at([805, 395]), { kind: "crossing", id: "2,1", at: [800, 400] });
  assert.deepEqual(at([600, 405]), { kind: "way", id: "1 1 right", at: [600, 400] });
  assert.deepEqual(at([395, 600]), { kind: "way", id: "1 1 up", at: [400, 600] });
  for (const point of [[200, 200], [-100, 0], [1_300, 0], [0, 900]]) assert.equal(at(point), null, `${point}`);
  assert.equal(at([0, 0], { warehouse: null }), null);
  // From far away a finger is as large as a part of the square.
  assert.equal(at([480, 400]).kind, "way");
  assert.equal(at([480, 400], { scale: 20, parcels: [] }).kind, "crossing");
});

test("while the warehouse is set up a point means goods, a corner, an edge, or the side of its square that is nearest", () => {
  const at = (point) => meant(point, scene({ isPlacing: true }));
  assert.deepEqual(at([620, 110]), { kind: "good", id: "7", at: [600, 150] });
  assert.deepEqual(at([1_195, 810]), { kind: "corner", id: "3,2", at: [1_200, 800] });
  assert.deepEqual([at([1_330, 400]), at([600, 930])].map(({ kind, id }) => [kind, id]), [["edge", "right"], ["edge", "up"]]);
  assert.deepEqual([at([420, 200]), at([600, 390])].map(({ square, side }) => [square, side]), [[[1, 0], "left"], [[1, 0], "up"]]);
  assert.equal(at([1_240, 100]), null);
});

test("keys reach everything, one step at a time", () => {
  let [at, steps] = [nearest([0, 0], scene()), 0];
  assert.equal(at.id, "0,0");
  for (let next = at; next; steps++) {
    at = next;
    next = nextTo(at.at, [1, 0], scene());
    assert.ok(!next || next.at[0] > at.at[0]);
  }
  // Three crossings and three ways to the right of the first one.
  assert.equal(at.id, "3,0");
  assert.ok(steps >= 6);
  assert.equal(nextTo([0, 0], [0, -1], scene()), null);
  assert.equal(nearest([590, 160], scene()).kind, "good");
  assert.equal(nearest([0, 0], scene({ warehouse: null })), null);
});

test("while the warehouse is set up keys reach each thing, also what lies more aside than ahead", () => {
  const set = scene({ isPlacing: true });
  const arrows = [[1, 0], [-1, 0], [0, 1], [0, -1]];
  const [first, reached] = [nearest([0, 0], set), new Map()];
  const reach = (target) => {
    if (!target || reached.has(`${target.kind} ${target.id}`)) return;
    reached.set(`${target.kind} ${target.id}`, target);
    for (const arrow of arrows) reach(nextTo(target.at, arrow, set));
  };
  reach(first);
  const kinds = [...reached.values()].map(({ kind }) => kind);
  const count = (kind) => kinds.filter((one) => one === kind).length;
  assert.deepEqual(["good", "corner", "edge", "square"].map(count), [1, 4, 2, 6 * 4]);
});

test("what the keys mean stays the same thing when it is elsewhere", () => {
  const good = { kind: "good", id: "7", at: [600, 150] };
  assert.deepEqual(again(good, scene({ isPlacing: true, parcels: [{ ...PARCEL, x: 1_000 }] })).at, [1_000, 150]);
  assert.equal(again(good, scene({ isPlacing: true, parcels: [] })).id, "1 0 down");
});

test("a label stands at its thing, off what it may not cover, and in the view while there is room", () => {
  const view = [-1_000, -1_000, 1_000, 1_000];
  const place = (more) => free([0, 0], [10, 10], [30, 10], { hard: [], soft: [], view, px: 1, ...more });
  const box = ([x, y]) => [x - 30, y - 10, x + 30, y + 10];
  assert.deepEqual(place(), [0, -24]);
  assert.deepEqual(place({ hard: [[-30, -40, 30, -11]] }), [0, 24]);
  // Goods above are left free, as below is no further.
  assert.deepEqual(place({ soft: [[-30, -40, 30, -11]] }), [0, 24]);
  // What may be covered is, where the alternative is out of view.
  assert.deepEqual(place({ soft: [[-30, -40, 30, -11]], view: [-40, -40, 40, 12] }), [0, -24]);
  const ring = [[-50, -60, 50, -12], [-50, 12, 50, 60], [12, -12, 50, 12], [-50, -12, -12, 12]];
  assert.ok(ring.every((hard) => !meets(box(place({ hard: ring })), hard)));
  // Where all is full it stands somewhere all the same.
  assert.equal(place({ hard: [view] }).length, 2);
});

test("boxes that only touch do not meet", () => {
  assert.equal(meets([0, 0, 10, 10], [10, 0, 20, 10]), false);
  assert.equal(meets([0, 0, 10, 10], [9, 9, 20, 20]), true);
});

test("lines across a box stay in it", () => {
  const numbers = hatch(-10, -20, 30, 40, 7).match(/-?[\d.]+/g).map(Number);
  assert.ok(numbers.length > 20);
  numbers.forEach((number, at) => assert.ok(at % 2 === 0 ? number >= -10 && number <= 30 : number >= -20 && number <= 40, `${number}`));
});

const NOW = 1_000;
const robot = (state, more) => Object.assign(new Robot("r1"), { connected: true, heard: NOW, stated: NOW, state, ...more });

test("goods are in the claw from the pick-up until they are put down", () => {
  const gone = new Set(["7"]);
  assert.equal(carries(robot({ product: "7", phase: "driving" }, { gone })), "7");
  assert.equal(carries(robot({ product: "7", phase: "returning" }, { gone })), null);
  assert.equal(carries(robot({ product: "7", phase: "driving" })), null);
  assert.equal(carries(null), null);
});

test("goods stand apart where each number can be read, and else as one; what stands at one side always does", () => {
  const goods = [[1, "up"], [2, "down"], [3, "up"]].map(([id, side]) => ({ id, side, square: [4, 5] }));
  const all = [...goods, { id: 4, side: "up", square: [0, 5] }];
  const ids = (isLegible) => stacks(all, isLegible).map((stack) => stack.map(({ id }) => id));
  assert.deepEqual(ids(() => true), [[1, 3], [2], [4]]);
  assert.deepEqual(ids(() => false), [[1, 2, 3], [4]]);
  // One number that cannot be read is enough.
  assert.deepEqual(ids(({ id }) => id !== 2), [[1, 2, 3], [4]]);
});

test("the order under way is 0, and those that wait are counted without it", () => {
  const busy = robot({ product: "7", order: "1" }, { queue: [{ order: "1", product: "7" }, { order: "2", product: "9" }, { order: "3", product: "8" }] });
  assert.deepEqual(["7", "9", "8", "5"].map((product) => turnOf(busy, product)), [0, 1, 2, -1]);
});

test("the next crossing is known while the robot's place is, and an age counts by the robot's clock", () => {
  assert.deepEqual(nextOf(robot({ next: "2,1", x_mm: "0" }), SIDE), [800, 400]);
  assert.equal(nextOf(robot({ next: "2,1" }), SIDE), null);
  assert.equal(blockedFor(robot({ time_ms: "90500" }, { blocked: new Map([["1 0 up", 66]]) }), "1 0 up"), 24);
  assert.equal(blockedFor(robot({ time_ms: "1000" }, { blocked: new Map([["1 0 up", 66]]) }), "1 0 up"), 0);
});

test("an arm that is not heard is not drawn, and one that looks ahead points ahead", () => {
  assert.equal(above(""), null);
  const { degrees, reach, gap } = above("512,512,512,512,512,512,512,512");
  assert.ok(Math.abs(degrees) < 0.1);
  assert.ok(reach > 0);
  assert.ok(Math.abs(gap - 80) < 0.1, `${gap}`);
  assert.ok(above("412,-,-,-,-,-,-,-").degrees > 0);
});

/** What is offered by these targets, and what was done. */
function offered(one, more = {}) {
  const done = [];
  const act = (name) => (...what) => done.push([name, ...what]);
  const page = {
    link: { warehouse: WAREHOUSE, mayDrive: true }, robot: () => one, now: () => NOW, isPast: () => false, isPlaceWanted: () => false,
    fetch: act("fetch"), stands: act("stands"), obstacle: act("obstacle"), isSetUp: () => false, setUp: () => assert.fail("nothing is set up"), ...more,
  };
  return { offer: offers(page), done };
}
const GOOD = { kind: "good", id: "7", at: [0, 0] };

test("a click fetches goods once, and nothing where it would be wrong", () => {
  const { offer, done } = offered(robot({}));
  assert.equal(offer(GOOD).what, "7 Nails, square 1,0");
  offer(GOOD).act();
  assert.deepEqual(done, [["fetch", "7", undefined]]);
  const refused = [
    [null], [robot({ product: "7" })], [robot({ product: "7", phase: "driving" }, { gone: new Set(["7"]) })],
    [robot({}, { queue: [{ order: "1", product: "7" }] })], [robot({}, { heard: -Infinity })],
    [robot({}), { link: { warehouse: WAREHOUSE, mayDrive: false } }],
  ];
  for (const [one, more] of refused) {
    const { act, does, why } = offered(one, more).offer(GOOD);
    assert.deepEqual([act, does], [undefined, undefined]);
    assert.ok(why);
  }
});

test("goods that stand as one are named, and one of them is chosen", () => {
  const product = [...WAREHOUSE.product, { id: 9, square: [1, 0], side: "up" }];
  const target = meant([600, 150], scene({ parcels: [{ ...PARCEL, id: "7 9" }] }));
  const chosen = [];
  const { offer } = offered(robot({}), { link: { warehouse: { ...WAREHOUSE, product }, mayDrive: true }, choose: (...what) => chosen.push(what) });
  assert.equal(offer(target).what, "square 1,0: 7 Nails, 9");
  offer(target).act();
  assert.deepEqual(chosen, [[["7", "9"], [600, 150]]]);
});

test("goods that were delivered are only asked about", () => {
  const { what, does } = offered(robot({}, { gone: new Set(["7"]), jobs: { done: [{ product: "7", at: 90_000, detours: [], legs: [], order: "1" }] } })).offer(GOOD);
  assert.match(what, /delivered at/);
  assert.equal(does, "say that it is back, and fetch it");
});

test("a crossing is offered only while somebody is to say where the robot stands", () => {
  const crossing = { kind: "crossing", id: "2,1", at: [0, 0] };
  assert.equal(offered(robot({})).offer(crossing).act, undefined);
  const { offer, done } = offered(robot({}), { isPast: () => false, isPlaceWanted: () => true });
  offer(crossing).act();
  assert.deepEqual(done, [["stands", ["2", "1"]]]);
});

test("an obstacle is put only in a simulated world", () => {
  const edge = { kind: "way", id: "1 0 up", at: [0, 0] };
  assert.equal(offered(robot({})).offer(edge).why, "put obstacles on a real floor by hand");
  const truth = { x: 0, y: 0, heading: 0, carrying: undefined };
  assert.equal(offered(robot({}, { truth })).offer(edge).does, "put an obstacle here");
  assert.equal(offered(robot({}, { truth, placed: ["1 1 down"] })).offer(edge).does, "take the obstacle away");
  assert.match(offered(robot({ time_ms: "9000" }, { truth, blocked: new Map([["1 1 down", 4]]) })).offer(edge).what, /found blocked 5 s ago/);
});

test("while the warehouse is set up nothing is ordered", () => {
  const { offer, done } = offered(robot({}), { isSetUp: () => true, setUp: ({ id }) => ({ what: `set up ${id}` }) });
  assert.deepEqual(offer(GOOD), { what: "set up 7" });
  assert.match(offer(null).why, /^Click on a side/);
  assert.deepEqual(done, []);
});

test("where there is nothing, that is said", () => {
  assert.ok(offered(robot({})).offer(null).why);
});
