// What the lines of a station tell of a robot, taken over into the model of it.

/** @import { Entry, Fields, Robot } from "./robot.js" */

import { quantile } from "./quantile.js";

/**
 * The `key=value` words of a line.
 *
 * @param {string[]} words
 * @returns {Fields}
 */
export function fields(words) {
  return Object.fromEntries(words.map((word) => word.split("=", 2)));
}

/**
 * Words in groups of so many; what is left over is none.
 *
 * @param {string[]} words
 * @param {number} size
 */
function groups(words, size) {
  return Array.from({ length: Math.floor(words.length / size) }, (_, group) => words.slice(group * size, (group + 1) * size));
}

/**
 * Those that tell what is so now, by their first word. Before a list stands the number of its items.
 *
 * @type {Record<string, (robot: Robot, words: string[], now: number, at: number) => void>}
 */
const NOW = {
  state: (robot, words, now, at) => robot.become(fields(words), now, at),
  route(robot, [, ...words]) {
    robot.route = groups(words, 2).map(([x, y]) => [Number(x), Number(y)]);
  },
  gone(robot, [, ...words]) {
    robot.gone = new Set(words);
  },
  blocked(robot, [, ...words]) {
    robot.blocked = new Map(groups(words, 4).map((way) => [way.slice(0, 3).join(" "), Number(way[3])]));
  },
  obstacles(robot, [, ...words]) {
    robot.placed = groups(words, 3).map((way) => way.join(" "));
  },
  queue(robot, [, ...words]) {
    robot.queue = groups(words, 2).map(([order = "", product = ""]) => ({ order, product }));
  },
  health: (robot, words, now) => robot.tellsHealth(fields(words), now),
  truth(robot, [x, y, heading, carrying]) {
    robot.truth = { x: Number(x), y: Number(y), heading: Number(heading), carrying };
  },
  latency(robot, words) {
    const [longest = 0, ...counted] = words.map(Number);
    robot.frames.add(longest, counted);
    // Without a frame measured there is no new figure.
    if (counted.length > 0) robot.latency = { p50: quantile(0.5, counted, longest), p99: quantile(0.99, counted, longest) };
  },
  commission(robot, words) {
    robot.commission = fields(words);
  },
  found(robot, words) {
    robot.found = words;
  },
  kept(robot, words) {
    robot.kept.push(words);
  },
  sensors(robot, words) {
    robot.sensors = groups(words, 4).map((sensor) => {
      const [reading = 0, lowest = 0, highest = 0, both] = sensor.map(Number);
      return { reading, lowest, highest, both: both === 1 };
    });
  },
};

/**
 * Takes over a line that tells of a robot.
 *
 * @param {Robot} robot
 * @param {string} word the first word of the line
 * @param {string[]} rest
 * @param {number} now when it came, by this page's clock
 * @param {number} at the same in ms since 1970, or, of what is long over, when it was
 */
export function report(robot, word, rest, now, at) {
  if (Object.hasOwn(NOW, word)) return NOW[word]?.(robot, rest, now, at);
  note(robot, word, rest, at - robot.pace.waited);
}

/**
 * Keeps what a line says that happened at a time.
 *
 * @param {Pick<Robot, "thinks" | "happened">} robot
 * @param {string} word
 * @param {string[]} rest
 * @param {number} at in ms since 1970
 * @returns {Entry | null} the entry of the log, if the line is one
 */
export function note(robot, word, rest, at) {
  if (word === "thinks") robot.thinks = fields(rest);
  else if (word === "because") robot.thinks = { because: rest.join(" ") };
  // What a person has asked for in a terminal is told by the robot, behind the crossing where it was.
  if (word === "event" && rest[0] === "asked") return note(robot, "asked", rest.slice(5), at);
  if (word !== "event" && word !== "thought" && word !== "asked") return null;
  // A thought's values come right before it.
  /** @type {Entry} */
  const entry = { at, kind: word, words: rest, values: word === "thought" ? robot.thinks : null };
  robot.thinks = null;
  robot.happened(entry);
  return entry;
}
