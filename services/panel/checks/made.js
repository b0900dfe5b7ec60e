// Gives the tests what the panel makes when it runs (src/page.rs): `setup/limits.js`, and the sentences that it adds to the
// words of each language.

import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const SENTENCES = new URL("../../../bus/orders/sentences.txt", import.meta.url);
/** The panel sends those of `lager-floor`. No test looks at them. */
const LIMITS = { squares: 20, leastSideCm: 20, mostSideCm: 100, goods: 50 };

/**
 * A name, and below it the sentence in English and in Swedish.
 *
 * @param {1 | 2} line
 */
function sentences(line) {
  const lines = readFileSync(SENTENCES, "utf8").split("\n").filter((line) => line && !line.startsWith("#"));
  const table = {};
  for (let i = 0; i + 2 < lines.length; i += 3) table[lines[i]] = lines[i + line].trim();
  return `export const SENTENCES = ${JSON.stringify(table)};\n`;
}

export function resolve(specifier, context, next) {
  return specifier.endsWith("/limits.js") ? { url: "page:limits", shortCircuit: true } : next(specifier, context);
}

export function load(url, context, next) {
  const module = (source) => ({ format: "module", source, shortCircuit: true });
  if (url === "page:limits") return module(`export const LIMITS = ${JSON.stringify(LIMITS)};\n`);
  const [, language] = url.match(/\/words\/(en|sv)\.js$/) ?? [];
  if (!language) return next(url, context);
  return module(readFileSync(fileURLToPath(url), "utf8") + sentences(language === "en" ? 1 : 2));
}
