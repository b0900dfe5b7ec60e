// Puts the page together: one link, one robot in view, everything drawn once a picture.

import { Arm } from "./missions/arm.js";
import { Asked, Where } from "./drive/ask.js";
import { Bar } from "./bar/bar.js";
import { choose, named, shown } from "./station/chosen.js";
import { Driving } from "./drive/drive.js";
import { Fleet } from "./fleet/fleet.js";
import { ByHand } from "./drive/hand.js";
import { Line } from "./line/line.js";
import { Link } from "./station/link.js";
import { Log } from "./log/log.js";
import { WarehouseMap } from "./map/map.js";
import { Missions } from "./missions/missions.js";
import { Notify } from "./bar/notify.js";
import { offers } from "./map/offers.js";
import { called, reason } from "./words/sentences.js";
import { Kept } from "./setup/kept.js";
import { OnMap } from "./setup/onmap.js";
import { Setup } from "./setup/setup.js";
import { Strips } from "./signals/strips.js";
import { change, current, put, say, translate } from "./words/words.js";

const at = (id) => document.getElementById(id);
const now = () => performance.now();

current();
translate();
const link = new Link();
const robot = () => shown(link);

const bar = new Bar(link, {
  link: at("link"), mode: at("mode"), driver: at("driver"), battery: at("battery"), told: at("told"),
  form: at("stop-place"), stop: at("stop"), stopSaid: at("stop-said"), stopAll: at("stop-all"),
  resumePlace: at("resume-place"), resume: at("resume"), resumeThen: at("resume-then"),
}, robot, [
  { button: at("resume"), said: at("resume-said") },
  { button: at("drive-resume"), said: at("drive-resume-said") },
]);
const map = new WarehouseMap(at("map"), {
  words: at("map-text"), scaleBar: at("map-scale"), legend: at("map-legend"), tell: (words = "") => put(at("map-said"), words),
  tools: { zoomIn: at("zoom-in"), zoomOut: at("zoom-out"), fit: at("fit"), follow: at("follow") },
  hand: {
    tip: at("map-tip"), isArmed: () => at("armed").checked, isPlacing: isSetUp, grip: (target) => (isSetUp() ? onMap.grip(target) : null),
    offers: offers({
      link, robot, now, obstacle: meetWay, isPlaceWanted: () => where.isWanted(robot()), stands: (crossing) => where.choose(crossing),
      fetch: (product) => missions.fetch(product, { beside: at("map-undo"), said: at("map-said") }),
      isSetUp, setUp: (target) => onMap.offers(target),
    }),
  },
});
const missions = new Missions(link, {
  fetch: at("fetch"), goods: at("goods"), picks: at("picks"), picked: at("picked"), pickedForce: at("picked-force"), plain: at("plain"), back: at("goods-back"), backSaid: at("goods-back-said"), backYes: at("goods-back-yes"), backNo: at("goods-back-no"), clear: at("clear"), undo: at("queue-undo"),
  said: at("missions-said"), queue: at("queue"), history: at("history"),
}, robot);
const arm = new Arm(at("arm-drawing"));
const driving = new Driving(link, { armed: at("armed"), said: at("drive-said"), pad: at("pad"), arm: at("arm"), resume: at("drive-resume") }, robot, now);
const byHand = new ByHand(link, { ask: at("manual"), box: at("hand"), said: at("hand-said"), take: at("hand-now"), leave: at("hand-leave") }, robot, () => act("mode manual"), (...words) => driving.tell(...words));
const where = new Where(link, { dialog: at("where"), form: at("where-form"), said: at("where-said"), later: at("where-later") }, robot);
const asked = new Asked(link, { box: at("asked"), said: at("asked-said"), give: at("hand-over"), keep: at("keep") }, robot, () => driving.letGo());
const setup = new Setup(link, {
  form: at("warehouse"), products: at("products"), add: at("add-product"), said: at("setup-said"), floor: at("floor-size"),
  undo: at("undo"), redo: at("redo"), undoes: at("undo-what"), unsaved: at("unsaved"), discard: at("discard"),
  saveFile: at("save-file"), loadFile: at("load-file"), mapString: at("map-string"), goodsString: at("goods-string"),
}, { drawn: drawWarehouse, isOpen: isSetUp });
const onMap = new OnMap(map, {
  form: at("rename"), number: at("rename-number"), name: at("rename-name"), move: at("rename-move"), remove: at("rename-remove"), close: at("rename-close"),
}, { edits: setup.edits, changed: () => setup.fill(), mayEdit: () => link.mayDrive });
map.scaledAnew = () => onMap.draw(isSetUp());
const kept = new Kept(link, {
  where: at("kept-where"), robots: at("kept-robots"), ask: at("renew"), box: at("renew-box"), question: at("renew-question"), yes: at("renew-yes"), no: at("renew-no"), said: at("renew-said"),
}, robot);
const line = new Line({
  gains: at("gains"), gainsNow: at("gains-now"), gainsBack: at("gains-back"), said: at("board-said"),
  calibrate: at("calibrate"), steps: at("calibration"), calibrationSaid: at("calibration-said"), sensors: at("calibration-sensors"),
}, link, robot);
const fleet = new Fleet(link, { tab: at("tab-fleet"), list: at("fleet-list") }, (name) => {
  at("robot").value = name;
  at("robot").onchange();
});
const strips = new Strips(at("strips"));
const notify = new Notify(link, at("notify"));
const log = new Log({ filter: at("filter"), entries: at("entries"), span: at("save-span"), csv: at("save-csv"), mcap: at("save-mcap"), said: at("log-said") }, robot);

/** Whether the map is the warehouse that is set up, and no robot is told anything by it. */
function isSetUp() {
  return !at("setup").hidden;
}

/** Draws the warehouse that is kept or, while it is set up, the one that it would become. */
function drawWarehouse() {
  const warehouse = isSetUp() ? setup.edits.now : link.warehouse;
  at("map-zone").classList.toggle("empty", !warehouse);
  map.setWarehouse(warehouse);
}

/** Puts an obstacle on a way of a simulated world, or takes it away. */
async function meetWay(edge) {
  const shown = robot();
  // Where one stands a second put changes nothing, so it is tried to be taken first.
  const take = await link.act(shown, `obstacle take ${edge}`);
  const put = take.done ? take : await link.act(shown, `obstacle put ${edge}`);
  if (!put.done) return tell("refused", reason(put.refused));
  const done = take.done ? "take" : "put";
  tell(done === "put" ? "obstacle_put" : "obstacle_taken");
  const undo = at("map-undo");
  undo.hidden = false;
  undo.onclick = async () => {
    undo.hidden = true;
    const back = await link.act(shown, `obstacle ${done === "put" ? "take" : "put"} ${edge}`);
    tell(...(back.done ? [done === "put" ? "obstacle_taken" : "obstacle_put"] : ["refused", reason(back.refused)]));
  };
}

function tell(...words) {
  put(at("map-said"), say(...words));
}

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
at("control").onclick = async () => {
  const shown = robot();
  if (!shown) return;
  const mine = shown.driver === link.me;
  driving.letGo();
  driving.tell(...(shown.driver && !mine ? ["asked_for", called(shown.driver)] : [null]));
  const answer = await link.ask(mine ? "free" : "take", shown.name);
  driving.tell(...(answer.refused ? ["refused", reason(answer.refused)] : [null]));
  if (mine && answer.done && where.isOpen(shown)) where.ask();
};
at("name").value = localStorage.getItem("name") ?? "";
at("name").onchange = () => {
  driving.letGo();
  // It stands in lines of words.
  at("name").value = at("name").value.trim().replaceAll(" ", "-");
  link.rename(at("name").value);
};
at("language").onclick = () => {
  change();
  translate();
  words();
  setup.draw();
  map.redraw();
};

// Space is STOP, so a box is ticked by Enter.
for (const box of document.querySelectorAll("[type=checkbox]")) {
  box.addEventListener("keydown", (event) => event.key === "Enter" && !event.repeat && box.click());
}

for (const tab of document.querySelectorAll("[role=tab]")) {
  tab.addEventListener("click", () => show(tab));
  tab.addEventListener("keydown", (event) => {
    const tabs = [...document.querySelectorAll("[role=tab]:not([hidden])")];
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step || at("armed").checked) return;
    const next = tabs[(tabs.indexOf(tab) + step + tabs.length) % tabs.length];
    show(next);
    next.focus();
  });
}

function show(tab) {
  const wasSetUp = isSetUp();
  document.body.dataset.view = tab.getAttribute("aria-controls");
  for (const other of document.querySelectorAll("[role=tab]")) {
    const chosen = other === tab;
    other.setAttribute("aria-selected", chosen);
    other.tabIndex = chosen ? 0 : -1;
    at(other.getAttribute("aria-controls")).hidden = !chosen;
  }
  driving.letGo();
  if (wasSetUp === isSetUp()) return;
  drawWarehouse();
  map.fit();
}

/** Words that change with the language or with who looks. */
function words() {
  at("language").textContent = say("language");
  for (const element of document.querySelectorAll(".driver-only")) element.disabled = !link.mayDrive;
  setup.draw();
}

link.addEventListener("robots", () => {
  const list = at("robot");
  // One that is not here stays chosen: nobody takes its place unasked.
  const names = new Set([...link.robots.keys(), ...(named() === null ? [] : [named()])]);
  list.replaceChildren(...[...names].sort().map((name) => new Option(name, name)));
  list.value = robot()?.name ?? named() ?? "";
});
at("robot").onchange = () => {
  choose(at("robot").value);
  driving.letGo();
  byHand.leave();
};
link.addEventListener("warehouse", () => {
  setup.kept(link.warehouse);
  drawWarehouse();
  missions.setWarehouse(link.warehouse);
});
link.addEventListener("link", words);
words();

/** All that is not moved is drawn five times a second. */
const REST_MS = 200;
/**
 * What part of a core pictures may take. Each new pose is drawn at once, twenty times a second. As many
 * more as this allows, up to all of the screen's, let robot and strips move smoothly: on a machine that
 * paints in a fraction of a millisecond all of them.
 */
const SHARE = 0.04;
/** So long a picture has taken lately, in ms, all the browser's work for it included. */
let cost = 5;
let drawn = -Infinity;
let due = null;
let timer = null;

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
  const pause = cost / SHARE;
  timer = setTimeout(soon, Math.min(pause, REST_MS));
  const isSmooth = pause < 34;
  const shown = robot();
  driving.pads();
  map.move(shown, time);
  const isRest = time - drawn >= REST_MS;
  if (isSmooth || isRest) strips.move(shown, time);
  if (isRest) {
    drawn = time;
    drawRest(shown, time);
  }
}

function drawRest(shown, time) {
  const face = bar.draw(shown, time);
  map.draw(shown, [...link.robots.values()].filter((other) => other !== shown), time, face);
  drawRemedy(face);
  fleet.draw(shown, time);
  missions.draw(shown, time);
  arm.draw(shown);
  driving.draw();
  strips.draw(shown);
  line.draw(shown);
  if (isSetUp()) kept.draw();
  asked.draw(shown);
  byHand.draw(shown);
  log.draw(shown);
  notify.draw(time);
  const mine = shown?.driver && shown.driver === link.me;
  const seat = mine ? ["control_mine"] : shown?.driver ? ["control_other", called(shown.driver)] : ["control_free"];
  put(at("control"), say(...seat));
  // Who has the wheel is not known until the robot is heard again.
  at("control").disabled = !link.open || !shown?.connected;
  if (!map.warehouse) tell("no_map");
  else if (at("map-said").textContent === say("no_map")) put(at("map-said"), "");
}
/** The control of this page that ends what is wrong, by the name of the remedy. */
const REMEDIES = { reset: "where-ask", charge: "where-ask", hand: "picked", put_back: "do-back", arm: "tab-drive", calibrate: "tab-line", map: "tab-setup" };

/** Beside the sentence that names a remedy stands a button that does it, or shows where it is done. */
function drawRemedy({ remedy }) {
  const button = at("remedy");
  const control = REMEDIES[remedy] && at(REMEDIES[remedy]);
  button.hidden = !control;
  if (!control) return;
  put(button, control.textContent);
  button.disabled = control.disabled;
  button.onclick = () => control.click();
}
link.addEventListener("pose", soon);
soon();
