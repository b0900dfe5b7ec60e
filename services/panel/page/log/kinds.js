// The kinds of what happens, each with its word and its shape, and every entry of the log as a sentence.

/** @import { Entry } from "../station/robot.js" */

import { called, crossing, plain, reason, sentence, thought } from "../words/sentences.js";
import { say } from "../words/words.js";

/** @typedef {"stop" | "help" | "goods" | "ways" | "persons" | "link" | "battery" | "settings"} Kind */
/**
 * The kinds in the order of the filter: the word, and the shape in a square of 20.
 *
 * @type {Record<Kind, [string, string]>}
 */
export const KINDS = {
  stop: ["log_stop", "M7 3h6l4 4v6l-4 4H7l-4-4V7zM6.5 10h7"],
  help: ["log_help", "M10 3l8 14H2zM10 8v4M10 14.5v.5"],
  goods: ["log_goods", "M3 6.5 10 3l7 3.5v7L10 17l-7-3.5zM3 6.5 10 10l7-3.5M10 10v7"],
  ways: ["log_ways", "M10 2v16M2 10h16M7.5 4.5 10 2l2.5 2.5M7.5 15.5 10 18l2.5-2.5M4.5 7.5 2 10l2.5 2.5M15.5 7.5 18 10l-2.5 2.5"],
  persons: ["log_persons", "M10 3.5a3 3 0 1 0 0 6a3 3 0 1 0 0-6M4 17q0-5 6-5t6 5"],
  link: ["log_link", "M3 16v-2M7.5 16v-5M12 16V8M16.5 16V4"],
  battery: ["log_battery", "M2 6.5h13v7H2zM15 8.5h2.5v3H15M5 9v2M8 9v2"],
  settings: ["log_settings", "M3 6h8M15 6h2M13 4v4M3 14h2M9 14h8M7 12v4"],
};

/** @type {Partial<Record<string, Kind>>} */
const OF_EVENT = {
  stopped: "stop", resumed: "stop", failed: "help", refused: "help", pickup_refused: "help", in_position: "goods", getting_item: "goods",
  item_delivered: "goods", mode: "persons", ended: "link", restarted: "link", link_lost: "link", link_back: "link",
};
/** @type {Partial<Record<string, Kind>>} */
const OF_WISH = {
  stop: "stop", resume: "stop", order: "goods", cancel: "goods", first: "goods", up: "goods", clear: "goods", back: "goods", picked: "goods",
  obstacle: "ways", commission: "settings", gains: "settings", calibrate: "settings", restart: "settings", pick: "settings", warehouse: "settings",
};
/**
 * How the kinds of thoughts begin; all others are of the way.
 *
 * @type {[RegExp, Kind][]}
 */
const OF_THOUGHT = [
  [/^(failed|pickup_refused|awaits|moves_alone)/, "help"],
  [/^(order|queue|goods|all_goods|fetching|picking|has_goods|delivered)/, "goods"],
  [/^(board|blind|sees_again|link|joint|parked_without_link)/, "link"],
  [/^(battery|parked)/, "battery"],
  [/^(map|picks|set_up)/, "settings"],
  [/^(started_by_reset|reset_)/, "stop"],
  [/^(no_such|put_|arm_|honks)/, "persons"],
];

/**
 * The kind of an entry of the log.
 *
 * @param {Entry} entry
 * @returns {Kind}
 */
export function kindOf({ kind, words: [first = "", second = ""], values }) {
  if (kind === "event") return OF_EVENT[first] ?? "ways";
  if (kind === "asked") return OF_WISH[second] ?? "persons";
  // A refusal answers a person; a thought without values is said by the station, of its link.
  if (kind === "refused" || values?.because) return "persons";
  const thought = values?.kind;
  if (!thought) return "link";
  return OF_THOUGHT.find(([begins]) => begins.test(thought))?.[1] ?? "ways";
}

/**
 * The crossing of an entry, as `2,1`; empty where it has none.
 *
 * @param {Entry} entry
 * @returns {string}
 */
export function placeOf({ kind, words, values }) {
  if (kind === "event") return words.slice(1, 3).join();
  if (kind === "asked" && words[1] === "obstacle") return words.slice(3, 5).join();
  if (kind === "asked" && words[1] === "place") return words.slice(2, 4).join();
  return (kind === "thought" && values?.node) || "";
}

/**
 * An entry as a sentence.
 *
 * @param {Entry} entry
 * @returns {string}
 */
export function told({ kind, words, values }) {
  if (kind === "refused") return say("blocked", reason(words[0] ?? ""));
  if (kind === "thought") return say("thinks", (values && thought(values)) ?? words.join(" "));
  if (kind === "asked") return asked(words);
  const [what = "", x, y, , product, ...more] = words;
  return sentence(`event_${what}`, { product, node: crossing(`${x},${y}`), ...about(more) }) ?? what;
}

/**
 * What an event is about besides its place and its goods.
 *
 * @param {string[]} words
 */
function about([first, second = ""]) {
  const cause = (first !== "none" && sentence(`stop_cause_${first}`)) || "\u2013";
  return { cause, by: called(second), mode: say(`mode_${first}`), service: first };
}

/**
 * Who has asked for what, at a page or in a terminal.
 *
 * @param {string[]} words
 */
function asked([name = "", what = "", first = "", ...more]) {
  const who = called(name);
  /** @type {Partial<Record<string, () => string | undefined>>} */
  const of = {
    mode: () => say(`mode_${first}`),
    order: () => more[0],
    resume: () => "",
    drive: () => "",
    arm: () => "",
    obstacle: () => crossing(more.slice(0, 2).join()),
    restart: () => say(`board_${first}`),
    place: () => [crossing(`${first},${more[0]}`), sentence(`looks_${more[1]}`)].join(" "),
  };
  // What takes no words is called as its button is.
  if (plain().includes(what)) return `${who}: ${[sentence(`do_${what}`), first].filter(Boolean).join(" ")}`;
  return say(`did_${what}${["commission", "obstacle", "pick"].includes(what) ? `_${first}` : ""}`, who, of[what]?.() ?? [first, ...more].join(" "));
}
