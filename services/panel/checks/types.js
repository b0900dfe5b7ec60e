// Runs the type checker. The errors of the files in `untyped.txt` do not count; a file that has none left has to leave
// that list. Without the list, all of them count.

import { spawnSync } from "node:child_process";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { elements } from "./ids.js";

const here = (name) => fileURLToPath(new URL(name, import.meta.url));
writeFileSync(here("types/ids.d.ts"), elements());
const { stdout, stderr, error } = spawnSync(process.execPath, [here("../node_modules/typescript/bin/tsc"), "--project", here("../jsconfig.json"), "--pretty", "false"], { cwd: here(".."), encoding: "utf8" });
if (error || stderr) throw error ?? new Error(stderr);

const list = here("untyped.txt");
const untyped = existsSync(list) ? readFileSync(list, "utf8").split("\n").filter((line) => line && !line.startsWith("#")) : [];
const found = new Set();
let isTold = false;
const errors = stdout.split("\n").filter((line) => {
  // Further lines of an error are indented.
  if (!line.startsWith(" ")) {
    const file = line.split("(")[0];
    isTold = Boolean(line) && !untyped.includes(file);
    found.add(file);
  }
  return isTold;
});
const typed = untyped.filter((file) => !found.has(file)).map((file) => `${file} has its types: take it out of checks/untyped.txt`);
const wrong = [...errors, ...typed];
for (const line of wrong) console.log(line);
process.exitCode = wrong.length ? 1 : 0;
