// The language of the page: its words and its sentences. Each language is a script of its own
// (`en.js`, `sv.js`), and only the one in use is fetched.

import { retried } from "../parts/retried.js";

/**
 * What a language's script has. The sentences are those of bus/orders/sentences.txt.
 *
 * @typedef {{ WORDS: Record<string, string>, SENTENCES: Record<string, string> }} Spoken
 */

/** @type {Spoken} */
let spoken = { WORDS: {}, SENTENCES: {} };
/** @type {(language: string, query: string) => Promise<Spoken>} */
const fetches = (language, query) => import(new URL(`words/${language}.js${query}`, document.baseURI).href);
const languages = {
  en: retried((query) => fetches("en", query)),
  sv: retried((query) => fetches("sv", query)),
};

/**
 * The language in use. `early.js` has chosen it.
 *
 * @returns {"en" | "sv"}
 */
export function current() {
  return document.documentElement.dataset.language === "sv" ? "sv" : "en";
}

/** Fetches a language and uses it. Nothing changes if it cannot be had. */
export async function speak(language = current()) {
  spoken = await languages[language]();
  const root = document.documentElement;
  root.dataset.language = root.lang = language;
}

/** Changes to the other language. */
export async function change() {
  await speak(current() === "sv" ? "en" : "sv");
  localStorage.setItem("language", current());
}

/**
 * A sentence of the table, with its values left open.
 *
 * @param {string} name
 * @returns {string | undefined}
 */
export function open(name) {
  return spoken.SENTENCES[name];
}

/** The names of all sentences. */
export function names() {
  return Object.keys(spoken.SENTENCES);
}

/** @typedef {[string, ...(string | number | null | undefined)[]]} Words A key of this table, and its values. */

/**
 * A word or sentence; {0} and so on are filled in.
 *
 * @param {string} key
 * @param {(string | number | null | undefined)[]} values
 * @returns {string}
 */
export function say(key, ...values) {
  const text = spoken.WORDS[key] ?? open(key) ?? key;
  return text.replace(/\{(\d)\}/g, (_, index) => String(values[index] ?? ""));
}

/**
 * A number with one decimal, as the language writes it.
 *
 * @param {number} value
 */
export function decimal(value) {
  const text = value.toFixed(1);
  return current() === "sv" ? text.replace(".", ",") : text;
}

/**
 * The time of day of a moment in ms since 1970.
 *
 * @param {number} at
 */
export function clock(at) {
  return new Date(at).toLocaleTimeString(current(), { hourCycle: "h23", hour: "2-digit", minute: "2-digit", second: "2-digit" });
}

/**
 * A time in ms, in words.
 *
 * @param {number} ms
 */
export function span(ms) {
  if (ms < 1_000) return `${Math.max(0, Math.round(ms))} ms`;
  if (ms < 60_000) return `${decimal(ms / 1_000)} s`;
  if (ms < 3_600_000) return `${Math.floor(ms / 60_000)} min`;
  return `${Math.floor(ms / 3_600_000)} h`;
}

/**
 * A time in ms as minutes and seconds, such as 1:05, or as seconds below a minute.
 *
 * @param {number} ms
 */
export function minutes(ms) {
  const all = Math.max(0, Math.round(ms / 1_000));
  const [hours, rest, seconds] = [Math.floor(all / 3_600), Math.floor((all % 3_600) / 60), all % 60];
  if (all < 60) return `${seconds} s`;
  const two = [rest, seconds].map((part) => String(part).padStart(2, "0"));
  return hours ? `${hours}:${two.join(":")}` : `${rest}:${two[1]}`;
}

/**
 * Fills in the words that stand in the page itself.
 *
 * @param {ParentNode} part
 */
export function translate(part = document) {
  /** @param {string} name */
  const all = (name) => [...part.querySelectorAll(`[${name}]`)].map((element) => ({ element, words: say(element.getAttribute(name) ?? "") }));
  for (const { element, words } of all("data-word")) element.textContent = words;
  for (const { element, words } of all("data-label")) {
    element.setAttribute("aria-label", words);
    if (element.matches("input[type=search], #name")) element.setAttribute("placeholder", words);
  }
  for (const { element, words } of all("data-title")) {
    element.setAttribute("title", words);
    element.setAttribute("aria-label", words);
  }
}

/**
 * Changes a text only where it is another one: a live region would say it again.
 *
 * @param {Element} element
 * @param {string} text
 */
export function put(element, text) {
  if (element.textContent === text) return;
  const { firstChild: only } = element;
  // A text that stays in its place costs a browser less than another one in its place.
  if (text && only?.nodeName === "#text" && !only.nextSibling) only.nodeValue = text;
  else element.textContent = text;
}
