// All robots of the station at a glance, where there are two or more: who needs a person comes first.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */
/** @import { Face } from "../bar/face.js" */

import { battery } from "../bar/battery.js";
import { face, SHAPES } from "../bar/face.js";
import { drawRemedy } from "../bar/remedy.js";
import { make, set } from "../parts/svg.js";
import { put, say } from "../words/words.js";

/** The looks, the gravest first. */
const GRAVITY = Object.keys(SHAPES);

/** @typedef {{ item: HTMLElement, button: HTMLButtonElement, remedy: HTMLButtonElement, shape: Element } & Record<"name" | "said" | "more", HTMLElement>} Row */

export class Fleet {
  /**
   * @param {Link} link
   * @param {{ tab: HTMLElement, list: HTMLElement }} parts
   * @param {(name: string) => void} choose is called with the name of the robot that is to be shown
   */
  constructor(link, { tab, list }, choose) {
    this.link = link;
    this.tab = tab;
    this.list = list;
    this.choose = choose;
    /** @type {Map<string, Row>} */
    this.rows = new Map();
  }

  /**
   * @param {Robot | null} shown
   * @param {number} now
   */
  draw(shown, now) {
    const robots = [...this.link.robots.values()];
    this.tab.toggleAttribute("hidden", robots.length < 2);
    if (this.tab.hidden) return;
    const states = robots.map((robot) => ({ robot, state: face(this.link, robot, now) }));
    /** @param {{ state: Face }} one */
    const grave = ({ state }) => GRAVITY.indexOf(state.look);
    states.sort((one, other) => grave(one) - grave(other) || one.robot.name.localeCompare(other.robot.name));
    states.forEach(({ robot, state }, place) => {
      const row = this.row(robot);
      // A row that stays in its place keeps the reader's focus.
      if (this.list.children[place] !== row.item) this.list.insertBefore(row.item, this.list.children[place] ?? null);
      const { button, remedy, shape, name, said, more } = row;
      set(button, "aria-pressed", String(robot === shown));
      set(button, "data-look", state.look);
      set(shape, "d", SHAPES[state.look]);
      drawRemedy(remedy, state, () => this.choose(robot.name));
      put(name, robot.name);
      put(said, state.said ?? "");
      put(more, [state.since, state.more, ...figures(robot)].filter(Boolean).join(" \u00b7 "));
    });
  }

  /**
   * @param {Robot} robot
   * @returns {Row}
   */
  row(robot) {
    const known = this.rows.get(robot.name);
    if (known) return known;
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.onclick = () => this.choose(robot.name);
    const shape = make("path", {}, make("svg", { viewBox: "0 0 32 32", "aria-hidden": "true" }, button));
    const [name, said, more] = [document.createElement("strong"), document.createElement("span"), document.createElement("small")];
    button.append(name, said, more);
    const remedy = document.createElement("button");
    remedy.type = "button";
    item.append(button, remedy);
    const row = { item, button, remedy, shape, name, said, more };
    this.rows.set(robot.name, row);
    return row;
  }
}

/**
 * Battery and orders.
 *
 * @param {Robot} robot
 */
function figures({ state, queue }) {
  return [battery(state).words, queue.length ? say("orders_wait", queue.length) : ""];
}
