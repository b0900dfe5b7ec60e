// The Health view: where the link is cut, the robot's services, losses, machine and versions.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */
/** @import { Row } from "./model.js" */

import { chain, isOld, losses, machine, services, versions } from "./model.js";
import { age } from "../bar/face.js";
import { MARKS } from "../parts/marks.js";
import { make, set } from "../parts/svg.js";
import { reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

/** @typedef {{ item: HTMLLIElement, shape: SVGSVGElement, path: SVGPathElement, name: HTMLElement, value: HTMLElement, said: HTMLElement, button: HTMLButtonElement | null }} Drawn a row as it is drawn */

export class Health {
  /**
   * @param {Link} link
   * @param {Record<"body" | "said" | "links" | "services" | "machine" | "losses" | "versions", HTMLElement>} parts `said`
   *   is for how old they are
   */
  constructor(link, parts) {
    this.link = link;
    this.parts = parts;
    /**
     * The rows of each list, by their ids.
     *
     * @type {Map<HTMLElement, Map<string, Drawn>>}
     */
    this.rows = new Map();
    /** @type {Robot | null} */
    this.robot = null;
    /**
     * Why a board was not restarted, beside its row.
     *
     * @type {{ robot: Robot, row: string, said: string } | null}
     */
    this.refused = null;
  }

  /**
   * Draws it where it is in view.
   *
   * @param {Robot | null} robot
   * @param {number} now
   */
  draw(robot, now) {
    const { parts, link } = this;
    if (document.body.dataset.view !== "health") return;
    this.robot = robot;
    this.list(parts.links, chain(link, robot, now));
    const told = robot?.health ? robot : null;
    const isStale = told !== null && isOld(told, now);
    parts.body.classList.toggle("old", isStale);
    put(parts.said, told ? (isStale ? say("health_as_of", age(now - told.healthAt)) : "") : say("health_untold"));
    this.list(parts.services, told ? services(told) : []);
    const { refused } = this;
    this.list(parts.losses, (told ? losses(told) : []).map((row) => (refused?.robot === told && refused?.row === row.id ? { ...row, said: refused.said } : row)));
    this.list(parts.machine, told ? machine(told) : []);
    this.list(parts.versions, versions(link, robot));
  }

  /**
   * Has a board restarted.
   *
   * @param {Row} row
   */
  async restart({ id, board }) {
    const { robot, link } = this;
    if (!robot) return;
    const { refused } = await link.act(robot, `restart ${board}`);
    this.refused = refused ? { robot, row: id, said: reason(refused) } : null;
  }

  /**
   * Shows these rows in a list, and touches only what has changed.
   *
   * @param {HTMLElement} list
   * @param {Row[]} rows
   */
  list(list, rows) {
    list.parentElement?.toggleAttribute("hidden", !rows.length);
    const known = this.rows.get(list) ?? new Map();
    this.rows.set(list, known);
    for (const [id, { item }] of known) {
      if (rows.some((row) => row.id === id)) continue;
      item.remove();
      known.delete(id);
    }
    rows.forEach((row, place) => {
      const drawn = known.get(row.id) ?? newRow(row.id, row.board ? () => this.restart(row) : null);
      known.set(row.id, drawn);
      if (list.children[place] !== drawn.item) list.insertBefore(drawn.item, list.children[place] ?? null);
      fill(drawn, row);
    });
  }
}

/**
 * @param {string} id
 * @param {(() => void) | null} press what its button does, if it has one
 * @returns {Drawn}
 */
function newRow(id, press) {
  const item = document.createElement("li");
  item.dataset.row = id;
  const shape = make("svg", { viewBox: "0 0 20 20", role: "img" }, item);
  const [name, value, said] = [document.createElement("strong"), document.createElement("span"), document.createElement("p")];
  const button = press && document.createElement("button");
  item.append(name, value, said, ...(button ? [button] : []));
  if (button) [button.type, button.onclick] = ["button", press];
  return { item, shape, path: make("path", {}, shape), name, value, said, button };
}

/**
 * @param {Drawn} drawn
 * @param {Row} row
 */
function fill(drawn, { mark, name, value, said }) {
  set(drawn.item, "data-mark", mark);
  set(drawn.path, "d", MARKS[mark]);
  set(drawn.shape, "aria-label", say(`mark_${mark}`));
  put(drawn.name, name);
  put(drawn.value, value);
  put(drawn.said, said ?? "");
  if (drawn.button) put(drawn.button, say("restart_board", name));
}
