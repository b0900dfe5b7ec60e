// Which element each id of the page's HTML is. So the type checker knows what `at("stop")` returns, and refuses an id
// that stands nowhere.

import { readFileSync } from "node:fs";

const page = new URL("../page/", import.meta.url);

/** The declarations for `parts/at.js`. */
export function elements() {
  const ids = new Map();
  for (const file of ["index.html", "screen.html"]) {
    const html = readFileSync(new URL(file, page), "utf8");
    for (const [, tag, id] of html.matchAll(/<([a-z][a-z0-9]*)\b[^>]*?\sid="([^"]+)"/g)) {
      const other = ids.get(id);
      // Both pages share scripts, so one id is one kind of element.
      if (other && other !== tag) throw new Error(`${file}: #${id} is <${tag}>, and <${other}> on the other page`);
      ids.set(id, tag);
    }
  }
  const lines = [...ids].map(([id, tag]) => `  "${id}": (HTMLElementTagNameMap & SVGElementTagNameMap)["${tag}"];\n`);
  return `// Made from the page's HTML by checks/ids.js.\ninterface Ids {\n${lines.join("")}}\n`;
}
