// What the planner believes of the craft, the water and the AUVs, in words.

import { bearing, degrees, number } from "./format.js";
import { scheduleWords } from "./visits.js";

/** @param {import("./types.js").Prediction} believed @returns {string[][]} */
export function beliefsOf({ current, craft, auvs, schedule, figure }) {
  const speed = current ? Math.hypot(...current) : NaN;
  return [
    ["current", current ? `${number(speed, 2, "m/s")} towards ${bearing(Math.atan2(current[1], current[0]))}` : "not known"],
    ["heading lag", number(Number(craft.heading_lag_s), 2, "s")],
    ["heading offset", number(degrees(Number(craft.heading_offset_rad)), 1, "°")],
    ["surge lag", number(Number(craft.surge_lag_s), 2, "s")],
    ["sway per yaw rate", number(Number(craft.sway_per_yaw_rate_s), 2, "s")],
    ...schedule ? scheduleWords(schedule) : [],
    ...figure ? [["figure", figure.sentence]] : [],
    ["craft follows", craft.follows ? "yes" : "no: its motion differs from the prediction"],
    ...auvs.map(({ id, drift, route, dive, covariances_m2: [first] }) => [
      id, `± ${number(Math.sqrt(((first?.[0] ?? NaN) + (first?.[2] ?? NaN)) * 2.995), 1, "m")} (95 %), drift ${number(Math.hypot(...drift), 3, "m/s")}${route ? `; ${routeWords(route)}` : ""}${dive ? `; dives from ${number(dive.depth_min_m, 0)} to ${number(dive.depth_max_m, 0, "m")}` : ""}`,
    ]),
  ];
}

/** @param {import("./types.js").RouteFit} route */
function routeWords({ probability, north_m, east_m, next_turn, repeats }) {
  const percent = number(100 * probability, 0, "%");
  const kind = repeats && { lanes: `lanes of ${number(repeats.leg_m, 0, "m")}, ${number(repeats.spacing_m, 0, "m")} apart`, laps: `laps of ${number(repeats.period_m, 0, "m")}`, other: `a pattern of ${number(repeats.period_m, 0, "m")}` }[repeats.pattern];
  const where = kind ? `found: ${kind}, ${number(repeats?.times ?? NaN, 1)} times` : `route ${number(Math.hypot(north_m, east_m), 1, "m")} off`;
  const turn = next_turn && probability >= 0.5 ? `, next turn ${number(degrees(Math.abs(next_turn.by_rad)), 0, "°")} to ${next_turn.by_rad < 0 ? "port" : "starboard"} in ${number(next_turn.in_s, 0)} ± ${number(next_turn.sigma_s, 0, "s")}` : "";
  return `${where}${turn}, follows it ${percent}`;
}
