// How fast a person drives: one of three steps, which each command says for itself, so that none is left over from
// somebody else. This browser keeps it; who has never chosen drives at the middle one.

/** Where the browser keeps it. */
const KEPT = "speed";
/** The step without which a command is at full speed. */
const FULL = "full";

export class Speed {
  /**
   * @param {Map<string, HTMLElement>} buttons one for each step, the slowest first
   * @param {() => void} changed
   */
  constructor(buttons, changed) {
    this.buttons = buttons;
    this.changed = changed;
    const kept = localStorage.getItem(KEPT) ?? "";
    this.step = buttons.has(kept) ? kept : "middle";
    for (const [step, button] of buttons) button.addEventListener("click", () => this.choose(step));
    this.draw();
  }

  /** What a command to the wheels says of it. */
  get said() {
    return this.step === FULL ? "" : ` ${this.step}`;
  }

  /** @param {string} step */
  choose(step) {
    if (step === this.step) return;
    this.step = step;
    localStorage.setItem(KEPT, step);
    this.draw();
    this.changed();
  }

  /**
   * Goes on to the next faster step (1), to the next slower one (-1) or to none (0).
   *
   * @param {number} way
   */
  turn(way) {
    const steps = [...this.buttons.keys()];
    const next = steps[steps.indexOf(this.step) + way];
    if (next) this.choose(next);
  }

  draw() {
    for (const [step, button] of this.buttons) button.setAttribute("aria-pressed", String(step === this.step));
  }
}
