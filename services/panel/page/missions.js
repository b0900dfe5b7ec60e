// What is fetched: the queue, what the hands at the goods say, what has been delivered.

import { crossing, sentence } from "./sentences.js";
import { say, span } from "./words.js";
import { put } from "./bar.js";

export class Missions {
  constructor(link, parts, robot) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.shown = null;
    this.order = Date.now() % 1_000_000_000;
    parts.fetch.addEventListener("submit", (event) => {
      event.preventDefault();
      this.act(`order ${++this.order} ${parts.goods.value}`);
    });
    // It shows what the robot says, not what was wished.
    parts.picks.onclick = (event) => {
      event.preventDefault();
      const wish = this.robot()?.state.pick === "auto" ? "manual" : "auto";
      this.act(`pick ${wish}`);
    };
    parts.picked.onclick = () => this.act("picked");
    parts.pickedForce.onclick = () => this.act("picked force");
    parts.clear.onclick = () => this.act("clear");
    link.addEventListener("event", ({ detail }) => this.remember(detail));
  }

  async act(action) {
    const robot = this.robot();
    if (!robot) return put(this.parts.said, say("no_robot"));
    const answer = await this.link.act(robot, action);
    const why = answer.refused === "lost" ? say("lost") : answer.refused;
    put(this.parts.said, answer.refused ? say("refused", why) : "");
  }

  setWarehouse(warehouse) {
    const { goods } = this.parts;
    goods.replaceChildren(...(warehouse?.product ?? []).map(({ id, name }) => new Option(name ? `${id} ${name}` : id, id)));
  }

  /** Keeps when goods were fetched and delivered, what was in the way, and what cannot be reached. */
  remember({ robot, entry }) {
    if (entry.kind === "thought") return this.rememberThought(robot, entry.values ?? {});
    const [what, x, y, , product, looks] = entry.words;
    if (what === "way_blocked") robot.detours.push({ node: `${x},${y}`, looks });
    if (what === "getting_item") Object.assign(robot, { began: entry.at, detours: [] });
    if (what !== "item_delivered") return;
    const took = robot.began ? span(entry.at - robot.began) : "";
    robot.history.unshift({ product, at: entry.at, took, detours: robot.detours });
    robot.detours = [];
  }

  rememberThought(robot, { kind, product }) {
    if (kind === "order_put_off") robot.unreachable.add(product);
    if (["fetching", "order_cancelled"].includes(kind)) robot.unreachable.delete(product);
    if (kind === "queue_cleared") robot.unreachable.clear();
  }

  draw(robot, now) {
    this.drawQueue(robot);
    const { picks } = this.parts;
    const pick = robot?.isStale(now) ? undefined : robot?.state.pick;
    picks.checked = robot?.state.pick === "auto";
    picks.disabled = pick === undefined || !this.link.mayDrive;
    const lines = (robot?.history ?? []).map(delivered);
    fill(this.parts.history, lines, (line) => item(line));
  }

  drawQueue(robot) {
    const { queue } = this.parts;
    const current = robot?.state.product;
    const orders = (robot?.queue ?? []).filter(({ order }) => order !== robot.state.order);
    const shown = JSON.stringify([current, orders, document.documentElement.lang]);
    if (this.shown === shown) return;
    this.shown = shown;
    queue.replaceChildren();
    if (current !== undefined) queue.append(item(`${current}  ${say("under_way")}`));
    for (const { order, product } of orders) {
      const line = item(product);
      line.append(
        button(say("first"), () => this.act(`first ${order}`)),
        button(say("cancel"), () => this.act(`cancel ${order}`)),
      );
      queue.append(line);
    }
    if (!queue.children.length) queue.append(item(say("queue_empty")));
  }
}

/** One delivery as a line: when, what, how long it took, and which ways were blocked on it. */
function delivered({ product, at, took, detours }) {
  const words = [new Date(at).toLocaleTimeString(), product, took];
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

function button(text, act) {
  const element = document.createElement("button");
  element.type = "button";
  element.textContent = text;
  element.onclick = act;
  return element;
}
