// Which time the lanes show: the last while, or a held one. It draws nothing, and reads no clock.

import { KEPT_MS } from "./figures.js";

/** The whiles to choose from, in ms. */
export const WINDOWS_MS = [30_000, 60_000, 120_000, KEPT_MS];
/** The shortest time that is shown, in ms: ten states of the robot. */
const LEAST_MS = 500;

/** @typedef {{ from: number, to: number }} Range In ms by the station's clock. */

export class Span {
  constructor() {
    this.ms = 60_000;
    /**
     * The held time; null: the last while is shown, and moves on.
     *
     * @type {Range | null}
     */
    this.held = null;
    /**
     * What was shown before each step into it.
     *
     * @type {Range[]}
     */
    this.older = [];
  }

  /**
   * @param {number} now
   * @returns {Range}
   */
  range(now) {
    return this.held ?? { from: now - this.ms, to: now };
  }

  /**
   * Holds what is shown, or goes on with the last while.
   *
   * @param {number} now
   */
  pause(now) {
    this.held = this.held ? null : this.range(now);
    this.older = [];
  }

  /**
   * Shows the last while of this length, or one that ends where the held one does.
   *
   * @param {number} ms
   */
  choose(ms) {
    this.ms = ms;
    this.older = [];
    if (this.held) this.held = { from: this.held.to - ms, to: this.held.to };
  }

  /**
   * Shows only a part of what is shown.
   *
   * @param {number} now
   * @param {Range} part
   */
  zoom(now, { from, to }) {
    if (to - from < LEAST_MS) return;
    this.older.push(this.range(now));
    this.held = { from, to };
  }

  /**
   * Shows a time that is so many times as long, round a moment.
   *
   * @param {number} now
   * @param {number} times
   * @param {number | null} round
   */
  grow(now, times, round) {
    const { from, to } = this.range(now);
    const ms = Math.min(KEPT_MS, (to - from) * times);
    const middle = round ?? (from + to) / 2;
    const share = (middle - from) / (to - from);
    // Nothing is known of what comes later than now.
    const end = Math.min(now, middle + (1 - share) * ms);
    this.zoom(now, { from: end - ms, to: end });
  }

  /** Shows what was shown before the last step into it. */
  back() {
    this.held = this.older.pop() ?? this.held;
  }
}
