// The last minute as strips of a few figures, and the eleven line sensors as a bar.

import { SPAN_MS } from "./link.js";
import { say } from "./words.js";

/** Word, unit, least and most value, keys of the past. */
const STRIPS = [
  ["line_error", "½", -10, 10, ["line_error"]],
  ["duty", "/255", 0, 255, ["left_duty", "right_duty"]],
  ["distance", "cm", 0, 80, ["distance_cm"]],
  ["path", "µs", 0, null, ["path_p50", "path_p99"]],
  ["battery", "V", 9, 13, ["battery"]],
  ["losses", "", 0, null, ["lost"]],
];
const SENSORS = 11;

export class Strips {
  constructor(parent) {
    this.strips = STRIPS.map((strip) => ({ strip, ...this.figure(parent) }));
    const sensors = document.createElement("figure");
    sensors.id = "sensors";
    this.sensors = Array.from({ length: SENSORS }, () => {
      const bar = document.createElement("span");
      sensors.append(bar);
      return bar;
    });
    parent.append(sensors);
  }

  figure(parent) {
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    const canvas = document.createElement("canvas");
    figure.append(caption, canvas);
    parent.append(figure);
    return { caption, canvas };
  }

  draw(robot, now) {
    const style = getComputedStyle(document.body);
    const colours = [style.getPropertyValue("--accent"), style.getPropertyValue("--quiet")];
    for (const { strip, caption, canvas } of this.strips) this.strip(strip, caption, canvas, robot, now, colours);
    const { line_bits: bits, line_error: error } = robot?.state ?? {};
    // Where the bits are not told, the sensor above the middle of the tape shows.
    const middle = error === undefined ? null : Math.round((SENSORS - 1) / 2 + Number(error) / 2);
    this.sensors.forEach((bar, index) => bar.classList.toggle("on", bits ? bits[index] === "1" : index === middle));
  }

  strip([word, unit, low, high, keys], caption, canvas, robot, now, colours) {
    const past = robot?.past ?? [];
    const last = past.at(-1);
    const values = keys.map((key) => last?.[key]);
    const known = values.filter((value) => value !== null && value !== undefined);
    const text = `${say(word)} ${known.length ? `${known.join(" / ")} ${unit}` : "–"}`;
    if (caption.textContent !== text) caption.textContent = text;

    const ratio = devicePixelRatio;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, width, height);
    pen.lineWidth = 1.5 * ratio;
    const from = now - SPAN_MS;
    let first = past.length;
    while (first > 0 && past[first - 1].at > from) first--;
    const seen = past.slice(first);
    const top = high ?? Math.max(1, ...seen.flatMap((point) => keys.map((key) => point[key] ?? 0)));
    keys.forEach((key, index) => {
      pen.strokeStyle = colours[index];
      pen.beginPath();
      let column = null;
      let level = null;
      for (const point of seen) {
        const value = point[key];
        if (value === null) {
          column = null;
          continue;
        }
        const x = Math.round(((point.at - from) / SPAN_MS) * width);
        const y = Math.round(height - ((Math.min(top, Math.max(low, value)) - low) / (top - low)) * (height - 2) - 1);
        if (column === null) pen.moveTo(x, y);
        else if (column !== x || level !== y) pen.lineTo(x, y);
        column = x;
        level = y;
      }
      pen.stroke();
    });
  }
}
