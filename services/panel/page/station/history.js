// What the station keeps of the last day (services/panel/src/history.rs).

/** The station gives nothing of its history; the message is the word for why. */
class Refused extends Error {}

/**
 * What the station's history says.
 *
 * @param {string} what `states.csv`, `states`, `events`, `lines` or `moment`
 * @param {Record<string, string | number>} query which robot, and what of it
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
 * @param {string} what
 * @param {Record<string, string | number>} query
 * @returns {Promise<any[]>}
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
