// Words that stand at things on the map. They keep their size on the screen, and they yield: none stands over a robot,
// over another one or, where there is room elsewhere, over goods.

import { make, set } from "../parts/svg.js";
import { put } from "../words/words.js";

/** @typedef {[number, number, number, number]} Box Left, top, right and bottom. */
/** @typedef {{ group: SVGElement, box: SVGElement, text: SVGTextContentElement, wide: number, off: [number, number], shown: string }} Label */
/**
 * What is to be said, and where: `at` is the point that it belongs to, `reach` how far from there that thing reaches
 * across and up, in mm of the drawing.
 *
 * @typedef {{ key: string, style: string, words: string, at: [number, number], reach: [number, number] }} Said
 */

/** How high a label is, how much wider than its words, and how far it stays from what it belongs to, in pixels. */
const HIGH_PX = 20;
const WIDER_PX = 14;
const OFF_PX = 4;
/** So much further from its thing a label goes to leave goods free, in pixels. */
const SOFT_PX = 40;

export class Labels {
  /** @param {SVGElement} svg */
  constructor(svg) {
    /** @type {SVGElement} */
    this.group = make("g", {}, svg);
    /** @type {Map<string, Label>} */
    this.all = new Map();
    /** The robot's own is the first, wherever it stands. */
    this.label("chip", "chip");
  }

  /**
   * @param {string} key
   * @param {string} style
   */
  label(key, style) {
    let label = this.all.get(key);
    if (!label) {
      const group = make("g", { class: style, hidden: "" }, this.group);
      label = { group, box: make("rect", {}, group), text: make("text", {}, group), wide: 0, off: [0, 0], shown: "" };
      this.all.set(key, label);
    }
    return label;
  }

  /**
   * Lays the labels that there are now, the most important one first. `hard` are boxes that none may cover, `soft`
   * those that it leaves free where it can, `view` is what is seen, `px` are the mm of one pixel.
   *
   * @param {Said[]} labels
   * @param {{ hard: Box[], soft: Box[], view: Box, px: number }} room
   */
  lay(labels, { hard, soft, view, px }) {
    const taken = [...hard];
    const keys = new Set(labels.map(({ key }) => key));
    for (const [key, { group }] of this.all) {
      if (!keys.has(key)) group.toggleAttribute("hidden", true);
    }
    for (const { key, style, words, at, reach } of labels) {
      const label = this.label(key, style);
      label.group.toggleAttribute("hidden", false);
      set(label.group, "class", style);
      this.size(label, words, px);
      const off = free(at, reach, [label.wide / 2, (HIGH_PX * px) / 2], { hard: taken, soft, view, px });
      label.off = off;
      taken.push(about([at[0] + off[0], at[1] + off[1]], [label.wide / 2, (HIGH_PX * px) / 2]));
      move(label, at);
    }
  }

  /**
   * Moves a label with the thing that it belongs to, until it is laid anew.
   *
   * @param {string} key
   * @param {[number, number]} at
   */
  follow(key, at) {
    const label = this.all.get(key);
    if (label && !label.group.hasAttribute("hidden")) move(label, at);
  }

  /**
   * @param {Label} label
   * @param {string} words
   * @param {number} px
   */
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

/**
 * @param {Label} label
 * @param {[number, number]} at
 */
function move({ group, off }, [x, y]) {
  set(group, "transform", `translate(${(x + off[0]).toFixed(1)} ${(y + off[1]).toFixed(1)})`);
}

/**
 * Where a label of half this width and height stands best, from the point that it belongs to: the nearest place that
 * is free and seen; to stay off goods it goes a little further.
 *
 * @param {[number, number]} at
 * @param {[number, number]} reach
 * @param {[number, number]} half
 * @param {{ hard: Box[], soft: Box[], view: Box, px: number }} room
 * @returns {[number, number]}
 */
export function free([x, y], [across, up], [wide, high], { hard, soft, view, px }) {
  const [aside, away] = [across + wide + OFF_PX * px, up + high + OFF_PX * px];
  /** @type {[number, number][]} */
  const ways = [[0, -away], [0, away], [aside, 0], [-aside, 0], [aside, -away], [-aside, -away], [aside, away], [-aside, away]];
  const places = ways.flatMap(([dx, dy]) => [1, 1.6, 2.4, 3.5].map((far) => ({ dx: dx * far, dy: dy * far })))
    .map(({ dx, dy }) => ({ dx, dy, box: about([x + dx, y + dy], [wide, high]) }));
  /** @type {(box: Box, boxes: Box[]) => boolean} */
  const isOver = (box, boxes) => boxes.some((other) => meets(box, other));
  const open = places.filter(({ box }) => !isOver(box, hard));
  const costs = open.map(({ dx, dy, box }) => Math.hypot(dx, dy) + (isOver(box, soft) ? SOFT_PX * px : 0) + (isInside(box, view) ? 0 : 1e6));
  const best = open[costs.indexOf(Math.min(...costs))] ?? places.at(-1);
  return best ? [best.dx, best.dy] : [0, 0];
}

/**
 * The box about a point.
 *
 * @param {[number, number]} at
 * @param {[number, number]} half
 * @returns {Box}
 */
const about = ([x, y], [wide, high]) => [x - wide, y - high, x + wide, y + high];

/**
 * Whether two boxes have a point in common.
 *
 * @param {Box} a
 * @param {Box} b
 */
export function meets(a, b) {
  return a[0] < b[2] && a[2] > b[0] && a[1] < b[3] && a[3] > b[1];
}

/**
 * @param {Box} a
 * @param {Box} b
 */
const isInside = (a, b) => a[0] >= b[0] && a[1] >= b[1] && a[2] <= b[2] && a[3] <= b[3];
