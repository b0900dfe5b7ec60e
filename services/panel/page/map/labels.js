// Words that stand at things on the map. They keep their size on the screen, and they yield: none stands over a robot,
// over another one or, where there is room elsewhere, over goods.

import { make, set } from "../parts/svg.js";
import { put } from "../words/words.js";

/** How high a label is, how much wider than its words, and how far it stays from what it belongs to, in pixels. */
const HIGH_PX = 20;
const WIDER_PX = 14;
const OFF_PX = 4;
/** So much further from its thing a label goes to leave goods free, in pixels. */
const SOFT_PX = 40;

export class Labels {
  constructor(svg) {
    this.group = make("g", {}, svg);
    this.all = new Map();
    /** The robot's own is the first, wherever it stands. */
    this.label("chip", "chip");
  }

  label(key, style) {
    let label = this.all.get(key);
    if (!label) {
      const group = make("g", { class: style, hidden: "" }, this.group);
      label = { group, box: make("rect", {}, group), text: make("text", {}, group), wide: 0, off: [0, 0] };
      this.all.set(key, label);
    }
    return label;
  }

  /**
   * Lays the labels that there are now, the most important one first: its key, style and words, the point that it
   * belongs to, and how far from it that thing reaches across and up, in mm of the drawing. `hard` are boxes that
   * none may cover, `soft` those that it leaves free where it can, `view` is what is seen.
   */
  lay(labels, { hard, soft, view, px }) {
    const taken = [...hard];
    const keys = new Set(labels.map(({ key }) => key));
    for (const [key, { group }] of this.all) {
      if (!keys.has(key)) group.toggleAttribute("hidden", true);
    }
    for (const { key, style, words, at: [x, y], reach: [across, up] } of labels) {
      const label = this.label(key, style);
      label.group.toggleAttribute("hidden", false);
      set(label.group, "class", style);
      this.size(label, words, px);
      const [wide, high] = [label.wide / 2, (HIGH_PX * px) / 2];
      const [aside, away] = [across + wide + OFF_PX * px, up + high + OFF_PX * px];
      const places = [[0, -away], [0, away], [aside, 0], [-aside, 0], [aside, -away], [-aside, -away], [aside, away], [-aside, away]]
        .flatMap(([dx, dy]) => [1, 1.6, 2.4, 3.5].map((far) => [dx * far, dy * far]));
      const box = ([dx, dy]) => [x + dx - wide, y + dy - high, x + dx + wide, y + dy + high];
      const isOver = (place, boxes) => boxes.some((other) => meets(box(place), other));
      // The nearest one that is seen; to stay off goods it goes a little further.
      const free = places.filter((place) => !isOver(place, taken));
      const cost = (place) => Math.hypot(...place) + (isOver(place, soft) ? SOFT_PX * px : 0) + (isInside(box(place), view) ? 0 : 1e6);
      const off = free.reduce((best, place) => (cost(place) < cost(best) ? place : best), free[0] ?? places.at(-1));
      label.off = off;
      taken.push(box(off));
      move(label, [x, y]);
    }
  }

  /** Moves a label with the thing that it belongs to, until it is laid anew. */
  follow(key, at) {
    const label = this.all.get(key);
    if (label && !label.group.hasAttribute("hidden")) move(label, at);
  }

  size(label, words, px) {
    const shown = `${words} ${px}`;
    if (label.shown === shown) return;
    label.shown = shown;
    put(label.text, words);
    set(label.text, "y", 4 * px);
    label.wide = label.text.getComputedTextLength() + WIDER_PX * px;
    const attributes = { x: -label.wide / 2, y: (-HIGH_PX * px) / 2, width: label.wide, height: HIGH_PX * px, rx: 3 * px };
    for (const [key, value] of Object.entries(attributes)) set(label.box, key, value.toFixed(1));
  }
}

function move({ group, off }, [x, y]) {
  set(group, "transform", `translate(${(x + off[0]).toFixed(1)} ${(y + off[1]).toFixed(1)})`);
}

/** Whether two boxes have a point in common; each is left, top, right and bottom. */
export function meets(a, b) {
  return a[0] < b[2] && a[2] > b[0] && a[1] < b[3] && a[3] > b[1];
}

const isInside = (a, b) => a[0] >= b[0] && a[1] >= b[1] && a[2] <= b[2] && a[3] <= b[3];
