// The order under way as a card: what, where it goes, since when, and how far it has come.

import { carries } from "../map/goods.js";
import { minutes, put, say } from "../words/words.js";
import { ends, left } from "./legs.js";

/** The steps of an order, and the time of its job at which each is done. */
const STEPS = [["step_begun", "began"], ["step_arrived", "arrived"], ["step_picked", "picked"], ["step_carried", null], ["delivered", "at"]];
const [ARRIVES, PICKS, CARRIES] = [1, 2, 3];
/** Who sets out within this time of being ordered did not wait, in ms. */
const AT_ONCE_MS = 2_000;

export class Order {
  /** `parts` are the card and what stands in it. */
  constructor(parts) {
    this.parts = parts;
    this.steps = STEPS.map(() => {
      const step = document.createElement("li");
      step.append(document.createElement("span"), document.createElement("span"));
      return step;
    });
    parts.steps.append(...this.steps);
  }

  /**
   * @param {string | undefined} product what is under way
   * @param {{ name?: string, square?: number[] }} goods what the warehouse knows of it
   * @param {import("./legs.js").Known | null} known null while nothing can be said of what is to come
   */
  draw(robot, product, goods, known, now) {
    const { card, number, name, where, time } = this.parts;
    card.hidden = product === undefined;
    if (card.hidden) return;
    const job = jobOf(robot, product);
    // A claw that has closed on nothing says that the goods are gone, too.
    const isCarried = job.picked !== undefined || (carries(robot) === product && robot.state.phase !== "picking");
    put(number, product);
    number.classList.toggle("full", isCarried);
    put(name, goods.name || say("goods_numbered", product));
    const ms = known && left(job, known, now);
    const to = isCarried || !goods.square ? say("order_to") : say("order_from", goods.square.join(","));
    put(where, ms === null ? to : `${to}, ≈ ${minutes(ms)}`);
    put(time, job.began === undefined ? "" : minutes(now - job.began));
    this.drawSteps(job, isCarried ? CARRIES : job.arrived !== undefined || robot.state.phase === "picking" ? PICKS : ARRIVES, known, now);
  }

  drawSteps(job, current, known, now) {
    const guessed = known ? ends(job, known) : {};
    const isAtOnce = job.asked && job.began - job.asked.at < AT_ONCE_MS;
    this.steps.forEach((step, index) => {
      const [word, key] = STEPS[index];
      step.className = index < current ? "" : index === current ? "is" : "to";
      if (index === current) step.setAttribute("aria-current", "step");
      else step.removeAttribute("aria-current");
      const [label, time] = step.children;
      put(label, say(index === 0 && isAtOnce ? "step_asked" : word));
      put(time, index === 0 ? began(job) : index === CARRIES ? (current === CARRIES ? say("now") : "") : since(job, key, guessed, now));
    });
  }
}

/** The robot's job with these goods; one that nobody has told is empty. */
export function jobOf(robot, product) {
  const { now } = robot.jobs;
  return now?.product === product ? now : { product, order: robot.state.order ?? "", detours: [], legs: [] };
}

const began = ({ began: at }) => (at === undefined ? "" : new Date(at).toTimeString().slice(0, 8));

/** How long after it set out a step was done, or will be; what takes longer than ever has no time. */
function since({ began: from, ...job }, key, guessed, now) {
  if (from === undefined) return "";
  if (job[key] !== undefined) return `+${minutes(job[key] - from)}`;
  return guessed[key] > now ? `≈ ${minutes(guessed[key] - from)}` : "";
}
