// What has happened, as sentences in the reader's language; and what the station keeps of the last day as
// a file.

import { note } from "../station/link.js";
import { mcap } from "./mcap.js";
import { fill, item } from "../parts/list.js";
import { PLAIN, called, crossing, reason, sentence, thought } from "../words/sentences.js";
import { clock, current, put, say, span } from "../words/words.js";

/** How long ago what is saved may be, in ms. */
const SPANS_MS = [600_000, 3_600_000, 86_400_000];
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

export class Log {
  constructor(parts, robot) {
    this.parts = parts;
    this.robot = robot;
    parts.span.replaceChildren(...SPANS_MS.map((ms) => new Option(span(ms), ms)));
    parts.csv.onclick = () => this.save("csv", "text/csv", table);
    parts.mcap.onclick = () => this.save("mcap", "application/octet-stream", recording);
  }

  draw(robot) {
    const { filter, entries, csv, mcap } = this.parts;
    csv.disabled = mcap.disabled = !robot || this.saving;
    const events = robot?.events ?? [];
    const shown = [robot?.name, events.length, events.at(-1)?.at, filter.value, current()].join();
    // Nobody reads it while another view is open.
    if (entries.parentElement.hidden || this.shown === shown) return;
    this.shown = shown;
    const wanted = filter.value.toLowerCase();
    const lines = events.map(line).filter((text) => text.toLowerCase().includes(wanted));
    if (!lines.length) lines.push(say("log_empty"));
    fill(entries, lines.slice(-200).reverse(), (text) => item(text));
  }

  /** Hands what the station keeps of the chosen time to the reader as a file. */
  async save(ending, type, content) {
    const robot = this.robot();
    if (!robot || this.saving) return;
    this.saving = true;
    put(this.parts.said, "");
    const until = Date.now();
    const query = new URLSearchParams({ robot: robot.name, since: until - Number(this.parts.span.value), until });
    try {
      const anchor = document.createElement("a");
      anchor.href = URL.createObjectURL(new Blob([await content(query)], { type }));
      anchor.download = `${robot.name}.${ending}`;
      anchor.click();
      setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
    } catch (error) {
      put(this.parts.said, say(error instanceof Refused ? error.message : "lost"));
    } finally {
      this.saving = false;
    }
  }
}

/** The station gives nothing of its history; the message is the word for why. */
class Refused extends Error {}

/** What the station's history says to this. */
async function ask(what, query) {
  const answer = await fetch(new URL(`history/${what}?${query}`, location.href), { cache: "no-store" });
  if (answer.ok) return answer;
  throw new Refused({ 404: "no_history", 503: "history_busy" }[answer.status] ?? "lost");
}

/** The same, an object from each line. */
async function lines(what, query) {
  const text = await (await ask(what, query)).text();
  return text.split("\n").filter(Boolean).map((line) => JSON.parse(line));
}

const table = async (query) => (await ask("states.csv", query)).blob();

/** The figures of the table, and what happened meanwhile. */
async function recording(query) {
  const states = (await lines("states", query)).map(({ at_ms: at, ...value }) => ({ at, value }));
  const past = { thinks: null, events: [], happened: (entry) => past.events.push(entry) };
  for (const { at_ms: at, line } of await lines("events", query)) {
    const [word, ...rest] = line.split(" ");
    note(past, word, rest, at);
  }
  const events = past.events.map(({ at, kind, words, values }) => ({ at, value: { kind, words, values } }));
  return mcap("lager panel", [
    { topic: "state", schema: STATE, messages: states },
    { topic: "events", schema: EVENT, messages: events },
  ]);
}

/** One entry as a sentence with its time. */
function line({ at, kind, words, values }) {
  const time = clock(at);
  if (kind === "refused") return `${time}  ${say("blocked", reason(words[0]))}`;
  if (kind === "thought") return `${time}  ${say("thinks", (values && thought(values)) ?? words.join(" "))}`;
  if (kind === "asked") return `${time}  ${asked(words)}`;
  const [what, x, y, , product, ...more] = words;
  return `${time}  ${sentence(`event_${what}`, { product, node: crossing(`${x},${y}`), ...about(more) }) ?? what}`;
}

/** What a person calls the parts of a robot that stop it for him. */
const BY = { comm: "by_comm", operator: "by_operator" };

/** What an event is about besides its place and its goods. */
function about([first, second]) {
  const cause = (first !== "none" && sentence(`stop_cause_${first}`)) || "\u2013";
  return { cause, by: BY[second] ? say(BY[second]) : second, mode: say(`mode_${first}`), service: first };
}

/** Who at a page has asked for what. */
function asked([name, what, first, ...more]) {
  const who = called(name);
  const of = {
    mode: () => say(`mode_${first}`),
    order: () => more[0],
    resume: () => "",
    obstacle: () => crossing(more.slice(0, 2).join()),
    place: () => [crossing(`${first},${more[0]}`), sentence(`looks_${more[1]}`)].join(" "),
  };
  // What takes no words is called as its button is.
  if (PLAIN.includes(what)) return `${who}: ${[sentence(`do_${what}`), first].filter(Boolean).join(" ")}`;
  return say(`did_${what}${["obstacle", "pick"].includes(what) ? `_${first}` : ""}`, who, of[what]?.() ?? [first, ...more].join(" "));
}
