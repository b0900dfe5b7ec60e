// The orders that wait, in the robot's order: a row is dragged or moved by keys, and goes where the robot then says.

/** @import { Order } from "../station/robot.js" */

import { parcel } from "../parts/parcel.js";
import { called } from "../words/sentences.js";
import { minutes, put, say } from "../words/words.js";

/** A press that moves further than this, in pixels, drags its row. */
const STILL_PX = 5;
/**
 * Why an order was put off, by the thought that says so.
 *
 * @type {Partial<Record<string, string>>}
 */
const PUT_OFF = { order_put_off: "put_off_way", order_waits_for_charge: "put_off_battery" };

/** @type {Partial<Record<string, number>>} */
const KEYS = { ArrowUp: -1, ArrowDown: 1 };

/**
 * An order that waits: its goods' name, who wants it, in how many ms it comes, and the thought that put it off.
 *
 * @typedef {Order & { name: string, who: string | undefined, ms: number | null, putOff: string | undefined }} Waiting
 */
/** @typedef {Record<"up" | "down" | "out", HTMLButtonElement>} Buttons */
/** @typedef {{ row: HTMLLIElement, buttons: Buttons } & Record<"name" | "tag" | "about", HTMLElement>} Row */
/**
 * The row under the hand: its order, where it was gripped, and the order before which it would go; null is the end.
 *
 * @typedef {{ order: string, row: HTMLElement, from: number, isMoved: boolean, before?: string | null }} Drag
 */

export class Queue {
  /**
   * @param {HTMLElement} list
   * @param {object} page
   * @param {(order: string, before: string | null) => unknown} page.move puts an order before another one, or at the end
   * @param {(order: string) => unknown} page.cancel takes it out
   * @param {() => boolean} page.isArmed whether the arrows drive
   */
  constructor(list, { move, cancel, isArmed }) {
    this.list = list;
    this.move = move;
    this.cancel = cancel;
    this.isArmed = isArmed;
    /** @type {string[]} */
    this.orders = [];
    /** @type {Map<string, Row>} */
    this.rows = new Map();
    this.mayDrive = false;
    /** @type {Drag | null} */
    this.drag = null;
    this.pointer();
    list.addEventListener("keydown", (event) => this.key(event));
  }

  /**
   * @param {Waiting[]} orders as they wait
   * @param {string | null} me
   * @param {boolean} mayDrive
   */
  draw(orders, me, mayDrive) {
    this.orders = orders.map(({ order }) => order);
    const focused = document.activeElement;
    for (const [order, { row }] of this.rows) {
      if (this.orders.includes(order)) continue;
      if (this.drag?.order === order) this.drop(false);
      row.remove();
      this.rows.delete(order);
    }
    orders.forEach((one, index) => {
      const { row, name, about, tag, buttons } = this.rows.get(one.order) ?? this.row(one);
      if (this.list.children[index] !== row) this.list.insertBefore(row, this.list.children[index] ?? null);
      put(name, one.name);
      const by = one.who && one.who !== me ? say("by", called(one.who)) : "";
      put(about, one.ms === null ? by : `≈ ${minutes(one.ms)}`);
      const why = PUT_OFF[one.putOff ?? ""];
      tag.toggleAttribute("hidden", !why);
      put(tag, why ? say(why) : "");
      const words = [say("turn", index + 1, orders.length), `${one.product} ${one.name}`, tag.textContent, about.textContent];
      label(row, words.filter(Boolean).join(", "));
      const { up, down, out } = buttons;
      label(up, say("move_up", one.product), true);
      label(down, say("move_down", one.product), true);
      label(out, say("cancel_order", one.product), true);
      up.toggleAttribute("disabled", index === 0);
      down.toggleAttribute("disabled", index === orders.length - 1);
      for (const button of [up, down, out]) button.toggleAttribute("hidden", !mayDrive);
    });
    this.mayDrive = mayDrive;
    // A row that changes its place loses the focus in some browsers.
    if (focused instanceof HTMLElement && focused !== document.activeElement && this.list.contains(focused)) focused.focus();
  }

  /**
   * @param {Order} of
   * @returns {Row}
   */
  row({ order, product }) {
    const row = document.createElement("li");
    row.className = "waiting";
    row.tabIndex = 0;
    row.dataset.order = order;
    row.setAttribute("aria-keyshortcuts", "Alt+ArrowUp Alt+ArrowDown Delete");
    /** @param {string} className */
    const span = (className) => Object.assign(document.createElement("span"), { className });
    /** @type {(textContent: string, onclick: () => void) => HTMLButtonElement} */
    const button = (textContent, onclick) => Object.assign(document.createElement("button"), { type: "button", textContent, onclick });
    const buttons = {
      up: button("\u2191", () => this.step(order, -1)),
      down: button("\u2193", () => this.step(order, 1)),
      out: button("\u2715", () => this.cancel(order)),
    };
    const parts = { row, name: span("name"), tag: span("tag"), about: span("about"), buttons };
    row.append(parcel(product), parts.name, parts.tag, parts.about, ...Object.values(buttons));
    this.rows.set(order, parts);
    return parts;
  }

  /**
   * One place earlier or later.
   *
   * @param {string} order
   * @param {number} by
   */
  step(order, by) {
    const at = this.orders.indexOf(order);
    const to = at + by;
    if (at < 0 || to < 0 || to >= this.orders.length) return;
    this.move(order, this.orders[by < 0 ? to : to + 1] ?? null);
  }

  /**
   * Keys on a row: the arrows go to the next one, with Alt they move it, Delete takes it out.
   *
   * @param {KeyboardEvent} event
   */
  key(event) {
    const row = rowAt(event);
    if (!row || event.target !== row || event.ctrlKey || event.metaKey || event.shiftKey || this.isArmed()) return;
    const { order = "" } = row.dataset;
    const by = KEYS[event.key];
    if (by && event.altKey && this.mayDrive) this.step(order, by);
    else if (by && !event.altKey) focus(by < 0 ? row.previousElementSibling : row.nextElementSibling);
    else if (event.key === "Delete" && !event.repeat && this.mayDrive) this.takeOut(row, order);
    else return;
    event.preventDefault();
  }

  /**
   * The focus stays in the list.
   *
   * @param {HTMLElement} row
   * @param {string} order
   */
  takeOut(row, order) {
    focus(row.nextElementSibling ?? row.previousElementSibling);
    this.cancel(order);
  }

  /** A mouse takes hold of a row anywhere, a finger of its parcel: elsewhere it scrolls. */
  pointer() {
    const { list } = this;
    list.addEventListener("pointerdown", (event) => {
      const [row, { target }] = [rowAt(event), event];
      if (!row || !this.mayDrive || event.button !== 0 || !(target instanceof Element) || target.closest("button")) return;
      if (event.pointerType !== "mouse" && !target.closest(".parcel")) return;
      this.drag = { order: row.dataset.order ?? "", row, from: event.clientY, isMoved: false };
      list.setPointerCapture(event.pointerId);
    });
    list.addEventListener("pointermove", (event) => this.drag && this.drags(this.drag, event.clientY));
    list.addEventListener("pointerup", () => this.drop(true));
    for (const end of ["pointercancel", "lostpointercapture"]) list.addEventListener(end, () => this.drop(false));
  }

  /**
   * @param {Drag} drag
   * @param {number} y
   */
  drags(drag, y) {
    drag.isMoved ||= Math.abs(y - drag.from) > STILL_PX;
    if (!drag.isMoved) return;
    drag.row.classList.add("dragged");
    drag.row.style.translate = `0 ${Math.round(y - drag.from)}px`;
    const others = [...this.list.children].filter((row) => row !== drag.row);
    const next = others.find((row) => {
      const { top, height } = row.getBoundingClientRect();
      return y < top + height / 2;
    });
    drag.before = next?.getAttribute("data-order") ?? null;
    for (const row of others) row.classList.toggle("before", row === next);
    this.list.classList.toggle("last", !next);
  }

  /**
   * Lets go of the row that is dragged, if one is.
   *
   * @param {boolean} isThere whether it goes to where it is
   */
  drop(isThere) {
    const { drag } = this;
    if (!drag) return;
    const { row } = drag;
    this.drag = null;
    row.classList.remove("dragged");
    row.style.translate = "";
    this.list.classList.remove("last");
    for (const other of this.list.children) other.classList.remove("before");
    if (!isThere) return;
    row.focus();
    if (drag.isMoved && drag.before !== undefined) this.move(drag.order, drag.before);
  }
}

/**
 * The row that an event has met.
 *
 * @param {Event} event
 */
const rowAt = ({ target }) => (target instanceof Element ? target.closest("li") : null);

/** @param {Element | null} row */
function focus(row) {
  if (row instanceof HTMLElement) row.focus();
}

/**
 * What a screen reader and, for a button, a pointer that rests on it are told.
 *
 * @param {HTMLElement} element
 * @param {string} words
 */
function label(element, words, isTitle = false) {
  if (element.ariaLabel === words) return;
  element.ariaLabel = words;
  if (isTitle) element.title = words;
}
