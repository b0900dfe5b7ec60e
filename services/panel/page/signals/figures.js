// The figures of one robot in the last ten minutes, as columns by time: what the station has kept, and then
// what this page hears. Times are in ms by the station's clock: a browser's may be wrong.

import { ask, why } from "../station/history.js";

/** @typedef {"line_error" | "left_duty" | "right_duty" | "distance_cm" | "battery" | "path_p50" | "path_p99" | "lost"} Key */
/** @typedef {{ at: number } & Record<Key, number | null>} Row */

/** How long they are kept, in ms; the station keeps as much at full rate. */
export const KEPT_MS = 600_000;
/** No line is drawn over a longer time without figures, in ms. The station's old ones are a second apart. */
export const GAP_MS = 1_500;
/** When the station is asked again if it has not answered, in ms. */
const AGAIN_MS = 5_000;
/** What the columns may hold above what is kept, in ms: they are cut that seldom. */
const SPARE_MS = 30_000;

/**
 * What is kept, and the column of the station's table that has it.
 *
 * @type {[Key, string][]}
 */
const HEADS = [
  ["line_error", "line_error_half_sensors"],
  ["left_duty", "left_duty_of_255"],
  ["right_duty", "right_duty_of_255"],
  ["distance_cm", "distance_cm"],
  ["battery", "battery_V"],
  ["path_p50", "path_p50_us"],
  ["path_p99", "path_p99_us"],
  ["lost", "lost_packets"],
];
/**
 * Nothing of it.
 *
 * @type {Record<Key, number | null>}
 */
const NOTHING = { line_error: null, left_duty: null, right_duty: null, distance_cm: null, battery: null, path_p50: null, path_p99: null, lost: null };
/**
 * What one of them is in the unit that is shown: whole sensors, and percent.
 *
 * @type {Partial<Record<Key, number>>}
 */
const SHOWN = { line_error: 1 / 2, left_duty: 100 / 255, right_duty: 100 / 255 };

/** Figures by time, the oldest first; `null` is not known. */
export class Columns {
  constructor() {
    /** @type {number[]} */
    this.at = [];
    /** @type {Record<Key | "lost_in_1s", (number | null)[]>} */
    this.of = { line_error: [], left_duty: [], right_duty: [], distance_cm: [], battery: [], path_p50: [], path_p99: [], lost: [], lost_in_1s: [] };
    /** The first row that is at most a second older than the last one. */
    this.second = 0;
  }

  /** @param {Row} row as the robot tells it */
  push(row) {
    const last = this.at.at(-1);
    if (last !== undefined && row.at <= last) return;
    if (last !== undefined && row.at - last > GAP_MS) this.put(last + 1, () => null);
    this.put(row.at, (key) => {
      const figure = row[key];
      return figure === null ? null : figure * (SHOWN[key] ?? 1);
    });
  }

  /**
   * @param {number} at
   * @param {(key: Key) => number | null} figure
   */
  put(at, figure) {
    this.at.push(at);
    for (const [key] of HEADS) this.of[key].push(figure(key));
    while (at - (this.at[this.second] ?? at) > 1_000) this.second += 1;
    this.of.lost_in_1s.push(increase(this.of.lost, this.second, this.at.length - 1));
  }

  /** Leaves out what is older, now and then. */
  cut() {
    const from = (this.at.at(-1) ?? 0) - KEPT_MS;
    if ((this.at[0] ?? from) >= from - SPARE_MS) return;
    const gone = this.at.findIndex((at) => at >= from);
    this.at.splice(0, gone);
    for (const column of Object.values(this.of)) column.splice(0, gone);
    this.second = Math.max(0, this.second - gone);
  }

  /**
   * How many packets were lost in each minute of the time that is kept, the last one last.
   *
   * @param {number} until
   * @returns {number[]}
   */
  lostByMinute(until) {
    /** @type {number[]} */
    const minutes = Array(KEPT_MS / 60_000).fill(0);
    this.at.forEach((at, row) => {
      const minute = minutes.length - 1 - Math.floor((until - at) / 60_000);
      const sum = minutes[minute];
      if (sum !== undefined) minutes[minute] = sum + (increase(this.of.lost, row - 1, row) ?? 0);
    });
    return minutes;
  }
}

/**
 * How much a count has grown from one row to another; null if it is not known. One that began anew has not.
 *
 * @param {(number | null)[]} counts
 * @param {number} first
 * @param {number} last
 */
function increase(counts, first, last) {
  const [before = null, after = null] = [counts[first], counts[last]];
  return before === null || after === null ? null : Math.max(0, after - before);
}

/** The figures of a robot that this page shows. */
export class Figures {
  /**
   * @param {import("../station/robot.js").Robot} robot
   * @param {Pick<import("../station/link.js").Link, "ahead">} link
   */
  constructor(robot, link) {
    this.robot = robot;
    this.link = link;
    this.columns = new Columns();
    /** How many states of all that the page has heard are in the columns. */
    this.taken = 0;
    /** Whether the station is asked, and when it is asked next, by this page's clock. */
    this.isAsked = false;
    this.next = 0;
    /**
     * The word for why what the station has kept is not here.
     *
     * @type {string | null}
     */
    this.why = null;
  }

  /**
   * Takes in what is new.
   *
   * @param {number} now by this page's clock
   */
  follow(now) {
    const { past, total } = this.robot;
    // The page keeps a minute: what it has forgotten meanwhile the station still has.
    if (total - this.taken > past.length) this.next = Math.min(this.next, now);
    if (now >= this.next && !this.isAsked) this.fetch();
    if (total > this.taken) this.hear(past.slice(-(total - this.taken)));
    this.columns.cut();
  }

  /**
   * Adds what the page has heard.
   *
   * @param {Row[]} rows with times by this page's clock
   */
  hear(rows) {
    this.taken = this.robot.total;
    for (const row of rows) this.columns.push({ ...row, at: row.at + this.link.ahead });
  }

  /** Fetches the last ten minutes from the station. */
  async fetch() {
    this.isAsked = true;
    try {
      const { body } = await ask("states.csv", { robot: this.robot.name });
      const columns = new Columns();
      if (body) for await (const row of table(body)) columns.push(row);
      this.columns = columns;
      this.hear(this.robot.past);
      this.why = null;
      this.next = Infinity;
    } catch (error) {
      this.why = why(error);
      // A station without a history will have none later.
      this.next = this.why === "no_history" ? Infinity : performance.now() + AGAIN_MS;
    } finally {
      this.isAsked = false;
    }
  }
}

/**
 * The rows of the station's table, as they come.
 *
 * @param {ReadableStream<Uint8Array>} body
 * @returns {AsyncGenerator<Row>}
 */
async function* table(body) {
  const [reader, decoder] = [body.getReader(), new TextDecoder()];
  let rest = "";
  /** @type {((line: string) => Row) | null} */
  let read = null;
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const lines = (rest + decoder.decode(value, { stream: true })).split("\n");
    rest = lines.pop() ?? "";
    for (const line of lines) {
      if (read) yield read(line);
      else read = rowsOf(line);
    }
  }
}

/**
 * What reads a line of the table that has this line of heads.
 *
 * @param {string} heads
 * @returns {(line: string) => Row}
 */
export function rowsOf(heads) {
  const names = heads.split(",");
  const places = HEADS.map(([key, head]) => ({ key, place: names.indexOf(head) }));
  return (line) => {
    // Texts stand in quotation marks where they have commas. No figure does.
    const cells = line.replace(/"[^"]*"/g, "").split(",");
    const row = { ...NOTHING, at: Number(cells[0]) * 1_000 };
    for (const { key, place } of places) row[key] = cells[place] ? Number(cells[place]) : null;
    return row;
  };
}
