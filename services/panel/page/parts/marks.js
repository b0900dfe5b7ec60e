/** @import { Mark } from "../health/model.js" */

/**
 * The shape of each mark, in a square of 20.
 *
 * @type {Record<Mark, string>}
 */
export const MARKS = {
  good: "M10 2a8 8 0 1 0 0 16a8 8 0 1 0 0-16M6.5 10l2.5 2.5 4.5-5",
  bad: "M2 2h16v16H2zM7 7l6 6m0-6l-6 6",
  unknown: "M10 2a8 8 0 1 0 0 16a8 8 0 1 0 0-16",
};
