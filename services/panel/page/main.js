// Puts the page together: one link, one robot in view, everything drawn once a picture.

/** @import { Robot } from "./station/robot.js" */

import { Arm } from "./missions/arm.js";
import { Asked, Where } from "./drive/ask.js";
import { at, every } from "./parts/at.js";
import { Bar } from "./bar/bar.js";
import { choose, named, shown } from "./station/chosen.js";
import { Driving } from "./drive/drive.js";
import { Help } from "./help/help.js";
import { nameTheme, switchesTheme } from "./help/theme.js";
import { Fleet } from "./fleet/fleet.js";
import { ByHand } from "./drive/hand.js";
import { Later } from "./parts/later.js";
import { Link } from "./station/link.js";
import { Log } from "./log/log.js";
import { WarehouseMap } from "./map/map.js";
import { Kept } from "./time/kept.js";
import { Missions } from "./missions/missions.js";
import { Moment } from "./time/moment.js";
import { Notify } from "./bar/notify.js";
import { obstacles } from "./map/obstacle.js";
import { offers } from "./map/offers.js";
import { drawRemedy } from "./bar/remedy.js";
import { Save } from "./log/save.js";
import { Stack } from "./map/stack.js";
import { Strips } from "./signals/strips.js";
import { TimeLine } from "./time/line.js";
import { Wheel } from "./drive/wheel.js";
import { change, put, say, speak, translate } from "./words/words.js";

const now = () => performance.now();

await speak();
translate();
const link = new Link();
const robot = () => shown(link);
const kept = new Kept(link);
const moment = new Moment(link, robot, () => at("armed").checked);

const bar = new Bar(link, {
  link: at("link"), mode: at("mode"), driver: at("driver"), battery: at("battery"), told: at("told"),
  form: at("stop-place"), stop: at("stop"), stopSaid: at("stop-said"), stopAll: at("stop-all"),
  resumePlace: at("resume-place"), resume: at("resume"), resumeThen: at("resume-then"),
}, robot, [
  { button: at("resume"), said: at("resume-said") },
  { button: at("drive-resume"), said: at("drive-resume-said") },
]);
const meetWay = obstacles(link, { said: at("map-said"), undo: at("map-undo") }, robot);
/**
 * What goods, crossings and ways are, and what a click on one does.
 *
 * @param {{ robot: () => Robot | null, isPast: () => boolean, isSetUp: () => boolean }} of the robot that is shown
 */
const offered = (of) => offers({
  link, now, obstacle: meetWay, isPlaceWanted: () => where.isWanted(robot()), stands: (crossing) => where.choose(crossing),
  choose: (goods, at) => stack.open(goods, at, map.pixels(at), map.size),
  fetch: (product, hand = { beside: at("map-undo"), said: at("map-said") }) => missions.fetch(product, hand),
  edited: () => editor.made?.now ?? null,
  setUp: (target) => editor.made?.offers(target) ?? null,
  ...of,
});
const tellOnMap = (words = "") => put(at("map-said"), words);
const mapOffers = offered({ isPast: () => moment.isPast, isSetUp, robot: () => moment.shown(robot(), now())[0] });
const map = new WarehouseMap(at("map"), {
  words: at("map-text"), scaleBar: at("map-scale"), legend: at("map-legend"), over: [at("asked"), at("moment")], tell: tellOnMap,
  tools: { zoomIn: at("zoom-in"), zoomOut: at("zoom-out"), fit: at("fit"), follow: at("follow") },
  hand: {
    tip: at("map-tip"), isArmed: () => at("armed").checked, isPlacing: isSetUp, grip: (target) => (isSetUp() && editor.made?.grip(target)) || null,
    offers: mapOffers,
  },
});
const stack = new Stack(at("map-stack"), mapOffers, tellOnMap);
const missions = new Missions(link, {
  fetch: at("fetch"), goods: at("goods"), tiles: at("tiles"), picks: at("picks"), picked: at("picked"), pickedForce: at("picked-force"), plain: at("plain"),
  back: at("goods-back"), backSaid: at("goods-back-said"), backYes: at("goods-back-yes"), backNo: at("goods-back-no"), clear: at("clear"), undo: at("queue-undo"),
  said: at("missions-said"), head: at("queue-said"), queue: at("queue"), rest: at("missions-now"),
  order: at("order"), orderNumber: at("order-number"), orderName: at("order-name"), orderWhere: at("order-where"), orderTime: at("order-time"), orderSteps: at("order-steps"), orderCancel: at("order-cancel"),
  past: at("past"), pastOpen: at("past-open"), pastGoods: at("past-goods"), pastTime: at("past-time"), pastTotals: at("past-totals"), history: at("history"),
}, robot, { offers: offered({ isPast: () => false, isSetUp: () => false, robot }), isArmed: () => at("armed").checked, isOpen: () => !at("missions").hidden });
const arm = new Arm(at("arm-drawing"));
const driving = new Driving(link, { armed: at("armed"), said: at("drive-said"), pad: at("pad"), speed: at("speed"), arm: at("arm"), sticks: at("sticks"), resume: at("drive-resume") }, robot, now);
const byHand = new ByHand(link, { ask: at("manual"), box: at("hand"), said: at("hand-said"), take: at("hand-now"), leave: at("hand-leave") }, robot, () => act("mode manual"), (...words) => driving.tell(...words));
const where = new Where(link, { dialog: at("where"), form: at("where-form"), said: at("where-said"), later: at("where-later") }, robot);
const wheel = new Wheel(link, { button: at("control"), name: at("name") }, robot, driving, where);
const asked = new Asked(link, { box: at("asked"), said: at("asked-said"), give: at("hand-over"), keep: at("keep") }, robot, () => driving.letGo());
const editor = new Later(
  at("setup"),
  (query) => (query ? import(`./setup/editor.js${query}`) : import("./setup/editor.js")),
  ({ Editor }) => new Editor(link, { map, robot, isOpen: isSetUp, drawn: drawWarehouse }),
);
const commission = new Later(
  at("commission"),
  (query) => (query ? import(`./commission/commission.js${query}`) : import("./commission/commission.js")),
  ({ Commission }) => new Commission(at("commission"), link),
);
const line = new Later(
  at("line"),
  (query) => (query ? import(`./line/line.js${query}`) : import("./line/line.js")),
  ({ Line }) => new Line({
    gains: at("gains"), gainsNow: at("gains-now"), gainsBack: at("gains-back"), said: at("board-said"),
    calibrate: at("calibrate"), steps: at("calibration"), calibrationSaid: at("calibration-said"), sensors: at("calibration-sensors"),
  }, link, robot),
);
const fleet = new Fleet(link, { tab: at("tab-fleet"), list: at("fleet-list") }, (name) => {
  at("robot").value = name;
  at("robot").dispatchEvent(new Event("change"));
});
const signals = new Later(
  at("signals"),
  (query) => (query ? import(`./signals/signals.js${query}`) : import("./signals/signals.js")),
  ({ Signals }) => new Signals(at("signals"), () => at("armed").checked, link),
);
const coming = { said: at("coming-said"), again: at("coming-again") };
const strips = new Strips(at("strips"), (lane) => {
  show(at("tab-signals"));
  signals.once((made) => made.show(lane));
});
const notify = new Notify(link, at("notify"));
const log = new Log({ panel: at("log"), map: at("map-zone"), filter: at("filter"), kinds: at("log-kinds"), entries: at("entries"), earlier: at("log-earlier"), said: at("log-said") }, { kept, moment, robot });
const save = new Save({ span: at("save-span"), csv: at("save-csv"), mcap: at("save-mcap"), said: at("log-said") }, robot, () => moment.at ?? link.now(), (query) => (query ? import(`./log/recording.js${query}`) : import("./log/recording.js")));
const timeLine = new TimeLine(link, {
  line: at("time"), slider: at("time-line"), choice: at("time-span"), from: at("time-from"), before: at("time-before"), after: at("time-after"), now: at("time-now"), tag: at("moment"),
}, { kept, moment, robot });
const health = new Later(
  at("health"),
  (query) => (query ? import(`./health/health.js${query}`) : import("./health/health.js")),
  ({ Health }) => new Health(link, {
    body: at("health"), said: at("health-said"), links: at("health-links"), services: at("health-services"), machine: at("health-machine"), losses: at("health-losses"), versions: at("health-versions"),
  }),
);
const help = new Help({ dialog: at("help"), body: at("help-body"), open: at("help-open"), close: at("help-close"), legend: at("map-legend") }, () => at("armed").checked);
switchesTheme(at("theme"));

/** Whether the map is the warehouse that is set up, and no robot is told anything by it. */
function isSetUp() {
  return !at("setup").hidden;
}

/** Draws the warehouse that is kept or, while it is set up, the one that it would become. */
function drawWarehouse() {
  const warehouse = isSetUp() && editor.made ? editor.made.now : link.warehouse;
  at("map-zone").classList.toggle("empty", !warehouse);
  map.setWarehouse(warehouse);
}

/**
 * Has the robot in view do something, and tells where one drives why not.
 *
 * @param {string} action
 */
async function act(action) {
  const shown = robot();
  if (!shown) return;
  const answer = await link.act(shown, action);
  if (answer.refused) driving.refuse(answer.refused);
  else driving.tell(null);
}

at("autonomous").onclick = () => {
  driving.letGo();
  // Whoever was driven by hand is lost until somebody says where it stands.
  if (where.isOpen(robot())) where.ask(() => act("mode autonomous"));
  else act("mode autonomous");
};
at("where-ask").onclick = () => link.warehouse && where.ask();
at("reload").onclick = () => location.reload();
at("language").onclick = async () => {
  try {
    await change();
  } catch {
    return tellOnMap(say("view_failed"));
  }
  translate();
  words();
  map.redraw();
};

// Space is STOP, so a box is ticked by Enter.
for (const box of every("[type=checkbox]", HTMLInputElement)) {
  box.addEventListener("keydown", (event) => event.key === "Enter" && !event.repeat && box.click());
}

/** @type {Partial<Record<string, number>>} */
const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };
for (const tab of every("[role=tab]", HTMLButtonElement)) {
  tab.addEventListener("click", () => show(tab));
  tab.addEventListener("keydown", (event) => {
    const tabs = every("[role=tab]:not([hidden])", HTMLButtonElement);
    const step = STEPS[event.key];
    if (!step || at("armed").checked) return;
    const next = tabs[(tabs.indexOf(tab) + step + tabs.length) % tabs.length] ?? tab;
    show(next);
    next.focus();
  });
}

at("commission-open").onclick = () => show(at("commission-open"));

/** @param {HTMLElement} tab or what opens a view that belongs to one */
function show(tab) {
  const wasSetUp = isSetUp();
  document.body.dataset.view = tab.getAttribute("aria-controls") ?? "";
  const seat = tab === at("commission-open") ? at("tab-setup") : tab;
  for (const other of every("[role=tab]", HTMLButtonElement)) {
    const chosen = other === seat;
    other.setAttribute("aria-selected", String(chosen));
    other.tabIndex = chosen ? 0 : -1;
    document.getElementById(other.getAttribute("aria-controls") ?? "")?.toggleAttribute("hidden", other !== tab);
  }
  at("commission").toggleAttribute("hidden", seat === tab);
  driving.letGo();
  // Who drives or sets up sees what is now.
  if (tab.id === "tab-drive" || isSetUp()) moment.back();
  if (wasSetUp === isSetUp()) return;
  editor.made?.close();
  drawWarehouse();
  map.fit();
}

/** Words that change with the language or with who looks. */
function words() {
  at("language").textContent = say("language");
  for (const element of every(".driver-only", HTMLElement)) element.toggleAttribute("disabled", !link.mayDrive);
  nameTheme(at("theme"));
  if (help.dialog.open) help.write();
  editor.made?.words();
}

link.addEventListener("robots", () => {
  const list = at("robot");
  // One that is not here stays chosen: nobody takes its place unasked.
  const wanted = named();
  const names = new Set([...link.robots.keys(), ...(wanted === null ? [] : [wanted])]);
  list.replaceChildren(...[...names].sort().map((name) => new Option(name, name)));
  list.value = robot()?.name ?? wanted ?? "";
});
at("robot").onchange = () => {
  choose(at("robot").value);
  driving.letGo();
  byHand.leave();
};
link.addEventListener("warehouse", () => {
  drawWarehouse();
  missions.setWarehouse(link.warehouse);
});
link.addEventListener("link", words);
words();

/** All that is not moved is drawn five times a second, and all else while nothing moves. */
const REST_MS = 200;
/** So often where only figures change. */
const FIGURES_MS = 600;
/** What somebody does, and what has happened, may go on changing things for so long. */
const AFTER_MS = 2_000;
/** When something has happened last, or somebody has done something here. */
let news = now();
/** What part of a core pictures may take while something moves: a quick machine draws all of the screen's. */
const SHARE = 0.025;
/** A slow machine draws half of the twenty poses a second, but so many that the robot still glides (`GLIDE_MS`). */
const GLIDES_MS = 90;
/** So long a picture has taken lately, in ms, all the browser's work for it included. */
let cost = 5;
let drawn = -Infinity;
let pictured = -Infinity;
/** @type {number | null} */
let due = null;
let timer = 0;

/** Whether the next picture may differ from this one in more than figures. */
function moves() {
  const { left_duty: left = 0, right_duty: right = 0 } = robot()?.state ?? {};
  return at("armed").checked || moment.isPast || Number(left) !== 0 || Number(right) !== 0;
}

/** Whether only figures change, and not those of a view that is about them. Silence is no figure. */
const isQuiet = () => now() - news > AFTER_MS && now() - (robot()?.heard ?? 0) < REST_MS && signals.view.hidden && line.view.hidden;

/** Something has happened, or somebody has done something here. */
function hear() {
  news = now();
  if (moves()) return;
  clearTimeout(timer);
  timer = setTimeout(soon, pictured + REST_MS - news);
}
for (const event of ["link", "news", "robots", "warehouse"]) link.addEventListener(event, hear);
for (const event of ["pointerdown", "pointerup", "pointermove", "wheel", "keydown", "input", "change", "hashchange"]) addEventListener(event, hear, { capture: true, passive: true });

/** So long after a picture comes the next one while something moves, in ms. */
const pauses = () => Math.min(cost / SHARE, GLIDES_MS);

/** Draws in the browser's next picture. */
function soon() {
  clearTimeout(timer);
  due ??= requestAnimationFrame(picture);
}

// A message to itself comes once the picture is laid out and painted.
const painted = new MessageChannel();
painted.port1.onmessage = ({ data: began }) => (cost += (Math.min(now() - began, 50) - cost) / 16);

function picture() {
  due = null;
  const time = now();
  painted.port2.postMessage(time);
  const pause = pauses();
  pictured = time;
  timer = setTimeout(soon, moves() ? pause : isQuiet() ? FIGURES_MS : REST_MS);
  const isSmooth = pause < 34;
  const shown = robot();
  driving.pads();
  const [seen, then] = moment.shown(shown, time);
  map.move(seen, then);
  const isRest = time - drawn >= REST_MS;
  if (isSmooth || isRest) strips.move(seen, then);
  if (isRest) {
    drawn = time;
    drawRest(shown, time, seen, then);
  }
}

/**
 * Draws the robot in view, and on map and strips what is `seen` of it at the time `then`: the same, or a past moment.
 *
 * @param {Robot | null} shown
 * @param {number} time
 * @param {Robot | null} seen
 * @param {number} then
 */
function drawRest(shown, time, seen, then) {
  const face = bar.draw(shown, time);
  const isNow = seen === shown;
  const others = isNow ? [...link.robots.values()].filter((other) => other !== shown) : shown ? [asNow(shown)] : [];
  map.draw(seen, others, then, isNow ? face : seen ? moment.face() : null);
  drawRemedy(at("remedy"), face);
  fleet.draw(shown, time);
  missions.draw(shown, time);
  arm.draw(shown);
  driving.draw();
  strips.draw(seen, then);
  timeLine.draw(shown);
  at("coming").toggleAttribute("hidden", ![signals, editor, commission, line, health].some(({ view, state }) => !view.hidden && state));
  signals.open(coming)?.draw(shown, time);
  editor.open(coming)?.draw();
  commission.open(coming)?.draw(shown, time);
  line.open(coming)?.draw(shown);
  asked.draw(shown);
  byHand.draw(shown);
  log.draw(shown);
  save.draw(shown);
  notify.draw(time);
  wheel.draw(shown);
  health.open(coming)?.draw(shown, time);
  if (!map.warehouse) put(at("map-said"), say("no_map"));
  else if (at("map-said").textContent === say("no_map")) put(at("map-said"), "");
}

/**
 * The live robot beside the past one: grey, and called what it is.
 *
 * @param {Robot} live
 * @returns {Robot}
 */
const asNow = (live) => Object.create(live, { name: { value: say("time_now") }, isStale: { value: () => true } });

link.addEventListener("pose", () => moves() && now() - pictured >= pauses() && soon());
soon();
