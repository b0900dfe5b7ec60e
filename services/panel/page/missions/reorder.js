// What moves an order in the robot's queue, and which goods a person means by what was typed. Pure.

/** @import { Product } from "../station/robot.js" */

/**
 * The orders that are moved up, one after the other, so that `order` stands before `before`; null: at the end.
 * @param {string[]} orders as they wait
 * @param {string} order
 * @param {string | null} before
 * @returns {string[]}
 */
export function ups(orders, order, before) {
  const from = orders.indexOf(order);
  const to = before === null ? orders.length : orders.indexOf(before);
  if (from < 0 || to < 0) return [];
  // Upwards it passes each one itself; downwards each one passes it.
  return to <= from ? Array(from - to).fill(order) : orders.slice(from + 1, to);
}

/**
 * The goods that this text means: their number, their name, else all whose name has it or whose number begins so.
 *
 * @template {Pick<Product, "id" | "name">} Goods
 * @param {Goods[]} goods
 * @param {string} text
 * @returns {Goods[]}
 */
export function matches(goods, text) {
  const wanted = text.trim().toLocaleLowerCase();
  /** @param {Goods} one */
  const name = (one) => (one.name ?? "").toLocaleLowerCase();
  const alike = goods.filter((one) => name(one).includes(wanted) || String(one.id).startsWith(wanted));
  if (!wanted) return alike;
  const [byNumber, byName] = [alike.filter((one) => String(one.id) === wanted), alike.filter((one) => name(one) === wanted)];
  if (byNumber.length) return byNumber;
  return byName.length ? byName : alike;
}
