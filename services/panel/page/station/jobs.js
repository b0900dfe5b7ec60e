// The orders that a robot has begun, by its events: what was fetched when, and how far the one under way has come.
// What is told twice, by the station's history and on a new connection, counts once. Pure: entries in, orders out.

/** @import { Entry, Fields } from "./robot.js" */

/** What is told again of an order is told with a time that is this near to the first one, in ms. */
const SAME_MS = 10_000;
/** A crossing that is told again is told within this time; no two are so near, in ms. */
const CROSSING_MS = 500;

/** @typedef {{ at: number, who: string }} Asked When and by whom an order was given at a page. */
/** @typedef {"began" | "arrived" | "picked" | "at" | "back" | "next"} Step */
/**
 * One order. Times are in ms since 1970; one that nobody has told is missing.
 *
 * @typedef {{ product: string, order: string, asked?: Asked | undefined, passed?: number, legs: number[],
 *   detours: { node: string, looks: string, at: number }[] } & Partial<Record<Step, number>>} Job
 */
/** @typedef {Job & { at: number }} Delivered */

export class Jobs {
  constructor() {
    /**
     * What was delivered, the newest first.
     *
     * @type {Delivered[]}
     */
    this.done = [];
    /** @type {Job | null} */
    this.now = null;
    /**
     * By the numbers of the orders.
     *
     * @type {Map<string, Asked>}
     */
    this.asked = new Map();
    /**
     * Why orders that wait were put off, by their goods: the kind of the thought that said so.
     *
     * @type {Map<string, string>}
     */
    this.putOff = new Map();
    /** When the station's history was asked for what came before; for good once it is in it. */
    this.recalled = -Infinity;
  }

  /** @param {Entry} entry */
  take({ at, kind, words, values }) {
    if (kind === "asked") this.ask(at, words);
    else if (kind === "event") this.event(at, words);
    else if (kind === "thought" && values) this.thought(at, values);
  }

  /**
   * @param {number} at
   * @param {string[]} words
   */
  ask(at, [who = "", what, order = ""]) {
    if (what === "order" && !this.asked.has(order)) this.asked.set(order, { at, who });
  }

  /**
   * @param {number} at
   * @param {string[]} words
   */
  event(at, [what, x, y, order = "", product = "", looks = ""]) {
    if (what === "getting_item") return this.begin(at, order, product);
    if (what === "item_delivered") return this.deliver(at, order, product);
    const job = this.now;
    if (!job || job.order !== order) return;
    if (what === "in_position") job.arrived ??= at;
    const node = `${x},${y}`;
    const isTold = job.detours.some((one) => one.node === node && one.looks === looks && at - one.at < SAME_MS);
    if (what === "way_blocked" && !isTold) job.detours.push({ node, looks, at });
    if (what === "next_node" && (job.passed === undefined || at - job.passed > CROSSING_MS)) {
      if (job.passed !== undefined) job.legs.push(at - job.passed);
      job.passed = at;
    }
  }

  /**
   * @param {number} at
   * @param {string} order
   * @param {string} product
   */
  begin(at, order, product) {
    const [last] = this.done;
    const isTold = [this.now, ...this.done].some((job) => job?.order === order && Math.abs(at - (job.began ?? -Infinity)) < SAME_MS);
    if (isTold) return;
    // It goes straight on, without coming back first.
    if (last && last.back === undefined) last.next ??= at;
    this.now = { product, order, asked: this.asked.get(order), began: at, passed: at, detours: [], legs: [] };
  }

  /**
   * @param {number} at
   * @param {string} order
   * @param {string} product
   */
  deliver(at, order, product) {
    if (this.done.some((job) => job.order === order && Math.abs(at - job.at) < SAME_MS)) return;
    const job = this.now?.product === product ? this.now : { product, order, detours: [], legs: [] };
    this.done.unshift({ ...job, at });
    this.now = null;
  }

  /**
   * @param {number} at
   * @param {Fields} values
   */
  thought(at, { kind = "", product = "" }) {
    const job = this.now;
    const isIts = job?.product === product;
    if (kind === "has_goods" && isIts) {
      job.picked ??= at;
      // The way out of the goods is no leg between two crossings.
      delete job.passed;
    }
    if (kind === "is_back" && this.done[0]) this.done[0].back ??= at;
    const isPutOff = ["order_put_off", "order_waits_for_charge"].includes(kind);
    if (isPutOff) this.putOff.set(product, kind);
    if (["fetching", "order_cancelled"].includes(kind)) this.putOff.delete(product);
    if (kind === "queue_cleared") this.putOff.clear();
    if (isIts && (isPutOff || kind === "order_cancelled")) this.now = null;
  }
}
