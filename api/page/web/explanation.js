// Why a plan steers as it does: what it does otherwise than line of sight, in a sentence.

import { degrees, number } from "./format.js";
import { isOther } from "./hand_over.js";

/** Headings and speeds that differ by less are the same, rad and m/s. */
const SAME_RAD = 0.05, SAME_MPS = 0.03;
/** Methods that steer by a plan. */
const PLANNED = ["mpc", "previous_plan"];

/**
 * @param {import("./types.js").Prediction} prediction
 * @param {{ heading: number, speed: number, method: string }} steered
 */
export function explanation({ after_s, goal, asc, line_of_sight, line_of_sight_reference: law, rms_m, line_of_sight_rms_m, cost, line_of_sight_cost, avoidance }, { heading, speed, method }) {
  // The law steers for the same manoeuvre.
  if (avoidance?.manoeuvre) return avoidanceWords(avoidance);
  if (!PLANNED.includes(method)) return "";
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
  const horizon = number(after_s.at(-1), 0, "s"), distances = `${number(rms_m, 1, "m")} to the goal (RMS), by line of sight ${number(line_of_sight_rms_m, 1, "m")}`;
  // The cost decides; a record of an earlier version does not have it.
  if (cost === undefined || line_of_sight_cost === undefined) return `${so}: until ${horizon} from now it expects ${distances}.`;
  return `${so}: until ${horizon} from now that costs ${besideLaw(cost, line_of_sight_cost)}; it expects ${distances}.`;
}

/** A predicted cost beside that of the law: bare costs have no unit that a person knows. @param {number} cost @param {number} law */
export function besideLaw(cost, law) {
  if (!Number.isFinite(cost) || !(law > 0)) return "–";
  const less = 100 * (1 - cost / law);
  return Math.abs(less) >= 0.05 ? `${number(Math.abs(less), 1, "%")} ${less > 0 ? "less" : "more"} than line of sight` : "as much as line of sight";
}

/** @param {import("./types.js").Avoidance} avoidance */
export function avoidanceWords({ sentence }) {
  return `${sentence.charAt(0).toUpperCase()}${sentence.slice(1)}.`;
}
