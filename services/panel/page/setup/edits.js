// What a person changes in the warehouse before it is saved: the changes themselves, what is wrong with their result,
// and the way back. All of it is pure: no page, no link.

import { LIMITS } from "../words/table.js";

/**
 * A warehouse as its file has it.
 * @typedef {{ id: number, name?: string, square: [number, number], side: string }} Product
 * @typedef {{ size: [number, number], side_length_cm: number, delivery?: [number, number], product?: Product[] }} Warehouse
 * @typedef {(string | number)[]} Said the key of a sentence and its values
 */

/** The changes since the page was opened, each with its name, and which of them are saved. */
export class Edits {
  constructor() {
    /** @type {{ warehouse: Warehouse | null, what: Said | null }[]} */
    this.steps = [{ warehouse: null, what: null }];
    this.at = 0;
    /** What is saved, at which step, and how many steps were left on a way that nobody can go any more. */
    this.safe = null;
    this.savedAt = 0;
    this.left = 0;
  }

  /** @returns {Warehouse | null} the warehouse as it is drawn now */
  get now() {
    return this.steps[this.at].warehouse;
  }

  /** @returns {number} how many changes lie between this and what is saved */
  get unsaved() {
    return same(this.safe, this.now) ? 0 : Math.max(1, this.left + Math.abs(this.at - this.savedAt));
  }

  /** @returns {Said | null} what going back undoes */
  get undoes() {
    // Before the first warehouse there was none, and none can be saved.
    return this.steps[this.at - 1]?.warehouse ? this.steps[this.at].what : null;
  }

  /** @returns {Said | null} what going forth does again */
  get redoes() {
    return this.steps[this.at + 1]?.what ?? null;
  }

  /** @param {Warehouse} warehouse @returns {boolean} whether it is another one */
  change(warehouse) {
    if (same(warehouse, this.now)) return false;
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

  /** This warehouse is saved, as it was sent: what is drawn now, if nobody went on meanwhile. */
  saved(warehouse) {
    this.safe = warehouse;
    const at = this.steps.findLastIndex((step) => step.warehouse === warehouse);
    if (at >= 0) [this.savedAt, this.left] = [at, 0];
  }

  /**
   * The station keeps this warehouse. It is drawn, too, unless somebody is at work here.
   * @param {Warehouse} warehouse @returns {boolean} whether it was saved elsewhere while somebody is at work here
   */
  kept(warehouse) {
    if (same(warehouse, this.safe)) return false;
    if (!this.now) [this.steps, this.at] = [[{ warehouse, what: null }], 0];
    else if (this.unsaved && !same(warehouse, this.now)) {
      this.safe = warehouse;
      return true;
    } else this.change(warehouse);
    this.saved(this.now);
    return false;
  }

  /** Back to what the station keeps; that can be undone, too. */
  discard() {
    this.change(this.safe);
    this.saved(this.now);
  }
}

/** @returns {boolean} whether what somebody else has written has the form of a warehouse */
export function isWarehouse({ size, side_length_cm: side, delivery, product }) {
  const isWhole = (list, least) => Array.isArray(list) && list.length === 2 && list.every((number) => Number.isInteger(number) && number >= least);
  const isProduct = (one) => Number.isInteger(one?.id) && isWhole(one.square, 0) && one.side in { left: 0, up: 0, right: 0, down: 0 };
  return isWhole(size, 1) && Number.isInteger(side) && isWhole(delivery, 0) && Array.isArray(product) && product.every(isProduct);
}

/** Whether two warehouses are the same, whatever is left out in one of them. */
function same(a, b) {
  const whole = (one) => one && JSON.stringify([one.size, one.side_length_cm, one.delivery ?? [0, 0], goods(one).map(({ id, name = "", square, side }) => [id, name, square, side]), one.exit, one.floor, one.obstacle]);
  return whole(a) === whole(b);
}

const goods = (warehouse) => warehouse?.product ?? [];

/** What a change is called. */
function difference(before, after) {
  if (!before) return ["change_all"];
  const [was, is] = [goods(before), goods(after)];
  const ids = (list) => new Set(list.map(({ id }) => id));
  const [added, removed] = [is.filter(({ id }) => !ids(was).has(id)), was.filter(({ id }) => !ids(is).has(id))];
  const found = [];
  if (String(before.size) !== String(after.size)) found.push(["change_size", ...after.size]);
  else if (String(before.delivery ?? [0, 0]) !== String(after.delivery ?? [0, 0])) found.push(["change_delivery", after.delivery.join(", ")]);
  if (before.side_length_cm !== after.side_length_cm) found.push(["change_side", after.side_length_cm]);
  for (const { id } of added) found.push(["change_placed", id]);
  for (const { id } of removed) found.push(["change_removed", id]);
  for (const one of is) {
    const other = was.find(({ id }) => id === one.id);
    if (!other) continue;
    if (String(other.square) !== String(one.square) || other.side !== one.side) found.push(["change_moved", one.id]);
    if ((other.name ?? "") !== (one.name ?? "")) found.push(["change_named", one.id]);
  }
  return found.length === 1 ? found[0] : ["change_all"];
}

/** @param {Warehouse} warehouse @returns {number} the next number that no goods have */
export const freeNumber = (warehouse) => Math.max(0, ...goods(warehouse).map(({ id }) => id)) + 1;

/** Puts goods with the next number at the side of a square. */
export const placed = (warehouse, square, side) => ({ ...warehouse, product: [...goods(warehouse), { id: freeNumber(warehouse), square, side }] });

/** Moves goods to the side of a square. */
export const moved = (warehouse, id, square, side) => replaced(warehouse, id, (one) => [{ ...one, square, side }]);

/** Names goods; without a name they have only their number. */
export const named = (warehouse, id, name) => replaced(warehouse, id, ({ name: _, ...one }) => [name.trim() ? { ...one, name: name.trim() } : one]);

/** Takes goods out. */
export const removed = (warehouse, id) => replaced(warehouse, id, () => []);

/** Chooses the corner of the delivery. */
export const delivered = (warehouse, delivery) => ({ ...warehouse, delivery });

/** Gives the floor another size, within the limits. The delivery stays in its corner. */
export function resized(warehouse, size) {
  const within = size.map((squares) => Math.max(1, Math.min(LIMITS.squares, squares)));
  const delivery = (warehouse.delivery ?? [0, 0]).map((number, axis) => (number === 0 ? 0 : within[axis]));
  return { ...warehouse, size: within, delivery };
}

function replaced(warehouse, id, by) {
  return { ...warehouse, product: goods(warehouse).flatMap((one) => (one.id === id ? by(one) : [one])) };
}

/** @returns {Said | null} what is wrong with size and side; the station checks it, too */
export function wrongFloor({ size, side_length_cm: side, product = [] }) {
  const largest = Math.max(...size);
  if (largest > LIMITS.squares) return ["size_limits", LIMITS.squares, largest];
  if (side < LIMITS.leastSideCm || side > LIMITS.mostSideCm) return ["side_limits", LIMITS.leastSideCm, side, LIMITS.mostSideCm];
  return product.length > LIMITS.goods ? ["goods_limits", LIMITS.goods, product.length] : null;
}

/** @returns {(Said | null)[]} what is wrong with each of the goods, in their order */
export function wrongGoods({ size, product = [] }) {
  const before = (one, index, key) => one[key] !== undefined && product.findIndex((other) => other[key] === one[key]) < index;
  return product.map((one, index) => {
    const [x, y] = one.square;
    if (before(one, index, "id")) return ["duplicate", one.id];
    if (x < 0 || y < 0 || x >= size[0] || y >= size[1]) return ["outside", one.id];
    return before(one, index, "name") ? ["same_name", one.name] : null;
  });
}
