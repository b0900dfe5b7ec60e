// What is on the ways of the map: the trail, the route with the next crossing, obstacles and ways found blocked.

/** @import { Pose, Robot } from "../station/robot.js" */
/** @import { Floor } from "./floor.js" */

import { SPAN_MS } from "../station/robot.js";
import { way } from "./grid.js";
import { make, set } from "../parts/svg.js";
import { say } from "../words/words.js";

/** The trail fades in so many steps. */
const TRAIL = 6;
/** An obstacle of a simulated world in mm, along its way and across it, and in pixels at least. */
const OBSTACLE = { along: 80, across: 160 };
const OBSTACLE_PX = { along: 6, across: 14 };

export class Ways {
  /**
   * The layers from the bottom up.
   *
   * @param {SVGElement} svg
   */
  constructor(svg) {
    this.trail = make("g", { class: "trail" }, svg);
    for (let step = 0; step < TRAIL; step++) make("polyline", { opacity: (0.55 * (TRAIL - step)) / TRAIL }, this.trail);
    this.gap = make("polyline", { class: "gap" }, svg);
    this.route = make("polyline", { class: "route" }, svg);
    this.placed = make("g", {}, svg);
    this.found = make("g", {}, svg);
    this.next = make("g", { class: "next" }, svg);
    make("circle", {}, this.next);
    make("circle", { class: "dot" }, this.next);
    /**
     * How much of whose trail is drawn.
     *
     * @type {{ robot: Robot | null, count: number }}
     */
    this.trailed = { robot: null, count: 0 };
    /** Which things are drawn. */
    this.shown = "";
  }

  /**
   * @param {boolean} isShown
   * @param {boolean} isKnown
   */
  show(isShown, isKnown) {
    this.trail.toggleAttribute("hidden", !isShown);
    for (const part of [this.gap, this.route]) part.toggleAttribute("hidden", !isKnown);
    if (!isKnown) this.next.toggleAttribute("hidden", true);
  }

  /**
   * @param {Robot} robot
   * @param {Floor} floor
   * @param {number} now
   */
  drawTrail(robot, floor, now) {
    // One point in four, and nothing new between them.
    const count = Math.floor(robot.total / 4);
    if (this.trailed.count === count && this.trailed.robot === robot) return;
    this.trailed = { robot, count };
    /** @type {string[][]} */
    const steps = Array.from({ length: TRAIL }, () => []);
    for (let i = robot.past.length - 1; i >= 0; i -= 4) {
      const { at, x, y } = robot.past[i] ?? { at: -Infinity, x: null, y: null };
      if (now - at > SPAN_MS) break;
      if (x === null || y === null) continue;
      const drawn = floor.onWayOut({ x, y, heading: 0 });
      const point = `${Math.round(drawn.x)},${-Math.round(drawn.y)}`;
      const step = Math.floor(((now - at) * TRAIL) / SPAN_MS);
      // Each step begins where the younger one ends.
      if (step > 0 && !steps[step]?.length) steps[step - 1]?.push(point);
      steps[step]?.push(point);
    }
    [...this.trail.children].forEach((line, step) => set(line, "points", steps[step]?.join(" ") ?? ""));
  }

  /**
   * @param {Robot} robot
   * @param {Pose} pose
   * @param {number} side
   */
  drawRoute(robot, pose, side) {
    const nodes = robot.route.map(([x, y]) => `${x * side},${-y * side}`);
    for (const line of [this.gap, this.route]) set(line, "points", [`${Math.round(pose.x)},${Math.round(-pose.y)}`, ...nodes].join(" "));
    const next = nextOf(robot, side);
    this.next.toggleAttribute("hidden", !next);
    if (next) set(this.next, "transform", `translate(${next[0]} ${-next[1]})`);
  }

  /**
   * What was put on ways is a bar across them; what the robot has found blocked is a cross.
   *
   * @param {Robot} robot
   * @param {number} side
   * @param {number} px
   */
  drawThings(robot, side, px) {
    const shown = [side, px, ...robot.placed, "", ...robot.blocked.keys()].join(";");
    if (this.shown === shown) return;
    this.shown = shown;
    this.placed.replaceChildren();
    this.found.replaceChildren();
    for (const words of robot.placed) {
      const { dx, middle: [x, y] } = way(words, side);
      const along = Math.max(OBSTACLE.along, OBSTACLE_PX.along * px);
      const across = Math.max(OBSTACLE.across, OBSTACLE_PX.across * px);
      const [width, height] = dx ? [along, across] : [across, along];
      const bar = make("rect", { class: "placed", x: x - width / 2, y: -y - height / 2, width, height }, this.placed);
      make("title", { "data-word": "placed" }, bar, say("placed"));
    }
    for (const words of robot.blocked.keys()) {
      const { middle: [x, y] } = way(words, side);
      const cross = make("g", { class: "blocked", transform: `translate(${x} ${-y})` }, this.found);
      make("title", { "data-word": "found" }, cross, say("found"));
      const arm = Math.min(10 * px, side / 4);
      const d = `M${-arm} ${-arm}L${arm} ${arm}M${arm} ${-arm}L${-arm} ${arm}`;
      make("path", { class: "back", d }, cross);
      make("path", { d }, cross);
    }
  }
}

/**
 * The next crossing of a robot in mm; null if it goes to none.
 *
 * @param {Pick<Robot, "state">} robot
 * @param {number} side
 * @returns {[number, number] | null}
 */
export function nextOf({ state: { next, x_mm: mm } }, side) {
  if (next === undefined || mm === undefined) return null;
  const [x, y] = next.split(",");
  return [Number(x) * side, Number(y) * side];
}

/**
 * How long ago a way was found blocked, in whole seconds of the robot's clock.
 *
 * @param {Pick<Robot, "state" | "blocked">} robot
 * @param {string} words
 */
export function blockedFor(robot, words) {
  return Math.max(0, Math.floor(Number(robot.state.time_ms) / 1_000) - (robot.blocked.get(words) ?? 0));
}
