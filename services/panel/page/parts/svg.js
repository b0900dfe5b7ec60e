// What every drawing of the page is made with.

/** @import { Pose } from "../station/robot.js" */

const NS = "http://www.w3.org/2000/svg";

/**
 * An element of SVG with attributes.
 *
 * @template {keyof SVGElementTagNameMap} Name
 * @param {Name} name
 * @param {Record<string, string | number>} attributes
 * @param {Element | null} parent
 * @param {string | number | null} text
 * @returns {SVGElementTagNameMap[Name]}
 */
export function make(name, attributes = {}, parent = null, text = null) {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  if (text !== null) element.textContent = String(text);
  parent?.append(element);
  return element;
}

/**
 * Changes an attribute only where it is another one: what is as it was is not styled and painted again. So does
 * `toggleAttribute` with attributes that are there or not, and `element.hidden = true` does not.
 *
 * @param {Element} element
 * @param {string} name
 * @param {string | number} value
 */
export function set(element, name, value) {
  if (element.getAttribute(name) !== String(value)) element.setAttribute(name, String(value));
}

/**
 * Puts a shape that looks up at 0 degrees to a pose; `grow` makes it larger than it is.
 *
 * @param {Element} group
 * @param {Pose} pose
 */
export function place(group, { x, y, heading }, grow = 1) {
  const larger = grow === 1 ? "" : ` scale(${grow.toFixed(2)})`;
  set(group, "transform", `translate(${x.toFixed(1)} ${(-y).toFixed(1)}) rotate(${heading.toFixed(1)})${larger}`);
}

/**
 * Lines across a box from its left edge up to the right, `gap` apart, as a path.
 *
 * @param {number} left
 * @param {number} top
 * @param {number} right
 * @param {number} bottom
 * @param {number} gap
 */
export function hatch(left, top, right, bottom, gap) {
  let path = "";
  for (let from = bottom + (right - left) - gap / 2; from > top; from -= gap) {
    const [low, high] = [Math.max(0, from - bottom), Math.min(right - left, from - top)];
    if (low < high) path += `M${left + low} ${from - low}L${left + high} ${from - high}`;
  }
  return path;
}
