// What the station keeps of the last day as a file: a table, or a recording.

/** @import { Query } from "../station/history.js" */
/** @import { Robot } from "../station/robot.js" */

import { SPANS_MS } from "../time/kept.js";
import { ask, why } from "../station/history.js";
import { retried } from "../parts/retried.js";
import { put, say, span } from "../words/words.js";

export class Save {
  /**
   * @param {{ span: HTMLSelectElement, csv: HTMLButtonElement, mcap: HTMLButtonElement, said: HTMLElement }} parts
   * @param {() => Robot | null} robot
   * @param {() => number} until where the time ends that is saved, in ms since 1970
   * @param {(query: string) => Promise<{ recording: (query: Query) => Promise<BlobPart> }>} fetches the script that makes recordings (`retried`)
   */
  constructor(parts, robot, until, fetches) {
    this.parts = parts;
    this.robot = robot;
    this.until = until;
    this.isSaving = false;
    const script = retried(fetches);
    parts.span.replaceChildren(...SPANS_MS.map((ms) => new Option(span(ms), String(ms))));
    parts.csv.onclick = () => this.save("csv", "text/csv", table);
    parts.mcap.onclick = () => this.save("mcap", "application/octet-stream", async (query) => (await script()).recording(query));
  }

  /** @param {Robot | null} robot */
  draw(robot) {
    for (const button of [this.parts.csv, this.parts.mcap]) button.toggleAttribute("disabled", !robot || this.isSaving);
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
