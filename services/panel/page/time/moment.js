// The moment that map, strips and log show: now, or a past one that the station tells of. A past robot is made of the
// same lines by the same code as the live one, so that the same functions draw it.
//
// Orders go to the live robot. So nobody orders by a map that shows the past, and who drives by hand sees what is now.
// The address keeps the moment, in UTC, so a page that is loaded anew, and whoever is sent the address, sees the same.

/** @import { Told } from "../station/history.js" */
/** @import { Link } from "../station/link.js" */

import { face } from "../bar/face.js";
import { lines, why } from "../station/history.js";
import { report } from "../station/report.js";
import { Robot, SPAN_MS } from "../station/robot.js";

/** States are kept once a second at least; of one that is older, the robot was not heard then. */
const HEARD_MS = 2_500;
/** So long a moment is looked at before the minute before it is asked for, in ms. */
const REST_MS = 200;
/** What is refused because others ask is asked again after this time, in ms. */
const AGAIN_MS = 400;

/** @param {number} ms */
const pause = (ms) =>
  new Promise((end) => {
    setTimeout(end, ms);
  });

/**
 * A robot as it was at a moment.
 *
 * @param {Robot} live the robot, which knows what has happened
 * @param {Told[]} told what the station tells of it
 * @param {number} at the moment in ms since 1970
 * @param {number} ahead how far that clock is ahead of the page's
 * @returns {Robot}
 */
function robotOf(live, told, at, ahead) {
  const robot = new Robot(live.name);
  robot.connected = robot.speaks = true;
  for (const { at_ms: then, line } of [...told].sort((a, b) => a.at_ms - b.at_ms)) {
    const [word, ...rest] = line.split(" ");
    report(robot, word ?? "", rest, then - ahead, then);
  }
  const now = at - ahead;
  if (now - robot.stated < HEARD_MS) robot.stated = now;
  robot.heard = robot.stated;
  robot.events = live.events.filter((entry) => entry.at <= at);
  for (const entry of robot.events) robot.jobs.take(entry);
  return robot;
}

export class Moment {
  /**
   * @param {Link} link
   * @param {() => Robot | null} live the robot in view
   * @param {() => boolean} isArmed whether somebody drives it by hand from this page
   */
  constructor(link, live, isArmed) {
    this.link = link;
    this.live = live;
    this.isArmed = isArmed;
    /**
     * The moment that is wanted, in ms since 1970; null is now.
     *
     * @type {number | null}
     */
    this.at = null;
    /**
     * The past robot, the time that it is of by this page's clock, and the word for why there is none.
     *
     * @type {Robot | null}
     */
    this.past = null;
    this.then = 0;
    /** @type {string | null} */
    this.why = null;
    this.isLoading = false;
    this.isNew = false;
    link.addEventListener("link", () => link.open && !this.past && (this.why = null));
    const kept = Date.parse(decodeURIComponent(location.hash.replace(/^#at=/, "")));
    if (Number.isFinite(kept)) this.at = kept;
  }

  /** Whether the past is wanted: shown, or on its way. */
  get isPast() {
    return this.at !== null;
  }

  /** Whether the past is shown, or why it is not. */
  get isShown() {
    return this.at !== null && Boolean(this.past || this.why);
  }

  /**
   * Shows a moment; one that is not over yet is now.
   *
   * @param {number} at in ms since 1970
   */
  go(at) {
    if (this.isArmed() || at >= this.link.now()) return this.back();
    if (at === this.at) return;
    this.at = Math.round(at);
    this.isNew = true;
    this.load();
  }

  /** Shows what is now. */
  back() {
    if (this.at === null) return;
    this.at = this.past = this.why = null;
    keep(null);
  }

  /**
   * The robot to be drawn, and the time by this page's clock for which it is drawn.
   *
   * @param {Robot | null} live
   * @param {number} now
   * @returns {[Robot | null, number]}
   */
  shown(live, now) {
    if (this.at === null) return [live, now];
    if (this.isArmed()) {
      this.back();
      return [live, now];
    }
    // One that was in the address, or of another robot than before.
    if (live && !this.isLoading && this.past?.name !== live.name && !this.why) {
      this.isNew = true;
      this.load();
    }
    if (this.past) return [this.past, this.then];
    return this.why ? [null, now] : [live, now];
  }

  /** The look of the past robot's state, in the words of the bar. */
  face() {
    const link = { open: true, me: this.link.me, tries: 0, closed: null, now: () => this.then + this.link.ahead };
    return face(link, this.past, this.then);
  }

  /** Asks for what is wanted, one answer at a time; of several wishes meanwhile only the last one counts. */
  async load() {
    if (this.isLoading) return;
    this.isLoading = true;
    while (this.at !== null && this.isNew) {
      const live = this.live();
      // Once it is here, `shown` asks.
      if (!live) break;
      this.isNew = false;
      try {
        await this.ask(live, this.at);
        this.why = null;
      } catch (error) {
        const busy = why(error) === "history_busy";
        if (busy) await pause(AGAIN_MS);
        if (busy) this.isNew = true;
        else [this.past, this.why] = [null, why(error)];
      }
    }
    this.isLoading = false;
    if (this.at === null) this.past = this.why = null;
  }

  /**
   * @param {Robot} live
   * @param {number} at
   */
  async ask(live, at) {
    const robot = live.name;
    const told = await lines("moment", { robot, at });
    this.show(live, told, at);
    await pause(REST_MS);
    if (this.isNew || this.at !== at) return;
    keep(at);
    // The state of the moment itself is told already.
    const before = (await lines("lines", { robot, since: at - SPAN_MS, until: at })).filter(({ at_ms: then, line }) => !told.some((one) => one.at_ms === then && one.line === line));
    this.show(live, [...before, ...told], at);
  }

  /**
   * @param {Robot} live
   * @param {Told[]} told
   * @param {number} at
   */
  show(live, told, at) {
    if (this.at === null) return;
    // The clock may be set while this is shown.
    const { ahead } = this.link;
    this.past = robotOf(live, told, at, ahead);
    this.then = at - ahead;
  }
}

/**
 * Keeps the moment in the address.
 *
 * @param {number | null} at
 */
function keep(at) {
  history.replaceState(null, "", location.pathname + location.search + (at === null ? "" : `#at=${new Date(at).toISOString()}`));
}
