// STOP: it asks nothing, waits for nothing, and says what has become of it.
//
//   socket there --> "stop", ahead of all else; unanswered for a second: the form as well
//   socket gone  --> the form, by a request of its own
//
// Before this runs the form is the browser's, and is answered by a page (services/panel/src/stop.rs).

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { reason, sentence } from "../words/sentences.js";
import { say } from "../words/words.js";

/**
 * Whether a person writes there: Space is a blank then.
 *
 * @param {EventTarget | null} element
 */
export function isText(element) {
  return element instanceof HTMLElement && (element.matches("input:not([type=checkbox], [type=radio], [type=file]), textarea") || element.isContentEditable);
}

/** After this time a stop that nobody has confirmed is said to be none, in ms. */
const CONFIRM_MS = 1_000;
/** So long the form is waited for; the panel answers within a second. */
const FORM_MS = 5_000;
/** A click ends a press that has stopped already, unless that was so long ago. */
const PRESS_MS = 1_000;

export class Stop {
  /**
   * The buttons of `form` stop the robots that they name, and `button` and the keys Esc and Space
   * `robot()`; `said` is where it is told. A stop calls `first`.
   *
   * @param {Link} link
   * @param {{ form: HTMLFormElement, button: HTMLButtonElement, said: HTMLElement }} parts
   * @param {() => Robot | null} robot
   * @param {() => string | null} name the name in view, whether that robot is known or not
   */
  constructor(link, { form, button, said }, robot, name, first = () => {}) {
    this.link = link;
    this.said = said;
    this.robot = robot;
    this.name = name;
    this.first = first;
    this.pressed = -Infinity;
    for (const one of form.querySelectorAll("button")) {
      one.addEventListener("pointerdown", () => {
        this.pressed = performance.now();
        this.press(one, button);
      });
    }
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const since = performance.now() - this.pressed;
      this.pressed = -Infinity;
      if (since > PRESS_MS) this.press(event.submitter ?? button, button);
    });
    document.documentElement.dataset.stops = "yes";
    // Ahead of whatever has the focus, dialogs and open lists included.
    addEventListener("keydown", (event) => this.key(event), { capture: true });
    // Some browsers press a button when Space comes up.
    addEventListener("keyup", (event) => event.key === " " && this.isKey(event) && event.preventDefault(), { capture: true });
  }

  /**
   * @param {Element} one
   * @param {HTMLButtonElement} button
   */
  press(one, button) {
    if (one === button) this.stop();
    else this.stopAll();
  }

  /** @param {KeyboardEvent} event */
  isKey({ key, target }) {
    // A button that is held, such as Resume, is held by Space.
    return key === "Escape" || (key === " " && !isText(target) && !(target instanceof Element && target.closest(".hold")));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (!this.isKey(event)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat) this.stop();
  }

  /** Stops the robot that is shown. */
  async stop() {
    this.first();
    const robot = this.robot();
    this.say("sent");
    // Who has not connected yet, or has no socket, is stopped by name.
    if (!robot || !this.link.open) return this.post([this.name()]);
    const unconfirmed = setTimeout(() => this.post([robot.name], "stop_unconfirmed"), CONFIRM_MS);
    const answer = await this.link.ask("stop", robot.name);
    clearTimeout(unconfirmed);
    if (answer.stopped !== undefined) this.became(robot.name, "stands", answer.stopped);
    else if (answer.done) this.became(robot.name, "sent");
    else if (answer.unsent) this.post([robot.name]);
    else if (answer.isUnknown) this.say("stop_unconfirmed");
    else if (!robot.connected) this.became(robot.name, "unheard");
    else this.say("stop_refused", reason(answer.refused ?? ""));
  }

  /** Stops every robot that the station knows. */
  stopAll() {
    this.first();
    this.say("sent");
    return this.post([]);
  }

  /**
   * The form by a request; without a name all are stopped. Until there is an answer `meanwhile` is said.
   *
   * @param {(string | null)[]} names
   */
  async post(names, meanwhile = "sent") {
    this.say(meanwhile);
    const body = new URLSearchParams([["name", localStorage.getItem("name") ?? ""], ...names.map((robot) => ["robot", robot ?? ""])]);
    let lines;
    try {
      const answer = await fetch("/stop", { method: "POST", body, headers: { accept: "text/plain" }, signal: AbortSignal.timeout(FORM_MS) });
      if (!answer.ok) return this.tell(say("stop_refused", (await answer.text()).split("\n")[0]));
      lines = (await answer.text()).split("\n").filter(Boolean);
    } catch (error) {
      // One that nobody answers may have arrived.
      return this.say(error instanceof DOMException && error.name === "TimeoutError" ? "stop_unconfirmed" : "stop_lost");
    }
    const words = lines.map((line) => {
      const [robot = "", word = "", ms] = line.split(" ");
      return became(robot, word, ms);
    });
    this.tell(words.join(". ") || say("no_robot"));
  }

  /**
   * @param {string} robot
   * @param {string} word
   * @param {number} [ms]
   */
  became(robot, word, ms) {
    this.tell(became(robot, word, ms));
  }

  /**
   * @param {string | null} key
   * @param {string[]} values
   */
  say(key, ...values) {
    this.tell(key ? say(key, ...values) : "");
  }

  /** @param {string} text */
  tell(text) {
    this.said.textContent = text;
  }
}

/**
 * What became of a robot's stop, by the words of the panel.
 *
 * @param {string} robot
 * @param {string} word
 * @param {string | number} [ms]
 */
const became = (robot, word, ms) => sentence(`became_${word}`, { robot, ms }) ?? word;
