// The Health view: where the link is cut, the robot's services, losses, machine and versions.

import { chain, isOld, losses, machine, services, versions } from "./model.js";
import { age } from "../bar/face.js";
import { make } from "../parts/svg.js";
import { put, say } from "../words/words.js";

/** The shape of each mark, in a square of 20. */
const MARKS = {
  good: "M10 2a8 8 0 1 0 0 16a8 8 0 1 0 0-16M6.5 10l2.5 2.5 4.5-5",
  bad: "M2 2h16v16H2zM7 7l6 6m0-6l-6 6",
  unknown: "M10 2a8 8 0 1 0 0 16a8 8 0 1 0 0-16",
};

export class Health {
  /** `parts` has a list for each of the sections, `said` for how old they are. */
  constructor(link, parts) {
    Object.assign(this, { link, parts });
    /** The rows of each list, by their ids. */
    this.rows = new Map();
  }

  /** Draws it where it is in view. */
  draw(robot, now) {
    const { parts, link } = this;
    if (document.body.dataset.view !== "health") return;
    this.list(parts.chain, chain(link, robot, now));
    const told = robot?.health.at !== undefined;
    const isStale = told && isOld(robot, now);
    parts.body.classList.toggle("old", isStale);
    put(parts.said, told ? (isStale ? say("health_as_of", age(now - robot.health.at)) : "") : say("health_untold"));
    this.list(parts.services, told ? services(robot) : []);
    this.list(parts.losses, told ? losses(robot) : []);
    this.list(parts.machine, told ? machine(robot) : []);
    this.list(parts.versions, versions(link, robot));
  }

  /** Shows these rows in a list, and touches only what has changed. */
  list(list, rows) {
    const section = list.closest("section");
    if (section.hidden !== !rows.length) section.hidden = !rows.length;
    const known = this.rows.get(list) ?? new Map();
    this.rows.set(list, known);
    for (const [id, item] of known) {
      if (rows.some((row) => row.id === id)) continue;
      item.remove();
      known.delete(id);
    }
    rows.forEach((row, place) => {
      const item = known.get(row.id) ?? newRow(row.id);
      known.set(row.id, item);
      if (list.children[place] !== item) list.insertBefore(item, list.children[place] ?? null);
      fill(item, row);
    });
  }
}

function newRow(id) {
  const item = document.createElement("li");
  item.dataset.row = id;
  make("path", {}, make("svg", { viewBox: "0 0 20 20", role: "img" }, item));
  for (const part of ["strong", "span", "p"]) item.append(document.createElement(part));
  return item;
}

function fill(item, { mark, name, value, said }) {
  const [shape, called, told, remedy] = item.children;
  if (item.dataset.mark !== mark) {
    item.dataset.mark = mark;
    shape.firstElementChild.setAttribute("d", MARKS[mark]);
  }
  const label = say(`mark_${mark}`);
  if (shape.getAttribute("aria-label") !== label) shape.setAttribute("aria-label", label);
  put(called, name);
  put(told, value);
  put(remedy, said ?? "");
}
