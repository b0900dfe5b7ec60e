// What each lane shows, and how its figures are written.

import { current } from "../words/words.js";

/**
 * @typedef {object} Lane
 * @property {string} word the word for what it shows; the strip at the page's foot has the same
 * @property {string} title the word that it is called by here
 * @property {{ key: import("./figures.js").Key | "lost_in_1s", word?: string, label?: string }[]} curves the second one is dashed
 * @property {string} unit
 * @property {number} decimals
 * @property {(least: number | null, most: number | null) => [number, number]} range
 */

/** @type {(from: number, to: number) => Lane["range"]} */
const fixed = (from, to) => () => [from, to];
/** @type {(least: number) => Lane["range"]} From 0 up to what there is, and to `least` at least. */
const upTo = (least) => (_, most) => [0, Math.max(least, (most ?? 0) * 1.05)];
/** @type {Lane["range"]} A volt or more, between halves. */
const volts = (least, most) => {
  const low = Math.floor((least ?? 11) * 2) / 2;
  return [low, Math.max(low + 1, Math.ceil((most ?? 12) * 2) / 2)];
};

/** @type {Lane[]} */
export const LANES = [
  { word: "line_error", title: "line_error", unit: "", decimals: 1, range: fixed(-5, 5), curves: [{ key: "line_error", word: "unit_sensors" }] },
  { word: "duty", title: "lane_duty", unit: "%", decimals: 0, range: fixed(0, 100), curves: [{ key: "left_duty", word: "left" }, { key: "right_duty", word: "right" }] },
  { word: "distance", title: "lane_distance", unit: "", decimals: 0, range: upTo(80), curves: [{ key: "distance_cm", label: "cm" }] },
  { word: "path", title: "lane_path", unit: "", decimals: 0, range: upTo(100), curves: [{ key: "path_p50", label: "p50 µs" }, { key: "path_p99", label: "p99 µs" }] },
  { word: "battery", title: "battery", unit: "", decimals: 1, range: volts, curves: [{ key: "battery", label: "V" }] },
  { word: "losses", title: "lane_lost", unit: "", decimals: 0, range: upTo(4), curves: [{ key: "lost_in_1s", word: "unit_lost" }] },
];

/**
 * A figure as the language writes it.
 *
 * @param {number} value
 * @param {number} [decimals]
 */
export function written(value, decimals = 0) {
  const text = value.toFixed(decimals).replace("-", "\u2212");
  return current() === "sv" ? text.replace(".", ",") : text;
}

/**
 * The figures at an axis: no more decimals than they need.
 *
 * @param {number[]} values
 */
export function ticks(values) {
  const decimals = values.some((value) => value % 1 !== 0) ? 1 : 0;
  // Room is left for five signs.
  if (Math.max(...values) >= 10_000) return values.map((value) => (value ? `${written(value / 1_000)}k` : "0"));
  return values.map((value) => written(value, decimals));
}

/**
 * The time of day at the station, in this browser's zone.
 *
 * @param {number} at in ms since 1970
 */
export function timeOfDay(at) {
  return new Date(at).toTimeString().slice(0, 8);
}

/**
 * A time in us as it is read best.
 *
 * @param {number} us
 */
export function micros(us) {
  if (us < 1_000) return `${written(us)} µs`;
  return us < 1_000_000 ? `${written(us / 1_000, us < 10_000 ? 1 : 0)} ms` : `${written(us / 1_000_000, 1)} s`;
}
