// Setting up: the warehouse by form, file and strings, with checks as one types. On the map it is set up, too (onmap.js);
// what was changed can be undone (edits.js), and counts once it is saved.

/** @import { Link } from "../station/link.js" */
/** @import { Warehouse } from "../station/robot.js" */
/** @import { Said } from "./edits.js" */

import { field, judge, wrong } from "../parts/fields.js";
import { Edits, placed, wrongFloor, wrongGoods } from "./edits.js";
import { Rows } from "./rows.js";
import { readFile, readGoods, readMap, wrongDrawing } from "./written.js";
import { reason } from "../words/sentences.js";
import { LIMITS } from "./limits.js";
import { decimal, put, say } from "../words/words.js";

/**
 * The warehouse that goods are put into where there is none yet.
 *
 * @type {Warehouse}
 */
const FIRST = { size: [4, 3], side_length_cm: 40, delivery: [0, 0], product: [] };

/**
 * @typedef {{ form: HTMLFormElement, products: HTMLTableSectionElement }
 *   & Record<"add" | "undo" | "redo" | "discard" | "saveFile", HTMLButtonElement>
 *   & Record<"loadFile" | "mapString" | "goodsString", HTMLInputElement>
 *   & Record<"said" | "floor" | "undoes" | "unsaved", HTMLElement>} Parts
 */

export class Setup {
  /**
   * @param {Link} link
   * @param {Parts} parts
   * @param {object} page
   * @param {() => void} page.drawn is called whenever another warehouse is to be drawn
   * @param {() => boolean} page.isOpen whether it is in view
   */
  constructor(link, parts, { drawn, isOpen }) {
    this.link = link;
    this.parts = parts;
    this.drawn = drawn;
    this.isOpen = isOpen;
    this.edits = new Edits();
    this.isSaving = false;
    /** Whether somebody else has saved another warehouse while somebody is at work here. */
    this.isElsewhere = false;
    const { form } = parts;
    /** @param {string} name */
    const input = (name) => field(form, name, HTMLInputElement);
    this.fields = { width: input("width"), height: input("height"), side: input("side"), delivery: field(form, "delivery", HTMLSelectElement) };
    this.rows = new Rows(parts.products, parts.add, () => this.takeForm());
    const { width, height, side } = this.fields;
    width.max = height.max = String(LIMITS.squares);
    side.min = String(LIMITS.leastSideCm);
    side.max = String(LIMITS.mostSideCm);
    judge(form);
    form.addEventListener("input", ({ target }) => {
      if (!isNamed(target)) return;
      this.corners();
      this.check();
    });
    // What is typed is one change once the hand leaves the field.
    form.addEventListener("change", ({ target }) => isNamed(target) && this.takeForm());
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.save();
    });
    parts.add.onclick = () => this.change(placed(this.edits.now ?? this.typed() ?? FIRST, [0, 0], "down"));
    parts.undo.onclick = () => this.go("undo");
    parts.redo.onclick = () => this.go("redo");
    parts.discard.onclick = () => this.go("discard");
    parts.saveFile.onclick = () => this.saveFile();
    parts.loadFile.onchange = () => this.loadFile();
    parts.mapString.onchange = () => parts.mapString.value && this.pasteMap(parts.mapString.value);
    parts.goodsString.onchange = () => parts.goodsString.value && this.pasteGoods(parts.goodsString.value);
    for (const field of [parts.mapString, parts.goodsString]) {
      field.addEventListener("keydown", (event) => {
        if (event.key !== "Enter") return;
        // It takes the string, where the form would save what stands in its other fields.
        event.preventDefault();
        field.blur();
      });
    }
    addEventListener("keydown", (event) => this.key(event));
    this.draw();
  }

  /**
   * Ctrl and S saves; Z undoes and Y or Shift and Z does it again, but in a field of text, whose own these are.
   *
   * @param {KeyboardEvent} event
   */
  key(event) {
    const key = event.key.toLowerCase();
    if (!this.isOpen() || !(event.ctrlKey || event.metaKey) || event.altKey || !this.link.mayDrive) return;
    const isText = event.target instanceof Element && event.target.matches("input:not([type=number]), textarea");
    if (key !== "s" && isText) return;
    if (key === "s") this.save();
    else if (key === "y" || (key === "z" && event.shiftKey)) this.go("redo");
    else if (key === "z") this.go("undo");
    else return;
    event.preventDefault();
  }

  /** @param {"undo" | "redo" | "discard"} step */
  go(step) {
    this.edits[step]();
    this.fill();
  }

  /**
   * Takes a changed warehouse.
   *
   * @param {Warehouse} warehouse
   */
  change(warehouse) {
    if (this.edits.change(warehouse)) this.fill();
    this.check();
  }

  /** The warehouse of the form, if all its fields are such that it can be one. */
  typed() {
    return wrong(this.parts.form.elements) ? null : this.read();
  }

  /** Takes what stands in the form; its fields are left as they are, since a hand is in them. */
  takeForm() {
    const warehouse = this.typed();
    if (warehouse && !wrongFloor(warehouse) && this.edits.change(warehouse)) this.drawn();
    this.check();
  }

  /**
   * Takes a warehouse of somebody else's making, if it can be drawn.
   *
   * @param {Warehouse | null} warehouse
   */
  paste(warehouse) {
    /** @type {Said | null} */
    const why = warehouse ? wrongDrawing(warehouse) : ["no_warehouse"];
    if (why) put(this.parts.said, say(...why));
    else if (warehouse) this.change(warehouse);
  }

  saveFile() {
    const blob = new Blob([JSON.stringify(this.edits.now, null, 2)], { type: "application/json" });
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(blob);
    anchor.download = "warehouse.json";
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
  }

  async loadFile() {
    const { loadFile } = this.parts;
    const file = loadFile.files?.[0];
    if (file) this.paste(readFile(await file.text()));
    // The same file can be chosen again.
    loadFile.value = "";
  }

  /** @param {string} text */
  pasteMap(text) {
    const map = readMap(text);
    if (map) this.paste({ ...(this.edits.now ?? FIRST), ...map });
    else put(this.parts.said, say("map_string_how"));
  }

  /** @param {string} text */
  pasteGoods(text) {
    const goods = readGoods(text);
    if ("wrong" in goods) put(this.parts.said, say("goods_string_how", goods.wrong));
    else this.paste({ ...(this.edits.now ?? FIRST), ...goods });
  }

  /** Saves what is drawn, once nothing is wrong with it. */
  async save() {
    this.takeForm();
    const why = this.check();
    const { now } = this.edits;
    if (why || !now) return put(this.parts.said, why ?? say("no_warehouse"));
    this.isSaving = true;
    const { refused, told = "" } = await this.link.ask("warehouse", null, JSON.stringify(now));
    this.isSaving = false;
    if (refused) put(this.parts.said, reason(refused));
    else {
      put(this.parts.said, told.split("; ").map(reason).join("; ") || say("saved"));
      this.edits.saved(now);
      this.isElsewhere = false;
    }
    this.kept(this.link.warehouse);
    this.draw();
  }

  /**
   * The station keeps this warehouse.
   *
   * @param {Warehouse | null} warehouse
   */
  kept(warehouse) {
    if (!warehouse || this.isSaving) return;
    const before = this.edits.now;
    this.isElsewhere = this.edits.kept(warehouse) || (this.isElsewhere && this.edits.unsaved > 0);
    if (this.edits.now !== before) this.fill();
    this.draw();
  }

  /** Fills the form in. */
  fill() {
    const { now } = this.edits;
    if (!now) return;
    const { width, height, side, delivery } = this.fields;
    width.value = String(now.size[0]);
    height.value = String(now.size[1]);
    side.value = String(now.side_length_cm);
    this.corners();
    delivery.value = String(now.delivery);
    this.rows.fill(now.product ?? []);
    this.drawn();
    this.check();
  }

  /** What can be undone, and what is not saved. */
  draw() {
    const { parts, edits, link } = this;
    /** @type {(button: HTMLButtonElement, key: string, what: Said | null) => void} */
    const name = (button, key, what) => {
      const words = say(key, what ? say(...what) : "");
      button.toggleAttribute("disabled", !what || !link.mayDrive);
      if (button.title === words) return;
      button.title = words;
      button.setAttribute("aria-label", words);
    };
    name(parts.undo, "undo_what", edits.undoes);
    name(parts.redo, "redo_what", edits.redoes);
    put(parts.undoes, edits.undoes ? say("undo_what", say(...edits.undoes)) : "");
    const { unsaved } = edits;
    const words = unsaved === 1 ? say("unsaved_one") : unsaved ? say("unsaved_many", unsaved) : "";
    put(parts.unsaved, unsaved && this.isElsewhere ? `${words}; ${say("saved_elsewhere")}` : words);
    parts.discard.toggleAttribute("hidden", !unsaved || !edits.safe || !link.mayDrive);
    const { size: [x, y] = [0, 0], side_length_cm: side = 0 } = edits.now ?? {};
    put(parts.floor, side ? `${decimal((x * side) / 100)} × ${decimal((y * side) / 100)} m` : "");
  }

  corners() {
    const { width, height, delivery } = this.fields;
    const [x, y] = [Number(width.value), Number(height.value)];
    const chosen = delivery.selectedIndex;
    const corners = [[0, 0], [x, 0], [0, y], [x, y]];
    delivery.replaceChildren(...corners.map((corner) => new Option(`(${corner})`, String(corner))));
    delivery.selectedIndex = Math.max(chosen, 0);
  }

  /**
   * The warehouse that stands in the form.
   *
   * @returns {Warehouse}
   */
  read() {
    const { width, height, side, delivery } = this.fields;
    const [x = 0, y = 0] = delivery.value.split(",").map(Number);
    return {
      ...(this.edits.now ?? {}),
      size: [Number(width.value), Number(height.value)],
      side_length_cm: Number(side.value),
      delivery: [x, y],
      product: this.rows.read(),
    };
  }

  /** What is wrong, said and at each row; null if nothing is. */
  check() {
    const { form, said } = this.parts;
    const all = this.read();
    const goods = wrongGoods(all);
    this.rows.mark(goods);
    const first = wrongFloor(all) ?? goods.find(Boolean);
    // An empty form is not wrong yet.
    const isBegun = this.edits.now || this.fields.width.value;
    const why = isBegun ? wrong(form.elements) ?? (first ? say(...first) : null) : null;
    put(said, why ?? "");
    this.draw();
    return why;
  }
}

/**
 * Whether it is a field of the warehouse; what is pasted or loaded replaces all of them.
 *
 * @param {EventTarget | null} target
 */
const isNamed = (target) => target instanceof Element && Boolean(target.getAttribute("name"));
