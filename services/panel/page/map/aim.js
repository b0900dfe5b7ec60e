// The hand on the map. A pointer, a finger or the keys pan and zoom it, and mean a thing on it: the tip says what that
// is and what a click or Enter does there. The same words stand for all of them (offers.js), so no tip is wrong.

/** @import { Point, Target } from "./grid.js" */
/** @import { Box } from "./labels.js" */
/** @import { WarehouseMap } from "./map.js" */
/** @import { Offer } from "./offers.js" */

import { again, meant, nearest, nextTo } from "./grid.js";
import { meets } from "./labels.js";
import { put, say } from "../words/words.js";

/** A press that moves further than this, in pixels, moves the map and means nothing. */
const STILL_PX = 5;
/** Two clicks on a thing within this time are one, in ms. */
const TWICE_MS = 400;
/** How far the tip stays from what it is about, in pixels. */
const OFF_PX = 16;
/** @type {Record<string, Point>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * What a drag does at a point of the floor in mm, at its end, and when it is over, whether it counts or not.
 *
 * @typedef {{ move: (point: Point) => void, end: () => void, cancel: () => void }} Grip
 */

export class Aim {
  /**
   * @param {WarehouseMap} map
   * @param {object} hand
   * @param {HTMLElement} hand.tip
   * @param {(target: Target | null) => Offer} hand.offers says what a thing is and does
   * @param {(target: Target | null) => Grip | null} hand.grip what a drag that begins on it does, if not to move the map
   * @param {() => boolean} hand.isArmed whether the arrows drive
   */
  constructor(map, { tip, offers, grip, isArmed }) {
    this.map = map;
    this.tip = tip;
    this.offers = offers;
    this.grip = grip;
    this.isArmed = isArmed;
    /**
     * What the pointer means now.
     *
     * @type {Target | null}
     */
    this.pointed = null;
    /**
     * What the keys mean.
     *
     * @type {Target | null}
     */
    this.chosen = null;
    /** Whether what was chosen may be elsewhere now, and whether it was chosen while the warehouse was set up. */
    this.isOld = false;
    this.wasPlacing = false;
    /** @type {{ id: string | null, at: number }} */
    this.clicked = { id: null, at: -Infinity };
    this.gestures(map.svg);
    map.svg.addEventListener("keydown", (event) => this.key(event));
    map.svg.addEventListener("focus", () => this.draw());
    map.svg.addEventListener("blur", () => this.draw());
  }

  /**
   * Drag to pan, wheel or two fingers to zoom; a click acts.
   *
   * @param {SVGElement} svg
   */
  gestures(svg) {
    /** @type {Point | null} */
    let from = null;
    let moved = 0;
    /** @type {Grip | null} */
    let gripped = null;
    /** @param {boolean} isDone */
    const letGo = (isDone) => {
      if (isDone && moved >= STILL_PX) gripped?.end();
      gripped?.cancel();
      gripped = null;
    };
    const { map } = this;
    /** @type {Map<number, PointerEvent>} */
    const fingers = new Map();
    const apart = () => {
      const [a, b] = [...fingers.values()];
      if (!a || !b) return { far: 0, clientX: 0, clientY: 0 };
      return { far: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY), clientX: (a.clientX + b.clientX) / 2, clientY: (a.clientY + b.clientY) / 2 };
    };
    svg.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, event);
      from = map.point(event);
      // A second finger zooms, so the first one meets nothing.
      moved = fingers.size > 1 ? Infinity : 0;
      letGo(false);
      if (fingers.size === 1) gripped = this.grip(this.at(event));
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", (event) => {
      if (!from) return this.point(event.pointerType === "touch" ? null : this.at(event));
      if (fingers.size === 2 && fingers.has(event.pointerId)) {
        const before = apart().far;
        fingers.set(event.pointerId, event);
        const now = apart();
        if (before > 0 && now.far > 0) map.zoom(before / now.far, map.point(now));
        return;
      }
      const [x, y] = map.point(event);
      moved += Math.hypot(event.movementX, event.movementY);
      if (moved < STILL_PX) return;
      this.point(null);
      if (gripped) gripped.move([x, -y]);
      else map.shift(from[0] - x, from[1] - y);
    });
    svg.addEventListener("pointerup", (event) => {
      fingers.delete(event.pointerId);
      if (from && moved < STILL_PX) this.click(this.at(event), event.timeStamp);
      letGo(true);
      from = null;
    });
    svg.addEventListener("pointercancel", (event) => {
      fingers.delete(event.pointerId);
      letGo(false);
      from = null;
    });
    svg.addEventListener("pointerleave", () => this.point(null));
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      map.zoom(event.deltaY > 0 ? 1.1 : 0.9, map.point(event));
    }, { passive: false });
  }

  /** @param {PointerEvent} event */
  at(event) {
    const [x, y] = this.map.point(event);
    return meant([x, -y], this.map.scene);
  }

  /** @param {Target | null} target */
  point(target) {
    if (this.pointed?.id === target?.id && this.pointed?.kind === target?.kind) return;
    this.pointed = target;
    this.draw();
  }

  /**
   * @param {Target | null} target
   * @param {number} time
   */
  click(target, time) {
    const id = target ? `${target.kind} ${target.id}` : "";
    if (this.clicked.id === id && time - this.clicked.at < TWICE_MS) return;
    // One that did nothing, or only lists goods, leaves the next one free.
    this.clicked = { id: this.act(target) && target?.kind !== "stack" ? id : null, at: time };
  }

  /**
   * Does what is offered, or says why nothing is; whether it did.
   *
   * @param {Target | null} target
   */
  act(target) {
    const { act, why } = this.offers(target);
    if (act) act();
    else this.map.tell(why ?? "");
    this.draw();
    return Boolean(act);
  }

  /**
   * Keys of the map itself, while the arrows do not drive.
   *
   * @param {KeyboardEvent} event
   */
  key(event) {
    if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey) return;
    const { map } = this;
    const arrow = ARROWS[event.key];
    if (arrow && this.isArmed()) return;
    if (arrow && event.shiftKey) map.shift((arrow[0] * map.view[2]) / 10, (-arrow[1] * map.view[3]) / 10);
    else if (arrow) this.step(arrow);
    else if (event.key === "+") map.zoom(0.8);
    else if (event.key === "-") map.zoom(1.25);
    else if (event.key === "Enter" && !event.repeat) this.act(this.current());
    else return;
    event.preventDefault();
  }

  /** What the keys mean: what was chosen last, at first what is nearest to the middle of the view. */
  current() {
    const { scene, view: [x, y, width, height] } = this.map;
    if (!scene.warehouse) return null;
    // What is set up and what is worked with are other things.
    if (!this.chosen || this.wasPlacing !== scene.isPlacing) this.chosen = nearest([x + width / 2, -y - height / 2], scene);
    else if (this.isOld) this.chosen = again(this.chosen, scene);
    this.isOld = false;
    this.wasPlacing = scene.isPlacing;
    return this.chosen;
  }

  /** @param {Point} arrow */
  step(arrow) {
    const before = this.current();
    if (!before) return;
    const next = nextTo(before.at, arrow, this.map.scene) ?? before;
    this.chosen = next;
    this.pointed = null;
    this.map.reveal(next.at);
    this.draw();
  }

  /** Another warehouse has other things, or the same ones elsewhere. */
  forget() {
    this.pointed = null;
    this.isOld = true;
  }

  /** The tip at what is meant: by the pointer or, while the map has the keys' focus, by them. */
  draw() {
    const { svg } = this.map;
    const hasKeys = svg.matches(":focus-visible");
    const target = this.pointed ?? (hasKeys ? this.current() : null);
    this.map.drawCross((hasKeys && this.current()?.at) || null);
    const { what, does, why } = target ? this.offers(target) : {};
    this.tip.toggleAttribute("hidden", !what);
    const [name, act] = this.tip.children;
    if (!target || !what || !name || !act) return;
    put(name, what);
    put(act, does ? say(this.pointed ? "tip_click" : "tip_enter", does) : why ?? "");
    this.place(this.map.pixels(target.at), this.map.robotPixels());
  }

  /**
   * Above what it is about, or where it covers no robot.
   *
   * @param {Point} at
   * @param {Box | null} robot
   */
  place([x, y], robot) {
    const { offsetWidth: wide, offsetHeight: high } = this.tip;
    const { width, height } = this.map.size;
    /** @type {(left: number, top: number) => Point} */
    const fit = (left, top) => [Math.max(4, Math.min(width - wide - 4, left)), Math.max(4, Math.min(height - high - 4, top))];
    const first = fit(x - wide / 2, y - OFF_PX - high);
    /** @type {Point[]} */
    const places = [first, fit(x - wide / 2, y + OFF_PX), fit(x + OFF_PX, y - high / 2), fit(x - OFF_PX - wide, y - high / 2), [4, 4]];
    /** @param {Point} place */
    const isFree = ([left, top]) => {
      /** @type {Box} */
      const box = [left, top, left + wide, top + high];
      return !meets(box, [x - 8, y - 8, x + 8, y + 8]) && !(robot && meets(box, robot));
    };
    const [left, top] = places.find(isFree) ?? first;
    Object.assign(this.tip.style, { left: `${Math.round(left)}px`, top: `${Math.round(top)}px` });
  }
}
