// What the page asks a person: where the robot stands after it was driven by hand, and whether
// somebody else may have the wheel. STOP and its keys work meanwhile: nothing here is in front of them.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { field, judge, wrong } from "../parts/fields.js";
import { called, reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

/**
 * Which way a robot on the delivery corner of this column looks into the warehouse.
 *
 * @param {number} x
 */
const inwards = (x) => (x === 0 ? "right" : "left");
/** The ways to look, from 0 degrees on to the right. */
const LOOKS = ["up", "right", "down", "left"];

export class Where {
  /**
   * @param {Link} link
   * @param {{ dialog: HTMLDialogElement, form: HTMLFormElement, said: HTMLElement, later: HTMLElement }} parts
   * @param {() => Robot | null} robot
   */
  constructor(link, parts, robot) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    /**
     * What is done once the robot knows where it stands.
     *
     * @type {(() => void) | null}
     */
    this.then = null;
    const { form, later } = parts;
    this.x = field(form, "x", HTMLInputElement);
    this.y = field(form, "y", HTMLInputElement);
    this.looks = field(form, "looks", HTMLSelectElement);
    /** Whether it is at the delivery or on a crossing. */
    this.at = field(form, "at", RadioNodeList);
    judge(form);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.answer();
    });
    later.onclick = () => parts.dialog.close();
    // To name a crossing is to choose it.
    for (const one of [this.x, this.y, this.looks]) one.addEventListener("input", () => (this.at.value = "crossing"));
  }

  /**
   * Whether a robot that has been driven by hand does not know where it stands.
   *
   * @param {Robot | null} robot
   */
  isOpen(robot) {
    return Boolean(robot?.speaks && this.link.warehouse && robot.state.phase && robot.state.x_mm === undefined);
  }

  /**
   * Whether somebody is to say where a robot stands: then a crossing of the map can be pointed at.
   *
   * @param {Robot | null} robot
   */
  isWanted(robot) {
    return this.parts.dialog.open || this.isOpen(robot);
  }

  /**
   * The robot stands on a crossing that was pointed at; which way it looks, is asked.
   *
   * @param {string[]} crossing
   */
  choose([x = "", y = ""]) {
    if (!this.parts.dialog.open) this.ask();
    [this.at.value, this.x.value, this.y.value] = ["crossing", x, y];
    // At first as it looked when it was known last.
    const { heading } = this.robot()?.pose ?? {};
    if (heading !== undefined) this.looks.value = LOOKS[(Math.round(heading / 90) + 40) % 4] ?? "";
    this.looks.focus();
  }

  /** @param {(() => void) | null} then is done once the robot knows where it stands */
  ask(then = null) {
    if (!this.link.warehouse) return;
    const [width, height] = this.link.warehouse.size;
    const { dialog, said } = this.parts;
    this.then = then;
    [this.x.max, this.y.max] = [String(width), String(height)];
    put(said, "");
    if (!dialog.open) dialog.show();
    const [first] = this.at;
    if (first instanceof HTMLElement) first.focus();
  }

  async answer() {
    const { dialog, said } = this.parts;
    const robot = this.robot();
    const { warehouse } = this.link;
    if (!robot || !warehouse) return put(said, say(robot ? "no_map" : "no_robot"));
    const { at, x, y, looks } = this;
    const why = at.value === "crossing" ? wrong([x, y]) : null;
    if (why) return put(said, why);
    const [cornerX, cornerY] = warehouse.delivery;
    let action = `place ${x.value} ${y.value} ${looks.value}`;
    // A simulated robot is carried there; a real one has been.
    if (at.value === "delivery") action = robot.truth ? `place ${cornerX} ${cornerY} ${inwards(cornerX)}` : "reset";
    const answer = await this.link.act(robot, action);
    if (answer.refused) return put(said, reason(answer.refused));
    dialog.close();
    this.then?.();
  }
}

/** The driver is asked by whoever wants the wheel. */
export class Asked {
  /**
   * @param {Link} link
   * @param {Record<"box" | "said" | "give" | "keep", HTMLElement>} parts
   * @param {() => Robot | null} robot
   * @param {() => void} letGo ends what is held
   */
  constructor(link, parts, robot, letGo) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    parts.give.onclick = () => {
      letGo();
      this.answer("free");
    };
    parts.keep.onclick = () => this.answer("keep");
  }

  /** @param {"free" | "keep"} verb */
  answer(verb) {
    const robot = this.robot();
    if (robot) this.link.ask(verb, robot.name);
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    const { box, said } = this.parts;
    const who = robot?.driver && robot.driver === this.link.me ? robot.asks : null;
    box.toggleAttribute("hidden", !who);
    put(said, who ? say("asks", called(who)) : "");
  }
}
