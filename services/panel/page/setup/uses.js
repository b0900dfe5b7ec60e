// Where the warehouse is kept, and what each robot does with it. A simulated robot can be put into it, after a question.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

export class Uses {
  /**
   * @param {Link} link
   * @param {Record<"ask" | "yes" | "no", HTMLButtonElement> & Record<"where" | "robots" | "box" | "question" | "said", HTMLElement>} parts
   * @param {() => Robot | null} robot
   */
  constructor(link, parts, robot) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    /**
     * The robot that is asked about.
     *
     * @type {string | null}
     */
    this.name = null;
    parts.ask.onclick = () => {
      this.name = this.candidate()?.name ?? null;
      put(parts.said, "");
      this.draw();
      parts.yes.focus();
      parts.box.scrollIntoView({ block: "nearest" });
    };
    parts.no.onclick = () => this.leave();
    parts.yes.onclick = async () => {
      const { name } = this;
      this.leave();
      const { refused } = await link.ask("renew", name);
      put(parts.said, refused ? say("refused", reason(refused)) : say("renews", name));
    };
  }

  leave() {
    this.name = null;
    this.draw();
  }

  /**
   * The robot that can be put into the saved warehouse and is not in it yet: the one in view, or another one.
   *
   * @returns {Robot | null}
   */
  candidate() {
    const robots = [this.robot(), ...this.link.robots.values()];
    return robots.find((robot) => robot?.connected && robot.renews && robot.uses === "world_before") ?? null;
  }

  draw() {
    const { link, parts } = this;
    put(parts.where, link.kept ? say("kept_in", link.kept) : say("kept_nowhere"));
    const here = [...link.robots.values()].filter(({ connected }) => connected);
    put(parts.robots, here.map(told).join(" "));
    const robot = this.candidate();
    parts.ask.toggleAttribute("hidden", !robot || !link.mayDrive || this.name !== null);
    if (robot) put(parts.ask, say("renew", robot.name));
    // What was asked about may have gone, or been put there by somebody else.
    if (robot?.name !== this.name) this.name = null;
    parts.box.toggleAttribute("hidden", this.name === null);
    if (!robot || this.name === null) return;
    // The order under way need not be listed with those that wait.
    const ordered = new Set([robot.state.product, ...robot.queue.map(({ product }) => product)]);
    const has = new Set(link.warehouse?.product?.map(({ id }) => String(id)));
    const unfit = [...ordered].filter((product) => product && !has.has(product));
    put(parts.question, [say("renew_how", robot.name), unfit.length ? say("renew_drops", unfit.join(", ")) : ""].filter(Boolean).join(" "));
  }
}

/**
 * What a robot does with the warehouse that the station keeps.
 *
 * @param {Robot} robot
 */
function told({ name, speaks, uses }) {
  return `${speaks && uses !== "-" ? reason(`uses_${uses} ${name}`) : say("uses_unknown", name)}.`;
}
