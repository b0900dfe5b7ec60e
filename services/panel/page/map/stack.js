// The list of goods that stand on the map as one: each with what it is and what a click on it does, as where it stands
// alone.

/** @import { Point, Target } from "./grid.js" */
/** @import { Offer } from "./offers.js" */

import { beside } from "../parts/beside.js";

/** How far it stays from what it is about, in pixels. */
const OFF_PX = 16;

export class Stack {
  /**
   * @param {HTMLElement} box
   * @param {(target: Target) => Offer} offers
   * @param {(words: string) => void} tell says why a click does nothing
   */
  constructor(box, offers, tell) {
    this.box = box;
    this.offers = offers;
    this.tell = tell;
    /**
     * Where the keys were before.
     *
     * @type {Element | null}
     */
    this.before = null;
    addEventListener("pointerdown", ({ target }) => target instanceof Node && !box.contains(target) && this.close());
    box.addEventListener("focusout", ({ relatedTarget }) => relatedTarget instanceof Node && !box.contains(relatedTarget) && this.close());
  }

  /**
   * Shows these goods at a point of the map; `room` is the size of the map.
   *
   * @param {string[]} goods their numbers
   * @param {Point} at in mm
   * @param {Point} pixel the same in pixels
   * @param {{ width: number, height: number }} room
   */
  open(goods, at, pixel, room) {
    const { box } = this;
    this.before = document.activeElement;
    box.replaceChildren(...goods.map((id) => this.row(id, at)));
    box.toggleAttribute("hidden", false);
    beside(box, pixel, room, OFF_PX);
    box.querySelector("button")?.focus();
  }

  close() {
    const { box, before } = this;
    if (box.hidden) return;
    const isInside = box.contains(document.activeElement);
    box.toggleAttribute("hidden", true);
    if (isInside && before instanceof SVGElement) before.focus();
  }

  /**
   * @param {string} id
   * @param {Point} at
   */
  row(id, at) {
    const row = document.createElement("button");
    row.type = "button";
    row.dataset.product = id;
    const offer = () => this.offers({ kind: "good", id, at });
    const { what = "", does, why = "" } = offer();
    const [name, act] = [document.createElement("strong"), document.createElement("span")];
    name.textContent = what;
    act.textContent = does ?? why;
    row.append(name, act);
    row.ariaDisabled = String(!does);
    row.onclick = () => {
      // It may be another one by now.
      const { act, why = "" } = offer();
      if (!act) return this.tell(why);
      this.close();
      act();
    };
    return row;
  }
}
