// Light, dark, or as the system has it. What is chosen is kept, and `early.js` brings it back before the first paint.

import { put, say } from "../words/words.js";

/** As the system has it. */
const SYSTEM = "system";
/** The themes in turn. */
const THEMES = [SYSTEM, "light", "dark"];
const root = document.documentElement;

const inUse = () => root.dataset.theme ?? SYSTEM;

/**
 * What the button says: the theme in use.
 *
 * @param {HTMLElement} button
 */
export function nameTheme(button) {
  put(button, say(`theme_${inUse()}`));
}

/**
 * The button changes to the next theme.
 *
 * @param {HTMLElement} button
 */
export function switchesTheme(button) {
  button.onclick = () => {
    const next = THEMES[(THEMES.findIndex((theme) => theme === inUse()) + 1) % THEMES.length] ?? SYSTEM;
    localStorage.setItem("theme", next);
    if (next === SYSTEM) delete root.dataset.theme;
    else root.dataset.theme = next;
    nameTheme(button);
  };
}
