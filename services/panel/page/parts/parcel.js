// Goods as a parcel with its number, in lists.

import { put } from "../words/words.js";

/** @param {string} id */
export function parcel(id) {
  const element = document.createElement("span");
  element.className = "parcel";
  put(element, id);
  return element;
}
