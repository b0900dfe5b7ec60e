// The line under the robot: the calibration of its sensors as guided steps, and the gains of the
// control that follows it.

import { reason } from "./reasons.js";
import { SENSORS, sensors } from "./strips.js";
import { put, say } from "./words.js";

export class Line {
  constructor(parts, link, robot) {
    Object.assign(this, { parts, link, robot });
    /** The gains in force, those before the last change, and whether others are being typed. */
    this.gainsNow = null;
    this.gainsBefore = null;
    this.gainsTyped = false;
    parts.gains.addEventListener("submit", (event) => {
      event.preventDefault();
      const { p, d } = parts.gains.elements;
      this.setGains([p.value, d.value]);
    });
    parts.gains.addEventListener("input", () => (this.gainsTyped = true));
    parts.gainsBack.onclick = () => {
      this.gainsTyped = false;
      this.setGains(this.gainsBefore);
    };
    /** What each line sensor has seen since the calibration began; null while there is none. */
    this.seen = null;
    this.bars = Array.from({ length: SENSORS }, () => parts.sensors.appendChild(document.createElement("span")));
    parts.calibrate.onclick = () => this.calibrate();
  }

  /** Step by step: put it over tape, press and move it, read what came of it. */
  async calibrate() {
    const { calibrate, steps, calibrationSaid } = this.parts;
    const at = (step) => [...steps.children].forEach((line, index) => line.toggleAttribute("aria-current", index === step));
    const robot = this.robot();
    this.seen = Array.from({ length: SENSORS }, () => new Set());
    calibrate.disabled = true;
    at(1);
    put(calibrationSaid, say("calibrating"));
    const { refused } = robot ? await this.link.act(robot, "calibrate") : { refused: say("no_robot") };
    at(2);
    put(calibrationSaid, refused ? reason(refused) : say("calibrated"));
    calibrate.disabled = false;
  }

  /** The gains in force stand in the fields, unless somebody types there. */
  draw(robot) {
    this.drawSensors(robot?.state);
    const { gain_p: p, gain_d: d } = robot?.state ?? {};
    this.gainsNow = p === undefined || d === undefined ? null : [p, d];
    put(this.parts.gainsNow, this.gainsNow ? say("gains_now", p, d) : say("gains_unset"));
    put(this.parts.gainsBack, this.gainsBefore ? say("put_back", ...this.gainsBefore) : "");
    this.parts.gainsBack.hidden = !this.gainsBefore;
    if (this.gainsTyped || !this.gainsNow) return;
    const { elements } = this.parts.gains;
    [elements.p.value, elements.d.value] = this.gainsNow;
  }

  /** What the sensors see now, and which have seen both tape and floor. */
  drawSensors(state) {
    const bits = sensors(state);
    let both = 0;
    this.bars.forEach((bar, index) => {
      const bit = bits?.[index];
      if (this.parts.calibrate.disabled && state?.line_bits) this.seen[index].add(bit);
      const isBoth = this.seen?.[index].size === 2;
      both += Number(isBoth);
      bar.classList.toggle("on", bit === "1");
      bar.classList.toggle("both", isBoth);
    });
    const words = bits ? say("sensors_seen", bits, both) : say("sensors_unheard");
    const { sensors: row } = this.parts;
    if (row.getAttribute("aria-label") !== words) row.setAttribute("aria-label", words);
  }

  async setGains([p, d]) {
    const before = this.gainsNow;
    const robot = this.robot();
    const answer = robot ? await this.link.act(robot, `gains ${p} ${d}`) : { refused: say("no_robot") };
    put(this.parts.said, answer.refused ? reason(answer.refused) : say("saved"));
    if (answer.refused) return;
    this.gainsBefore = before;
    // Somebody may be typing others by now.
    const { elements } = this.parts.gains;
    if (elements.p.value === p && elements.d.value === d) this.gainsTyped = false;
  }
}
