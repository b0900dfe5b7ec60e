// What a person changes in the warehouse before it is saved: the changes themselves, what is wrong with their result,
// and the way back. All of it is pure: no page, no link.

/** @import { Point } from "../map/grid.js" */
/** @import { Product, Side, Warehouse } from "../station/robot.js" */

import { LIMITS } from "./limits.js";

/** @typedef {[key: string, ...values: (string | number)[]]} Said The key of a sentence and its values. */

/** The changes since the page was opened, each with its name, and which of them are saved. */
export class Edits {
  constructor() {
    /** @type {{ warehouse: Warehouse | null, what: Said | null }[]} */
    this.steps = [{ warehouse: null, what: null }];
    this.at = 0;
    /**
     * What is saved.
     *
     * @type {Warehouse | null}
     */
    this.safe = null;
    /** At which step, and how many steps were left on a way that nobody can go any more. */
    this.savedAt = 0;
    this.left = 0;
  }

  /** The warehouse as it is drawn now. */
  get now() {
    return this.steps[this.at]?.warehouse ?? null;
  }

  /** How many changes lie between this and what is saved. */
  get unsaved() {
    return isSame(this.safe, this.now) ? 0 : Math.max(1, this.left + Math.abs(this.at - this.savedAt));
  }

  /**
   * What going back undoes.
   *
   * @returns {Said | null}
   */
  get undoes() {
    // Before the first warehouse there was none, and none can be saved.
    return this.steps[this.at - 1]?.warehouse ? this.steps[this.at]?.what ?? null : null;
  }

  /**
   * What going forth does again.
   *
   * @returns {Said | null}
   */
  get redoes() {
    return this.steps[this.at + 1]?.what ?? null;
  }

  /**
   * Takes a changed warehouse; whether it is another one.
   *
   * @param {Warehouse} warehouse
   */
  change(warehouse) {
    if (isSame(warehouse, this.now)) return false;
    // What was undone and is saved stays so many changes away.
    if (this.savedAt > this.at) [this.left, this.savedAt] = [this.left + this.savedAt - this.at, this.at];
    this.steps.splice(this.at + 1, Infinity, { warehouse, what: difference(this.now, warehouse) });
    this.at += 1;
    return true;
  }

  undo() {
    if (this.undoes) this.at -= 1;
  }

  redo() {
    if (this.redoes) this.at += 1;
  }

  /**
   * This warehouse is saved, as it was sent: what is drawn now, if nobody went on meanwhile.
   *
   * @param {Warehouse | null} warehouse
   */
  saved(warehouse) {
    this.safe = warehouse;
    const at = this.steps.findLastIndex((step) => step.warehouse === warehouse);
    if (at >= 0) [this.savedAt, this.left] = [at, 0];
  }

  /**
   * The station keeps this warehouse. It is drawn, too, unless somebody is at work here.
   *
   * @param {Warehouse} warehouse
   * @returns {boolean} whether it was saved elsewhere while somebody is at work here
   */
  kept(warehouse) {
    if (isSame(warehouse, this.safe)) return false;
    if (this.now && this.unsaved && !isSame(warehouse, this.now)) {
      this.safe = warehouse;
      return true;
    }
    if (this.now) this.change(warehouse);
    else [this.steps, this.at] = [[{ warehouse, what: null }], 0];
    this.saved(this.now);
    return false;
  }

  /** Back to what the station keeps; that can be undone, too. */
  discard() {
    if (this.safe) this.change(this.safe);
    this.saved(this.now);
  }
}

/**
 * Whether two warehouses are the same, whatever is left out in one of them.
 *
 * @param {Warehouse | null} a
 * @param {Warehouse | null} b
 */
function isSame(a, b) {
  /** @param {Warehouse | null} one */
  const whole = (one) => one && JSON.stringify([one.size, one.side_length_cm, one.delivery, goods(one).map(({ id, name = "", square, side }) => [id, name, square, side]), one.exit, one.floor, one.obstacle]);
  return whole(a) === whole(b);
}

/** @param {Warehouse} warehouse */
const goods = ({ product = [] }) => product;

/**
 * What a change is called.
 *
 * @param {Warehouse | null} before
 * @param {Warehouse} after
 * @returns {Said}
 */
function difference(before, after) {
  if (!before) return ["change_all"];
  /** @type {Said[]} */
  const found = [];
  if (String(before.size) !== String(after.size)) found.push(["change_size", ...after.size]);
  else if (String(before.delivery) !== String(after.delivery)) found.push(["change_delivery", after.delivery.join(", ")]);
  if (before.side_length_cm !== after.side_length_cm) found.push(["change_side", after.side_length_cm]);
  for (const { id } of goods(before)) if (!goods(after).some((one) => one.id === id)) found.push(["change_removed", id]);
  for (const one of goods(after)) {
    const was = goods(before).find(({ id }) => id === one.id);
    if (!was) found.push(["change_placed", one.id]);
    else if (String(was.square) !== String(one.square) || was.side !== one.side) found.push(["change_moved", one.id]);
    if (was && (was.name ?? "") !== (one.name ?? "")) found.push(["change_named", one.id]);
  }
  const [only, ...others] = found;
  return only && !others.length ? only : ["change_all"];
}

/**
 * The next number that no goods have.
 *
 * @param {Warehouse} warehouse
 */
export const freeNumber = (warehouse) => Math.max(0, ...goods(warehouse).map(({ id }) => id)) + 1;

/**
 * Puts goods with the next number at the side of a square.
 *
 * @param {Warehouse} warehouse
 * @param {Point} square
 * @param {Side} side
 * @returns {Warehouse}
 */
export const placed = (warehouse, square, side) => ({ ...warehouse, product: [...goods(warehouse), { id: freeNumber(warehouse), square, side }] });

/**
 * Moves goods to the side of a square.
 *
 * @param {Warehouse} warehouse
 * @param {number} id
 * @param {Point} square
 * @param {Side} side
 */
export const moved = (warehouse, id, square, side) => replaced(warehouse, id, (one) => [{ ...one, square, side }]);

/**
 * Names goods; without a name they have only their number.
 *
 * @param {Warehouse} warehouse
 * @param {number} id
 * @param {string} name
 */
export const named = (warehouse, id, name) => replaced(warehouse, id, ({ square, side }) => [{ id, ...(name.trim() && { name: name.trim() }), square, side }]);

/**
 * Takes goods out.
 *
 * @param {Warehouse} warehouse
 * @param {number} id
 */
export const removed = (warehouse, id) => replaced(warehouse, id, () => []);

/**
 * Chooses the corner of the delivery.
 *
 * @param {Warehouse} warehouse
 * @param {Point} delivery
 * @returns {Warehouse}
 */
export const delivered = (warehouse, delivery) => ({ ...warehouse, delivery });

/**
 * Gives the floor another size, within the limits. The delivery stays in its corner.
 *
 * @param {Warehouse} warehouse
 * @param {Point} size
 * @returns {Warehouse}
 */
export function resized(warehouse, size) {
  /** @param {number} squares */
  const within = (squares) => Math.max(1, Math.min(LIMITS.squares, squares));
  const [width, height] = [within(size[0]), within(size[1])];
  const [x, y] = warehouse.delivery;
  return { ...warehouse, size: [width, height], delivery: [x && width, y && height] };
}

/**
 * @param {Warehouse} warehouse
 * @param {number} id
 * @param {(one: Product) => Product[]} by
 * @returns {Warehouse}
 */
function replaced(warehouse, id, by) {
  return { ...warehouse, product: goods(warehouse).flatMap((one) => (one.id === id ? by(one) : [one])) };
}

/**
 * What is wrong with size and side; the station checks it, too.
 *
 * @param {Warehouse} warehouse
 * @returns {Said | null}
 */
export function wrongFloor({ size, side_length_cm: side, product = [] }) {
  const largest = Math.max(...size);
  if (largest > LIMITS.squares) return ["size_limits", LIMITS.squares, largest];
  if (side < LIMITS.leastSideCm || side > LIMITS.mostSideCm) return ["side_limits", LIMITS.leastSideCm, side, LIMITS.mostSideCm];
  return product.length > LIMITS.goods ? ["goods_limits", LIMITS.goods, product.length] : null;
}

/**
 * What is wrong with each of the goods, in their order.
 *
 * @param {Warehouse} warehouse
 * @returns {(Said | null)[]}
 */
export function wrongGoods({ size, product = [] }) {
  return product.map((one, index) => {
    const [x, y] = one.square;
    const before = product.slice(0, index);
    if (before.some(({ id }) => id === one.id)) return ["duplicate", one.id];
    if (x < 0 || y < 0 || x >= size[0] || y >= size[1]) return ["outside", one.id];
    return one.name !== undefined && before.some(({ name }) => name === one.name) ? ["same_name", one.name] : null;
  });
}
