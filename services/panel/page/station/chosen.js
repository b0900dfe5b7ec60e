// Which robot the page shows. Its address says it (`/?r2`), so a page that is loaded anew, and whoever is
// sent the address, sees the same one; without a name it is the first that has connected.

/** @import { Link } from "./link.js" */

/**
 * The name in the address, or null.
 *
 * @returns {string | null}
 */
export function named() {
  return decodeURIComponent(location.search.slice(1)) || null;
}

/**
 * The robot that is shown; null if it is not here, whoever else is.
 *
 * @param {Pick<Link, "robots">} link
 */
export function shown(link) {
  const name = named();
  if (name !== null) return link.robots.get(name) ?? null;
  return link.robots.values().next().value ?? null;
}

/**
 * The robot of this name is shown from now on.
 *
 * @param {string} name
 */
export function choose(name) {
  history.replaceState(null, "", `?${encodeURIComponent(name)}`);
}
