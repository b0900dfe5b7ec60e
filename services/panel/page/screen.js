// A display on the robot itself (F2): what it does, in letters that are read from some metres away.
// It stops the robot and orders nothing else. `/screen?r2` shows that robot and nobody else.

import { at } from "./parts/at.js";
import { named, shown } from "./station/chosen.js";
import { battery } from "./bar/battery.js";
import { face, show } from "./bar/face.js";
import { Link } from "./station/link.js";
import { Stop } from "./bar/stop.js";
import { put, say, speak } from "./words/words.js";

await speak();
const link = new Link();
const robot = () => shown(link);
const name = () => robot()?.name ?? named();
const stop = new Stop(link, { form: at("stop-place"), button: at("stop"), said: at("stop-said") }, robot, name);
let wasStopped = false;

/** How often it is drawn, in ms. */
const REST_MS = 200;

function picture() {
  const seen = robot();
  const isStopped = seen?.state.stopped === "1";
  // What became of a stop is true as long as the stop is.
  if (wasStopped && !isStopped) stop.say(null);
  wasStopped = isStopped;
  show(face(link, seen, performance.now()), seen);
  put(at("whose"), name() ?? say("robot"));
  const { mode } = seen?.state ?? {};
  const waits = seen?.queue.length ? say("orders_wait", seen.queue.length) : "";
  put(at("figures"), [mode ? say(`mode_${mode}`) : "", battery(seen?.state ?? {}).words, waits].filter(Boolean).join(" \u00b7 "));
  setTimeout(() => requestAnimationFrame(picture), REST_MS);
}
requestAnimationFrame(picture);
