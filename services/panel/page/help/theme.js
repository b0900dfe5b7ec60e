// Light, dark, or as the system has it. What is chosen is kept, and `early.js` brings it back before the first paint.

import { put, say } from "../words/words.js";

/** The themes in turn; the first is the system's. */
const THEMES = ["system", "light", "dark"];
const root = document.documentElement;

const inUse = () => root.dataset.theme ?? THEMES[0];

/** What the button says: the theme in use. */
export function nameTheme(button) {
  put(button, say(`theme_${inUse()}`));
}

/** The button changes to the next theme. */
export function switchesTheme(button) {
  button.onclick = () => {
    const next = THEMES[(THEMES.indexOf(inUse()) + 1) % THEMES.length];
    localStorage.setItem("theme", next);
    if (next === THEMES[0]) delete root.dataset.theme;
    else root.dataset.theme = next;
    nameTheme(button);
  };
}
