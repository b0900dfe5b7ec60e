// Finds what stands in the page's HTML.

/**
 * The element with an id. Its type comes from the HTML itself (checks/ids.js).
 *
 * @template {keyof Ids} Id
 * @param {Id} id
 * @returns {Ids[Id]}
 */
export function at(id) {
  /** @type {any} */
  const element = document.getElementById(id);
  return element;
}

/**
 * All elements of a kind that a selector finds.
 *
 * @template {Element} Kind
 * @param {string} selector
 * @param {new () => Kind} kind
 * @returns {Kind[]}
 */
export function every(selector, kind) {
  return [...document.querySelectorAll(selector)].flatMap((one) => (one instanceof kind ? [one] : []));
}
