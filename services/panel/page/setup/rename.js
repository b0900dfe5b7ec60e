// The field on the map in which goods get another name, beside them. From there they are moved or removed, too.

/** @import { Point, Target } from "../map/grid.js" */
/** @import { WarehouseMap } from "../map/map.js" */
/** @import { Offer } from "../map/offers.js" */
/** @import { OnMap } from "./onmap.js" */

import { beside } from "../parts/beside.js";
import { put } from "../words/words.js";
import { named } from "./edits.js";

/** How far from the middle of the goods it stands, in pixels. */
const OFF_PX = 24;

export class Rename {
  /**
   * @param {WarehouseMap} map
   * @param {{ form: HTMLFormElement, name: HTMLInputElement } & Record<"number" | "move" | "remove" | "close", HTMLElement>} parts
   * @param {OnMap} onMap
   */
  constructor(map, parts, onMap) {
    this.map = map;
    this.parts = parts;
    this.onMap = onMap;
    /**
     * The goods that get a name.
     *
     * @type {number | null}
     */
    this.id = null;
    parts.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.keep();
    });
    parts.close.onclick = () => this.close();
    parts.move.onclick = () => this.end((id) => onMap.take(id));
    parts.remove.onclick = () => this.end((id) => onMap.remove(id));
  }

  /**
   * What a click on the map does: beside the open field it keeps the name, as Enter does.
   *
   * @param {Target} target
   * @returns {Offer}
   */
  offers(target) {
    if (this.id !== null) return { act: () => this.keep() };
    return this.onMap.offers(target, (id, at) => this.open(id, at));
  }

  /**
   * @param {number} id
   * @param {Point} at in mm of the floor
   */
  open(id, at) {
    const { form, name, number } = this.parts;
    this.id = id;
    put(number, String(id));
    name.value = this.onMap.edits.now?.product?.find((product) => product.id === id)?.name ?? "";
    form.toggleAttribute("hidden", false);
    beside(form, this.map.pixels(at), this.map.size, OFF_PX);
    name.select();
  }

  keep() {
    const name = this.parts.name.value;
    const { now } = this.onMap.edits;
    this.end((id) => now && this.onMap.change(named(now, id, name)));
  }

  /** @param {(id: number) => unknown} then */
  end(then) {
    const { id } = this;
    this.close();
    if (id !== null) then(id);
  }

  close() {
    const { form } = this.parts;
    const hadHand = form.contains(document.activeElement);
    this.id = null;
    form.toggleAttribute("hidden", true);
    if (hadHand) this.map.svg.focus();
  }
}
