// Setting up a robot: it asks a person at its side one thing after the other, and shows what its sensors read meanwhile.
// The robot decides everything (services/commission); this view shows what it tells, and gives the answers. It is a script
// of its own, which comes when somebody opens the view first (later.js).

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { Answers } from "./answers.js";
import { Live } from "./live.js";
import { button, element } from "./make.js";
import { field, found, saved, sentence, steps, word } from "./said.js";
import { make, set } from "../parts/svg.js";
import { reason } from "../words/sentences.js";
import { current, put } from "../words/words.js";

/** How often the page says that the person is there, in ms: while the robot may move by it, and else. */
const [HERE_MOVING_MS, HERE_MS] = [100, 1_000];
/** So long after an answer it may move before this page hears of it, in ms. */
const MAY_MOVE_MS = 3_000;
/** A tick in a square of 24. */
const TICK = "M6 12.5l4 4 8-9";

export class Commission {
  /**
   * @param {HTMLElement} view
   * @param {Link} link
   */
  constructor(view, link) {
    this.view = view;
    this.link = link;
    /** @type {Robot | null} */
    this.robot = null;
    this.language = "";
    /** What was refused last, and what was asked then. */
    this.refused = { said: "", at: "" };
    this.isLeaving = false;
    /** What there is to choose. */
    this.can = "";
    this.hereAt = -Infinity;
    this.answeredAt = -Infinity;
    const look = document.createElement("link");
    Object.assign(look, { rel: "stylesheet", href: new URL("commission/commission.css", document.baseURI).href });
    document.head.append(look);

    view.setAttribute("aria-labelledby", "commission-title");
    this.list = element(element(view, "nav"), "ol", "steps");
    const main = element(view, "div", "work");
    const head = element(main, "header");
    this.title = element(head, "h2");
    this.title.id = "commission-title";
    this.place = element(head, "p", "quiet");
    this.question = element(main, "p", "question");
    this.question.setAttribute("role", "status");
    this.why = element(main, "p", "why");
    this.why.setAttribute("role", "alert");
    this.live = new Live(element(main, "div", "drawing"));
    this.shows = element(main, "p", "shows");
    const foot = element(main, "footer");
    this.answers = new Answers(element(foot, "div", "answers"), (answer) => this.answer(answer), () => this.send("stand"), () => this.hold());
    this.said = element(foot, "p", "said");
    this.said.setAttribute("role", "alert");
    this.ways = element(foot, "p", "row");
    // A key that is held answers once.
    view.addEventListener("keydown", (event) => event.key === "Enter" && event.repeat && event.preventDefault());
    setInterval(() => this.stay(performance.now()), HERE_MOVING_MS);
  }

  /** Whether this page has the wheel of the robot in view. */
  get isMine() {
    return this.robot !== null && this.robot.driver === this.link.me && this.link.open;
  }

  /**
   * Says that the person is there, as long as this view is open and seen.
   *
   * @param {number} time
   */
  stay(time) {
    const { robot, link } = this;
    const how = robot?.commission;
    if (!robot || !how?.step || !this.isMine || this.view.hidden || document.hidden) return;
    const mayMove = how.moves === "1" || time - this.answeredAt < MAY_MOVE_MS;
    if (!mayMove && time - this.hereAt < HERE_MS) return;
    this.hereAt = time;
    // Nobody waits for an answer: where it does not arrive, the robot stands.
    link.send("do", robot.name, ++link.number, Math.round(time), "commission here");
  }

  /**
   * Says something to the commissioning.
   *
   * @param {string} words
   * @returns {Promise<boolean>} whether it is taken
   */
  async send(words) {
    const { robot, link } = this;
    if (!robot) return false;
    const at = robot.commission?.asked ?? "";
    const { refused } = await link.act(robot, `commission ${words}`);
    this.refused = { said: refused ? reason(refused) : "", at };
    return !refused;
  }

  /** @param {string} answer */
  async answer(answer) {
    const asked = this.robot?.commission?.asked;
    if (asked === undefined) return;
    this.answers.taken();
    this.answeredAt = performance.now();
    if (!(await this.send(`answer ${asked} ${answer}`))) this.answers.refused();
  }

  /** A button is held: what it moves goes on for a moment. */
  hold() {
    const { robot, link } = this;
    const asked = robot?.commission?.asked;
    if (!robot || asked === undefined || !this.isMine) return;
    // Nobody waits for an answer: where it does not arrive, the arm stands.
    link.send("do", robot.name, ++link.number, Math.round(performance.now()), `commission answer ${asked} hold`);
  }

  /**
   * Takes the wheel if nobody has it, and begins.
   *
   * @param {"begin" | "undo" | "restart"} what
   */
  async begin(what) {
    if (await this.take()) await this.send(what);
  }

  async take() {
    const { robot, link } = this;
    if (!robot) return false;
    if (this.isMine) return true;
    const { refused } = await link.ask("take", robot.name);
    this.refused = { said: refused ? reason(refused) : "", at: robot.commission?.asked ?? "" };
    return !refused;
  }

  async manual() {
    const { robot, link } = this;
    if (!robot || !(await this.take())) return;
    const { refused } = await link.act(robot, "mode manual");
    this.refused = { said: refused ? reason(refused) : "", at: robot.commission?.asked ?? "" };
  }

  /** Saves the description that was found out, for another machine. */
  save() {
    const blob = new Blob([saved(this.robot?.kept ?? [])], { type: "application/toml" });
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(blob);
    anchor.download = "robot.toml";
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 1_000);
  }

  /**
   * @param {Robot | null} robot
   * @param {number} time
   */
  draw(robot, time) {
    if (robot !== this.robot) this.isLeaving = false;
    this.robot = robot;
    const how = robot?.commission ?? {};
    const isAtWork = how.step !== undefined;
    this.view.classList.toggle("at-work", isAtWork);
    set(this.view, "data-question", how.question ?? "");
    set(this.view, "data-asked", how.asked ?? "");
    this.view.classList.toggle("old", robot !== null && robot.isStale(time));
    if (!isAtWork) this.isLeaving = false;
    this.drawSteps(how);
    const { ended } = how;
    put(this.title, isAtWork ? sentence(`step_${how.step}`) ?? how.step ?? "" : sentence(ended ? "page_over" : "page_title") ?? "");
    put(this.place, isAtWork ? word("step", { place: how.place ?? "", steps: how.steps ?? "" }) : "");
    const asked = how.question && (sentence(`page_${how.question}`) ?? sentence(how.question) ?? how.question);
    const about = how.about === undefined ? "" : `${sentences(field(how.about) ?? "")} `;
    put(this.question, isAtWork ? about + (asked ?? field(how.shows) ?? "") : ended ? sentences(field(ended) ?? "") : word("intro"));
    put(this.why, isAtWork ? sentences(field(how.why) ?? "") : "");
    put(this.shows, isAtWork && asked ? field(how.shows) ?? "" : "");
    if (robot) this.live.draw(robot, how.step, how.shows);
    const { isMine } = this;
    this.answers.draw({ asked: how.asked, takes: how.takes, moves: how.moves === "1", language: current() }, isAtWork && isMine && !this.isLeaving, time);
    if (this.refused.at !== (how.asked ?? "")) this.refused = { said: "", at: how.asked ?? "" };
    const other = robot?.driver && !isMine ? reason(`ask_driver ${robot.driver}`) : "";
    put(this.said, sentences(this.refused.said || (isAtWork || !ended ? other : "")));
    this.drawWays(robot, isAtWork, ended ?? "");
    for (const one of this.ways.querySelectorAll(".on")) one.toggleAttribute("disabled", how.asked === undefined);
  }

  /** @param {import("../station/robot.js").Fields} how */
  drawSteps(how) {
    const names = steps();
    const results = this.robot?.found ?? [];
    if (this.list.childElementCount !== names.length || this.language !== current()) {
      this.language = current();
      this.list.replaceChildren();
      for (const name of names) {
        const item = element(this.list, "li");
        const disc = make("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, item);
        make("circle", { cx: 12, cy: 12, r: 11 }, disc);
        make("path", { d: TICK }, disc);
        make("text", { x: 12, y: 16 }, disc, names.indexOf(name) + 1);
        element(item, "strong", "", sentence(`step_${name}`) ?? name);
        element(item, "span", "unseen");
        element(item, "p");
      }
    }
    const now = names.indexOf(how.step ?? "");
    names.forEach((name, at) => {
      const item = this.list.children[at];
      if (!item) return;
      const own = found(results, name);
      const isDone = now > at || own.length > 0 || Boolean(how.ended?.startsWith("ended_kept"));
      item.classList.toggle("done", isDone && at !== now);
      item.ariaCurrent = at === now ? "step" : null;
      put(item.children[2] ?? item, isDone && at !== now ? word("done") : "");
      put(item.children[3] ?? item, sentences(own.join(". ")));
    });
  }

  /**
   * What leads from step to step, and in and out of all of it.
   *
   * @param {Robot | null} robot
   * @param {boolean} isAtWork
   * @param {string} ended
   */
  drawWays(robot, isAtWork, ended) {
    const { isMine, link } = this;
    const isManual = robot?.state.mode === "manual";
    const isFirst = robot?.commission?.step === "boards";
    const can = [isAtWork, isMine, link.mayDrive, this.isLeaving, isAtWork && isFirst && !isManual, ended, robot?.kept.length, current(), robot?.name].join(" ");
    if (this.can === can) return;
    this.can = can;
    const hadFocus = this.ways.contains(document.activeElement);
    this.ways.replaceChildren();
    /** @type {(does: string, press: () => void, className?: string) => HTMLButtonElement} */
    const add = (does, press, className = "") => button(this.ways, does, press, className);
    if (this.isLeaving) {
      element(this.ways, "span", "", word("quit_asked"));
      add("quit_yes", () => this.send("quit"));
      add("quit_no", () => this.leave(false)).focus();
    } else if (isAtWork && !isMine) {
      add("take", () => this.take(), "first");
    } else if (isAtWork) {
      if (isFirst && !isManual) add("manual", () => this.manual());
      for (const on of ["back", "again", "skip"]) add(on, () => this.answer(on), "on");
      add("quit", () => this.leave(true), "plain");
    } else {
      if (/^ended_(kept|undone)/.test(ended)) add("restart", () => this.begin("restart"), "first");
      if (ended && robot?.kept.length) add("save", () => this.save(), "save");
      add("begin", () => this.begin("begin"), ended ? "" : "first");
      add("undo", () => this.begin("undo"), "plain");
    }
    // Whoever looks on may take the description with him.
    for (const one of this.ways.querySelectorAll("button:not(.save)")) one.toggleAttribute("disabled", !link.mayDrive);
    if (hadFocus && !this.ways.contains(document.activeElement)) this.ways.querySelector("button")?.focus();
  }

  /** @param {boolean} isLeaving */
  leave(isLeaving) {
    this.isLeaving = isLeaving;
    this.draw(this.robot, performance.now());
  }
}

/**
 * With a capital.
 *
 * @param {string} text
 */
const sentences = (text) => text.charAt(0).toUpperCase() + text.slice(1);
