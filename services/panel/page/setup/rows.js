// The table of the goods, a row of fields for each.

/** @import { Product } from "../station/robot.js" */
/** @import { Said } from "./edits.js" */

import { put, say, translate } from "../words/words.js";
import { SIDES } from "./written.js";

/**
 * @typedef {object} Row
 * @property {HTMLTableRowElement} line
 * @property {Record<"id" | "name" | "x" | "y", HTMLInputElement>} fields
 * @property {HTMLSelectElement} from
 * @property {HTMLElement} why
 */

const LABELS = { id: "number", name: "name", x: "column", y: "row" };

export class Rows {
  /**
   * @param {HTMLTableSectionElement} table
   * @param {HTMLElement} add the button below it
   * @param {() => void} removed is called when a row is taken out
   */
  constructor(table, add, removed) {
    this.table = table;
    this.add = add;
    this.removed = removed;
    /** @type {Row[]} */
    this.rows = [];
  }

  /**
   * Fills the table in. Where the hand was, it stays.
   *
   * @param {Product[]} products
   */
  fill(products) {
    const hand = document.activeElement;
    const index = this.rows.findIndex(({ line }) => line.contains(hand));
    const name = hand?.getAttribute("name");
    this.table.replaceChildren();
    this.rows = products.map((product) => this.row(product));
    if (index < 0) return;
    const { line } = this.rows[Math.min(index, this.rows.length - 1)] ?? {};
    const field = name ? line?.querySelector(`[name="${name}"]`) : line?.querySelector("button");
    (field instanceof HTMLElement ? field : this.add).focus();
  }

  /**
   * @param {Product} product
   * @returns {Row}
   */
  row({ id, name = "", square: [x, y], side }) {
    const line = document.createElement("tr");
    const from = document.createElement("select");
    from.name = "from";
    from.dataset.label = "reached_from";
    for (const word of SIDES) {
      const option = new Option(word, word);
      option.dataset.word = word;
      from.append(option);
    }
    from.value = side;
    const remove = document.createElement("button");
    Object.assign(remove, { type: "button", textContent: "×" });
    remove.dataset.title = "remove";
    const why = document.createElement("p");
    Object.assign(why, { className: "wrong", hidden: true });
    const fields = { id: field("id", id), name: field("name", name), x: field("x", x), y: field("y", y) };
    for (const parts of [[fields.id, why], [fields.name], [fields.x, fields.y], [from], [remove]]) {
      const cell = document.createElement("td");
      cell.append(...parts);
      line.append(cell);
    }
    translate(line);
    this.table.append(line);
    const row = { line, fields, from, why };
    remove.onclick = () => this.remove(row);
    return row;
  }

  /** @param {Row} row */
  remove(row) {
    const next = row.line.nextElementSibling ?? row.line.previousElementSibling;
    row.line.remove();
    this.rows = this.rows.filter((other) => other !== row);
    (next?.querySelector("button") ?? this.add).focus();
    this.removed();
  }

  /**
   * The goods that stand in it.
   *
   * @returns {Product[]}
   */
  read() {
    return this.rows.map(({ fields: { id, name, x, y }, from }) => {
      const side = SIDES[from.selectedIndex] ?? "left";
      /** @type {Product} */
      const product = { id: Number(id.value), square: [Number(x.value), Number(y.value)], side };
      return name.value ? { ...product, name: name.value } : product;
    });
  }

  /**
   * Says in each row what is wrong with it.
   *
   * @param {(Said | null)[]} wrong
   */
  mark(wrong) {
    this.rows.forEach(({ line, why }, index) => {
      const said = wrong[index];
      put(why, said ? say(...said) : "");
      why.toggleAttribute("hidden", !said);
      line.classList.toggle("bad", Boolean(said));
    });
  }
}

/**
 * @param {keyof typeof LABELS} name
 * @param {string | number} value
 */
function field(name, value) {
  const input = document.createElement("input");
  Object.assign(input, { name, value });
  input.dataset.label = LABELS[name];
  // What is left empty is no 0.
  if (name !== "name") Object.assign(input, { type: "number", min: 0, required: true, className: "short" });
  return input;
}
