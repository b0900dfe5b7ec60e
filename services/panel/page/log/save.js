// What the station keeps of the last day as a file: a table, or a recording.

/** @import { Query } from "../station/history.js" */
/** @import { Robot } from "../station/robot.js" */

import { SPANS_MS, entries } from "../time/kept.js";
import { mcap } from "./mcap.js";
import { ask, lines, why } from "../station/history.js";
import { put, say, span } from "../words/words.js";

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

export class Save {
  /**
   * @param {{ span: HTMLSelectElement, csv: HTMLButtonElement, mcap: HTMLButtonElement, said: HTMLElement }} parts
   * @param {() => Robot | null} robot
   * @param {() => number} until where the time ends that is saved, in ms since 1970
   */
  constructor(parts, robot, until) {
    this.parts = parts;
    this.robot = robot;
    this.until = until;
    this.isSaving = false;
    parts.span.replaceChildren(...SPANS_MS.map((ms) => new Option(span(ms), String(ms))));
    parts.csv.onclick = () => this.save("csv", "text/csv", table);
    parts.mcap.onclick = () => this.save("mcap", "application/octet-stream", recording);
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    this.parts.csv.disabled = this.parts.mcap.disabled = !robot || this.isSaving;
  }

  /**
   * Hands what the station keeps of the chosen time to the reader as a file.
   *
   * @param {string} ending
   * @param {string} type
   * @param {(query: Query) => Promise<BlobPart>} content
   */
  async save(ending, type, content) {
    const robot = this.robot();
    if (!robot || this.isSaving) return;
    this.isSaving = true;
    put(this.parts.said, "");
    const until = this.until();
    try {
      const anchor = document.createElement("a");
      const file = await content({ robot: robot.name, since: until - Number(this.parts.span.value), until });
      anchor.href = URL.createObjectURL(new Blob([file], { type }));
      anchor.download = `${robot.name}.${ending}`;
      anchor.click();
      setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
    } catch (error) {
      put(this.parts.said, say(why(error)));
    } finally {
      this.isSaving = false;
    }
  }
}

/** @param {Query} query */
const table = async (query) => (await ask("states.csv", query)).blob();

/**
 * The figures of the table, and what happened meanwhile.
 *
 * @param {Query} query
 */
async function recording(query) {
  const states = (await lines("states", query)).map(({ at_ms: at, ...value }) => ({ at, value }));
  const events = entries(await lines("events", query)).map(({ at, kind, words, values }) => ({ at, value: { kind, words, values } }));
  return mcap("lager panel", [
    { topic: "state", schema: STATE, messages: states },
    { topic: "events", schema: EVENT, messages: events },
  ]);
}
