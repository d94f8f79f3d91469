// Why a plan steers as it does: what it does otherwise than line of sight, in a sentence.

import { degrees, number } from "./format.js";
import { isOther } from "./hand_over.js";

/** Headings and speeds that differ by less are the same, rad and m/s. */
const SAME_RAD = 0.05, SAME_MPS = 0.03;

/**
 * @param {import("./types.js").Prediction} prediction
 * @param {{ heading: number, speed: number }} steered
 */
export function explanation({ after_s, goal, asc, line_of_sight, line_of_sight_reference: law, rms_m, line_of_sight_rms_m }, { heading, speed }) {
  const apart = (/** @type {[number, number][]} */ track, /** @type {number} */ i) => Math.hypot(track[i][0] - goal[i][0], track[i][1] - goal[i][1]);
  const other = goal.findIndex(([north, east], i) => i > 0 && isOther(Math.hypot(north - goal[i - 1][0], east - goal[i - 1][1]), after_s[i] - after_s[i - 1]));
  const turn = Math.atan2(Math.sin(heading - law.heading_rad), Math.cos(heading - law.heading_rad)), faster = speed - law.speed_mps;
  const turned = Math.abs(turn) > SAME_RAD && `${number(degrees(Math.abs(turn)), 0, "°")} more to ${turn > 0 ? "starboard" : "port"}`;
  const sped = Math.abs(faster) > SAME_MPS && `${number(Math.abs(faster), 2, "m/s")} ${faster > 0 ? "faster" : "slower"}`;
  const how = [turned, sped].filter(Boolean).join(" and "), so = how ? `The plan steers ${how} than line of sight would` : "Plan and line of sight steer the same";
  if (other > 0 && line_of_sight.length > other) {
    return `${so}: within ${number(after_s[other], 0, "s")} the goal is another one, ${number(apart(asc, other), 0, "m")} from the craft on the plan, ${number(apart(line_of_sight, other), 0, "m")} by line of sight.`;
  }
  if (!how) return `${so}.`;
  return `${so}: until ${number(after_s.at(-1), 0, "s")} from now it expects ${number(rms_m, 1, "m")} to the goal (RMS), by line of sight ${number(line_of_sight_rms_m, 1, "m")}.`;
}
