// How a craft goes on: between its reports, and from one goal to the next.

/** @typedef {import("./series.js").Series} Series */

/** A craft that is so much farther from its goal than it was has left it, m. */
const LEFT_M = 1;
/** It was still at the goal while it was within this of the least distance, m. */
const AT_GOAL_M = 0.5;
/** A craft that was never so near had not come to its goal, m. */
const NEAR_M = 5;

/** Speed above which a goal jumped, m/s. */
export const GOAL_SPEED_MAX_MPS = 3;
/** By how much farther it moves when it is another one, m. */
const GOAL_JUMPS_M = 5;

/** Whether a goal that moved so far in that time is another one. @param {number} moved @param {number} took */
export function isOther(moved, took) {
  return moved > GOAL_SPEED_MAX_MPS * took + GOAL_JUMPS_M;
}

/** Where the craft is at `t`, if it went on as it last reported, but for the current. @param {Series} craft @param {number} t @returns {[number, number]} */
export function carriedOn(craft, t) {
  const [then, north, east, heading, speed, sway] = ["t", "north", "east", "heading", "speed", "sway"].map((name) => craft.at(name, t)), after = t - then;
  if (!(after > 0)) return [north, east];
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)], [surge, across] = [after * speed, after * (sway || 0)];
  return [north + surge * cos - across * sin, east + surge * sin + across * cos];
}

/**
 * For how long the craft had been leaving its goal for the coming one at the row `last`, s; 0 if it had not.
 * A craft that its goal outruns goes away from it too, but comes nearer to where it is now.
 * @param {Series} goal @param {Series} craft @param {number} last @param {[number, number]} coming
 */
export function leftBefore(goal, craft, last, coming) {
  const [distance, times] = ["distance", "t"].map((name) => goal.column(name));
  let least = last;
  for (let i = last; i >= 0 && distance[i] < distance[least] + LEFT_M; i -= 1) if (distance[i] < distance[least]) least = i;
  if (!(distance[last] > distance[least] + LEFT_M && distance[least] < NEAR_M)) return 0;
  let left = last;
  while (left > least && distance[left] > distance[least] + AT_GOAL_M) left -= 1;
  const nearer = ([north, east] = coming) => {
    const off = (/** @type {number} */ t) => Math.hypot(craft.at("north", t) - north, craft.at("east", t) - east);
    return off(times[left]) - off(times[last]);
  };
  const toComing = nearer(), toFormer = nearer([goal.column("north")[last], goal.column("east")[last]]);
  return toComing > 0 && toComing > toFormer + LEFT_M ? times[last] - times[left] : 0;
}
