// STOP: it asks nothing, waits for nothing, and says what has become of it.

import { reason } from "./reasons.js";
import { say } from "./words.js";

/** Whether a person writes there: Space is a blank then. */
export function isText(element) {
  return element instanceof HTMLElement && (element.matches("input:not([type=checkbox], [type=radio], [type=file]), textarea") || element.isContentEditable);
}

/** After this time a stop that nobody has confirmed is said to be none, in ms. */
const CONFIRM_MS = 1_000;

export class Stop {
  /** `button` and the keys Esc and Space stop `robot()`; `said` is where it is told. A stop calls `first`. */
  constructor(link, { button, said, resume = null }, robot, first = () => {}) {
    Object.assign(this, { link, said, resume, robot, first });
    button.addEventListener("pointerdown", () => this.stop());
    button.addEventListener("click", (event) => event.detail === 0 && this.stop());
    // Ahead of whatever has the focus, dialogs and open lists included.
    addEventListener("keydown", (event) => this.key(event), { capture: true });
    // Some browsers press a button when Space comes up.
    addEventListener("keyup", (event) => event.key === " " && this.isKey(event) && event.preventDefault(), { capture: true });
  }

  isKey({ key, target }) {
    // The button of Resume is held by Space.
    return key === "Escape" || (key === " " && !isText(target) && !(this.resume && target === this.resume));
  }

  key(event) {
    if (!this.isKey(event)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat) this.stop();
  }

  /** Stops the robot that is shown; every other one has its own page. */
  async stop() {
    this.first();
    const robot = this.robot();
    if (!robot || !this.link.open) return this.say("stop_lost");
    this.say("sent");
    const unconfirmed = setTimeout(() => this.say("stop_unconfirmed"), CONFIRM_MS);
    const answer = await this.link.ask("stop", robot.name);
    clearTimeout(unconfirmed);
    if (answer.stopped !== undefined) this.say("stands", answer.stopped);
    else if (answer.done) this.say("sent");
    else if (answer.unsent) this.say("stop_lost");
    else if (answer.isUnknown) this.say("stop_unconfirmed");
    else this.say("stop_refused", reason(answer.refused));
  }

  say(key, ...values) {
    this.said.textContent = key ? say(key, ...values) : "";
  }
}
