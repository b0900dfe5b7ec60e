// The view of signals: lanes with one time axis and one cursor, and what stands beside them. It is a script of
// its own, which comes when somebody opens the view first (later.js).

import { add } from "./add.js";
import { Histogram, Losses } from "./aside.js";
import { Figures } from "./figures.js";
import { Lane } from "./lane.js";
import { LANES, timeOfDay } from "./lanes.js";
import { readColours } from "./plot.js";
import { Span } from "./span.js";
import { Tools } from "./tools.js";
import { current, put, say, translate } from "../words/words.js";

/** How far a key moves the cursor, as a part of the width. */
const STEP = 0.01;
/** What stands beside the lanes is drawn so often, in ms. */
const ASIDE_MS = 1_000;

export class Signals {
  /**
   * @param {HTMLElement} view
   * @param {() => boolean} isArmed whether the keys drive the robot
   * @param {import("../station/link.js").Link} link
   */
  constructor(view, isArmed, link) {
    this.view = view;
    this.isArmed = isArmed;
    this.link = link;
    this.span = new Span();
    /** @type {Figures | null} */
    this.figures = null;
    /** What was drawn last, so that nothing is drawn twice. */
    this.drawn = "";
    this.drawnAside = -Infinity;
    /**
     * Where keys have put the cursor, as a part of the width.
     *
     * @type {number | null}
     */
    this.part = null;
    /**
     * The time at the cursor, and now, by the station's clock.
     *
     * @type {number | null}
     */
    this.at = null;
    this.now = 0;
    this.tools = new Tools(add(view, "div", { className: "tools" }), {
      pause: () => this.span.pause(this.now),
      choose: (ms) => this.span.choose(ms),
      grow: (times) => this.span.grow(this.now, times, this.at),
      back: () => this.span.back(),
    });
    this.said = add(view, "p", { className: "said", role: "status" });
    const columns = add(view, "div", { className: "columns" });
    this.place = add(columns, "div", { id: "lanes", tabIndex: 0, role: "group" });
    this.place.dataset.label = "lanes_how";
    this.lanes = LANES.map((lane, index) => new Lane(this.place, lane, {
      isLast: index === LANES.length - 1,
      zoom: (from, to) => this.span.zoom(this.now, { from, to }),
      back: () => this.span.back(),
      moved: (at) => this.tellCursor(at),
    }));
    const aside = add(columns, "aside");
    const cursor = add(aside, "section");
    this.cursorTitle = add(cursor, "h3");
    this.cursorTime = add(cursor, "time");
    this.histogram = new Histogram(add(aside, "section", { className: "histogram" }));
    this.losses = new Losses(add(aside, "section", { className: "losses" }));
    this.listen();
    translate(view);
  }

  /** The keys: P holds the picture, arrows move the cursor. While they drive the robot, they do nothing here. */
  listen() {
    addEventListener("keydown", ({ key, repeat, ctrlKey, altKey, metaKey, target }) => {
      if (key.toLowerCase() !== "p" || repeat || ctrlKey || altKey || metaKey) return;
      const isWritten = target instanceof Element && target.matches("input, select, textarea");
      if (!this.view.hidden && !isWritten && !this.isArmed()) this.span.pause(this.now);
    });
    this.place.addEventListener("keydown", (event) => {
      const part = this.part ?? 1;
      const to = new Map([["ArrowLeft", part - STEP], ["ArrowRight", part + STEP], ["Home", 0], ["End", 1]]).get(event.key);
      if (to === undefined || this.isArmed()) return;
      event.preventDefault();
      this.point(Math.min(1, Math.max(0, to)));
    });
    this.place.addEventListener("pointermove", () => (this.part = null));
    this.place.addEventListener("blur", () => this.part !== null && this.point(null));
  }

  /**
   * Puts the cursor of all lanes there, or takes it away.
   *
   * @param {number | null} part
   */
  point(part) {
    this.part = part;
    for (const lane of this.lanes) lane.point(part);
  }

  /**
   * Shows the lane that is called by this word.
   *
   * @param {string} word
   */
  show(word) {
    const found = this.lanes.find(({ lane }) => lane.word === word);
    found?.element.focus();
    found?.element.scrollIntoView({ block: "nearest" });
  }

  /**
   * Draws what has changed.
   *
   * @param {import("../station/robot.js").Robot | null} robot
   * @param {number} now by this page's clock
   */
  draw(robot, now) {
    if (!robot) return put(this.said, say("no_robot"));
    if (this.figures?.robot !== robot) {
      const { ms } = this.span;
      this.span = Object.assign(new Span(), { ms });
      this.figures = new Figures(robot, this.link);
      this.drawnAside = -Infinity;
    }
    const { figures, span } = this;
    if (!span.held) figures.follow(now);
    const why = figures.why ?? (figures.isAsked ? "history_fetched" : null);
    put(this.said, why ? say(why) : "");
    const time = now + this.link.ahead;
    this.now = time;
    this.tools.draw(span, time);
    this.tellCursor(this.at);
    const isNewLook = readColours(this.place);
    this.drawLanes(figures.columns, span.range(time), isNewLook);
    // What is held stays.
    if (!isNewLook && (span.held || now - this.drawnAside < ASIDE_MS)) return;
    this.drawnAside = now;
    this.histogram.draw(robot.frames);
    this.losses.draw(figures.columns, time);
  }

  /**
   * Draws the lanes where something would be seen elsewhere.
   *
   * @param {import("./figures.js").Columns} columns
   * @param {import("./span.js").Range} range
   * @param {boolean} isNewLook
   */
  drawLanes(columns, range, isNewLook) {
    const { width, height } = this.place.getBoundingClientRect();
    const pixel = (range.to - range.from) / Math.max(1, width);
    const look = [Math.floor(range.to / pixel), Math.round(range.to - range.from), width, height, columns.at[0], current()].join();
    if (look === this.drawn && !isNewLook) return;
    this.drawn = look;
    for (const lane of this.lanes) lane.draw(columns, range);
  }

  /**
   * Tells the time at the cursor, or the newest one.
   *
   * @param {number | null} at
   */
  tellCursor(at) {
    this.at = at;
    put(this.cursorTitle, say(at === null ? "newest" : "at_cursor"));
    if (!this.now) return;
    const shown = at ?? this.span.range(this.now).to;
    const ms = at === null ? "" : `.${String(Math.floor(at) % 1_000).padStart(3, "0")}`;
    put(this.cursorTime, timeOfDay(shown) + ms);
    this.cursorTime.dateTime = new Date(shown).toISOString();
  }
}
