// Tells a person who looks elsewhere that a robot needs him: in the title of the page, and if he has asked for it
// by a message of the browser and by a sound. Browsers show messages only for a page of this machine or over TLS.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */
/** @import { Face, Look } from "./face.js" */

import { say } from "../words/words.js";
import { battery } from "./battery.js";
import { face } from "./face.js";

/**
 * The looks that only a person ends.
 *
 * @type {Look[]}
 */
const NEEDS = ["board", "lost", "needs"];
/** What has passed within this time is not told, in ms. */
const PASSES_MS = 2_000;
/** The sound: its pitch in Hz and its length in s. */
const PITCH = 660;
const LENGTH = 0.3;

export class Notify {
  /**
   * @param {Link} link
   * @param {HTMLInputElement} box
   */
  constructor(link, box) {
    this.link = link;
    this.box = box;
    this.title = document.title;
    /** @type {AudioContext | null} */
    this.audio = null;
    /**
     * Since when each robot has needed somebody, by its name and whether to charge it, and whether that has been told.
     *
     * @type {Map<string, { since: number, isTold: boolean }>}
     */
    this.needing = new Map();
    box.checked = localStorage.getItem("notify") === "yes";
    box.addEventListener("change", () => this.choose());
    // A page may sound only once somebody has pressed something on it.
    addEventListener("pointerdown", () => box.checked && this.wake());
  }

  choose() {
    localStorage.setItem("notify", this.box.checked ? "yes" : "no");
    if (!this.box.checked) return;
    this.wake();
    globalThis.Notification?.requestPermission();
  }

  wake() {
    this.audio ??= new AudioContext();
    this.audio.resume();
  }

  /** @param {number} now */
  draw(now) {
    const all = [...this.link.robots.values()].map((robot) => ({ robot, ...face(this.link, robot, now) }));
    /** @type {Need[]} */
    const needy = all.flatMap((one) => (isNeedy(one) ? one : (alarm(one.robot, now) ?? [])));
    const title = needy.map(({ robot, said }) => `${robot.name}: ${said}`).join("; ");
    const called = title ? `! ${title}` : this.title;
    if (document.title !== called) document.title = called;
    const before = this.needing;
    this.needing = new Map(needy.map((one) => [key(one), before.get(key(one)) ?? { since: now, isTold: false }]));
    for (const one of needy) {
      const { robot, said, more } = one;
      const need = this.needing.get(key(one));
      if (!need || need.isTold || now - need.since < PASSES_MS) continue;
      need.isTold = true;
      if (this.box.checked) this.tell(robot.name, [said, more].filter(Boolean).join(". "));
    }
  }

  /**
   * @param {string} name
   * @param {string} body
   */
  tell(name, body) {
    this.sound();
    if (globalThis.Notification?.permission !== "granted") return;
    try {
      new Notification(name, { body, tag: name });
    } catch {
      // On some phones only a worker may; the sound has told it.
    }
  }

  sound() {
    if (this.audio?.state !== "running") return;
    const tone = new OscillatorNode(this.audio, { frequency: PITCH });
    tone.connect(this.audio.destination);
    tone.start();
    tone.stop(this.audio.currentTime + LENGTH);
  }
}

/** @typedef {{ robot: Robot, look: Look | "charge", said?: string | null, more?: string | null }} Need */

/**
 * Of one robot, to charge it is told apart from all else.
 *
 * @param {Need} need
 */
const key = ({ robot: { name }, look }) => `${name} ${look === "charge"}`;

/**
 * The battery of a robot that still goes is nearly empty.
 *
 * @param {Robot} robot
 * @param {number} now
 * @returns {Need | null}
 */
function alarm(robot, now) {
  const { words, isLow } = battery(robot.state);
  return isLow && !robot.isStale(now) ? { robot, look: "charge", said: say("battery_alarm", words) } : null;
}

/**
 * Whether a robot waits for a person: to end what is wrong, or to pick goods up.
 *
 * @param {Face & { robot: Robot }} shown
 */
function isNeedy({ look, robot: { state } }) {
  const isStoppedAlone = look === "stopped" && state.stop_cause !== undefined && state.stop_cause !== "ordered";
  return NEEDS.includes(look) || isStoppedAlone || (look === "waits" && state.phase === "picking" && state.pick === "manual");
}
