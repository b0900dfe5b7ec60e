// What this view is made of.

import { word } from "./said.js";

/**
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Element} parent
 * @param {Name} name
 * @param {string} [className]
 * @param {string} [text]
 * @returns {HTMLElementTagNameMap[Name]}
 */
export function element(parent, name, className = "", text = "") {
  const made = document.createElement(name);
  if (className) made.className = className;
  if (text) made.textContent = text;
  parent.append(made);
  return made;
}

/**
 * @param {Element} parent
 * @param {string} does the name of its word, and what it does
 * @param {(() => void) | null} press nothing: it sends its form
 * @param {string} [className]
 */
export function button(parent, does, press, className = "") {
  const made = element(parent, "button", className, word(does));
  made.type = press ? "button" : "submit";
  made.onclick = press;
  made.dataset.does = does;
  return made;
}

/**
 * A box or a choice with its words.
 *
 * @param {Element} parent
 * @param {HTMLInputElement} input
 * @param {string} text
 */
export function labelled(parent, input, text) {
  const label = element(parent, "label");
  label.append(input);
  element(label, "span", "", text);
}
