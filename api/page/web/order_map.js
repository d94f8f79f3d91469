// Orders on the map: handles to move and size what is ordered, and what is drawn anew.

import { GOALS, withValue } from "./order_draft.js";

/**
 * @typedef {import("./types.js").Place} Place
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {import("./order_draft.js").Setting} Setting
 * What a drag of a handle makes of the setting.
 * @typedef {Place & { drag: (at: Place) => Partial<Setting> }} Handle
 */

/** Radius of a disc that is tapped, m. */
const TAPPED_M = 10;

/** Metres as a map gives them. @param {number} metres */
function tenth(metres) {
  return Number(metres.toFixed(1));
}

/** @param {Place} a @param {Place} b */
function between(a, b) {
  return Math.hypot(a.north - b.north, a.east - b.east);
}

/** Where to move and to size what `section` has. @param {string} section @param {Setting} setting @param {Picture} picture @returns {Handle[]} */
export function handlesOf(section, setting, picture) {
  if (section === "keep_outs") {
    return setting.keep_outs.flatMap((disc, i) => {
      const centre = { north: disc.north_m, east: disc.east_m }, put = (/** @type {object} */ part) => ({ keep_outs: setting.keep_outs.map((other, k) => (k === i ? { ...disc, ...part } : other)) });
      return [{ ...centre, east: disc.east_m + disc.radius_m, drag: (at) => put({ radius_m: Math.max(tenth(between(at, centre)), 0.1) }) }, { ...centre, drag: (at) => put({ north_m: tenth(at.north), east_m: tenth(at.east) }) }];
    });
  }
  if (section === "area") return setting.area.map(([north, east], i) => ({ north, east, drag: (at) => withValue(setting, ["area", i], [tenth(at.north), tenth(at.east)]) }));
  if (section !== "goal") return [];
  const { goal } = setting, anchor = anchorOf(goal, picture), reach = reachOf(goal), [ring] = followed(goal, picture);
  /** @type {Handle[]} */
  const handles = ring && reach ? [{ north: ring.north, east: ring.east + reach[1], drag: (at) => withValue(setting, ["goal", reach[0]], Math.max(tenth(between(at, ring)), 1)) }] : [];
  if (anchor && goal.offset) handles.push({ ...seenFrom(anchor, goal.offset), drag: (at) => withValue(setting, ["goal", "offset"], offsetTo(at, anchor, goal.offset.frame)) });
  return handles;
}

/** The radius that a goal has about its AUVs, and its member. @param {any} goal @returns {[string, number] | undefined} */
function reachOf(goal) {
  if (goal?.kind === "range") return ["range_m", goal.range_m];
  return goal?.kind === "visit" ? ["within_m", goal.within_m ?? 20] : undefined;
}

/** The AUVs of a goal on the map. @param {any} goal @param {Picture} picture */
function followed(goal, picture) {
  const ids = goal?.auv ? [goal.auv] : goal?.auvs ?? Object.keys(goal?.weights ?? {});
  return picture.vehicles.filter(({ kind, name, north, east }) => kind === "auv" && ids.includes(name) && Number.isFinite(north + east));
}

/** What an offset is seen from, with the heading of the one AUV. @param {any} goal @param {Picture} picture */
function anchorOf(goal, picture) {
  const vehicles = followed(goal, picture);
  if (!vehicles.length || !GOALS[goal.kind]?.isMean) return null;
  const weights = vehicles.map(({ name }) => goal.weights?.[name ?? ""] ?? 1), total = weights.reduce((sum, weight) => sum + weight, 0) || 1;
  const mean = (/** @type {"north" | "east"} */ axis) => vehicles.reduce((sum, vehicle, i) => sum + vehicle[axis] * weights[i], 0) / total;
  return { north: mean("north"), east: mean("east"), heading: vehicles[0].heading || 0 };
}

/** @param {Place & { heading: number }} anchor @param {any} offset @returns {Place} */
function seenFrom({ north, east, heading }, { frame, north_m = 0, east_m = 0, ahead_m = 0, starboard_m = 0, range_m = 0, bearing_rad = 0 }) {
  if (frame === "ned") return { north: north + north_m, east: east + east_m };
  if (frame === "polar") return { north: north + range_m * Math.cos(bearing_rad), east: east + range_m * Math.sin(bearing_rad) };
  return { north: north + ahead_m * Math.cos(heading) - starboard_m * Math.sin(heading), east: east + ahead_m * Math.sin(heading) + starboard_m * Math.cos(heading) };
}

/** @param {Place} at @param {Place & { heading: number }} anchor @param {string} frame */
function offsetTo(at, anchor, frame) {
  const north = at.north - anchor.north, east = at.east - anchor.east, { heading } = anchor;
  if (frame === "ned") return { frame, north_m: tenth(north), east_m: tenth(east) };
  if (frame === "polar") return { frame, range_m: tenth(Math.hypot(north, east)), bearing_rad: Number(Math.atan2(east, north).toFixed(4)) };
  return { frame, ahead_m: tenth(north * Math.cos(heading) + east * Math.sin(heading)), starboard_m: tenth(east * Math.cos(heading) - north * Math.sin(heading)) };
}

/** What a drag from one place to another draws: a disc from its centre to its edge, or a rectangle. @param {string} section @param {Setting} setting @param {Place} from @param {Place} to @returns {Partial<Setting>} */
export function dragged(section, setting, from, to) {
  if (section === "keep_outs") return { keep_outs: [...setting.keep_outs, { north_m: tenth(from.north), east_m: tenth(from.east), radius_m: Math.max(tenth(between(from, to)), 0.1) }] };
  const [n0, e0, n1, e1] = [from.north, from.east, to.north, to.east].map(tenth);
  return { area: [[n0, e0], [n0, e1], [n1, e1], [n1, e0]] };
}

/** What a tap adds: a disc, or a corner on the nearest side. @param {string} section @param {Setting} setting @param {Place} at @returns {Partial<Setting>} */
export function tapped(section, setting, at) {
  if (section === "keep_outs") return dragged(section, setting, at, { north: at.north + TAPPED_M, east: at.east });
  const { area } = setting, detour = (/** @type {[number, number]} */ a, /** @type {[number, number]} */ b) => Math.hypot(a[0] - at.north, a[1] - at.east) + Math.hypot(b[0] - at.north, b[1] - at.east) - Math.hypot(a[0] - b[0], a[1] - b[1]);
  const detours = area.map((corner, i) => detour(corner, area[(i + 1) % area.length])), nearest = area.length < 3 ? area.length : detours.indexOf(Math.min(...detours)) + 1;
  return { area: area.toSpliced(nearest, 0, [tenth(at.north), tenth(at.east)]) };
}

/**
 * What is ordered and not yet sent, and the handles.
 * @param {string} section that is open @param {{ now: Setting, base: Setting, edited: string[] }} draft @param {Handle[]} handles @param {Picture} picture
 * @returns {import("./types.js").Overlay}
 */
export function orderOverlay(section, { now, base, edited }, handles, picture) {
  /** @type {import("./types.js").Overlay} */
  const drawn = { lines: [], discs: [], marks: handles.map(({ north, east }) => ({ north, east, kind: "handle", colour: "button" })) };
  const shows = (/** @type {string} */ member) => edited.includes(member) || section === member;
  if (shows("keep_outs")) {
    now.keep_outs.forEach(({ north_m: north, east_m: east, radius_m: radius }, i) => {
      const isOld = base.keep_outs.some((disc) => disc.north_m === north && disc.east_m === east && disc.radius_m === radius);
      if (!isOld) drawn.discs.push({ north, east, radius, colour: "button", style: "keep-out" });
      drawn.marks.push({ north: north + radius, east, kind: "label", colour: "button", text: String(i + 1) });
    });
  }
  if (shows("area") && now.area.length) drawn.lines.push({ points: now.area, colour: "button", style: "area", closed: true, name: "area to send" });
  if (!shows("goal")) return drawn;
  const reach = reachOf(now.goal), anchor = anchorOf(now.goal, picture);
  for (const { north, east } of followed(now.goal, picture)) {
    if (reach) drawn.discs.push({ north, east, radius: reach[1], colour: "button", style: "acoustic" });
    drawn.marks.push({ north, east, kind: "ring", colour: "button" });
  }
  if (anchor && now.goal.offset) {
    const { north, east } = seenFrom(anchor, now.goal.offset);
    drawn.lines.push({ points: [[anchor.north, anchor.east], [north, east]], colour: "button", style: "thin", name: "offset" });
  }
  return drawn;
}
