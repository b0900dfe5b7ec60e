// Words and sentences, in both languages.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { afterEach, test } from "node:test";
import { runInNewContext } from "node:vm";
import { called, crossing, failure, reason, sentence, thought } from "../page/words/sentences.js";
import { decimal, open, names, say, span, speak } from "../page/words/words.js";

const inSwedish = async (act) => {
  await speak("sv");
  return act();
};
afterEach(() => speak("en"));

test("a word has its values filled in, in the language in use", async () => {
  assert.equal(say("fetches", 7), "fetches 7");
  assert.equal(await inSwedish(() => say("fetches", 7)), "hämtar 7");
  await speak("en");
  assert.equal(say("side_limits", 20, 5, 100), "the robot drives in squares of 20 to 100 cm; these are 5 cm");
  assert.equal(say("fetches"), "fetches ");
});

test("a sentence of the table is a word, too, and what stands nowhere is shown as it is", () => {
  assert.equal(say("late", 3), open("late"));
  assert.equal(say("no such word"), "no such word");
  assert.equal(sentence("no such word"), null);
  assert.equal(sentence("late_answer", { text: "stop", ms: 0 }), "stop: came 0 ms late; give it anew");
});

test("the language is the one chosen before, or else the browser's, and its words are fetched at once", () => {
  const early = readFileSync(new URL("../page/early.js", import.meta.url), "utf8");
  const languages = [[null, "sv-SE", "sv"], [null, "en-GB", "en"], [null, "de", "en"], ["sv", "en-GB", "sv"], ["en", "sv-SE", "en"]];
  for (const [kept, language, expected] of languages) {
    const [root, fetched] = [{ dataset: {} }, []];
    runInNewContext(early, {
      addEventListener() {},
      document: { documentElement: root, createElement: () => ({}), head: { append: (link) => fetched.push(link.href) } },
      localStorage: { getItem: (key) => (key === "language" ? kept : null) },
      navigator: { language },
    });
    assert.deepEqual([root.lang, root.dataset.language, ...fetched], [expected, expected, `words/${expected}.js`], `${kept} ${language}`);
  }
});

test("numbers and times are written as the language does", async () => {
  assert.deepEqual([0, -2, 999.4, 1_000, 59_940, 60_000, 3_599_999, 7_200_000].map(span), ["0 ms", "0 ms", "999 ms", "1.0 s", "59.9 s", "1 min", "59 min", "2 h"]);
  assert.equal(await inSwedish(() => decimal(11.74)), "11,7");
});

test("a reason has its values in the order of the English sentence, and the last one is the rest", () => {
  assert.equal(reason("late_answer order%207 99"), "order 7: came 99 ms late; give it anew");
  assert.equal(reason("wheel_asked panel-12"), sentence("wheel_asked", { who: sentence("called_guest", { number: "12" }) }));
  assert.equal(reason("lost"), say("lost"));
  assert.equal(reason("something that nobody knows"), "something that nobody knows");
});

test("every sentence has the same values in the same order in both languages, and as a reason none is left open", async () => {
  const values = (text) => [...new Set(text.match(/\{\w+\}/g))];
  const english = Object.fromEntries(names().map((name) => [name, values(open(name))]));
  assert.ok(names().length > 300);
  for (const language of ["en", "sv"]) {
    await speak(language);
    assert.deepEqual(Object.fromEntries(names().map((name) => [name, values(open(name))])), english);
    for (const name of names()) {
      const told = reason([name, ...english[name].map((_, at) => `v${at}`)].join(" "));
      assert.doesNotMatch(told, /[{}]|undefined|null/, name);
    }
  }
});

test("a page is called by a name, as oneself, or as a guest", () => {
  assert.equal(called("eva"), "eva");
  assert.equal(called("eva", "eva"), open("called_you"));
  assert.match(called("panel-12"), /12/);
  assert.equal(called("panel"), open("called_form"));
});

test("what is wrong and what is thought have their place and their goods in them", () => {
  assert.equal(crossing("2,1"), "(2, 1)");
  assert.equal(crossing(undefined), "");
  assert.equal(failure({}), null);
  assert.match(failure({ failure: "line_lost", failure_node: "2,1" }), /\(2, 1\)/);
  assert.equal(thought({ kind: "nobody has thought of it" }), null);
  assert.match(thought({ kind: "node_passed", node: "2,1", seen: "3" }), /\(2, 1\).*3/);
  assert.equal(thought({ because: "late_answer a 1" }), "a: came 1 ms late; give it anew");
});
