// What state a robot is in, for who glances at it: one look for each, in the bar, on the map and on `/screen`.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { at } from "../parts/at.js";
import { set } from "../parts/svg.js";
import { named } from "../station/chosen.js";
import { called, crossing, failure, reason, sentence } from "../words/sentences.js";
import { put, say, span } from "../words/words.js";

/** The looks, the gravest first, each with its shape in a square of 32. */
export const SHAPES = {
  unheard: "M16 3a13 13 0 1 0 0 26a13 13 0 1 0 0-26M8 18l4-4M24 14l-4 4M11 22l2-2M19 12l2-2",
  stopped: "M10 2h12l8 8v12l-8 8H10l-8-8V10zM9 16h14",
  board: "M16 3L30 28H2zM16 12v8M16 23v2",
  lost: "M16 3L30 28H2zM13 14a3 3 0 1 1 3 4v2M16 23v2",
  needs: "M16 3L30 28H2zM16 12v8M16 23v2",
  hand: "M4 4h24v24H4zM11 17V11M14 16V9M18 16V9M21 17V12M11 17q0 6 5 6t5-6",
  waits: "M16 3a13 13 0 1 0 0 26a13 13 0 1 0 0-26M13 11v10M19 11v10",
  drives: "M16 3a13 13 0 1 0 0 26a13 13 0 1 0 0-26M11 10l12 6-12 6 3-6z",
  none: "M16 3a13 13 0 1 0 0 26a13 13 0 1 0 0-26",
};
/** @typedef {keyof typeof SHAPES} Look */
/**
 * How a state looks.
 *
 * @typedef {object} Face
 * @property {Look} look
 * @property {string | null} said its sentence
 * @property {string | null} [since] since when
 * @property {string | null} [by] who has stopped it, or why
 * @property {string | null} [proof] what shows that it stands
 * @property {string | null} [more] what there is to add
 * @property {string | null} [chip] what stands at the robot on the map
 * @property {string | null} [remedy] the name of the remedy that is told
 * @property {boolean} [isDeaf] whether STOP cannot reach it now
 */

/**
 * By the names of the robot: what holds it when it does not hear a board.
 *
 * @type {["sensor" | "steering", string][]}
 */
const HELD_BY = [["sensor", "blind"], ["steering", "unheard"]];
/** A page that has asked for a stop did so within this time of it, in ms. */
const ASKED_MS = 10_000;

/**
 * An age in ms, in words that do not dance.
 *
 * @param {number} ms
 */
export const age = (ms) => (ms < 60_000 ? `${Math.max(0, Math.floor(ms / 1_000))} s` : span(ms));

/**
 * How a robot's state looks. What is old is not said as if it were so.
 *
 * @param {Pick<Link, "open" | "me" | "tries" | "closed" | "now">} link
 * @param {Robot | null} robot
 * @param {number} now
 * @returns {Face}
 */
export function face(link, robot, now) {
  if (!link.open && link.me === null && link.tries === 0) return { look: "none", said: sentence("face_connecting") };
  if (!link.open && !robot) return { look: "unheard", said: sentences(lost(link)), remedy: tooOld(link) };
  if (robot && (!link.open || ((robot.speaks || !robot.connected) && robot.isStale(now)))) {
    const why = link.open ? sentence("face_unheard", { robot: robot.name }) : sentences(lost(link));
    const remedy = tooOld(link);
    const old = [robot.heard, robot.stated].filter(Number.isFinite);
    const heard = old.length ? age(now - Math.min(...old)) : null;
    const before = does(robot).join(", ");
    const last = heard ? say("age", heard) : say("unheard");
    return {
      look: "unheard",
      said: why,
      since: link.open && heard ? sentence("face_since", { age: heard }) : null,
      isDeaf: link.open && !robot.connected,
      more: sentences(link.open && heard ? null : last, before && sentence("face_before", { before })),
      chip: heard && sentence("face_seen", { age: heard }),
      remedy,
    };
  }
  const wanted = link.me && named();
  if (!robot) return { look: "none", said: wanted ? say("not_here", wanted) : say("no_robot") };
  if (!robot.speaks) return { look: "none", said: say("plain") };
  const { phase, remedy, hold, x_mm: x } = robot.state;
  const boards = silent(robot);
  const why = failure({ ...robot.state, failure_node: robot.state.node });
  // Stop and mode stand beside it.
  const end = remedy === undefined || ["none", "resume", "mode"].includes(remedy) ? null : sentence(`remedy_${remedy}`);
  const unknown = phase && x === undefined && phase !== "waiting_for_map";
  if (robot.state.stopped === "1") return { look: "stopped", ...stopped(link, robot, [...boards, why, end]), chip: sentence("face_stands"), remedy: end && remedy };
  const [holder] = HELD_BY.find(([, held]) => hold === held) ?? [];
  const needs = (why && phase !== "picking") || end || phase === "stuck";
  const look = boards.length || holder ? "board" : unknown ? "lost" : needs ? "needs" : idle(robot);
  const board = boards[0] ?? (holder && unheard(holder));
  const chip = look === "board" ? board : look === "lost" ? say("place_unknown") : null;
  const [said, ...rest] = does(robot);
  return { look, said, more: sentences(...rest, ...boards, why, end), chip, remedy: end && remedy };
}

/**
 * Each with a capital; those that are none left out.
 *
 * @param {(string | null | undefined | false)[]} all
 */
const sentences = (...all) => all.flatMap((one) => (one ? [one.charAt(0).toUpperCase() + one.slice(1)] : [])).join(". ");

/** @param {string} board */
const unheard = (board) => say("board_lost", say(`board_${board}`));

/**
 * @param {Robot} robot
 * @returns {Look}
 */
function idle({ state: { mode, phase } }) {
  if (mode === "manual") return "hand";
  return !phase || phase.startsWith("waiting") || phase === "picking" ? "waits" : "drives";
}

/**
 * The boards that are not heard, unless the reason why it stands says so.
 *
 * @param {Robot} robot
 */
function silent({ state }) {
  const boards = HELD_BY.filter(([board, held]) => state[`${board}_up`] === "0" && state.hold !== held);
  return boards.map(([board]) => unheard(board));
}

/**
 * Why a robot stands, and what it does, in words.
 *
 * @param {Robot} robot
 * @returns {[string, ...string[]]}
 */
function does({ state: { mode, phase, next, product, hold, stopped: isStopped } }) {
  const isByHand = mode === "manual";
  const act = isByHand ? say("by_hand") : phase === "driving" && !next ? say("drives") : sentence(`phase_${phase}`, { node: crossing(next) }) ?? "";
  const held = hold && hold !== "none" && sentence(`hold_${hold}`);
  const isHalted = isStopped === "1";
  const fetches = product !== undefined && say(isHalted || isByHand ? "was_to_fetch" : "fetches", product);
  const said = isHalted ? [say("stopped_short"), fetches] : [[act, fetches].filter(Boolean).join(", ")];
  const [first = "", ...rest] = [!isHalted && held, ...said, isHalted && held].flatMap((one) => one || []);
  return [first, ...rest];
}

/**
 * A latched stop: since when, by whom or why, and that the wheels stand.
 *
 * @param {Pick<Link, "me" | "now">} link
 * @param {Robot} robot
 * @param {(string | null)[]} more
 */
function stopped(link, robot, more) {
  const { left_duty: left, right_duty: right, stood_ms: ms } = robot.state;
  const since = robot.stoppedSince === null ? null : sentence("face_ago", { age: age(link.now() - robot.stoppedSince) });
  const by = stopper(link, robot);
  const turns = Number(left) || Number(right) ? "turn" : ms === undefined ? "stand" : "stood";
  const proof = left === undefined ? null : sentence(`face_wheels_${turns}`, { ms });
  const [said, ...rest] = does(robot);
  return { said, since, by: by ? sentence("face_by", { by }) : causeOf(robot), proof, more: sentences(...rest, ...more) };
}

/**
 * The name of who has ordered a stop; null where nobody has.
 *
 * @param {Pick<Link, "me">} link
 * @param {Robot} robot
 */
function stopper(link, { state: { stop_cause: cause, stop_by: by }, events, stoppedSince: since }) {
  if (cause !== "ordered") return null;
  if (by !== "comm") return by ? called(by) : null;
  const asked = events.findLast(({ kind, words, at }) => kind === "asked" && words[1] === "stop" && Math.abs(at - (since ?? at)) < ASKED_MS);
  return asked ? called(asked.words[0] ?? "", link.me) : called(by);
}

/**
 * Why a robot was stopped, in words.
 *
 * @param {Robot} robot
 */
export const causeOf = ({ state: { stop_cause: cause } }) => (cause !== "none" && sentence(`stop_cause_${cause}`)) || "";

/**
 * The remedy of a page that is of another version than the panel.
 *
 * @param {Pick<Link, "open" | "closed">} link
 */
const tooOld = (link) => (!link.open && link.closed === "other_language" ? "reload" : null);

/**
 * Why there is no connection.
 *
 * @param {Pick<Link, "closed">} link
 */
const lost = (link) => (link.closed ? reason(link.closed) : say("lost"));

/**
 * Shows a state in the page. What became of a stop stands in the place of the proof.
 *
 * @param {Face} face
 * @param {Robot | null} robot
 */
export function show({ look, said, since, by, proof, more, isDeaf }, robot) {
  const { body } = document;
  set(body, "data-look", look);
  body.classList.toggle("stale", look === "unheard" || look === "none");
  body.classList.toggle("stopped", robot?.state.stopped === "1");
  set(at("shape"), "d", SHAPES[look]);
  put(at("doing"), said ?? "");
  put(at("since"), since ?? "");
  const told = at("stop-said").textContent ? null : proof;
  const words = sentences([by, told].filter(Boolean).join("; "), more);
  put(at("more"), words && at("stop-said").textContent ? `${words}.` : words);
  const name = robot?.name ?? named() ?? "";
  put(at("stop-word"), say("stop"));
  put(at("stop-whom"), (isDeaf && sentence("face_deaf", { robot: name })) || name);
}
