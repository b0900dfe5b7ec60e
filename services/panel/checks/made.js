// Gives the tests what the panel makes when it runs (src/page.rs): `setup/limits.js`, `commission/sentences.js`, and the
// sentences that it adds to the words of each language.

import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const SENTENCES = new URL("../../../bus/orders/sentences.txt", import.meta.url);
const COMMISSION = new URL("../../commission/sentences.txt", import.meta.url);
/** The panel sends those of `lager-floor`. No test looks at them. */
const LIMITS = { squares: 20, leastSideCm: 20, mostSideCm: 100, goods: 50 };

/**
 * A name, and below it the sentence in English and in Swedish.
 *
 * @param {1 | 2} line
 */
function table(line, from = SENTENCES) {
  const lines = readFileSync(from, "utf8").split("\n").filter((line) => line && !line.startsWith("#"));
  const sentences = {};
  for (let i = 0; i + 2 < lines.length; i += 3) sentences[lines[i]] = lines[i + line].trim();
  return sentences;
}

/** @param {object} sentences */
const exported = (sentences) => `export const SENTENCES = ${JSON.stringify(sentences)};\n`;

export function resolve(specifier, context, next) {
  if (specifier.endsWith("/limits.js")) return { url: "page:limits", shortCircuit: true };
  const isCommission = specifier === "./sentences.js" && context.parentURL?.includes("/commission/");
  return isCommission ? { url: "page:commission", shortCircuit: true } : next(specifier, context);
}

export function load(url, context, next) {
  const module = (source) => ({ format: "module", source, shortCircuit: true });
  if (url === "page:limits") return module(`export const LIMITS = ${JSON.stringify(LIMITS)};\n`);
  if (url === "page:commission") return module(exported({ en: table(1, COMMISSION), sv: table(2, COMMISSION) }));
  const [, language] = url.match(/\/words\/(en|sv)\.js$/) ?? [];
  if (!language) return next(url, context);
  return module(readFileSync(fileURLToPath(url), "utf8") + exported(table(language === "en" ? 1 : 2)));
}
