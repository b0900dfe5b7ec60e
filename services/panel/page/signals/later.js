// The view of signals is a script of its own: it is fetched when somebody opens the view, so that the first view
// of the page does not wait for a library of plots.

import { put, say } from "../words/words.js";

export class Later {
  /**
   * @param {{ view: HTMLElement, said: HTMLElement, again: HTMLElement }} parts
   * @param {() => boolean} isArmed whether the keys drive the robot
   * @param {import("../station/link.js").Link} link
   * @param {(query: string) => Promise<{ Signals: any }>} load fetches the script; its address ends with the query
   */
  constructor(parts, isArmed, link, load) {
    this.parts = parts;
    this.isArmed = isArmed;
    this.link = link;
    this.script = load;
    this.signals = null;
    this.tries = 0;
    /** @type {"loading" | "failed" | null} */
    this.state = null;
    /** The lane that somebody wants to see. */
    this.wanted = null;
    parts.again.onclick = () => this.load();
  }

  async load() {
    this.state = "loading";
    // A browser may keep for an address that it could not be had, so each try has its own.
    const tries = this.tries++;
    try {
      const { Signals } = await this.script(tries ? `?${tries}` : "");
      this.signals = new Signals(this.parts.view, this.isArmed, this.link);
      this.state = null;
    } catch {
      this.state = "failed";
    }
  }

  /**
   * Shows a lane by its word, as soon as there are lanes.
   *
   * @param {string} lane
   */
  show(lane) {
    this.wanted = lane;
  }

  /**
   * Draws the view if it is open; the first time it is fetched.
   *
   * @param {any} robot
   * @param {number} now
   */
  draw(robot, now) {
    const { view, said, again } = this.parts;
    if (view.hidden) return;
    if (!this.signals && !this.state) this.load();
    put(said, this.state ? say(this.state === "failed" ? "plots_failed" : "plots_loading") : "");
    said.hidden = !this.state;
    again.hidden = this.state !== "failed";
    if (this.wanted && this.signals) {
      this.signals.show(this.wanted);
      this.wanted = null;
    }
    this.signals?.draw(robot, now);
  }
}
