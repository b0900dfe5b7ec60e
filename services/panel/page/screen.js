// A display on the robot itself (F2): what it does, in letters that are read from some metres away.
// It stops the robot and orders nothing else. `/screen?r2` shows that robot and nobody else.

import { doing, stopped } from "./bar.js";
import { named, shown } from "./chosen.js";
import { Link } from "./link.js";
import { Stop } from "./stop.js";
import { current, decimal, put, say, span } from "./words.js";

const at = (id) => document.getElementById(id);
current();
const link = new Link();
const robot = () => shown(link);
const name = () => robot()?.name ?? named();
const stop = new Stop(link, { form: at("stop-place"), button: at("stop"), said: at("stop-said") }, robot, name);
let wasStopped = false;

function picture() {
  const now = performance.now();
  const seen = robot();
  const stale = !seen || seen.isStale(now);
  const isStopped = seen?.state.stopped === "1";
  document.body.classList.toggle("stale", stale);
  document.body.classList.toggle("stopped", isStopped);
  // What became of a stop is true as long as the stop is.
  if (wasStopped && !isStopped) stop.say(null);
  wasStopped = isStopped;
  put(at("stop-word"), say("stop"));
  put(at("stop-whom"), name() ?? "");
  put(at("robot"), name() ?? say("no_robot"));
  put(at("doing"), !seen && name() ? notHere() : isStopped ? stopped(seen) : doing(seen));
  const { mode, battery_dv } = seen?.state ?? {};
  const volts = battery_dv === undefined ? "" : say("volts", decimal(Number(battery_dv) / 10));
  put(at("figures"), [mode ? say(`mode_${mode}`) : "", volts].filter(Boolean).join(" \u00b7 "));
  const heard = seen && Number.isFinite(seen.heard) ? say("age", span(seen.age(now))) : say("unheard");
  put(at("link"), !link.open ? say("lost") : stale && seen ? say("no_link", heard) : "");
  requestAnimationFrame(picture);
}

/** The robot that was asked for, as long as the station does not know it. */
const notHere = () => (link.me ? say("not_here", named()) : "");
requestAnimationFrame(picture);
