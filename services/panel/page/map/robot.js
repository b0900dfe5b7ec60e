// A robot on the map, to scale: hull, wheels, the eyes of its line sensors, arm, claw and what it holds.

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
  constructor(svg, name) {
    this.group = make("g", { class: name, hidden: "" }, svg);
    make("title", { "data-word": name }, this.group, say(name));
    const parts = (style) => make("g", { class: `parts ${style}` }, this.group);
    const wheels = name === "ghost" ? null : parts("wheels");
    make("path", { class: "hull", d: HULL_PATH }, this.group);
    make("path", { class: "arrow", d: "M-34 96L0 38L34 96L0 80Z" }, this.group);
    // Hatched, while it is stopped.
    make("path", { class: "hatch", d: hatch(8 - HULL, 45 - BODY.front, HULL - 8, BODY.rear - 8, 55) }, this.group);
    // Of truth only the place is of interest.
    if (!wheels) return;
    for (const x of [-BODY.half, BODY.half - 26]) for (const y of [-92, 26]) make("rect", { x, y, width: 26, height: 66, rx: 8 }, wheels);
    const eyes = parts("eyes");
    this.eyes = Array.from({ length: 11 }, (_, eye) => make("rect", { x: eye * 9 - 49, y: -160, width: 6, height: 14 }, eyes));
    this.arm = parts("limbs");
    this.links = make("path", {}, this.arm);
    this.claw = make("path", { class: "claw" }, this.arm);
    make("circle", { cx: 0, cy: 0, r: 30 }, this.arm);
    this.held = make("g", { class: "held", hidden: "" }, this.arm);
    make("rect", {}, this.held);
    make("text", {}, this.held);
    this.reach = 0;
    this.grow = 1;
  }

  /** The parts of a robot that say what it is like: `carries` is the number of the goods in its claw. */
  draw({ line_bits: bits = "", servos = "" }, carries, px) {
    this.grow = Math.max(1, (LEAST_PX * px) / LENGTH);
    this.group.classList.toggle("small", LENGTH / px < PARTS_PX);
    this.eyes.forEach((eye, at) => eye.classList.toggle("on", bits[at] === "1"));
    const { degrees, reach, gap } = above(servos) ?? { degrees: 0, reach: 100, gap: 2 * CLAW };
    this.reach = BASE + reach;
    set(this.arm, "transform", `translate(0 ${-BASE}) rotate(${degrees.toFixed(1)})`);
    set(this.links, "d", `M0 0V${Math.round(-reach)}`);
    const jaw = Math.round(Math.min(CLAW, gap / 2)) + 6;
    set(this.claw, "d", `M${-jaw} ${Math.round(-reach - 30)}V${Math.round(20 - reach)}H${jaw}V${Math.round(-reach - 30)}`);
    this.held.toggleAttribute("hidden", carries === null);
    if (carries === null) return;
    const size = Math.max(HELD, HELD_PX * px) / this.grow;
    const [box, number] = this.held.children;
    for (const [key, value] of Object.entries({ x: -size / 2, y: -size / 2, width: size, height: size })) set(box, key, value.toFixed(1));
    put(number, carries);
    const letter = (12 * px) / this.grow;
    set(number, "font-size", letter.toFixed(1));
    set(number, "y", (letter * 0.36).toFixed(1));
    this.degrees = degrees;
    this.middle = -reach - 20;
  }

  move(pose) {
    place(this.group, pose, this.grow ?? 1);
    this.pose = pose;
    // A number is read upright, however the robot and its arm are turned.
    if (this.held && !this.held.hasAttribute("hidden")) set(this.held, "transform", `translate(0 ${this.middle.toFixed(1)}) rotate(${(-pose.heading - this.degrees).toFixed(1)})`);
  }

  show(isShown) {
    this.group.toggleAttribute("hidden", !isShown);
    if (!isShown) this.pose = null;
  }

  /** The box about it, arm and goods included, as left, top, right and bottom in mm of the drawing; null if hidden. */
  get box() {
    if (!this.pose) return null;
    const { x, y, heading } = this.pose;
    const [sin, cos] = [Math.sin((heading * Math.PI) / 180), Math.cos((heading * Math.PI) / 180)];
    const ahead = Math.max(BODY.front, this.reach + HELD);
    const corners = [[-BODY.half, ahead], [BODY.half, ahead], [-BODY.half, -BODY.rear], [BODY.half, -BODY.rear]]
      .map(([right, up]) => [x + (right * cos + up * sin) * this.grow, -(y + (up * cos - right * sin) * this.grow)]);
    const [xs, ys] = [0, 1].map((axis) => corners.map((corner) => corner[axis]));
    return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
  }
}
