// What the station keeps of a time as a recording. A script of its own: it is fetched when somebody saves one.

/** @import { Query } from "../station/history.js" */

import { lines } from "../station/history.js";
import { entries } from "../time/kept.js";
import { mcap } from "./mcap.js";

/** What a recording has of one moment, by the names of the table's columns. */
const STATE = { title: "lager.panel.State", type: "object", additionalProperties: { type: ["number", "string", "null"] } };
/** What a recording has of what happened: the words of the station, and a thought's values. */
const EVENT = {
  title: "lager.panel.Event",
  type: "object",
  required: ["kind", "words", "values"],
  properties: {
    kind: { enum: ["event", "thought", "asked"] },
    words: { type: "array", items: { type: "string" } },
    values: { type: ["object", "null"], additionalProperties: { type: "string" } },
  },
};

/**
 * The figures of the table, and what happened meanwhile.
 *
 * @param {Query} query
 */
export async function recording(query) {
  const states = (await lines("states", query)).map(({ at_ms: at, ...value }) => ({ at, value }));
  const events = entries(await lines("events", query)).map(({ at, kind, words, values }) => ({ at, value: { kind, words, values } }));
  return mcap("lager panel", [
    { topic: "state", schema: STATE, messages: states },
    { topic: "events", schema: EVENT, messages: events },
  ]);
}
