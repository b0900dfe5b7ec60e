// One lane: what it shows and its figures at the left, its curves with axes at the right.

import { Box, axis, colours } from "./plot.js";
import { GAP_MS } from "./figures.js";
import { ticks, timeOfDay, written } from "./lanes.js";
import { add } from "./add.js";
import { put, say } from "../words/words.js";

/** The height of the time axis, which only the lowest lane has, in pixels. */
const TIMES_PX = 24;
/** The width of the axis of figures: all lanes have the same. */
const FIGURES_PX = 48;
/** From pixels to the next, no zoom is meant. */
const LEAST_DRAG_PX = 4;

/**
 * The stronger line where the figures are 0.
 *
 * @param {import("./plot.js").Picture} plot
 */
function zero({ ctx, bbox, scales: { y }, valToPos }) {
  if (y.min > 0 || y.max < 0) return;
  const height = Math.round(valToPos(0, "y", true));
  ctx.fillStyle = colours.quiet;
  ctx.fillRect(bbox.left, height, bbox.width, Math.max(1, devicePixelRatio));
}

export class Lane {
  /**
   * @param {HTMLElement} parent
   * @param {import("./lanes.js").Lane} lane
   * @param {{ isLast: boolean, zoom: (from: number, to: number) => void, back: () => void, moved: (at: number | null) => void }} shared
   */
  constructor(parent, lane, shared) {
    this.lane = lane;
    this.shared = shared;
    /** @type {number[]} */
    this.times = [];
    /**
     * The figures of each curve at these times.
     *
     * @type {(number | null)[][]}
     */
    this.data = [];
    // The strip of the same name leads here.
    this.element = add(parent, "section", { className: "lane", tabIndex: -1 });
    this.element.dataset.lane = lane.word;
    const legend = add(this.element, "div");
    this.title = add(legend, "h3");
    const list = add(legend, "dl");
    this.curves = lane.curves.map((curve) => {
      const row = add(list, "div");
      return { ...curve, name: add(row, "dt"), value: add(row, "dd") };
    });
    this.box = new Box(this.element, () => this.options());
  }

  /**
   * What uPlot draws.
   *
   * @returns {import("./plot.js").Options}
   */
  options() {
    const { lane, shared } = this;
    /** @param {number} curve */
    const stroke = (curve) => (curve ? colours.ink : colours.accent);
    return {
      ms: 1,
      padding: [8, 12, shared.isLast ? 0 : 8, 0],
      scales: { x: { time: true }, y: { range: (_, least, most) => lane.range(least, most) } },
      axes: [
        axis((_, at) => at.map((time) => (shared.isLast ? timeOfDay(time) : "")), shared.isLast ? TIMES_PX : 0, 90),
        axis((_, values) => ticks(values), FIGURES_PX, 20, !lane.decimals),
      ],
      series: [{}, ...lane.curves.map((_, index) => ({
        stroke: () => stroke(index), width: 1.5, dash: index ? [4, 3] : undefined, points: { show: false },
      }))],
      cursor: {
        y: false,
        sync: { key: "signals", setSeries: false, filters: { pub: (kind) => kind === "mousemove" || kind === "mouseleave" } },
        // In a gap no curve is marked.
        dataIdx: (_plot, _series, row, at) => (Math.abs((this.times[row] ?? Infinity) - at) <= GAP_MS ? row : null),
        drag: { setScale: false, dist: LEAST_DRAG_PX },
        points: { size: 9, width: 2, fill: () => colours.panel, stroke: (_, series) => stroke(series - 1) },
        bind: { dblclick: () => shared.back },
      },
      hooks: {
        drawAxes: [zero],
        setCursor: [({ cursor: { left }, posToVal }) => {
          this.tell();
          shared.moved(left < 0 ? null : posToVal(left, "x"));
        }],
        setSelect: [(plot) => {
          const { left, width } = plot.select;
          if (!width) return;
          plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          shared.zoom(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
        }],
      },
    };
  }

  /**
   * @param {import("./figures.js").Columns} columns
   * @param {import("./span.js").Range} range
   */
  draw({ at, of }, { from, to }) {
    this.times = at;
    this.data = this.lane.curves.map(({ key }) => of[key]);
    const data = [at, ...this.data];
    const plot = this.box.ready(data);
    plot?.batch(() => {
      plot.setData(data, false);
      plot.setScale("x", { min: from, max: to });
    });
    this.tell();
  }

  /** Its name, and its figures at the cursor or the newest. */
  tell() {
    const { lane, data } = this;
    const row = nearest(this.times, this.at());
    put(this.title, say(lane.title));
    this.curves.forEach(({ label, word, name, value }, index) => {
      const figure = data[index]?.[row] ?? null;
      put(name, label ?? say(word ?? ""));
      put(value, figure === null ? "\u2013" : `${written(figure, lane.decimals)} ${lane.unit}`.trim());
    });
  }

  /** The time at the cursor; null if it is not here. */
  at() {
    const { plot } = this.box;
    return plot && plot.cursor.left >= 0 ? plot.posToVal(plot.cursor.left, "x") : null;
  }

  /**
   * Puts the cursor to a part of the width, from 0 to 1; null takes it away.
   *
   * @param {number | null} part
   */
  point(part) {
    const { plot } = this.box;
    plot?.setCursor(part === null ? { left: -10, top: -10 } : { left: part * plot.over.clientWidth, top: 0 });
  }
}

/**
 * The row of a time, or the last one without a time; -1 if nothing was known near it.
 *
 * @param {number[]} times
 * @param {number | null} at
 */
function nearest(times, at) {
  if (at === null) return times.length - 1;
  /** @param {number} row */
  const off = (row) => Math.abs((times[row] ?? Infinity) - at);
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? 0) < at) low = middle + 1;
    else high = middle;
  }
  const row = off(low - 1) < off(low) ? low - 1 : low;
  return off(row) <= GAP_MS ? row : -1;
}
