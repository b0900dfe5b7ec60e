// What is fetched: the queue, what the hands at the goods say, what has been delivered.

import { turnOf, wasDelivered } from "../map/goods.js";
import { PLAIN, crossing, reason, sentence } from "../words/sentences.js";
import { clock, put, say, span } from "../words/words.js";

/** Whoever orders the same goods again within this time has clicked twice, or holds Enter. */
const TWICE_MS = 700;

export class Missions {
  constructor(link, parts, robot) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.shown = null;
    /** Number and name of goods, by number. */
    this.names = new Map();
    this.order = Date.now() % 1_000_000_000;
    /** What was ordered last, of which robot and when; one press is one order. */
    this.ordered = { at: -Infinity };
    /** What was taken out of a robot's queue last: its products, and how many waited behind. */
    this.taken = null;
    parts.fetch.addEventListener("submit", (event) => {
      event.preventDefault();
      if (!parts.goods.value) return put(parts.said, say("no_map"));
      this.fetch(parts.goods.value);
    });
    // It shows what the robot says, not what was wished.
    parts.picks.onclick = (event) => {
      event.preventDefault();
      const wish = this.robot()?.state.pick === "auto" ? "manual" : "auto";
      this.act(`pick ${wish}`);
    };
    parts.picked.onclick = () => this.act("picked");
    parts.pickedForce.onclick = () => this.act("picked force");
    /** The goods that a person is asked about: they were not in their place. */
    this.asked = null;
    parts.backYes.onclick = () => this.back();
    parts.backNo.onclick = () => this.leave();
    parts.clear.onclick = () => this.takeBack("clear", waiting(this.robot()));
    parts.undo.onclick = () => this.undo();
    this.plain = PLAIN.map((action) => {
      const button = Object.assign(document.createElement("button"), { type: "button", id: `do-${action}` });
      button.onclick = () => this.act(action);
      return button;
    });
    parts.plain.append(...this.plain);
  }

  /** Has a robot do something; `said` is where it says why not. */
  async act(action, robot = this.robot(), said = this.parts.said) {
    if (!robot) return put(said, say("no_robot"));
    const answer = await this.link.act(robot, action);
    put(said, answer.refused ? reason(answer.refused) : "");
    return !answer.refused;
  }

  /** Orders goods from the form, or from what stands `beside` it, which says in `said` why not. */
  async fetch(product, { beside = this.parts.fetch, said = this.parts.said } = {}) {
    const [robot, at] = [this.robot(), performance.now()];
    // What was delivered is not fetched again before a person has put it back.
    if (robot?.gone.has(product) && turnOf(robot, product) < 0) return this.ask({ robot, product, beside, said });
    const { ordered } = this;
    const isTwice = ordered.robot === robot && ordered.product === product && (ordered.waits || at - ordered.at < TWICE_MS);
    if (isTwice) {
      ordered.at = at;
      return;
    }
    const order = { robot, product, at, waits: true };
    this.ordered = order;
    await this.act(`order ${++this.order} ${product}`, robot, said);
    order.waits = false;
  }

  /** Asks where the hand was whether goods are in their place again. */
  ask(asked) {
    const { robot, product, beside } = asked;
    const { back, backSaid, backNo } = this.parts;
    const delivery = wasDelivered(robot, product);
    const name = this.names.get(product) ?? product;
    this.asked = asked;
    beside.after(back);
    put(backSaid, delivery ? say("back_delivered", name, clock(delivery.at)) : say("back_away", name));
    back.hidden = false;
    backNo.focus();
  }

  leave() {
    this.asked = null;
    this.parts.back.hidden = true;
  }

  /** They are back: the robot is told so, and fetches them. */
  async back() {
    const { robot, product, beside, said } = this.asked;
    this.leave();
    if (!(await this.act(`back ${product}`, robot, said))) return;
    // The station tells the robot's answer before it tells that the goods are back.
    robot.gone.delete(product);
    await this.fetch(product, { beside, said });
  }

  /** Takes orders out of the queue; `gone` are those, `behind` those that wait behind them. */
  async takeBack(action, gone, behind = 0) {
    const robot = this.robot();
    if (!(await this.act(action)) || !gone.length) return;
    this.taken = { robot, products: gone.map(({ product }) => product), behind };
  }

  /** Orders anew what was taken out, and moves it to where it was. */
  async undo() {
    const { robot, products, behind } = this.taken;
    this.taken = null;
    for (const product of products) {
      const order = ++this.order;
      if (!(await this.act(`order ${order} ${product}`, robot))) return;
      for (let step = 0; step < behind; step++) await this.act(`up ${order}`, robot);
    }
  }

  setWarehouse(warehouse) {
    const { goods } = this.parts;
    this.names = new Map((warehouse?.product ?? []).map(({ id, name = "" }) => [String(id), `${id} ${name}`.trim()]));
    goods.replaceChildren(...(warehouse?.product ?? []).map(({ id, name }) => new Option(name ? `${id} ${name}` : id, id)));
  }

  draw(robot, now) {
    // Another robot, or the goods are back: the question is over.
    if (this.asked && (robot !== this.asked.robot || !robot.gone.has(this.asked.product))) this.leave();
    this.drawQueue(robot);
    const { picks, undo } = this.parts;
    this.plain.forEach((button, at) => {
      put(button, sentence(`do_${PLAIN[at]}`));
      button.disabled = !this.link.mayDrive;
    });
    undo.hidden = !this.taken || this.taken.robot !== robot;
    const pick = robot?.isStale(now) ? undefined : robot?.state.pick;
    picks.checked = robot?.state.pick === "auto";
    picks.disabled = pick === undefined || !this.link.mayDrive;
    const lines = (robot?.history ?? []).map((one) => delivered(one, this.names));
    if (!lines.length) lines.push(say("history_empty"));
    fill(this.parts.history, lines, (line) => item(line));
  }

  drawQueue(robot) {
    const { queue } = this.parts;
    const { product: current, order: number } = robot?.state ?? {};
    const orders = waiting(robot);
    const shown = JSON.stringify([robot?.name, current, number, orders, [...this.names], document.documentElement.lang]);
    if (this.shown === shown) return;
    this.shown = shown;
    queue.replaceChildren();
    const cancel = (order, product, behind) =>
      button(say("cancel"), say("cancel_order", product), () => this.takeBack(`cancel ${order}`, [{ order, product }], behind));
    if (current !== undefined) {
      const line = item(`${this.names.get(current) ?? current}  ${say("under_way")}`);
      // Ordered anew it comes before all that wait but the first, which is under way by then.
      if (number !== undefined) line.append(cancel(number, current, Math.max(0, orders.length - 1)));
      queue.append(line);
    }
    orders.forEach(({ order, product }, index) => {
      const line = item(this.names.get(product) ?? product);
      line.className = "waiting";
      const after = orders[index + 1];
      const [up, down] = [
        button("\u2191", say("move_up", product), () => this.act(`up ${order}`)),
        button("\u2193", say("move_down", product), () => this.act(`up ${after.order}`)),
      ];
      [up.disabled, down.disabled] = [index === 0, !after];
      line.append(up, down, cancel(order, product, orders.length - 1 - index));
      queue.append(line);
    });
    if (!queue.children.length) queue.append(item(say("queue_empty")));
  }
}

/** The orders that wait; the one under way may be listed with them. */
function waiting(robot) {
  return (robot?.queue ?? []).filter(({ order }) => order !== robot.state.order);
}

/** One delivery as a line: when, what, how long it took, and which ways were blocked on it. */
function delivered({ product, at, took, detours }, names) {
  const name = names.get(product) ?? product;
  const words = [clock(at), took ? say("took", name, span(took)) : name];
  const ways = detours.map(({ node, looks }) => `${crossing(node)} ${sentence(`looks_${looks}`) ?? ""}`.trim());
  if (ways.length) words.push(say("detours", ways.join("; ")));
  return words.join("  ");
}

/** An item of a list. */
export function item(text) {
  const element = document.createElement("li");
  element.append(text);
  return element;
}

/** Fills a list, if it has changed. */
export function fill(list, lines, make) {
  const shown = lines.join("\n");
  if (list.dataset.shown === shown) return;
  list.dataset.shown = shown;
  list.replaceChildren(...lines.map(make));
}

function button(text, label, act) {
  const element = document.createElement("button");
  element.type = "button";
  element.textContent = text;
  element.title = label;
  element.setAttribute("aria-label", label);
  element.onclick = act;
  return element;
}
