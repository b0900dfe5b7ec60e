// Resume is held, so that nobody does it in passing. Each press ends in a resume or in a word why not.

/** @import { Link } from "../station/link.js" */
/** @import { Words } from "../words/words.js" */
/** @import { Robot } from "../station/robot.js" */
/** @typedef {{ button: HTMLElement, said: HTMLElement }} Held A button that is held, and where it is told why not. */

import { set } from "../parts/svg.js";
import { called, reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

/** How long it is held, in ms. */
const HOLD_MS = 1_000;
/** So much longer it may be held until what is in its way has passed, in ms. */
const PATIENCE_MS = 1_000;

export class Resume {
  /**
   * @param {Link} link
   * @param {Held[]} buttons end the stop of `robot()` when they are held
   * @param {() => Robot | null} robot
   */
  constructor(link, buttons, robot) {
    this.link = link;
    this.buttons = buttons;
    this.robot = robot;
    /**
     * The robot whose Resume is held, the stop that was shown when the hold began, which button, and the end of the hold.
     *
     * @type {{ robot: Robot, stop: string, one: Held, timer: number } | null}
     */
    this.held = null;
    for (const one of buttons) this.listen(one);
  }

  /** @param {Held} one */
  listen(one) {
    const { button } = one;
    button.addEventListener("pointerdown", (event) => {
      // A finger that slips is still there.
      button.setPointerCapture(event.pointerId);
      this.begin(one);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture", "blur", "keyup"]) {
      button.addEventListener(name, () => this.held?.one === one && this.letGo("hold_longer"));
    }
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    button.addEventListener("keydown", (event) => {
      if (![" ", "Enter"].includes(event.key)) return;
      event.preventDefault();
      if (!event.repeat) this.begin(one);
    });
  }

  /** @param {Held} one */
  begin(one) {
    const robot = this.robot();
    if (this.held || robot?.state.stopped !== "1" || !robot.state.stop) return;
    const why = this.forbidden(robot);
    put(one.said, why ? say(...why) : "");
    if (why) return;
    one.button.classList.add("held");
    const timer = setTimeout(() => this.end(performance.now() + PATIENCE_MS), HOLD_MS);
    this.held = { robot, stop: robot.state.stop, one, timer };
  }

  /**
   * It has been held for long enough: what is in its way may pass until `latest`.
   *
   * @param {number} latest
   */
  async end(latest) {
    if (!this.held) return;
    const { robot, stop, one } = this.held;
    const why = this.forbidden(robot) ?? this.notYet(robot);
    if (why && performance.now() < latest) {
      this.held.timer = setTimeout(() => this.end(latest), 50);
      return;
    }
    if (why) return this.letGo(...why);
    this.letGo();
    const answer = await this.link.act(robot, `resume ${stop}`);
    put(one.said, answer.refused ? say("refused", reason(answer.refused)) : "");
  }

  /**
   * Ends the hold; why, if that is to be told.
   *
   * @param {Words | []} why
   */
  letGo(...why) {
    if (!this.held) return;
    const { one, timer } = this.held;
    clearTimeout(timer);
    this.held = null;
    one.button.classList.remove("held");
    const [word, ...values] = why;
    put(one.said, word ? say(word, ...values) : "");
  }

  /**
   * Why this page may not end the stop, as words; null if it may.
   *
   * @param {Robot} robot
   * @returns {Words | null}
   */
  forbidden(robot) {
    if (!this.link.mayDrive) return ["viewer"];
    return robot.driver && robot.driver !== this.link.me ? ["person", called(robot.driver)] : null;
  }

  /**
   * What is in the way for a moment, likewise.
   *
   * @param {Robot} robot
   * @returns {Words | null}
   */
  notYet(robot) {
    if (!this.link.open) return ["lost"];
    if (robot.isStale(performance.now())) return ["old"];
    const { left_duty: left, right_duty: right } = robot.state;
    return Number(left) || Number(right) ? ["still_moves"] : null;
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    const { held } = this;
    if (held && robot !== held.robot) this.letGo();
    else if (held && held.robot.state.stopped !== "1") this.letGo();
    // What is held ends the stop that it was held for, and no newer one.
    else if (held && held.robot.state.stop !== held.stop) this.letGo("stopped_again");
    for (const { button, said } of this.buttons) {
      set(button, "aria-disabled", String(robot?.state.stopped === "1" && this.forbidden(robot) !== null));
      if (robot?.state.stopped !== "1") put(said, "");
    }
  }
}
