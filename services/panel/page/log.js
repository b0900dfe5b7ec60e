// What has happened, as sentences in the reader's language, and what the page has seen of the last ten minutes as a file.

import { clock, current, put, say, span } from "./words.js";
import { mcap } from "./mcap.js";
import { fill, item } from "./missions.js";
import { PLAIN, called, crossing, reason, sentence, thought } from "./sentences.js";

/** How long ago what is saved may be, in ms. */
const KEPT_MS = 600_000;
/** What a recording has of one moment, as strips and trail show it. */
const STATE = { title: "lager.panel.State", type: "object", additionalProperties: { type: ["number", "string", "null"] } };
/** What a recording has of what happened: the words of the station, a thought's values, why not. */
const EVENT = {
  title: "lager.panel.Event",
  type: "object",
  required: ["kind", "words", "values"],
  properties: {
    kind: { enum: ["event", "thought", "refused", "asked"] },
    words: { type: "array", items: { type: "string" } },
    values: { type: ["object", "null"], additionalProperties: { type: "string" } },
  },
};

export class Log {
  constructor(parts, robot) {
    this.parts = parts;
    this.robot = robot;
    parts.csv.onclick = () => this.save("csv", "text/csv", table);
    parts.mcap.onclick = () => this.save("mcap", "application/octet-stream", recording);
  }

  draw(robot) {
    const { filter, entries, csv, mcap } = this.parts;
    csv.disabled = mcap.disabled = !robot?.past.length;
    // No page knows more than it has seen.
    const seen = robot?.past.length ? span(robot.past.at(-1).at - robot.past[0].at) : "";
    put(csv, say("save_csv", seen));
    put(mcap, say("save_mcap", seen));
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

  /** Hands what this page has seen, ten minutes at most, to the reader as a file. */
  save(ending, type, content) {
    const robot = this.robot();
    if (!robot?.past.length) return;
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(new Blob([content(robot)], { type }));
    anchor.download = `${robot.name}.${ending}`;
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
  }
}

/** The figures of each moment as lines with commas. */
function table({ past }) {
  const keys = Object.keys(figures(past[0]));
  const rows = past.map((point) => [new Date(point.wall).toISOString(), ...Object.values(figures(point)).map((value) => cell(value ?? ""))].join(","));
  return [`time,${keys.join(",")}`, ...rows, ""].join("\n");
}

/** Rows of numbers have commas of their own. */
const cell = (value) => (String(value).includes(",") ? `"${value}"` : value);

/** The same figures, and what happened meanwhile. */
function recording({ past, events }) {
  const states = past.map((point) => ({ at: point.wall, value: figures(point) }));
  const recent = events.filter(({ at }) => at > Date.now() - KEPT_MS);
  const happened = recent.map(({ at, kind, words, values }) => ({ at, value: { kind, words, values } }));
  return mcap("lager panel", [
    { topic: "state", schema: STATE, messages: states },
    { topic: "events", schema: EVENT, messages: happened },
  ]);
}

/** The names in a file of what has a unit: "left_duty" is of 255, "line_error" in half sensors. */
const UNITS = {
  x: "x_mm", y: "y_mm", line_error: "line_error_half_sensors", left_duty: "left_duty_of_255", right_duty: "right_duty_of_255",
  battery: "battery_V", path_p50: "path_p50_us", path_p99: "path_p99_us", lost: "lost_packets", servos: "servos_of_1023", loads: "loads_of_1023",
};

function figures({ at, wall, ...figures }) {
  return Object.fromEntries(Object.entries(figures).map(([key, value]) => [UNITS[key] ?? key, value]));
}

/** One entry as a sentence with its time. */
function line({ at, kind, words, values }) {
  const time = clock(at);
  if (kind === "refused") return `${time}  ${say("blocked", reason(words[0]))}`;
  if (kind === "thought") return `${time}  ${(values && thought(values)) ?? words.join(" ")}`;
  if (kind === "asked") return `${time}  ${asked(words)}`;
  const [what, x, y, , product, ...more] = words;
  return `${time}  ${say(`event_${what}`, product, crossing(`${x},${y}`), ...about(what, more))}`;
}

/** What a person calls the parts of a robot that stop it for him. */
const BY = { comm: "by_comm", operator: "by_operator" };

/** What an event is about besides its place and its goods. */
function about(what, [first, second]) {
  if (what === "stopped") return [(first !== "none" && sentence(`stop_cause_${first}`)) || "\u2013", BY[second] ? say(BY[second]) : second];
  if (what === "mode") return [say(`mode_${first}`)];
  return [first];
}

/** Who at a page has asked for what. */
function asked([name, what, first, ...more]) {
  const who = called(name);
  const of = { mode: () => say(`mode_${first}`), order: () => more[0], resume: () => "", obstacle: () => more.slice(0, 2).join(", ") };
  // What takes no words is called as its button is.
  if (PLAIN.includes(what)) return `${who}: ${[sentence(`do_${what}`), first].filter(Boolean).join(" ")}`;
  return say(`did_${what}${what === "obstacle" ? `_${first}` : ""}`, who, of[what]?.() ?? [first, ...more].join(" "));
}
