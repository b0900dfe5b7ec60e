// Setting up on the map: what a click, a key or a drag does to the warehouse's things there, and what is drawn for it.

import { BEYOND } from "../map/floor.js";
import { make, set } from "../parts/svg.js";
import { decimal, put, say } from "../words/words.js";
import { delivered, freeNumber, moved, named, placed, removed, resized } from "./edits.js";

/** How long and how wide a handle is, and how far from the floor its length is written, in pixels. */
const HANDLE_PX = [40, 12];
const LENGTH_PX = 52;

export class OnMap {
  /** `edits` are the changes, `changed` draws them; `mayEdit` says whether this page may change anything. */
  constructor(map, parts, { edits, changed, mayEdit }) {
    Object.assign(this, { map, parts, edits, changed, mayEdit, carried: null, renamed: null });
    this.group = make("g", { class: "set-up", hidden: "" });
    // No robot is covered by it.
    map.others.before(this.group);
    this.ghost = make("rect", { class: "new-size", hidden: "" }, this.group);
    this.spot = make("rect", { class: "new-place", hidden: "" }, this.group);
    this.size = make("text", { class: "size", hidden: "" }, this.group);
    this.lengths = ["right", "up"].map((edge) => make("text", { class: "size", "data-length": edge }, this.group));
    this.corners = [0, 1, 2, 3].map(() => make("circle", { class: "corner" }, this.group));
    this.handles = ["right", "up"].map((edge) => make("rect", { class: "handle", "data-edge": edge }, this.group));
    parts.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.keepName();
    });
    parts.close.onclick = () => this.closeName();
    parts.move.onclick = () => {
      this.carried = this.renamed;
      this.closeName();
      map.tell(say("move_how", this.carried));
    };
    parts.remove.onclick = () => {
      const id = this.renamed;
      this.closeName();
      this.change(removed(edits.now, id));
    };
  }

  change(warehouse) {
    this.carried = null;
    this.map.tell();
    if (this.edits.change(warehouse)) this.changed();
  }

  /** What the things are and what a click does, as in `offers.js`. */
  offers(target) {
    const { edits } = this;
    // A click beside the field leaves it, as Enter does.
    if (this.renamed !== null) return { act: () => this.keepName() };
    const offer = {
      square: ({ square, side }) => {
        const what = say("tip_square", square.join(", "), say(side));
        if (this.carried !== null) return { what, does: say("does_move", this.carried), act: () => this.change(moved(edits.now, this.carried, square, side)) };
        return { what, does: say("does_goods", freeNumber(edits.now)), act: () => this.change(placed(edits.now, square, side)) };
      },
      good: ({ id, at }) => {
        const { name } = edits.now.product.find((product) => String(product.id) === id) ?? {};
        return { what: say("change_goods", name ? `${id} ${name}` : id), does: say("does_name"), act: () => this.openName(Number(id), at) };
      },
      corner: ({ id }) => {
        const corner = id.split(",").map(Number);
        const isIt = String(edits.now.delivery ?? [0, 0]) === id;
        const what = say("tip_corner", corner.join(", "));
        return isIt ? { what, why: say("is_delivery") } : { what, does: say("does_deliver"), act: () => this.change(delivered(edits.now, corner)) };
      },
      edge: ({ id }) => {
        const [x, y] = edits.now.size;
        const [what, does] = { right: ["tip_edge_right", "does_edge_right"], up: ["tip_edge_up", "does_edge_up"] }[id];
        return { what: say(what), does: say(does), act: () => this.change(resized(edits.now, id === "right" ? [x + 1, y] : [x, y + 1])) };
      },
    }[target.kind](target);
    return this.mayEdit() ? offer : { what: offer.what, why: say("viewer") };
  }

  /** What a drag that begins on a thing does meanwhile and at its end; null where it moves the map. */
  grip(target) {
    if (!this.mayEdit()) return null;
    if (target?.kind === "edge") return this.stretch(target.id);
    return target?.kind === "good" ? this.carry(Number(target.id)) : null;
  }

  stretch(edge) {
    const { edits, map, ghost, size } = this;
    let wanted = edits.now;
    return {
      move: ([x, y]) => {
        const { side } = map;
        const [columns, rows] = edits.now.size;
        wanted = resized(edits.now, edge === "right" ? [Math.round((x - BEYOND) / side), rows] : [columns, Math.round((y - BEYOND) / side)]);
        const [width, height] = wanted.size.map((squares) => squares * side + 2 * BEYOND);
        box(ghost, [-BEYOND, BEYOND - height, width, height]);
        put(size, wanted.size.join(" × "));
        write(size, [x, -y - 16 * map.px]);
      },
      end: () => this.change(wanted),
      cancel: () => [ghost, size].forEach(hide),
    };
  }

  carry(id) {
    const { edits, map, spot } = this;
    let place = null;
    return {
      move: (at) => {
        place = map.sideAt(at);
        spot.toggleAttribute("hidden", !place);
        if (place) box(spot, mark(place, map.side));
      },
      end: () => place && this.change(moved(edits.now, id, place.square, place.side)),
      cancel: () => hide(spot),
    };
  }

  /** The field for a name, beside its goods. */
  openName(id, at) {
    const { form, name, number } = this.parts;
    this.renamed = id;
    put(number, String(id));
    name.value = this.edits.now.product.find((product) => product.id === id)?.name ?? "";
    form.hidden = false;
    const [x, y] = this.map.pixels(at);
    const { clientWidth: width, clientHeight: height } = form.parentElement;
    const below = y + form.offsetHeight + 32 < height;
    form.style.left = `${Math.round(Math.max(4, Math.min(width - form.offsetWidth - 4, x - form.offsetWidth / 2)))}px`;
    form.style.top = `${Math.round(below ? y + 24 : Math.max(4, y - 24 - form.offsetHeight))}px`;
    name.select();
  }

  keepName() {
    const [id, name] = [this.renamed, this.parts.name.value];
    this.closeName();
    this.change(named(this.edits.now, id, name));
  }

  closeName() {
    const had = this.parts.form.contains(document.activeElement);
    this.renamed = null;
    this.parts.form.hidden = true;
    if (had) this.map.svg.focus();
  }

  /** Shows what only setting up needs, at the scale of the map. */
  draw(isOpen) {
    const { map, edits: { now } } = this;
    this.group.toggleAttribute("hidden", !isOpen || !now);
    if (!isOpen) {
      this.carried = null;
      if (this.renamed !== null) this.closeName();
    }
    if (!isOpen || !now) return;
    const { px, side } = map;
    const [columns, rows] = now.size;
    const [wide, high] = [columns * side, rows * side];
    const [long, thin] = HANDLE_PX.map((pixels) => pixels * px);
    const [right, up] = [wide + BEYOND, high + BEYOND];
    box(this.handles[0], [right - thin, -high / 2 - long / 2, thin, long]);
    box(this.handles[1], [wide / 2 - long / 2, -up, long, thin]);
    [[0, 0], [wide, 0], [0, high], [wide, high]].forEach(([x, y], index) => {
      const isIt = String(now.delivery ?? [0, 0]) === String([x / side, y / side].map(Math.round));
      for (const [key, value] of Object.entries({ cx: x, cy: -y, class: isIt ? "corner chosen" : "corner" })) set(this.corners[index], key, value);
    });
    const length = (squares) => say("squares", squares, decimal((squares * side) / 1_000));
    put(this.lengths[0], length(columns));
    write(this.lengths[0], [wide / 2, -up - 20 * px]);
    put(this.lengths[1], length(rows));
    write(this.lengths[1], [right + LENGTH_PX * px, -high / 2]);
    set(this.lengths[1], "transform", `rotate(-90 ${right + LENGTH_PX * px} ${-high / 2})`);
  }
}

/** Where goods would stand at a side of a square. */
function mark({ at: [x, y] }, side) {
  const half = side * 0.12;
  return [x - half, -y - half, 2 * half, 2 * half];
}

function box(rect, [x, y, width, height]) {
  rect.removeAttribute("hidden");
  for (const [key, value] of Object.entries({ x, y, width, height })) set(rect, key, Math.round(value));
}

function write(text, [x, y]) {
  text.removeAttribute("hidden");
  set(text, "x", Math.round(x));
  set(text, "y", Math.round(y));
}

const hide = (element) => element.setAttribute("hidden", "");
