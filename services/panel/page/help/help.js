// What every sign of the page means, made from what draws it: the shapes of the states, the map's legend, the keys of the
// wheels and of the arm. Nothing here is in front of STOP, and its keys work meanwhile.

import { SHAPES } from "../bar/face.js";
import { isText } from "../bar/stop.js";
import { KEYS } from "../drive/drive.js";
import { KINDS } from "../log/kinds.js";
import { MARKS } from "../parts/marks.js";
import { make } from "../parts/svg.js";
import { say } from "../words/words.js";

/**
 * The keys of the whole page, and what they do.
 *
 * @type {[string, string][]}
 */
const PAGE_KEYS = [["Esc", "key_stop"], ["Space", "key_space"], ["?", "key_help"], ["Tab", "key_next"], ["\u2190 \u2192 \u2191 \u2193", "key_tabs"], ["Enter", "key_press"]];
/**
 * Keys of lists, of the time line and of the curves.
 *
 * @type {[string, string][]}
 */
const VIEW_KEYS = [["/", "key_search"], ["K J", "key_events"], ["\u2190 \u2192 Home End", "key_time"], ["Alt \u2191 \u2193", "key_queue"], ["Delete", "key_queue_out"], ["Ctrl Z", "key_undo"], ["Ctrl Y", "key_redo"], ["Ctrl S", "key_save"]];
/** @type {[string, string][]} */
const MAP_KEYS = [["\u2190 \u2192 \u2191 \u2193", "key_map"], ["Enter", "key_map_enter"], ["Shift \u2190 \u2192", "key_map_move"], ["+ \u2212", "key_map_zoom"]];
/** The colours that have a meaning. */
const COLOURS = ["accent", "goods", "caution", "danger", "quiet"];

export class Help {
  /**
   * @param {{ dialog: HTMLDialogElement } & Record<"body" | "open" | "close" | "legend", HTMLElement>} parts `legend` is the map's
   * @param {() => boolean} isArmed whether keys drive the robot: then no letter is for anything else
   */
  constructor({ dialog, body, open, close, legend }, isArmed) {
    this.dialog = dialog;
    this.body = body;
    this.open = open;
    this.legend = legend;
    open.onclick = () => this.toggle();
    close.onclick = () => this.toggle();
    addEventListener("keydown", (event) => {
      if (event.key !== "?" || event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
      if (isArmed() || isText(event.target)) return;
      event.preventDefault();
      this.toggle();
    });
  }

  toggle() {
    const { dialog, open } = this;
    if (dialog.open) {
      dialog.close();
      open.focus();
    } else {
      this.write();
      // Not before all else: STOP and its keys stay reachable.
      dialog.show();
    }
  }

  /** Writes it in the language in use. */
  write() {
    const legend = document.createElement("ul");
    for (const row of this.legend.querySelectorAll("li")) legend.append(row.cloneNode(true));
    const states = list(Object.entries(SHAPES).map(([look, shape]) => [shapeSign(32, shape), say(`look_${look}`)]));
    const kinds = list(Object.values(KINDS).map(([word, shape]) => [shapeSign(20, shape), say(word)]));
    const marks = list(Object.entries(MARKS).map(([mark, shape]) => [shapeSign(20, shape), say(`mark_${mark}`)]));
    const colours = list(COLOURS.map((colour) => [colourSign(colour), say(`colour_${colour}`)]));
    /** @param {[string, string][]} all */
    const keys = (all) => list(all.map(([key, word]) => [keySign(key), say(word)]));
    this.body.replaceChildren(
      section("help_states", states), section("legend", legend), section("help_colours", colours), section("log", kinds), section("health", marks),
      section("help_keys", keys(PAGE_KEYS)), section("help_view_keys", keys(VIEW_KEYS)), section("help_map_keys", keys(MAP_KEYS)), section("help_drive_keys", keys(KEYS.wheels)), section("help_arm_keys", keys(KEYS.arm)),
    );
  }
}

/**
 * @param {string} word
 * @param {Element} content
 */
function section(word, content) {
  const element = document.createElement("section");
  const head = document.createElement("h3");
  head.textContent = say(word);
  element.append(head, content);
  return element;
}

/** @param {[Element, string][]} rows */
function list(rows) {
  const element = document.createElement("ul");
  for (const [sign, words] of rows) {
    const row = document.createElement("li");
    const text = document.createElement("span");
    text.textContent = words;
    row.append(sign, text);
    element.append(row);
  }
  return element;
}

/**
 * A shape in a square of so many units.
 *
 * @param {number} size
 * @param {string} shape
 */
function shapeSign(size, shape) {
  const sign = make("svg", { viewBox: `0 0 ${size} ${size}`, class: "state", "aria-hidden": "true" });
  make("path", { d: shape }, sign);
  return sign;
}

/** @param {string} colour */
function colourSign(colour) {
  const sign = document.createElement("i");
  sign.className = `colour ${colour}`;
  return sign;
}

/** @param {string} key */
function keySign(key) {
  const sign = document.createElement("kbd");
  sign.textContent = key;
  return sign;
}
