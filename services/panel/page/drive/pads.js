// What the gamepads say, and whether they may be believed: an entry that is dead, or that never was at
// rest, drives nothing.
//
// A pad whose radio drops may leave its entry behind with the stick as it was, and comes back as a
// second one; a pad may appear with a stick at its end. So
//
// - an entry counts once it was seen at rest, at least `COME_MS` after it came and `LOOK_MS` after the box was
//   ticked;
// - of several entries of one pad only the one that came last counts;
// - one that has told nothing new while another one did since is not believed until it rests again.

/** So long an entry that has come is only looked at: its first reading may be none. */
const COME_MS = 150;
/** So long all are once the box is ticked: a browser tells of what is held some time after it is asked first. */
const LOOK_MS = 500;
/** An entry whose news is so much older than another one's is dead, in ms of the browser's clock. */
const FROZEN_MS = 300;
/** How far a stick is bent that says something. */
const BENT = 0.5;

/** The buttons at the left and at the right shoulder: slower and faster. */
const [SLOWER, FASTER] = [4, 5];

/** @typedef {{ id: string, came: number, since: number, rested: boolean, shoulder: number }} Known What is known of an entry. */
/** @typedef {{ pad: Gamepad, index: number }} There An entry and its place in the browser's list. */


/**
 * Codes of the wheels, each with the button of the cross, and the axis and its way, that say it; the first that is
 * pressed counts.
 *
 * @type {[number, number, number, number][]}
 */
const CODES = [
  [2, 12, 1, -1],
  [4, 13, 1, 1],
  [6, 14, 0, -1],
  [7, 15, 0, 1],
];

/**
 * The code of the wheels that an entry says, or null.
 *
 * @param {Pick<Gamepad, "axes" | "buttons">} pad
 */
function code({ axes, buttons }) {
  const found = CODES.find(([, button, axis, way]) => (axes[axis] ?? 0) * way > BENT || buttons[button]?.pressed);
  return found?.[0] ?? null;
}

/**
 * The way in which an entry's shoulder buttons turn the speed.
 *
 * @param {Pick<Gamepad, "buttons">} pad
 */
function shoulder({ buttons }) {
  return Number(buttons[FASTER]?.pressed ?? false) - Number(buttons[SLOWER]?.pressed ?? false);
}

export class Pads {
  /** @param {() => number} now */
  constructor(now) {
    this.now = now;
    /**
     * By its place in the browser's list: its pad, when it came, and whether it was seen at rest.
     *
     * @type {Map<number, Known>}
     */
    this.known = new Map();
    this.came = 0;
    /**
     * The axes of the entry that counts, or of one that does not yet; null without a gamepad.
     *
     * @type {readonly number[] | null}
     */
    this.axes = null;
    this.since = now();
    /**
     * The entry that says something, by its place.
     *
     * @type {number | null}
     */
    this.speaks = null;
    /** The way in which the speed was turned at the last reading: 1, -1 or 0. A press counts once. */
    this.turned = 0;
    this.listens = false;
  }

  /** Hears of pads that come and go. A browser that somebody listens to looks for them all the time. */
  listen() {
    if (this.listens) return;
    this.listens = true;
    addEventListener("gamepadconnected", ({ gamepad }) => this.known.delete(gamepad?.index));
    addEventListener("gamepaddisconnected", ({ gamepad }) => this.known.delete(gamepad?.index));
  }

  /** Each entry is new again. */
  forget() {
    this.known.clear();
    this.came = 0;
    this.since = this.now();
    this.speaks = null;
    this.axes = null;
  }

  /**
   * The code of the wheels that is held on a pad, or null.
   *
   * @returns {number | null}
   */
  read() {
    this.listen();
    const all = [...(navigator.getGamepads?.() ?? [])];
    const there = all.flatMap((pad, index) => (pad?.mapping === "standard" && pad.connected !== false ? [{ pad, index }] : []));
    for (const index of this.known.keys()) {
      if (!there.some((one) => one.index === index)) this.known.delete(index);
    }
    for (const { pad, index } of there) this.meet(pad, index);
    const newest = Math.max(...there.map(({ pad }) => pad.timestamp ?? 0));
    const counts = there.filter(({ pad, index }) => this.isBelieved(pad, index, newest, there));
    this.turned = 0;
    for (const { pad, index } of there) {
      const known = this.known.get(index);
      const way = shoulder(pad);
      if (!known || known.shoulder === way) continue;
      known.shoulder = way;
      if (counts.some((one) => one.index === index)) this.turned = way;
    }
    // Who speaks goes on speaking; another pad does not talk into it.
    const speaker = counts.find(({ index }) => index === this.speaks) ?? counts.find(({ pad }) => code(pad));
    this.axes = (speaker ?? counts[0] ?? there[0])?.pad.axes ?? null;
    const said = speaker ? code(speaker.pad) : null;
    this.speaks = said === null ? null : speaker?.index ?? null;
    return said;
  }

  /**
   * Learns of an entry, and whether it rests.
   *
   * @param {Gamepad} pad
   * @param {number} index
   */
  meet(pad, index) {
    let known = this.known.get(index);
    if (!known || known.id !== pad.id) {
      known = { id: pad.id, came: ++this.came, since: this.now(), rested: false, shoulder: shoulder(pad) };
      this.known.set(index, known);
    }
    const isLookedAt = this.now() - known.since > COME_MS && this.now() - this.since > LOOK_MS;
    if (code(pad) === null && isLookedAt) known.rested = true;
  }

  /**
   * Whether what an entry says counts; `newest` is when the last news of all came.
   *
   * @param {Gamepad} pad
   * @param {number} index
   * @param {number} newest
   * @param {There[]} there
   */
  isBelieved(pad, index, newest, there) {
    const known = this.known.get(index);
    if (!known) return false;
    const isReplaced = there.some((one) => {
      const other = this.known.get(one.index);
      return other && other.id === known.id && other.came > known.came;
    });
    const isFrozen = code(pad) !== null && newest - (pad.timestamp ?? newest) > FROZEN_MS;
    if (isReplaced || isFrozen) known.rested = false;
    return known.rested;
  }
}
