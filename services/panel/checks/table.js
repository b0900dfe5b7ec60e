// Gives the tests `words/table.js`, which the panel makes of the table of sentences when it runs (src/page.rs).

import { readFileSync } from "node:fs";

const SENTENCES = new URL("../../../bus/orders/sentences.txt", import.meta.url);
/** The panel sends those of `lager-floor`. No test looks at them. */
const LIMITS = { squares: 20, leastSideCm: 20, mostSideCm: 100, goods: 50 };

/** A name, and below it the sentence in English and in Swedish. */
function script() {
  const lines = readFileSync(SENTENCES, "utf8").split("\n").filter((line) => line && !line.startsWith("#"));
  const table = {};
  for (let i = 0; i + 2 < lines.length; i += 3) table[lines[i]] = { en: lines[i + 1].trim(), sv: lines[i + 2].trim() };
  return `export const TABLE = ${JSON.stringify(table)};\nexport const LIMITS = ${JSON.stringify(LIMITS)};\n`;
}

export function resolve(specifier, context, next) {
  return specifier.endsWith("/table.js") ? { url: "page:table", shortCircuit: true } : next(specifier, context);
}

export function load(url, context, next) {
  return url === "page:table" ? { format: "module", source: script(), shortCircuit: true } : next(url, context);
}
