// What the station keeps of the last day (services/panel/src/history.rs).

/** @typedef {{ at_ms: number, line: string }} Told A line that the station has heard, and when, in ms since 1970. */
/** @typedef {{ at_ms: number } & Record<string, number | string | null>} Row A row of the table of states. */
/**
 * What it says in lines, and what each line is.
 *
 * @typedef {{ states: Row, events: Told, lines: Told, moment: Told }} Answers
 */
/** @typedef {Record<string, string | number>} Query Which robot, and what of it. */

/** The station gives nothing of its history; the message is the word for why. */
class Refused extends Error {}

/**
 * What the station's history says.
 *
 * @param {keyof Answers | "states.csv"} what
 * @param {Query} query
 * @returns {Promise<Response>}
 */
export async function ask(what, query) {
  // Names, words and numbers need no escapes.
  const words = Object.entries(query).map(([key, value]) => `${key}=${typeof value === "number" ? Math.round(value) : value}`);
  const answer = await fetch(new URL(`history/${what}?${words.join("&")}`, location.href), { cache: "no-store" });
  if (answer.ok) return answer;
  throw new Refused({ 404: "no_history", 503: "history_busy" }[answer.status] ?? "lost");
}

/**
 * The same, an object from each line.
 *
 * @template {keyof Answers} What
 * @param {What} what
 * @param {Query} query
 * @returns {Promise<Answers[What][]>}
 */
export async function lines(what, query) {
  const text = await (await ask(what, query)).text();
  return text.split("\n").filter(Boolean).map((line) => JSON.parse(line));
}

/**
 * The word for why nothing came.
 *
 * @param {unknown} error
 * @returns {string}
 */
export const why = (error) => (error instanceof Refused ? error.message : "lost");
