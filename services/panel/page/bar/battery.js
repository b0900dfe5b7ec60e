// The battery in words: its charge and how long that lasts where the robot tells them, else its voltage.

/** @import { State } from "../station/robot.js" */

import { decimal, minutes, say } from "../words/words.js";

/** From here on somebody should charge it, in percent and in s; the robot itself stands later. */
const LOW_PERCENT = 15;
const LOW_S = 300;

/**
 * @param {State} state of a robot
 * @returns {{ words: string, volts: string, isLow: boolean }} empty words where nothing is known
 */
export function battery({ battery_dv: decivolts, battery_percent: percent, battery_left_s: left, hold }) {
  const volts = decivolts === undefined ? "" : say("volts", decimal(Number(decivolts) / 10));
  const isHeld = hold === "battery";
  const isLow = isHeld || (percent !== undefined && Number(percent) <= LOW_PERCENT) || (left !== undefined && Number(left) <= LOW_S);
  const charge = percent === undefined ? volts : `${percent} %`;
  const time = left === undefined || isHeld ? "" : `, ≈ ${lasts(Number(left))}`;
  return { words: charge && (isLow ? say("battery_low", charge + time) : charge + time), volts, isLow };
}

/**
 * Minutes are enough until it is nearly empty.
 *
 * @param {number} seconds
 */
const lasts = (seconds) => (seconds < 120 ? minutes(seconds * 1_000) : say("in_minutes", Math.round(seconds / 60)));
