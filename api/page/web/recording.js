// A mission in the page: columns of numbers that grow, from a record's table, from events, or both.

import { ageMax, ageWords } from "./alarm.js";

/** Default start of the settled scores of a simulated mission, s. */
const SETTLED_AFTER_S = 120;
/** For the course of the goal: its least movement, and the speed above which it jumped. */
const GOAL_MOVES_M = 0.02, GOAL_SPEED_MAX_MPS = 3;
/** A goal that moves so much farther has switched to another AUV. */
const GOAL_JUMPS_M = 5;
/** Most predictions, log entries and violations kept. */
const PREDICTIONS_MAX = 1_500, LOG_MAX = 2_000, BREACHES_MAX = 500;
/** Below this age an AUV is known directly, not by a fix, s. */
const FIX_AGE_MIN_S = 0.5;
/** Tolerance of a limit, for rounding, m. */
const NOTICEABLE_M = 0.01;

/** Rows of numbers ordered by time, stored as columns. */
export class Series {
  /** @param {string[]} names the first is the time */
  constructor(...names) {
    this.names = names;
    this.length = 0;
    /** @type {{ [name: string]: Float64Array }} */
    this.columns = Object.fromEntries(names.map((name) => [name, new Float64Array(64)]));
  }

  /** @param {string} name */
  column(name) {
    return this.columns[name];
  }

  get first() {
    return this.length ? this.columns[this.names[0]][0] : NaN;
  }

  get last() {
    return this.length ? this.columns[this.names[0]][this.length - 1] : NaN;
  }

  /**
   * Inserts a row in order of time, because reports come late. A row with an existing time replaces that row.
   * @param {number[]} values
   */
  push(...values) {
    const time = values[0];
    if (!Number.isFinite(time)) return;
    let at = this.length;
    if (at && time <= this.last) {
      at = this.indexAt(time);
      if (at < 0 || this.columns[this.names[0]][at] !== time) {
        at += 1;
        this.grow();
        for (const column of Object.values(this.columns)) column.copyWithin(at + 1, at, this.length);
        this.length += 1;
      }
    } else {
      this.grow();
      this.length += 1;
    }
    this.names.forEach((name, i) => { this.columns[name][at] = values[i] ?? NaN; });
  }

  grow() {
    if (this.length < this.columns[this.names[0]].length) return;
    for (const [name, column] of Object.entries(this.columns)) {
      const longer = new Float64Array(2 * column.length);
      longer.set(column);
      this.columns[name] = longer;
    }
  }

  /**
   * Index of the last row at `time` or before; −1 if there is none.
   * @param {number} time
   */
  indexAt(time) {
    const times = this.columns[this.names[0]];
    let low = -1, high = this.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle; else high = middle - 1;
    }
    return low;
  }

  /**
   * The value at `time`, held from the previous row.
   * @param {string} name
   * @param {number} time
   */
  at(name, time) {
    const i = this.indexAt(time);
    return i < 0 ? NaN : this.columns[name][i];
  }
}

/**
 * @typedef {import("./types.js").Prediction} Prediction
 * @typedef {import("./types.js").Breach} Breach
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").MissionJson} MissionJson
 * @typedef {import("./types.js").LogEntry} LogEntry
 */

const GOAL = ["t", "north", "east", "distance", "along", "cross", "energy"];
const CRAFT = ["t", "north", "east", "heading", "speed", "sway"];
const AUV = ["t", "north", "east", "depth", "heading"], ESTIMATE = ["t", "north", "east", "depth"];
const FIX = ["t", "north", "east", "depth", "sigma"];
const PLANS = ["t", "sequence", "speed", "heading", "method", "degraded", "solve_ms", "late_s", "rms"];

/** A mission's past and present. */
export class Recording {
  /** @param {MissionJson} mission */
  constructor(mission) {
    this.mission = mission;
    this.craft = new Series(...CRAFT);
    this.goal = new Series(...GOAL);
    this.plans = new Series(...PLANS);
    /** @type {Map<string, Series>} */
    this.auvs = new Map();
    /** @type {Map<string, Series>} */
    this.fixes = new Map();
    /** Where an AUV of a live mission was believed to be. @type {Map<string, Series>} */
    this.estimates = new Map();
    /** Times of the fixes that an estimate did not rest on. @type {Map<string, Series>} */
    this.refused = new Map();
    /** Age of what was last heard of each AUV when a plan was made. @type {Map<string, Series>} */
    this.ages = new Map();
    /** Names of what answered, by their number in `plans`. @type {string[]} */
    this.methods = [];
    /** By the plan's time, in order of arrival. @type {Map<number, Prediction>} */
    this.predictions = new Map();
    /** Times of plans whose prediction was not kept. @type {Set<number>} */
    this.without = new Set();
    /** @type {LogEntry[]} */
    this.log = [];
    /** Counts the log entries. */
    this.logVersion = 0;
    /** Discs and area of a live mission, by the time from which they count. @type {{ t: number, keep_outs: Scene["keep_outs"], area: Scene["area"] }[]} */
    this.settings = [];
    /** Violations of limits by the craft, and the number of positions checked. */
    this.breaches = { found: /** @type {Breach[]} */ ([]), now: /** @type {Map<string, Breach>} */ (new Map()), looked: 0 };
    /** Number of the last event taken. */
    this.sequence = 0;
    /** Counts the changes, for views. */
    this.version = 0;
    this.goalCourse = NaN;
    this.wasDegraded = false;
    /** The alarm of the log that has not ended, and since when. */
    this.alarm = { words: "", t: NaN, entry: /** @type {LogEntry | undefined} */ (undefined) };
    /** When a live mission ran again after a pause. */
    this.ranAt = -Infinity;
    /** Of the table that is being read: column by name. @type {Map<string, number>} */
    this.header = new Map();
    this.open = "";
  }

  get live() {
    return this.mission.kind === "live";
  }

  /** @returns {Scene} as the mission was made */
  get scene() {
    return this.mission.scene ?? {};
  }

  /**
   * Discs and area at `time`.
   * @param {number} time
   * @returns {{ keep_outs: { north_m: number, east_m: number, radius_m: number }[], area: [number, number][] }}
   */
  limitsAt(time) {
    const { keep_outs, area } = this.settings.findLast(({ t }) => t <= time) ?? this.scene;
    return { keep_outs: keep_outs ?? [], area: area ?? [] };
  }

  /**
   * Takes the discs and area of a live mission's setting from `t` on.
   * @param {number} t
   * @param {{ keep_outs?: Scene["keep_outs"] | null, area?: Scene["area"] | null }} setting
   */
  takeSetting(t, setting) {
    const before = this.limitsAt(t);
    const { keep_outs = before.keep_outs, area = before.area } = setting;
    this.settings = this.settings.filter((other) => other.t !== t).concat({ t, keep_outs: keep_outs ?? [], area: area ?? [] }).sort((a, b) => a.t - b.t);
  }

  /** Where the craft was beyond a limit until `time`: an entry for each stay, where that was farthest. @param {number} time */
  breachesUntil(time) {
    const { breaches, craft } = this;
    for (; breaches.looked < craft.length; breaches.looked += 1) this.lookForBreaches(breaches.looked);
    return breaches.found.filter(({ t }) => t <= time);
  }

  /** @param {number} i a place of the craft */
  lookForBreaches(i) {
    const { craft, breaches: { found, now } } = this, [t, north, east] = ["t", "north", "east"].map((name) => craft.column(name)[i]);
    const { keep_outs, area } = this.limitsAt(t), range = this.scene.range_max_m;
    const take = (/** @type {string} */ key, /** @type {string} */ limit, /** @type {number} */ beyond) => {
      const open = now.get(key);
      if (!(beyond > NOTICEABLE_M)) now.delete(key);
      else if (!open) {
        const breach = { t, north, east, limit, beyond };
        now.set(key, breach);
        found.push(breach);
        if (found.length > BREACHES_MAX) found.shift();
      } else if (beyond > open.beyond) Object.assign(open, { t, north, east, beyond });
    };
    for (const disc of keep_outs) take(`disc ${disc.north_m} ${disc.east_m} ${disc.radius_m}`, "inside a keep-out", disc.radius_m - Math.hypot(north - disc.north_m, east - disc.east_m));
    if (area.length) take("area", "outside the area", outside(area, north, east));
    for (const [id, series] of range ? this.places : []) {
      const [n, e, depth] = ["north", "east", "depth"].map((name) => series.at(name, t));
      take(`range ${id}`, `out of acoustic range of ${id}`, Math.hypot(north - n, east - e, depth || 0) - (range ?? Infinity));
    }
  }

  /** Positions of the AUVs: true in a simulated mission, estimated in a live one, and by fixes if no estimates were stored. */
  get places() {
    if (this.auvs.size) return this.auvs;
    return this.estimates.size ? this.estimates : this.fixes;
  }

  /** First and last moment that there is anything of. @returns {[number, number]} */
  get span() {
    const all = [this.plans, this.craft, ...this.auvs.values(), ...this.fixes.values()].filter((series) => series.length);
    if (!all.length) return [NaN, NaN];
    return [Math.min(...all.map((series) => series.first)), Math.max(...all.map((series) => series.last))];
  }

  /** @param {string} id @param {Map<string, Series>} map @param {string[]} names */
  series(id, map, names) {
    let series = map.get(id);
    if (!series) map.set(id, series = new Series(...names));
    return series;
  }

  /**
   * Takes lines of a record's table, as CSV. The first line of all is the header.
   * @param {string[]} some
   */
  takeLines(some) {
    for (const piece of some) {
      // A name may contain a line break: then its quotes are still open.
      const line = this.open ? `${this.open}\n${piece}` : piece;
      const quoted = line.includes('"');
      this.open = quoted && line.split('"').length % 2 === 0 ? line : "";
      if (!line || this.open) continue;
      const cells = quoted ? quotedCells(line) : line.split(",");
      if (this.header.size === 0) {
        cells.forEach((name, i) => this.header.set(name.trim(), i));
        continue;
      }
      this.takeRow((name) => cells[this.header.get(name) ?? -1] ?? "");
    }
    this.version += 1;
  }

  /** Begins a new table: the next line is a header. */
  newTable() {
    this.open = "";
    this.header.clear();
  }

  /** @param {(name: string) => string} word */
  takeRow(word) {
    const value = (/** @type {string} */ name) => { const text = word(name); return text === "" ? NaN : Number(text); };
    const kind = word("kind"), t = value("t_s");
    this.sequence = Math.max(this.sequence, value("sequence") || 0);
    if (kind === "truth" || kind === "asc_state" || kind === "fix") this.takePlace(kind, t, word("vehicle"), value);
    else if (kind === "refused") this.series(word("vehicle"), this.refused, ["t"]).push(t);
    else if (kind === "known" || kind === "estimated") {
      if (word("vehicle") !== "asc") this.series(word("vehicle"), this.ages, ["t", "age"]).push(t, value("age_s"));
      if (kind === "known" && word("vehicle") !== "asc") this.takeKnown(word("vehicle"), t - value("age_s"), value("age_s"), value("north_m"), value("east_m"));
      if (kind === "estimated") this.series(word("vehicle"), this.estimates, ESTIMATE).push(t, value("north_m"), value("east_m"), value("depth_m"));
    } else if (kind === "planned") {
      this.takePlan({
        t_s: t, sequence: value("sequence"), reference: { speed_mps: value("reference_speed_mps"), heading_rad: value("reference_heading_rad") },
        method: word("method"), outcome: word("outcome"), reason: word("reason"), solve_ms: value("solve_ms"), late_s: value("late_s"), rms_m: value("predicted_rms_m"),
      });
      if (this.live) this.takeGoal(t, value("goal_north_m"), value("goal_east_m"), value("goal_distance_m"), NaN);
    } else this.happened(t, kind, word("reason"));
  }

  /**
   * The newest fix that a simulated mission's planner had of an AUV.
   * @param {string} id @param {number} t when it was sent @param {number} age @param {number} north @param {number} east
   */
  takeKnown(id, t, age, north, east) {
    if (age < FIX_AGE_MIN_S || !Number.isFinite(north)) return;
    // Two plans may round the time of the same fix differently.
    this.series(id, this.fixes, FIX).push(Math.round(1000 * t) / 1000, north, east, NaN, NaN);
  }

  /**
   * The position of a vehicle.
   * @param {string} kind
   * @param {number} t
   * @param {string} vehicle
   * @param {(name: string) => number} value
   */
  takePlace(kind, t, vehicle, value) {
    const place = [t, value("north_m"), value("east_m")];
    if (vehicle === "asc") {
      this.craft.push(...place, value("heading_rad"), value("speed_mps"), value("sway_mps"));
      if (kind === "truth") this.takeGoal(t, value("goal_north_m"), value("goal_east_m"), value("goal_distance_m"), value("energy_j"));
    } else if (kind === "truth") {
      this.series(vehicle, this.auvs, AUV).push(...place, value("depth_m"), value("heading_rad"));
    } else this.series(vehicle, this.fixes, FIX).push(...place, value("depth_m"), value("sigma_m"));
  }

  /**
   * The goal, and the errors of the craft along and across its course: ahead and to starboard are positive.
   * @param {number} t @param {number} north @param {number} east @param {number} distance @param {number} energy
   * @param {[number, number]} [asc] where the craft was, if that is known better than by its last report
   */
  takeGoal(t, north, east, distance, energy, asc) {
    if (!Number.isFinite(north)) return;
    const { goal, craft } = this, before = goal.length - 1;
    if (before >= 0) {
      const dn = north - goal.column("north")[before], de = east - goal.column("east")[before];
      const moved = Math.hypot(dn, de), took = t - goal.last;
      if (GOAL_MOVES_M <= moved && moved <= GOAL_SPEED_MAX_MPS * took) this.goalCourse = Math.atan2(de, dn);
      if (moved > GOAL_SPEED_MAX_MPS * took + GOAL_JUMPS_M) this.goalJumped(t, moved, Number.isFinite(distance) ? distance : Math.hypot(craft.at("north", t) - north, craft.at("east", t) - east));
    }
    const [cn, ce] = asc ?? this.carriedOn(t), off = Math.hypot(cn - north, ce - east);
    // A table has the distance of the place that the planner took, which it does not have: as far off, in the direction of the last report.
    const scale = Number.isFinite(distance) && off > 0 ? distance / off : 1, [n, e] = [scale * (cn - north), scale * (ce - east)];
    const [cos, sin] = [Math.cos(this.goalCourse), Math.sin(this.goalCourse)];
    goal.push(t, north, east, Number.isFinite(distance) ? distance : Math.hypot(n, e), n * cos + e * sin, e * cos - n * sin, energy);
  }

  /** Where the craft is at `t`, if it went on as it last reported, but for the current. @param {number} t @returns {[number, number]} */
  carriedOn(t) {
    const [then, north, east, heading, speed, sway] = CRAFT.map((name) => this.craft.at(name, t)), after = t - then;
    if (!(after > 0)) return [north, east];
    const [cos, sin] = [Math.cos(heading), Math.sin(heading)], [surge, across] = [after * speed, after * (sway || 0)];
    return [north + surge * cos - across * sin, east + surge * sin + across * cos];
  }

  /** The goal is another one now: what that means is seen by how near the craft already is. @param {number} t @param {number} by @param {number} distance */
  goalJumped(t, by, distance) {
    this.happened(t, "goal jumps", `by ${by.toFixed(0)} m; the craft is ${distance.toFixed(0)} m from it`);
  }

  /** @param {{ t_s: number, sequence: number, reference: { speed_mps: number, heading_rad: number }, method: string, outcome: string, reason: string, solve_ms: number, late_s: number, rms_m: number }} plan */
  takePlan(plan) {
    let method = this.methods.indexOf(plan.method);
    if (method < 0) method = this.methods.push(plan.method) - 1;
    const degraded = plan.outcome === "degraded", since = Math.max(this.plans.last, this.ranAt), due = since + ageMax(this.scene.period_s);
    if (this.live && plan.t_s > due) {
      if (!this.alarm.words) this.alarmed(due, "not steering");
      this.alarmed(plan.t_s, "");
    }
    this.plans.push(plan.t_s, plan.sequence, plan.reference.speed_mps, plan.reference.heading_rad, method, degraded ? 1 : 0, plan.solve_ms, plan.late_s, plan.rms_m);
    if (degraded !== this.wasDegraded) this.happened(plan.t_s, degraded ? "degraded" : "recovered", plan.reason);
    this.wasDegraded = degraded;
  }

  /** An alarm begins at `t`; without `words` it ends. @param {number} t @param {string} words @param {string} [why] */
  alarmed(t, words, why = "") {
    const { alarm } = this, text = [words, why].filter(Boolean).join(": ");
    if (words === alarm.words) {
      // Why is known a little later.
      if (alarm.entry && alarm.entry.text !== text) {
        alarm.entry.text = text;
        this.logVersion += 1;
      }
      return;
    }
    if (alarm.words) this.happened(t, "alarm over", `${alarm.words}, after ${ageWords(Math.max(t - alarm.t, 0))}`);
    this.alarm = { words, t, entry: words ? this.happened(t, "alarm", text) : undefined };
  }

  /** @param {number} t_s @param {string} kind @param {string} text */
  happened(t_s, kind, text) {
    this.logVersion += 1;
    if (kind === "ran") this.ranAt = t_s;
    const entry = { t_s, kind, text };
    this.log.push(entry);
    if (this.log.length > LOG_MAX) this.log.splice(0, this.log.length - LOG_MAX);
    return entry;
  }

  /**
   * Takes an event of the stream.
   * @param {number} sequence NaN for a gap
   * @param {any} event
   * @param {(unix: number) => number} clock what the mission's clock shows at a Unix time
   */
  takeEvent(sequence, event, clock) {
    if (sequence <= this.sequence) return;
    if (Number.isFinite(sequence)) this.sequence = sequence;
    this.takeAny(sequence, event, clock);
  }

  /**
   * Takes an event that is still missing, even an earlier one.
   * @param {number} sequence @param {any} event @param {(unix: number) => number} clock
   */
  takeAny(sequence, event, clock) {
    this.version += 1;
    if (event.kind === "planned") this.takePlanned(sequence, event);
    else if (event.kind === "reported") this.takeReports(event.heard, clock(event.at_s));
    else if (event.kind === "gap") this.happened(this.span[1], "gap", `events ${event.from} to ${event.to} were not seen here`);
    else {
      const t = this.live ? clock(event.at_s) : this.plans.length ? this.plans.last : 0;
      if (event.kind === "changed") this.takeSetting(t, event.setting);
      this.happened(t, event.kind, wordsOf(event));
    }
  }

  /** @param {number} sequence @param {any} event */
  takePlanned(sequence, event) {
    const { t_s, truth, prediction } = event;
    if (truth) {
      const asc = truth.asc;
      this.craft.push(t_s, asc.north_m, asc.east_m, asc.heading_rad, asc.speed_mps, NaN);
      for (const [id, auv] of Object.entries(truth.auvs)) {
        this.series(id, this.auvs, AUV).push(t_s, auv.north_m, auv.east_m, auv.depth_m, auv.heading_rad);
      }
      this.takeGoal(t_s, truth.goal_north_m, truth.goal_east_m, truth.distance_m, truth.energy_j);
    }
    if (prediction) {
      this.keepPrediction(t_s, prediction);
      if (!truth && prediction.goal.length) this.takeGoal(t_s, prediction.goal[0][0], prediction.goal[0][1], NaN, NaN, prediction.asc[0]);
      for (const { id, age_s, heard, refused_t_s = [], positions, depths_m } of prediction.auvs) {
        this.series(id, this.ages, ["t", "age"]).push(t_s, age_s);
        for (const time of refused_t_s) this.series(id, this.refused, ["t"]).push(time);
        if (!truth) this.series(id, this.estimates, ESTIMATE).push(t_s, ...positions[0], depths_m[0]);
        else if (heard) this.takeKnown(id, heard.t_s, age_s, heard.north_m, heard.east_m);
      }
    }
    this.takePlan({ ...event, sequence, reason: event.reason ?? "", solve_ms: event.solve_time_ns / 1e6, rms_m: prediction?.rms_m ?? NaN });
  }

  /** @param {any} heard @param {number} t */
  takeReports(heard, t) {
    for (const { t_s, state } of heard.asc ?? []) {
      this.craft.push(t_s, state.north_m, state.east_m, state.heading_rad, state.speed_mps, state.sway_mps ?? NaN);
    }
    for (const [id, fixes] of Object.entries(heard.auvs ?? {})) {
      const series = this.series(id, this.fixes, FIX);
      for (const fix of fixes) series.push(fix.t_s, fix.north_m, fix.east_m, fix.depth_m ?? NaN, fix.sigma_m ?? NaN);
    }
    for (const note of heard.notes ?? []) this.happened(note.t_s ?? t, "note", note.text);
  }

  /** @param {number} t_s @param {Prediction} prediction */
  keepPrediction(t_s, prediction) {
    // Missing values are left out.
    prediction.violations ??= [];
    prediction.warnings ??= [];
    this.predictions.set(t_s, prediction);
    if (this.predictions.size > PREDICTIONS_MAX) {
      for (const oldest of this.predictions.keys()) {
        this.predictions.delete(oldest);
        break;
      }
    }
  }

  /**
   * The prediction of the plan at `time`, if loaded, or of a plan at most `within` older.
   * @param {number} time
   * @param {number} [within]
   * @returns {{ t_s: number, prediction: Prediction } | null}
   */
  predictionAt(time, within = 6) {
    const times = this.plans.column("t");
    for (let i = this.plans.indexAt(time); i >= 0 && time - times[i] <= within; i -= 1) {
      const prediction = this.predictions.get(times[i]);
      if (prediction) return { t_s: times[i], prediction };
    }
    return null;
  }
}

/**
 * Distance of a point outside a convex area, m; 0 inside.
 * @param {[number, number][]} corners either way round
 * @param {number} north
 * @param {number} east
 */
function outside(corners, north, east) {
  let [nearest, left, right] = [Infinity, false, false];
  corners.forEach(([n0, e0], i) => {
    const [n1, e1] = corners[(i + 1) % corners.length], [dn, de] = [n1 - n0, e1 - e0];
    const along = Math.min(Math.max(((north - n0) * dn + (east - e0) * de) / (dn * dn + de * de || 1), 0), 1);
    nearest = Math.min(nearest, Math.hypot(north - n0 - along * dn, east - e0 - along * de));
    const side = dn * (east - e0) - de * (north - n0);
    left ||= side < 0;
    right ||= side > 0;
  });
  return left && right ? nearest : 0;
}

/**
 * @param {string} line of CSV, RFC 4180
 * @returns {string[]}
 */
function quotedCells(line) {
  return Array.from(line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/gs), ([, quoted, plain]) => quoted?.replaceAll('""', '"') ?? plain);
}

/** @param {any} event */
function wordsOf(event) {
  if (event.kind === "created") return event.mission?.title ?? "";
  if (event.kind === "failed") return event.reason;
  if (event.kind === "clock_set") return `by ${event.by_s.toFixed(1)} s`;
  if (event.kind === "ran" && event.speed_factor) return `${event.speed_factor} times as fast as life`;
  if (event.kind === "changed") return Object.keys(event.setting).join(", ").replaceAll("_", " ");
  return "";
}

/**
 * Scores of the true distance to the goal from `from` to `to`.
 * @param {Recording} recording
 * @param {number} [from]
 * @param {number} [to]
 */
export function scores(recording, from = -Infinity, to = Infinity) {
  const { goal, craft } = recording;
  const times = goal.column("t"), distances = goal.column("distance");
  const settledFrom = (Number.isFinite(goal.first) ? goal.first : 0) + (recording.scene.settled_after_s ?? SETTLED_AFTER_S);
  const sums = { n: 0, square: 0, settledN: 0, settledSquare: 0, worst: NaN, worstAt: NaN };
  for (let i = 0; i < goal.length; i += 1) {
    const [t, d] = [times[i], distances[i]];
    if (t < from || t > to || !Number.isFinite(d)) continue;
    sums.n += 1;
    sums.square += d * d;
    if (t >= settledFrom) {
      sums.settledN += 1;
      sums.settledSquare += d * d;
    }
    if (!(d <= sums.worst)) [sums.worst, sums.worstAt] = [d, t];
  }
  const energyAt = (/** @type {number} */ t) => goal.at("energy", Math.min(t, goal.last));
  const begin = Math.max(from, goal.first);
  return {
    rms_m: Math.sqrt(sums.square / sums.n), settled_rms_m: Math.sqrt(sums.settledSquare / sums.settledN),
    worst_m: sums.worst, worst_at_s: sums.worstAt,
    energy_j: energyAt(to) - (begin > goal.first ? energyAt(begin) : 0), heading_travel_rad: headingTravel(craft, from, to),
  };
}

/** @param {Series} craft @param {number} from @param {number} to */
function headingTravel(craft, from, to) {
  const times = craft.column("t"), headings = craft.column("heading");
  let sum = 0;
  for (let i = 1; i < craft.length; i += 1) {
    if (times[i] < from || times[i] > to) continue;
    const turn = headings[i] - headings[i - 1];
    if (Number.isFinite(turn)) sum += Math.abs(Math.atan2(Math.sin(turn), Math.cos(turn)));
  }
  return craft.length ? sum : NaN;
}

/**
 * The stretch of `length` seconds with the largest root mean square distance to the goal. The approach at the start of a simulated
 * mission is left out if the mission is longer.
 * @param {Recording} recording
 * @param {number} [length]
 * @returns {{ from: number, to: number, rms_m: number } | null}
 */
export function worstStretch(recording, length = 60) {
  const { goal, live } = recording;
  const times = goal.column("t"), distances = goal.column("distance");
  const approach = recording.scene.settled_after_s ?? SETTLED_AFTER_S;
  const begin = !live && goal.last - goal.first > 2 * approach ? goal.first + approach : goal.first;
  let start = 0, square = 0, n = 0;
  let worst = null, worstMean = -1;
  for (let end = 0; end < goal.length; end += 1) {
    if (times[end] < begin || !Number.isFinite(distances[end])) {
      start = end + 1;
      [square, n] = [0, 0];
      continue;
    }
    square += distances[end] ** 2;
    n += 1;
    while (times[end] - times[start] > length) {
      square -= distances[start] ** 2;
      n -= 1;
      start += 1;
    }
    if (times[end] - times[start] >= 0.9 * length && square / n > worstMean) {
      worstMean = square / n;
      worst = { from: times[start], to: times[end], rms_m: Math.sqrt(Math.max(worstMean, 0)) };
    }
  }
  return worst;
}
