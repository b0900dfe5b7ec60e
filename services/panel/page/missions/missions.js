// What is fetched: the order under way, the queue, all goods, what the hands at the goods say, what was delivered.

/** @import { Hand, Offer, Tile } from "../map/offers.js" */
/** @import { Delivered } from "../station/jobs.js" */
/** @import { Link } from "../station/link.js" */
/** @import { Order as Waiting, Product, Robot, Warehouse } from "../station/robot.js" */
/** @import { Known } from "./legs.js" */

import { turnOf, wasDelivered } from "../map/goods.js";
import { titleOf } from "../parts/parcel.js";
import { plain, reason, sentence } from "../words/sentences.js";
import { clock, put, say } from "../words/words.js";
import { crossingsTo, learn, left, waits } from "./legs.js";
import { Order, jobOf } from "./order.js";
import { Past } from "./past.js";
import { Queue } from "./queue.js";
import { ups } from "./reorder.js";
import { Tiles } from "./tiles.js";

/** Whoever orders the same goods again within this time has clicked twice, or holds Enter. */
const TWICE_MS = 700;

/**
 * What stands in the view.
 *
 * @typedef {{ fetch: HTMLFormElement } & Record<"goods" | "picks", HTMLInputElement> & Record<"pastGoods" | "pastTime", HTMLSelectElement>
 *   & Record<"picked" | "pickedForce" | "backYes" | "backNo" | "clear" | "undo" | "orderCancel", HTMLButtonElement>
 *   & Record<"tiles" | "plain" | "back" | "backSaid" | "said" | "head" | "queue" | "rest" | "order" | "orderNumber" | "orderName" | "orderWhere"
 *     | "orderTime" | "orderSteps" | "past" | "pastOpen" | "pastTotals" | "history", HTMLElement>} Parts
 */

export class Missions {
  /**
   * @param {Link} link
   * @param {Parts} parts
   * @param {() => Robot | null} robot
   * @param {object} page
   * @param {(tile: Tile) => Offer} page.offers as on the map
   * @param {() => boolean} page.isArmed whether the arrows drive
   * @param {() => boolean} page.isOpen whether this view is seen
   */
  constructor(link, parts, robot, { offers, isArmed, isOpen }) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.isOpen = isOpen;
    /** @type {Warehouse | null} */
    this.warehouse = null;
    /**
     * Goods of the warehouse by their number.
     *
     * @type {Map<string, Product>}
     */
    this.goods = new Map();
    /**
     * Number and name of each.
     *
     * @type {Map<string, string>}
     */
    this.names = new Map();
    this.number = Date.now() % 1_000_000_000;
    /**
     * What was ordered last, of which robot and when; one press is one order.
     *
     * @type {{ robot: Robot | null, product: string, at: number, waits: boolean } | null}
     */
    this.ordered = null;
    /**
     * What was taken out of a robot's queue last: its products, and how many waited behind.
     *
     * @type {{ robot: Robot, products: string[], behind: number } | null}
     */
    this.taken = null;
    /**
     * What past orders teach, and from which.
     *
     * @type {{ done: Delivered[], count: number, after: number | undefined, known: Known } | null}
     */
    this.learned = null;
    this.order = new Order({ card: parts.order, number: parts.orderNumber, name: parts.orderName, where: parts.orderWhere, time: parts.orderTime, steps: parts.orderSteps });
    this.queue = new Queue(parts.queue, { isArmed, move: (order, before) => this.move(order, before), cancel: (order) => this.cancel(order) });
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
    /**
     * The goods that a person is asked about: they were not in their place.
     *
     * @type {{ robot: Robot, product: string } & Hand | null}
     */
    this.asked = null;
    parts.backYes.onclick = () => this.back();
    parts.backNo.onclick = () => this.leave();
    parts.clear.onclick = () => this.takeBack("clear", waiting(this.robot()).map(({ product }) => product));
    parts.undo.onclick = () => this.undo();
    this.plain = plain().map((action) => {
      const button = Object.assign(document.createElement("button"), { type: "button", id: `do-${action}` });
      button.onclick = () => this.act(action);
      return { action, button };
    });
    parts.plain.append(...this.plain.map(({ button }) => button));
  }

  /**
   * Has a robot do something; `said` is where it says why not.
   *
   * @param {string} action
   * @returns {Promise<boolean>} whether it is done
   */
  async act(action, robot = this.robot(), said = this.parts.said) {
    if (!robot) {
      put(said, say("no_robot"));
      return false;
    }
    const answer = await this.link.act(robot, action);
    put(said, answer.refused ? reason(answer.refused) : "");
    return !answer.refused;
  }

  /**
   * Orders goods.
   *
   * @param {string} product
   * @param {Hand} hand where a person is asked, and told why not
   */
  async fetch(product, { beside, said }) {
    const [robot, at] = [this.robot(), performance.now()];
    // What was delivered is not fetched again before a person has put it back.
    if (robot?.gone.has(product) && turnOf(robot, product) < 0) return this.ask({ robot, product, beside, said });
    const { ordered } = this;
    if (ordered?.robot === robot && ordered.product === product && (ordered.waits || at - ordered.at < TWICE_MS)) {
      ordered.at = at;
      return;
    }
    const order = { robot, product, at, waits: true };
    this.ordered = order;
    await this.act(`order ${++this.number} ${product}`, robot, said);
    order.waits = false;
  }

  /**
   * Asks where the hand was whether goods are in their place again.
   *
   * @param {{ robot: Robot, product: string } & Hand} asked
   */
  ask(asked) {
    const { robot, product, beside } = asked;
    const { back, backSaid, backNo } = this.parts;
    const delivery = wasDelivered(robot, product);
    const name = this.names.get(product) ?? product;
    this.asked = asked;
    beside.after(back);
    put(backSaid, delivery ? say("back_delivered", name, clock(delivery.at)) : say("back_away", name));
    back.toggleAttribute("hidden", false);
    backNo.focus();
  }

  leave() {
    this.asked = null;
    this.parts.back.toggleAttribute("hidden", true);
  }

  /** They are back: the robot is told so, and fetches them. */
  async back() {
    if (!this.asked) return;
    const { robot, product, beside, said } = this.asked;
    this.leave();
    if (!(await this.act(`back ${product}`, robot, said))) return;
    // The station tells the robot's answer before it tells that the goods are back.
    robot.gone.delete(product);
    await this.fetch(product, { beside, said });
  }

  /**
   * Takes an order out, be it under way or waiting.
   *
   * @param {string | undefined} order
   */
  cancel(order) {
    const robot = this.robot();
    if (!robot || order === undefined) return;
    const orders = waiting(robot);
    const at = orders.findIndex((one) => one.order === order);
    // Ordered anew, what was under way comes before all that wait but the first, which is under way by then.
    const behind = at < 0 ? Math.max(0, orders.length - 1) : orders.length - 1 - at;
    const product = orders[at]?.product ?? robot.state.product;
    this.takeBack(`cancel ${order}`, product === undefined ? [] : [product], behind);
  }

  /**
   * Puts an order before another one, or with null at the end. Where it then stands the robot says.
   *
   * @param {string} order
   * @param {string | null} before
   */
  async move(order, before) {
    const robot = this.robot();
    for (const one of ups(waiting(robot).map((one) => one.order), order, before)) {
      if (!(await this.act(`up ${one}`, robot))) return;
    }
  }

  /**
   * Takes orders out of the queue.
   *
   * @param {string} action
   * @param {string[]} products whose orders those are
   * @param {number} behind how many wait behind them
   */
  async takeBack(action, products, behind = 0) {
    const robot = this.robot();
    if (!robot || !(await this.act(action)) || !products.length) return;
    this.taken = { robot, products, behind };
  }

  /** Orders anew what was taken out, and moves it to where it was. */
  async undo() {
    if (!this.taken) return;
    const { robot, products, behind } = this.taken;
    this.taken = null;
    for (const product of products) {
      const order = ++this.number;
      if (!(await this.act(`order ${order} ${product}`, robot))) return;
      for (let step = 0; step < behind; step++) await this.act(`up ${order}`, robot);
    }
  }

  /** @param {Warehouse | null} warehouse */
  setWarehouse(warehouse) {
    this.warehouse = warehouse;
    this.learned = null;
    const goods = warehouse?.product ?? [];
    this.goods = new Map(goods.map((one) => [String(one.id), one]));
    this.names = new Map(goods.map((one) => [String(one.id), titleOf(one)]));
    this.tiles.setGoods(goods);
    this.past.setNames(this.names);
  }

  /**
   * @param {Robot | null} robot
   * @param {number} now
   */
  draw(robot, now) {
    // Another robot, or the goods are back: the question is over.
    if (this.asked && (robot !== this.asked.robot || !robot.gone.has(this.asked.product))) this.leave();
    if (!this.isOpen()) return;
    this.past.draw(robot, now);
    this.drawOrders(robot, now);
    this.tiles.draw(robot, !this.link.mayDrive || Boolean(robot?.isStale(now)));
    const { picks, picked, undo } = this.parts;
    for (const { action, button } of this.plain) {
      put(button, sentence(`do_${action}`) ?? action);
      button.toggleAttribute("disabled", !this.link.mayDrive);
    }
    undo.toggleAttribute("hidden", !this.taken || this.taken.robot !== robot);
    const pick = robot?.isStale(now) ? undefined : robot?.state.pick;
    picks.checked = robot?.state.pick === "auto";
    picks.toggleAttribute("disabled", pick === undefined || !this.link.mayDrive);
    picked.parentElement?.toggleAttribute("hidden", !(robot?.state.phase === "picking" && (pick === "manual" || robot.state.remedy !== undefined)));
  }

  /**
   * @param {Robot | null} robot
   * @param {number} now
   */
  drawOrders(robot, now) {
    const { head, clear } = this.parts;
    const orders = waiting(robot);
    const { product, mode, stopped } = robot?.state ?? {};
    const time = this.link.now();
    const known = robot && !robot.isStale(now) && mode === "autonomous" && stopped !== "1" ? this.known(robot.jobs.done) : null;
    this.order.draw(robot, this.goods.get(product ?? ""), known, time);
    const first = !robot || !known ? null : product === undefined ? 0 : left(jobOf(robot, product), known, time);
    const isAway = product !== undefined || robot?.state.phase === "returning";
    const ms = known ? waits(first, orders.map(({ product }) => product), known, isAway) : [];
    const rows = orders.map(({ order, product }, at) => ({
      order, product, ms: ms[at] ?? null,
      name: this.goods.get(product)?.name || say("goods_numbered", product),
      who: robot?.jobs.asked.get(order)?.who,
      putOff: robot?.jobs.putOff.get(product),
    }));
    this.queue.draw(rows, this.link.me, this.link.mayDrive);
    put(head, orders.length ? say("queue_head", orders.length, this.goods.size) : say("queue_empty"));
    clear.toggleAttribute("disabled", !orders.length || !this.link.mayDrive);
    this.parts.orderCancel.toggleAttribute("hidden", robot?.state.order === undefined || !this.link.mayDrive);
    const label = say("cancel_order", product ?? "");
    if (this.parts.orderCancel.title !== label) Object.assign(this.parts.orderCancel, { title: label, ariaLabel: label });
  }

  /**
   * What past orders teach; it is learned anew when another one is delivered.
   *
   * @param {Delivered[]} done
   */
  known(done) {
    const [{ learned }, count, after] = [this, done.length, done[0]?.next ?? done[0]?.back];
    if (learned?.done === done && learned.count === count && learned.after === after) return learned.known;
    const known = learn(done, (product) => crossingsTo(this.warehouse, product));
    this.learned = { done, count, after, known };
    return known;
  }
}

/**
 * The orders that wait; the one under way may be listed with them.
 *
 * @param {Robot | null} robot
 * @returns {Waiting[]}
 */
function waiting(robot) {
  return (robot?.queue ?? []).filter(({ order }) => order !== robot?.state.order);
}
