// How long what is heard of a robot has waited on its way: in a page that stood still, or on a network that did. Then
// many lines come at once, and none of them is of this moment.
//
// A state carries the robot's clock, and the station tells its own time between the states. Both stand in one stream, so
// what they say of each other is true however late it comes. A simulated robot's clock may go faster or slower. Pure.

/** What waited no longer than this, in ms, has not waited: the station's time stands up to a state beside the robot's. */
const USUAL_MS = 250;

/** @typedef {{ ms: number, at: number }} Both The robot's clock and the station's, in ms. */

export class Pace {
  constructor() {
    /**
     * What both clocks were at first, and when the station told its time last.
     *
     * @type {Both | null}
     */
    this.first = null;
    /** @type {Both | null} */
    this.last = null;
    /**
     * The robot's clock in the state that came last, if it came since then.
     *
     * @type {number | null}
     */
    this.ms = null;
    /** How long what comes now has waited, in ms. */
    this.waited = 0;
  }

  /**
   * The station tells its time.
   *
   * @param {number} at
   */
  station(at) {
    const { first, last, ms } = this;
    const both = ms === null ? null : { ms, at };
    // A clock that was set, or a robot that was not heard, begins anew.
    const goesOn = both && last && both.ms >= last.ms && at >= last.at;
    this.first = goesOn ? first : both;
    this.last = both;
    this.ms = null;
  }

  /**
   * A state has come.
   *
   * @param {number | null} ms the robot's clock in it
   * @param {number} now by the station's clock
   */
  robot(ms, now) {
    const { first, last } = this;
    this.waited = 0;
    this.ms = ms;
    if (ms === null || !first || !last || ms < last.ms || last.ms <= first.ms || last.at <= first.at) return;
    const at = last.at + ((ms - last.ms) * (last.at - first.at)) / (last.ms - first.ms);
    if (now - at > USUAL_MS) this.waited = now - at;
  }
}
