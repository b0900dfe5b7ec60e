// What is known of one robot. Views draw this, and change none of it.

import { Jobs } from "./jobs.js";
import { Pace } from "./pace.js";
import { Frames } from "./quantile.js";

/** @typedef {"left" | "up" | "right" | "down"} Side */
/** @typedef {{ x: number, y: number, heading: number }} Pose In mm with y upwards, and degrees to the right from up. */
/** @typedef {{ id: number, name?: string, square: [number, number], side: Side }} Product */
/**
 * What the station's file of the floor says.
 *
 * @typedef {object} Warehouse
 * @property {[number, number]} size
 * @property {number} side_length_cm
 * @property {[number, number]} delivery
 * @property {Product[]} [product]
 * @property {{ curve?: "straight" | "left" | "right" | "s", length_cm?: number, radius_cm?: number }} [exit]
 * @property {unknown} [floor] how bright it is
 * @property {unknown} [obstacle] what stands on ways
 */
/**
 * The fields of a robot's state, in its own words; what is not known is left out (bus/lines/src/extension/state.rs).
 *
 * @typedef {Partial<Record<
 *   "time_ms" | "x_mm" | "y_mm" | "heading_deg" | "unsure_mm" | "node" | "looks" | "next" | "phase" | "hold" | "failure"
 *   | "failure_expected" | "failure_seen" | "remedy" | "mode" | "pick" | "stopped" | "stop_cause" | "stop_by" | "stop"
 *   | "stop_age_ms" | "stood_ms" | "order" | "product" | "delivered" | "line_bits" | "line_error" | "distance_cm"
 *   | "left_duty" | "right_duty" | "code" | "servos" | "loads" | "servo_errors" | "battery_dv" | "battery_percent"
 *   | "battery_left_s" | "sensor_up" | "steering_up"
 *   | "sensor_lost" | "steering_lost" | "bus_lost" | "gain_p" | "gain_d", string>>} State
 */
/** @typedef {Partial<Record<string, string>>} Fields What stands in a line as `key=value`. */
/**
 * Something that has happened, in the words of its line, and when by this page's clock in ms since 1970.
 *
 * @typedef {{ at: number, kind: "event" | "thought" | "asked" | "refused", words: string[], values: Fields | null }} Entry
 */
/** @typedef {{ order: string, product: string }} Order */
/** @typedef {{ reading: number, lowest: number, highest: number, both: boolean }} Sensor */
/**
 * One moment of the last minute.
 *
 * @typedef {{ at: number } & Record<"x" | "y" | "line_error" | "left_duty" | "right_duty" | "distance_cm" | "battery"
 *   | "path_p50" | "path_p99" | "lost", number | null>} Moment
 */

/** Older than this, in ms, nothing is shown as true. */
const STALE_MS = 500;
/** How long trail and strips look back, in ms. */
export const SPAN_MS = 60_000;

/** What the model keeps of it: a minute at twenty a second, and what has happened. */
const MOMENTS = 1_400;
const ENTRIES = 1_000;
/** How fast it is at most for each unit of duty, in mm/s: 73 at a duty of 104 is usual, with room above. */
const MM_PER_DUTY = 1;
/**
 * What of a state changes all the time, while the robot stands, too.
 *
 * @type {Set<string>}
 */
const FIGURES = new Set(["time_ms", "unsure_mm", "stop_age_ms", "line_bits", "line_error", "distance_cm", "loads", "battery_dv", "battery_percent", "battery_left_s"]);
/** It is not taken to drive on for longer than this, in s. */
const DRIVES_ON_S = 60;

/**
 * Whether a state says more than other figures than the one before.
 *
 * @param {Fields} state
 * @param {Fields} before
 */
const turned = (state, before) => Object.keys({ ...state, ...before }).some((key) => !FIGURES.has(key) && state[key] !== before[key]);

export class Robot {
  /** @param {string} name */
  constructor(name) {
    this.name = name;
    this.connected = false;
    this.speaks = false;
    /** Which warehouse it uses, in the station's word, and whether it can be put into the saved one. */
    this.uses = "-";
    this.renews = false;
    /** @type {string | null} */
    this.driver = null;
    /**
     * Who asks the driver for the wheel.
     *
     * @type {string | null}
     */
    this.asks = null;
    /** When the station last heard it, by this page's clock. */
    this.heard = -Infinity;
    /** What the station says about it. */
    this.told = "";
    /** How many of its states have said more than other figures. */
    this.turns = 0;
    /** @type {State} */
    this.state = {};
    /** When its state last came, by this page's clock. */
    this.stated = -Infinity;
    /** @type {(Pose & { carrying: string | undefined }) | null} */
    this.truth = null;
    /** @type {{ p50: number, p99: number } | null} */
    this.latency = null;
    /** How long frames have taken since the page was opened. */
    this.frames = new Frames();
    /**
     * What each line sensor has read in the last calibration, the leftmost first.
     *
     * @type {Sensor[] | null}
     */
    this.sensors = null;
    /**
     * How its machine, services and boards are (bus/lines/src/extension/health.rs).
     *
     * @type {Fields | null}
     */
    this.health = null;
    /** When it told that, by this page's clock. */
    this.healthAt = -Infinity;
    /**
     * How far its commissioning is, what that has found out, and the lines of the descriptions that were saved, in words
     * (bus/lines/src/extension/commission.rs).
     *
     * @type {Fields}
     */
    this.commission = {};
    /** @type {string[]} */
    this.found = [];
    /** @type {string[][]} */
    this.kept = [];
    /** @type {[number, number][]} */
    this.route = [];
    /**
     * The products whose goods are not in their place: delivered, in the claw, or somewhere else.
     *
     * @type {Set<string>}
     */
    this.gone = new Set();
    /**
     * The ways on which something was put in a simulated world, as `x y side`.
     *
     * @type {string[]}
     */
    this.placed = [];
    /**
     * Where it was when that was known last.
     *
     * @type {(Pose & { unsure: number }) | null}
     */
    this.pose = null;
    /** How far it may have come since, in mm. */
    this.strayed = 0;
    /**
     * Ways that are not taken, and since when, in s of the robot's clock.
     *
     * @type {Map<string, number>}
     */
    this.blocked = new Map();
    /** @type {Order[]} */
    this.queue = [];
    /** @type {Moment[]} */
    this.past = [];
    /** States heard in all. */
    this.total = 0;
    /**
     * In ms since 1970.
     *
     * @type {number | null}
     */
    this.stoppedSince = null;
    /** @type {Entry[]} */
    this.events = [];
    /**
     * The values of the thought that comes next.
     *
     * @type {Fields | null}
     */
    this.thinks = null;
    this.jobs = new Jobs();
    this.pace = new Pace();
  }

  /** Nothing has happened yet. */
  forget() {
    this.pace = new Pace();
    this.events = [];
    this.thinks = null;
    this.jobs = new Jobs();
  }

  /**
   * Keeps an event, a thought, a refusal or what was asked, by when it was: some are told later.
   *
   * @param {Entry} entry
   */
  happened(entry) {
    this.jobs.take(entry);
    const after = this.events.findLastIndex(({ at }) => at <= entry.at);
    this.events.splice(after + 1, 0, entry);
    if (this.events.length > ENTRIES) this.events.shift();
  }

  /**
   * Takes over how it is.
   *
   * @param {Fields} health
   * @param {number} now when it came, by this page's clock
   */
  tellsHealth(health, now) {
    this.health = health;
    this.healthAt = now;
  }

  /**
   * Takes over a state.
   *
   * @param {State} state
   * @param {number} now when it came, by this page's clock
   * @param {number} at the same in ms since 1970
   */
  become(state, now, at) {
    const { pace } = this;
    pace.robot(state.time_ms === undefined ? null : Number(state.time_ms), at);
    this.stoppedSince = state.stop_age_ms === undefined ? null : at - pace.waited - Number(state.stop_age_ms);
    this.stray(state, now);
    if (turned(state, this.state)) this.turns += 1;
    this.state = state;
    this.stated = now;
    this.remember(now - pace.waited);
  }

  /**
   * Keeps where it was, and how far its wheels may have taken it since nobody knows.
   *
   * @param {State} state
   * @param {number} now
   */
  stray(state, now) {
    const { x_mm: x, y_mm: y, heading_deg: heading = 0, unsure_mm: unsure = 0 } = state;
    if (x !== undefined) {
      this.pose = { x: Number(x), y: Number(y), heading: Number(heading), unsure: Number(unsure) };
      this.strayed = 0;
    } else if (this.pose) {
      this.strayed += this.mayHaveDriven(now, state);
    }
  }

  /**
   * How far it may have driven since its state last came, in mm, at the duties of that state or of another one.
   *
   * @param {number} now
   * @param {State} [state]
   * @returns {number}
   */
  mayHaveDriven(now, { left_duty: left = "0", right_duty: right = "0" } = this.state) {
    const seconds = Math.max(0, now - this.stated) / 1_000;
    return Math.max(Number(left), Number(right)) * MM_PER_DUTY * Math.min(seconds, DRIVES_ON_S);
  }

  /**
   * Keeps what the strips and the trail show.
   *
   * @param {number} at when it was so, by this page's clock
   */
  remember(at) {
    this.total += 1;
    const { state, latency } = this;
    /** @param {keyof State} key */
    const figure = (key) => (state[key] === undefined ? null : Number(state[key]));
    const decivolts = figure("battery_dv");
    this.past.push({
      at,
      x: figure("x_mm"),
      y: figure("y_mm"),
      line_error: figure("line_error"),
      left_duty: figure("left_duty"),
      right_duty: figure("right_duty"),
      distance_cm: figure("distance_cm"),
      battery: decivolts === null ? null : decivolts / 10,
      path_p50: latency?.p50 ?? null,
      path_p99: latency?.p99 ?? null,
      lost: (figure("sensor_lost") ?? 0) + (figure("steering_lost") ?? 0) + (figure("bus_lost") ?? 0),
    });
    if (this.past.length > MOMENTS) this.past.splice(0, 200);
  }

  /**
   * Milliseconds since the robot was last heard.
   *
   * @param {number} now
   */
  age(now) {
    return now - this.heard;
  }

  /** @param {number} now */
  isStale(now) {
    return !this.connected || now - this.heard > STALE_MS || now - this.stated > STALE_MS;
  }
}
