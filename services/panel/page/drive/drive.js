// Driving by hand: keys, buttons, a gamepad; one held command at a time, given again until it is let go.
//
//   key, finger or stick down --> armed, driver, fresh state? --> "drive code" every 50 ms
//   up, blur, hidden, cancel, menu, lost link, stale state ----> "drive 1" once, then silence
//
// What goes straight or turns says its speed with each command; following the line has one of its own.
//
// Of two that are held the newer one counts, and when it is let go the older one again. Whatever
// else ends a hold ends both.
//
// The station gives each command its lease of 150 ms, so a page that dies lets the robot stand. Steps
// of the arm and the eighth turns are given once a press. Nothing cuts one of them short but the
// command to stand: what is held ends before one, and nothing is held or begun while one is under way.

/** @import { Answer, Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */
/** @import { Words } from "../words/words.js" */

import { Pads } from "./pads.js";
import { drawSticks } from "./sticks.js";
import { Speed } from "./speed.js";
import { reason } from "../words/sentences.js";
import { isText } from "../bar/stop.js";
import { say } from "../words/words.js";

const RENEW_MS = 50;
/** Code 1 of the wheels. */
const STAND = 1;
/** Unsent bytes beyond which nothing more is given. */
const BACKLOG = 2_000;

/** @typedef {[number, string, string[]]} Key A code of the wheels, its word, and the keys that say it. */
/** @typedef {string | Element} Source The key, the stick or the button of a pointer that holds something. */
/** @typedef {{ code: number, source: Source, button: Element | null, robot: Robot }} Hold */

/**
 * What is held.
 *
 * @type {Key[]}
 */
const HELD = [
  [2, "forward", ["ArrowUp"]],
  [4, "backward", ["ArrowDown"]],
  [6, "left", ["ArrowLeft"]],
  [7, "right", ["ArrowRight"]],
  [3, "follow_forward", []],
  [5, "follow_back", []],
];
/**
 * What runs once.
 *
 * @type {Key[]}
 */
const ONCE = [
  [8, "left_diag", ["PageUp"]],
  [9, "right_diag", ["PageDown"]],
  [STAND, "stand", []],
];
/** The buttons of the wheels, row by row. */
const PAD = ["left_diag", "forward", "right_diag", "left", "stand", "right", "follow_back", "backward", "follow_forward"];
/** The codes that have a speed. */
const PACED = [2, 4, 6, 7];
/**
 * The speeds, the slowest first: what a command says, its word and its keys.
 *
 * @type {[string, string, string[]][]}
 */
const SPEEDS = [
  ["slow", "slow", ["c"]],
  ["middle", "middle", ["d"]],
  ["full", "full_speed", ["e"]],
];
/**
 * One step of the arm: its code, word and keys.
 *
 * @type {[string, string, string[]][]}
 */
const STEPS = [
  ["F1", "clockwise", ["1"]],
  ["F2", "counterclockwise", ["2"]],
  ["F3", "in", ["q"]],
  ["F4", "out", ["w"]],
  ["F5", "up", ["a"]],
  ["F6", "down", ["s"]],
  ["F7", "left", ["z"]],
  ["F8", "right", ["x"]],
  ["F9", "squeeze", [","]],
  ["FA", "release", [".", "\u00f7"]],
];

/**
 * Keys whose names are long, as they are printed on keyboards.
 *
 * @type {Record<string, string>}
 */
const SIGNS = { ArrowUp: "\u2191", ArrowDown: "\u2193", ArrowLeft: "\u2190", ArrowRight: "\u2192", PageUp: "PgUp", PageDown: "PgDn" };

/**
 * Each key that drives or moves the arm, as it is printed, with the word for what it does.
 *
 * @type {Record<"wheels" | "arm", [string, string][]>}
 */
export const KEYS = {
  wheels: [...HELD, ...ONCE, ...SPEEDS].flatMap(([, word, [key]]) => (key ? [[SIGNS[key] ?? key, word]] : [])),
  arm: STEPS.map(([, word, keys]) => [keys.join(" "), word]),
};

export class Driving {
  /**
   * @param {Link} link
   * @param {{ armed: HTMLInputElement, sticks: SVGElement } & Record<"said" | "pad" | "speed" | "arm" | "resume", HTMLElement>} parts
   * @param {() => Robot | null} robot
   * @param {() => number} now
   */
  constructor(link, parts, robot, now) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.now = now;
    /**
     * What is held now.
     *
     * @type {Hold | null}
     */
    this.held = null;
    /**
     * What was held before that and still is, the newest last.
     *
     * @type {Hold[]}
     */
    this.older = [];
    this.timer = 0;
    /**
     * The robot that a step or a turn is under way on.
     *
     * @type {Robot | null}
     */
    this.step = null;
    /** Whether what is told was refused because of a stop. */
    this.isOfStop = false;
    /**
     * What the gamepads say.
     *
     * @type {number | null}
     */
    this.padCode = null;
    this.gamepads = new Pads(now);
    /** @type {Map<string, HTMLElement>} */
    const speeds = new Map();
    for (const [step, word, keys] of SPEEDS) speeds.set(step, addButton(parts.speed, word, keys, `speed ${step}`));
    this.speed = new Speed(speeds, () => this.paced());
    this.buttons();
    this.keys();
    this.releases();
  }

  /** Whether something is held now. */
  get isHeld() {
    return this.held !== null;
  }

  /**
   * @param {string | null} key
   * @param {(string | number | null | undefined)[]} values
   */
  tell(key, ...values) {
    this.parts.said.textContent = key ? say(key, ...values) : "";
    this.isOfStop = false;
  }

  /**
   * Tells why the robot has refused; a stop is ended by the button beside it.
   *
   * @param {string} refused
   */
  refuse(refused) {
    this.tell("refused", reason(refused));
    this.isOfStop = this.robot()?.state.stopped === "1";
  }

  /**
   * Why nothing may be driven now; null if it may.
   *
   * @returns {Words | null}
   */
  objection() {
    const robot = this.robot();
    if (!robot || !this.link.open) return ["lost"];
    if (robot.isStale(this.now())) return ["old"];
    if (!this.parts.armed.checked) return ["not_armed", say("armed")];
    if (robot.driver !== this.link.me) return ["not_driver"];
    return null;
  }

  /** Buttons that would do nothing now look like it. */
  draw() {
    const isOff = this.objection() !== null;
    for (const part of [this.parts.pad, this.parts.arm]) part.classList.toggle("off", isOff);
    if (this.robot()?.state.stopped !== "1") this.isOfStop = false;
    this.parts.resume.toggleAttribute("hidden", !this.isOfStop);
  }

  /**
   * Holds a code of the wheels; a button's hold ends with its focus, too.
   *
   * @param {number} code
   * @param {Source} source
   * @param {Element | null} button
   */
  hold(code, source, button = null) {
    if (this.held?.source === source || this.older.some((other) => other.source === source)) return;
    const why = this.objection();
    if (why) return this.tell(...why);
    const robot = this.robot();
    if (!robot) return;
    if (this.step === robot) return this.tell("wait");
    this.tell(null);
    if (this.held) this.older.push(this.held);
    else this.timer = setInterval(() => this.renew(), RENEW_MS);
    this.held = { code, source, button, robot };
    this.press();
    this.renew();
  }

  /** Shows what is held as pressed, by whatever it is held. */
  press() {
    const codes = [this.held, ...this.older].map((held) => `drive ${held?.code}`);
    for (const button of this.parts.pad.children) button.classList.toggle("down", codes.includes(button.getAttribute("data-action") ?? ""));
  }

  /** Another speed was chosen: what is held goes on at that one. */
  paced() {
    if (!this.held) return;
    // It is another command to the robot: what it says of the one before ends nothing.
    this.held = { ...this.held };
    this.renew();
  }

  async renew() {
    if (this.held?.source === "pad") this.pads();
    if (!this.held) return;
    const { code, robot } = this.held;
    const why = this.objection();
    if (why || robot !== this.robot()) return this.letGo(...(why ?? []));
    if (this.link.backlog > BACKLOG) return this.letGo("full");
    const held = this.held;
    const answer = await this.link.act(robot, `drive ${code}${PACED.includes(code) ? this.speed.said : ""}`);
    // What was let go meanwhile has its own end.
    if (answer.refused && this.held === held) {
      this.letGo();
      this.refuse(answer.refused);
    }
  }

  /**
   * Ends what is held, and what was held before it; tells why, if there is more to it than a hand.
   *
   * @param {Words | []} why
   */
  letGo(...why) {
    if (!this.held) return;
    clearInterval(this.timer);
    const { robot } = this.held;
    this.held = null;
    this.older = [];
    this.press();
    if (this.link.open) this.link.act(robot, `drive ${STAND}`);
    const [word, ...values] = why;
    if (word) this.tell(word, ...values);
  }

  /**
   * A key, pointer or stick is let go: what was held before it counts again.
   *
   * @param {Source} source
   */
  release(source) {
    if (this.held?.source === source) {
      const before = this.older.pop();
      if (!before) return this.letGo();
      this.held = before;
      this.press();
      this.renew();
      return;
    }
    this.older = this.older.filter((other) => other.source !== source);
    this.press();
  }

  /**
   * Has the robot do something once.
   *
   * @param {string} action
   */
  async once(action) {
    const why = this.objection();
    if (why) return this.tell(...why);
    const robot = this.robot();
    if (!robot) return;
    const isStand = action === `drive ${STAND}`;
    if (!isStand && this.step === robot) return this.tell("wait");
    const wasHeld = this.held !== null;
    // What is held ends for it, so the robot is not driven on while something else runs.
    this.letGo();
    if (action.startsWith("arm") && wasHeld) return this.tell("arm_waits");
    this.tell(null);
    if (isStand) return this.hear(await this.link.act(robot, action));
    this.step = robot;
    const button = document.querySelector(`[data-action="${action}"]`);
    button?.classList.add("down");
    const answer = await this.link.act(robot, action);
    button?.classList.remove("down");
    if (this.step === robot) this.step = null;
    this.hear(answer);
  }

  /** @param {Answer} answer */
  hear({ refused }) {
    if (refused) this.refuse(refused);
  }

  buttons() {
    const { pad, arm } = this.parts;
    for (const name of PAD) {
      const held = HELD.find(([, word]) => word === name);
      const once = ONCE.find(([, word]) => word === name);
      if (held) this.heldButton(pad, held);
      if (once) addButton(pad, name, once[2], `drive ${once[0]}`).addEventListener("click", () => this.once(`drive ${once[0]}`));
    }
    for (const [code, word, keys] of STEPS) {
      addButton(arm, word, keys, `arm ${code}`).addEventListener("click", () => this.once(`arm ${code}`));
    }
  }

  /**
   * @param {HTMLElement} pad
   * @param {Key} key
   */
  heldButton(pad, [code, word, keys]) {
    const button = addButton(pad, word, keys, `drive ${code}`);
    button.addEventListener("pointerdown", (event) => {
      button.setPointerCapture(event.pointerId);
      this.hold(code, button, button);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      button.addEventListener(end, () => this.release(button));
    }
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    button.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && !event.repeat) this.hold(code, place(event), button);
    });
    // Wherever the key comes up: the focus may be elsewhere by then.
    button.addEventListener("blur", () => [this.held, ...this.older].some((held) => held?.button === button) && this.letGo());
  }

  keys() {
    /**
     * @template {[unknown, string, string[]]} Row
     * @param {Row[]} table
     * @param {string} key
     */
    const find = (table, key) => table.find(([, , keys]) => keys.includes(key));
    addEventListener("keydown", (event) => {
      // Another window may have the key's end.
      if (event.ctrlKey || event.altKey || event.metaKey) return this.letGo();
      if (ownsKeys(event.target)) return;
      const held = find(HELD, event.key);
      const once = find(ONCE, event.key);
      // The keypad's division sign is a slash to most layouts.
      const step = find(STEPS, event.code === "NumpadDivide" ? "\u00f7" : event.key.toLowerCase());
      const pace = find(SPEEDS, event.key.toLowerCase());
      if (!held && !once && !step && !pace) return;
      // Unarmed, the arrows are the page's.
      if (!this.parts.armed.checked) return;
      event.preventDefault();
      if (event.repeat) return;
      if (held) this.hold(held[0], place(event));
      else if (once) this.once(`drive ${once[0]}`);
      else if (step) this.once(`arm ${step[0]}`);
      else if (pace) this.speed.choose(pace[0]);
    });
    addEventListener("keyup", (event) => this.release(place(event)));
  }

  /** Whatever may have eaten the end of a press is one. */
  releases() {
    addEventListener("blur", () => this.letGo());
    addEventListener("pagehide", () => this.letGo());
    document.addEventListener("visibilitychange", () => document.hidden && this.letGo());
    document.addEventListener("focusin", (event) => ownsKeys(event.target) && this.letGo());
    // A menu or a list of the browser's own takes the end of a key for itself.
    addEventListener("contextmenu", (event) => event.defaultPrevented || this.letGo());
    addEventListener("pointerdown", (event) => ownsKeys(event.target) && this.letGo(), { capture: true });
    this.parts.armed.addEventListener("change", () => {
      drawSticks(this.parts.sticks, null);
      this.gamepads.forget();
      this.letGo();
    });
    this.link.addEventListener("link", () => this.link.open || this.letGo());
  }

  /** Looks at the gamepads; called before each picture. */
  pads() {
    // A browser that was asked once looks at them all the time, for a hundredth of a core.
    if (!this.parts.armed.checked) return;
    const was = this.padCode;
    this.padCode = this.gamepads.read();
    drawSticks(this.parts.sticks, this.gamepads.axes);
    this.speed.turn(this.gamepads.turned);
    if (was === this.padCode) return;
    this.release("pad");
    if (this.padCode) this.hold(this.padCode, "pad");
  }
}

/**
 * Whether keys belong to a field: to write, or to choose with arrows.
 *
 * @param {EventTarget | null} element
 */
function ownsKeys(element) {
  return isText(element) || (element instanceof HTMLElement && element.closest("select, [type=radio], [type=file]") !== null);
}

/**
 * Which key it is, however it is called: with or without Shift and Num Lock the keypad's have two names.
 *
 * @param {KeyboardEvent} event
 */
function place({ code, key }) {
  return code || key;
}

/**
 * @param {HTMLElement} parent
 * @param {string} word
 * @param {string[]} keys
 * @param {string} action
 */
function addButton(parent, word, keys, action) {
  const button = document.createElement("button");
  button.type = "button";
  button.dataset.word = word;
  button.dataset.action = action;
  button.id = `${parent.id}-${word}`;
  button.textContent = say(word);
  const [key] = keys;
  if (key) {
    button.setAttribute("aria-keyshortcuts", key);
    button.dataset.key = SIGNS[key] ?? key;
  }
  // A key that repeats is one press.
  button.addEventListener("keydown", (event) => event.repeat && event.key === "Enter" && event.preventDefault());
  parent.append(button);
  return button;
}
