// The orders that wait, in the robot's order: a row is dragged or moved by keys, and goes where the robot then says.

import { parcel } from "../parts/parcel.js";
import { called } from "../words/sentences.js";
import { minutes, put, say } from "../words/words.js";

/** A press that moves further than this, in pixels, drags its row. */
const STILL_PX = 5;
/** Why an order was put off, by the thought that says so. */
const PUT_OFF = { order_put_off: "put_off_way", order_waits_for_charge: "put_off_battery" };

export class Queue {
  /**
   * `move` puts an order before another one, or with null at the end; `cancel` takes it out. `isArmed` says whether
   * the arrows drive.
   */
  constructor(list, { move, cancel, isArmed }) {
    Object.assign(this, { list, move, cancel, isArmed });
    this.rows = new Map();
    /** The row under the hand: its order, where it was gripped, and where it would go. */
    this.drag = null;
    this.pointer();
    list.addEventListener("keydown", (event) => this.key(event));
  }

  /** `orders` as they wait, each with its goods' name, who wants it, in how many ms it comes and why it was put off. */
  draw(orders, me, mayDrive) {
    this.orders = orders.map(({ order }) => order);
    const focused = document.activeElement;
    for (const [order, { row }] of this.rows) {
      if (this.orders.includes(order)) continue;
      if (this.drag?.order === order) this.drop(null);
      row.remove();
      this.rows.delete(order);
    }
    orders.forEach((one, index) => {
      const { row, name, about, tag, buttons } = this.rows.get(one.order) ?? this.row(one);
      if (this.list.children[index] !== row) this.list.insertBefore(row, this.list.children[index] ?? null);
      put(name, one.name);
      const by = one.who && one.who !== me ? say("by", called(one.who)) : "";
      put(about, one.ms === null ? by : `≈ ${minutes(one.ms)}`);
      const why = PUT_OFF[one.putOff];
      tag.hidden = !why;
      put(tag, why ? say(why) : "");
      const words = [say("turn", index + 1, orders.length), `${one.product} ${one.name}`, tag.textContent, about.textContent];
      label(row, words.filter(Boolean).join(", "));
      const [up, down] = buttons;
      ["move_up", "move_down", "cancel_order"].forEach((word, at) => label(buttons[at], say(word, one.product), true));
      [up.disabled, down.disabled] = [index === 0, index === orders.length - 1];
      for (const button of buttons) button.hidden = !mayDrive;
    });
    this.mayDrive = mayDrive;
    // A row that changes its place loses the focus in some browsers.
    if (focused !== document.activeElement && this.list.contains(focused)) focused.focus();
  }

  row({ order, product }) {
    const row = document.createElement("li");
    row.className = "waiting";
    row.tabIndex = 0;
    row.dataset.order = order;
    row.setAttribute("aria-keyshortcuts", "Alt+ArrowUp Alt+ArrowDown Delete");
    const [name, tag, about] = ["name", "tag", "about"].map((part) => Object.assign(document.createElement("span"), { className: part }));
    const buttons = [["\u2191", () => this.step(order, -1)], ["\u2193", () => this.step(order, 1)], ["\u2715", () => this.cancel(order)]].map(([text, onclick]) =>
      Object.assign(document.createElement("button"), { type: "button", textContent: text, onclick }));
    row.append(parcel(product), name, tag, about, ...buttons);
    const parts = { row, name, tag, about, buttons };
    this.rows.set(order, parts);
    return parts;
  }

  /** One place earlier or later. */
  step(order, by) {
    const at = this.orders.indexOf(order);
    const to = at + by;
    if (at < 0 || to < 0 || to >= this.orders.length) return;
    this.move(order, by < 0 ? this.orders[to] : this.orders[to + 1] ?? null);
  }

  /** Keys on a row: the arrows go to the next one, with Alt they move it, Delete takes it out. */
  key(event) {
    const row = event.target.closest("li");
    if (event.target !== row || event.ctrlKey || event.metaKey || event.shiftKey || this.isArmed()) return;
    const { order } = row.dataset;
    const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (by && event.altKey && this.mayDrive) this.step(order, by);
    else if (by && !event.altKey) (by < 0 ? row.previousElementSibling : row.nextElementSibling)?.focus();
    else if (event.key === "Delete" && !event.repeat && this.mayDrive) this.takeOut(row, order);
    else return;
    event.preventDefault();
  }

  /** The focus stays in the list. */
  takeOut(row, order) {
    (row.nextElementSibling ?? row.previousElementSibling)?.focus();
    this.cancel(order);
  }

  /** A mouse takes hold of a row anywhere, a finger of its parcel: elsewhere it scrolls. */
  pointer() {
    const { list } = this;
    list.addEventListener("pointerdown", (event) => {
      const row = event.target.closest("li");
      if (!row || !this.mayDrive || event.button !== 0 || event.target.closest("button")) return;
      if (event.pointerType !== "mouse" && !event.target.closest(".parcel")) return;
      this.drag = { order: row.dataset.order, row, from: event.clientY, isMoved: false, before: undefined };
      list.setPointerCapture(event.pointerId);
    });
    list.addEventListener("pointermove", (event) => this.drag && this.drags(event.clientY));
    list.addEventListener("pointerup", () => this.drag && this.drop(this.drag));
    for (const end of ["pointercancel", "lostpointercapture"]) list.addEventListener(end, () => this.drag && this.drop(null));
  }

  drags(y) {
    const { drag } = this;
    drag.isMoved ||= Math.abs(y - drag.from) > STILL_PX;
    if (!drag.isMoved) return;
    drag.row.classList.add("dragged");
    drag.row.style.translate = `0 ${Math.round(y - drag.from)}px`;
    const others = [...this.list.children].filter((row) => row !== drag.row);
    const next = others.find((row) => {
      const { top, height } = row.getBoundingClientRect();
      return y < top + height / 2;
    });
    drag.before = next?.dataset.order ?? null;
    for (const row of others) row.classList.toggle("before", row === next);
    this.list.classList.toggle("last", !next);
  }

  /** Lets go of the row; with `drag` it is moved. */
  drop(drag) {
    const { row } = this.drag;
    this.drag = null;
    row.classList.remove("dragged");
    row.style.translate = "";
    this.list.classList.remove("last");
    for (const other of this.list.children) other.classList.remove("before");
    if (!drag) return;
    row.focus();
    if (drag.isMoved && drag.before !== undefined) this.move(drag.order, drag.before);
  }
}

/** What a screen reader and, for a button, a pointer that rests on it are told. */
function label(element, words, isTitle = false) {
  if (element.getAttribute("aria-label") === words) return;
  element.setAttribute("aria-label", words);
  if (isTitle) element.title = words;
}
