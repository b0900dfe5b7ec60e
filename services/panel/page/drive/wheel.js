// The wheel: who drives a robot by hand. One takes it, leaves it or asks for it, by a name that one can choose.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */
/** @import { Driving } from "./drive.js" */
/** @import { Where } from "./ask.js" */

import { called, reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

export class Wheel {
  /**
   * @param {Link} link
   * @param {{ button: HTMLButtonElement, name: HTMLInputElement }} parts
   * @param {() => Robot | null} robot
   * @param {Driving} driving
   * @param {Where} where
   */
  constructor(link, parts, robot, driving, where) {
    this.link = link;
    this.parts = parts;
    this.robot = robot;
    this.driving = driving;
    this.where = where;
    parts.button.onclick = () => this.press();
    parts.name.value = localStorage.getItem("name") ?? "";
    parts.name.onchange = () => this.rename();
  }

  async press() {
    const { link, driving, where } = this;
    const robot = this.robot();
    if (!robot) return;
    const mine = robot.driver === link.me;
    driving.letGo();
    if (robot.driver && !mine) driving.tell("asked_for", called(robot.driver));
    else driving.tell(null);
    const answer = await link.ask(mine ? "free" : "take", robot.name);
    if (answer.refused) driving.tell("refused", reason(answer.refused));
    else driving.tell(null);
    // Whoever was driven by hand is lost until somebody says where it stands.
    if (mine && answer.done && where.isOpen(robot)) where.ask();
  }

  rename() {
    const { name } = this.parts;
    this.driving.letGo();
    // It stands in lines of words.
    name.value = name.value.trim().replaceAll(" ", "-");
    this.link.rename(name.value);
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    const { button } = this.parts;
    const driver = robot?.driver;
    const other = driver ? say("control_other", called(driver)) : say("control_free");
    put(button, driver && driver === this.link.me ? say("control_mine") : other);
    // Who has the wheel is not known until the robot is heard again.
    button.toggleAttribute("disabled", !this.link.open || !robot?.connected);
  }
}
