// Runs the type checker.

import { spawnSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { elements } from "./ids.js";

const here = (name) => fileURLToPath(new URL(name, import.meta.url));
writeFileSync(here("types/ids.d.ts"), elements());
const checker = [here("../node_modules/typescript/bin/tsc"), "--project", here("../jsconfig.json"), "--pretty", "false"];
const { status, error } = spawnSync(process.execPath, checker, { cwd: here(".."), stdio: "inherit" });
if (error) throw error;
process.exitCode = status ?? 1;
