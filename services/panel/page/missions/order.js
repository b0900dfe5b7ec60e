// The order under way as a card: what, where it goes, since when, and how far it has come.

/** @import { Job } from "../station/jobs.js" */
/** @import { Product, Robot } from "../station/robot.js" */
/** @import { Ends, Known } from "./legs.js" */

import { carries } from "../map/goods.js";
import { set } from "../parts/svg.js";
import { minutes, put, say } from "../words/words.js";
import { ends, left } from "./legs.js";

/**
 * The steps of an order, and the time of its job at which each is done; that the goods are carried is none.
 *
 * @type {[string, keyof Ends | "began" | null][]}
 */
const STEPS = [["step_begun", "began"], ["step_arrived", "arrived"], ["step_picked", "picked"], ["step_carried", null], ["delivered", "at"]];
const [ARRIVES, PICKS, CARRIES] = [1, 2, 3];
/** Who sets out within this time of being ordered did not wait, in ms. */
const AT_ONCE_MS = 2_000;

export class Order {
  /** @param {Record<"card" | "number" | "name" | "where" | "time" | "steps", HTMLElement>} parts */
  constructor(parts) {
    this.parts = parts;
    this.steps = STEPS.map(([word, key]) => {
      const [step, label, time] = [document.createElement("li"), document.createElement("span"), document.createElement("span")];
      step.append(label, time);
      return { word, key, step, label, time };
    });
    parts.steps.append(...this.steps.map(({ step }) => step));
  }

  /**
   * @param {Robot | null} robot
   * @param {Product | undefined} goods what the warehouse knows of what is under way
   * @param {Known | null} known null while nothing can be said of what is to come
   * @param {number} now by the station's clock
   */
  draw(robot, goods, known, now) {
    const { card, number, name, where, time } = this.parts;
    const product = robot?.state.product;
    card.toggleAttribute("hidden", product === undefined);
    if (!robot || product === undefined) return;
    const job = jobOf(robot, product);
    // A claw that has closed on nothing says that the goods are gone, too.
    const isCarried = job.picked !== undefined || (carries(robot) === product && robot.state.phase !== "picking");
    put(number, product);
    number.classList.toggle("full", isCarried);
    put(name, goods?.name || say("goods_numbered", product));
    const ms = known && left(job, known, now);
    const to = isCarried || !goods ? say("order_to") : say("order_from", goods.square.join(","));
    put(where, ms === null ? to : `${to}, ≈ ${minutes(ms)}`);
    put(time, job.began === undefined ? "" : minutes(now - job.began));
    this.drawSteps(job, isCarried ? CARRIES : job.arrived !== undefined || robot.state.phase === "picking" ? PICKS : ARRIVES, known, now);
  }

  /**
   * @param {Job} job
   * @param {number} current
   * @param {Known | null} known
   * @param {number} now
   */
  drawSteps(job, current, known, now) {
    const guessed = known && ends(job, known);
    const isAtOnce = job.asked && job.began !== undefined && job.began - job.asked.at < AT_ONCE_MS;
    this.steps.forEach(({ word, key, step, label, time }, index) => {
      set(step, "class", index < current ? "" : index === current ? "is" : "to");
      set(step, "aria-current", index === current ? "step" : "false");
      put(label, say(key === "began" && isAtOnce ? "step_asked" : word));
      put(time, key === null ? (current === CARRIES ? say("now") : "") : key === "began" ? began(job) : since(job, key, guessed, now));
    });
  }
}

/**
 * The robot's job with these goods; one that nobody has told is empty.
 *
 * @param {Robot} robot
 * @param {string} product
 * @returns {Job}
 */
export function jobOf(robot, product) {
  const { now } = robot.jobs;
  return now?.product === product ? now : { product, order: robot.state.order ?? "", detours: [], legs: [] };
}

/** @param {Job} job */
const began = ({ began: at }) => (at === undefined ? "" : new Date(at).toTimeString().slice(0, 8));

/**
 * How long after it set out a step was done, or will be; what takes longer than ever has no time.
 *
 * @param {Job} job
 * @param {keyof Ends} key
 * @param {Ends | null} guessed
 * @param {number} now
 */
function since(job, key, guessed, now) {
  const { began: from, [key]: done } = job;
  if (from === undefined) return "";
  if (done !== undefined) return `+${minutes(done - from)}`;
  const end = guessed?.[key] ?? 0;
  return end > now ? `≈ ${minutes(end - from)}` : "";
}
