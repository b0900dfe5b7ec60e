// The first row: which robot, what state it is in, who drives, how fresh; and STOP, which never waits.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */
/** @import { Face, Look } from "./face.js" */
/** @import { Held } from "./resume.js" */

import { named } from "../station/chosen.js";
import { battery } from "./battery.js";
import { age, causeOf, face, show } from "./face.js";
import { called, sentence } from "../words/sentences.js";
import { Resume } from "./resume.js";
import { Stop } from "./stop.js";
import { put, say } from "../words/words.js";

export class Bar {
  /**
   * @param {Link} link
   * @param {Record<"link" | "mode" | "driver" | "battery" | "told" | "stopSaid" | "resumePlace" | "resumeThen", HTMLElement>
   *   & { form: HTMLFormElement } & Record<"stop" | "stopAll" | "resume", HTMLButtonElement>} parts
   * @param {() => Robot | null} robot
   * @param {Held[]} resumes the buttons that end a stop when they are held
   */
  constructor(link, parts, robot, resumes) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.resume = new Resume(link, resumes, robot);
    const name = () => robot()?.name ?? named();
    this.wasStopped = false;
    /**
     * What was shown last, and of which robot.
     *
     * @type {Look | null}
     */
    this.looked = null;
    /** @type {Robot | null} */
    this.lookOf = null;
    this.stop = new Stop(link, { form: parts.form, button: parts.stop, said: parts.stopSaid }, robot, name, () => this.resume.letGo());
  }

  /**
   * Draws it; the state that it shows.
   *
   * @param {Robot | null} robot
   * @param {number} now
   */
  draw(robot, now) {
    const { parts } = this;
    const state = face(this.link, robot, now);
    show(state, robot);
    put(parts.link, this.linkWords(robot, now));
    const { mode, stopped } = robot?.state ?? {};
    put(parts.mode, stopped === "1" ? say("stopped_short") : mode ? say(`mode_${mode}`) : "");
    put(parts.driver, this.driverWords(robot));
    const { words, volts, isLow } = battery(robot?.state ?? {});
    parts.battery.classList.toggle("low", isLow);
    put(parts.battery, words);
    if (parts.battery.title !== volts) parts.battery.title = volts;
    this.drawStop(robot);
    this.tell(state, robot);
    return state;
  }

  /**
   * By voice, once: what is wrong and nobody here has brought about.
   *
   * @param {Face} face
   * @param {Robot | null} robot
   */
  tell({ look, said }, robot) {
    const isNew = look === "stopped" && this.looked !== "stopped" && this.lookOf === robot;
    if (look === "unheard") put(this.parts.told, `${said}. ${say("old")}`);
    else if (look !== "stopped") put(this.parts.told, "");
    else if (robot && isNew && !this.parts.stopSaid.textContent) put(this.parts.told, say("stopped_elsewhere", causeOf(robot)));
    this.looked = look;
    this.lookOf = robot;
  }

  /**
   * How old what is heard is.
   *
   * @param {Robot | null} robot
   * @param {number} now
   */
  linkWords(robot, now) {
    if (!robot || !Number.isFinite(robot.heard)) return "\u2013";
    const isFresh = this.link.open && robot.connected && !robot.isStale(now);
    return isFresh ? `${Math.round(robot.age(now))} ms` : age(now - Math.max(Math.min(robot.heard, robot.stated), 0));
  }

  /**
   * @param {Robot | null} robot
   * @returns {string}
   */
  driverWords(robot) {
    if (!robot) return "";
    if (!this.link.mayDrive && this.link.open) return say("viewer");
    if (robot.driver) return robot.driver === this.link.me ? sentence("cell_me") ?? "" : called(robot.driver);
    if (robot.state.stopped === "1") return "";
    return robot.state.mode === "autonomous" ? say("station_drives") : say("nobody");
  }

  /** @param {Robot | null} robot */
  drawStop(robot) {
    const { resumePlace, resume, resumeThen, stopAll } = this.parts;
    const isStopped = robot?.state.stopped === "1";
    stopAll.toggleAttribute("hidden", this.link.robots.size < (robot || !named() ? 2 : 1));
    for (const part of [resumePlace, resume]) part.toggleAttribute("hidden", !isStopped);
    this.resume.draw(robot);
    if (robot && isStopped) put(resumeThen, after(robot));
    else if (this.wasStopped) this.stop.say(null);
    this.wasStopped = isStopped;
  }
}

/**
 * What it does once the stop is released.
 *
 * @param {Robot} robot
 */
function after(robot) {
  const { mode, product, remedy } = robot.state;
  if (mode === "manual") return say("then_stands");
  if (remedy && remedy !== "resume") return say("then_needs");
  return product === undefined ? say("then_waits") : say("then_fetches", product);
}
