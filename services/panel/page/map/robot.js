// A robot on the map, to scale: hull, wheels, the eyes of its line sensors, arm, claw and what it holds.

/** @import { Pose, State } from "../station/robot.js" */
/** @import { Box } from "./labels.js" */

import { make, place, set, hatch } from "../parts/svg.js";
import { put, say } from "../words/words.js";
import { above } from "../missions/arm.js";

/** The body in mm: half its width with the wheels, length before and behind the axle. */
export const BODY = { half: 102, front: 170, rear: 110 };
/** Half the hull's width in mm, without the wheels. */
const HULL = 90;
const HULL_PATH = `M${-HULL} ${BODY.rear}V-120L-50 ${-BODY.front}H50L${HULL} -120V${BODY.rear}Z`;
/** How far ahead of the axle the arm's base stands, and half the claw's greatest opening, in mm. */
const BASE = 60;
const CLAW = 50;
/** Goods in the claw in mm, and in pixels at least. */
const HELD = 84;
const HELD_PX = 18;
/** A robot is drawn as long as this at least, and below the second one without its parts, in pixels. */
const LEAST_PX = 24;
const PARTS_PX = 28;
const LENGTH = BODY.front + BODY.rear;

export class Robot {
  /**
   * @param {SVGElement} svg
   * @param {"robot" | "ghost"} name
   */
  constructor(svg, name) {
    this.group = make("g", { class: name, hidden: "" }, svg);
    make("title", { "data-word": name }, this.group, say(name));
    const wheels = name === "ghost" ? null : make("g", { class: "parts wheels" }, this.group);
    make("path", { class: "hull", d: HULL_PATH }, this.group);
    make("path", { class: "arrow", d: "M-34 96L0 38L34 96L0 80Z" }, this.group);
    // Hatched, while it is stopped.
    make("path", { class: "hatch", d: hatch(8 - HULL, 45 - BODY.front, HULL - 8, BODY.rear - 8, 55) }, this.group);
    /** @type {Pose | null} */
    this.pose = null;
    /** How much larger than it is it is drawn. */
    this.grow = 1;
    // Of truth only the place is of interest.
    this.limbs = wheels && new Limbs(this.group);
    if (!wheels) return;
    for (const x of [-BODY.half, BODY.half - 26]) for (const y of [-92, 26]) make("rect", { x, y, width: 26, height: 66, rx: 8 }, wheels);
  }

  /**
   * The parts of a robot that say what it is like: `carries` is the number of the goods in its claw.
   *
   * @param {State} state
   * @param {string | null} carries
   * @param {number} px mm of one pixel
   */
  draw(state, carries, px) {
    this.grow = Math.max(1, (LEAST_PX * px) / LENGTH);
    this.group.classList.toggle("small", LENGTH / px < PARTS_PX);
    this.limbs?.draw(state, carries, px, this.grow);
  }

  /** @param {Pose} pose */
  move(pose) {
    place(this.group, pose, this.grow);
    this.pose = pose;
    this.limbs?.turn(pose.heading);
  }

  /** @param {boolean} isShown */
  show(isShown) {
    this.group.toggleAttribute("hidden", !isShown);
    if (!isShown) this.pose = null;
  }

  /**
   * The box about it, arm and goods included, in mm of the drawing; null if hidden.
   *
   * @returns {Box | null}
   */
  get box() {
    if (!this.pose) return null;
    const { x, y, heading } = this.pose;
    const [sin, cos] = [Math.sin((heading * Math.PI) / 180), Math.cos((heading * Math.PI) / 180)];
    const ahead = Math.max(BODY.front, (this.limbs?.reach ?? 0) + HELD);
    /** @type {[number, number][]} */
    const corners = [[-BODY.half, ahead], [BODY.half, ahead], [-BODY.half, -BODY.rear], [BODY.half, -BODY.rear]];
    const xs = corners.map(([right, up]) => x + (right * cos + up * sin) * this.grow);
    const ys = corners.map(([right, up]) => -(y + (up * cos - right * sin) * this.grow));
    return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
  }
}

/** The eyes of the line sensors, the arm as its servos stand, and what is in the claw. */
class Limbs {
  /** @param {SVGElement} group */
  constructor(group) {
    const eyes = make("g", { class: "parts eyes" }, group);
    this.eyes = Array.from({ length: 11 }, (_, eye) => make("rect", { x: eye * 9 - 49, y: -160, width: 6, height: 14 }, eyes));
    this.arm = make("g", { class: "parts limbs" }, group);
    this.links = make("path", {}, this.arm);
    this.claw = make("path", { class: "claw" }, this.arm);
    make("circle", { cx: 0, cy: 0, r: 30 }, this.arm);
    this.held = make("g", { class: "held", hidden: "" }, this.arm);
    this.parcel = make("rect", {}, this.held);
    this.number = make("text", {}, this.held);
    /** How far ahead of the axle the claw is, and the middle of what it holds from the arm's base, in mm. */
    this.reach = 0;
    this.middle = 0;
    /** How far the arm is turned. */
    this.degrees = 0;
  }

  /**
   * @param {State} state
   * @param {string | null} carries
   * @param {number} px mm of one pixel
   * @param {number} grow how much larger than it is it is drawn
   */
  draw({ line_bits: bits = "", servos = "" }, carries, px, grow) {
    this.eyes.forEach((eye, at) => eye.classList.toggle("on", bits[at] === "1"));
    const { degrees, reach, gap } = above(servos) ?? { degrees: 0, reach: 100, gap: 2 * CLAW };
    this.reach = BASE + reach;
    set(this.arm, "transform", `translate(0 ${-BASE}) rotate(${degrees.toFixed(1)})`);
    set(this.links, "d", `M0 0V${Math.round(-reach)}`);
    const jaw = Math.round(Math.min(CLAW, gap / 2)) + 6;
    set(this.claw, "d", `M${-jaw} ${Math.round(-reach - 30)}V${Math.round(20 - reach)}H${jaw}V${Math.round(-reach - 30)}`);
    this.held.toggleAttribute("hidden", carries === null);
    if (carries === null) return;
    const size = Math.max(HELD, HELD_PX * px) / grow;
    for (const [key, value] of Object.entries({ x: -size / 2, y: -size / 2, width: size, height: size })) set(this.parcel, key, value.toFixed(1));
    put(this.number, carries);
    const letter = (12 * px) / grow;
    set(this.number, "font-size", letter.toFixed(1));
    set(this.number, "y", (letter * 0.36).toFixed(1));
    this.degrees = degrees;
    this.middle = -reach - 20;
  }

  /**
   * A number is read upright, however the robot and its arm are turned.
   *
   * @param {number} heading
   */
  turn(heading) {
    if (this.held.hasAttribute("hidden")) return;
    set(this.held, "transform", `translate(0 ${this.middle.toFixed(1)}) rotate(${(-heading - this.degrees).toFixed(1)})`);
  }
}
