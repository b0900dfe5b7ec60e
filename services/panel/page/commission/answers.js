// What a person can answer: buttons, a number, the ways of the wheels. What is asked in a way that this page does not know
// yet is answered in a field.

import { word } from "./said.js";
import { button, element, labelled } from "./make.js";

/** How often a page says that a button is held, in ms. What it moves goes on for 300 ms. */
const HELD_MS = 100;
/** So long after a question is asked nothing answers it, in ms: a hand may still be at the answer before. */
const SETTLE_MS = 400;
/**
 * The letters of the wheels' ways.
 *
 * @type {[string, string][]}
 */
const WAYS = [["f", "forwards"], ["0", "still"], ["b", "backwards"]];
const SIDES = ["left", "right"];

export class Answers {
  /**
   * @param {HTMLElement} place
   * @param {(answer: string) => void} give
   * @param {() => void} stand
   * @param {() => void} hold
   */
  constructor(place, give, stand, hold) {
    this.place = place;
    this.give = give;
    this.stand = stand;
    this.hold = hold;
    /** Says again and again that a button is held. */
    this.held = 0;
    addEventListener("blur", () => this.letGo());
    document.addEventListener("visibilitychange", () => this.letGo());
    /** What is drawn: the question's number and what it takes. */
    this.drawn = "";
    this.since = -Infinity;
    /** @type {HTMLElement | null} */
    this.first = null;
  }

  /**
   * Draws what can be answered now.
   *
   * @param {{ asked: string | undefined, takes: string | undefined, moves: boolean, language: string }} now
   * @param {boolean} mayAnswer
   * @param {number} time
   */
  draw({ asked, takes, moves, language }, mayAnswer, time) {
    // What moves while its button is held has the same answers when it stands.
    const wanted = [asked, takes, moves && takes !== "hold", language].join(" ");
    if (wanted !== this.drawn) {
      // A hand that was here stays here.
      const hadFocus = this.place.contains(document.activeElement);
      const typed = this.place.querySelector("input:not([type=radio])");
      const text = typed instanceof HTMLInputElement && this.drawn.split(" ")[1] === takes ? typed.value : "";
      this.drawn = wanted;
      this.since = time;
      this.letGo();
      this.fill(takes, moves, text);
      this.hadFocus = hadFocus;
    }
    if (!mayAnswer) this.letGo();
    const isSettled = time - this.since >= SETTLE_MS;
    for (const one of this.place.querySelectorAll("button, input")) {
      const isStand = one.classList.contains("stand");
      one.toggleAttribute("disabled", !mayAnswer || (!isSettled && !isStand));
    }
    if (isSettled && mayAnswer && this.hadFocus) {
      this.hadFocus = false;
      this.first?.focus();
    }
  }

  /** Nothing more is answered before something else is asked. */
  taken() {
    this.since = Infinity;
    this.hadFocus = this.place.contains(document.activeElement);
  }

  /** What was answered is not taken, and can be answered again. */
  refused() {
    this.since = -Infinity;
  }

  /**
   * @param {string | undefined} takes
   * @param {boolean} moves
   * @param {string} text
   */
  fill(takes, moves, text) {
    const { place } = this;
    place.replaceChildren();
    this.first = null;
    const no = () => button(place, "no", () => this.give("no"));
    if (takes === "hold") {
      this.heldButton();
      button(place, "yes", () => this.give("yes"));
      no();
    } else if (moves) {
      if (takes) this.first = button(place, "now", () => this.give("yes"), "first");
      button(place, "stand", () => this.stand(), "stand");
    } else if (takes === "yes") {
      this.first = button(place, "yes", () => this.give("yes"), "first");
      no();
    } else if (takes === "ways") {
      this.ways();
    } else if (takes) {
      this.typed(takes === "number", text);
      no();
    }
  }

  /** What moves does so only while this is held. */
  heldButton() {
    const one = button(this.place, "hold", () => {}, "first held");
    this.first = one;
    const begin = () => {
      if (this.held || one.disabled) return;
      this.hold();
      this.held = setInterval(() => this.hold(), HELD_MS);
      one.ariaPressed = "true";
    };
    one.addEventListener("pointerdown", (event) => {
      // A finger that slips is still there.
      one.setPointerCapture(event.pointerId);
      begin();
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture", "blur", "keyup"]) {
      one.addEventListener(name, () => this.letGo());
    }
    one.addEventListener("contextmenu", (event) => event.preventDefault());
    one.addEventListener("keydown", (event) => {
      if (![" ", "Enter"].includes(event.key)) return;
      event.preventDefault();
      if (!event.repeat) begin();
    });
  }

  /** The button is held no more. */
  letGo() {
    clearInterval(this.held);
    this.held = 0;
    this.place.querySelector(".held")?.removeAttribute("aria-pressed");
  }

  /**
   * @param {boolean} isNumber
   * @param {string} text
   */
  typed(isNumber, text) {
    const form = element(this.place, "form");
    const input = document.createElement("input");
    input.setAttribute("aria-label", word("answer"));
    input.autocomplete = "off";
    input.value = text;
    if (isNumber) input.inputMode = "decimal";
    form.append(input);
    button(form, "set", null, "first");
    form.onsubmit = (event) => {
      event.preventDefault();
      const answer = input.value.trim().toLowerCase().replaceAll(" ", "");
      if (answer) this.give(answer);
      else input.focus();
    };
    this.first = input;
  }

  ways() {
    const form = element(this.place, "form", "ways");
    for (const side of SIDES) {
      const group = element(form, "fieldset");
      element(group, "legend", "", word(side));
      for (const [letter, name] of WAYS) {
        const input = document.createElement("input");
        Object.assign(input, { type: "radio", name: side, value: letter, required: true });
        labelled(group, input, word(name));
        this.first ??= input;
      }
    }
    button(form, "set", null, "first");
    form.noValidate = true;
    form.onsubmit = (event) => {
      event.preventDefault();
      const data = new FormData(form);
      const ways = SIDES.map((side) => data.get(side) ?? "");
      const missing = ways.indexOf("");
      if (missing < 0) this.give(ways.join(""));
      else form.querySelectorAll("fieldset")[missing]?.querySelector("input")?.focus();
    };
  }
}
