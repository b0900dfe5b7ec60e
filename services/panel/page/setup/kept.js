// Where the warehouse is kept, and what each robot does with it. A simulated robot can be put into it, after a question.

import { reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

export class Kept {
  constructor(link, parts, robot) {
    Object.assign(this, { link, parts, robot, name: null });
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

  /** The robot that can be put into the saved warehouse and is not in it yet: the one in view, or another one. */
  candidate() {
    const can = ({ connected, renews, uses }) => connected && renews && uses === "world_before";
    const robots = [this.robot(), ...this.link.robots.values()];
    return robots.find((robot) => robot && can(robot)) ?? null;
  }

  draw() {
    const { link, parts } = this;
    put(parts.where, link.kept ? say("kept_in", link.kept) : say("kept_nowhere"));
    const told = [...link.robots.values()].filter(({ connected }) => connected).map(uses);
    put(parts.robots, told.join(" "));
    const robot = this.candidate();
    parts.ask.hidden = !robot || !link.mayDrive || this.name !== null;
    if (robot) put(parts.ask, say("renew", robot.name));
    // What was asked about may have gone, or been put there by somebody else.
    if (robot?.name !== this.name) this.name = null;
    parts.box.hidden = this.name === null;
    if (this.name === null) return;
    // The order under way need not be listed with those that wait.
    const ordered = new Set([robot.state.product, ...robot.queue.map(({ product }) => product)]);
    const unfit = [...ordered].filter((product) => product && !link.warehouse.product?.some(({ id }) => String(id) === product));
    put(parts.question, [say("renew_how", robot.name), unfit.length ? say("renew_drops", unfit.join(", ")) : ""].filter(Boolean).join(" "));
  }
}

/** What a robot does with the warehouse that the station keeps. */
function uses({ name, speaks, uses }) {
  const code = speaks && uses !== "-" ? `uses_${uses}` : "uses_unknown";
  return `${code === "uses_unknown" ? say(code, name) : reason(`${code} ${name}`)}.`;
}
