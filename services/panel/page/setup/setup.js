// Setting up: the warehouse by form, file and strings, with checks as one types. On the map it is set up, too (onmap.js);
// what was changed can be undone (edits.js), and counts once it is saved.

import { judge, wrong } from "../parts/fields.js";
import { Edits, isWarehouse, placed, wrongFloor, wrongGoods } from "./edits.js";
import { reason } from "../words/sentences.js";
import { LIMITS } from "../words/table.js";
import { decimal, put, say, translate } from "../words/words.js";

const SIDES = ["left", "up", "right", "down"];
/** The warehouse that goods are put into where there is none yet. */
const FIRST = { size: [4, 3], side_length_cm: 40, delivery: [0, 0], product: [] };

export class Setup {
  /** `drawn` is called whenever another warehouse is to be drawn; `isOpen` says whether it is in view. */
  constructor(link, parts, { drawn, isOpen }) {
    Object.assign(this, { link, parts, drawn, isOpen, edits: new Edits(), isSaving: false, isElsewhere: false });
    const { form } = parts;
    const { width, height, side } = form.elements;
    width.max = height.max = LIMITS.squares;
    [side.min, side.max] = [LIMITS.leastSideCm, LIMITS.mostSideCm];
    judge(form);
    form.addEventListener("input", ({ target }) => {
      if (!target.name) return;
      this.corners();
      this.check();
    });
    // What is typed is one change once the hand leaves the field.
    form.addEventListener("change", ({ target }) => target.name && this.takeForm());
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.save();
    });
    parts.add.onclick = () => this.change(placed(this.edits.now ?? this.typed() ?? FIRST, [0, 0], "down"));
    parts.undo.onclick = () => this.go("undo");
    parts.redo.onclick = () => this.go("redo");
    parts.discard.onclick = () => this.go("discard");
    parts.saveFile.onclick = () => this.saveFile();
    parts.loadFile.onchange = () => parts.loadFile.files.length && this.loadFile(parts.loadFile.files[0]);
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

  /** Ctrl and S saves; Z undoes and Y or Shift and Z does it again, but in a field of text, whose own these are. */
  key(event) {
    const key = event.key.toLowerCase();
    if (!this.isOpen() || !(event.ctrlKey || event.metaKey) || event.altKey || !this.link.mayDrive) return;
    if (key !== "s" && event.target.matches?.("input:not([type=number]), textarea")) return;
    if (key === "s") this.save();
    else if (key === "y" || (key === "z" && event.shiftKey)) this.go("redo");
    else if (key === "z") this.go("undo");
    else return;
    event.preventDefault();
  }

  go(step) {
    this.edits[step]();
    this.fill();
  }

  /** Takes a changed warehouse. */
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
    if (!warehouse || wrongFloor(warehouse)) return this.check();
    if (this.edits.change(warehouse)) this.drawn();
    this.check();
  }

  /** Takes a warehouse of somebody else's making, if it can be drawn. */
  paste(warehouse) {
    if (!isWarehouse(warehouse)) return put(this.parts.said, say("no_warehouse"));
    const { size, delivery } = warehouse;
    const isCorner = delivery.every((number, axis) => number === 0 || number === size[axis]);
    const why = wrongFloor(warehouse) ?? (isCorner ? null : ["no_corner", delivery.join(", ")]);
    if (why) return put(this.parts.said, say(...why));
    this.change(warehouse);
  }

  saveFile() {
    const blob = new Blob([JSON.stringify(this.edits.now, null, 2)], { type: "application/json" });
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(blob);
    anchor.download = "warehouse.json";
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
  }

  async loadFile(file) {
    try {
      const { size, side_length_cm, delivery = [0, 0], product = [], ...rest } = JSON.parse(await file.text());
      this.paste({ ...rest, size, side_length_cm, delivery, product });
    } catch {
      // It is no JSON.
      put(this.parts.said, say("no_warehouse"));
    }
    // The same file can be chosen again.
    this.parts.loadFile.value = "";
  }

  /** The map as the document writes it, "X,Y,x,y" (M1). */
  pasteMap(text) {
    const numbers = text.split(",").map((word) => (/^\s*\d+\s*$/.test(word) ? Number(word) : NaN));
    if (numbers.length !== 4 || numbers.some(Number.isNaN)) return put(this.parts.said, say("map_string_how"));
    const [width, height, x, y] = numbers;
    this.paste({ ...(this.edits.now ?? FIRST), size: [width, height], delivery: [x, y] });
  }

  /** The goods as the document writes them, "v,x,y,s;...", s clockwise from left (M3). */
  pasteGoods(text) {
    const product = [];
    for (const part of text.split(";").filter((part) => part.trim())) {
      const words = part.split(",").map((word) => word.trim());
      const numbers = words.map((word) => (/^\d+$/.test(word) ? Number(word) : NaN));
      const side = SIDES[numbers[3]];
      if (words.length !== 4 || numbers.some(Number.isNaN) || !side) return put(this.parts.said, say("goods_string_how", part));
      product.push({ id: numbers[0], square: [numbers[1], numbers[2]], side });
    }
    this.paste({ ...(this.edits.now ?? FIRST), product });
  }

  /** Saves what is drawn, once nothing is wrong with it. */
  async save() {
    this.takeForm();
    const why = this.check();
    const { now } = this.edits;
    if (why || !now) return put(this.parts.said, why ?? say("no_warehouse"));
    this.isSaving = true;
    const answer = await this.link.ask("warehouse", null, JSON.stringify(now));
    this.isSaving = false;
    const told = (answer.told ?? "").split("; ").map(reason).join("; ");
    put(this.parts.said, answer.refused ? reason(answer.refused) : told || say("saved"));
    if (!answer.refused) {
      this.edits.saved(now);
      this.isElsewhere = false;
    }
    this.kept(this.link.warehouse);
    this.draw();
  }

  /** The station keeps this warehouse. */
  kept(warehouse) {
    if (!warehouse || this.isSaving) return;
    const before = this.edits.now;
    this.isElsewhere = this.edits.kept(warehouse) || (this.isElsewhere && this.edits.unsaved > 0);
    if (this.edits.now !== before) this.fill();
    this.draw();
  }

  /** Fills the form in. Where the hand was, it stays. */
  fill() {
    const { now } = this.edits;
    if (!now) return;
    const { form, products } = this.parts;
    const { elements } = form;
    const row = [...products.rows].findIndex((line) => line.contains(document.activeElement));
    const { name } = document.activeElement;
    [elements.width.value, elements.height.value] = now.size;
    elements.side.value = now.side_length_cm;
    this.corners();
    elements.delivery.value = String(now.delivery ?? [0, 0]);
    products.replaceChildren();
    for (const product of now.product ?? []) this.row(product);
    if (row >= 0) (products.rows[Math.min(row, products.rows.length - 1)]?.querySelector(`[name="${name}"]`) ?? this.parts.add).focus();
    this.drawn();
    this.check();
  }

  /** What can be undone, and what is not saved. */
  draw() {
    const { parts, edits, link } = this;
    const named = (button, key, what) => {
      const words = say(key, what ? say(...what) : "");
      button.disabled = !what || !link.mayDrive;
      if (button.title === words) return;
      button.title = words;
      button.setAttribute("aria-label", words);
    };
    named(parts.undo, "undo_what", edits.undoes);
    named(parts.redo, "redo_what", edits.redoes);
    put(parts.undoes, edits.undoes ? say("undo_what", say(...edits.undoes)) : "");
    const { unsaved } = edits;
    const words = unsaved === 1 ? say("unsaved_one") : unsaved ? say("unsaved_many", unsaved) : "";
    put(parts.unsaved, unsaved && this.isElsewhere ? `${words}; ${say("saved_elsewhere")}` : words);
    parts.discard.hidden = !unsaved || !edits.safe;
    const { size: [x, y] = [], side_length_cm: side } = edits.now ?? {};
    put(parts.floor, side ? `${decimal((x * side) / 100)} × ${decimal((y * side) / 100)} m` : "");
  }

  corners() {
    const { width, height, delivery } = this.parts.form.elements;
    const [x, y] = [Number(width.value), Number(height.value)];
    const chosen = delivery.selectedIndex;
    const corners = [[0, 0], [x, 0], [0, y], [x, y]];
    delivery.replaceChildren(...corners.map((corner) => new Option(`(${corner})`, String(corner))));
    delivery.selectedIndex = Math.max(chosen, 0);
  }

  row({ id, name = "", square, side }) {
    const line = document.createElement("tr");
    const field = (type, value, key, size) => {
      const input = document.createElement("input");
      Object.assign(input, { type, value, name: key });
      // What is left empty is no 0.
      if (type === "number") Object.assign(input, { min: 0, required: true });
      input.className = size;
      input.dataset.label = { id: "number", name: "name", x: "column", y: "row" }[key];
      return input;
    };
    const sides = document.createElement("select");
    sides.name = "from";
    sides.dataset.label = "reached_from";
    for (const word of SIDES) sides.appendChild(new Option(word, word)).dataset.word = word;
    sides.value = side;
    const remove = document.createElement("button");
    Object.assign(remove, { type: "button", textContent: "×" });
    remove.dataset.title = "remove";
    remove.onclick = () => {
      const next = line.nextElementSibling ?? line.previousElementSibling;
      line.remove();
      (next?.querySelector("button") ?? this.parts.add).focus();
      this.takeForm();
    };
    const cells = [[field("number", id, "id", "short")], [field("text", name, "name", "")], [field("number", square[0], "x", "short"), field("number", square[1], "y", "short")], [sides], [remove]];
    for (const parts of cells) {
      const cell = document.createElement("td");
      cell.append(...parts);
      line.append(cell);
    }
    const why = document.createElement("p");
    Object.assign(why, { className: "wrong", hidden: true });
    line.children[1].append(why);
    translate(line);
    this.parts.products.append(line);
  }

  read() {
    const { elements } = this.parts.form;
    const product = [...this.parts.products.rows].map((line) => {
      const value = (name) => line.querySelector(`[name=${name}]`).value;
      const good = { id: Number(value("id")), square: [Number(value("x")), Number(value("y"))], side: value("from") };
      return value("name") ? { ...good, name: value("name") } : good;
    });
    return {
      ...(this.edits.now ?? {}),
      size: [Number(elements.width.value), Number(elements.height.value)],
      side_length_cm: Number(elements.side.value),
      delivery: elements.delivery.value.split(",").map(Number),
      product,
    };
  }

  /** What is wrong, said and at each row; null if nothing is. */
  check() {
    const { form, products, said } = this.parts;
    const all = this.read();
    const goods = wrongGoods(all);
    [...products.rows].forEach((line, index) => {
      const tag = line.querySelector(".wrong");
      const why = goods[index] ? say(...goods[index]) : "";
      put(tag, why);
      tag.hidden = !why;
      line.classList.toggle("bad", Boolean(why));
    });
    const first = wrongFloor(all) ?? goods.find(Boolean);
    // An empty form is not wrong yet.
    const why = this.edits.now || form.elements.width.value ? wrong(form.elements) ?? (first ? say(...first) : null) : null;
    put(said, why ?? "");
    this.draw();
    return why;
  }
}
