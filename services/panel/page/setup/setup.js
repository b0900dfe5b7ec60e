// Setting up: the warehouse by form, file and strings, with checks as one types.

import { judge, wrong } from "../parts/fields.js";
import { reason } from "../words/sentences.js";
import { LIMITS } from "../words/table.js";
import { put, say, translate } from "../words/words.js";

const SIDES = ["left", "up", "right", "down"];

export class Setup {
  constructor(link, parts) {
    this.link = link;
    this.parts = parts;
    this.past = [];
    this.dirty = false;
    const { form } = parts;
    const { width, height, side } = form.elements;
    width.max = height.max = LIMITS.squares;
    [side.min, side.max] = [LIMITS.leastSideCm, LIMITS.mostSideCm];
    judge(form);
    form.addEventListener("input", ({ target }) => {
      // What is pasted or loaded replaces the form's content as a whole.
      if (!target.name) return;
      this.dirty = true;
      this.corners();
      this.check();
    });
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const why = wrong(form.elements);
      if (why) put(parts.said, why);
      else this.save(this.read());
    });
    parts.add.onclick = () => {
      this.dirty = true;
      this.row({ id: this.freeNumber(), square: [0, 0], side: "down" });
      this.check();
    };
    parts.undo.onclick = () => this.undo();
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
    this.drawUndo();
  }

  async undo() {
    const before = this.past.at(-1);
    if (before && (await this.save(before, false))) this.past.pop();
    this.drawUndo();
  }

  drawUndo() {
    this.parts.undo.disabled = !this.past.length;
  }

  /** Puts goods at the side of a square, with the next number. */
  place(square, side) {
    this.dirty = true;
    this.row({ id: this.freeNumber(), square, side });
    return this.save(this.read());
  }

  saveFile() {
    const blob = new Blob([JSON.stringify(this.read(), null, 2)], { type: "application/json" });
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(blob);
    anchor.download = "warehouse.json";
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
  }

  async loadFile(file) {
    try {
      const { size, side_length_cm, delivery = [0, 0], product = [], ...rest } = JSON.parse(await file.text());
      await this.save({ ...rest, size, side_length_cm, delivery, product });
    } catch {
      // It is no JSON, or something else than this.
      put(this.parts.said, `${file.name}: ${say("no_warehouse")}`);
    }
    // The same file can be chosen again.
    this.parts.loadFile.value = "";
  }

  /** The map as the document writes it, "X,Y,x,y" (M1). */
  pasteMap(text) {
    const numbers = text.split(",").map((word) => (/^\s*\d+\s*$/.test(word) ? Number(word) : NaN));
    if (numbers.length !== 4 || numbers.some(Number.isNaN)) return put(this.parts.said, say("map_string_how"));
    const [width, height, x, y] = numbers;
    this.save({ ...this.read(), size: [width, height], delivery: [x, y] });
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
    this.save({ ...this.read(), product });
  }

  /** Whether it is saved; what is wrong is told. */
  async save(warehouse, undoable = true) {
    const before = this.link.warehouse;
    const why = this.wrong(warehouse);
    const answer = why ? {} : await this.link.ask("warehouse", null, JSON.stringify(warehouse));
    const refused = why ?? (answer.refused && reason(answer.refused));
    const told = (answer.told ?? "").split("; ").map(reason).join("; ");
    put(this.parts.said, refused ?? (told || say("saved")));
    if (refused) return false;
    if (undoable && before) this.past.push(before);
    this.drawUndo();
    this.dirty = false;
    this.setWarehouse(warehouse);
    return true;
  }

  /** Fills the form in, unless somebody is at work in it. */
  setWarehouse(warehouse) {
    if (this.dirty || !warehouse) return;
    const { elements } = this.parts.form;
    [elements.width.value, elements.height.value] = warehouse.size;
    elements.side.value = warehouse.side_length_cm;
    this.corners();
    elements.delivery.value = String(warehouse.delivery ?? [0, 0]);
    this.parts.products.replaceChildren();
    for (const product of warehouse.product ?? []) this.row(product);
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
      line.remove();
      this.dirty = true;
      this.check();
    };
    const cells = [[field("number", id, "id", "short")], [field("text", name, "name", "")], [field("number", square[0], "x", "short"), field("number", square[1], "y", "short")], [sides], [remove]];
    for (const parts of cells) {
      const cell = document.createElement("td");
      cell.append(...parts);
      line.append(cell);
    }
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
      ...(this.link.warehouse ?? {}),
      size: [Number(elements.width.value), Number(elements.height.value)],
      side_length_cm: Number(elements.side.value),
      delivery: elements.delivery.value.split(",").map(Number),
      product,
    };
  }

  /** What is wrong with a warehouse, as a sentence; the station checks it, too. */
  wrong({ size = [], side_length_cm: side, product }) {
    const largest = Math.max(...size);
    if (largest > LIMITS.squares) return say("size_limits", LIMITS.squares, largest);
    if (side < LIMITS.leastSideCm || side > LIMITS.mostSideCm) return say("side_limits", LIMITS.leastSideCm, side, LIMITS.mostSideCm);
    if (product.length > LIMITS.goods) return say("goods_limits", LIMITS.goods, product.length);
    const ids = product.map(({ id }) => id);
    const twice = ids.find((id, index) => ids.indexOf(id) !== index);
    if (twice !== undefined) return say("duplicate", twice);
    const outside = product.find(({ square: [x, y] }) => x < 0 || y < 0 || x >= size[0] || y >= size[1]);
    return outside ? say("outside", outside.id) : null;
  }

  check() {
    put(this.parts.said, this.wrong(this.read()) ?? "");
  }

  freeNumber() {
    return Math.max(0, ...[...this.parts.products.rows].map((line) => Number(line.querySelector("[name=id]").value))) + 1;
  }
}
