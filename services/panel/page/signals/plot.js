// A plot of uPlot's in a box of the page: as large as the box, in the page's colours.

import { Plot } from "../vendor/uplot.js";

/** @typedef {{ ink: string, quiet: string, accent: string, edge: string, panel: string }} Colours */

/**
 * The page's colours in the theme in use; they are filled in before anything is drawn.
 *
 * @type {Colours}
 */
export const colours = { ink: "", quiet: "", accent: "", edge: "", panel: "" };

/**
 * Reads the colours where they have changed; returns whether they have.
 *
 * @param {HTMLElement} element one whose border, text and ground have them
 * @returns {boolean}
 */
export function readColours(element) {
  const style = getComputedStyle(element);
  const ink = style.color;
  if (ink === colours.ink) return false;
  const [accent, quiet] = [style.getPropertyValue("--accent"), style.getPropertyValue("--quiet")];
  Object.assign(colours, { ink, quiet, accent, edge: style.borderTopColor, panel: style.backgroundColor });
  return true;
}

/** An axis whose figures are written so. */
export function axis(values, more) {
  const edge = () => colours.edge;
  return {
    stroke: () => colours.quiet, font: "12px system-ui, sans-serif", gap: 4, values,
    grid: { stroke: edge, width: 1 }, ticks: { stroke: edge, width: 1, size: 4 }, ...more,
  };
}

export class Box {
  /**
   * @param {HTMLElement} parent
   * @param {() => object} options what uPlot is to draw, without a size
   */
  constructor(parent, options) {
    this.element = document.createElement("div");
    this.element.className = "plot";
    parent.append(this.element);
    this.options = options;
    this.plot = null;
    this.size = { width: 0, height: 0 };
    // To ask for the size would lay the page out each time.
    new ResizeObserver(([{ contentRect: { width, height } }]) => (this.size = { width: Math.floor(width), height: Math.floor(height) })).observe(this.element);
  }

  /**
   * The plot in the box's size; null while nobody sees the box.
   *
   * @param {number[][]} data
   */
  ready(data) {
    const { width, height } = this.size;
    if (width < 60 || height < 40) return null;
    this.plot ??= new Plot({ ...this.size, legend: { show: false }, ...this.options() }, data, this.element);
    if (this.plot.width !== width || this.plot.height !== height) this.plot.setSize(this.size);
    return this.plot;
  }
}
