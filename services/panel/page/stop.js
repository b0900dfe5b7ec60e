// STOP: it asks nothing, waits for nothing, and says what has become of it.

import { reason } from "./reasons.js";
import { say } from "./words.js";

/** After this time a stop that nobody has confirmed is said to be none, in ms. */
const CONFIRM_MS = 1_000;

export class Stop {
  /** `button` and the keys Esc and Space stop `robot()`; `said` is where it is told. */
  constructor(link, { button, said, resume = null }, robot) {
    Object.assign(this, { link, said, resume, robot });
    button.addEventListener("pointerdown", () => this.stop());
    button.addEventListener("click", (event) => event.detail === 0 && this.stop());
    // Ahead of whatever has the focus, dialogs and open lists included.
    addEventListener("keydown", (event) => this.key(event), { capture: true });
  }

  key(event) {
    const inText = event.target instanceof HTMLElement && event.target.matches("input:not([type=checkbox], [type=radio]), textarea, select");
    if (event.key !== "Escape" && !(event.key === " " && !inText)) return;
    // The button of Resume is held by this key.
    if (event.key === " " && this.resume && event.target === this.resume) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat) this.stop();
  }

  /** Stops the robot that is shown; every other one has its own page. */
  async stop() {
    const robot = this.robot();
    if (!robot || !this.link.open) return this.say("stop_lost");
    this.say("sent");
    const unconfirmed = setTimeout(() => this.say("stop_unconfirmed"), CONFIRM_MS);
    const answer = await this.link.ask("stop", robot.name);
    clearTimeout(unconfirmed);
    if (answer.stopped !== undefined) this.say("stands", answer.stopped);
    else if (answer.done) this.say("sent");
    else if (answer.unsent) this.say("stop_lost");
    else if (answer.refused === "lost") this.say("stop_unconfirmed");
    else this.say("stop_refused", reason(answer.refused));
  }

  say(key, ...values) {
    this.said.textContent = key ? say(key, ...values) : "";
  }
}
