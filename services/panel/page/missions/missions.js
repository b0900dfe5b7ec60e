// What is fetched: the order under way, the queue, all goods, what the hands at the goods say, what was delivered.

import { turnOf, wasDelivered } from "../map/goods.js";
import { PLAIN, reason, sentence } from "../words/sentences.js";
import { clock, put, say } from "../words/words.js";
import { crossingsTo, learn, left, waits } from "./legs.js";
import { Order, jobOf } from "./order.js";
import { Past } from "./past.js";
import { Queue } from "./queue.js";
import { ups } from "./reorder.js";
import { Tiles } from "./tiles.js";

/** Whoever orders the same goods again within this time has clicked twice, or holds Enter. */
const TWICE_MS = 700;

export class Missions {
  /** `isArmed` says whether the arrows drive, `isOpen` whether this view is seen; `offers` as on the map. */
  constructor(link, parts, robot, { offers, isArmed, isOpen }) {
    Object.assign(this, { link, parts, robot, isOpen });
    /** Goods of the warehouse, and number and name of each, by their number. */
    this.goods = new Map();
    this.names = new Map();
    this.number = Date.now() % 1_000_000_000;
    /** What was ordered last, of which robot and when; one press is one order. */
    this.ordered = { at: -Infinity };
    /** What was taken out of a robot's queue last: its products, and how many waited behind. */
    this.taken = null;
    /** What past orders teach, and from which. */
    this.learned = {};
    this.order = new Order({ card: parts.order, number: parts.orderNumber, name: parts.orderName, where: parts.orderWhere, time: parts.orderTime, steps: parts.orderSteps });
    this.queue = new Queue(parts.queue, { isArmed, move: (...where) => this.move(...where), cancel: (order) => this.cancel(order) });
    this.tiles = new Tiles({ form: parts.fetch, field: parts.goods, tiles: parts.tiles, said: parts.said }, {
      offers, isOff: () => isArmed() || !isOpen(),
    });
    this.past = new Past(link, { open: parts.pastOpen, box: parts.past, rest: parts.rest, goods: parts.pastGoods, time: parts.pastTime, totals: parts.pastTotals, list: parts.history });
    parts.orderCancel.onclick = () => this.cancel(this.robot()?.state.order);
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
    await this.act(`order ${++this.number} ${product}`, robot, said);
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

  /** Takes an order out, be it under way or waiting. */
  cancel(order) {
    const robot = this.robot();
    if (!robot || order === undefined) return;
    const orders = waiting(robot);
    const at = orders.findIndex((one) => one.order === order);
    // Ordered anew, what was under way comes before all that wait but the first, which is under way by then.
    const behind = at < 0 ? Math.max(0, orders.length - 1) : orders.length - 1 - at;
    const product = at < 0 ? robot.state.product : orders[at].product;
    this.takeBack(`cancel ${order}`, [{ order, product }], behind);
  }

  /** Puts an order before another one, or with null at the end. Where it then stands the robot says. */
  async move(order, before) {
    const robot = this.robot();
    for (const one of ups(waiting(robot).map((one) => one.order), order, before)) {
      if (!(await this.act(`up ${one}`, robot))) return;
    }
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
      const order = ++this.number;
      if (!(await this.act(`order ${order} ${product}`, robot))) return;
      for (let step = 0; step < behind; step++) await this.act(`up ${order}`, robot);
    }
  }

  setWarehouse(warehouse) {
    this.warehouse = warehouse;
    this.learned = {};
    const goods = warehouse?.product ?? [];
    this.goods = new Map(goods.map((one) => [String(one.id), one]));
    this.names = new Map(goods.map(({ id, name = "" }) => [String(id), `${id} ${name}`.trim()]));
    this.tiles.setGoods(goods);
    this.past.setNames(this.names);
  }

  draw(robot, now) {
    // Another robot, or the goods are back: the question is over.
    if (this.asked && (robot !== this.asked.robot || !robot.gone.has(this.asked.product))) this.leave();
    if (!this.isOpen()) return;
    this.past.draw(robot, now);
    this.drawOrders(robot, now);
    this.tiles.draw(robot, !this.link.mayDrive || robot?.isStale(now));
    const { picks, picked, undo } = this.parts;
    this.plain.forEach((button, at) => {
      put(button, sentence(`do_${PLAIN[at]}`));
      button.disabled = !this.link.mayDrive;
    });
    undo.hidden = !this.taken || this.taken.robot !== robot;
    const pick = robot?.isStale(now) ? undefined : robot?.state.pick;
    picks.checked = robot?.state.pick === "auto";
    picks.disabled = pick === undefined || !this.link.mayDrive;
    picked.parentElement.hidden = !(robot?.state.phase === "picking" && (pick === "manual" || robot.state.remedy !== undefined));
  }

  drawOrders(robot, now) {
    const { head, clear } = this.parts;
    const orders = waiting(robot);
    const { product, mode, stopped } = robot?.state ?? {};
    const [known, time] = [robot && this.known(robot.jobs.done), this.link.now()];
    const isGoing = robot && !robot.isStale(now) && mode === "autonomous" && stopped !== "1";
    this.order.draw(robot, product, this.goods.get(product) ?? {}, isGoing ? known : null, time);
    const first = !isGoing ? null : product === undefined ? 0 : left(jobOf(robot, product), known, time);
    const isAway = product !== undefined || robot?.state.phase === "returning";
    const ms = isGoing ? waits(first, orders.map(({ product }) => product), known, isAway) : [];
    const rows = orders.map(({ order, product }, at) => ({
      order, product, ms: ms[at] ?? null,
      name: this.goods.get(product)?.name || say("goods_numbered", product),
      who: robot.jobs.asked.get(order)?.who,
      putOff: robot.jobs.putOff.get(product),
    }));
    this.queue.draw(rows, this.link.me, this.link.mayDrive);
    put(head, orders.length ? say("queue_head", orders.length, this.goods.size) : say("queue_empty"));
    clear.disabled = !orders.length || !this.link.mayDrive;
    this.parts.orderCancel.hidden = robot?.state.order === undefined || !this.link.mayDrive;
    const label = say("cancel_order", product ?? "");
    if (this.parts.orderCancel.title !== label) Object.assign(this.parts.orderCancel, { title: label, ariaLabel: label });
  }

  /** What past orders teach; it is learned anew when another one is delivered. */
  known(done) {
    const { done: before, count, after } = this.learned;
    const last = done[0]?.next ?? done[0]?.back;
    if (before !== done || count !== done.length || after !== last) {
      this.learned = { done, count: done.length, after: last, known: learn(done, (product) => crossingsTo(this.warehouse, product)) };
    }
    return this.learned.known;
  }
}

/** The orders that wait; the one under way may be listed with them. */
function waiting(robot) {
  return (robot?.queue ?? []).filter(({ order }) => order !== robot.state.order);
}
