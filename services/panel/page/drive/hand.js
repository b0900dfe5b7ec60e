// Taking a robot by hand needs the wheel. One that is on its way is not taken by a hand that slipped: the page
// asks first, and without an answer the robot goes on by itself.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { say, put } from "../words/words.js";

/** How long there is to think, in ms. */
const THINK_MS = 10_000;

export class ByHand {
  /**
   * @param {Link} link
   * @param {Record<"ask" | "box" | "said" | "take" | "leave", HTMLElement>} parts
   * @param {() => Robot | null} robot
   * @param {() => void} take has the robot driven by hand
   * @param {(word: string | null) => void} tell says why not
   */
  constructor(link, parts, robot, take, tell) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.take = take;
    this.tell = tell;
    /**
     * The robot that is asked about, and when the question ends.
     *
     * @type {{ robot: Robot, product: string, at: number } | null}
     */
    this.asked = null;
    parts.ask.onclick = () => this.ask();
    parts.take.onclick = () => this.now();
    parts.leave.onclick = () => this.leave();
  }

  ask() {
    const robot = this.robot();
    if (!robot || this.asked) return;
    if (robot.driver !== this.link.me) return this.tell("not_driver");
    const { mode, product, stopped } = robot.state;
    // One that is stopped, or has nothing to do, loses nothing.
    if (mode !== "autonomous" || product === undefined || stopped === "1") return this.take();
    this.tell(null);
    this.asked = { robot, product, at: performance.now() + THINK_MS };
    this.draw(robot);
  }

  now() {
    const { robot } = this.asked ?? {};
    this.leave();
    if (robot && robot === this.robot()) this.take();
  }

  leave() {
    this.asked = null;
    this.parts.box.toggleAttribute("hidden", true);
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    const { asked, parts } = this;
    if (!asked) return;
    // What it was asked about is over.
    if (robot !== asked.robot || robot.driver !== this.link.me || robot.state.mode !== "autonomous") return this.leave();
    const left = asked.at - performance.now();
    if (left <= 0) return this.leave();
    parts.box.toggleAttribute("hidden", false);
    put(parts.said, say("hand_asked", asked.product, Math.ceil(left / 1_000)));
  }
}
