// The grid of a warehouse: its sides, and the things on it that a pointer or a key can mean.

/** @import { Side, Warehouse } from "../station/robot.js" */
/** @import { Parcel } from "./goods.js" */

import { BEYOND } from "./floor.js";

/** @typedef {[number, number]} Point */
/** @typedef {{ kind: "square", id: string, at: Point, square: Point, side: Side }} SquareSide */
/**
 * What a pointer or a key means; `at` is in mm. An edge of the floor is its handle.
 *
 * @typedef {{ kind: "good" | "stack" | "crossing" | "way" | "corner" | "edge", id: string, at: Point } | SquareSide} Target
 */
/**
 * What there is to mean.
 *
 * @typedef {object} Scene
 * @property {Warehouse | null} warehouse
 * @property {number} side of a square, in mm
 * @property {number} scale mm of one pixel
 * @property {Pick<Parcel, "id" | "x" | "y" | "size">[]} parcels
 * @property {boolean} isPlacing whether the warehouse is being set up
 */

/**
 * The steps to the four sides of a square, with y upwards.
 *
 * @type {Record<Side, Point>}
 */
export const SIDES = { left: [-1, 0], up: [0, 1], right: [1, 0], down: [0, -1] };

/** How near a point means a crossing or a way: as a part of a square's side, and in pixels at least. */
const NEAR = 0.15;
const NEAR_PX = 8;
/** How near to it a handle or a corner of the floor is meant, in pixels: as a finger is. */
const GRIP_PX = 22;
/** How far from its middle the side of a square is meant by keys, as a part of the square's side. */
const ASIDE = 0.3;
/** @type {Side[]} */
const ALL_SIDES = ["left", "up", "right", "down"];

/**
 * Column, row and side of a way from its words, `x y side`, and its middle in mm.
 *
 * @param {string} words
 * @param {number} side of a square, in mm
 * @returns {{ x: number, y: number, to: Side | undefined, dx: number, dy: number, middle: Point }}
 */
export function way(words, side) {
  const [x, y, name] = words.split(" ");
  const to = ALL_SIDES.find((one) => one === name);
  const [dx, dy] = to ? SIDES[to] : [0, 0];
  return { x: Number(x), y: Number(y), to, dx, dy, middle: [(Number(x) + dx / 2) * side, (Number(y) + dy / 2) * side] };
}

/**
 * The two crossings of a way as `x,y`, from its words.
 *
 * @param {string} words
 */
export function ends(words) {
  const { x, y, dx, dy } = way(words, 1);
  return [`${x},${y}`, `${x + dx},${y + dy}`];
}

/**
 * The words of the same way from its end that is further left or lower.
 *
 * @param {string} words
 * @returns {string}
 */
export function oneName(words) {
  const { x, y, to, dx, dy } = way(words, 1);
  if (to === "left") return `${x + dx} ${y} right`;
  return to === "down" ? `${x} ${y + dy} up` : words;
}

/**
 * The side of its square that a point is nearest to.
 *
 * @param {number} x
 * @param {number} y
 */
function nearestSide(x, y) {
  const ways = { left: x, right: 1 - x, down: y, up: 1 - y };
  return ALL_SIDES.reduce((best, side) => (ways[side] < ways[best] ? side : best));
}

/**
 * @param {number} x
 * @param {number} y
 * @param {number} side
 * @returns {Target}
 */
const crossing = (x, y, side) => ({ kind: "crossing", id: `${x},${y}`, at: [x * side, y * side] });
/**
 * @param {string} words
 * @param {number} side
 * @returns {Target}
 */
const wayAt = (words, side) => ({ kind: "way", id: words, at: way(words, side).middle });
/**
 * @param {Pick<Parcel, "id" | "x" | "y">} parcel
 * @returns {Target}
 */
const good = ({ id, x, y }) => ({ kind: id.includes(" ") ? "stack" : "good", id, at: [x, y] });

/**
 * The corners of a floor, and the handles by which it is made larger or smaller.
 *
 * @param {Point} size
 * @param {number} side
 * @returns {Target[]}
 */
function bounds([width, height], side) {
  /** @type {(x: number, y: number) => Target} */
  const corner = (x, y) => ({ kind: "corner", id: `${x},${y}`, at: [x * side, y * side] });
  return [
    corner(0, 0), corner(width, 0), corner(0, height), corner(width, height),
    { kind: "edge", id: "right", at: [width * side + BEYOND, (height / 2) * side] },
    { kind: "edge", id: "up", at: [(width / 2) * side, height * side + BEYOND] },
  ];
}

/**
 * @param {number} x
 * @param {number} y
 * @param {Side} from
 * @param {number} side
 * @returns {SquareSide}
 */
function square(x, y, from, side) {
  const [dx, dy] = SIDES[from];
  return { kind: "square", id: `${x} ${y} ${from}`, square: [x, y], side: from, at: [(x + 0.5 + dx * ASIDE) * side, (y + 0.5 + dy * ASIDE) * side] };
}

/**
 * The side of a square that a point in mm means; null outside.
 *
 * @param {Point} point
 * @param {Pick<Scene, "warehouse" | "side">} scene
 */
export function sideAt([px, py], { warehouse, side }) {
  const [width, height] = warehouse?.size ?? [0, 0];
  const [gx, gy] = [px / side, py / side];
  const [x, y] = [Math.floor(gx), Math.floor(gy)];
  return x < 0 || y < 0 || x >= width || y >= height ? null : square(x, y, nearestSide(gx - x, gy - y), side);
}

/**
 * What a point in mm means: goods, a crossing or a way; while the warehouse is set up, goods, a handle, a corner or the
 * side of a square; or null.
 *
 * @param {Point} point
 * @param {Scene} scene
 * @returns {Target | null}
 */
export function meant([px, py], { warehouse, side, scale, parcels, isPlacing }) {
  if (!warehouse) return null;
  const [width, height] = warehouse.size;
  const [gx, gy] = [px / side, py / side];
  const hit = parcels.find(({ x, y, size }) => Math.max(Math.abs(px - x), Math.abs(py - y)) <= size / 2);
  if (hit) return good(hit);
  if (isPlacing) {
    const grip = bounds(warehouse.size, side).find(({ at: [x, y] }) => Math.hypot(px - x, py - y) < GRIP_PX * scale);
    return grip ?? sideAt([px, py], { warehouse, side });
  }
  const near = Math.min(0.3, Math.max(NEAR, (NEAR_PX * scale) / side));
  const [nx, ny] = [Math.round(gx), Math.round(gy)];
  const [isColumn, isRow] = [Math.abs(gx - nx) < near, Math.abs(gy - ny) < near];
  if (nx < 0 || ny < 0 || nx > width || ny > height) return null;
  if (isColumn && isRow) return crossing(nx, ny, side);
  if (isRow && gx > 0 && gx < width) return wayAt(`${Math.floor(gx)} ${ny} right`, side);
  if (isColumn && gy > 0 && gy < height) return wayAt(`${nx} ${Math.floor(gy)} up`, side);
  return null;
}

/**
 * Everything that keys can reach.
 *
 * @param {Scene} scene
 */
function all({ warehouse, side, parcels, isPlacing }) {
  if (!warehouse) return [];
  const [width, height] = warehouse.size;
  const found = [...parcels.map(good), ...(isPlacing ? bounds(warehouse.size, side) : [])];
  for (let x = 0; x <= width; x++) {
    for (let y = 0; y <= height; y++) {
      if (isPlacing) {
        if (x < width && y < height) for (const from of ALL_SIDES) found.push(square(x, y, from, side));
        continue;
      }
      found.push(crossing(x, y, side));
      if (x < width) found.push(wayAt(`${x} ${y} right`, side));
      if (y < height) found.push(wayAt(`${x} ${y} up`, side));
    }
  }
  return found;
}

/**
 * The thing that is next from a point in mm in a direction; what lies aside counts as further, and what lies more aside
 * than ahead only while the warehouse is set up, where nothing else is. Null if there is none.
 *
 * @param {Point} point
 * @param {Point} direction
 * @param {Scene} scene
 * @returns {Target | null}
 */
export function nextTo([px, py], [dx, dy], scene) {
  /** @type {Target | null} */
  let best = null;
  let least = Infinity;
  let isLeastAside = true;
  for (const target of all(scene)) {
    const [x, y] = [target.at[0] - px, target.at[1] - py];
    const [along, across] = [x * dx + y * dy, Math.abs(x * dy - y * dx)];
    const [isAside, far] = [across > along, along + 2 * across];
    if (along <= 1 || (isAside && !scene.isPlacing)) continue;
    if (isAside === isLeastAside ? far >= least : isAside) continue;
    [best, least, isLeastAside] = [target, far, isAside];
  }
  return best;
}

/**
 * The same thing where it is now; if it is gone, what is nearest to where it was.
 *
 * @param {Target} target
 * @param {Scene} scene
 */
export function again({ kind, id, at }, scene) {
  return all(scene).find((one) => one.kind === kind && one.id === id) ?? nearest(at, scene);
}

/**
 * The thing that is nearest to a point in mm; null if there is none.
 *
 * @param {Point} point
 * @param {Scene} scene
 * @returns {Target | null}
 */
export function nearest([px, py], scene) {
  /** @param {Target} one */
  const far = ({ at: [x, y] }) => Math.hypot(x - px, y - py);
  const [first = null, ...others] = all(scene);
  return others.reduce((best, one) => (best && far(best) <= far(one) ? best : one), first);
}
