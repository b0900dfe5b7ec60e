// That nothing of the page is dead: each script is loaded, each name that one exports is used, each style meets
// something, and each id is there for somebody.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { posix } from "node:path";
import { test } from "node:test";

const page = new URL("../page/", import.meta.url);
const names = readdirSync(page, { recursive: true }).map((name) => name.replaceAll("\\", "/")).filter((name) => /\.\w+$/.test(name)).sort();
const text = new Map(names.map((name) => [name, readFileSync(new URL(name, page), "utf8")]));
const all = (ending) => names.filter((name) => name.endsWith(ending));
/** What others have written is taken as it is. */
const ours = (ending) => all(ending).filter((name) => !name.startsWith("vendor/"));
const without = (source, comment) => source.replace(comment, "");
const script = (name) => without(text.get(name), /^ *\/\*\*[\s\S]*?\*\/$|^ *\/\/.*$/gm);
/** A language's words: `words.js` fetches those in use. */
const isLanguage = (name) => /^words\/..\.js$/.test(name);
const IMPORT = /(?:import \{ ([^}]*) \} from |import\()"([^"]+)"/g;

/** The imports of a script: the module, and the names; none where it is loaded later. */
function imports(name, source = script(name)) {
  return [...source.matchAll(IMPORT)].map(([, wanted = "", from]) => ({ from: posix.join(posix.dirname(name), from.split("?")[0]), wanted: wanted.split(",").map((one) => one.trim()).filter(Boolean) }));
}

test("each script is loaded by a page", () => {
  const entries = all(".html").flatMap((name) => [...text.get(name).matchAll(/<script[^>]* src="([^"]+)"/g)].map(([, from]) => from));
  const loaded = new Set();
  const load = (name) => {
    if (loaded.has(name) || !text.has(name)) return;
    loaded.add(name);
    for (const { from } of imports(name)) load(from);
  };
  entries.forEach(load);
  assert.deepEqual(all(".js").filter((name) => !loaded.has(name) && !isLanguage(name)), []);
});

test("each import is there, and each name that is exported is imported by somebody", () => {
  const exported = new Map(ours(".js").map((name) => [name, [...script(name).matchAll(/^export (?:async )?(?:const|function|class) (\w+)/gm)].map(([, one]) => one)]));
  // What only a test looks at is there for it.
  const tests = readdirSync(new URL(".", import.meta.url)).filter((name) => name.endsWith(".test.js"));
  const looked = tests.flatMap((name) => imports(`../checks/${name}`, readFileSync(new URL(name, import.meta.url), "utf8")).map(({ from, wanted }) => ({ from: from.replace("../page/", ""), wanted })));
  const used = new Map();
  for (const { from, wanted } of [...all(".js").flatMap((name) => imports(name)), ...looked]) used.set(from, [...(used.get(from) ?? []), ...wanted]);
  for (const name of ours(".js")) {
    for (const { from, wanted } of imports(name)) {
      if (["setup/limits.js", "commission/sentences.js"].includes(from) || from.startsWith("vendor/")) continue;
      assert.deepEqual(wanted.filter((one) => !exported.get(from)?.includes(one)), [], `${name} imports from ${from}`);
    }
  }
  const dead = [...exported].flatMap(([name, ones]) => ones.filter((one) => !used.get(name)?.includes(one)).map((one) => `${name}: ${one}`));
  // The script that is fetched later is used as a whole.
  const later = new Set(all(".js").flatMap((name) => imports(name).filter(({ wanted }) => !wanted.length).map(({ from }) => from)));
  assert.deepEqual(dead.filter((one) => !later.has(one.split(":")[0]) && !isLanguage(one.split(":")[0])), []);
});

/** Everything that may name a class or an id, but for the styles: also the page that answers a form. */
const html = [...all(".html").map((name) => text.get(name)), readFileSync(new URL("../src/stop.rs", import.meta.url), "utf8")].join("\n");
const written = [html, ...all(".js").filter((name) => !isLanguage(name)).map(script)].join("\n");
/** The words of what is quoted, in HTML by attributes. */
const words = new Set([...written.matchAll(/"([^"\n]*)"|`([^`]*)`/g)].flatMap(([, one, other]) => (one ?? other).match(/[A-Za-z_][\w-]*/g) ?? []));
const styles = all(".css").map((name) => ({ name, sheet: without(text.get(name), /\/\*[\s\S]*?\*\//g) }));

test("each class and id in a style is that of something", () => {
  for (const { name, sheet } of styles) {
    if (name.startsWith("vendor/")) continue;
    // What stands before a brace, at the head of a rule or of rules in a media query.
    const selectors = [...sheet.matchAll(/([^{};]*)\{/g)].map(([, selector]) => selector).filter((selector) => !selector.trim().startsWith("@"));
    const wanted = new Set(selectors.flatMap((selector) => selector.replace(/"[^"]*"/g, "").match(/(?<=[.#])[A-Za-z_][\w-]*/g) ?? []));
    assert.deepEqual([...wanted].filter((one) => !words.has(one)), [], name);
  }
});

test("each colour and size that a style defines is used, and each that is used is defined", () => {
  const sheets = styles.map(({ sheet }) => sheet).join("\n");
  const defined = new Set([...sheets.matchAll(/(--[\w-]+)\s*:/g)].map(([, name]) => name));
  for (const [, name] of written.matchAll(/setProperty\("(--[\w-]+)"/g)) defined.add(name);
  const used = new Set([...`${sheets}\n${written}`.matchAll(/(?:var\(|getPropertyValue\(")(--[\w-]+)/g)].map(([, name]) => name));
  assert.deepEqual([...used].filter((name) => !defined.has(name)), [], "used and not defined");
  assert.deepEqual([...defined].filter((name) => !used.has(name)), [], "defined and not used");
});

test("each id in the page is there for somebody, and stands there once", () => {
  const everything = [written, ...styles.map(({ sheet }) => sheet)].join("\n");
  for (const name of all(".html")) {
    const ids = [...text.get(name).matchAll(/\sid="([^"]+)"/g)].map(([, id]) => id);
    assert.deepEqual(ids.filter((id, at) => ids.indexOf(id) !== at), [], `${name}: twice`);
    const elsewhere = everything.replaceAll(/\sid="[^"]+"/g, "");
    assert.deepEqual(ids.filter((id) => !new RegExp(`(?<![\\w-])${id}(?![\\w-])`).test(elsewhere)), [], `${name}: for nobody`);
  }
});

test("a comment has lines of its own, so that it is not sent", () => {
  for (const name of ours(".js")) {
    const lines = text.get(name).split("\n");
    const within = lines.filter((line) => /\S.*(\/\*| \/\/ )/.test(line) && !/^\s*(\/\/|\/?\*)/.test(line));
    assert.deepEqual(within, [], name);
    assert.doesNotMatch(script(name), /\/\*\*|^\s*\* /m, name);
  }
});
