// What has happened: each with its time, its kind, a sentence and its place. A row shows its moment on the map, on the
// time line and in the strips.

import { KINDS, kindOf, placeOf, told } from "./kinds.js";
import { item } from "../parts/list.js";
import { crossing } from "../words/sentences.js";
import { clock, current, put, say } from "../words/words.js";
import { make } from "../parts/svg.js";

/** So many rows are shown at first, and so many more when somebody asks for them. */
const ROWS = 200;

export class Log {
  /** `kept` knows what has happened, `moment` what is shown. */
  constructor(parts, { kept, moment, robot }) {
    Object.assign(this, { parts, kept, moment, robot });
    /** The kinds that are shown; none: all of them. */
    this.kinds = new Set();
    this.rows = new WeakMap();
    this.most = ROWS;
    /** The entry whose row was chosen last. */
    this.chosen = null;
    this.choices = 0;
    this.chips = new Map();
    for (const kind of ["", ...Object.keys(KINDS)]) this.chip(kind);
    parts.earlier.onclick = () => this.earlier();
    parts.entries.addEventListener("keydown", (event) => this.key(event));
  }

  chip(kind) {
    const chip = document.createElement("button");
    chip.type = "button";
    const [word, count] = [document.createElement("span"), document.createElement("b")];
    word.dataset.word = kind ? KINDS[kind][0] : "log_all";
    put(word, say(word.dataset.word));
    if (kind) chip.append(icon(kind));
    chip.append(word, " ", count);
    chip.onclick = () => {
      if (!kind) this.kinds.clear();
      else if (!this.kinds.delete(kind)) this.kinds.add(kind);
    };
    this.chips.set(kind, { chip, count });
    this.parts.kinds.append(chip);
  }

  draw(robot) {
    const { filter, entries, earlier, panel } = this.parts;
    // Nobody reads it while another view is open.
    if (panel.hidden) return;
    const all = this.kept.all(robot);
    const shown = [robot?.name, all.length, all[0]?.at, all.at(-1)?.at, filter.value, [...this.kinds], this.most, current(), this.moment.at, this.choices].join();
    earlier.disabled = !robot || this.kept.isFetching;
    if (this.shown === shown) return;
    this.shown = shown;
    const counts = {};
    for (const entry of all) counts[kindOf(entry)] = (counts[kindOf(entry)] ?? 0) + 1;
    for (const [kind, { chip, count }] of this.chips) {
      put(count, String(kind ? counts[kind] ?? 0 : all.length));
      chip.setAttribute("aria-pressed", kind ? this.kinds.has(kind) : !this.kinds.size);
    }
    const words = filter.value.toLowerCase();
    const wanted = all.filter((entry) => (!this.kinds.size || this.kinds.has(kindOf(entry))) && (!words || this.row(entry).words.includes(words)));
    this.hasMore = wanted.length > this.most;
    earlier.hidden = !this.hasMore && this.kept.isAll;
    this.fill(wanted.slice(-this.most).reverse().map((entry) => this.row(entry)));
    // The one that was chosen, of several at once, or else the last one that had happened by then.
    const at = this.moment.at;
    const now = at === null ? null : wanted.find((entry) => entry === this.chosen && entry.at === at) ?? wanted.findLast((entry) => entry.at <= at);
    for (const row of this.shownRows) {
      row.button.classList.toggle("later", at !== null && row.at > at);
      if (row.entry === now) row.button.setAttribute("aria-current", "true");
      else row.button.removeAttribute("aria-current");
    }
    if (this.drawnAt !== at && now) this.reveal(this.row(now).element);
    this.drawnAt = at;
    if (!this.shownRows.length) entries.replaceChildren(item(say("log_empty")));
  }

  /** Only what is new is put in: what has the focus keeps it. */
  fill(rows) {
    const { entries } = this.parts;
    if (!this.shownRows?.length) entries.replaceChildren();
    this.shownRows = rows;
    const kept = new Set(rows.map(({ element }) => element));
    for (const element of [...entries.children]) if (!kept.has(element)) element.remove();
    rows.forEach(({ element }, index) => {
      if (entries.children[index] !== element) entries.insertBefore(element, entries.children[index] ?? null);
    });
    // One of them is reached by the Tab key, and the arrows go on from there.
    const focused = rows.find(({ button }) => button === document.activeElement) ?? rows[0];
    for (const { button } of rows) button.tabIndex = button === focused?.button ? 0 : -1;
  }

  /** Scrolls the list, and not the page, until a row is seen. */
  reveal({ offsetTop: top, offsetHeight: height }) {
    const { entries } = this.parts;
    if (top < entries.scrollTop) entries.scrollTop = top;
    else if (top + height > entries.scrollTop + entries.clientHeight) entries.scrollTop = top + height - entries.clientHeight;
  }

  row(entry) {
    let row = this.rows.get(entry);
    if (row?.language === current()) return row;
    const kind = kindOf(entry);
    const [time, word, sentence, place] = [clock(entry.at), say(KINDS[kind][0]), told(entry), placeOf(entry)];
    const button = document.createElement("button");
    button.type = "button";
    button.className = "entry";
    button.dataset.kind = kind;
    const cell = (text, name) => Object.assign(document.createElement(name), { textContent: text });
    const when = cell(time, "time");
    when.dateTime = new Date(entry.at).toISOString();
    button.append(when, icon(kind), cell(word, "b"), " ", cell(sentence, "span"), " ", cell(place, "small"));
    button.onclick = () => {
      this.chosen = entry;
      this.choices += 1;
      this.moment.go(entry.at);
      // In the hand the map may be out of sight.
      this.parts.map.scrollIntoView({ block: "nearest" });
    };
    const element = document.createElement("li");
    element.append(button);
    row = { entry, at: entry.at, button, element, language: current(), words: `${time} ${word} ${sentence} ${place} ${crossing(place || undefined)}`.toLowerCase() };
    this.rows.set(entry, row);
    return row;
  }

  /** The arrows go from row to row, while they do not drive. */
  key(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const at = this.shownRows?.findIndex(({ button }) => button === event.target) ?? -1;
    const next = step && !this.moment.isArmed() && at >= 0 && this.shownRows[at + step];
    if (!next) return;
    event.preventDefault();
    event.target.tabIndex = -1;
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

function icon(kind) {
  const svg = make("svg", { viewBox: "0 0 20 20", "aria-hidden": "true" });
  make("path", { d: KINDS[kind][1] }, svg);
  return svg;
}
