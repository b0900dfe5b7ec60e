// The one connection to the station: its lines become a model of every robot, orders go back.
//
// What the station says, one or more lines in a message (services/panel/src/speech.rs):
//
//   you <name> driver|viewer <release of the station's program>
//   time <ms> [<here>]                the station's clock, in ms since 1970; first, and after each `here`, which it repeats
//   warehouse <json>
//   kept <where>
//   about <robot> connected=0|1 speaks=0|1 driver=<name>|- [asks=<name>] uses=<what>|- renews=0|1 [age_ms=<n>]
//   from <robot> <a line of the extension, such as state ...>
//   from <robot> asked <who> <what>   a person here wants an action, stop, take, ask, keep, free or warehouse
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

/** @import { Fields, Warehouse } from "./robot.js" */

import { fields, report } from "./report.js";
import { Robot } from "./robot.js";

/**
 * What became of something that was asked. `isUnknown`: it was given, and nobody knows what became of it.
 *
 * @typedef {object} Answer
 * @property {boolean} [done]
 * @property {string} [told] what the station adds
 * @property {number} [stopped] after so many ms the wheels had no duty
 * @property {string} [refused] why not, as a code and its values
 * @property {boolean} [isUnknown]
 * @property {boolean} [unsent]
 */

/** How often the page says that it is there, in ms. */
const HERE_MS = 1_000;
/** Said where the panel no longer knows the browser: `up` was started anew, or the cookie is gone. */
const NO_TOKEN = "no_token";
/** A clock that goes back by more than this was set, in ms. */
const SET_MS = 1_000;
/** What a robot tells again and again although nothing has happened. */
const FIGURES = new Set(["state", "latency", "truth", "health", "sensors"]);
const RETRY_MS = [250, 500, 1_000, 2_000];

export class Link extends EventTarget {
  constructor() {
    super();
    /** @type {Map<string, Robot>} */
    this.robots = new Map();
    /** @type {Warehouse | null} */
    this.warehouse = null;
    /**
     * Where the station keeps it.
     *
     * @type {string | null}
     */
    this.kept = null;
    /**
     * What the station calls this page.
     *
     * @type {string | null}
     */
    this.me = null;
    this.mayDrive = false;
    /** The release of the station's program, which brought this page too. */
    this.release = "";
    /** When the station was last heard, by this page's clock. */
    this.heard = -Infinity;
    /**
     * How long its last answer to `here` took, in ms.
     *
     * @type {number | null}
     */
    this.trip = null;
    this.open = false;
    /**
     * Why the station has closed the connection, if it has said so.
     *
     * @type {string | null}
     */
    this.closed = null;
    this.number = 0;
    /**
     * Who waits for an answer, by its number.
     *
     * @type {Map<string, (answer: Answer) => void>}
     */
    this.waiting = new Map();
    this.tries = 0;
    /** How far the station's clock is ahead of this page's, in ms; the browser's own may be wrong. */
    this.ahead = Date.now() - performance.now();
    this.isTimed = false;
    this.socket = this.connect();
    setInterval(() => this.open && this.send("here", clock()), HERE_MS);
  }

  /** This moment by the station's clock, in whole ms since 1970. */
  now() {
    return Math.round(performance.now() + this.ahead);
  }

  /**
   * The station has told its time. The way here takes some, so the most that it is ahead counts, unless it was set.
   *
   * @param {number} ms since 1970
   */
  setTime(ms) {
    const ahead = ms - performance.now();
    if (!this.isTimed || ahead > this.ahead || ahead < this.ahead - SET_MS) this.ahead = ahead;
    this.isTimed = true;
  }

  /** @returns {WebSocket} */
  connect() {
    const url = new URL("live", location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.hash = "";
    const { edition = "" } = document.documentElement.dataset;
    const name = localStorage.getItem("name");
    url.search = String(new URLSearchParams({ edition, ...(name && { name }) }));
    const socket = new WebSocket(url);
    socket.onopen = () => {
      this.open = true;
      this.tries = 0;
      this.emit("link");
    };
    socket.onmessage = (message) => {
      this.heard = performance.now();
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
      setTimeout(() => (this.socket = this.connect()), wait);
    };
    return socket;
  }

  /**
   * The person at this page is called so from now on; the station is told by a new connection.
   *
   * @param {string} name
   */
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
   * Gives an order.
   *
   * @param {"do" | "stop" | "take" | "free" | "keep" | "renew" | "warehouse"} verb
   * @param {string | null} robot one robot by its name or, with `null`, the station
   * @returns {Promise<Answer>}
   */
  ask(verb, robot, rest = "") {
    const number = ++this.number;
    if (!this.open || this.socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve(this.noted(robot, { refused: "lost", unsent: true }));
    }
    this.send(verb, robot, number, rest);
    return new Promise((settle) => {
      this.waiting.set(String(number), (answer) => settle(this.noted(robot, answer)));
    });
  }

  /**
   * Keeps what was refused among what has happened.
   *
   * @param {string | null} robot
   * @param {Answer} answer
   */
  noted(robot, answer) {
    const { refused } = answer;
    const asked = this.robots.get(robot ?? "");
    // A command that is given again and again is refused as often.
    const last = asked?.events.at(-1);
    const isSame = last?.kind === "refused" && last.words[0] === refused;
    if (asked && refused && !isSame) asked.happened({ at: this.now(), kind: "refused", words: [refused], values: null });
    return answer;
  }

  /**
   * Has a robot do something.
   *
   * @param {Robot} robot
   * @param {string} action
   */
  act(robot, action) {
    return this.ask("do", robot.name, `${clock()} ${action}`);
  }

  /** @param {(string | number | null)[]} words */
  send(...words) {
    this.socket.send(words.filter((word) => word !== "" && word !== null).join(" "));
  }

  /** Bytes that the browser has not sent yet: a dead link shows here first. */
  get backlog() {
    return this.socket.bufferedAmount;
  }

  /** @param {string} line */
  hear(line) {
    const [word, first = "", ...rest] = line.split(" ");
    if (word === "from") {
      const [what = "", ...more] = rest;
      const robot = this.robot(first);
      const { turns } = robot;
      report(robot, what, more, performance.now(), this.now());
      if (!FIGURES.has(what) || robot.turns !== turns) this.emit("news");
    } else if (word === "past") {
      const [age, what = "", ...more] = rest;
      report(this.robot(first), what, more, performance.now(), this.now() - Number(age));
    } else if (word === "about") {
      this.about(this.robot(first), fields(rest));
    } else if (word === "answer") {
      this.emit("news");
      this.answer(first, rest);
    } else if (word === "time") {
      this.setTime(Number(first));
      if (rest[0]) this.trip = clock() - Number(rest[0]);
      for (const robot of this.robots.values()) robot.pace.station(Number(first));
    } else if (word === "warehouse") {
      this.warehouse = JSON.parse(line.slice("warehouse ".length));
      this.emit("warehouse");
    } else if (word === "kept") {
      this.kept = line.slice("kept ".length);
    } else if (word === "you") {
      // All that has happened is told after this.
      for (const robot of this.robots.values()) robot.forget();
      this.closed = null;
      this.me = first;
      this.mayDrive = rest[0] === "driver";
      this.release = rest[1] ?? "";
      this.emit("link");
    }
  }

  /**
   * The robot of a name; a new one if it has not been heard of.
   *
   * @param {string} name
   */
  robot(name) {
    let robot = this.robots.get(name);
    if (!robot) {
      robot = new Robot(name);
      this.robots.set(name, robot);
      this.emit("robots");
    }
    return robot;
  }

  /**
   * @param {Robot} robot
   * @param {Fields} said
   */
  about(robot, { age_ms: age, ...said }) {
    const told = Object.values(said).join(" ");
    if (robot.told !== told) this.emit("news");
    robot.told = told;
    robot.connected = said.connected === "1";
    robot.speaks = said.speaks === "1";
    robot.driver = said.driver === "-" ? null : said.driver ?? null;
    robot.asks = said.asks ?? null;
    robot.uses = said.uses ?? "-";
    robot.renews = said.renews === "1";
    // One that speaks only the document's language shows nothing that could be old.
    robot.heard = age === undefined ? -Infinity : performance.now() - Number(age);
  }

  /**
   * @param {string} number
   * @param {string[]} words
   */
  answer(number, [what, ...rest]) {
    const settle = this.waiting.get(number);
    this.waiting.delete(number);
    if (!settle) return;
    if (what === "done") settle({ done: true, told: rest.join(" ") });
    else if (what === "stopped") settle({ stopped: Number(rest[0]) });
    else settle({ refused: rest.join(" "), isUnknown: what === "lost" });
  }

  /** @param {"link" | "robots" | "warehouse" | "pose" | "news"} name */
  emit(name) {
    this.dispatchEvent(new Event(name));
  }
}

/** The page's clock in whole ms. */
const clock = () => Math.round(performance.now());
