// The line under the robot: the calibration of its sensors as guided steps, and the gains of the
// control that follows it.

import { judge, wrong } from "../parts/fields.js";
import { reason } from "../words/sentences.js";
import { SENSORS, sensors } from "../signals/strips.js";
import { put, say } from "../words/words.js";

/** The most that a line sensor reads. */
const MOST = 255;

export class Line {
  constructor(parts, link, robot) {
    Object.assign(this, { parts, link, robot });
    /** The gains in force, those before the last change, and whether others are being typed. */
    this.gainsNow = null;
    this.gainsBefore = null;
    this.gainsTyped = false;
    judge(parts.gains);
    parts.gains.addEventListener("submit", (event) => {
      event.preventDefault();
      const { p, d } = parts.gains.elements;
      const why = wrong([p, d]);
      if (why) put(parts.said, why);
      else this.setGains([p.value, d.value]);
    });
    parts.gains.addEventListener("input", () => (this.gainsTyped = true));
    parts.gainsBack.onclick = () => {
      this.gainsTyped = false;
      this.setGains(this.gainsBefore);
    };
    this.bars = Array.from({ length: SENSORS }, () => new SensorBar(parts.sensors));
    parts.calibrate.onclick = () => this.calibrate();
  }

  /** Step by step: put it over tape, press and move it, read what came of it. */
  async calibrate() {
    const { calibrate, steps, calibrationSaid } = this.parts;
    const at = (step) => [...steps.children].forEach((line, index) => line.toggleAttribute("aria-current", index === step));
    const robot = this.robot();
    if (robot) robot.sensors = null;
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
    this.drawSensors(robot);
    const { gain_p: p, gain_d: d } = robot?.state ?? {};
    this.gainsNow = p === undefined || d === undefined ? null : [p, d];
    put(this.parts.gainsNow, this.gainsNow ? say("gains_now", p, d) : say("gains_unset"));
    put(this.parts.gainsBack, this.gainsBefore ? say("put_back", ...this.gainsBefore) : "");
    this.parts.gainsBack.hidden = !this.gainsBefore;
    if (this.gainsTyped || !this.gainsNow) return;
    const { elements } = this.parts.gains;
    [elements.p.value, elements.d.value] = this.gainsNow;
  }

  /** What the sensors see now, and what they have read in the calibration that runs or ran last. */
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

/** One sensor: its reading as a mark on a scale, what it has read so far as a stretch of it. */
class SensorBar {
  constructor(parent) {
    const add = (inside, name) => inside.appendChild(Object.assign(document.createElement("span"), { className: name }));
    this.column = add(parent, "sensor");
    this.scale = add(this.column, "scale");
    this.stretch = add(this.scale, "stretch");
    this.mark = add(this.scale, "mark");
    this.value = add(this.column, "value");
  }

  draw(bit, read) {
    this.column.classList.toggle("on", bit === "1");
    this.column.classList.toggle("both", Boolean(read?.both));
    this.column.classList.toggle("unread", !read);
    const { reading = 0, lowest = 0, highest = 0 } = read ?? {};
    const share = (value) => `${((value / MOST) * 100).toFixed(1)}%`;
    this.mark.style.bottom = share(reading);
    this.stretch.style.bottom = share(lowest);
    this.stretch.style.height = share(highest - lowest);
    put(this.value, read ? String(reading) : "–");
  }
}
