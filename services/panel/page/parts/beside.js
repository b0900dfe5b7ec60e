// Puts a box over the map beside what it is about.

/** How far the box stays from the edges of the map, in pixels. */
const EDGE_PX = 4;

/**
 * Below the point where there is room, else above it.
 *
 * @param {HTMLElement} box
 * @param {[number, number]} point in pixels of the map
 * @param {{ width: number, height: number }} room the size of the map
 * @param {number} off how far it stays from the point, in pixels
 */
export function beside(box, [x, y], { width, height }, off) {
  const { offsetWidth: wide, offsetHeight: high } = box;
  const top = y + off + high + EDGE_PX < height ? y + off : Math.max(EDGE_PX, y - off - high);
  const left = Math.max(EDGE_PX, Math.min(width - wide - EDGE_PX, x - wide / 2));
  Object.assign(box.style, { left: `${Math.round(left)}px`, top: `${Math.round(top)}px` });
}
