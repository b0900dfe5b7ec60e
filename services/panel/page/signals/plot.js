// A plot of uPlot's in a box of the page: as large as the box, in the page's colours.

import { Plot } from "../vendor/uplot.js";

/** @typedef {(number | null)[][]} Data The places along x, and then what each curve has there. */
/**
 * What is used here of a plot of uPlot's. Places are in pixels, those on the canvas in the screen's own.
 *
 * @typedef {object} Picture
 * @property {number} width
 * @property {number} height
 * @property {HTMLElement} over
 * @property {CanvasRenderingContext2D} ctx
 * @property {{ left: number, top: number, width: number, height: number }} bbox on the canvas
 * @property {Record<"x" | "y", { min: number, max: number }>} scales
 * @property {{ left: number }} cursor
 * @property {{ left: number, width: number }} select
 * @property {(value: number, scale: "x" | "y", isOnCanvas?: boolean) => number} valToPos
 * @property {(at: number, scale: "x" | "y") => number} posToVal
 * @property {(size: { width: number, height: number }) => void} setSize
 * @property {(data: Data, isScaled?: boolean) => void} setData
 * @property {(scale: "x" | "y", range: { min: number, max: number }) => void} setScale
 * @property {(at: { left: number, top: number }) => void} setCursor
 * @property {(box: { left: number, top: number, width: number, height: number }, isTold: boolean) => void} setSelect
 * @property {(change: () => void) => void} batch
 */
/** @typedef {(plot: Picture, values: number[]) => string[]} Written */
/** @typedef {(plot: Picture, least: number | null, most: number | null) => [number, number]} Range */
/**
 * What is used here of its options.
 *
 * @typedef {object} Options
 * @property {1} [ms]
 * @property {number[]} padding
 * @property {{ x: { time: boolean, distr?: 3, range?: Range }, y: { range: Range } }} scales
 * @property {Axis[]} axes
 * @property {Curve[]} series
 * @property {Cursor} cursor
 * @property {{ draw?: Hook[], drawAxes?: Hook[], setCursor?: Hook[], setSelect?: Hook[] }} [hooks]
 */
/** @typedef {{ values: Written, splits?: (plot: Picture) => number[], filter?: (plot: Picture, values: number[]) => number[] } & Record<string, any>} Axis */
/** @typedef {{ stroke?: () => string, fill?: () => string, width?: number, dash?: number[] | undefined, paths?: unknown, points?: object }} Curve */
/** @typedef {(plot: Picture) => void} Hook */
/**
 * @typedef {object} Cursor
 * @property {boolean} [show]
 * @property {boolean} [y]
 * @property {{ key: string, setSeries: boolean, filters: { pub: (kind: string) => boolean } }} [sync]
 * @property {(plot: Picture, series: number, row: number, at: number) => number | null} [dataIdx]
 * @property {{ setScale: boolean, dist: number }} [drag]
 * @property {{ size: number, width: number, fill: () => string, stroke: (plot: Picture, series: number) => string }} [points]
 * @property {{ dblclick: () => () => void }} [bind]
 */
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

/** How much larger letters are on a screen that stands further away, as in all of the page. */
const SCALE = matchMedia("(min-width: 2400px)").matches ? 1.5 : 1;
/** The size of letters in pixels. */
export const LETTERS = 12 * SCALE;
/** Steps between figures that are whole. */
const WHOLE = Array.from({ length: 7 }, (_, power) => [1, 2, 5].map((step) => step * 10 ** power)).flat();

/**
 * An axis.
 *
 * @param {Written} values how its figures are written
 * @param {number} size how much room it takes, in pixels of a usual screen, as the next one
 * @param {number} space what is left between two figures at least
 * @param {boolean} [isWhole] whether all its figures are whole numbers
 * @returns {Axis}
 */
export function axis(values, size, space, isWhole = false) {
  const line = { stroke: () => colours.edge, width: 1 };
  return {
    stroke: () => colours.quiet, font: `${LETTERS}px system-ui, sans-serif`, gap: 4, values,
    size: size * SCALE, space: space * SCALE, grid: line, ticks: { ...line, size: 4 }, ...(isWhole && { incrs: WHOLE }),
  };
}

export class Box {
  /**
   * @param {HTMLElement} parent
   * @param {() => Options} options what uPlot is to draw, without a size
   */
  constructor(parent, options) {
    this.element = document.createElement("div");
    this.element.className = "plot";
    parent.append(this.element);
    this.options = options;
    /** @type {Picture | null} */
    this.plot = null;
    this.size = { width: 0, height: 0 };
    // To ask for the size would lay the page out each time.
    const watch = new ResizeObserver(([seen]) => {
      if (seen) this.size = { width: Math.floor(seen.contentRect.width), height: Math.floor(seen.contentRect.height) };
    });
    watch.observe(this.element);
  }

  /**
   * The plot in the box's size; null while nobody sees the box.
   *
   * @param {Data} data
   * @returns {Picture | null}
   */
  ready(data) {
    const { width, height } = this.size;
    if (width < 60 || height < 40) return null;
    /** @type {Picture} */
    const plot = (this.plot ??= new Plot({ ...this.size, legend: { show: false }, ...this.options() }, data, this.element));
    if (plot.width !== width || plot.height !== height) plot.setSize(this.size);
    return plot;
  }
}
