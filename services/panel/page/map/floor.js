// The warehouse's floor: racks, tape at its true width, the way out with the place of delivery, and the numbers of
// columns and rows. All of it is in mm, but for letters, which keep their size on the screen.

/** @import { Pose, Warehouse } from "../station/robot.js" */

import { hatch, make } from "../parts/svg.js";
import { put, say } from "../words/words.js";

/** The bends of the way out in degrees, to the left; what lies before the first one and the bar, in mm. */
const BENDS = { straight: [], left: [90], right: [-90], s: [45, -45] };
const STRAIGHT = 200;
const BAR = 300;
/** How far the floor goes beyond the outer tape, and the racks stay from the tape, in mm. */
export const BEYOND = 130;
export const INSIDE = 84;
/** A rack's posts in mm. */
const POST = 22;
/** The place of delivery in mm: along the way out, before and behind the bar, and across it. */
const ZONE = { before: 230, behind: 130, half: 220 };
/** How near to each other two numbers of columns or rows stand at most, in pixels. */
const APART_PX = 28;

export class Floor {
  /** @param {SVGElement} svg */
  constructor(svg) {
    this.still = make("g", {}, svg);
    this.letters = make("g", {}, svg);
    /** @type {Warehouse | null} */
    this.warehouse = null;
    /** Of a square, in mm. */
    this.side = 400;
    /** Where the way out ends; its heading is in radians from the right to the left. */
    this.end = { x: 0, y: 0, heading: 0 };
    this.path = "";
    this.wayOut = make("path");
    this.wayOutLength = 0;
  }

  /** @param {Warehouse | null} warehouse */
  draw(warehouse) {
    this.warehouse = warehouse;
    this.still.replaceChildren();
    this.letters.replaceChildren();
    if (!warehouse) return;
    this.side = warehouse.side_length_cm * 10;
    this.exit(warehouse);
    const [width, height] = warehouse.size;
    const [wide, high] = [width * this.side, height * this.side];
    make("rect", { class: "floor", x: -BEYOND, y: -high - BEYOND, width: wide + 2 * BEYOND, height: high + 2 * BEYOND }, this.still);
    this.zone();
    this.racks(width, height);
    /**
     * @param {"line" | "path"} name
     * @param {Record<string, string | number>} attributes
     */
    const add = (name, attributes) => make(name, { class: "tape", ...attributes }, this.still);
    for (let x = 0; x <= width; x++) add("line", { x1: x * this.side, y1: 10, x2: x * this.side, y2: -high - 10 });
    for (let y = 0; y <= height; y++) add("line", { x1: -10, y1: -y * this.side, x2: wide + 10, y2: -y * this.side });
    add("path", { d: this.path, fill: "none" });
    const { x, y, heading } = this.end;
    const [dx, dy] = [(Math.sin(heading) * BAR) / 2, (Math.cos(heading) * BAR) / 2];
    add("line", { x1: x + dx, y1: -y + dy, x2: x - dx, y2: -y - dy });
  }

  /**
   * All racks are a few paths: a large warehouse has thousands of them.
   *
   * @param {number} width
   * @param {number} height
   */
  racks(width, height) {
    const length = this.side - 2 * INSIDE;
    /** @type {[string[], string[], string[]]} */
    const [racks, boards, posts] = [[], [], []];
    const far = length - POST;
    /** @type {[number, number][]} */
    const corners = [[0, 0], [far, 0], [0, far], [far, far]];
    for (let x = 0; x < width; x++) {
      for (let y = 1; y <= height; y++) {
        const [left, top] = [x * this.side + INSIDE, INSIDE - y * this.side];
        racks.push(`M${left} ${top}h${length}v${length}h${-length}z`);
        for (const board of [1, 2]) boards.push(`M${left} ${top + (board * length) / 3}h${length}`);
        for (const [dx, dy] of corners) {
          posts.push(`M${left + dx} ${top + dy}h${POST}v${POST}h${-POST}z`);
        }
      }
    }
    make("path", { class: "rack", d: racks.join("") }, this.still);
    make("path", { class: "board", d: boards.join("") }, this.still);
    make("path", { class: "post", d: posts.join("") }, this.still);
  }

  /** The place of delivery, hatched, about the bar at the end of the way out. */
  zone() {
    const { x, y, heading } = this.end;
    const turned = { transform: `translate(${x} ${-y}) rotate(${(-heading * 180) / Math.PI})` };
    const { before, behind, half } = ZONE;
    make("path", { class: "way-out", d: this.path }, this.still);
    const zone = make("g", { class: "zone", ...turned }, this.still);
    make("rect", { x: -before, y: -half, width: before + behind, height: 2 * half }, zone);
    make("path", { d: hatch(-before, -half, behind, half, 60) }, zone);
  }

  /**
   * Letters at a scale of `px` mm a pixel; the numbers thin out where they would touch.
   *
   * @param {number} px
   */
  scale(px) {
    this.letters.replaceChildren();
    if (!this.warehouse) return;
    const [width, height] = this.warehouse.size;
    /**
     * @param {string} style
     * @param {number} x
     * @param {number} y
     * @param {number | null} text
     */
    const letter = (style, x, y, text = null) => make("text", { class: style, x, y }, this.letters, text);
    const step = [1, 2, 5, 10, 20, 50].find((step) => (step * this.side) / px >= APART_PX) ?? 100;
    for (let x = 0; x <= width; x += step) letter("axis", x * this.side, BEYOND + 16 * px, x);
    const aside = this.warehouse.delivery[0] === 0 ? width * this.side + BEYOND + 12 * px : -BEYOND - 12 * px;
    for (let y = 0; y <= height; y += step) letter("axis", aside, 4 * px - y * this.side, y);
    const { x, y, heading } = this.end;
    const up = Math.abs(Math.cos(heading)) > 0.5 ? ZONE.half : ZONE.before;
    // It begins at the side of the warehouse and goes away from it.
    const isLeft = this.warehouse.delivery[0] === 0;
    const name = letter("axis", x + (isLeft ? ZONE.before : -ZONE.before), -y - up - 8 * px);
    name.style.textAnchor = isLeft ? "end" : "start";
    name.dataset.word = "delivered_here";
    put(name, say("delivered_here"));
  }

  /**
   * Left, top, right and bottom of everything on the floor, in mm with y upwards.
   *
   * @returns {[number, number, number, number]}
   */
  get bounds() {
    const [width, height] = [this.size[0] * this.side, this.size[1] * this.side];
    const { x, y } = this.end;
    const far = Math.max(...Object.values(ZONE));
    return [Math.min(-BEYOND, x - far), Math.max(height + BEYOND, y + far), Math.max(width + BEYOND, x + far), Math.min(-BEYOND, y - far)];
  }

  /** Squares in x and in y. */
  get size() {
    return this.warehouse?.size ?? [0, 0];
  }

  /**
   * The way out of the delivery corner, and the bar at its end, as the warehouse's file has them.
   *
   * @param {Warehouse} warehouse
   */
  exit(warehouse) {
    const { curve = "straight", length_cm = 80, radius_cm = 30 } = warehouse.exit ?? {};
    const [x, y] = warehouse.delivery;
    const arcs = BENDS[curve].map((degrees) => (degrees * Math.PI) / 180);
    const radius = radius_cm * 10;
    const bent = arcs.reduce((sum, arc) => sum + radius * Math.abs(arc), 0);
    const first = arcs.length ? STRAIGHT : length_cm * 10;
    let at = { x: x * this.side, y: y * this.side, heading: x === 0 ? Math.PI : 0 };
    let path = `M${at.x} ${-at.y}`;
    /** @param {number} length */
    const go = (length) => {
      at = { ...at, x: at.x + length * Math.cos(at.heading), y: at.y + length * Math.sin(at.heading) };
      path += `L${at.x} ${-at.y}`;
    };
    go(first);
    for (const arc of arcs) {
      const side = Math.sign(arc);
      const centre = at.heading + (side * Math.PI) / 2;
      const [cx, cy] = [at.x + radius * Math.cos(centre), at.y + radius * Math.sin(centre)];
      const end = centre + Math.PI + arc;
      at = { x: cx + radius * Math.cos(end), y: cy + radius * Math.sin(end), heading: at.heading + arc };
      path += `A${radius} ${radius} 0 0 ${side > 0 ? 0 : 1} ${at.x} ${-at.y}`;
    }
    if (arcs.length) go(length_cm * 10 - first - bent);
    this.path = path;
    this.end = at;
    this.wayOut = make("path", { d: path });
    this.wayOutLength = this.wayOut.getTotalLength();
  }

  /**
   * Odometry counts the way out as if it were straight: where a pose on it is.
   *
   * @param {Pose} pose
   * @returns {Pose}
   */
  onWayOut(pose) {
    if (!this.warehouse) return pose;
    const [column, row] = this.warehouse.delivery;
    const [x, y] = [column * this.side, row * this.side];
    const outwards = x === 0 ? -1 : 1;
    const far = (pose.x - x) * outwards;
    if (far <= 0 || Math.abs(pose.y - y) >= 1) return pose;
    const end = this.wayOutLength - 1;
    const at = this.wayOut.getPointAtLength(Math.min(far, end));
    const ahead = this.wayOut.getPointAtLength(Math.min(far, end) + 1);
    const along = (Math.atan2(ahead.x - at.x, at.y - ahead.y) * 180) / Math.PI;
    return { x: at.x, y: -at.y, heading: pose.heading + along - outwards * 90 };
  }
}
