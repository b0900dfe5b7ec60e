// What a robot thinks, what is wrong, what would end it and why something is not done, in the reader's language:
// sentences for the codes and values that robot, station and panel tell. The table comes from the panel
// (bus/orders/sentences.txt).

/** @import { Fields } from "../station/robot.js" */

import { decimal, names, open, say } from "./words.js";

/** The actions that take no words, each with its button: the names of the table that begin with `do_`. */
export function plain() {
  return names().filter((name) => name.startsWith("do_")).map((name) => name.slice("do_".length));
}

/**
 * The sentence of a name, with the values filled in; null if the name is not known here.
 *
 * @param {string} name
 * @param {Record<string, string | number | null | undefined>} values
 * @returns {string | null}
 */
export function sentence(name, values = {}) {
  const text = open(name);
  return text?.replace(/\{(\w+)\}/g, (_, key) => String(values[key] ?? "")) ?? null;
}

/**
 * Why an answer is no: "lost" where there is no link, else a code with its values, in the order in which the
 * sentence has them first, in each language. The last value is the rest, and may be a reason itself. Words that are no code are shown.
 *
 * @param {string} refused
 * @returns {string}
 */
export function reason(refused) {
  if (refused === "lost") return say("lost");
  const [code = "", ...words] = refused.split(" ");
  const text = open(code);
  if (!text) return refused;
  const keys = [...new Set([...text.matchAll(/\{(\w+)\}/g)].map(([, key = ""]) => key))];
  const last = words.splice(keys.length - 1).join(" ");
  const values = [...words.map(decodeURIComponent), last];
  return sentence(code, Object.fromEntries(keys.map((key, at) => [key, told(key, values[at] ?? "")]))) ?? refused;
}

/**
 * A value as it stands in its sentence.
 *
 * @param {string} key
 * @param {string} value
 */
function told(key, value) {
  if (key === "why") return reason(value);
  if (key === "who") return called(value);
  return (key === "command" && sentence(`command_${value}`)) || value;
}

/**
 * What a person calls the parts of a robot by which people ask something of it.
 *
 * @type {Partial<Record<string, string>>}
 */
const PARTS = { comm: "by_comm", operator: "by_operator" };

/**
 * What somebody is called: a name that a person chose, the one who reads this, the number of a guest, or one of these
 * parts.
 *
 * @param {string} name
 * @param {string | null} me
 * @returns {string}
 */
export function called(name, me = null) {
  if (name === me) return sentence("called_you") ?? name;
  const [, guest] = name.match(/^panel-(\d+)$/) ?? [];
  const part = PARTS[name];
  if (part) return say(part);
  const known = guest ? sentence("called_guest", { number: guest }) : name === "panel" ? sentence("called_form") : null;
  return known ?? name;
}

/**
 * A crossing, from `2,1`.
 *
 * @param {string | undefined} text
 */
export const crossing = (text) => (text === undefined ? "" : `(${text.replace(",", ", ")})`);

/**
 * What is wrong, from fields that begin with `failure`; null if nothing is.
 *
 * @param {Fields} fields
 */
export function failure({ failure: kind, failure_node: node, failure_expected: expected, failure_seen: seen }) {
  return kind === undefined ? null : sentence(`failure_${kind}`, { node: crossing(node), expected, seen });
}

/**
 * A thought from its values or from its reason; null if its kind is not known here.
 *
 * @param {Fields} fields
 * @returns {string | null}
 */
export function thought(fields) {
  if (fields.because) return reason(fields.because);
  const { kind, node, looks, joint, sides, product, expected, seen, remedy } = fields;
  return sentence(kind === "order_waits" && seen === "0" ? "thought_order_waits_next" : `thought_${kind}`, {
    node: crossing(node), product, expected, seen,
    looks: sentence(`looks_${looks}`),
    joint: sentence(`joint_${joint}`),
    sides: sentence(`sides_${Number(sides ?? 0) & 3}`),
    volts: decimal(Number(seen) / 10),
    failure: failure(fields),
    remedy: sentence(`remedy_${remedy}`),
  });
}
