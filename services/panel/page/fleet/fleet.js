// All robots of the station at a glance, where there are two or more: who needs a person comes first.

import { battery } from "../bar/battery.js";
import { face, SHAPES } from "../bar/face.js";
import { make } from "../parts/svg.js";
import { put, say } from "../words/words.js";

/** The looks, the gravest first. */
const GRAVITY = Object.keys(SHAPES);

export class Fleet {
  /** `choose` is called with the name of the robot that is to be shown. */
  constructor(link, { tab, list }, choose) {
    Object.assign(this, { link, tab, list, choose });
    this.rows = new Map();
  }

  draw(shown, now) {
    const robots = [...this.link.robots.values()];
    this.tab.hidden = robots.length < 2;
    if (this.tab.hidden) return;
    const states = robots.map((robot) => ({ robot, state: face(this.link, robot, now) }));
    const grave = ({ state }) => GRAVITY.indexOf(state.look);
    states.sort((one, other) => grave(one) - grave(other) || one.robot.name.localeCompare(other.robot.name));
    states.forEach(({ robot, state }, place) => {
      const row = this.row(robot);
      // A row that stays in its place keeps the reader's focus.
      if (this.list.children[place] !== row) this.list.insertBefore(row, this.list.children[place] ?? null);
      const button = row.firstElementChild;
      const [shape, name, said, more] = button.children;
      button.setAttribute("aria-pressed", robot === shown);
      button.dataset.look = state.look;
      shape.firstElementChild.setAttribute("d", SHAPES[state.look]);
      put(name, robot.name);
      put(said, state.said ?? "");
      put(more, [state.since, state.more, ...figures(robot)].filter(Boolean).join(" \u00b7 "));
    });
  }

  row(robot) {
    let row = this.rows.get(robot.name);
    if (row) return row;
    row = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.onclick = () => this.choose(robot.name);
    make("path", {}, make("svg", { viewBox: "0 0 32 32", "aria-hidden": "true" }, button));
    for (const part of ["strong", "span", "small"]) button.append(document.createElement(part));
    row.append(button);
    this.rows.set(robot.name, row);
    return row;
  }
}

/** Battery and orders. */
function figures({ state, queue }) {
  return [battery(state).words, queue.length ? say("orders_wait", queue.length) : ""];
}
