// What the robot's sensors and motors do while a question waits, as a person sees it from a step away: the line sensors,
// a scale, the duty of both sides. The sentence below says the same.

/** @import { Robot } from "../station/robot.js" */

import { make, set } from "../parts/svg.js";
import { SENSORS, sensors } from "../signals/strips.js";
import { values, word } from "./said.js";
import { current } from "../words/words.js";

/** The drawing is so large, in its own units. */
const [WIDTH, HEIGHT] = [660, 240];
const GAP = 8;
/** The most that a line sensor reads, that a distance sensor reads, and the most duty. */
const [MOST, MOST_RANGE, MOST_DUTY] = [255, 1_023, 255];

export class Live {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.place = place;
    this.svg = make("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "xMinYMid", role: "img" }, place);
    /** What is drawn, and in which language. */
    this.kind = "";
    /**
     * Draws it anew.
     *
     * @type {(robot: Robot, shows: string) => void}
     */
    this.move = () => {};
  }

  /**
   * @param {Robot} robot
   * @param {string | undefined} step
   * @param {string} shows the values that belong to it
   */
  draw(robot, step, shows = "") {
    const drawing = drawingOf(step, shows);
    this.place.toggleAttribute("hidden", !drawing);
    if (!drawing) return;
    const kind = `${drawing.name} ${current()}`;
    if (kind !== this.kind) {
      this.kind = kind;
      this.svg.replaceChildren();
      this.move = drawing(this.svg);
    }
    this.move(robot, shows);
  }
}

/**
 * Which drawing belongs to the values of a step; none to most.
 *
 * @param {string | undefined} step
 * @param {string} shows
 */
function drawingOf(step, shows) {
  if (step === "line") return line;
  if (shows.startsWith("live_range")) return range;
  return shows.startsWith("live_wheels") || shows.startsWith("live_seconds") ? duty : null;
}

/**
 * Each line sensor: dark over tape and, while they are calibrated, its reading and what it has read so far.
 *
 * @param {SVGSVGElement} svg
 * @returns {(robot: Robot, shows: string) => void}
 */
function line(svg) {
  const width = (WIDTH - GAP * (SENSORS - 1)) / SENSORS;
  const high = HEIGHT - 28;
  const bars = Array.from({ length: SENSORS }, (_, index) => {
    const at = { x: (index * (width + GAP)).toFixed(1), width: width.toFixed(1) };
    const group = make("g", {}, svg);
    make("rect", { ...at, y: 1, height: high - 1, rx: 2, class: "box" }, group);
    const stretch = make("rect", { ...at, class: "stretch" }, group);
    const mark = make("rect", { ...at, height: 4, class: "fill" }, group);
    make("text", { x: index * (width + GAP) + width / 2, y: HEIGHT - 6 }, group, index + 1);
    return { group, stretch, mark };
  });
  return (robot, shows) => {
    const bits = sensors(robot.state);
    const read = shows.startsWith("live_calibration") ? robot.sensors : null;
    bars.forEach(({ group, stretch, mark }, index) => {
      const sensor = read?.[index];
      group.classList.toggle("on", !sensor && bits?.[index] === "1");
      group.classList.toggle("both", Boolean(sensor?.both));
      for (const part of [stretch, mark]) part.toggleAttribute("hidden", !sensor);
      const { reading = 0, lowest = 0, highest = 0 } = sensor ?? {};
      /** @param {number} value */
      const up = (value) => (high - (value / MOST) * (high - 4)).toFixed(1);
      set(stretch, "y", up(highest));
      set(stretch, "height", (((highest - lowest) / MOST) * (high - 4)).toFixed(1));
      set(mark, "y", (Number(up(reading)) - 2).toFixed(1));
    });
    set(svg, "aria-label", word("sensor", { bits: bits ?? "–" }));
  };
}

/**
 * What the distance sensor reads, on its scale.
 *
 * @param {SVGSVGElement} svg
 * @returns {(robot: Robot, shows: string) => void}
 */
function range(svg) {
  make("rect", { x: 1, y: 100, width: WIDTH - 2, height: 56, rx: 2, class: "box" }, svg);
  const fill = make("rect", { x: 1, y: 101, height: 54, class: "fill" }, svg);
  const figure = make("text", { x: WIDTH / 2, y: 76, class: "figure" }, svg, "");
  for (const part of [0, 0.5, 1]) {
    make("text", { x: part * WIDTH, y: 178, class: ["start", "", "end"][part * 2] ?? "" }, svg, Math.round(part * MOST_RANGE));
  }
  return (_, shows) => {
    const reading = Number(values(shows)[0] ?? 0);
    set(fill, "width", ((Math.min(reading, MOST_RANGE) / MOST_RANGE) * (WIDTH - 2)).toFixed(1));
    if (figure.textContent !== String(reading)) figure.textContent = String(reading);
    set(svg, "aria-label", String(reading));
  };
}

/**
 * The duty of both sides.
 *
 * @param {SVGSVGElement} svg
 * @returns {(robot: Robot, shows: string) => void}
 */
function duty(svg) {
  const high = HEIGHT - 30;
  const bars = ["left", "right"].map((side, index) => {
    const x = index * 160 + 1;
    make("rect", { x, y: 1, width: 120, height: high - 1, rx: 2, class: "box" }, svg);
    make("text", { x: x + 60, y: HEIGHT - 8 }, svg, word(side));
    return make("rect", { x: x + 1, width: 118, class: "fill" }, svg);
  });
  return ({ state: { left_duty: left = "0", right_duty: right = "0" } }) => {
    [left, right].forEach((duty, index) => {
      const bar = bars[index];
      const share = Math.min(Number(duty) / MOST_DUTY, 1) * (high - 2);
      if (!bar) return;
      set(bar, "y", (high - 1 - share).toFixed(1));
      set(bar, "height", share.toFixed(1));
    });
    set(svg, "aria-label", `${word("left")} ${left}, ${word("right")} ${right}`);
  };
}
