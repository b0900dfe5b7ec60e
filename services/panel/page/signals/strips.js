// The last minute as strips of a few figures, and the eleven line sensors as a bar.
//
// A strip moves with every picture of the screen. It is not drawn anew for that: what is there is
// shifted by the pixels that time has passed, and what is new is drawn at its end. The library of plots that
// the view of signals has would draw each strip anew for every picture, and would have to be loaded before the
// page's first view.

import { SPAN_MS } from "../station/robot.js";
import { decimal, put, say } from "../words/words.js";

/** @typedef {import("../station/robot.js").Robot} Robot */
/** @typedef {import("../station/robot.js").Moment} Moment */

/**
 * Word, unit, least and most value, keys of the past.
 *
 * @type {[string, string, number, number | null, (keyof Moment)[]][]}
 */
const STRIPS = [
  ["line_error", "", -10, 10, ["line_error"]],
  ["duty", "%", 0, 255, ["left_duty", "right_duty"]],
  ["distance", "cm", 0, 80, ["distance_cm"]],
  ["battery", "V", 9, 13, ["battery"]],
  ["losses", "", 0, null, ["lost"]],
];
export const SENSORS = 11;
const DARK = matchMedia("(prefers-color-scheme: dark)");

/**
 * What each line sensor sees, the leftmost first, 1 for tape; null if the board is not heard. Where it
 * tells only how far the line is off, the sensor above the middle of the tape does.
 *
 * @param {import("../station/robot.js").State} [state]
 * @returns {string | null}
 */
export function sensors({ line_bits: bits, line_error: error } = {}) {
  if (bits || error === undefined) return bits ?? null;
  const middle = Math.round((SENSORS - 1) / 2 + Number(error) / 2);
  return Array.from({ length: SENSORS }, (_, index) => (index === middle ? "1" : "0")).join("");
}

export class Strips {
  /**
   * @param {HTMLElement} parent
   * @param {(word: string) => void} open shows the lane of a strip that somebody has clicked
   */
  constructor(parent, open) {
    /**
     * The theme that the colours are of.
     *
     * @type {string | null}
     */
    this.theme = null;
    this.colours = ["", ""];
    this.strips = STRIPS.map((strip) => new Strip(parent, open, ...strip));
    const [figure, row] = [document.createElement("figure"), document.createElement("div")];
    figure.id = "sensors";
    this.caption = document.createElement("figcaption");
    this.sensors = Array.from({ length: SENSORS }, () => row.appendChild(document.createElement("span")));
    figure.append(this.caption, row);
    parent.append(figure);
  }

  /**
   * Moves the lines: for every picture of the screen.
   *
   * @param {Robot | null} robot
   * @param {number} now
   */
  move(robot, now) {
    for (const strip of this.strips) strip.move(robot, now);
  }

  /**
   * Figures and sensors of a robot at a time.
   *
   * @param {Robot | null} robot
   * @param {number} now
   */
  draw(robot, now) {
    const theme = document.documentElement.dataset.theme ?? String(DARK.matches);
    if (this.theme !== theme) {
      this.theme = theme;
      const style = getComputedStyle(document.body);
      this.colours = [style.getPropertyValue("--accent"), style.getPropertyValue("--quiet")];
    }
    const { colours } = this;
    for (const strip of this.strips) strip.draw(robot, now, colours);
    put(this.caption, say("line_sensors"));
    const seen = sensors(robot?.state);
    this.sensors.forEach((bar, index) => bar.classList.toggle("on", seen?.[index] === "1"));
  }
}

/**
 * Figures with their unit, short enough for a caption.
 *
 * @param {number[]} figures
 * @param {string} unit
 */
function told(figures, unit) {
  if (unit === "µs" && Math.max(...figures) >= 1000) return `${figures.map((us) => decimal(us / 1000)).join(" / ")} ms`;
  // A duty is told in parts of 255.
  if (unit === "%") return `${figures.map((duty) => Math.round(duty / 2.55)).join(" / ")} %`;
  if (unit === "V") return `${figures.map((volts) => decimal(volts)).join(" / ")} V`;
  return `${figures.join(" / ")} ${unit}`.trim();
}

class Strip {
  /**
   * @param {HTMLElement} parent
   * @param {(word: string) => void} open
   * @param {string} word
   * @param {string} unit
   * @param {number} low
   * @param {number | null} high
   * @param {(keyof Moment)[]} keys
   */
  constructor(parent, open, word, unit, low, high, keys) {
    this.word = word;
    this.unit = unit;
    this.low = low;
    this.high = high;
    this.top = high ?? 1;
    this.keys = keys;
    const [figure, caption] = [document.createElement("figure"), document.createElement("figcaption")];
    this.caption = document.createElement("button");
    this.caption.type = "button";
    this.caption.dataset.lane = word;
    this.caption.onclick = () => open(word);
    caption.append(this.caption);
    this.canvas = document.createElement("canvas");
    figure.append(caption, this.canvas);
    parent.append(figure);
    this.pen = this.canvas.getContext("2d");
    this.box = { width: 0, height: 0 };
    this.size = { width: 0, height: 0, ratio: 1 };
    // To ask for the size would lay the page out each time.
    new ResizeObserver(([seen]) => (this.box = seen?.contentRect ?? this.box)).observe(this.canvas);
    this.colours = ["", ""];
    this.look = "";
    /**
     * What the canvas shows: whose past, drawn in what way, up to which point and which column.
     *
     * @type {{ robot: Robot | null, look: string, total: number, column: number }}
     */
    this.shown = { robot: null, look: "", total: 0, column: 0 };
  }

  /**
   * The last figures, and what the lines look like.
   *
   * @param {Robot | null} robot
   * @param {number} now
   * @param {string[]} colours
   */
  draw(robot, now, colours) {
    const last = robot?.past.at(-1);
    const known = this.keys.flatMap((key) => last?.[key] ?? []);
    const text = `${say(this.word)} ${known.length ? told(known, this.unit) : "–"}`;
    if (this.caption.textContent !== text) this.caption.textContent = text;

    const ratio = devicePixelRatio;
    const [width, height] = [Math.round(this.box.width * ratio), Math.round(this.box.height * ratio)];
    const since = now - SPAN_MS;
    const seen = (robot?.past ?? []).filter(({ at }) => at > since);
    this.top = this.high ?? Math.max(1, ...seen.flatMap((point) => this.keys.map((key) => point[key] ?? 0)));
    this.colours = colours;
    this.look = [width, height, ratio, this.top, ...colours].join();
    this.size = { width, height, ratio };
  }

  /**
   * @param {Robot | null} robot
   * @param {number} now
   */
  move(robot, now) {
    const { pen, size: { width, height } } = this;
    if (!pen || !width || !height) return;
    const past = robot?.past ?? [];
    const total = robot?.total ?? 0;
    // Columns are counted from when the page was opened, so that a shift is of whole pixels.
    const column = this.column(now);
    const { shown } = this;
    const shift = column - shown.column;
    if (shown.robot === robot && shown.look === this.look && shift === 0 && total === shown.total) return;
    let first = past.length - (total - shown.total) - 1;
    if (shown.robot !== robot || shown.look !== this.look || shift >= width) {
      Object.assign(this.canvas, { width, height });
      first = past.findIndex(({ at }) => this.column(at) > column - width);
      if (first < 0) first = past.length;
    } else if (shift > 0) {
      pen.globalCompositeOperation = "copy";
      pen.drawImage(this.canvas, -shift, 0);
      pen.globalCompositeOperation = "source-over";
    }
    this.line(pen, past.slice(Math.max(0, first)), column);
    this.shown = { robot, look: this.look, total, column };
  }

  /**
   * Draws from the first of these points to the last.
   *
   * @param {CanvasRenderingContext2D} pen
   * @param {Moment[]} points
   * @param {number} column
   */
  line(pen, points, column) {
    if (points.length < 2) return;
    const { low, top } = this;
    const { width, height, ratio } = this.size;
    pen.lineWidth = 1.5 * ratio;
    pen.lineCap = "round";
    this.keys.forEach((key, index) => {
      pen.strokeStyle = this.colours[index] ?? "";
      pen.beginPath();
      let isDrawn = false;
      for (const { at, [key]: value } of points) {
        if (value !== null) {
          const x = width - 1 + this.column(at) - column;
          const y = Math.round(height - ((Math.min(top, Math.max(low, value)) - low) / (top - low)) * (height - 2) - 1);
          if (isDrawn) pen.lineTo(x, y);
          else pen.moveTo(x, y);
        }
        isDrawn = value !== null;
      }
      pen.stroke();
    });
  }

  /**
   * The column of pixels of a moment.
   *
   * @param {number} at
   */
  column(at) {
    return Math.floor((at * this.size.width) / SPAN_MS);
  }
}
