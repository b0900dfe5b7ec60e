// What the page's modules need of a browser before they are imported by a test: a language and an address.

import { register } from "node:module";

register("./table.js", import.meta.url);
globalThis.document = { documentElement: { dataset: { language: "en" } } };
globalThis.location = { search: "" };
