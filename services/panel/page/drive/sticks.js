// The sticks of the gamepad as they are bent, so that a driver sees what the page sees.

import { set } from "../parts/svg.js";

/** How far a stick's mark goes from its middle, in units of the drawing. */
const REACH = 8;

/**
 * Draws both sticks from the axes of a gamepad; nothing where there is none.
 *
 * @param {SVGElement} svg
 * @param {readonly number[] | null} axes
 */
export function drawSticks(svg, axes) {
  svg.toggleAttribute("hidden", axes === null);
  if (axes === null) return;
  svg.querySelectorAll(".stick").forEach((stick, place) => {
    const [x = 0, y = 0] = axes.slice(2 * place, 2 * place + 2);
    set(stick, "transform", `translate(${(x * REACH).toFixed(1)} ${(y * REACH).toFixed(1)})`);
  });
}
