// What has happened, as sentences in the reader's language, and the last ten minutes as a table.

import { say } from "./words.js";
import { fill, item } from "./missions.js";
import { crossing, thought } from "./sentences.js";

export class Log {
  constructor(parts, robot) {
    this.parts = parts;
    this.robot = robot;
    parts.save.onclick = () => this.save();
  }

  draw(robot) {
    const wanted = this.parts.filter.value.toLowerCase();
    const lines = (robot?.events ?? []).map(line).filter((text) => text.toLowerCase().includes(wanted));
    fill(this.parts.entries, lines.slice(-200).reverse(), (text) => item(text));
  }

  save() {
    const past = this.robot()?.past ?? [];
    if (!past.length) return;
    const keys = Object.keys(past[0]).filter((key) => key !== "at" && key !== "wall");
    const rows = past.map((point) => [new Date(point.wall).toISOString(), ...keys.map((key) => point[key] ?? "")].join(","));
    const blob = new Blob([[`time,${keys.join(",")}`, ...rows, ""].join("\n")], { type: "text/csv" });
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(blob);
    anchor.download = `${this.robot().name}.csv`;
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
  }
}

/** One entry as a sentence with its time. */
function line({ at, kind, words, values }) {
  const time = new Date(at).toLocaleTimeString();
  if (kind === "thought") return `${time}  ${(values && thought(values)) ?? words.join(" ")}`;
  const [what, x, y, , product] = words;
  return `${time}  ${say(`event_${what}`, product, crossing(`${x},${y}`))}`;
}
