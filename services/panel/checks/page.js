// What the page's modules need of a browser before they are imported by a test: a language and an address.

import { register } from "node:module";

register("./made.js", import.meta.url);
globalThis.document = { documentElement: { dataset: { language: "en" } }, baseURI: new URL("../page/", import.meta.url).href };
globalThis.location = { search: "" };

const { speak } = await import("../page/words/words.js");
await speak();
