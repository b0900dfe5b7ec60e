// How long orders will take, learned from those that were delivered. Where nothing is known there is no time. Pure.

/** So many of the newest orders of the same goods count. */
const LATEST = 5;

/**
 * @typedef {import("../station/jobs.js").Job} Job
 * @typedef {{ done: Job[], crossing: number | null, back: number }} Known
 */

/**
 * What past orders teach, the newest first: ms for each crossing, and from a delivery to the next order.
 * @param {Job[]} done
 * @returns {Known}
 */
export function learn(done) {
  const after = (until) => median(done.flatMap((job) => (job.at !== undefined && job[until] !== undefined ? [job[until] - job.at] : [])));
  return { done, crossing: median(done.flatMap(({ legs }) => legs)), back: after("next") ?? after("back") ?? 0 };
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
 * @returns {{ arrived: number | null, picked: number | null, at: number | null }}
 */
export function ends(job, known) {
  const { product, crossings } = job;
  const after = (before, from, to) => {
    const ms = before === null ? null : part(known, product, crossings, from, to);
    return ms === null ? null : before + ms;
  };
  const arrived = job.arrived ?? after(job.began ?? null, "began", "arrived");
  const picked = job.picked ?? after(arrived, "arrived", "picked");
  return { arrived, picked, at: after(picked, "picked", "at") };
}

/**
 * In how many ms each of the orders that wait is delivered, in their order; null: not known.
 * @param {number | null} first in how many ms the one under way is delivered; 0 where there is none
 * @param {{ product: string, crossings?: number }[]} orders
 * @param {Known} known
 * @param {boolean} isAway the robot still has to come back from a delivery before it sets out
 * @returns {(number | null)[]}
 */
export function waits(first, orders, known, isAway) {
  let at = first;
  return orders.map(({ product, crossings }, index) => {
    const whole = ends({ product, crossings, order: "", began: 0, detours: [], legs: [] }, known).at;
    at = at === null || whole === null ? null : at + whole + (index > 0 || isAway ? known.back : 0);
    return at;
  });
}

/**
 * How many crossings goods are away from delivery, by the warehouse; undefined: not known.
 * @returns {number | undefined}
 */
export function crossingsTo(warehouse, product) {
  const goods = warehouse?.product?.find(({ id }) => String(id) === product);
  if (!goods || !warehouse.delivery) return undefined;
  const [[x, y], [dx, dy]] = [goods.square, warehouse.delivery];
  const corners = { left: [[x, y], [x, y + 1]], right: [[x + 1, y], [x + 1, y + 1]], down: [[x, y], [x + 1, y]], up: [[x, y + 1], [x + 1, y + 1]] }[goods.side];
  return corners && Math.min(...corners.map(([cx, cy]) => Math.abs(cx - dx) + Math.abs(cy - dy)));
}

/** How long one part of an order takes: as these goods took, or as others took and the way that is longer or shorter. */
function part({ done, crossing }, product, crossings, from, to) {
  const took = (jobs, of = (ms) => ms) => jobs.flatMap((job) => (job[from] === undefined || job[to] === undefined ? [] : [of(job[to] - job[from], job)]));
  const own = took(done.filter((job) => job.product === product));
  if (own.length) return median(own.slice(0, LATEST));
  // To pick up takes as long everywhere.
  if (from === "arrived") return median(took(done).slice(0, LATEST));
  if (crossings === undefined || crossing === null) return null;
  const others = done.filter((job) => job.crossings !== undefined);
  const rest = median(took(others, (ms, job) => ms - job.crossings * crossing));
  return rest === null ? null : Math.max(0, rest + crossings * crossing);
}

/** @returns {number | null} */
function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor((sorted.length - 1) / 2)] : null;
}
