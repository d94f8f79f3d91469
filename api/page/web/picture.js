// The map of recordings at one moment.

import { figureEllipses, figureLine, placeMarks } from "./figure.js";
import { ageWords } from "./alarm.js";
import { auvColour } from "./dom.js";
import { number } from "./format.js";
import { noGoLines } from "./limits.js";
import { addVessels, vesselsOf } from "./traffic.js";
import { addTour, visitsAt } from "./visits.js";

/**
 * @typedef {import("./recording.js").Recording} Recording
 * @typedef {import("./series.js").Series} Series
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {{ name: string, colour: string, recording: Recording }} Run
 * @typedef {{ forecasts: boolean, goal: boolean, fixes: boolean, ghost: boolean, acoustic: boolean, bounds: boolean, paths: boolean, chart: boolean, tour: boolean, traffic: boolean }} Layers
 * @typedef {{ lines: import("./types.js").Line[], marks: import("./types.js").Mark[] }} Background
 */

/** Time that the length of an arrow stands for, s. */
const ARROW_S = 12;
/** Raw fixes are shown for so long, s. */
const FIXES_S = 300;
/** Times of the same fix differ by less, s: they are rounded. */
const SAME_FIX_S = 0.01;
/** A craft of a fleet that was not heard for so long may be elsewhere, s. */
const SILENT_S = 10;
/** A course is computed from fixes so far apart, s. */
const COURSE_S = 5;

/**
 * The map of `runs` at `t`. For one run it shows all estimates of the planner, for several only their craft.
 * @param {Run[]} runs
 * @param {number} t
 * @param {Layers} layers
 * @param {Background} background
 * @param {import("./fleet.js").Fleet} [fleet] whose craft the runs are: they are told apart as runs are, and all that is known of each is shown
 * @returns {Picture}
 */
export function pictureAt(runs, t, layers, background, fleet) {
  const first = runs[0].recording, order = [...first.places.keys()], several = runs.length > 1 || fleet !== undefined;
  const colourOf = (/** @type {string} */ id) => fleet?.colourOf(id, t) ?? auvColour(order.indexOf(id));
  /** @type {Picture} */
  const picture = {
    tracks: [], lines: [], discs: [], ellipses: [], marks: [], arrows: [], vehicles: [], current: null,
    origin: first.mission.origin ?? null, label: "",
  };
  if (layers.chart) {
    picture.lines.push(...background.lines);
    picture.marks.push(...background.marks);
  }
  bounds(picture, first, t, layers);
  const visits = visitsAt(first, t);
  // A goal that visits is an AUV, and another one after each visit.
  if (layers.goal && !fleet && !visits.schedule && visits.goal?.kind !== "visit") addTrack(picture, first.goal, t, "goal", "dashed", "goal");
  for (const [id, series] of first.places) addTrack(picture, series, t, colourOf(id), first.live ? "dotted" : "solid", id, true);
  // Where it was is in the colour of its hull, unless several runs are told apart: the plan has one of its own.
  for (const { name, colour, recording } of runs) addTrack(picture, recording.craft, t, several ? colour : "hull", "solid", name || "surface craft");
  const shown = runs.length === 1 || fleet ? runs : [], known = shown.map(({ recording }) => recording.predictionAt(t)), believed = known.find(Boolean) ?? null;
  known.forEach((each, i) => each && beliefs(picture, shown[i], each, layers, colourOf, several));
  if (layers.traffic) trueVessels(picture, first, t, believed?.prediction.vessels);
  // Every craft of a fleet knows the same vessels.
  if (believed && layers.traffic) addVessels(picture, vesselsOf(believed.prediction), believed.prediction.after_s.at(-1) ?? 0);
  if (layers.tour) known.forEach((each, i) => each && addTour(picture, each.prediction.asc[0], t, visitsAt(shown[i].recording, t), several ? shown[i].colour : ""));
  if (layers.fixes) rawFixes(picture, first, t);
  for (const run of runs) craftAt(picture, run, t, several);
  auvsAt(picture, first, t, known.flatMap((each) => each?.prediction.auvs ?? []), colourOf);
  shown.forEach((run, i) => references(picture, run, t, known[i]?.prediction, layers, several));
  for (const { recording } of runs) breaches(picture, recording, t);
  if (!layers.acoustic) picture.discs = picture.discs.filter((disc) => disc.style !== "acoustic");
  picture.label = inWords(picture, runs, t);
  return picture;
}

/** @param {Picture} picture @param {Recording} recording @param {number} t @param {Layers} layers */
function bounds(picture, recording, t, layers) {
  const { keep_outs, area, no_go } = recording.limits.at(t), { paths = {} } = recording.scene;
  if (layers.paths) for (const [id, points] of Object.entries(paths)) picture.lines.push({ points, colour: "line", style: "wide", name: `path of ${id}` });
  if (!layers.bounds) return;
  picture.lines.push(...noGoLines(no_go));
  if (area.length) picture.lines.push({ points: area, colour: "bad", style: "area", closed: true, name: "area" });
  for (const disc of keep_outs) picture.discs.push({ north: disc.north_m, east: disc.east_m, radius: disc.radius_m, colour: "bad", style: "keep-out" });
}

/**
 * @param {Picture} picture @param {Series} series @param {number} t @param {string} colour
 * @param {"solid" | "dashed" | "dotted" | "wide"} style @param {string} name @param {boolean} [byDepth] @param {boolean} [aside]
 */
function addTrack(picture, series, t, colour, style, name, byDepth = false, aside = false) {
  const to = series.indexAt(t) + 1;
  if (to < 1) return;
  const track = { t: series.column("t"), north: series.column("north"), east: series.column("east"), depth: byDepth ? series.column("depth") : undefined, length: series.length };
  picture.tracks.push({ track, from: 0, to, colour, style, byDepth, name, aside });
}

/**
 * @param {Picture} picture @param {Run} run @param {{ t_s: number, prediction: import("./types.js").Prediction }} believed @param {Layers} layers
 * @param {(auv: string) => string} colourOf @param {boolean} several of which each has its own colour
 */
function beliefs(picture, { name, recording, colour }, { t_s, prediction }, layers, colourOf, several) {
  if (layers.ghost && !several) picture.lines.push({ points: prediction.line_of_sight, colour: "los", style: "dashed", name: "line of sight" });
  // A spare craft of a fleet has none. One that visits is one of the numbered AUVs.
  const hasGoal = layers.goal && (!several || prediction.auvs.length > 0);
  if (hasGoal) picture.lines.push({ points: prediction.goal, colour: several ? colour : "goal", style: "dotted", name: "goal, forecast" });
  if (hasGoal && several && prediction.goal.length && !prediction.schedule) picture.marks.push({ north: prediction.goal[0][0], east: prediction.goal[0][1], kind: "ring", colour, title: `goal of ${name}` });
  if (layers.goal && prediction.figure) {
    picture.lines.push({ points: figureLine(prediction.figure), colour: "goal", style: "dashed", name: "figure" });
    picture.ellipses.push(...figureEllipses(prediction.figure, (id) => prediction.auvs.find((auv) => auv.id === id)?.positions[0]));
  }
  if (layers.forecasts) {
    for (const auv of prediction.auvs) {
      const colour = colourOf(auv.id);
      picture.marks.push(...placeMarks(auv.id, auv.places ?? [], colour));
      picture.lines.push({ points: auv.positions, colour, style: "dotted", name: `${auv.id}, forecast` });
      auv.covariances_m2.forEach((covariance, i) => {
        const last = auv.covariances_m2.length - 1;
        if (i % 4 && i !== last) return;
        const [north, east] = auv.positions[i];
        picture.ellipses.push({ north, east, covariance, colour });
      });
    }
  }
  picture.lines.push({ points: prediction.asc, colour, style: "solid", name: "plan" });
  if (prediction.current && !picture.current) {
    const [north_mps, east_mps] = prediction.current;
    picture.current = { north_mps, east_mps, estimated: !recording.mission.scene?.information?.includes("current known") };
  }
  for (const violation of prediction.violations) {
    const place = along(prediction, violation.t_s - t_s);
    if (place) picture.marks.push({ north: place[0], east: place[1], kind: "violation", colour: "bad", title: violationWords(violation) });
  }
}

/** @param {import("./types.js").Violation} violation */
export function violationWords(violation) {
  return `${violation.limit.replaceAll("_", " ")}${violation.pointer ? ` (${violation.pointer})` : ""}: ${number(violation.amount, 2, violation.unit)} beyond`;
}

/**
 * The position of the plan `after` seconds from its start.
 * @param {import("./types.js").Prediction} prediction
 * @param {number} after
 * @returns {[number, number] | undefined}
 */
function along({ after_s, asc }, after) {
  const i = after_s.findIndex((time) => time >= after);
  if (i <= 0) return i === 0 ? asc[0] : asc.at(-1);
  const f = (after - after_s[i - 1]) / (after_s[i] - after_s[i - 1]);
  const [[n0, e0], [n1, e1]] = [asc[i - 1], asc[i]];
  return [n0 + f * (n1 - n0), e0 + f * (e1 - e0)];
}

/** @param {Picture} picture @param {Recording} recording @param {number} t */
function rawFixes(picture, recording, t) {
  for (const [id, fixes] of recording.fixes) {
    const refused = recording.refused.get(id), times = fixes.column("t");
    for (let i = fixes.indexAt(t); i >= 0 && t - times[i] < FIXES_S; i -= 1) {
      const isRefused = refused !== undefined && times[i] - refused.at("t", times[i] + SAME_FIX_S) < SAME_FIX_S;
      picture.marks.push({
        north: fixes.column("north")[i], east: fixes.column("east")[i], kind: isRefused ? "refused" : "fix", colour: isRefused ? "bad" : "fix",
        title: `${id}: fix of ${number(t - times[i], 0, "s")} ago${isRefused ? ", refused" : ""}`,
      });
    }
  }
}

/**
 * Where other vessels of a simulated mission went; where they are, unless the planner's belief of that is drawn.
 * @param {Picture} picture @param {Recording} recording @param {number} t @param {{ id: string }[]} [believed]
 */
function trueVessels(picture, recording, t, believed = []) {
  for (const [id, series] of recording.vessels) {
    const i = series.indexAt(t);
    if (i < 0) continue;
    const colour = "soft", [north, east, heading, speed] = ["north", "east", "course", "speed"].map((column) => series.column(column)[i]);
    addTrack(picture, series, t, colour, "dotted", id, false, true);
    if (!believed.some((vessel) => vessel.id === id)) picture.vehicles.push({ kind: speed ? "vessel" : "still", north, east, heading, colour, name: id, aside: true });
  }
}

/** @param {Picture} picture @param {Run} run @param {number} t @param {boolean} several */
function craftAt(picture, { name, colour, recording }, t, several) {
  const i = recording.craft.indexAt(t);
  if (i < 0) return;
  const [north, east, heading] = ["north", "east", "heading"].map((column) => recording.craft.column(column)[i]);
  const age = t - recording.craft.column("t")[i], stale = several && recording.live && age > SILENT_S;
  picture.vehicles.push({ kind: "craft", north, east, heading, colour: several ? colour : "hull", name: several ? name : "surface craft", ...stale && { stale, note: `heard ${ageWords(age)} ago` } });
}

/** @param {Picture} picture @param {Recording} recording @param {number} t @param {import("./types.js").PredictedAuv[]} auvs @param {(auv: string) => string} colourOf */
function auvsAt(picture, recording, t, auvs, colourOf) {
  const range = recording.scene.range_max_m;
  for (const [id, series] of recording.places) {
    const i = series.indexAt(t);
    if (i < 0) continue;
    const believed = recording.live ? auvs.find((auv) => auv.id === id) : undefined;
    let [north, east] = ["north", "east"].map((column) => series.column(column)[i]);
    let depth = series.column("depth")[i];
    // A live AUV is drawn at its estimated position, not at its last fix.
    if (believed) [[north, east], depth] = [believed.positions[0], believed.depths_m[0]];
    const heading = believed && believed.positions.length > 1 ? course(believed.positions) : headingOf(series, i);
    picture.vehicles.push({ kind: "auv", north, east, heading, colour: colourOf(id), name: id, note: Number.isFinite(depth) ? `${number(depth, 1, "m")} deep` : "" });
    if (range && Number.isFinite(north)) picture.discs.push({ north, east, radius: Math.sqrt(Math.max(range ** 2 - (depth || 0) ** 2, 0)), colour: "fix", style: "acoustic" });
  }
}

/** @param {[number, number][]} points */
function course([a, b]) {
  return Math.atan2(b[1] - a[1], b[0] - a[0]);
}

/** @param {Series} series @param {number} i */
function headingOf(series, i) {
  const heading = series.columns.heading?.[i];
  if (Number.isFinite(heading)) return heading;
  const times = series.column("t");
  let before = i;
  while (before > 0 && times[i] - times[before] < COURSE_S) before -= 1;
  return before < i ? Math.atan2(series.column("east")[i] - series.column("east")[before], series.column("north")[i] - series.column("north")[before]) : 0;
}

/** @param {Picture} picture @param {Run} run @param {number} t @param {import("./types.js").Prediction | undefined} prediction @param {Layers} layers @param {boolean} several */
function references(picture, { recording, colour }, t, prediction, layers, several) {
  const craft = recording.craft.indexAt(t), plan = recording.plans.indexAt(t);
  // That of a craft of a fleet that has no plan any more is not what it does.
  if (craft < 0 || plan < 0 || (several && !prediction)) return;
  const at = { north: recording.craft.column("north")[craft], east: recording.craft.column("east")[craft] };
  const los = prediction?.line_of_sight_reference;
  if (los && layers.ghost && !several) picture.arrows.push({ ...at, heading: los.heading_rad, length_m: los.speed_mps * ARROW_S, colour: "los" });
  const [heading, speed] = ["heading", "speed"].map((column) => recording.plans.column(column)[plan]);
  picture.arrows.push({ ...at, heading, length_m: speed * ARROW_S, colour });
}

/** Where the craft was beyond a limit. @param {Picture} picture @param {Recording} recording @param {number} t */
function breaches(picture, recording, t) {
  for (const { north, east, limit, beyond } of recording.limits.brokenUntil(t)) picture.marks.push({ north, east, kind: "violation", colour: "bad", title: `${number(beyond, 2, "m")} ${limit}` });
}

/** @param {Picture} picture @param {Run[]} runs @param {number} t */
function inWords(picture, runs, t) {
  const places = picture.vehicles.map(({ name, north, east }) => `${name} at ${number(north, 0)} m north, ${number(east, 0)} m east`);
  const distances = runs.map(({ name, recording }) => `${runs.length > 1 ? `${name}: ` : ""}${number(recording.goal.at("distance", t), 1)} m from the goal`);
  return `Map, north up: ${[...places, ...distances].join("; ")}`;
}
