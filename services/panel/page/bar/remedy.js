// Beside the sentence that names a remedy stands a button that does it, or shows where it is done.

/** @import { Face } from "./face.js" */

import { put } from "../words/words.js";

/**
 * The control of this page that ends what is wrong, by the name of the remedy.
 *
 * @type {Record<string, string>}
 */
const REMEDIES = { reset: "where-ask", charge: "where-ask", hand: "picked", put_back: "do-back", arm: "tab-drive", calibrate: "tab-line", map: "tab-setup", describe: "commission-open", reload: "reload" };

/**
 * Has a button do what helps, or hides it where this page has nothing that does.
 *
 * @param {HTMLButtonElement} button
 * @param {Face} face
 * @param {(() => void) | null} choose brings the robot into view first, if it is another one
 */
export function drawRemedy(button, { remedy }, choose = null) {
  const control = document.getElementById((remedy && REMEDIES[remedy]) || "");
  button.toggleAttribute("hidden", !(control instanceof HTMLButtonElement));
  if (!(control instanceof HTMLButtonElement)) return;
  put(button, control.textContent);
  button.toggleAttribute("disabled", !choose && control.disabled);
  button.onclick = () => {
    choose?.();
    control.click();
  };
}
