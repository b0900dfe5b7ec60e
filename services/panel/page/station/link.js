// The one connection to the station: its lines become a model of every robot, orders go back.
//
// What the station says, one or more lines in a message (services/panel/src/speech.rs):
//
//   you <name> driver|viewer
//   warehouse <json>
//   kept <where>
//   about <robot> connected=0|1 speaks=0|1 driver=<name>|- [asks=<name>] uses=<what>|- renews=0|1 [age_ms=<n>]
//   from <robot> <a line of the extension, such as state ...>
//   from <robot> asked <who> <what>   a person here wants an action, stop, take or free
//   past <robot> <ms> <an event, a thought or what was asked so long ago>
//   answer <number> done [<reason>{; <reason>}] | refused <reason> | stopped <ms> | lost <reason>
//
// What the page says:
//
//   do <robot> <number> <ms> <action> the extension's action; answered once
//   stop <robot> <number>             ahead of all else
//   take <robot> <number>             the driver's seat, or asks whoever has it for it
//   free | keep <robot> <number>      leaves it; does not leave it for whoever asks
//   renew <robot> <number>            puts a simulated robot into the warehouse that is saved
//   warehouse <number> <json>
//   here <ms>                         once a second
//
// <ms> is this page's clock: what was held up on the way moves nothing.
//
// Nothing here draws, and nothing here is kept when the page is closed. The station keeps it, and tells
// on each connection what has happened; its history (services/panel/src/history.rs) has the last day.

/** Older than this, in ms, nothing is shown as true. */
export const STALE_MS = 500;
/** How long trail and strips look back, in ms. */
export const SPAN_MS = 60_000;

/** How often the page says that it is there, in ms. */
const HERE_MS = 1_000;
/** Said where the panel no longer knows the browser: `up` was started anew, or the cookie is gone. */
const NO_TOKEN = "no_token";
const RETRY_MS = [250, 500, 1_000, 2_000];

/** What is known of one robot. */
class Robot {
  constructor(name) {
    this.name = name;
    this.connected = false;
    this.speaks = false;
    /** Which warehouse it uses, and whether it can be put into the saved one. */
    this.uses = "-";
    this.renews = false;
    this.driver = null;
    /** Who asks the driver for the wheel. */
    this.asks = null;
    /** When the station last heard it, by this page's clock. */
    this.heard = -Infinity;
    this.state = {};
    /** When its state last came, by this page's clock. */
    this.stated = -Infinity;
    this.truth = null;
    this.latency = null;
    /** What each line sensor has read in the last calibration, the leftmost first. */
    this.sensors = null;
    this.route = [];
    /** The products whose goods are not in their place: delivered, in the claw, or somewhere else. */
    this.gone = new Set();
    /** The ways on which something was put in a simulated world, as `x y side`. */
    this.placed = [];
    /** Where it was when that was known last, and how far it may have come since, in mm. */
    this.pose = null;
    this.strayed = 0;
    /** Ways that are not taken, and since when, in s of the robot's clock. */
    this.blocked = new Map();
    this.queue = [];
    this.forget();
    this.past = [];
    /** States heard in all. */
    this.total = 0;
    this.stoppedSince = null;
  }

  /** Nothing has happened yet. */
  forget() {
    this.events = [];
    /** The values of the thought that comes next. */
    this.thinks = null;
    this.history = [];
    /** When it set out on this order, and the ways that were found blocked on it. */
    this.began = null;
    this.detours = [];
    /** Goods that wait because no way leads to them. */
    this.unreachable = new Set();
  }

  /** Keeps an event, a thought, a refusal or what was asked, by when it was: some are told later. */
  happened(entry) {
    const after = this.events.findLastIndex(({ at }) => at <= entry.at);
    this.events.splice(after + 1, 0, entry);
    if (this.events.length > 1_000) this.events.shift();
  }

  /** Milliseconds since the robot was last heard. */
  age(now) {
    return now - this.heard;
  }

  isStale(now) {
    return !this.connected || now - this.heard > STALE_MS || now - this.stated > STALE_MS;
  }
}

export class Link extends EventTarget {
  constructor() {
    super();
    this.robots = new Map();
    this.warehouse = null;
    /** Where the station keeps it. */
    this.kept = null;
    this.me = null;
    this.mayDrive = false;
    this.open = false;
    /** Why the station has closed the connection, if it has said so. */
    this.closed = null;
    this.number = 0;
    this.waiting = new Map();
    this.tries = 0;
    this.connect();
    setInterval(() => this.open && this.send("here", clock()), HERE_MS);
  }

  connect() {
    const url = new URL("live", location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.hash = "";
    url.search = new URLSearchParams(localStorage.getItem("name") ? { name: localStorage.getItem("name") } : {});
    const socket = new WebSocket(url);
    this.socket = socket;
    socket.onopen = () => {
      this.open = true;
      this.tries = 0;
      this.emit("link");
    };
    socket.onmessage = (message) => {
      for (const line of message.data.split("\n")) {
        if (line) this.hear(line);
      }
      if (message.data.includes(" state ")) this.emit("pose");
    };
    socket.onclose = ({ reason }) => {
      this.open = false;
      if (reason) this.closed = reason;
      for (const settle of this.waiting.values()) settle({ refused: "lost", isUnknown: true });
      this.waiting.clear();
      for (const robot of this.robots.values()) robot.connected = false;
      this.emit("link");
      if (!reason) this.askWhy();
      const wait = RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)];
      setTimeout(() => this.connect(), wait);
    };
  }

  /** The person at this page is called so from now on; the station is told by a new connection. */
  rename(name) {
    localStorage.setItem("name", name);
    this.socket.close();
  }

  /** A browser does not say why a socket was refused; the page's own address does. */
  async askWhy() {
    const answer = await fetch(new URL("style.css", location.href), { cache: "no-store" }).catch(() => null);
    if (this.open || !answer) return;
    if (answer.status === 403) this.closed = NO_TOKEN;
    else if (this.closed === NO_TOKEN) this.closed = null;
    this.emit("link");
  }

  /**
   * Gives an order, to one robot by its name or, with `null`, to the station; resolves to {done},
   * {stopped: ms} or {refused: reason}, where `isUnknown` says that it was given all the same.
   */
  ask(verb, robot, rest = "") {
    const number = ++this.number;
    if (!this.open || this.socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve(this.noted(robot, { refused: "lost", unsent: true }));
    }
    this.send(verb, robot, number, rest);
    return new Promise((settle) => this.waiting.set(String(number), (answer) => settle(this.noted(robot, answer))));
  }

  /** Keeps what was refused among what has happened. */
  noted(robot, answer) {
    const { refused } = answer;
    const asked = refused && this.robots.get(robot);
    // A command that is given again and again is refused as often.
    const last = asked?.events.at(-1);
    const isSame = last?.kind === "refused" && last.words[0] === refused;
    if (asked && !isSame) asked.happened({ at: Date.now(), kind: "refused", words: [refused], values: null });
    return answer;
  }

  act(robot, action) {
    return this.ask("do", robot.name, `${clock()} ${action}`);
  }

  send(...words) {
    this.socket.send(words.filter((word) => word !== "" && word !== null).join(" "));
  }

  /** Bytes that the browser has not sent yet: a dead link shows here first. */
  get backlog() {
    return this.socket.bufferedAmount;
  }

  hear(line) {
    const [word, ...rest] = line.split(" ");
    if (word === "from") {
      this.report(this.robot(rest[0]), rest[1], rest.slice(2));
    } else if (word === "past") {
      this.report(this.robot(rest[0]), rest[2], rest.slice(3), Number(rest[1]));
    } else if (word === "about") {
      this.about(this.robot(rest[0]), fields(rest.slice(1)));
    } else if (word === "answer") {
      this.answer(rest);
    } else if (word === "warehouse") {
      this.warehouse = JSON.parse(line.slice("warehouse ".length));
      this.emit("warehouse");
    } else if (word === "kept") {
      this.kept = line.slice("kept ".length);
    } else if (word === "you") {
      // All that has happened is told after this.
      for (const robot of this.robots.values()) robot.forget();
      this.closed = null;
      this.me = rest[0];
      this.mayDrive = rest[1] === "driver";
      this.emit("link");
    }
  }

  robot(name) {
    let robot = this.robots.get(name);
    if (!robot) {
      robot = new Robot(name);
      this.robots.set(name, robot);
      this.emit("robots");
    }
    return robot;
  }

  about(robot, said) {
    robot.connected = said.connected === "1";
    robot.speaks = said.speaks === "1";
    robot.driver = said.driver === "-" ? null : said.driver;
    robot.asks = said.asks ?? null;
    [robot.uses, robot.renews] = [said.uses, said.renews === "1"];
    // One that speaks only the document's language shows nothing that could be old.
    robot.heard = said.age_ms === undefined ? -Infinity : performance.now() - Number(said.age_ms);
  }

  answer([number, what, ...rest]) {
    const settle = this.waiting.get(number);
    this.waiting.delete(number);
    if (!settle) return;
    if (what === "done") settle({ done: true, told: rest.join(" ") });
    else if (what === "stopped") settle({ stopped: Number(rest[0]) });
    else settle({ refused: rest.join(" "), isUnknown: what === "lost" });
  }

  report(robot, word, rest, age = 0) {
    const now = performance.now();
    if (word === "state") {
      const state = fields(rest);
      robot.stoppedSince = state.stop_age_ms === undefined ? null : Date.now() - Number(state.stop_age_ms);
      stray(robot, state, now);
      robot.state = state;
      robot.stated = now;
      remember(robot, now);
    } else if (word === "route") {
      robot.route = rest.slice(1).reduce(pairs, []);
    } else if (word === "gone") {
      robot.gone = new Set(rest.slice(1));
    } else if (word === "blocked") {
      robot.blocked = new Map();
      for (let i = 1; i + 3 < rest.length; i += 4) {
        robot.blocked.set(rest.slice(i, i + 3).join(" "), Number(rest[i + 3]));
      }
    } else if (word === "obstacles") {
      robot.placed = [];
      for (let i = 1; i + 2 < rest.length; i += 3) robot.placed.push(rest.slice(i, i + 3).join(" "));
    } else if (word === "queue") {
      robot.queue = [];
      for (let i = 1; i + 1 < rest.length; i += 2) {
        robot.queue.push({ order: rest[i], product: rest[i + 1] });
      }
    } else if (word === "truth") {
      const [x, y, heading, carrying] = rest;
      robot.truth = { x: Number(x), y: Number(y), heading: Number(heading), carrying };
    } else if (word === "latency") {
      const [longest, ...counted] = rest.map(Number);
      // Without a frame measured there is no new figure.
      if (counted.length > 0) robot.latency = { p50: quantile(0.5, counted, longest), p99: quantile(0.99, counted, longest) };
    } else if (word === "sensors") {
      robot.sensors = Array.from({ length: rest.length / 4 }, (_, sensor) => {
        const [reading, lowest, highest, both] = rest.slice(4 * sensor, 4 * sensor + 4).map(Number);
        return { reading, lowest, highest, both: both === 1 };
      });
    } else {
      const entry = note(robot, word, rest, Date.now() - age);
      if (entry) this.dispatchEvent(new CustomEvent("event", { detail: { robot, entry } }));
    }
  }

  emit(name) {
    this.dispatchEvent(new Event(name));
  }
}

/** Keeps what a line says that happened at a time; the entry of the log, if the line is one. */
export function note(robot, word, rest, at) {
  if (word === "thinks") robot.thinks = fields(rest);
  else if (word === "because") robot.thinks = { because: rest.join(" ") };
  if (!["event", "thought", "asked"].includes(word)) return null;
  // A thought's values come right before it.
  const entry = { at, kind: word, words: rest, values: word === "thought" ? robot.thinks : null };
  robot.thinks = null;
  robot.happened(entry);
  return entry;
}

/** The page's clock in whole ms. */
const clock = () => Math.round(performance.now());

function fields(words) {
  return Object.fromEntries(words.map((word) => word.split("=", 2)));
}

function pairs(list, word, index) {
  if (index % 2 === 0) list.push([Number(word), 0]);
  else list[list.length - 1][1] = Number(word);
  return list;
}

/** How fast it is at most for each unit of duty, in mm/s: 73 at a duty of 104 is usual, with room above. */
export const MM_PER_DUTY = 1;

/** Keeps where it was, and how far its wheels may have taken it since nobody knows. */
function stray(robot, { x_mm: x, y_mm: y, heading_deg: heading = 0, unsure_mm: unsure = 0, left_duty: left = 0, right_duty: right = 0 }, now) {
  if (x !== undefined) {
    robot.pose = { x: Number(x), y: Number(y), heading: Number(heading), unsure: Number(unsure) };
    robot.strayed = 0;
  } else if (robot.pose) {
    const seconds = Math.max(0, now - robot.stated) / 1_000;
    robot.strayed += Math.max(Number(left), Number(right)) * MM_PER_DUTY * Math.min(seconds, 60);
  }
}

/**
 * The time that this part of all frames did not exceed, in us, interpolated within its bucket. `counted` has the
 * number and the count of each bucket in turn.
 */
function quantile(part, counted, longest) {
  const upper = (bucket) => (bucket < 1 ? 256 * (bucket + 1) : (5 + ((bucket - 1) % 4)) * 2 ** (6 + Math.floor((bucket - 1) / 4))) / 1_000;
  const frames = counted.reduce((sum, count, i) => (i % 2 === 1 ? sum + count : sum), 0);
  let left = Math.max(1, Math.ceil(part * frames));
  for (let i = 0; i < counted.length; i += 2) {
    const [bucket, count] = [counted[i], counted[i + 1]];
    if (left <= count) {
      const lower = upper(bucket - 1);
      const end = bucket === 89 ? longest : upper(bucket);
      return Math.round(Math.min(longest, lower + ((end - lower) * left) / count));
    }
    left -= count;
  }
  return longest;
}

/** Keeps what the strips and the trail show. */
function remember(robot, now) {
  robot.total += 1;
  const { state } = robot;
  const figure = (key) => (state[key] === undefined ? null : Number(state[key]));
  robot.past.push({
    at: now,
    x: figure("x_mm"),
    y: figure("y_mm"),
    line_error: figure("line_error"),
    left_duty: figure("left_duty"),
    right_duty: figure("right_duty"),
    distance_cm: figure("distance_cm"),
    battery: state.battery_dv === undefined ? null : Number(state.battery_dv) / 10,
    path_p50: robot.latency?.p50 ?? null,
    path_p99: robot.latency?.p99 ?? null,
    lost: ["sensor_lost", "steering_lost", "bus_lost"].reduce((sum, key) => sum + Number(state[key] ?? 0), 0),
  });
  // A minute at twenty a second.
  if (robot.past.length > 1_400) robot.past.splice(0, 200);
}
