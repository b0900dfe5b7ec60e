// A view that few open is a script of its own, fetched when somebody opens it: the first view of the page does not
// wait for it.

import { put, say } from "../words/words.js";
import { retried } from "./retried.js";

/**
 * @template {object} Script what the script exports
 * @template {object} Made what the page makes of it
 */
export class Later {
  /**
   * @param {HTMLElement} view does not take the hand before its script is there
   * @param {(query: string) => Promise<Script>} fetches the script (`retried`)
   * @param {(script: Script) => Made} make
   */
  constructor(view, fetches, make) {
    this.view = view;
    this.fetches = retried(fetches);
    this.make = make;
    /**
     * Null before the script is there.
     *
     * @type {Made | null}
     */
    this.made = null;
    /** @type {"loading" | "failed" | null} */
    this.state = null;
    /**
     * What somebody wants of it as soon as it takes the hand.
     *
     * @type {((made: Made) => void) | null}
     */
    this.wanted = null;
    view.inert = true;
  }

  async load() {
    this.state = "loading";
    try {
      this.made = this.make(await this.fetches());
      this.state = null;
    } catch {
      this.state = "failed";
    }
  }

  /**
   * Does this now or, while the view does not take the hand, as soon as it does: before, nothing in it takes the focus.
   *
   * @param {(made: Made) => void} act
   */
  once(act) {
    if (this.made && !this.view.inert) act(this.made);
    else this.wanted = act;
  }

  /**
   * What is to be drawn, if the view is open; the first time it is fetched.
   *
   * @param {{ said: HTMLElement, again: HTMLElement }} parts for how the fetching goes
   */
  open({ said, again }) {
    if (this.view.hidden) return null;
    if (!this.made && !this.state) this.load();
    put(said, this.state ? say(`view_${this.state}`) : "");
    again.toggleAttribute("hidden", this.state !== "failed");
    again.onclick = () => this.load();
    // It takes the hand with its first picture.
    if (this.made && this.view.inert) {
      this.view.inert = false;
      this.wanted?.(this.made);
    }
    return this.made;
  }
}
