// What a user means to change of a live mission's setting: step by step, undone, and in words.

import { moment, number } from "./format.js";

/**
 * A setting without what is not set.
 * @typedef {{ north_m: number, east_m: number, radius_m: number }} KeepOut
 * @typedef {{ goal: any, limits: { [limit: string]: number }, keep_outs: KeepOut[], area: [number, number][], surface_craft: CraftSetting[] }} Setting
 * A craft of a fleet: without `serves` it may serve every AUV.
 * @typedef {{ id: string, limits?: { [limit: string]: number }, serves?: string[] }} CraftSetting
 * @typedef {(string | number)[]} Path of a value in a setting
 */

const DEGREES = 180 / Math.PI;

/**
 * The kinds of goals: the name in the form, the words of an order, own numbers, what one begins with beside its AUVs at a time, and whether it is of one AUV, weighs AUVs, is a mean that an offset is seen from, or has no offset.
 * @type {{ [kind: string]: { title: string, words: (auvs: string) => string, numbers?: string[], begins?: (t_s: number) => object, isOfOne?: boolean, weighs?: boolean, isMean?: boolean, hasNoOffset?: boolean } }}
 */
export const GOALS = {
  track: { title: "stay above one AUV", words: (auvs) => `stay above ${auvs}`, isOfOne: true, isMean: true },
  intermittent: { title: "follow each in turn", words: (auvs) => `follow ${auvs} in turn`, numbers: ["dwell_s"], begins: (t_s) => ({ dwell_s: 240, epoch_s: Math.round(t_s) }) },
  midpoint: { title: "stay above the middle of", words: (auvs) => `stay above the middle of ${auvs}`, isMean: true },
  weighted: { title: "stay above the weighted mean of", words: (auvs) => `stay above the weighted mean of ${auvs}`, weighs: true, isMean: true },
  range: { title: "stay in range of each of", words: (auvs) => `stay in range of ${auvs}`, numbers: ["range_m"], begins: () => ({ range_m: 100 }) },
  visit: { title: "visit, when it pays", words: (auvs) => `visit ${auvs}`, numbers: ["within_m", "dwell_min_s"], weighs: true },
  localise: { title: "move so that ranges fix", words: (auvs) => `move so that ranges fix ${auvs}`, numbers: ["growth_m2ps", "sigma_m", "interval_s", "stand_off_m"], begins: () => ({ growth_m2ps: 0.03 }), weighs: true, hasNoOffset: true },
};

/** What members are called, and how many of the shown unit one of theirs is. @type {{ [member: string]: [string, number?] }} */
export const LABELS = {
  speed_max_mps: ["fastest speed, m/s"], speed_min_mps: ["slowest speed, m/s"], turn_rate_max_radps: ["largest turn rate, °/s", DEGREES],
  acceleration_max_mps2: ["largest acceleration, m/s²"], deceleration_max_mps2: ["largest deceleration, m/s²"],
  north_m: ["north, m"], east_m: ["east, m"], radius_m: ["radius, m"], ahead_m: ["ahead, m"], starboard_m: ["to starboard, m"], bearing_rad: ["bearing, °", DEGREES], range_m: ["range, m"],
  dwell_s: ["time with each, s"], epoch_s: ["begins with the first at"], within_m: ["served within, m"], dwell_min_s: ["least time with one, s"],
  growth_m2ps: ["variance grows by, m²/s"], sigma_m: ["accuracy of a fix, m"], sigma_rad: ["its growth with range, rad"], interval_s: ["between fixes, s"],
  growth_kbps: ["data gathered, kbit/s"], upload_kbps: ["uploaded at no range, kbit/s"], range_max_m: ["nothing uploaded from, m"], surge_lag_s: ["surge lag, s"],
  stand_off_m: ["distance to keep, m"], fixes: ["measured between them"], "offset/frame": ["where to be"], "cost/kind": ["what waiting costs"], reduce: ["of these costs"],
};

/** What choices are called. @type {{ [member: string]: { [choice: string]: string } }} */
export const CHOICES = {
  "offset/frame": { ned: "north and east of it", polar: "at a range and bearing", target: "ahead and to starboard, by its course", path: "ahead and to starboard, by its path" },
  "cost/kind": { age: "time since served", uncertainty: "uncertainty of its navigation", data: "data not uploaded" }, reduce: { mean: "the mean counts", max: "the largest counts" }, fixes: { range: "ranges", usbl: "positions by USBL" },
};

/** What a member is called and its unit. An AUV may have the name of whatever JavaScript has. @param {string | number} member @returns {[string, number?] | undefined} */
export function labelOf(member) {
  return Object.hasOwn(LABELS, member) ? LABELS[member] : undefined;
}

/** A value at a path. @param {any} of @param {Path} path @returns {any} */
export function valueAt(of, path) {
  return path.reduce((value, key) => (value && Object.hasOwn(value, key) ? value[key] : undefined), of);
}

/** A copy with a value at a path; an undefined one is left out, and what it leaves empty. @param {any} of @param {Path} path @param {unknown} value @returns {any} */
export function withValue(of, [key, ...rest], value) {
  const next = rest.length ? withValue(of?.[key] ?? {}, rest, value) : value;
  if (Array.isArray(of)) return Object.assign([...of], { [key]: next });
  const { [key]: _, ...others } = of ?? {};
  if (next === undefined || (value === undefined && !Object.keys(next).length)) return others;
  return { ...of, [key]: next };
}

/** @param {any} of */
function withoutNull(of) {
  return Object.fromEntries(Object.entries(of ?? {}).filter(([, value]) => value !== null));
}

/** @param {any} setting as the service has it @returns {Setting} */
function settingOf(setting) {
  return {
    goal: setting?.goal, limits: withoutNull(setting?.limits), surface_craft: (setting?.surface_craft ?? []).map((/** @type {any} */ craft) => ({ ...withoutNull(craft), ...craft.limits && { limits: withoutNull(craft.limits) } })),
    keep_outs: (setting?.keep_outs ?? []).map((/** @type {KeepOut} */ { north_m, east_m, radius_m }) => ({ north_m, east_m, radius_m })), area: setting?.area ?? [],
  };
}

/** Whether two values are the same, in whatever order their members are. @param {unknown} a @param {unknown} b */
function isSame(a, b) {
  const sorted = (/** @type {string} */ _, /** @type {any} */ value) => (value && typeof value === "object" && !Array.isArray(value) ? Object.fromEntries(Object.entries(value).sort(([x], [y]) => (x < y ? -1 : 1))) : value);
  return JSON.stringify(a, sorted) === JSON.stringify(b, sorted);
}

/** A setting that is edited. */
export class OrderDraft {
  /** @param {() => void} changed */
  constructor(changed) {
    this.changed = changed;
    this.base = this.now = settingOf(null);
    /** @type {Setting[]} */
    this.before = [];
  }

  /** Members that are to be changed. */
  get edited() {
    return /** @type {(keyof Setting)[]} */ (["goal", "limits", "keep_outs", "area", "surface_craft"]).filter((member) => !isSame(this.base[member], this.now[member]));
  }

  /** What the mission has now. Says which members were changed here and there. @param {any} setting */
  became(setting) {
    const { edited, base } = this, next = settingOf(setting);
    if (isSame(base, next)) return [];
    this.base = next;
    this.now = { ...next, ...Object.fromEntries(edited.map((member) => [member, this.now[member]])) };
    this.before = [];
    this.changed();
    return edited.filter((member) => !isSame(base[member], next[member]));
  }

  /** What was sent is set. @param {any} setting */
  settle(setting) {
    this.base = this.now = settingOf(setting);
    this.before = [];
    this.changed();
  }

  /** @param {Partial<Setting>} part @param {boolean} [goesOn] whether it belongs to the step before */
  edit(part, goesOn = false) {
    if (!goesOn) this.before.push(this.now);
    this.now = { ...this.now, ...part };
    this.changed();
  }

  undo() {
    this.now = this.before.pop() ?? this.now;
    this.changed();
  }

  discard() {
    this.settle(this.base);
  }

  /** What a PATCH has. */
  patch() {
    const empty = (/** @type {any} */ value) => !Object.keys(value).length;
    return Object.fromEntries(this.edited.map((member) => [member, empty(this.now[member]) ? null : this.now[member]]));
  }

  /** What changes, a sentence each. */
  words() {
    const { base, now } = this, discs = (/** @type {Setting} */ from, /** @type {Setting} */ but) => from.keep_outs.filter((disc) => !but.keep_outs.some((other) => isSame(disc, other))).map(discWords);
    const gone = discs(base, now), come = discs(now, base), goals = [now.goal, base.goal].map(goalWords);
    return [
      ...goals[0] === goals[1] ? [] : [`Goal: ${goals[0]}; until now: ${goals[1]}`], ...leafWords("Goal", base.goal, now.goal), ...leafWords("Limits", base.limits, now.limits),
      ...now.surface_craft.flatMap((craft) => craftWords(base.surface_craft.find(({ id }) => id === craft.id), craft)),
      ...gone.length === 1 && come.length === 1 ? [`Keep-out: ${come[0]}; until now: ${gone[0]}`] : [...come.map((words) => `New keep-out: ${words}`), ...gone.map((words) => `No keep-out any more: ${words}`)],
      ...isSame(base.area, now.area) ? [] : [now.area.length ? `Working area: ${areaWords(now.area)}; until now: ${areaWords(base.area)}` : `No working area any more: ${areaWords(base.area)}`],
    ];
  }
}

/** Whether a craft of a fleet serves nobody, by order. @param {CraftSetting | undefined} craft */
export function standsDown(craft) {
  return craft?.serves?.length === 0;
}

/** @param {CraftSetting | undefined} before @param {CraftSetting} now @returns {string[]} */
function craftWords(before, now) {
  const { id, serves = ["every AUV"] } = now;
  const served = isSame(before?.serves, now.serves) ? [] : [standsDown(now) ? `${id} stands down: it serves nobody` : `${id} may serve ${serves.join(", ")}`];
  return [...served, ...leafWords(`Limits of ${id}`, before?.limits, now.limits)];
}

/** @param {KeepOut} disc */
function discWords({ north_m, east_m, radius_m }) {
  return `${number(radius_m, 1, "m")} around ${number(north_m, 1, "m")} N, ${number(east_m, 1, "m")} E`;
}

/** @param {[number, number][]} area */
function areaWords(area) {
  const doubled = area.reduce((sum, [north, east], i) => sum + north * area[(i + 1) % area.length][1] - east * area[(i + 1) % area.length][0], 0);
  return area.length ? `${area.length} corners, ${number(Math.abs(doubled) / 2, 0, "m²")}` : "none";
}

/** @param {any} goal */
function goalWords(goal) {
  const { kind, auv, auvs = Object.keys(goal?.weights ?? {}), next } = goal ?? {};
  return Object.hasOwn(GOALS, kind) ? `${GOALS[kind].words(auv ?? auvs.join(", "))}${next ? `, ${next} next` : ""}` : "none";
}

/** Changed numbers and choices within a member. @param {string} of @param {any} before @param {any} now @returns {string[]} */
function leafWords(of, before, now) {
  const leaves = (/** @type {any} */ from) => new Map(Object.entries(from ?? {}).filter(([key]) => !["kind", "auv", "auvs", "next"].includes(key)).flatMap(([key, value]) => (value && typeof value === "object" ? Object.entries(value).map(([inner, leaf]) => [`${key}/${inner}`, leaf]) : [[key, value]])));
  const [old, given] = [leaves(before), leaves(now)], isOther = before?.kind !== now?.kind;
  return [...new Set([...isOther ? [] : old.keys(), ...given.keys()])].filter((key) => !isSame(old.get(key), given.get(key))).map((key) => {
    const [group, member = group] = key.split(/\/(.*)/), isOfAuv = Object.hasOwn(GROUPS, group);
    const [label, scale = 1] = isOfAuv ? [`${GROUPS[group]} ${member}`] : labelOf(key) ?? labelOf(member) ?? [member === group ? member : `${group} ${member}`];
    const shown = (/** @type {any} */ value) => (value === undefined ? "not set" : typeof value !== "number" ? CHOICES[key]?.[value] ?? String(value) : group === "serve_by_s" || key === "epoch_s" ? moment(value, true) : String(Number((value * scale).toPrecision(6))));
    return `${of}, ${group === "offset" && member !== "frame" ? "offset " : ""}${label}: ${shown(given.get(key))}${isOther ? "" : `; until now: ${shown(old.get(key))}`}`;
  });
}

/** @type {{ [member: string]: string }} */
const GROUPS = { weights: "weight of", serve_by_s: "serve by, for", costs_now: "cost now of" };
