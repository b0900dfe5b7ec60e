// What a robot thinks, what is wrong, what would end it and why something is not done, in the reader's language:
// sentences for the codes and values that robot, station and panel tell. The table comes from the panel
// (bus/orders/sentences.txt).

import { TABLE } from "./table.js";
import { current, decimal, say } from "./words.js";

/** The actions that take no words, each with its button: the names of the table that begin with `do_`. */
export const PLAIN = Object.keys(TABLE).filter((name) => name.startsWith("do_")).map((name) => name.slice("do_".length));

/** The sentence of a name, with the values filled in; null if the name is not known here. */
export function sentence(name, values = {}) {
  const text = TABLE[name]?.[current()];
  return text?.replace(/\{(\w+)\}/g, (_, key) => values[key] ?? "") ?? null;
}

/**
 * Why an answer is no: "lost" where there is no link, else a code with its values, in the order in which the English
 * sentence has them first. The last value is the rest, and may be a reason itself. Words that are no code are shown.
 */
export function reason(refused) {
  if (refused === "lost") return say("lost");
  const [code, ...words] = refused.split(" ");
  if (!TABLE[code]) return refused;
  const keys = [...new Set([...TABLE[code].en.matchAll(/\{(\w+)\}/g)].map(([, key]) => key))];
  const last = words.splice(keys.length - 1).join(" ");
  const values = [...words.map(decodeURIComponent), last];
  return sentence(code, Object.fromEntries(keys.map((key, at) => [key, told(key, values[at])])));
}

/** A value as it stands in its sentence. */
function told(key, value) {
  if (key === "why") return reason(value);
  if (key === "who") return called(value);
  return (key === "command" && sentence(`command_${value}`)) || value;
}

/** What a page is called: a name that a person chose, the one who reads this, or the number of a guest. */
export function called(name, me = null) {
  if (name === me) return sentence("called_you");
  const [, guest] = name.match(/^panel-(\d+)$/) ?? [];
  return guest ? sentence("called_guest", { number: guest }) : name === "panel" ? sentence("called_form") : name;
}

/** A crossing, from `2,1`. */
export const crossing = (text) => (text === undefined ? "" : `(${text.replace(",", ", ")})`);

/** What is wrong, from fields that begin with `failure`; null if nothing is. */
export function failure({ failure: kind, failure_node: node, failure_expected: expected, failure_seen: seen }) {
  return kind === undefined ? null : sentence(`failure_${kind}`, { node: crossing(node), expected, seen });
}

/** A thought from its values or from its reason; null if its kind is not known here. */
export function thought(fields) {
  if (fields.because) return reason(fields.because);
  const { kind, node, looks, joint, sides = 0, product, expected, seen, remedy } = fields;
  return sentence(kind === "order_waits" && seen === "0" ? "thought_order_waits_next" : `thought_${kind}`, {
    node: crossing(node), product, expected, seen,
    looks: sentence(`looks_${looks}`),
    joint: sentence(`joint_${joint}`),
    sides: sentence(`sides_${sides & 3}`),
    volts: decimal(seen / 10),
    failure: failure(fields),
    remedy: sentence(`remedy_${remedy}`),
  });
}
