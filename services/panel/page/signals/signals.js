// The view of signals: lanes with one time axis and one cursor, and what stands beside them. It is a script of
// its own, which comes when somebody opens the view first (later.js).

import { Histogram, Losses } from "./aside.js";
import { Figures } from "./figures.js";
import { Lane } from "./lane.js";
import { LANES, timeOfDay } from "./lanes.js";
import { readColours } from "./plot.js";
import { Span, WINDOWS_MS } from "./span.js";
import { put, say, span as inWords, translate } from "../words/words.js";

/** How far a key moves the cursor, as a part of the width. */
const STEP = 0.01;
/** What stands beside the lanes is drawn so often, in ms. */
const ASIDE_MS = 1_000;

/** A time as short as it is clear. */
function brief(ms) {
  return ms < 60_000 ? `${Math.round(ms / 1_000)} s` : inWords(ms);
}

/** An element in another one, with properties. */
function add(parent, tag, properties = {}) {
  const element = Object.assign(document.createElement(tag), properties);
  parent.append(element);
  return element;
}

export class Signals {
  /**
   * @param {HTMLElement} parent
   * @param {() => boolean} isArmed whether the keys drive the robot
   */
  constructor(parent, isArmed) {
    this.isArmed = isArmed;
    this.span = new Span();
    /** @type {Figures | null} */
    this.figures = null;
    /** What was drawn last, so that nothing is drawn twice. */
    this.drawn = "";
    this.drawnAside = -Infinity;
    /** Where the keys have put the cursor. */
    this.part = null;
    this.at = null;
    this.now = 0;
    this.tools(add(parent, "div", { className: "tools" }));
    this.said = add(parent, "p", { className: "said", role: "status" });
    const columns = add(parent, "div", { className: "columns" });
    this.lanesPlace(add(columns, "div", { id: "lanes", tabIndex: 0 }));
    const aside = add(columns, "aside");
    const cursor = add(aside, "section");
    this.cursorTitle = add(cursor, "h3");
    this.cursorTime = add(cursor, "p", { className: "time" });
    this.histogram = new Histogram(add(aside, "section", { className: "histogram" }));
    this.losses = new Losses(add(aside, "section", { className: "losses" }));
    addEventListener("keydown", (event) => this.key(event, parent));
    translate(parent);
  }

  /** The buttons above the lanes. */
  tools(place) {
    const button = (parent, act, data) => {
      const element = add(parent, "button", { type: "button", onclick: act });
      Object.assign(element.dataset, data);
      return element;
    };
    add(place, "h2").dataset.word = "signals";
    this.tag = add(place, "span", { className: "tag", hidden: true });
    this.pauseButton = button(place, () => this.pause(), {});
    this.pauseWord = add(this.pauseButton, "span");
    add(this.pauseButton, "kbd", { textContent: "P" });
    const windows = add(place, "div", { className: "choice", role: "group" });
    windows.dataset.label = "time_window";
    this.windows = WINDOWS_MS.map((ms) => {
      const choose = button(windows, () => this.span.choose(ms), { ms });
      choose.textContent = brief(ms);
      return choose;
    });
    button(place, () => this.grow(0.5), { title: "zoom_in" }).textContent = "+";
    button(place, () => this.grow(2), { title: "zoom_out" }).textContent = "\u2212";
    this.back = button(place, () => this.span.back(), { word: "zoom_back" });
    this.back.id = "zoom-back";
    this.pauseButton.id = "pause";
  }

  /** The lanes, which share a cursor that keys move, too. */
  lanesPlace(place) {
    this.place = place;
    place.role = "group";
    place.dataset.label = "lanes_how";
    const shared = {
      zoom: (from, to) => this.span.zoom(this.now, { from, to }),
      back: () => this.span.back(),
      moved: (at) => this.tellCursor(at),
    };
    this.lanes = LANES.map((lane, index) => new Lane(place, lane, { ...shared, isLast: index === LANES.length - 1 }));
    place.addEventListener("keydown", (event) => {
      const { part } = this;
      const to = { ArrowLeft: (part ?? 1) - STEP, ArrowRight: (part ?? 1) + STEP, Home: 0, End: 1 }[event.key];
      if (to === undefined || this.isArmed()) return;
      event.preventDefault();
      this.part = Math.min(1, Math.max(0, to));
      for (const lane of this.lanes) lane.point(this.part);
    });
    place.addEventListener("pointermove", () => (this.part = null));
    place.addEventListener("blur", () => this.part !== null && this.lanes.forEach((lane) => lane.point((this.part = null))));
  }

  /** P holds the picture and lets it go on, unless the keys drive the robot or somebody writes. */
  key(event, view) {
    const { key, repeat, ctrlKey, altKey, metaKey, target } = event;
    if (key.toLowerCase() !== "p" || repeat || ctrlKey || altKey || metaKey) return;
    if (view.hidden || this.isArmed() || target.matches?.("input, select, textarea")) return;
    this.pause();
  }

  pause() {
    this.span.pause(this.now);
  }

  grow(times) {
    this.span.grow(this.now, times, this.at);
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
   * Draws what has changed; `now` is this page's clock.
   *
   * @param {any} robot
   * @param {number} now
   */
  draw(robot, now) {
    if (!robot) return put(this.said, say("no_robot"));
    if (this.figures?.robot !== robot) {
      this.figures = new Figures(robot);
      this.span = Object.assign(new Span(), { ms: this.span.ms });
      this.drawnAside = -Infinity;
    }
    const { figures, span } = this;
    if (!span.held) figures.follow(now);
    const time = figures.time(now);
    const isFetched = figures.isAsked && !figures.why && "history_fetched";
    put(this.said, isFetched || figures.why ? say(isFetched || figures.why) : "");
    this.drawTools(time);
    if (time === null) return;
    this.now = time;
    const isNewLook = readColours(this.place);
    this.drawLanes(figures.columns, span.range(time), isNewLook);
    // What is held stays.
    if (span.held && !isNewLook) return;
    if (now - this.drawnAside < ASIDE_MS && !isNewLook) return;
    this.drawnAside = now;
    this.histogram.draw(robot.frames);
    this.losses.draw(figures.columns, time);
  }

  drawTools(time) {
    const { span } = this;
    this.tag.hidden = !span.held;
    if (span.held) put(this.tag, say("paused", brief(Math.max(0, time - span.held.to))));
    put(this.pauseWord, say(span.held ? "go_live" : "pause"));
    for (const choose of this.windows) choose.setAttribute("aria-pressed", Number(choose.dataset.ms) === span.ms);
    this.back.disabled = !span.older.length;
    this.tellCursor(this.at);
  }

  /** Draws the lanes where something would be seen elsewhere. */
  drawLanes(columns, range, isNewLook) {
    const { width, height } = this.lanes[0].box.size;
    const pixel = (range.to - range.from) / Math.max(1, width);
    const look = [Math.floor(range.to / pixel), Math.round(range.from - range.to), width, height, columns.at[0], document.documentElement.lang].join();
    if (look === this.drawn && !isNewLook) return;
    this.drawn = look;
    for (const lane of this.lanes) lane.draw(columns, range);
  }

  /**
   * The time at the cursor, or that there is none.
   *
   * @param {number | null} at
   */
  tellCursor(at) {
    this.at = at;
    put(this.cursorTitle, say(at === null ? "newest" : "at_cursor"));
    const shown = at ?? this.span.range(this.now).to;
    put(this.cursorTime, shown ? `${timeOfDay(shown)}${at === null ? "" : `.${String(Math.floor(at) % 1_000).padStart(3, "0")}`}` : "\u2013");
  }
}
