// What stands beside the lanes: how long the path has taken as a histogram, and what the link has lost.

import { KEPT_MS } from "./figures.js";
import { micros, ticks, timeOfDay, written } from "./lanes.js";
import { Box, LETTERS, axis, colours } from "./plot.js";
import { Plot } from "../vendor/uplot.js";
import { add } from "./add.js";
import { put, say } from "../words/words.js";

/** What is marked of all frames: how many of them were at least as fast. */
const PARTS = { p50: 0.5, p99: 0.99, "p99.9": 0.999 };
/** Of these a line stands in the picture. */
const MARKED = ["p50", "p99", "max"];

export class Histogram {
  /** @param {HTMLElement} parent */
  constructor(parent) {
    this.title = add(parent, "h3");
    this.box = new Box(parent, () => this.options());
    const list = add(parent, "dl", { className: "marks" });
    this.figures = [...Object.keys(PARTS), "max"].map((name) => {
      const row = add(list, "div");
      add(row, "dt", { textContent: name });
      return { name, element: add(row, "dd") };
    });
    this.said = add(parent, "p", { className: "quiet" });
    /** @type {Record<string, number | null>} In us; null if there are too few frames. */
    this.marks = {};
  }

  /** @returns {import("./plot.js").Options} */
  options() {
    return {
      padding: [2 * LETTERS, 12, 0, 0],
      cursor: { show: false },
      scales: {
        x: { time: false, distr: 3, range: (_, least, most) => [10 ** Math.floor(Math.log10(least ?? 10)), Math.max(most ?? 0, 1_000)] },
        y: { range: (_plot, _least, most) => [0, Math.max(1, most ?? 1)] },
      },
      axes: [
        { ...axis((_, times) => times.map(micros), 24, 0), splits: ({ scales: { x } }) => decades(x.min, x.max), filter: (_, times) => times },
        axis((_, roots) => roots.map((root) => written(root * root)), 44, 36, true),
      ],
      series: [{}, { paths: Plot.paths.stepped({ align: 1 }), width: 0, fill: () => colours.accent, points: { show: false } }],
      hooks: { draw: [(plot) => this.mark(plot)] },
    };
  }

  /** @param {import("../station/quantile.js").Frames} frames */
  draw(frames) {
    const { from, counts } = frames.steps();
    const total = counts.reduce((sum, count) => sum + count, 0);
    const quantiles = Object.entries(PARTS).map(([name, part]) => [name, frames.quantile(part)]);
    this.marks = { ...Object.fromEntries(quantiles), max: total ? frames.longest : null };
    const data = [from, counts.map(Math.sqrt)];
    this.box.ready(data)?.setData(data);
    put(this.title, say("path_histogram"));
    for (const { name, element } of this.figures) {
      const us = this.marks[name] ?? null;
      put(element, us === null ? "\u2013" : micros(us));
    }
    put(this.said, total ? say("frames_told", total) : say("frames_none"));
  }

  /**
   * Draws a line with its name for each mark.
   *
   * @param {import("./plot.js").Picture} plot
   */
  mark({ ctx, bbox, valToPos }) {
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.font = `600 ${LETTERS * ratio}px system-ui, sans-serif`;
    ctx.textBaseline = "bottom";
    ctx.fillStyle = colours.ink;
    let free = -Infinity;
    for (const name of MARKED) {
      const us = this.marks[name] ?? null;
      if (us === null) continue;
      const x = Math.round(valToPos(us, "x", true));
      if (!(x >= bbox.left && x <= bbox.left + bbox.width + 1)) continue;
      ctx.fillRect(x, bbox.top - 4 * ratio, ratio, bbox.height + 4 * ratio);
      const width = ctx.measureText(name).width;
      const left = Math.max(free, Math.min(x - width / 2, bbox.left + bbox.width - width));
      ctx.fillText(name, left, bbox.top - 6 * ratio);
      free = left + width + 6 * ratio;
    }
    ctx.restore();
  }
}

/**
 * The powers of ten in a range.
 *
 * @param {number} least
 * @param {number} most
 */
function decades(least, most) {
  /** @type {number[]} */
  const all = [];
  for (let power = Math.ceil(Math.log10(least) - 1e-9); 10 ** power <= most * 1.001; power++) all.push(10 ** power);
  return all;
}

export class Losses {
  /** @param {HTMLElement} parent */
  constructor(parent) {
    this.title = add(parent, "h3");
    this.said = add(parent, "p", { className: "quiet" });
    this.box = new Box(parent, () => ({
      ms: 1,
      padding: [8, 12, 0, 0],
      cursor: { show: false },
      scales: { x: { time: true, range: (_, least, most) => [(least ?? 0) - 30_000, (most ?? 0) + 30_000] }, y: { range: (_plot, _least, most) => [0, Math.max(4, most ?? 0)] } },
      axes: [
        axis((_, at) => at.map((time) => timeOfDay(time).slice(0, 5)), 24, 60),
        axis((_, values) => ticks(values), 44, 20, true),
      ],
      series: [{}, { paths: Plot.paths.bars({ size: [0.7] }), width: 0, fill: () => colours.accent, points: { show: false } }],
    }));
  }

  /**
   * @param {import("./figures.js").Columns} columns
   * @param {number} until
   */
  draw(columns, until) {
    const minutes = columns.lostByMinute(until);
    const data = [minutes.map((_, index) => until - KEPT_MS + (index + 0.5) * 60_000), minutes];
    this.box.ready(data)?.setData(data);
    put(this.title, say("lost_by_minute"));
    put(this.said, say("lost_in_all", minutes.reduce((sum, lost) => sum + lost, 0)));
  }
}
