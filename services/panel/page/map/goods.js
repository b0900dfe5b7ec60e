// The goods on the map: parcels with their numbers, at the side of the square from which they are reached.

/** @import { Product, Robot, Warehouse } from "../station/robot.js" */
/** @import { Box } from "./labels.js" */

import { INSIDE } from "./floor.js";
import { SIDES } from "./grid.js";
import { meets } from "./labels.js";
import { titleOf } from "../parts/parcel.js";
import { make, set } from "../parts/svg.js";
import { put, say } from "../words/words.js";

/** A parcel's side: in mm, in pixels at least, and as a part of its square at most. */
const SIZE = 112;
const SIZE_PX = 20;
const PART = 0.7;
/** From this size on, in pixels, a parcel has its number; where parcels share a square, from this size of its digits on. */
const NUMBER_PX = 12;
const DIGIT_PX = 9;
/** From this size of a square on, in pixels, goods have their names. */
const NAME_PX = 80;
/**
 * So far from the tape a parcel begins, in mm, that a robot that has turned in at it does not cover it; where goods
 * share a square, that a robot that drives by does not.
 */
const CLEAR = 178;
const BESIDE = 104;
/** A robot that puts its goods down or comes back has them no more. */
const HANDS_EMPTY = ["backing_off", "turning_round", "returning"];

/** @typedef {[Product, ...Product[]]} Stack Goods that are drawn as one parcel. */
/**
 * A parcel on the map: where it is and how large, in mm, and what it is drawn with.
 *
 * @typedef {object} Parcel
 * @property {string} id the number of its goods, of a stack all of them as words
 * @property {string} [name]
 * @property {number} x
 * @property {number} y
 * @property {number} size
 * @property {number} dx
 * @property {number} dy
 * @property {[number, number]} square
 * @property {boolean} isShared whether others are in the same square
 * @property {SVGElement} box
 * @property {SVGElement} number
 * @property {SVGElement} turn
 * @property {SVGElement} turnNumber
 * @property {SVGElement} why
 */

/**
 * The number of the goods that a robot has in its claw, or null.
 *
 * @param {Pick<Robot, "state" | "gone"> | null} robot
 */
export function carries(robot) {
  const { product, phase = "" } = robot?.state ?? {};
  return product !== undefined && robot?.gone.has(product) && !HANDS_EMPTY.includes(phase) ? product : null;
}

/**
 * Which order of a robot goods have: 0 is under way, 1 the next one; -1 if they are not ordered.
 *
 * @param {Pick<Robot, "state" | "queue">} robot
 * @param {string} product
 */
export function turnOf({ state: { product: current, order: number }, queue }, product) {
  const waiting = queue.filter(({ order }) => order !== number);
  return product === current ? 0 : waiting.findIndex((one) => one.product === product) + 1 || -1;
}

export class Goods {
  /** @param {SVGElement} svg */
  constructor(svg) {
    this.group = make("g", {}, svg);
    this.names = make("g", {}, svg);
    /** @type {Parcel[]} */
    this.parcels = [];
    /**
     * The boxes of the names.
     *
     * @type {Box[]}
     */
    this.taken = [];
  }

  /**
   * All goods of a warehouse at a scale of `px` mm a pixel.
   *
   * @param {Warehouse | null} warehouse
   * @param {number} side
   * @param {number} px
   */
  draw(warehouse, side, px) {
    this.group.replaceChildren();
    this.names.replaceChildren();
    const products = warehouse?.product ?? [];
    const size = Math.min(Math.max(SIZE, SIZE_PX * px), side * PART);
    const small = shared(size, side, px);
    const all = stacks(products, ({ id }) => small >= NUMBER_PX * px && letter(String(id), small, px) >= DIGIT_PX * px);
    this.parcels = all.map((stack) => {
      const isShared = all.filter(([{ square }]) => String(square) === String(stack[0].square)).length > 1;
      return this.parcel(stack, isShared, side, isShared ? small : size, px);
    });
    this.hasNumbers = size >= NUMBER_PX * px;
    this.hasWords = side / px >= NAME_PX;
    this.taken = [];
    if (this.hasWords) for (const parcel of this.parcels) this.name(parcel, side, px);
  }

  /**
   * @param {Stack} stack
   * @param {boolean} isShared
   * @param {number} side
   * @param {number} size
   * @param {number} px
   * @returns {Parcel}
   */
  parcel(stack, isShared, side, size, px) {
    const [{ square }] = stack;
    const ways = new Set(stack.map(({ side }) => side));
    // One that is reached from several sides stands between them.
    const [dx, dy] = ways.size > 1 ? [0, 0] : SIDES[stack[0].side];
    const middle = side / 2;
    const depth = isShared ? Math.min(BESIDE + size / 2, middle - size) : Math.min(CLEAR + size / 2, middle);
    const [x, y] = [(square[0] + 0.5) * side + dx * (middle - depth), (square[1] + 0.5) * side + dy * (middle - depth)];
    const id = stack.map(({ id }) => id).join(" ");
    const box = make("g", { class: "good", "data-product": id, transform: `translate(${x} ${-y})` }, this.group);
    make("title", {}, box, stack.map(titleOf).join("\n"));
    // The mark on the tape at which the robot turns in reaches to its goods.
    const reach = ways.size > 1 ? middle : depth;
    for (const way of ways) {
      const [wx, wy] = SIDES[way];
      make("path", { class: "mark", d: `M${wx * reach} ${-wy * reach}L${(wx * size) / 2} ${(-wy * size) / 2}` }, box);
    }
    const behind = Math.min(2.5 * px, size / 6) - size / 2;
    if (stack.length > 1) make("rect", { x: behind, y: -behind - size, width: size, height: size, rx: size / 12 }, box);
    make("rect", { x: -size / 2, y: -size / 2, width: size, height: size, rx: size / 12 }, box);
    make("path", { class: "lid", d: `M${-size / 6} ${-size / 2}v${size / 5}h${size / 3}v${-size / 5}` }, box);
    const words = stack.length > 1 ? many(stack.length) : id;
    const high = letter(words, size, px);
    const number = make("text", { class: "number", y: high * 0.36, "font-size": high }, box, size / px < NUMBER_PX ? "" : words);
    const turn = make("g", { class: "turn", transform: `translate(${size / 2} ${-size / 2})` }, box);
    make("circle", {}, turn);
    const turnNumber = make("text", { y: 4 * px }, turn);
    const why = make("text", { class: "why", y: size / 2 + 14 * px }, box);
    const name = stack.length > 1 ? id.replaceAll(" ", " \u00b7 ") : stack[0].name;
    return { id, name, x, y, size, dx, dy, square, isShared, box, number, turn, turnNumber, why };
  }

  /**
   * A name stands at its goods where it has room there.
   *
   * @param {Parcel} parcel
   * @param {number} side
   * @param {number} px
   */
  name({ id, name, x, y, size, dx, dy, square, isShared }, side, px) {
    if (!name) return;
    const [middle, below] = [dx && !isShared ? (square[0] + 0.5) * side : x, dy >= 0];
    const at = { x: middle, y: -y + (below ? size / 2 + 15 * px : -size / 2 - 8 * px) };
    const text = make("text", { class: "name", "data-name": id, ...at }, this.names, name);
    const half = text.getComputedTextLength() / 2;
    const [across, down] = [at.x - (square[0] + 0.5) * side, at.y + (square[1] + 0.5) * side];
    const isIn = Math.abs(across) + half < side / 2 - INSIDE && Math.abs(down) + 6 * px < side / 2;
    const hits = this.parcels.some((other) => other.id !== id && Math.abs(other.x - at.x) < half + other.size / 2 && Math.abs(-other.y - at.y + 4 * px) < 8 * px + other.size / 2);
    /** @type {Box} */
    const box = [at.x - half, at.y - 12 * px, at.x + half, at.y + 4 * px];
    if (!isIn || hits || this.taken.some((other) => meets(other, box))) text.remove();
    else this.taken.push(box);
  }

  /**
   * How each parcel stands with a robot: ordered, under way, out of reach, or no more in its place.
   *
   * @param {Robot} robot
   */
  mark(robot) {
    const noWay = ["no_way", "unreachable"].includes(robot.state.failure ?? "");
    for (const { id, box, number, turn, turnNumber, why } of this.parcels) {
      const ids = id.split(" ");
      const turns = ids.map((one) => turnOf(robot, one)).filter((turn) => turn >= 0);
      const order = Math.min(...turns.filter((turn) => turn > 0));
      const here = ids.filter((one) => !robot.gone.has(one));
      const [isWanted, isQueued, isGone] = [turns.includes(0), Number.isFinite(order), !here.length];
      const isOutOfReach = isWanted ? noWay : isQueued && ids.some((one) => robot.jobs.putOff.get(one) === "order_put_off");
      // Of a stack the number of those that are in their place.
      if (ids.length > 1 && number.textContent) put(number, many(here.length || ids.length));
      const words = ["good", isWanted && "wanted", isQueued && "queued", isGone && "gone", isOutOfReach && "out-of-reach"];
      set(box, "class", words.filter(Boolean).join(" "));
      turn.toggleAttribute("hidden", !isQueued || !this.hasNumbers);
      put(turnNumber, isQueued ? String(order) : "");
      // In a dense map the dashed parcel says enough.
      const isAway = isGone && !isWanted && this.hasWords;
      const said = isOutOfReach ? say("no_way") : isAway ? say(ids.every((one) => wasDelivered(robot, one)) ? "delivered" : "away") : "";
      put(why, said);
      // It stands in the name's place.
      this.names.querySelector(`[data-name="${id}"]`)?.toggleAttribute("hidden", said !== "");
    }
  }

  /**
   * The boxes of parcels and names in mm of the drawing.
   *
   * @returns {Box[]}
   */
  get boxes() {
    /** @type {(parcel: Parcel) => Box} */
    const box = ({ x, y, size }) => [x - size / 2, -y - size / 2, x + size / 2, -y + size / 2];
    return [...this.parcels.map(box), ...this.taken];
  }
}

/** @param {number} count */
const many = (count) => `\u00d7${count}`;

/**
 * How high the letters on a parcel are, so that they fit.
 *
 * @param {string} words
 * @param {number} size
 * @param {number} px
 */
const letter = (words, size, px) => Math.min(Math.max(11 * px, size * 0.45), (size * 0.9) / (0.6 * words.length));

/**
 * Goods, each for itself or with those that are drawn as one with it: what stands at one side of a square, and all of
 * a square that has no room for a number that can be read on each.
 *
 * @param {Product[]} products
 * @param {(product: Product) => boolean} isLegible whether its number is, in a square that it shares
 * @returns {Stack[]}
 */
export function stacks(products, isLegible) {
  /** @type {(all: Product[], key: (one: Product) => string) => Stack[]} */
  const groups = (all, key) => {
    /** @type {Map<string, Stack>} */
    const found = new Map();
    for (const one of all) {
      const group = found.get(key(one));
      if (group) group.push(one);
      else found.set(key(one), [one]);
    }
    return [...found.values()];
  };
  return groups(products, ({ square }) => String(square)).flatMap((all) => (all.every(isLegible) ? groups(all, ({ side }) => side) : [all]));
}

/**
 * How large parcels are that share a square, so that they do not touch: to scale, if that can be read.
 *
 * @param {number} size
 * @param {number} side
 * @param {number} px
 */
function shared(size, side, px) {
  const room = (side / 2 - BESIDE) / 1.5;
  return Math.min(size, room >= SIZE_PX * px ? room : side / 3);
}

/**
 * The robot's last delivery of goods that are not in their place, if it has told one.
 *
 * @param {Pick<Robot, "jobs">} robot
 * @param {string} product
 */
export function wasDelivered(robot, product) {
  return robot.jobs.done.find((one) => one.product === product) ?? null;
}
