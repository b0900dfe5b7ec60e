// The line under the robot: the calibration of its sensors as guided steps, and the gains of the
// control that follows it.

/** @import { Link } from "../station/link.js" */
/** @import { Robot, Sensor } from "../station/robot.js" */
/** @typedef {[string, string]} Gains On the error and on its change. */

import { field, judge, wrong } from "../parts/fields.js";
import { reason } from "../words/sentences.js";
import { SENSORS, sensors } from "../signals/strips.js";
import { put, say } from "../words/words.js";

/** The most that a line sensor reads. */
const MOST = 255;

export class Line {
  /**
   * @param {{ gains: HTMLFormElement, calibrate: HTMLButtonElement }
   *   & Record<"gainsNow" | "gainsBack" | "said" | "steps" | "calibrationSaid" | "sensors", HTMLElement>} parts
   * @param {Link} link
   * @param {() => Robot | null} robot
   */
  constructor(parts, link, robot) {
    this.parts = parts;
    this.link = link;
    this.robot = robot;
    this.p = field(parts.gains, "p", HTMLInputElement);
    this.d = field(parts.gains, "d", HTMLInputElement);
    /**
     * The gains in force, those before the last change, and whether others are being typed.
     *
     * @type {Gains | null}
     */
    this.gainsNow = null;
    /** @type {Gains | null} */
    this.gainsBefore = null;
    this.gainsTyped = false;
    judge(parts.gains);
    parts.gains.addEventListener("submit", (event) => {
      event.preventDefault();
      const why = wrong([this.p, this.d]);
      if (why) put(parts.said, why);
      else this.setGains([this.p.value, this.d.value]);
    });
    parts.gains.addEventListener("input", () => (this.gainsTyped = true));
    parts.gainsBack.onclick = () => {
      this.gainsTyped = false;
      if (this.gainsBefore) this.setGains(this.gainsBefore);
    };
    this.bars = Array.from({ length: SENSORS }, () => new SensorBar(parts.sensors));
    parts.calibrate.onclick = () => this.calibrate();
  }

  /** Step by step: put it over tape, press and move it, read what came of it. */
  async calibrate() {
    const { calibrate, steps, calibrationSaid } = this.parts;
    /** @param {number} step */
    const at = (step) => [...steps.children].forEach((line, index) => (line.ariaCurrent = index === step ? "step" : null));
    const robot = this.robot();
    if (robot) robot.sensors = null;
    calibrate.toggleAttribute("disabled", true);
    at(1);
    put(calibrationSaid, say("calibrating"));
    const { refused } = robot ? await this.link.act(robot, "calibrate") : { refused: say("no_robot") };
    at(2);
    put(calibrationSaid, refused ? reason(refused) : say("calibrated"));
    calibrate.toggleAttribute("disabled", false);
  }

  /**
   * The gains in force stand in the fields, unless somebody types there.
   *
   * @param {Robot | null} robot
   */
  draw(robot) {
    this.drawSensors(robot);
    const { gain_p: p, gain_d: d } = robot?.state ?? {};
    this.gainsNow = p === undefined || d === undefined ? null : [p, d];
    put(this.parts.gainsNow, this.gainsNow ? say("gains_now", p, d) : say("gains_unset"));
    put(this.parts.gainsBack, this.gainsBefore ? say("put_back", ...this.gainsBefore) : "");
    this.parts.gainsBack.toggleAttribute("hidden", !this.gainsBefore);
    if (this.gainsTyped || !this.gainsNow) return;
    [this.p.value, this.d.value] = this.gainsNow;
  }

  /**
   * What the sensors see now, and what they have read in the calibration that runs or ran last.
   *
   * @param {Robot | null} robot
   */
  drawSensors(robot) {
    const bits = sensors(robot?.state);
    const read = robot?.sensors;
    this.bars.forEach((bar, index) => bar.draw(bits?.[index], read?.[index]));
    const both = read?.filter(({ both }) => both).length ?? 0;
    const values = read?.map(({ reading }) => reading).join(" ") ?? "";
    const seen = bits ? say("sensors_seen", bits) : say("sensors_unheard");
    const words = read ? say("sensors_read", values, both) : seen;
    const { sensors: row } = this.parts;
    if (row.getAttribute("aria-label") !== words) row.setAttribute("aria-label", words);
  }

  /** @param {Gains} gains */
  async setGains([p, d]) {
    const before = this.gainsNow;
    const robot = this.robot();
    const answer = robot ? await this.link.act(robot, `gains ${p} ${d}`) : { refused: say("no_robot") };
    put(this.parts.said, answer.refused ? reason(answer.refused) : say("saved"));
    if (answer.refused) return;
    // What is set again leaves what can be put back.
    if (String(before) !== String([p, d])) this.gainsBefore = before;
    // Somebody may be typing others by now.
    if (this.p.value === p && this.d.value === d) this.gainsTyped = false;
  }
}

/** One sensor: its reading as a mark on a scale, what it has read so far as a stretch of it. */
class SensorBar {
  /** @param {HTMLElement} parent */
  constructor(parent) {
    /**
     * @param {HTMLElement} inside
     * @param {string} name
     */
    const add = (inside, name) => inside.appendChild(Object.assign(document.createElement("span"), { className: name }));
    this.column = add(parent, "sensor");
    this.scale = add(this.column, "scale");
    this.stretch = add(this.scale, "stretch");
    this.mark = add(this.scale, "mark");
    this.value = add(this.column, "value");
  }

  /**
   * @param {string | undefined} bit
   * @param {Sensor | undefined} read
   */
  draw(bit, read) {
    this.column.classList.toggle("on", bit === "1");
    this.column.classList.toggle("both", Boolean(read?.both));
    this.column.classList.toggle("unread", !read);
    const { reading = 0, lowest = 0, highest = 0 } = read ?? {};
    /** @param {number} value */
    const share = (value) => `${((value / MOST) * 100).toFixed(1)}%`;
    this.mark.style.bottom = share(reading);
    this.stretch.style.bottom = share(lowest);
    this.stretch.style.height = share(highest - lowest);
    put(this.value, read ? String(reading) : "–");
  }
}
