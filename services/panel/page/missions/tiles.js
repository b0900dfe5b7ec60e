// All goods as tiles, of which a click orders one, and the field that finds them by number or name. What a tile does
// is said where the map's clicks are (map/offers.js).

/** @import { Offer, Tile } from "../map/offers.js" */
/** @import { Product, Robot } from "../station/robot.js" */

import { turnOf } from "../map/goods.js";
import { parcel, titleOf } from "../parts/parcel.js";
import { isText } from "../bar/stop.js";
import { put, say } from "../words/words.js";
import { matches } from "./reorder.js";

/** So many of the goods that match are named. */
const SOME = 3;

export class Tiles {
  /**
   * @param {{ form: HTMLFormElement, field: HTMLInputElement, tiles: HTMLElement, said: HTMLElement }} parts
   * @param {object} page
   * @param {(tile: Tile) => Offer} page.offers says what goods are and what a click does
   * @param {() => boolean} page.isOff whether keys are others'
   */
  constructor({ form, field, tiles, said }, { offers, isOff }) {
    this.form = form;
    this.field = field;
    this.tiles = tiles;
    this.said = said;
    this.offers = offers;
    /** @type {Product[]} */
    this.goods = [];
    /**
     * By the numbers of the goods.
     *
     * @type {Map<string, HTMLButtonElement>}
     */
    this.buttons = new Map();
    this.shown = "";
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.submit();
    });
    field.addEventListener("input", () => this.find());
    addEventListener("keydown", (event) => {
      if (event.key !== "/" || event.ctrlKey || event.altKey || event.metaKey || isText(event.target) || isOff()) return;
      event.preventDefault();
      field.focus();
    });
  }

  /** @param {Product[]} goods */
  setGoods(goods) {
    this.goods = goods;
    this.buttons = new Map(goods.map(({ id, name }) => [String(id), this.tile(String(id), name)]));
    this.tiles.replaceChildren(...this.buttons.values());
    this.find();
  }

  /**
   * @param {string} id
   * @param {string} [name]
   */
  tile(id, name) {
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.product = id;
    button.append(parcel(id), Object.assign(document.createElement("span"), { textContent: name ?? "" }));
    button.onclick = () => this.order(id);
    return button;
  }

  /**
   * Orders goods, or says why not.
   *
   * @param {string} id
   */
  order(id) {
    const { what, why, act } = this.offer(id);
    put(this.said, why ? `${what}: ${why}` : "");
    act?.();
  }

  /**
   * What a click on the tile does now.
   *
   * @param {string} id
   */
  offer(id) {
    return this.offers({ kind: "good", id, hand: { beside: this.form, said: this.said } });
  }

  /**
   * @param {Robot | null} robot
   * @param {boolean} isOld
   */
  draw(robot, isOld) {
    const { state, queue, gone, jobs } = robot ?? {};
    const shown = JSON.stringify([robot?.name, isOld, state?.product, state?.phase, queue, [...(gone ?? [])], jobs?.done[0]?.at, this.goods, document.documentElement.lang]);
    if (this.shown === shown) return;
    this.shown = shown;
    for (const [id, button] of this.buttons) {
      const { what, does, why } = this.offer(id);
      const turn = robot ? turnOf(robot, id) : -1;
      const looks = [turn === 0 && "wanted", turn > 0 && "queued", robot?.gone.has(id) && "gone"].filter(Boolean).join(" ");
      if (button.className !== looks) button.className = looks;
      const said = `${what}: ${why ?? does}`;
      if (button.title === said) continue;
      button.title = said;
      button.ariaLabel = said;
      button.ariaDisabled = String(Boolean(why));
    }
  }

  /** Shows what the text in the field may mean. */
  find() {
    const { value } = this.field;
    const found = matches(this.goods, value);
    for (const [id, button] of this.buttons) button.toggleAttribute("hidden", !found.some((one) => String(one.id) === id));
    if (!value.trim()) return;
    const [one] = found;
    put(this.said, one ? (found.length > 1 ? "" : say("search_one", titleOf(one))) : say("search_none"));
  }

  /** Orders what is meant, if that is one. */
  submit() {
    const { field, said } = this;
    if (!this.goods.length) return put(said, say("no_map"));
    const text = field.value.trim();
    if (!text) return field.focus();
    const found = matches(this.goods, text);
    const some = found.slice(0, SOME).map(titleOf).join(", ");
    if (found.length > 1) return put(said, say("search_many", found.length > SOME ? `${some} …` : some));
    const [one] = found;
    if (!one) return put(said, say("search_none"));
    field.value = "";
    this.find();
    this.order(String(one.id));
  }
}
