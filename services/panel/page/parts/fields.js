// What is wrong in the fields of a form, in the reader's language and where the hand was. The browser would
// say it in its own language, and would let a field block that nobody sees.

import { say } from "../words/words.js";

/** Has the page judge a form. */
export function judge(form) {
  form.noValidate = true;
}

/** What is wrong with the first of these fields that cannot be; null if nothing is. What is disabled counts not. */
export function wrong(fields) {
  const field = [...fields].find((field) => field.willValidate && !field.validity.valid);
  if (!field) return null;
  const name = field.getAttribute("aria-label") ?? field.closest("label")?.textContent.trim() ?? field.name;
  return field.max ? say("field_range", name, field.min, field.max) : say("field_least", name, field.min);
}
