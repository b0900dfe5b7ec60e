// The arm as its servos tell it: from the side how it reaches, from above where it points, and for
// each joint where it stands, how hard it works, and the errors they have told.
//
// Lengths and angles are those of the simulator's world (firmware/plant/src/arm.rs); of another arm
// the drawing shows the right joints bent the right way.

/** @import { Robot } from "../station/robot.js" */
/** @typedef {(number | null)[]} Positions Of the servos; of one that is not heard it is null. */

import { make, set } from "../parts/svg.js";
import { put, say } from "../words/words.js";

/** Radians of one unit of position, and the middle of the range. */
const UNIT = ((300 / 1_023) * Math.PI) / 180;
const CENTRE = 512;
/** In mm. */
const SHOULDER_HEIGHT = 120;
const UPPER_ARM = 150;
const FOREARM = 150;
/** The claw's position at which its jaws meet, and mm for each further unit. */
const CLOSED = 210;
const GAP = 80 / 302;
/**
 * Joint: its word, its servos by index.
 *
 * @type {[string, [number, ...number[]]][]}
 */
const JOINTS = [
  ["base", [0]], ["shoulder", [1, 2]], ["elbow", [3, 4]], ["wrist", [5]], ["rotation", [6]], ["claw", [7]],
];
/** What the bits of an AX-12's error byte mean, the lowest first. */
const ERRORS = ["voltage", "angle", "heat", "range", "checksum", "overload", "instruction"];

export class Arm {
  /** @param {SVGElement} svg */
  constructor(svg) {
    this.svg = svg;
    this.shown = "";
    /**
     * The bar of each joint's load.
     *
     * @type {(SVGRectElement | null)[]}
     */
    this.bars = [];
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    const { servos = "", loads = "", servo_errors: errors = "" } = robot?.state ?? {};
    const shown = [servos, errors, document.documentElement.lang].join(" ");
    if (this.shown !== shown) {
      this.shown = shown;
      this.drawPositions(read(servos), errors);
    }
    const all = loads.split(",").map(Number);
    this.bars.forEach((bar, line) => bar && drawLoad(bar, JOINTS[line]?.[1] ?? [], all));
  }

  /**
   * @param {Positions} positions
   * @param {string} errors
   */
  drawPositions(positions, errors) {
    this.svg.replaceChildren();
    this.svg.toggleAttribute("hidden", !positions.length);
    this.bars = [];
    if (!positions.length) return;
    this.fromTheSide(positions);
    this.fromAbove(positions);
    this.bars = JOINTS.map(([word, indexes], line) => this.joint(line, word, indexes, positions));
    const told = ERRORS.filter((_, bit) => errors.at(-1 - bit) === "1");
    if (told.length) make("text", { class: "wrong", x: 0, y: 134 }, this.svg, `! ${told.map((word) => say(`servo_${word}`)).join(", ")}`);
  }

  /** @param {Positions} positions */
  fromTheSide(positions) {
    const side = make("g", { transform: "translate(36 108) scale(0.2 -0.2)" }, this.svg);
    const [elbow, claw] = bent(positions);
    make("path", { class: "ground", d: "M-150 0H310" }, side);
    make("path", { class: "stand", d: `M0 0V${SHOULDER_HEIGHT}` }, side);
    make("polyline", { class: "links", points: `0,${SHOULDER_HEIGHT} ${elbow} ${claw}` }, side);
    /** @type {[number, number][]} */
    const joints = [[0, SHOULDER_HEIGHT], elbow, claw];
    for (const [cx, cy] of joints) make("circle", { cx, cy, r: 14 }, side);
  }

  /**
   * Where the base points, and how far the jaws are apart.
   *
   * @param {Positions} positions
   */
  fromAbove(positions) {
    const { degrees, gap } = turned(positions);
    const above = make("g", { transform: `translate(126 88) rotate(${degrees.toFixed(1)}) scale(0.6)` }, this.svg);
    make("circle", { class: "ground", r: 8 }, above);
    make("path", { class: "links", d: "M0 0V-44" }, above);
    const half = gap / 8 + 2;
    make("path", { class: "links", d: `M${-half} -60V-46H${half}V-60` }, above);
  }

  /**
   * @param {number} line
   * @param {string} word
   * @param {[number, ...number[]]} servos
   * @param {Positions} positions
   * @returns {SVGRectElement | null} the bar of its load
   */
  joint(line, word, [index], positions) {
    const y = 12 + line * 19;
    make("text", { x: 166, y: y + 4 }, this.svg, say(`servo_${word}`));
    make("rect", { class: "track", x: 228, y: y - 3, width: 56, height: 6 }, this.svg);
    const position = positions[index] ?? null;
    if (position === null) return null;
    make("circle", { cx: 228 + (position / 1_023) * 56, cy: y, r: 5 }, this.svg);
    make("text", { x: 294, y: y + 4 }, this.svg, String(position));
    const bar = make("rect", { class: "load", x: 322, y: y - 3, height: 6 }, this.svg);
    make("title", {}, bar);
    return bar;
  }
}

/**
 * The most that a joint's servos are loaded; it changes all the time.
 *
 * @param {SVGRectElement} bar
 * @param {number[]} servos
 * @param {number[]} loads
 */
function drawLoad(bar, servos, loads) {
  const part = Math.max(...servos.map((servo) => Math.abs(loads[servo] || 0))) / 1_023;
  set(bar, "width", Math.round(part * 26));
  if (bar.firstElementChild) put(bar.firstElementChild, say("servo_load", Math.round(part * 100)));
}

/**
 * The servos' positions from their text.
 *
 * @param {string} servos
 * @returns {Positions}
 */
const read = (servos) => (servos ? servos.split(",").map((text) => (text === "-" ? null : Number(text))) : []);

/**
 * Where elbow and claw are seen from the side, in mm from the foot of the base.
 *
 * @param {Positions} positions
 * @returns {[[number, number], [number, number]]}
 */
function bent(positions) {
  const upper = Math.PI / 2 + angle(positions[1]);
  const fore = upper - Math.PI / 2 + angle(positions[3]);
  const [x, y] = [UPPER_ARM * Math.cos(upper), SHOULDER_HEIGHT + UPPER_ARM * Math.sin(upper)];
  return [[x, y], [x + FOREARM * Math.cos(fore), y + FOREARM * Math.sin(fore)]];
}

/**
 * How far the base is turned to the right, in degrees, and how far the jaws are apart, in mm.
 *
 * @param {Positions} positions
 */
function turned(positions) {
  const degrees = (-angle(positions[0]) * 180) / Math.PI;
  return { degrees, gap: Math.max(0, ((positions[7] ?? CLOSED) - CLOSED) * GAP) };
}

/**
 * The arm from above, for the map: as `turned`, and how far the claw reaches ahead of the base, in mm; null if unheard.
 *
 * @param {string} servos
 */
export function above(servos) {
  const positions = read(servos);
  if (!positions.length) return null;
  const [, [reach]] = bent(positions);
  return { ...turned(positions), reach };
}

/** @param {number | null | undefined} position */
const angle = (position) => ((position ?? CENTRE) - CENTRE) * UNIT;
