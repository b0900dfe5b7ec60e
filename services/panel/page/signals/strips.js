// The last minute as strips of a few figures, and the eleven line sensors as a bar.
//
// A strip moves with every picture of the screen. It is not drawn anew for that: what is there is
// shifted by the pixels that time has passed, and what is new is drawn at its end.

import { SPAN_MS } from "../station/link.js";
import { decimal, put, say } from "../words/words.js";

/** Word, unit, least and most value, keys of the past. */
const STRIPS = [
  ["line_error", "", -10, 10, ["line_error"]],
  ["duty", "%", 0, 255, ["left_duty", "right_duty"]],
  ["distance", "cm", 0, 80, ["distance_cm"]],
  ["path", "µs", 0, null, ["path_p50", "path_p99"]],
  ["battery", "V", 9, 13, ["battery"]],
  ["losses", "", 0, null, ["lost"]],
];
export const SENSORS = 11;
const DARK = matchMedia("(prefers-color-scheme: dark)");

/**
 * What each line sensor sees, the leftmost first, 1 for tape; null if the board is not heard. Where it
 * tells only how far the line is off, the sensor above the middle of the tape does.
 */
export function sensors({ line_bits: bits, line_error: error } = {}) {
  if (bits || error === undefined) return bits ?? null;
  const middle = Math.round((SENSORS - 1) / 2 + Number(error) / 2);
  return Array.from({ length: SENSORS }, (_, index) => (index === middle ? "1" : "0")).join("");
}

export class Strips {
  constructor(parent) {
    this.strips = STRIPS.map((strip) => new Strip(parent, ...strip));
    const [figure, row] = [document.createElement("figure"), document.createElement("div")];
    figure.id = "sensors";
    this.caption = document.createElement("figcaption");
    this.sensors = Array.from({ length: SENSORS }, () => row.appendChild(document.createElement("span")));
    figure.append(this.caption, row);
    parent.append(figure);
  }

  /** Moves the lines: for every picture of the screen. */
  move(robot, now) {
    for (const strip of this.strips) strip.move(robot, now);
  }

  /** Figures and sensors of a robot at a time. */
  draw(robot, now) {
    const dark = DARK.matches;
    if (this.dark !== dark) {
      this.dark = dark;
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

/** Figures with their unit, short enough for a caption. */
function told(figures, unit) {
  if (unit === "µs" && Math.max(...figures) >= 1000) return `${figures.map((us) => decimal(us / 1000)).join(" / ")} ms`;
  // A duty is told in parts of 255.
  if (unit === "%") return `${figures.map((duty) => Math.round(duty / 2.55)).join(" / ")} %`;
  if (unit === "V") return `${figures.map((volts) => decimal(volts)).join(" / ")} V`;
  return `${figures.join(" / ")} ${unit}`.trim();
}

class Strip {
  constructor(parent, word, unit, low, high, keys) {
    Object.assign(this, { word, unit, low, high, keys });
    const figure = document.createElement("figure");
    this.caption = document.createElement("figcaption");
    this.canvas = document.createElement("canvas");
    figure.append(this.caption, this.canvas);
    parent.append(figure);
    this.pen = this.canvas.getContext("2d");
    // To ask for the size would lay the page out each time.
    new ResizeObserver(([{ contentRect }]) => (this.box = contentRect)).observe(this.canvas);
    this.colours = ["", ""];
    /** What the canvas shows: whose past, drawn in what way, up to which point and which column. */
    this.shown = { robot: null, look: "", total: 0, column: 0 };
  }

  /** The last figures, and what the lines look like. */
  draw(robot, now, colours) {
    const last = robot?.past.at(-1);
    const values = this.keys.map((key) => last?.[key]);
    const known = values.filter((value) => value !== null && value !== undefined);
    const text = `${say(this.word)} ${known.length ? told(known, this.unit) : "–"}`;
    if (this.caption.textContent !== text) this.caption.textContent = text;

    const ratio = devicePixelRatio;
    const [width, height] = [this.box?.width ?? 0, this.box?.height ?? 0].map((side) => Math.round(side * ratio));
    const since = now - SPAN_MS;
    const seen = (robot?.past ?? []).filter(({ at }) => at > since);
    this.top = this.high ?? Math.max(1, ...seen.flatMap((point) => this.keys.map((key) => point[key] ?? 0)));
    this.colours = colours;
    this.look = [width, height, ratio, this.top, ...colours].join();
    this.size = { width, height, ratio };
  }

  move(robot, now) {
    if (!this.size?.width || !this.size.height) return;
    const { width } = this.size;
    const past = robot?.past ?? [];
    const total = robot?.total ?? 0;
    // Columns are counted from when the page was opened, so that a shift is of whole pixels.
    const column = this.column(now);
    const { shown } = this;
    const shift = column - shown.column;
    if (shown.robot === robot && shown.look === this.look && shift === 0 && total === shown.total) return;
    let first = past.length - (total - shown.total) - 1;
    if (shown.robot !== robot || shown.look !== this.look || shift >= width) {
      Object.assign(this.canvas, { width, height: this.size.height });
      first = past.findIndex(({ at }) => this.column(at) > column - width);
      if (first < 0) first = past.length;
    } else if (shift > 0) {
      this.pen.globalCompositeOperation = "copy";
      this.pen.drawImage(this.canvas, -shift, 0);
      this.pen.globalCompositeOperation = "source-over";
    }
    this.line(past.slice(Math.max(0, first)), column);
    this.shown = { robot, look: this.look, total, column };
  }

  /** Draws from the first of these points to the last. */
  line(points, column) {
    if (points.length < 2) return;
    const { pen, low, top } = this;
    const { width, height, ratio } = this.size;
    pen.lineWidth = 1.5 * ratio;
    pen.lineCap = "round";
    this.keys.forEach((key, index) => {
      pen.strokeStyle = this.colours[index];
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

  /** The column of pixels of a moment. */
  column(at) {
    return Math.floor((at * this.size.width) / SPAN_MS);
  }
}
