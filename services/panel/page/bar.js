// The first row: which robot, how fresh, who drives, what it does; and STOP, which never waits.

import { crossing, failure, sentence } from "./sentences.js";
import { reason } from "./reasons.js";
import { Stop } from "./stop.js";
import { decimal, put, say, span } from "./words.js";

/** How long Resume is held, in ms. */
const HOLD_MS = 1_000;

export class Bar {
  constructor(link, parts, robot) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.stop = new Stop(link, { button: parts.stop, said: parts.stopSaid, resume: parts.resume }, robot, () => this.letResumeGo());
    /** The robot whose Resume is held, the stop that was shown when the hold began, and the end of the hold. */
    this.held = null;
    this.resume();
  }

  /** Resume is held, so that nobody does it in passing. A stop ends the hold, too. */
  resume() {
    const { resume } = this.parts;
    const begin = () => {
      const robot = this.robot();
      if (this.held || !robot || resume.disabled) return;
      resume.classList.add("held");
      const timer = setTimeout(async () => {
        const may = this.isStillHeld(robot);
        const { stop } = this.held;
        this.letResumeGo();
        if (!may) return;
        const answer = await this.link.act(robot, `resume ${stop}`);
        this.stop.say(...(answer.refused ? ["refused", reason(answer.refused)] : [null]));
      }, HOLD_MS);
      this.held = { robot, stop: robot.state.stop, timer };
    };
    const end = () => this.letResumeGo();
    resume.addEventListener("pointerdown", begin);
    for (const name of ["pointerup", "pointerleave", "pointercancel", "blur"]) resume.addEventListener(name, end);
    resume.addEventListener("keydown", (event) => [" ", "Enter"].includes(event.key) && !event.repeat && begin());
    resume.addEventListener("keyup", end);
  }

  letResumeGo() {
    clearTimeout(this.held?.timer);
    this.held = null;
    this.parts.resume.classList.remove("held");
  }

  /** Whether what is held would end the stop that it was held for. */
  isStillHeld(robot) {
    const { held } = this;
    return held?.robot === robot && this.mayResume(robot) && robot.state.stop === held.stop;
  }

  /** Whether this page may end the stop: a driver's, with the robot at rest and nobody else at the wheel. */
  mayResume(robot) {
    const { stopped, stop, left_duty: left, right_duty: right } = robot.state;
    const isAnothers = robot.driver && robot.driver !== this.link.me;
    const moves = Number(left) || Number(right);
    return stopped === "1" && stop && this.link.mayDrive && !isAnothers && !moves && !robot.isStale(performance.now());
  }

  draw(robot, now) {
    const { parts } = this;
    const stale = !robot || robot.isStale(now);
    document.body.classList.toggle("stale", stale);
    document.body.classList.toggle("stopped", robot?.state.stopped === "1");
    put(parts.link, this.linkWords(robot, now));
    put(parts.linkSaid, !this.link.open ? this.lostWords() : robot && stale ? say("old") : "");
    const mode = robot?.state.mode;
    put(parts.mode, mode ? say(`mode_${mode}`) : "");
    put(parts.driver, this.driverWords(robot));
    const { battery_dv: decivolts, hold } = robot?.state ?? {};
    const volts = decivolts === undefined ? "" : decimal(Number(decivolts) / 10);
    parts.battery.classList.toggle("low", hold === "battery");
    put(parts.battery, volts && say(hold === "battery" ? "battery_low" : "volts", volts));
    put(parts.doing, doing(robot));
    this.drawStop(robot);
  }

  linkWords(robot, now) {
    const heard = robot && Number.isFinite(robot.heard) ? say("age", span(robot.age(now))) : say("unheard");
    if (!this.link.open) return robot ? `${this.lostWords()}, ${heard}` : this.lostWords();
    if (!robot) return say("no_robot");
    if (!robot.connected) return say("no_link", heard);
    if (!robot.speaks) return say("plain");
    if (robot.isStale(now)) return say("stale", span(now - Math.max(robot.stated, 0)));
    return say("link", Math.round(robot.age(now)));
  }

  /** Why there is no connection. */
  lostWords() {
    return this.link.closed ? reason(this.link.closed) : say("lost");
  }

  driverWords(robot) {
    if (!robot) return "";
    if (!this.link.mayDrive && this.link.open) return say("viewer");
    if (robot.driver) return say("person", robot.driver === this.link.me ? `${robot.driver} ✓` : robot.driver);
    return robot.state.mode === "autonomous" ? say("station_drives") : say("nobody");
  }

  drawStop(robot) {
    const { resume, stopSaid } = this.parts;
    const stopped = robot?.state.stopped === "1";
    resume.hidden = !stopped;
    if (this.held && !this.isStillHeld(robot)) this.letResumeGo();
    if (stopped) {
      const since = robot.stoppedSince;
      const age = since === null ? "" : span(Date.now() - since);
      const cause = sentence(`stop_cause_${robot.state.stop_cause}`);
      put(resume, `${say("resume")} · ${say("stopped", age, cause ? `: ${cause}` : "")}`);
      resume.disabled = !this.mayResume(robot);
      // Whoever has not stopped it himself is told once, by voice as well.
      const isNew = this.wasStopped === false && this.stopOf === robot;
      if (isNew && !stopSaid.textContent) this.stop.say("stopped_elsewhere", cause);
    } else if (this.wasStopped) {
      this.stop.say(null);
    }
    this.wasStopped = stopped;
    this.stopOf = robot;
  }
}

/** By the names of the robot: what holds it when it does not hear a board. */
const HELD_BY = { sensor: "blind", steering: "unheard" };

/** What a robot does, in words. */
export function doing(robot) {
  const { phase, next, product, hold, remedy } = robot?.state ?? {};
  if (!phase) return "";
  const words = [phase === "driving" && !next ? say("drives") : sentence(`phase_${phase}`, { node: crossing(next) }) ?? phase];
  if (product !== undefined) words.push(say("fetches", product));
  if (hold !== "none") words.push(sentence(`hold_${hold}`));
  for (const board of ["sensor", "steering"]) {
    // The reason why it stands may have said it.
    if (robot.state[`${board}_up`] === "0" && hold !== HELD_BY[board]) words.push(say("board_lost", say(`board_${board}`)));
  }
  const why = failure({ ...robot.state, failure_node: robot.state.node });
  // Stop and mode stand beside it.
  const end = ["resume", "mode"].includes(remedy) ? null : sentence(`remedy_${remedy}`);
  return [words.filter(Boolean).join(", "), why, end].filter(Boolean).join(". ");
}
