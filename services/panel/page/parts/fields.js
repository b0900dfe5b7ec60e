// What is wrong in the fields of a form, in the reader's language and where the hand was. The browser would
// say it in its own language, and would let a field block that nobody sees.

import { say } from "../words/words.js";

/**
 * Has the page judge a form.
 *
 * @param {HTMLFormElement} form
 */
export function judge(form) {
  form.noValidate = true;
}

/**
 * The field of a form that has a name; `kind` is what it is: an input, a list, or several to choose one of.
 *
 * @template {Element | RadioNodeList} Kind
 * @param {HTMLFormElement} form
 * @param {string} name
 * @param {new () => Kind} kind
 * @returns {Kind}
 */
export function field(form, name, kind) {
  const found = form.elements.namedItem(name);
  if (found instanceof kind) return found;
  throw new Error(`the form #${form.id} has no such field as ${name}`);
}

/**
 * What is wrong with the first of these fields that cannot be; null if nothing is. What is disabled counts not.
 *
 * @param {Iterable<Element>} fields
 * @returns {string | null}
 */
export function wrong(fields) {
  const field = [...fields].find((field) => field instanceof HTMLInputElement && field.willValidate && !field.validity.valid);
  if (!(field instanceof HTMLInputElement)) return null;
  const name = field.getAttribute("aria-label") ?? field.closest("label")?.textContent?.trim() ?? field.name;
  return field.max ? say("field_range", name, field.min, field.max) : say("field_least", name, field.min);
}
