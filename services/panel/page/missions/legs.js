// How long orders will take, learned from those that were delivered. Where nothing is known there is no time. Pure.

/** @import { Delivered, Job, Step } from "../station/jobs.js" */
/** @import { Side, Warehouse } from "../station/robot.js" */

/** So many of the newest orders of the same goods count. */
const LATEST = 5;

/** @typedef {(product: string) => number | undefined} Far How many crossings goods are away from delivery, if that is known. */
/** @typedef {{ done: Delivered[], far: Far, crossing: number | null, back: number }} Known */
/** @typedef {{ arrived: number | null, picked: number | null, at: number | null }} Ends In ms since 1970. */

/**
 * What past orders teach, the newest first: ms for each crossing, and from a delivery to the next order.
 *
 * @param {Delivered[]} done
 * @param {Far} far
 * @returns {Known}
 */
export function learn(done, far) {
  /** @param {Step} until */
  const after = (until) => median(done.flatMap((job) => took(job, "at", until) ?? []));
  return { done, far, crossing: median(done.flatMap(({ legs }) => legs)), back: after("next") ?? after("back") ?? 0 };
}

/**
 * In how many ms an order is delivered that is under way; null: not known, or it takes longer than it ever did.
 * @param {Job} job
 * @param {Known} known
 * @param {number} now
 * @returns {number | null}
 */
export function left(job, known, now) {
  const steps = ends(job, known);
  return steps.at === null || steps.at < now ? null : steps.at - now;
}

/**
 * When an order will have arrived, is picked up and delivered; null: not known. What has been is as it was.
 * @param {Job} job
 * @param {Known} known
 * @returns {Ends}
 */
export function ends(job, known) {
  /** @type {(before: number | null, from: Step, to: Step) => number | null} */
  const after = (before, from, to) => {
    const ms = part(known, job.product, from, to);
    return before === null || ms === null ? null : before + ms;
  };
  const arrived = job.arrived ?? after(job.began ?? null, "began", "arrived");
  const picked = job.picked ?? after(arrived, "arrived", "picked");
  return { arrived, picked, at: after(picked, "picked", "at") };
}

/**
 * In how many ms each of the orders that wait is delivered, in their order; null: not known.
 * @param {number | null} first in how many ms the one under way is delivered; 0 where there is none
 * @param {string[]} products
 * @param {Known} known
 * @param {boolean} isAway the robot still has to come back from a delivery before it sets out
 * @returns {(number | null)[]}
 */
export function waits(first, products, known, isAway) {
  let at = first;
  return products.map((product, index) => {
    const whole = ends({ product, order: "", began: 0, detours: [], legs: [] }, known).at;
    at = at === null || whole === null ? null : at + whole + (index > 0 || isAway ? known.back : 0);
    return at;
  });
}

/**
 * How many crossings goods are away from delivery, by the warehouse; undefined: not known.
 *
 * @param {Warehouse | null} warehouse
 * @param {string} product
 * @returns {number | undefined}
 */
export function crossingsTo(warehouse, product) {
  const goods = warehouse?.product?.find(({ id }) => String(id) === product);
  if (!warehouse || !goods) return undefined;
  const [[x, y], [dx, dy]] = [goods.square, warehouse.delivery];
  /** @type {Record<Side, [number, number][]>} */
  const corners = { left: [[x, y], [x, y + 1]], right: [[x + 1, y], [x + 1, y + 1]], down: [[x, y], [x + 1, y]], up: [[x, y + 1], [x + 1, y + 1]] };
  return Math.min(...corners[goods.side].map(([cx, cy]) => Math.abs(cx - dx) + Math.abs(cy - dy)));
}

/**
 * How long one part of an order took, in ms; null: not known.
 *
 * @param {Job} job
 * @param {Step} from
 * @param {Step} to
 */
function took(job, from, to) {
  const { [from]: began, [to]: done } = job;
  return began === undefined || done === undefined ? null : done - began;
}

/**
 * How long one part of an order takes: as these goods took, or as others took and the way that is longer or shorter.
 *
 * @param {Known} known
 * @param {string} product
 * @param {Step} from
 * @param {Step} to
 */
function part({ done, far, crossing }, product, from, to) {
  /** @param {Delivered[]} jobs */
  const all = (jobs) => jobs.flatMap((job) => took(job, from, to) ?? []);
  const own = all(done.filter((job) => job.product === product));
  if (own.length) return median(own.slice(0, LATEST));
  // To pick up takes as long everywhere.
  if (from === "arrived") return median(all(done).slice(0, LATEST));
  const crossings = far(product);
  if (crossings === undefined || crossing === null) return null;
  const rest = median(done.flatMap((job) => {
    const [ms, away] = [took(job, from, to), far(job.product)];
    return ms === null || away === undefined ? [] : ms - away * crossing;
  }));
  return rest === null ? null : Math.max(0, rest + crossings * crossing);
}

/**
 * @param {number[]} numbers
 * @returns {number | null}
 */
function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return sorted[Math.floor((sorted.length - 1) / 2)] ?? null;
}
