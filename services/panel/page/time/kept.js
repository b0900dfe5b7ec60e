// What has happened to the robot in view: what the station tells a page, and what was fetched of the time before that.

/** @import { Link } from "../station/link.js" */
/** @import { Told } from "../station/history.js" */
/** @import { Entry, Robot } from "../station/robot.js" */

import { lines, why } from "../station/history.js";
import { note } from "../station/report.js";

/** The station keeps a day, in ms. */
const DAY_MS = 86_400_000;
/** The spans of it that can be shown and saved, in ms. */
export const SPANS_MS = [600_000, 3_600_000, DAY_MS];
/** So much is fetched at a time. */
const MOST = 500;
/** Told twice, a thing may be this much earlier or later, in ms: the ways of the two answers differ. */
const SAME_MS = 500;
/** What has a mark on the time line. */
const MARKED = "stopped,item_delivered,failed,pickup_refused,refused";

/** @type {(a: Entry, b: Entry) => boolean} */
const isSame = (a, b) => Math.abs(a.at - b.at) < SAME_MS && a.kind === b.kind && String(a.words) === String(b.words);

/**
 * Two lists in one, each by its times: of the older one, what is before the newer one.
 *
 * @param {Entry[]} older
 * @param {Entry[]} newer
 * @returns {Entry[]}
 */
function joined(older, newer) {
  if (!older.length) return newer;
  const from = newer[0]?.at ?? Infinity;
  const near = newer.filter(({ at }) => at < from + 2 * SAME_MS);
  return [...older.filter((one) => one.at < from + SAME_MS && !near.some((other) => isSame(one, other))), ...newer].sort((a, b) => a.at - b.at);
}

/**
 * Entries of the log from lines of the station's history.
 *
 * @param {Told[]} told
 * @returns {Entry[]}
 */
export function entries(told) {
  /** @type {Parameters<typeof note>[0]} */
  const past = { thinks: null, happened() {} };
  return told.flatMap(({ at_ms: at, line }) => {
    const [word = "", ...rest] = line.split(" ");
    return note(past, word, rest, at) ?? [];
  });
}

export class Kept {
  /** @param {Pick<Link, "now">} link */
  constructor(link) {
    this.link = link;
    /**
     * The robot of which all this is.
     *
     * @type {string | null}
     */
    this.name = null;
    /** @type {Entry[]} */
    this.fetched = [];
    /**
     * What has a mark on the time line.
     *
     * @type {Entry[] | null}
     */
    this.marked = null;
    /** Whether the station keeps nothing older. */
    this.isAll = false;
    this.isFetching = false;
    /**
     * All of it, and what it was made of.
     *
     * @type {Entry[] | null}
     */
    this.list = null;
    this.held = "";
  }

  /**
   * Everything that is known to have happened to a robot, the oldest first; the same list until it changes.
   *
   * @param {Robot | null} robot
   * @returns {Entry[]}
   */
  all(robot) {
    const name = robot?.name ?? null;
    if (name !== this.name) Object.assign(this, new Kept(this.link), { name });
    const held = robot?.events ?? [];
    const key = [held.length, held[0]?.at, held.at(-1)?.at, this.fetched.length].join();
    if (this.list && this.held === key) return this.list;
    // What the page itself lets go stays with what was fetched.
    if (this.fetched.length) this.fetched = joined(this.fetched, held);
    this.list = this.fetched.length ? this.fetched : [...held];
    this.held = [held.length, held[0]?.at, held.at(-1)?.at, this.fetched.length].join();
    return this.list;
  }

  /**
   * Fetches what happened before all that is known.
   *
   * @param {Robot} robot
   * @returns {Promise<string | null>} the word for why not
   */
  async earlier(robot) {
    if (this.isFetching) return null;
    this.isFetching = true;
    const list = this.all(robot);
    const until = list[0]?.at ?? this.link.now();
    try {
      const told = await lines("events", { robot: robot.name, since: until - DAY_MS, until: until + SAME_MS, most: MOST });
      if (robot.name !== this.name) return null;
      const older = joined(entries(told), list);
      this.isAll = older.length === list.length;
      this.fetched = older;
      return null;
    } catch (error) {
      return why(error);
    } finally {
      this.isFetching = false;
    }
  }

  /**
   * Fetches what has a mark on the time line.
   *
   * @param {Robot} robot
   * @returns {Promise<boolean>} false if the station keeps no history
   */
  async marks(robot) {
    const { name } = robot;
    this.all(robot);
    this.marked ??= [];
    try {
      const now = this.link.now();
      const told = entries(await lines("events", { robot: name, since: now - DAY_MS, until: now, only: MARKED }));
      if (name === this.name) this.marked = told;
      return true;
    } catch (error) {
      return why(error) !== "no_history";
    }
  }
}
