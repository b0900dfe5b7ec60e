// What was delivered, from the station's history: the same for every browser, and after a reload.

/** @import { Delivered } from "../station/jobs.js" */
/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { Jobs } from "../station/jobs.js";
import { lines, why } from "../station/history.js";
import { entries } from "../time/kept.js";
import { crossing, sentence } from "../words/sentences.js";
import { clock, put, say, span } from "../words/words.js";
import { fill, item } from "../parts/list.js";

/** An answer that did not come is asked for again after this time, in ms. */
const AGAIN_MS = 10_000;

/** @type {Delivered[]} */
const NONE = [];

export class Past {
  /**
   * `open` shows `list` with its filters and hides `rest`.
   *
   * @param {Pick<Link, "now">} link
   * @param {Record<"open" | "box" | "rest" | "totals" | "list", HTMLElement> & Record<"goods" | "time", HTMLSelectElement>} parts
   */
  constructor(link, parts) {
    this.link = link;
    this.parts = parts;
    const { open, box, rest, goods, time } = parts;
    open.onclick = () => {
      const isOpen = box.hasAttribute("hidden");
      box.toggleAttribute("hidden", !isOpen);
      rest.toggleAttribute("hidden", isOpen);
      open.ariaExpanded = String(isOpen);
      if (isOpen) this.show();
    };
    for (const filter of [goods, time]) filter.onchange = () => this.show();
    this.jobs = NONE;
    /** @type {Map<string, string>} */
    this.names = new Map();
    /**
     * What is shown, and of which orders.
     *
     * @type {string | null}
     */
    this.shown = null;
    this.shownOf = NONE;
  }

  /**
   * The goods that can be chosen.
   *
   * @param {Map<string, string>} names by their numbers
   */
  setNames(names) {
    this.names = names;
    this.shown = null;
    const { goods } = this.parts;
    const { value } = goods;
    const all = new Option(say("past_goods"), "");
    all.dataset.word = "past_goods";
    goods.replaceChildren(all, ...[...names].map(([id, name]) => new Option(name, id)));
    if (names.has(value)) goods.value = value;
  }

  /**
   * @param {Robot | null} robot
   * @param {number} now
   */
  draw(robot, now) {
    this.jobs = robot?.jobs.done ?? NONE;
    // The newest come first.
    const other = this.jobs.findIndex((job) => !this.isToday(job));
    const today = other < 0 ? this.jobs.length : other;
    put(this.parts.open, this.parts.box.hidden ? say("past_open", today) : say("past_close"));
    if (robot && now - robot.jobs.recalled > AGAIN_MS) recall(robot, now);
    this.show();
  }

  /**
   * Today by the station's clock.
   *
   * @param {Delivered} job
   */
  isToday({ at }) {
    return at >= new Date(this.link.now()).setHours(0, 0, 0, 0);
  }

  show() {
    const { goods, time, totals, list } = this.parts;
    const shown = [goods.value, time.value, this.jobs.length, this.jobs[0]?.at, new Date(this.link.now()).getDate(), document.documentElement.lang].join();
    if (this.shown === shown && this.shownOf === this.jobs) return;
    this.shown = shown;
    this.shownOf = this.jobs;
    const jobs = this.jobs.filter((job) => (!goods.value || job.product === goods.value) && (time.value !== "today" || this.isToday(job)));
    const all = this.jobs.filter((job) => !goods.value || job.product === goods.value);
    put(totals, say("past_totals", all.filter((job) => this.isToday(job)).length, all.length));
    fill(list, jobs.length ? jobs.map((job) => delivered(job, this.names)) : [say("history_empty")], (line) => item(line));
  }
}

/**
 * Puts together what the station's history tells of a robot and what this page has heard.
 *
 * @param {Robot} robot
 * @param {number} now
 */
async function recall(robot, now) {
  const { jobs } = robot;
  jobs.recalled = now;
  try {
    const told = entries(await lines("events", { robot: robot.name, since: 0 }));
    // It has connected anew meanwhile.
    if (robot.jobs !== jobs) return;
    const whole = new Jobs();
    whole.recalled = Infinity;
    // The history's times are exact; what this page has heard adds what came after them.
    for (const entry of [...told, ...robot.events]) whole.take(entry);
    robot.jobs = whole;
  } catch (error) {
    // A station without a history has none later either.
    if (why(error) === "no_history") jobs.recalled = Infinity;
  }
}

/**
 * One delivery as a line: when, what, how long it took, and which ways were blocked on it.
 *
 * @param {Delivered} job
 * @param {Map<string, string>} names
 */
function delivered({ product, at, began, detours }, names) {
  const name = names.get(product) ?? product;
  const words = [clock(at), began === undefined ? name : say("took", name, span(at - began))];
  const ways = detours.map(({ node, looks }) => `${crossing(node)} ${sentence(`looks_${looks}`) ?? ""}`.trim());
  if (ways.length) words.push(say("detours", ways.join("; ")));
  return words.join("  ");
}
