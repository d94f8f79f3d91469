// Other vessels: on the map, in a table, and what of them keeps a mission from looking good.

import { ageWords } from "./alarm.js";
import { el, named } from "./dom.js";
import { number } from "./format.js";

/**
 * @typedef {import("./types.js").PredictedVessel} PredictedVessel
 * @typedef {PredictedVessel & { called: string, met?: import("./types.js").Encounter, distance: number, cpa: number, tcpa: number, closes: boolean, moves: boolean }} Vessel
 */

/** Age from which a vessel that moves may be elsewhere, and from which silence is no news of traffic, s; who is at anchor reports each three minutes. */
const STALE_S = 120, QUIET_S = 180, QUIET_AT_ANCHOR_S = 360;
/** Least rate at which a distance changes, m/s, and speed of what moves, m/s. */
const CLOSES_MPS = 0.05, MOVES_MPS = 0.1;
/** A map that showed all traffic would show nothing of the craft: beside vessels that are met, it is fitted to those so near, m. */
const FITTED_M = 300;
/** Most vessels in a table. */
const ROWS_MAX = 12;

/** How each kind of encounter is told, and what the craft does until it acts. @type {{ [kind: string]: [string, string] }} */
const ENCOUNTERS = {
  head_on: ["head-on", "will give way"], crossing_give_way: ["crosses from starboard", "will give way"], crossing_stand_on: ["crosses from port", "stands on"],
  overtaking: ["is overtaken", "will keep clear"], overtaken: ["overtakes", "stands on"], keep_clear: ["in the way", "keeps clear"],
};

/**
 * The vessels of a plan: those that the craft acts for first, then other encounters, then the nearest.
 * @param {Pick<import("./types.js").Prediction, "asc" | "after_s" | "avoidance" | "vessels">} prediction
 * @returns {Vessel[]}
 */
export function vesselsOf({ asc: [from = [NaN, NaN], to], after_s: [, step], avoidance, vessels = [] }) {
  const found = vessels.map((vessel) => {
    const { id, name, position: [north, east], velocity } = vessel, met = avoidance?.encounters.find((encounter) => encounter.vessel === id);
    const [n, e] = [north - from[0], east - from[1]], [vn, ve] = [0, 1].map((i) => (velocity?.[i] ?? NaN) - (to?.[i] - from[i]) / step);
    const along = n * vn + e * ve, distance = Math.hypot(n, e), tcpa = Math.max(-along / (vn ** 2 + ve ** 2), 0) || 0;
    return {
      separation_m: met?.separation_m, ...vessel, called: name || id, met, distance, cpa: met?.cpa_m ?? Math.hypot(n + vn * tcpa, e + ve * tcpa), tcpa: met?.tcpa_s ?? tcpa,
      closes: along < -CLOSES_MPS * distance, moves: velocity !== undefined && Math.hypot(...velocity) > MOVES_MPS,
    };
  });
  const rank = (/** @type {Vessel} */ { met }) => (met?.acts ? 0 : met ? 1 : 2);
  return found.sort((a, b) => rank(a) - rank(b) || a.distance - b.distance);
}

/** Whether a vessel may be elsewhere. @param {Vessel} vessel */
function isStale({ moves, velocity, age_s }) {
  return age_s > STALE_S && (moves || !velocity);
}

/**
 * Draws vessels where they are `after` seconds from the plan, with their tracks until `horizon`.
 * @param {import("./types.js").Picture} picture @param {Vessel[]} vessels @param {number} horizon s @param {number} [after]
 */
export function addVessels(picture, vessels, horizon, after = 0) {
  for (const vessel of vessels) {
    const { called, met, position, velocity = [0, 0], moves, separation_m, distance, age_s } = vessel, stale = isStale(vessel);
    const colour = met?.acts ? "warn" : met ? "ink" : "soft", at = (/** @type {number} */ t) => /** @type {[number, number]} */ ([position[0] + velocity[0] * t, position[1] + velocity[1] * t]);
    const [north, east] = at(after), aside = !met && distance > FITTED_M, speed = moves ? number(Math.hypot(...velocity), 1, "m/s") : "";
    picture.lines.push({ points: [position, at(horizon)], colour, style: "dashed", aside: true });
    if (separation_m) picture.discs.push({ north, east, radius: separation_m, colour, style: "separation" });
    picture.vehicles.push({ kind: moves ? "vessel" : "still", north, east, heading: Math.atan2(velocity[1], velocity[0]), colour, name: called, note: stale ? `heard ${ageWords(age_s)} ago` : speed, stale, aside });
  }
}

/** @param {Vessel[]} vessels */
export function vesselTable(vessels) {
  const head = ["vessel", "now", "CPA", "TCPA"], more = vessels.length - ROWS_MAX, metres = (/** @type {number} */ value) => number(value, 0, "m");
  const bodies = vessels.slice(0, ROWS_MAX).map((vessel) => {
    const { called, met, distance, cpa, tcpa, age_s } = vessel, values = [metres(distance), metres(cpa), tcpa > 0 ? ageWords(tcpa) : "–"];
    const [kind, until] = ENCOUNTERS[met?.kind ?? ""] ?? [], meets = met ? `${kind}: the craft ${met.acts ? `acts, passes at ${metres(met.passes_m)}` : until}` : "no encounter";
    return el("tbody", { class: met?.acts ? "acts" : isStale(vessel) ? "stale" : "" }, el("tr", {}, el("th", { scope: "row" }, named(called)), values.map((text) => el("td", {}, text))),
      el("tr", {}, el("td", { colSpan: head.length }, `${meets}; heard ${ageWords(age_s)} ago`)));
  });
  return [el("table", { class: "vessels" }, el("thead", {}, el("tr", {}, head.map((name) => el("th", { scope: "col" }, name)))), bodies), more > 0 && el("p", { class: "said" }, `and ${more} farther off`)];
}

/** Until when a plan of `t_s` knows the traffic, by the last that was heard of it. @param {number} t_s @param {PredictedVessel[]} vessels */
export function knownUntil(t_s, vessels) {
  return Math.max(...vessels.map(({ age_s, velocity }) => t_s - age_s + (velocity && Math.hypot(...velocity) <= MOVES_MPS ? QUIET_AT_ANCHOR_S : QUIET_S)));
}

/**
 * What of the traffic of the last plan is not good, if anything is.
 * @param {import("./recording.js").Recording} recording
 * @returns {import("./types.js").TrafficState | undefined}
 */
export function trafficState(recording) {
  const { plans: { last }, vesselsUntil } = recording, prediction = recording.predictionAt(last)?.prediction;
  if (last > vesselsUntil) return { why: "no other vessel heard for 3 min" };
  const [near] = (prediction ? vesselsOf(prediction) : []).filter(({ distance, separation_m = 0 }) => distance < separation_m).sort((a, b) => a.distance - b.distance);
  return near && { why: "vessel too near", near: `${near.called} ${number(near.distance, 0, "m")}${near.closes ? ", closing" : ""}` };
}
