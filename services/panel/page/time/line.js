// The time line under the map: a slider over what the station keeps. Its right end is now, by the station's clock; times
// are told in the browser's zone.

/** @import { Link } from "../station/link.js" */
/** @import { Entry, Robot } from "../station/robot.js" */
/** @import { Kept } from "./kept.js" */
/** @import { Moment } from "./moment.js" */

import { age } from "../bar/face.js";
import { isText } from "../bar/stop.js";
import { kindOf } from "../log/kinds.js";
import { make, set } from "../parts/svg.js";
import { clock, put, say, span } from "../words/words.js";
import { SPANS_MS } from "./kept.js";

/** A press of an arrow goes this far, and a page key ten times as far, in ms. */
const STEPS_MS = [1_000, 5_000, 60_000];
/** @type {Partial<Record<string, number>>} */
const KEYS = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 };
/**
 * What a letter goes to: the next thing that happened, or the one before.
 *
 * @type {Partial<Record<string, number>>}
 */
const WAYS = { j: 1, k: -1 };
/** Nearer to the right end than this, in pixels, it is now. */
const NOW_PX = 8;
/** The line's height, and where its ticks stand, in pixels. */
const [HEIGHT, BASE] = [32, 22];
/** @typedef {"goods" | "help" | "stop"} Mark */
/**
 * The marks, each with its shape about a point above the line: what is graver stands on top.
 *
 * @type {Record<Mark, (x: number) => string>}
 */
const MARKS = {
  goods: (x) => `M${x - 3.5} 5.5h7v7h-7z`,
  help: (x) => `M${x} 4.5l5.5 9h-11z`,
  stop: (x) => `M${x - 2} 4h4l3 3v4l-3 3h-4l-3-3v-4z`,
};
/** The line's ends are so far inside, in pixels, so that no mark is cut. */
const INSET = 7;
/** Two events within this time are one step, in ms. */
const STEP_MS = 20;

/**
 * Which mark an entry has; null if it has none.
 *
 * @param {Entry} entry
 * @returns {Mark | null}
 */
function markOf(entry) {
  if (entry.kind !== "event") return null;
  if (entry.words[0] === "stopped") return "stop";
  if (entry.words[0] === "item_delivered") return "goods";
  return kindOf(entry) === "help" ? "help" : null;
}

export class TimeLine {
  /**
   * @param {Link} link
   * @param {Record<"line" | "slider" | "from" | "tag", HTMLElement> & { choice: HTMLSelectElement }
   *   & Record<"before" | "after" | "now", HTMLButtonElement>} parts
   * @param {{ kept: Kept, moment: Moment, robot: () => Robot | null }} of what has happened, what is shown, and the robot
   *   in view
   */
  constructor(link, parts, { kept, moment, robot }) {
    this.link = link;
    this.parts = parts;
    this.kept = kept;
    this.moment = moment;
    this.robot = robot;
    const { slider, choice, before, after, now } = parts;
    choice.replaceChildren(...SPANS_MS.map((ms) => new Option(span(ms), String(ms))));
    this.svg = make("svg", { "aria-hidden": "true", height: HEIGHT }, slider);
    this.ticks = make("path", { class: "ticks" }, this.svg);
    this.marks = {
      goods: make("path", { class: "mark-goods" }, this.svg),
      help: make("path", { class: "mark-help" }, this.svg),
      stop: make("path", { class: "mark-stop" }, this.svg),
    };
    this.handle = make("rect", { class: "handle", y: 14, width: 6, height: 16, rx: 2 }, this.svg);
    this.width = 0;
    /** Whether the station keeps a history, as far as is known. */
    this.isKept = true;
    /**
     * Of which robot the marks were asked for.
     *
     * @type {string | null}
     */
    this.asked = null;
    /** What was drawn last. */
    this.shown = "";
    new ResizeObserver(([entry]) => entry && (this.width = Math.round(entry.contentRect.width))).observe(slider);
    slider.addEventListener("keydown", (event) => this.key(event));
    slider.addEventListener("pointerdown", (event) => {
      slider.setPointerCapture(event.pointerId);
      this.drag(event);
    });
    slider.addEventListener("pointermove", (event) => slider.hasPointerCapture(event.pointerId) && this.drag(event));
    before.onclick = () => this.step(-1);
    after.onclick = () => this.step(1);
    now.onclick = () => moment.back();
    // While somebody drives, no letter is a shortcut.
    addEventListener("keydown", (event) => {
      const way = WAYS[event.key.toLowerCase()];
      const isTyped = isText(event.target) || event.target instanceof HTMLSelectElement;
      if (way && !isTyped && !event.ctrlKey && !event.altKey && !event.metaKey && !moment.isArmed() && !parts.line.hidden) this.step(way);
    });
    link.addEventListener("link", () => (this.asked = null));
  }

  get span() {
    return Number(this.parts.choice.value);
  }

  /**
   * Shows the moment under the pointer.
   *
   * @param {PointerEvent} event
   */
  drag({ clientX }) {
    const { left, width } = this.parts.slider.getBoundingClientRect();
    const x = Math.max(0, Math.min(width, clientX - left));
    if (x > width - INSET - NOW_PX) this.moment.back();
    else this.moment.go(this.link.now() - Math.min(1, (width - INSET - x) / (width - 2 * INSET)) * this.span);
    this.draw(this.robot());
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (this.moment.isArmed() || event.ctrlKey || event.altKey || event.metaKey) return;
    const step = STEPS_MS[SPANS_MS.indexOf(this.span)] ?? 0;
    const by = (KEYS[event.key] ?? 0) * step;
    const now = this.link.now();
    if (by) this.moment.go(Math.max(now - this.span, (this.moment.at ?? now) + by));
    else if (event.key === "Home") this.moment.go(now - this.span + step);
    else if (event.key === "End") this.moment.back();
    else return;
    event.preventDefault();
    this.draw(this.robot());
  }

  /**
   * To the next thing that happened, or the one before.
   *
   * @param {number} way
   */
  step(way) {
    const all = this.kept.all(this.robot());
    const from = this.moment.at ?? Infinity;
    const next = way < 0 ? all.findLast(({ at }) => at < from - STEP_MS) : all.find(({ at }) => at > from + STEP_MS);
    if (next) this.moment.go(next.at);
    else if (way > 0) this.moment.back();
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    const { line, from, choice } = this.parts;
    if (robot && this.asked !== robot.name && this.link.open) {
      this.asked = robot.name;
      this.kept.marks(robot).then((isKept) => (this.isKept = isKept));
    }
    line.toggleAttribute("hidden", !robot || !this.isKept);
    document.body.classList.toggle("past", this.moment.isShown);
    this.tag();
    if (line.hidden || !this.width) return;
    const now = this.link.now();
    const { at } = this.moment;
    // A row of the log may be older than what the line shows.
    const wide = at === null ? 0 : SPANS_MS.find((ms) => now - at < ms) ?? 0;
    if (wide > this.span) choice.value = String(wide);
    const { width, span } = this;
    put(from, clock(now - span).slice(0, 5));
    const all = this.kept.all(robot);
    const shown = [robot?.name, width, span, Math.floor((now * width) / span), all.length, all.at(-1)?.at, this.kept.marked?.length, at].join();
    if (this.shown === shown) return;
    this.shown = shown;
    set(this.svg, "width", width);
    /** @param {number} then */
    const place = (then) => INSET + (width - 2 * INSET) * (1 - (now - then) / span);
    this.drawMarks(all, place);
    const x = Math.max(INSET, Math.min(width - INSET, place(at ?? now)));
    set(this.handle, "x", (x - 3).toFixed(1));
    this.tell(at, now);
  }

  /**
   * @param {Entry[]} all
   * @param {(then: number) => number} place
   */
  drawMarks(all, place) {
    /** @type {Record<Mark, string>} */
    const paths = { goods: "", help: "", stop: "" };
    /**
     * Where many things happened at once, one tick says it.
     *
     * @type {Set<number>}
     */
    const ticks = new Set();
    const first = all[0]?.at ?? Infinity;
    for (const entry of [...(this.kept.marked ?? []).filter(({ at }) => at < first), ...all]) {
      const x = Math.round(place(entry.at));
      if (x < INSET || x > this.width - INSET) continue;
      ticks.add(x);
      const mark = markOf(entry);
      if (mark && !paths[mark].includes(MARKS[mark](x))) paths[mark] += MARKS[mark](x);
    }
    set(this.ticks, "d", `M${INSET} ${BASE}H${this.width - INSET}${[...ticks].map((x) => `M${x}.5 ${BASE - 4}v8`).join("")}`);
    set(this.marks.goods, "d", paths.goods);
    set(this.marks.help, "d", paths.help);
    set(this.marks.stop, "d", paths.stop);
  }

  /**
   * The slider's value, for who does not see it: seconds from its left end.
   *
   * @param {number | null} at
   * @param {number} now
   */
  tell(at, now) {
    const { slider } = this.parts;
    const seconds = this.span / 1_000;
    set(slider, "aria-valuemin", 0);
    set(slider, "aria-valuemax", seconds);
    set(slider, "aria-valuenow", at === null ? seconds : Math.max(0, Math.round(seconds - (now - at) / 1_000)));
    set(slider, "aria-valuetext", at === null ? say("time_now") : say("moment", clock(at)));
    set(slider, "aria-disabled", String(this.moment.isArmed()));
    this.parts.now.toggleAttribute("disabled", at === null);
  }

  /** Over the map: that it shows the past, which moment, and what the robot did then. */
  tag() {
    const { tag } = this.parts;
    const { at, past, why, isShown } = this.moment;
    const [when, what] = tag.children;
    tag.toggleAttribute("hidden", !isShown);
    if (at === null || !isShown || !when || !what) return;
    put(when, say("moment_ago", clock(at), age(this.link.now() - at)));
    put(what, why ? say(why) : !past ? "" : Number.isFinite(past.stated) ? this.moment.face().said ?? "" : say("moment_none"));
  }
}
