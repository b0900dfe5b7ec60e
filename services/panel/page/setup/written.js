// A warehouse as others write it: in a file, or in the strings of the document. All of it is pure.

/** @import { Point } from "../map/grid.js" */
/** @import { Product, Side, Warehouse } from "../station/robot.js" */
/** @import { Said } from "./edits.js" */

import { wrongFloor } from "./edits.js";

/**
 * The sides in the order of their numbers, clockwise from the left.
 *
 * @type {Side[]}
 */
export const SIDES = ["left", "up", "right", "down"];

/**
 * The warehouse of a file's text; what is left out in it is as the station has it.
 *
 * @param {string} text
 * @returns {Warehouse | null}
 */
export function readFile(text) {
  try {
    const { delivery = [0, 0], product = [], ...rest } = JSON.parse(text);
    const warehouse = { ...rest, delivery, product };
    return isWarehouse(warehouse) ? warehouse : null;
  } catch {
    // It is no JSON.
    return null;
  }
}

/**
 * Whether what somebody else has written has the form of a warehouse.
 *
 * @param {any} one
 * @returns {one is Warehouse}
 */
function isWarehouse(one) {
  const { size, side_length_cm: side, delivery, product } = one;
  /** @type {(list: any, least: number) => boolean} */
  const isWhole = (list, least) => Array.isArray(list) && list.length === 2 && list.every((number) => Number.isInteger(number) && number >= least);
  /** @param {any} good */
  const isProduct = (good) => Number.isInteger(good?.id) && isWhole(good.square, 0) && SIDES.includes(good.side);
  return isWhole(size, 1) && Number.isInteger(side) && isWhole(delivery, 0) && Array.isArray(product) && product.every(isProduct);
}

/**
 * What is wrong with a warehouse that others have written, before it can be drawn.
 *
 * @param {Warehouse} warehouse
 * @returns {Said | null}
 */
export function wrongDrawing(warehouse) {
  const { size: [width, height], delivery: [x, y] } = warehouse;
  if (width < 1 || height < 1) return ["no_warehouse"];
  const isCorner = (x === 0 || x === width) && (y === 0 || y === height);
  return wrongFloor(warehouse) ?? (isCorner ? null : ["no_corner", `${x}, ${y}`]);
}

/**
 * The map as the document writes it, "X,Y,x,y" (M1).
 *
 * @param {string} text
 * @returns {{ size: Point, delivery: Point } | null}
 */
export function readMap(text) {
  const [width, height, x, y, ...more] = text.split(",").map(whole);
  if (width === undefined || height === undefined || x === undefined || y === undefined || more.length) return null;
  return { size: [width, height], delivery: [x, y] };
}

/**
 * The goods as the document writes them, "v,x,y,s;...", s clockwise from left (M3), or the part that is none.
 *
 * @param {string} text
 * @returns {{ product: Product[] } | { wrong: string }}
 */
export function readGoods(text) {
  /** @type {Product[]} */
  const product = [];
  for (const part of text.split(";").filter((part) => part.trim())) {
    const [id, x, y, number, ...more] = part.split(",").map(whole);
    const side = SIDES[number ?? -1];
    if (id === undefined || x === undefined || y === undefined || !side || more.length) return { wrong: part };
    product.push({ id, square: [x, y], side });
  }
  return { product };
}

/**
 * A whole number that is written in digits alone.
 *
 * @param {string} word
 */
const whole = (word) => (/^\s*\d+\s*$/.test(word) ? Number(word) : undefined);
