// What the page asks a person: where the robot stands after it was driven by hand, and whether
// somebody else may have the wheel. STOP and its keys work meanwhile: nothing here is in front of them.

import { judge, wrong } from "../parts/fields.js";
import { called, reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

/** Which way a robot on the delivery corner looks into the warehouse. */
const inwards = (x) => (x === 0 ? "right" : "left");
/** The ways to look, from 0 degrees on to the right. */
const LOOKS = ["up", "right", "down", "left"];

export class Where {
  /** `then` is done once the robot knows where it stands. */
  constructor(link, parts, robot) {
    Object.assign(this, { link, parts, robot, then: null });
    const { form, later } = parts;
    judge(form);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.answer();
    });
    later.onclick = () => parts.dialog.close();
    // To name a crossing is to choose it.
    for (const name of ["x", "y", "looks"]) form.elements[name].addEventListener("input", () => (form.elements.at.value = "crossing"));
  }

  /** Whether a robot that has been driven by hand does not know where it stands. */
  isOpen(robot) {
    return Boolean(robot?.speaks && this.link.warehouse && robot.state.phase && robot.state.x_mm === undefined);
  }

  /** Whether somebody is to say where a robot stands: then a crossing of the map can be pointed at. */
  isWanted(robot) {
    return this.parts.dialog.open || this.isOpen(robot);
  }

  /** The robot stands on a crossing that was pointed at; which way it looks, is asked. */
  choose([x, y]) {
    const { form, dialog } = this.parts;
    if (!dialog.open) this.ask();
    const { elements } = form;
    [elements.at.value, elements.x.value, elements.y.value] = ["crossing", x, y];
    // At first as it looked when it was known last.
    const { heading } = this.robot()?.pose ?? {};
    if (heading !== undefined) elements.looks.value = LOOKS[(Math.round(heading / 90) + 40) % 4];
    elements.looks.focus();
  }

  ask(then = null) {
    const [width, height] = this.link.warehouse.size;
    const { form, dialog, said } = this.parts;
    this.then = then;
    [form.elements.x.max, form.elements.y.max] = [width, height];
    put(said, "");
    if (!dialog.open) dialog.show();
    form.elements.at[0].focus();
  }

  async answer() {
    const { form, dialog, said } = this.parts;
    const robot = this.robot();
    if (!robot) return put(said, say("no_robot"));
    const { at, x, y, looks } = form.elements;
    const why = at.value === "crossing" ? wrong([x, y]) : null;
    if (why) return put(said, why);
    const [cornerX, cornerY] = this.link.warehouse.delivery;
    let action = `place ${x.value} ${y.value} ${looks.value}`;
    // A simulated robot is carried there; a real one has been.
    if (at.value === "delivery") action = robot.truth ? `place ${cornerX} ${cornerY} ${inwards(cornerX)}` : "reset";
    const answer = await this.link.act(robot, action);
    if (answer.refused) return put(said, reason(answer.refused));
    dialog.close();
    this.then?.();
  }
}

/** The driver is asked by whoever wants the wheel. */
export class Asked {
  constructor(link, parts, robot, letGo) {
    Object.assign(this, { link, parts, robot });
    parts.give.onclick = () => {
      letGo();
      this.link.ask("free", this.robot().name);
    };
    parts.keep.onclick = () => this.link.ask("keep", this.robot().name);
  }

  draw(robot) {
    const { box, said } = this.parts;
    const who = robot?.driver && robot.driver === this.link.me ? robot.asks : null;
    box.hidden = !who;
    put(said, who ? say("asks", called(who)) : "");
  }
}
