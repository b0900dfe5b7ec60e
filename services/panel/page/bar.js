// The first row: which robot, how fresh, who drives, what it does; and STOP, which never waits.

import { named } from "./chosen.js";
import { crossing, failure, sentence } from "./sentences.js";
import { reason } from "./reasons.js";
import { Resume } from "./resume.js";
import { Stop } from "./stop.js";
import { decimal, put, say, span } from "./words.js";

export class Bar {
  /** `resumes` are the buttons that end a stop when they are held. */
  constructor(link, parts, robot, resumes) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.resume = new Resume(link, resumes, robot);
    const name = () => robot()?.name ?? named();
    this.stop = new Stop(link, { form: parts.form, button: parts.stop, said: parts.stopSaid }, robot, name, () => this.resume.letGo());
  }

  draw(robot, now) {
    const { parts } = this;
    const stale = !robot || robot.isStale(now);
    document.body.classList.toggle("stale", stale);
    document.body.classList.toggle("stopped", robot?.state.stopped === "1");
    put(parts.link, this.linkWords(robot, now));
    put(parts.linkSaid, !this.link.open ? this.lostWords() : robot && stale ? say("old") : "");
    const { mode, stopped } = robot?.state ?? {};
    put(parts.mode, stopped === "1" ? say("stopped_short") : mode ? say(`mode_${mode}`) : "");
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
    if (!robot) return named() && this.link.me ? say("not_here", named()) : say("no_robot");
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
    if (robot.state.stopped === "1") return "";
    return robot.state.mode === "autonomous" ? say("station_drives") : say("nobody");
  }

  drawStop(robot) {
    const { halt, haltSaid, haltThen, resume, stopSaid, stopWhom, stopAll } = this.parts;
    const isStopped = robot?.state.stopped === "1";
    put(stopWhom, robot?.name ?? named() ?? "");
    stopAll.hidden = this.link.robots.size < (robot || !named() ? 2 : 1);
    halt.hidden = resume.hidden = !isStopped;
    this.resume.draw(robot);
    if (isStopped) {
      put(haltSaid, stopped(robot));
      put(haltThen, after(robot));
      // Whoever has not stopped it himself is told once, by voice as well.
      const isNew = this.wasStopped === false && this.stopOf === robot;
      if (isNew && !stopSaid.textContent) this.stop.say("stopped_elsewhere", causeOf(robot));
    } else if (this.wasStopped) {
      this.stop.say(null);
    }
    this.wasStopped = isStopped;
    this.stopOf = robot;
  }
}

const causeOf = (robot) => sentence(`stop_cause_${robot.state.stop_cause}`) ?? "";

/** That a robot is stopped, since when and why. */
export function stopped(robot) {
  const since = robot.stoppedSince;
  const cause = causeOf(robot);
  const tail = cause ? `: ${cause}` : "";
  return since === null ? `${say("stopped_short")}${tail}` : say("stopped", span(Math.max(0, Date.now() - since)), tail);
}

/** What it does once the stop is released. */
function after(robot) {
  const { mode, product, remedy } = robot.state;
  if (mode === "manual") return say("then_stands");
  if (remedy && remedy !== "resume") return say("then_needs");
  return product === undefined ? say("then_waits") : say("then_fetches", product);
}

/** By the names of the robot: what holds it when it does not hear a board. */
const HELD_BY = { sensor: "blind", steering: "unheard" };

/** What a robot does, in words. */
export function doing(robot) {
  const { phase, next, product, hold, remedy, stopped: isStopped } = robot?.state ?? {};
  if (!phase) return isStopped === "1" ? say("stopped_short") : "";
  // What it did before it was stopped it does no more.
  const does = phase === "driving" && !next ? say("drives") : sentence(`phase_${phase}`, { node: crossing(next) }) ?? phase;
  const words = [isStopped === "1" ? say("stopped_short") : does];
  if (product !== undefined) words.push(say(isStopped === "1" ? "was_to_fetch" : "fetches", product));
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
