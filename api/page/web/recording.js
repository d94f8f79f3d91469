// A mission in the page: columns of numbers that grow, from a record's table, from events, or both.

import { ageMax } from "./alarm.js";
import { Table } from "./csv.js";
import { carriedOn, GOAL_SPEED_MAX_MPS, isOther, leftBefore } from "./hand_over.js";
import { eventWords, Journal } from "./journal.js";
import { Limits } from "./limits.js";
import { Series } from "./series.js";
import { knownUntil } from "./traffic.js";

/** Least movement of the goal that has a course, m. */
const GOAL_MOVES_M = 0.02;
/** Most predictions kept. */
const PREDICTIONS_MAX = 1_500;
/** Below this age an AUV is known directly, not by a fix, s. */
const FIX_AGE_MIN_S = 0.5;

/**
 * @typedef {import("./types.js").Prediction} Prediction
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").MissionJson} MissionJson
 */

const GOAL = ["t", "north", "east", "distance", "along", "cross", "energy"];
const CRAFT = ["t", "north", "east", "heading", "speed", "sway"];
const AUV = ["t", "north", "east", "depth", "heading"], ESTIMATE = ["t", "north", "east", "depth"];
const FIX = ["t", "north", "east", "depth", "sigma"], VESSEL = ["t", "north", "east", "course", "speed", "length"];
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
    /** Where other vessels truly were, in a simulated mission. @type {Map<string, Series>} */
    this.vessels = new Map();
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
    this.journal = new Journal(this.scene.faults);
    this.limits = new Limits(this);
    /** Jumps of the goal: when, how far off the craft was, and for how long it had been leaving the former goal. @type {{ t: number, off: number, left: number }[]} */
    this.handOvers = [];
    /** Number of the last event taken. */
    this.sequence = 0;
    /** Counts the changes, for views. */
    this.version = 0;
    this.goalCourse = NaN;
    /** Until when the traffic is known; NaN if no other vessel was ever heard. */
    this.vesselsUntil = NaN;
    /** Number of the last event of a gap, until a later plan has come. */
    this.missing = 0;
    this.table = new Table();
  }

  get live() {
    return this.mission.kind === "live";
  }

  /** Craft that a plan is made for at each time. */
  get craftCount() {
    return 1;
  }

  /** @returns {Scene} as the mission was made */
  get scene() {
    return this.mission.scene ?? {};
  }

  /** Positions of the AUVs: true in a simulated mission, estimated in a live one, and by fixes if no estimates were stored. */
  get places() {
    if (this.auvs.size) return this.auvs;
    return this.estimates.size ? this.estimates : this.fixes;
  }

  /** Places of the AUVs that the craft serves. @param {number} _t */
  servedAt(_t) {
    return this.places;
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

  /** Takes an event that a record's table does not have. @param {any} event @param {(unix: number) => number} clock */
  takePast(event, clock) {
    this.takeSetting(clock(event.at_s), event.setting);
  }

  /** Discs and areas of a live mission from `t` on. @param {number} t @param {any} setting */
  takeSetting(t, setting) {
    this.limits.take(t, setting);
  }

  /** Takes lines of a record's table, as CSV. The first line of all is the header. @param {string[]} some */
  takeLines(some) {
    for (const word of this.table.rows(some)) this.takeRow(word);
    this.version += 1;
  }

  /** Begins a new table: the next line is a header. */
  newTable() {
    this.table = new Table();
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
    } else if (kind === "vessel") {
      if (!this.live) this.takeVessel(word("vehicle"), t, value);
    } else if (kind !== "range") this.journal.happened(t, kind, word("reason"));
  }

  /** @param {string} id @param {number} t @param {(name: string) => number} value */
  takeVessel(id, t, value) {
    this.series(id, this.vessels, VESSEL).push(t, ...["north_m", "east_m", "course_rad", "speed_mps", "length_m"].map(value));
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
    // Events of a gap come later than those after it.
    const { goal, craft } = this, before = goal.indexAt(t), isNewest = before === goal.length - 1;
    let course = this.goalCourse;
    if (before >= 0) {
      const dn = north - goal.column("north")[before], de = east - goal.column("east")[before];
      const moved = Math.hypot(dn, de), took = t - goal.column("t")[before];
      if (GOAL_MOVES_M <= moved && moved <= GOAL_SPEED_MAX_MPS * took) course = Math.atan2(de, dn);
      if (isOther(moved, took)) this.goalJumped(t, before, [north, east], moved, Number.isFinite(distance) ? distance : Math.hypot(craft.at("north", t) - north, craft.at("east", t) - east));
    }
    const [cn, ce] = asc ?? carriedOn(this.craft, t), off = Math.hypot(cn - north, ce - east);
    // A table has the distance of the place that the planner took, which it does not have: as far off, in the direction of the last report.
    const scale = Number.isFinite(distance) && off > 0 ? distance / off : 1, [n, e] = [scale * (cn - north), scale * (ce - east)];
    const [cos, sin] = [Math.cos(course), Math.sin(course)];
    if (isNewest) this.goalCourse = course;
    goal.push(t, north, east, Number.isFinite(distance) ? distance : Math.hypot(n, e), n * cos + e * sin, e * cos - n * sin, energy);
  }

  /** The goal is another one now: what that means is seen by how near the craft already is. @param {number} t @param {number} before row of the former goal @param {[number, number]} coming @param {number} by @param {number} off */
  goalJumped(t, before, coming, by, off) {
    const left = leftBefore(this.goal, this.craft, before, coming);
    this.handOvers.push({ t, off, left });
    this.journal.happened(t, "goal jumps", `by ${by.toFixed(0)} m; the craft ${left ? `left ${left.toFixed(0)} s before and ` : ""}is ${off.toFixed(0)} m from it`);
  }

  /** @param {{ t_s: number, sequence: number, reference: { speed_mps: number, heading_rad: number }, method: string, outcome: string, reason: string, solve_ms: number, late_s: number, rms_m: number }} plan */
  takePlan(plan) {
    let method = this.methods.indexOf(plan.method);
    if (method < 0) method = this.methods.push(plan.method) - 1;
    this.journal.until(plan.t_s);
    const degraded = plan.outcome === "degraded", before = this.plans.indexAt(plan.t_s), wasDegraded = before >= 0 && this.plans.column("degraded")[before] === 1;
    const isSeen = !this.missing, since = Math.max(this.plans.last, this.journal.ranAt), due = since + ageMax(this.scene.period_s);
    if (plan.sequence > this.missing) this.missing = 0;
    if (this.live && isSeen && plan.t_s > due) {
      if (!this.journal.alarm.words) this.journal.alarmed(due, "no new plan");
      this.journal.alarmed(plan.t_s, "");
    }
    this.plans.push(plan.t_s, plan.sequence, plan.reference.speed_mps, plan.reference.heading_rad, method, degraded ? 1 : 0, plan.solve_ms, plan.late_s, plan.rms_m);
    if (degraded !== wasDegraded) this.journal.happened(plan.t_s, degraded ? "degraded" : "recovered", plan.reason);
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
    else if (event.kind === "gap") {
      this.missing = event.to;
      this.journal.happened(this.span[1], "gap", `events ${event.from} to ${event.to} were not seen here`);
    } else {
      const t = this.live ? clock(event.at_s) : this.plans.length ? this.plans.last : 0;
      if (event.kind === "changed") this.takeSetting(t, event.setting);
      this.journal.happened(t, event.kind, eventWords(event));
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
      for (const [id, vessel] of Object.entries(truth.vessels ?? {})) this.takeVessel(id, t_s, (name) => vessel[name]);
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
    for (const note of heard.notes ?? []) this.journal.happened(note.t_s ?? t, "note", note.text);
  }

  /** @param {number} t_s @param {Prediction} prediction @param {string} [_craft] that it is of, in a fleet */
  keepPrediction(t_s, prediction, _craft) {
    // Missing values are left out.
    prediction.violations ??= [];
    prediction.warnings ??= [];
    if (prediction.vessels?.length) this.vesselsUntil = Math.max(this.vesselsUntil || -Infinity, knownUntil(t_s, prediction.vessels));
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
