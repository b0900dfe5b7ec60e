// The sentences of a commissioning. Their table is the robot's own (services/commission/sentences.txt); the panel sends it
// with this script (src/page.rs).

import { SENTENCES } from "./sentences.js";
import { reason } from "../words/sentences.js";
import { current } from "../words/words.js";

/**
 * The sentence of a name, with the values filled in; null if the table has no such name.
 *
 * @param {string} name
 * @param {Record<string, string | number>} values
 * @returns {string | null}
 */
export function sentence(name, values = {}) {
  const text = SENTENCES[current()][name];
  return text?.replace(/\{(\w+)\}/g, (_, key) => String(values[key] ?? "")) ?? null;
}

/**
 * A word of this view.
 *
 * @param {string} name
 * @param {Record<string, string | number>} values
 */
export const word = (name, values = {}) => sentence(`page_${name}`, values) ?? name;

/**
 * A code with its values, as a sentence: they stand in the order in which the English one has them first. A value may be
 * a code with values itself. What is no code of this table is one of the table of orders, or text.
 *
 * @param {string} code
 * @returns {string}
 */
export function told(code) {
  const [name = "", ...words] = code.split(" ");
  const english = SENTENCES.en[name];
  if (english === undefined) return reason(code);
  const keys = [...new Set([...english.matchAll(/\{(\w+)\}/g)].map(([, key = ""]) => key))];
  const last = words.splice(Math.max(keys.length - 1, 0)).join(" ");
  const values = [...words.map(plain), last].map((value) => inner(value));
  return sentence(name, Object.fromEntries(keys.map((key, at) => [key, values[at] ?? ""]))) ?? code;
}

/**
 * A field of a line, in which a code is one word.
 *
 * @param {string | undefined} field
 */
export const field = (field) => (field === undefined ? null : told(plain(field)));

/** @param {string} value */
const inner = (value) => (/^[a-z]+_/.test(value) ? told(value) : value);

/** @param {string} text */
function plain(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/**
 * The values of a code, such as `189` of `live_range 189`.
 *
 * @param {string | undefined} field
 * @returns {string[]}
 */
export const values = (field) => (field === undefined ? [] : plain(field).split(" ").slice(1));

/** The steps, in their order, as the table names them. */
export const steps = () => Object.keys(SENTENCES.en).filter((name) => name.startsWith("step_")).map((name) => name.slice("step_".length));

/**
 * What each step has found out, from the words of its line: how much, and then each step with a code.
 *
 * @param {string[]} words
 * @param {string} step
 */
export const found = ([, ...words], step) => words.flatMap((word, at) => (at % 2 && words[at - 1] === step ? [field(word) ?? ""] : []));

/**
 * The text of the description that was saved last, from the words of its lines: the number of each, how many, and it.
 *
 * @param {string[][]} lines
 */
export function saved(lines) {
  const last = lines.slice(Math.max(lines.findLastIndex(([number]) => number === "1"), 0));
  return last.map(([, , ...words]) => `${words.join(" ")}\n`).join("");
}
