// Lists of lines that are drawn again and again.

/**
 * An item of a list.
 * @param {string} text
 */
export function item(text) {
  const element = document.createElement("li");
  element.append(text);
  return element;
}

/**
 * Fills a list, if it has changed.
 * @param {HTMLElement} list
 * @param {string[]} lines
 * @param {(line: string) => HTMLElement} make
 */
export function fill(list, lines, make) {
  const shown = lines.join("\n");
  if (list.dataset.shown === shown) return;
  list.dataset.shown = shown;
  list.replaceChildren(...lines.map(make));
}
