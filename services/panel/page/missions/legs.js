// How long orders will take, learned from those that were delivered. Where nothing is known there is no time. Pure.

/** So many of the newest orders of the same goods count. */
const LATEST = 5;

/**
 * @typedef {import("../station/jobs.js").Job} Job
 * @typedef {{ done: Job[], far: (product: string) => number | undefined, crossing: number | null, back: number }} Known
 */

/**
 * What past orders teach, the newest first: ms for each crossing, and from a delivery to the next order.
 * @param {Job[]} done
 * @param {(product: string) => number | undefined} far how many crossings goods are away from delivery
 * @returns {Known}
 */
export function learn(done, far) {
  const after = (until) => median(done.flatMap((job) => (job.at !== undefined && job[until] !== undefined ? [job[until] - job.at] : [])));
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
 * @returns {{ arrived: number | null, picked: number | null, at: number | null }}
 */
export function ends(job, known) {
  const after = (before, from, to) => {
    const ms = before === null ? null : part(known, job.product, from, to);
    return ms === null ? null : before + ms;
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
function part({ done, far, crossing }, product, from, to) {
  const took = (jobs, of = (ms) => ms) => jobs.flatMap((job) => (job[from] === undefined || job[to] === undefined ? [] : [of(job[to] - job[from], job)]));
  const own = took(done.filter((job) => job.product === product));
  if (own.length) return median(own.slice(0, LATEST));
  // To pick up takes as long everywhere.
  if (from === "arrived") return median(took(done).slice(0, LATEST));
  const crossings = far(product);
  if (crossings === undefined || crossing === null) return null;
  const others = done.filter((job) => far(job.product) !== undefined);
  const rest = median(took(others, (ms, job) => ms - far(job.product) * crossing));
  return rest === null ? null : Math.max(0, rest + crossings * crossing);
}

/** @returns {number | null} */
function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor((sorted.length - 1) / 2)] : null;
}
