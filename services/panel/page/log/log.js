// What has happened: each with its time, its kind, a sentence and its place. A row shows its moment on the map, on the
// time line and in the strips.

/** @import { Entry, Robot } from "../station/robot.js" */
/** @import { Kept } from "../time/kept.js" */
/** @import { Moment } from "../time/moment.js" */

import { KINDS, kindOf, placeOf, told } from "./kinds.js";
import { item } from "../parts/list.js";
import { crossing } from "../words/sentences.js";
import { clock, current, put, say } from "../words/words.js";
import { make } from "../parts/svg.js";

/** So many rows are shown at first, and so many more when somebody asks for them. */
const ROWS = 200;
/** @type {Partial<Record<string, number>>} */
const STEPS = { ArrowDown: 1, ArrowUp: -1 };

/**
 * An entry as it is shown; `words` are what the filter looks at.
 *
 * @typedef {{ entry: Entry, button: HTMLButtonElement, element: HTMLLIElement, language: string, words: string }} Row
 */

export class Log {
  /**
   * @param {{ filter: HTMLInputElement, earlier: HTMLButtonElement }
   *   & Record<"panel" | "map" | "kinds" | "entries" | "said", HTMLElement>} parts
   * @param {{ kept: Kept, moment: Moment, robot: () => Robot | null }} of what has happened, what is shown, and the robot
   *   in view
   */
  constructor(parts, { kept, moment, robot }) {
    this.parts = parts;
    this.kept = kept;
    this.moment = moment;
    this.robot = robot;
    /**
     * The kinds that are shown; none: all of them.
     *
     * @type {Set<string>}
     */
    this.kinds = new Set();
    /** @type {WeakMap<Entry, Row>} */
    this.rows = new WeakMap();
    /** @type {Row[]} */
    this.shownRows = [];
    this.most = ROWS;
    /** Whether more is known than is shown. */
    this.hasMore = false;
    /**
     * The entry whose row was chosen last.
     *
     * @type {Entry | null}
     */
    this.chosen = null;
    this.choices = 0;
    /** What was drawn last. */
    this.shown = "";
    /**
     * The moment that was drawn last.
     *
     * @type {number | null}
     */
    this.drawnAt = null;
    this.all = this.chip("log_all", () => this.kinds.clear());
    this.chips = Object.entries(KINDS).map(([kind, [word, shape]]) => ({ kind, ...this.chip(word, () => this.kinds.delete(kind) || this.kinds.add(kind), shape) }));
    parts.earlier.onclick = () => this.earlier();
    parts.entries.addEventListener("keydown", (event) => this.key(event));
  }

  /**
   * A button of the filter, and where it says how many it stands for.
   *
   * @param {string} name its word
   * @param {() => void} act
   * @param {string} [shape]
   */
  chip(name, act, shape) {
    const chip = document.createElement("button");
    chip.type = "button";
    const [word, count] = [document.createElement("span"), document.createElement("b")];
    word.dataset.word = name;
    put(word, say(name));
    if (shape) chip.append(icon(shape));
    chip.append(word, " ", count);
    chip.onclick = act;
    this.parts.kinds.append(chip);
    return { chip, count };
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    const { filter, entries, earlier, panel } = this.parts;
    // Nobody reads it while another view is open.
    if (panel.hidden) return;
    const all = this.kept.all(robot);
    const shown = [robot?.name, all.length, all[0]?.at, all.at(-1)?.at, filter.value, [...this.kinds], this.most, current(), this.moment.at, this.choices].join();
    earlier.toggleAttribute("disabled", !robot || this.kept.isFetching);
    if (this.shown === shown) return;
    this.shown = shown;
    const kinds = all.map(kindOf);
    press(this.all, !this.kinds.size, all.length);
    for (const { kind, ...chip } of this.chips) press(chip, this.kinds.has(kind), kinds.filter((one) => one === kind).length);
    const words = filter.value.toLowerCase();
    const wanted = all.filter((entry) => (!this.kinds.size || this.kinds.has(kindOf(entry))) && (!words || this.row(entry).words.includes(words)));
    this.hasMore = wanted.length > this.most;
    earlier.toggleAttribute("hidden", !this.hasMore && this.kept.isAll);
    this.fill(wanted.slice(-this.most).reverse().map((entry) => this.row(entry)));
    // The one that was chosen, of several at once, or else the last one that had happened by then.
    const at = this.moment.at;
    const now = at === null ? null : wanted.find((entry) => entry === this.chosen && entry.at === at) ?? wanted.findLast((entry) => entry.at <= at);
    for (const row of this.shownRows) {
      row.button.classList.toggle("later", at !== null && row.entry.at > at);
      if (row.entry === now) row.button.setAttribute("aria-current", "true");
      else row.button.removeAttribute("aria-current");
    }
    if (this.drawnAt !== at && now) this.reveal(this.row(now).element);
    this.drawnAt = at;
    if (!this.shownRows.length) entries.replaceChildren(item(say("log_empty")));
  }

  /**
   * Only what is new is put in: what has the focus keeps it.
   *
   * @param {Row[]} rows
   */
  fill(rows) {
    const { entries } = this.parts;
    if (!this.shownRows.length) entries.replaceChildren();
    this.shownRows = rows;
    /** @type {Set<Element>} */
    const kept = new Set(rows.map(({ element }) => element));
    for (const element of [...entries.children]) if (!kept.has(element)) element.remove();
    rows.forEach(({ element }, index) => {
      if (entries.children[index] !== element) entries.insertBefore(element, entries.children[index] ?? null);
    });
    // One of them is reached by the Tab key, and the arrows go on from there.
    const focused = rows.find(({ button }) => button === document.activeElement) ?? rows[0];
    for (const { button } of rows) button.tabIndex = button === focused?.button ? 0 : -1;
  }

  /**
   * Scrolls the list, and not the page, until a row is seen.
   *
   * @param {HTMLElement} row
   */
  reveal({ offsetTop: top, offsetHeight: height }) {
    const { entries } = this.parts;
    if (top < entries.scrollTop) entries.scrollTop = top;
    else if (top + height > entries.scrollTop + entries.clientHeight) entries.scrollTop = top + height - entries.clientHeight;
  }

  /**
   * @param {Entry} entry
   * @returns {Row}
   */
  row(entry) {
    let row = this.rows.get(entry);
    if (row?.language === current()) return row;
    const kind = kindOf(entry);
    const [time, word, sentence, place] = [clock(entry.at), say(KINDS[kind][0]), told(entry), placeOf(entry)];
    const button = document.createElement("button");
    button.type = "button";
    button.className = "entry";
    button.dataset.kind = kind;
    /** @type {<Name extends "b" | "small" | "span" | "time">(text: string, name: Name) => HTMLElementTagNameMap[Name]} */
    const cell = (text, name) => Object.assign(document.createElement(name), { textContent: text });
    const when = cell(time, "time");
    when.dateTime = new Date(entry.at).toISOString();
    button.append(when, icon(KINDS[kind][1]), cell(word, "b"), " ", cell(sentence, "span"), " ", cell(place, "small"));
    button.onclick = () => {
      this.chosen = entry;
      this.choices += 1;
      this.moment.go(entry.at);
      // In the hand the map may be out of sight.
      this.parts.map.scrollIntoView({ block: "nearest" });
    };
    const element = document.createElement("li");
    element.append(button);
    row = { entry, button, element, language: current(), words: `${time} ${word} ${sentence} ${place} ${crossing(place || undefined)}`.toLowerCase() };
    this.rows.set(entry, row);
    return row;
  }

  /**
   * The arrows go from row to row, while they do not drive.
   *
   * @param {KeyboardEvent} event
   */
  key(event) {
    const step = STEPS[event.key];
    const at = this.shownRows.findIndex(({ button }) => button === event.target);
    const [row, next] = [this.shownRows[at], step ? this.shownRows[at + step] : undefined];
    if (!row || !next || this.moment.isArmed()) return;
    event.preventDefault();
    row.button.tabIndex = -1;
    next.button.tabIndex = 0;
    next.button.focus();
  }

  /** Shows what happened before; what the page does not hold is asked of the station. */
  async earlier() {
    const robot = this.robot();
    if (!robot) return;
    put(this.parts.said, "");
    this.most += ROWS;
    if (this.hasMore) return;
    const refused = await this.kept.earlier(robot);
    if (refused) put(this.parts.said, say(refused));
    else if (this.kept.isAll) put(this.parts.said, say("log_no_earlier"));
  }
}

/**
 * @param {{ chip: HTMLButtonElement, count: HTMLElement }} chip
 * @param {boolean} isPressed
 * @param {number} many
 */
function press({ chip, count }, isPressed, many) {
  chip.ariaPressed = String(isPressed);
  put(count, String(many));
}

/** @param {string} shape */
function icon(shape) {
  const svg = make("svg", { viewBox: "0 0 20 20", "aria-hidden": "true" });
  make("path", { d: shape }, svg);
  return svg;
}
