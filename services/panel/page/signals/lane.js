// One lane: what it shows and its figures at the left, its curves with axes at the right.

import { Box, axis, colours } from "./plot.js";
import { GAP_MS } from "./figures.js";
import { ticks, timeOfDay, written } from "./lanes.js";
import { put, say } from "../words/words.js";

/** The height of the time axis, which only the lowest lane has, in pixels. */
const TIMES_PX = 24;
/** The width of the axis of figures: all lanes have the same. */
const FIGURES_PX = 48;
/** From pixels to the next, no zoom is meant. */
const LEAST_DRAG_PX = 4;

/** The stronger line where the figures are 0. */
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
    /** @type {(number | null)[][]} */
    this.data = [[], ...lane.curves.map(() => [])];
    this.element = document.createElement("section");
    this.element.className = "lane";
    // What the strip of the same name leads to.
    this.element.tabIndex = -1;
    this.element.dataset.lane = lane.word;
    this.title = document.createElement("h3");
    const list = document.createElement("dl");
    this.curves = lane.curves.map(() => {
      const [row, name, value] = ["div", "dt", "dd"].map((tag) => document.createElement(tag));
      row.append(name, value);
      list.append(row);
      return { name, value };
    });
    const legend = document.createElement("div");
    legend.append(this.title, list);
    this.element.append(legend);
    parent.append(this.element);
    this.box = new Box(this.element, () => this.options());
  }

  /** What uPlot draws. */
  options() {
    const { lane, shared } = this;
    const stroke = [() => colours.accent, () => colours.ink];
    return {
      ms: 1,
      padding: [8, 12, shared.isLast ? 0 : 8, 0],
      scales: { x: { time: true }, y: { range: (_, least, most) => lane.range(least, most) } },
      axes: [
        axis((_, at) => at.map((time) => (shared.isLast ? timeOfDay(time) : "")), { size: shared.isLast ? TIMES_PX : 0, space: 90 }),
        axis((_, values) => ticks(values), { size: FIGURES_PX, space: 20 }),
      ],
      series: [{}, ...lane.curves.map((_, index) => ({
        stroke: stroke[index], width: 1.5, dash: index ? [4, 3] : undefined, points: { show: false },
      }))],
      cursor: {
        y: false,
        sync: { key: "signals", setSeries: false, filters: { pub: (kind) => kind === "mousemove" || kind === "mouseleave" } },
        drag: { setScale: false, dist: LEAST_DRAG_PX },
        points: { size: 9, width: 2, fill: () => colours.panel, stroke: (_, index) => stroke[index - 1]() },
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
    this.data = [at, ...this.lane.curves.map(({ key }) => of[key])];
    const plot = this.box.ready(this.data);
    plot?.batch(() => {
      plot.setData(this.data, false);
      plot.setScale("x", { min: from, max: to });
    });
    this.tell();
  }

  /** Its name, and its figures at the cursor or the newest. */
  tell() {
    const { lane, data } = this;
    const at = this.at();
    const row = nearest(data[0], at);
    put(this.title, say(lane.title));
    this.curves.forEach(({ name, value }, index) => {
      const { label, word } = lane.curves[index];
      const figure = row === null ? null : data[index + 1][row];
      put(name, label ?? say(word));
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

/** The row of a time, or the last one without a time; null if nothing was known near it. */
function nearest(times, at) {
  if (at === null) return times.length ? times.length - 1 : null;
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < at) low = middle + 1;
    else high = middle;
  }
  const row = low > 0 && at - times[low - 1] < times[low] - at ? low - 1 : low;
  return Math.abs(times[row] - at) <= GAP_MS ? row : null;
}
