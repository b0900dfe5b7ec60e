// Goods as a parcel with its number, in lists, and in words.

/** @import { Product } from "../station/robot.js" */

import { put } from "../words/words.js";

/**
 * Goods with their number and, if they have one, their name.
 *
 * @param {Pick<Product, "id" | "name">} product
 */
export const titleOf = ({ id, name = "" }) => `${id} ${name}`.trim();

/** @param {string} id */
export function parcel(id) {
  const element = document.createElement("span");
  element.className = "parcel";
  put(element, id);
  return element;
}
