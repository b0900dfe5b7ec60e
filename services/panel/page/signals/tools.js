// The buttons above the lanes: they hold the picture, and choose the time that it shows.

import { add } from "./add.js";
import { WINDOWS_MS } from "./span.js";
import { put, say, span } from "../words/words.js";

/**
 * A time as short as it is clear.
 *
 * @param {number} ms
 */
function brief(ms) {
  return ms < 60_000 ? `${Math.round(ms / 1_000)} s` : span(ms);
}

/**
 * @param {HTMLElement} parent
 * @param {() => void} act
 * @param {Partial<HTMLButtonElement>} properties
 * @param {Record<string, string>} data
 */
function button(parent, act, properties, data = {}) {
  const element = add(parent, "button", { type: "button", onclick: act, ...properties });
  Object.assign(element.dataset, data);
  return element;
}

export class Tools {
  /**
   * @param {HTMLElement} place
   * @param {{ pause: () => void, choose: (ms: number) => void, grow: (times: number) => void, back: () => void }} acts
   */
  constructor(place, { pause, choose, grow, back }) {
    add(place, "h2").dataset.word = "signals";
    this.tag = add(place, "span", { className: "tag", hidden: true });
    const held = button(place, pause, { id: "pause" });
    this.pause = add(held, "span");
    add(held, "kbd", { textContent: "P" });
    const windows = add(place, "div", { className: "choice", role: "group" });
    windows.dataset.label = "time_window";
    this.windows = WINDOWS_MS.map((ms) => ({ ms, element: button(windows, () => choose(ms), { textContent: brief(ms) }, { ms: `${ms}` }) }));
    button(place, () => grow(0.5), { textContent: "+" }, { title: "zoom_in" });
    button(place, () => grow(2), { textContent: "\u2212" }, { title: "zoom_out" });
    this.back = button(place, back, { id: "zoom-back" }, { word: "zoom_back" });
  }

  /**
   * @param {import("./span.js").Span} shown
   * @param {number} now by the station's clock
   */
  draw({ held, ms, older }, now) {
    this.tag.toggleAttribute("hidden", !held);
    if (held) put(this.tag, say("paused", brief(Math.max(0, now - held.to))));
    put(this.pause, say(held ? "go_live" : "pause"));
    for (const window of this.windows) window.element.ariaPressed = String(window.ms === ms);
    this.back.toggleAttribute("disabled", !older.length);
  }
}
