// Setting up on the map: what a click, a key or a drag does to the warehouse's things there, and what is drawn for it.

/** @import { Grip } from "../map/aim.js" */
/** @import { Point, SquareSide, Target } from "../map/grid.js" */
/** @import { Box } from "../map/labels.js" */
/** @import { WarehouseMap } from "../map/map.js" */
/** @import { Offer } from "../map/offers.js" */
/** @import { Warehouse } from "../station/robot.js" */
/** @import { Edits } from "./edits.js" */

import { BEYOND } from "../map/floor.js";
import { make, set } from "../parts/svg.js";
import { decimal, put, say } from "../words/words.js";
import { delivered, freeNumber, moved, placed, removed, resized } from "./edits.js";

/** How long and how wide a handle is, and how far from the floor its length is written, in pixels. */
const [LONG_PX, THIN_PX] = [40, 12];
const LENGTH_PX = 52;

export class OnMap {
  /**
   * @param {WarehouseMap} map
   * @param {object} page
   * @param {Edits} page.edits the changes
   * @param {() => void} page.changed draws them
   * @param {() => boolean} page.mayEdit whether this page may change anything
   */
  constructor(map, { edits, changed, mayEdit }) {
    this.map = map;
    this.edits = edits;
    this.changed = changed;
    this.mayEdit = mayEdit;
    /**
     * The goods that a click moves.
     *
     * @type {number | null}
     */
    this.carried = null;
    this.group = make("g", { class: "set-up", hidden: "" });
    // No robot is covered by it.
    map.others.before(this.group);
    /** @param {string} style */
    const hidden = (style) => make("rect", { class: style, hidden: "" }, this.group);
    this.ghost = hidden("new-size");
    this.spot = hidden("new-place");
    this.size = make("text", { class: "size", hidden: "" }, this.group);
    /** @param {string} edge */
    const length = (edge) => make("text", { class: "size", "data-length": edge }, this.group);
    this.lengths = { right: length("right"), up: length("up") };
    this.corners = [0, 1, 2, 3].map(() => make("circle", { class: "corner" }, this.group));
    /** @param {string} edge */
    const handle = (edge) => make("rect", { class: "handle", "data-edge": edge }, this.group);
    this.handles = { right: handle("right"), up: handle("up") };
  }

  /** @param {Warehouse} warehouse */
  change(warehouse) {
    this.carried = null;
    this.map.tell();
    if (this.edits.change(warehouse)) this.changed();
  }

  /**
   * Lets the next click on the side of a square move goods there.
   *
   * @param {number} id
   */
  take(id) {
    this.carried = id;
    this.map.tell(say("move_how", id));
  }

  /** @param {number} id */
  remove(id) {
    if (this.edits.now) this.change(removed(this.edits.now, id));
  }

  /**
   * What a thing is and what a click on it does, as in `offers.js`.
   *
   * @param {Target} target
   * @param {(id: number, at: Point) => void} rename
   * @returns {Offer}
   */
  offers(target, rename) {
    const { now } = this.edits;
    if (!now) return { why: say("no_map") };
    const offer = this.offer(target, now, rename);
    return this.mayEdit() ? offer : { what: offer.what ?? "", why: say("viewer") };
  }

  /**
   * @param {Target} target
   * @param {Warehouse} now
   * @param {(id: number, at: Point) => void} rename
   * @returns {Offer}
   */
  offer(target, now, rename) {
    if (target.kind === "square") return this.square(target, now);
    const { kind, id, at } = target;
    if (kind === "good") {
      const { name } = now.product?.find((product) => String(product.id) === id) ?? {};
      return { what: say("goods_numbered", name ? `${id} ${name}` : id), does: say("does_name"), act: () => rename(Number(id), at) };
    }
    if (kind === "corner") {
      const [x = 0, y = 0] = id.split(",").map(Number);
      const what = say("tip_corner", `${x}, ${y}`);
      if (String(now.delivery) === id) return { what, why: say("is_delivery") };
      return { what, does: say("does_deliver"), act: () => this.change(delivered(now, [x, y])) };
    }
    const [columns, rows] = now.size;
    if (id === "right") return { what: say("tip_edge_right"), does: say("does_edge_right"), act: () => this.change(resized(now, [columns + 1, rows])) };
    return { what: say("tip_edge_up"), does: say("does_edge_up"), act: () => this.change(resized(now, [columns, rows + 1])) };
  }

  /**
   * @param {SquareSide} target
   * @param {Warehouse} now
   * @returns {Offer}
   */
  square({ square, side }, now) {
    const what = say("tip_square", square.join(", "), say(side));
    const { carried } = this;
    if (carried !== null) return { what, does: say("does_move", carried), act: () => this.change(moved(now, carried, square, side)) };
    return { what, does: say("does_goods", freeNumber(now)), act: () => this.change(placed(now, square, side)) };
  }

  /**
   * What a drag does that begins on a thing; null where it moves the map.
   *
   * @param {Target | null} target
   * @returns {Grip | null}
   */
  grip(target) {
    if (!this.mayEdit()) return null;
    if (target?.kind === "edge") return this.stretch(target.id);
    return target?.kind === "good" ? this.carry(Number(target.id)) : null;
  }

  /**
   * @param {string} edge
   * @returns {Grip}
   */
  stretch(edge) {
    const { edits, map, ghost, size } = this;
    /** @type {Warehouse | null} */
    let wanted = null;
    return {
      move: ([x, y]) => {
        const { now } = edits;
        if (!now) return;
        const { side } = map;
        const [columns, rows] = now.size;
        wanted = resized(now, edge === "right" ? [Math.round((x - BEYOND) / side), rows] : [columns, Math.round((y - BEYOND) / side)]);
        const [width, height] = [wanted.size[0] * side + 2 * BEYOND, wanted.size[1] * side + 2 * BEYOND];
        box(ghost, [-BEYOND, BEYOND - height, width, height]);
        put(size, wanted.size.join(" × "));
        write(size, [x, -y - 16 * map.px]);
      },
      end: () => edits.now && wanted && this.change(resized(edits.now, wanted.size)),
      cancel: () => [ghost, size].forEach(hide),
    };
  }

  /**
   * @param {number} id
   * @returns {Grip}
   */
  carry(id) {
    const { edits, map, spot } = this;
    /** @type {SquareSide | null} */
    let place = null;
    return {
      move: (at) => {
        place = map.sideAt(at);
        if (place) box(spot, mark(place, map.side));
        else hide(spot);
      },
      end: () => edits.now && place && this.change(moved(edits.now, id, place.square, place.side)),
      cancel: () => hide(spot),
    };
  }

  /**
   * Shows what only setting up needs, at the scale of the map.
   *
   * @param {boolean} isOpen
   */
  draw(isOpen) {
    const { map, edits: { now }, lengths, handles } = this;
    this.group.toggleAttribute("hidden", !isOpen || !now);
    if (!isOpen) this.carried = null;
    if (!isOpen || !now) return;
    const { px, side } = map;
    const [columns, rows] = now.size;
    const [wide, high] = [columns * side, rows * side];
    const [long, thin] = [LONG_PX * px, THIN_PX * px];
    const [right, up] = [wide + BEYOND, high + BEYOND];
    box(handles.right, [right - thin, -high / 2 - long / 2, thin, long]);
    box(handles.up, [wide / 2 - long / 2, -up, long, thin]);
    this.corners.forEach((corner, index) => {
      const [x, y] = [index % 2 ? columns : 0, index > 1 ? rows : 0];
      const isIt = String(now.delivery) === String([x, y]);
      for (const [key, value] of Object.entries({ cx: x * side, cy: -y * side, class: isIt ? "corner chosen" : "corner" })) set(corner, key, value);
    });
    /** @param {number} squares */
    const length = (squares) => say("squares", squares, decimal((squares * side) / 1_000));
    put(lengths.right, length(columns));
    write(lengths.right, [wide / 2, -up - 20 * px]);
    put(lengths.up, length(rows));
    write(lengths.up, [right + LENGTH_PX * px, -high / 2]);
    set(lengths.up, "transform", `rotate(-90 ${right + LENGTH_PX * px} ${-high / 2})`);
  }
}

/**
 * Where goods would stand at a side of a square.
 *
 * @param {SquareSide} place
 * @param {number} side
 * @returns {Box}
 */
function mark({ at: [x, y] }, side) {
  const half = side * 0.12;
  return [x - half, -y - half, 2 * half, 2 * half];
}

/**
 * @param {SVGElement} rect
 * @param {Box} box left, top, width and height
 */
function box(rect, [x, y, width, height]) {
  rect.removeAttribute("hidden");
  for (const [key, value] of Object.entries({ x, y, width, height })) set(rect, key, Math.round(value));
}

/**
 * @param {SVGElement} text
 * @param {Point} at
 */
function write(text, [x, y]) {
  text.removeAttribute("hidden");
  set(text, "x", Math.round(x));
  set(text, "y", Math.round(y));
}

/** @param {SVGElement} element */
const hide = (element) => element.setAttribute("hidden", "");
