// A display on the robot itself (F2): what it does, in letters that are read from some metres away.
// It stops the robot and orders nothing else.

import { doing } from "./bar.js";
import { Link } from "./link.js";
import { Stop } from "./stop.js";
import { current, decimal, put, say, span } from "./words.js";

const at = (id) => document.getElementById(id);
current();
const link = new Link();
// `/screen?r2` shows that robot, otherwise the first.
const wanted = decodeURIComponent(location.search.slice(1));

const shown = () => link.robots.get(wanted) ?? [...link.robots.values()][0];
new Stop(link, { button: at("stop"), said: at("stop-said") }, shown);

function picture() {
  const now = performance.now();
  const robot = shown();
  const stale = !robot || robot.isStale(now);
  document.body.classList.toggle("stale", stale);
  document.body.classList.toggle("stopped", robot?.state.stopped === "1");
  put(at("stop"), say("stop"));
  put(at("robot"), robot?.name ?? say("no_robot"));
  put(at("doing"), robot?.state.stopped === "1" ? say("stopped_short") : doing(robot));
  const { mode, battery_dv } = robot?.state ?? {};
  const volts = battery_dv === undefined ? "" : say("volts", decimal(Number(battery_dv) / 10));
  put(at("figures"), [mode ? say(`mode_${mode}`) : "", volts].filter(Boolean).join(" \u00b7 "));
  const heard = robot && Number.isFinite(robot.heard) ? say("age", span(robot.age(now))) : say("unheard");
  put(at("link"), !link.open ? say("lost") : stale ? say("no_link", heard) : "");
  requestAnimationFrame(picture);
}
requestAnimationFrame(picture);
