// The goods on the map: parcels with their numbers, at the side of the square from which they are reached.

/** @import { Product, Robot, Warehouse } from "../station/robot.js" */
/** @import { Box } from "./labels.js" */

import { INSIDE } from "./floor.js";
import { SIDES } from "./grid.js";
import { meets } from "./labels.js";
import { make, set } from "../parts/svg.js";
import { put, say } from "../words/words.js";

/** A parcel's side: in mm, in pixels at least, and as a part of its square at most. */
const SIZE = 112;
const SIZE_PX = 20;
const PART = 0.7;
/** From this size on, in pixels, a parcel has its number. */
const NUMBER_PX = 12;
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

/**
 * A parcel on the map: where it is and how large, in mm, and what it is drawn with.
 *
 * @typedef {object} Parcel
 * @property {string} id
 * @property {string} [name]
 * @property {number} x
 * @property {number} y
 * @property {number} size
 * @property {number} dx
 * @property {number} dy
 * @property {[number, number]} square
 * @property {boolean} isShared whether others are in the same square
 * @property {SVGElement} box
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
    this.parcels = products.map((product) => this.parcel(product, products, side, size, px));
    this.hasNumbers = size >= NUMBER_PX * px;
    this.hasWords = side / px >= NAME_PX;
    this.taken = [];
    if (this.hasWords) for (const parcel of this.parcels) this.name(parcel, side, px);
  }

  /**
   * @param {Product} product
   * @param {Product[]} products
   * @param {number} side
   * @param {number} size
   * @param {number} px
   * @returns {Parcel}
   */
  parcel({ id, name, square, side: from }, products, side, size, px) {
    const [dx, dy] = SIDES[from];
    const isShared = products.filter((other) => String(other.square) === String(square)).length > 1;
    const middle = side / 2;
    if (isShared) size = shared(size, side, px);
    const depth = isShared ? Math.min(BESIDE + size / 2, middle - size) : Math.min(CLEAR + size / 2, middle);
    const [x, y] = [(square[0] + 0.5) * side + dx * (middle - depth), (square[1] + 0.5) * side + dy * (middle - depth)];
    const box = make("g", { class: "good", "data-product": id, transform: `translate(${x} ${-y})` }, this.group);
    make("title", {}, box, name ? `${id} ${name}` : String(id));
    // The mark on the tape at which the robot turns in reaches to its goods.
    make("path", { class: "mark", d: `M${dx * depth} ${-dy * depth}L${(dx * size) / 2} ${(-dy * size) / 2}` }, box);
    make("rect", { x: -size / 2, y: -size / 2, width: size, height: size, rx: size / 12 }, box);
    make("path", { class: "lid", d: `M${-size / 6} ${-size / 2}v${size / 5}h${size / 3}v${-size / 5}` }, box);
    const letter = Math.min(Math.max(11 * px, size * 0.45), (size * 0.9) / (0.6 * String(id).length));
    make("text", { class: "number", y: letter * 0.36, "font-size": letter }, box, size / px < NUMBER_PX ? "" : String(id));
    const turn = make("g", { class: "turn", transform: `translate(${size / 2} ${-size / 2})` }, box);
    make("circle", {}, turn);
    const turnNumber = make("text", { y: 4 * px }, turn);
    const why = make("text", { class: "why", y: size / 2 + 14 * px }, box);
    return { id: String(id), name, x, y, size, dx, dy, square, isShared, box, turn, turnNumber, why };
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
    for (const { id, box, turn, turnNumber, why } of this.parcels) {
      const order = turnOf(robot, id);
      const [isWanted, isQueued, isGone] = [order === 0, order > 0, robot.gone.has(id)];
      const isOutOfReach = isWanted ? noWay : isQueued && robot.jobs.putOff.get(id) === "order_put_off";
      const words = ["good", isWanted && "wanted", isQueued && "queued", isGone && "gone", isOutOfReach && "out-of-reach"];
      set(box, "class", words.filter(Boolean).join(" "));
      turn.toggleAttribute("hidden", !isQueued || !this.hasNumbers);
      put(turnNumber, isQueued ? String(order) : "");
      // In a dense map the dashed parcel says enough.
      const isAway = isGone && !isWanted && this.hasWords;
      const said = isOutOfReach ? say("no_way") : isAway ? say(wasDelivered(robot, id) ? "delivered" : "away") : "";
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
