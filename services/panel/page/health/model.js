// What the Health view says of a robot, from what robot and station tell. Nothing here draws.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { age } from "../bar/face.js";
import { called, reason, sentence } from "../words/sentences.js";
import { say } from "../words/words.js";

/**
 * @typedef {"good" | "bad" | "unknown"} Mark
 * @typedef {{ id: string, mark: Mark, name: string, value: string, said?: string, board?: string }} Row a subject, its
 *   value, where it is not good what is wrong and what helps, and the board that can be restarted there
 */

/** Later than this a health is old, in ms; a robot tells it once a second. */
const OLD_MS = 3_000;
/** Started again more often than this a service is ill. */
const OFTEN = 3;
/**
 * What the robot does without a board, by the names of its remedies.
 *
 * @type {["sensor" | "steering", string][]}
 */
const BOARDS = [["sensor", "remedy_light"], ["steering", "remedy_report"]];

/**
 * Whether what the robot told of its health may no longer be shown as true.
 *
 * @param {Robot} robot
 * @param {number} now
 */
export const isOld = (robot, now) => robot.isStale(now) || now - robot.healthAt > OLD_MS;

/**
 * The links from this page to the boards, the first that is cut with what helps.
 *
 * @param {Pick<Link, "open" | "closed" | "me" | "heard" | "trip">} link
 * @param {Robot | null} robot
 * @param {number} now
 * @returns {Row[]}
 */
export function chain(link, robot, now) {
  const isHeard = Boolean(robot && link.open && robot.connected && !robot.isStale(now));
  /** @param {number} at */
  const seen = (at) => (Number.isFinite(at) ? age(now - at) : say("unheard"));
  /** @param {string | number | null | undefined} ms */
  const trip = (ms) => (ms === undefined || ms === null ? "" : say("health_trip", ms));
  /** @type {Row[]} */
  const rows = [{ id: "page", mark: "good", name: say("health_page"), value: link.me ? called(link.me, null) : "" }];
  rows.push({
    id: "station",
    mark: link.open ? "good" : "bad",
    name: say("health_station"),
    value: link.open ? trip(link.trip) : seen(link.heard),
    said: link.open ? "" : `${link.closed ? reason(link.closed) : say("lost")}. ${say("health_station_helps")}`,
  });
  if (!robot) return rows;
  rows.push({
    id: "robot",
    mark: isHeard ? "good" : link.open ? "bad" : "unknown",
    name: robot.name,
    value: isHeard ? trip(robot.health?.trip_ms) : seen(robot.heard),
    said: isHeard || !link.open ? "" : say("health_robot_helps"),
  });
  for (const [board, remedy] of BOARDS) {
    const isUp = robot.state[`${board}_up`] === "1";
    const heard = robot.health?.[`${board}_age_ms`];
    // Since the robot told so, the board's silence has gone on.
    const silence = heard === undefined ? say("unheard") : age(Number(heard) + now - robot.healthAt);
    rows.push({
      id: board,
      mark: !isHeard ? "unknown" : isUp ? "good" : "bad",
      name: say(`board_${board}`),
      value: isHeard && isUp ? say("health_heard") : isHeard ? silence : seen(robot.stated),
      said: isHeard && !isUp ? sentence(remedy) ?? "" : "",
    });
  }
  return rows;
}

/**
 * The robot's processes that are started again when they die.
 *
 * @param {Pick<Robot, "health">} robot
 * @returns {Row[]}
 */
export function services({ health }) {
  const told = health?.services?.split(",").filter(Boolean) ?? [];
  return told.map((one) => {
    const [name = "", state, since, restarts] = one.split(":");
    const isUp = state === "up";
    const isOften = Number(restarts) >= OFTEN;
    const long = age(Number(since) * 1_000);
    return {
      id: name,
      mark: isUp && !isOften ? "good" : "bad",
      name: sentence(`service_${name}`) ?? name,
      value: [isUp ? say("health_runs", long) : say("health_died", long), Number(restarts) && say("health_restarts", restarts)].filter(Boolean).join(" \u00b7 "),
      said: isUp ? (isOften ? say("health_often") : "") : say("health_down"),
    };
  });
}

/**
 * What is lost and damaged on the links.
 *
 * @param {Pick<Robot, "state" | "health">} robot
 * @returns {Row[]}
 */
export function losses({ state, health }) {
  /** @type {Row[]} */
  const boards = BOARDS.map(([board]) => {
    const [lost, damaged, restarts] = [state[`${board}_lost`], health?.[`${board}_damaged`], health?.[`${board}_restarts`]];
    const value = lost === undefined ? say("unheard") : say("health_lost", lost, damaged ?? "\u2013", restarts ?? "\u2013");
    return { id: `lost-${board}`, mark: lost === undefined ? "unknown" : "good", name: say(`board_${board}`), value, board };
  });
  return [...boards, { id: "lost-bus", mark: state.bus_lost === undefined ? "unknown" : "good", name: say("health_between"), value: say("health_missed", state.bus_lost ?? "\u2013") }];
}

/**
 * Load and memory of the robot's machine, and what is wrong with it.
 *
 * @param {Pick<Robot, "health">} robot
 * @returns {Row[]}
 */
export function machine({ health }) {
  const { load_percent: load, cores, memory_mib: all, memory_free_mib: free, found } = health ?? {};
  /** @type {Row[]} */
  const rows = [];
  const findings = found?.split(",").filter(Boolean).map((one) => one.split(":")) ?? [];
  if (load !== undefined) rows.push({ id: "load", mark: "good", name: say("health_load"), value: say("health_load_of", load, cores) });
  if (all !== undefined) rows.push({ id: "memory", mark: "good", name: say("health_memory"), value: say("health_memory_of", free, all) });
  for (const [code = "", seen] of findings) {
    rows.push({ id: code, mark: "bad", name: say("health_finding"), value: "", said: sentence(`finding_${code}`, { seen }) ?? code });
  }
  if (found !== undefined && !findings.length) rows.push({ id: "found", mark: "good", name: say("health_findings"), value: say("health_nothing") });
  return rows;
}

/**
 * The releases of the programs, and the packets that the boards speak. This page is of the station's release: one of
 * another version is sent away.
 *
 * @param {Pick<Link, "release">} link
 * @param {Robot | null} robot
 * @returns {Row[]}
 */
export function versions(link, robot) {
  /** @type {Row[]} */
  const rows = [{ id: "release-station", mark: link.release ? "good" : "unknown", name: say("health_station"), value: link.release || "\u2013" }];
  if (!robot) return rows;
  const release = robot.health?.release;
  const isApart = Boolean(link.release) && release !== undefined && release !== link.release;
  rows.push({ id: "release-robot", mark: release === undefined ? "unknown" : isApart ? "bad" : "good", name: robot.name, value: release ?? "\u2013", said: isApart ? say("health_update") : "" });
  for (const [board] of BOARDS) {
    const [version, build, fits] = [robot.health?.[`${board}_version`], robot.health?.[`${board}_build`], robot.health?.program_build];
    const value = version === undefined ? "\u2013" : version === "0" ? say("health_original") : say("health_packets", version, build ?? "\u2013");
    // An original board has no build number, and a robot of an earlier release tells none.
    const isApart = version !== undefined && version !== "0" && build !== undefined && build !== fits;
    const helps = Number(build) < Number(fits) ? "health_board_old" : "health_board_new";
    rows.push({ id: `release-${board}`, mark: version === undefined ? "unknown" : isApart ? "bad" : "good", name: say(`board_${board}`), value, said: isApart ? say(helps, fits) : "" });
  }
  return rows;
}
