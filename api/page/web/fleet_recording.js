// The recording of a mission of several craft: one for each of them, which share the AUVs, and who served whom.

import { Recording } from "./recording.js";

/** @typedef {import("./types.js").Assigned} Assigned */

/** What an absence is called in the log, and what its end. @type {{ [away: string]: string }} */
const ABSENCES = { silent: "is silent", not_steering: "is not steered", battery_low: "has little energy left", does_not_follow: "does not follow", person: "is steered by a person", returning: "is well again" };

/** The recording of one craft of a fleet. */
class CraftRecording extends Recording {
  /** @param {FleetRecording} fleet @param {string} id */
  constructor(fleet, id) {
    super(fleet.mission);
    this.fleet = fleet;
    this.id = id;
    const { auvs, fixes, estimates, refused, ages } = fleet;
    Object.assign(this, { auvs, fixes, estimates, refused, ages });
    this.goalOfPlan = /** @type {Parameters<Recording["takeGoal"]> | undefined} */ (undefined);
    this.journal.ranAt = fleet.journal.ranAt;
    this.limits.settings = fleet.limits.settings;
  }

  /** @param {number} t */
  servedAt(t) {
    const auvs = this.fleet.assignedAt(t)?.craft.get(this.id) ?? [];
    return new Map([...this.places].filter(([id]) => auvs.includes(id)));
  }

  /** The goal of a plan counts if that has AUVs: a spare craft has none. @param {Parameters<Recording["takeGoal"]>} goal */
  takeGoal(...goal) {
    this.goalOfPlan = goal;
  }

  settleGoal() {
    if (this.goalOfPlan) super.takeGoal(...this.goalOfPlan);
    this.goalOfPlan = undefined;
  }

  /** @param {number} sequence @param {any} event */
  takePlanned(sequence, event) {
    super.takePlanned(sequence, event);
    if (event.prediction?.auvs.length) this.settleGoal();
  }

  /** Other craft of the fleet are no other vessels. @param {number} t_s @param {import("./types.js").Prediction} prediction */
  keepPrediction(t_s, prediction) {
    prediction.vessels = prediction.vessels?.filter(({ id }) => !this.fleet.craftOf(id));
    super.keepPrediction(t_s, prediction);
  }
}

/** A mission of several craft. What it has of itself is of none of them: fixes, notes, the times of plans. */
export class FleetRecording extends Recording {
  /** @param {import("./types.js").MissionJson} mission */
  constructor(mission) {
    super(mission);
    /** Those that are or were in the fleet, in order. @type {Map<string, CraftRecording>} */
    this.parts = new Map();
    /** Who served whom, in order of time. @type {Assigned[]} */
    this.assigned = [];
    /** The craft of the last plan of a table, whose AUVs come next. @type {CraftRecording | undefined} */
    this.planned = undefined;
    for (const id of this.scene.auvs ?? []) this.series(id, this.estimates, ["t", "north", "east", "depth"]);
    this.join(this.scene.surface_craft ?? []);
    this.join((mission.setting?.surface_craft ?? []).map((/** @type {{ id: string }} */ { id }) => id));
  }

  /** @param {string[]} ids */
  join(ids) {
    for (const id of ids) if (!this.parts.has(id)) this.parts.set(id, new CraftRecording(this, id));
  }

  get craftCount() {
    return this.parts.size;
  }

  /** @param {string} [id] */
  craftOf(id) {
    return this.parts.get(id ?? "");
  }

  /** Applies what concerns every craft. @param {(craft: CraftRecording) => void} act */
  each(act) {
    for (const craft of this.parts.values()) act(craft);
  }

  /** @param {string[]} some */
  takeLines(some) {
    super.takeLines(some);
    this.each((craft) => { craft.version += 1; });
  }

  /** @param {(name: string) => string} word */
  takeRow(word) {
    const kind = word("kind"), craft = this.craftOf(word("vehicle")), sequence = Number(word("sequence"));
    this.sequence = Math.max(this.sequence, sequence || 0);
    if (kind === "planned") {
      this.plannedAt(Number(word("t_s")), sequence, Number(word("late_s")));
      this.planned = craft;
    } else if (kind === "estimated") this.planned?.settleGoal();
    // Who is assigned to whom, and who is away, say the events.
    if (kind === "assigned") return;
    if (craft && kind === "asc_state") craft.takePlace(kind, Number(word("t_s")), "asc", (name) => Number(word(name) || NaN));
    else if (craft) craft.takeRow(word);
    else super.takeRow(word);
    this.ran();
  }

  /** The plans of a time are one row, with the number of the first. @param {number} t @param {number} sequence @param {number} late */
  plannedAt(t, sequence, late) {
    if (this.plans.at("t", t) !== t) this.plans.push(t, sequence, NaN, NaN, NaN, 0, NaN, late, NaN);
  }

  ran() {
    this.each((craft) => { craft.journal.ranAt = this.journal.ranAt; });
  }

  /** @param {any} event @param {(unix: number) => number} clock */
  takePast(event, clock) {
    if (event.kind === "assigned") this.takeAssigned(event);
    else super.takePast(event, clock);
  }

  /** @param {number} t @param {any} setting */
  takeSetting(t, setting) {
    this.join((setting.surface_craft ?? []).map((/** @type {{ id: string }} */ { id }) => id));
    super.takeSetting(t, setting);
    this.each((craft) => { craft.limits.settings = this.limits.settings; });
  }

  /** @param {number} sequence @param {any} event @param {(unix: number) => number} clock */
  takeAny(sequence, event, clock) {
    this.each((craft) => { craft.version += 1; });
    const craft = this.craftOf(event.craft ?? event.heard?.craft);
    if (event.kind === "planned" && craft) {
      this.version += 1;
      this.plannedAt(event.t_s, sequence, event.late_s);
      craft.takeAny(sequence, event, clock);
    } else if (event.kind === "assigned") this.takeAssigned(event);
    else {
      super.takeAny(sequence, event, clock);
      if (event.kind === "gap") this.each((each) => { each.missing = event.to; });
      this.ran();
    }
  }

  /** @param {any} heard @param {number} t */
  takeReports(heard, t) {
    const { asc, ...others } = heard;
    this.craftOf(heard.craft)?.takeReports({ asc }, t);
    super.takeReports(others, t);
  }

  /** @param {number} t_s @param {import("./types.js").Prediction} prediction @param {string} [craft] */
  keepPrediction(t_s, prediction, craft) {
    this.craftOf(craft)?.keepPrediction(t_s, prediction);
    this.predictions.set(t_s, prediction);
  }

  /** @param {any} event */
  takeAssigned({ t_s, assignment, away = {} }) {
    /** @type {Assigned} */
    const now = { t_s, away: new Map(Object.entries(away)), unserved: assignment.unserved ?? [], craft: new Map(assignment.craft.map((/** @type {any} */ { id, auvs }) => [id, auvs])) };
    this.version += 1;
    this.assigned = [...this.assigned.filter((other) => other.t_s !== t_s), now].sort((a, b) => a.t_s - b.t_s);
    this.join([...now.craft.keys()]);
    const words = assignedWords(this.assigned[this.assigned.indexOf(now) - 1], now);
    if (words) this.journal.happened(t_s, "assigned", words);
  }

  /** Who served whom at `t`. @param {number} t */
  assignedAt(t) {
    return this.assigned.findLast(({ t_s }) => t_s <= t);
  }

  /** The craft that served an AUV at `t`. @param {string} auv @param {number} t */
  serverOf(auv, t) {
    return [...this.assignedAt(t)?.craft ?? []].find(([, auvs]) => auvs.includes(auv))?.[0];
  }
}

/** What is new, and why: "asc-1 is silent: asc-2 serves auv-3 now". @param {Assigned | undefined} before @param {Assigned} now */
export function assignedWords(before, now) {
  const was = before?.craft ?? new Map(), isServed = [...now.craft.values()].flat();
  const news = Array.from(now.craft, ([id, auvs]) => /** @type {[string, string[]]} */ ([id, auvs.filter((auv) => !was.get(id)?.includes(auv))])).filter(([, auvs]) => auvs.length);
  const moved = news.map(([id, auvs]) => `${id} serves ${auvs.join(", ")}${before ? " now" : ""}`).join("; ");
  const ids = [...new Set([...before?.away.keys() ?? [], ...now.away.keys()])].filter((id) => before?.away.get(id) !== now.away.get(id)), absence = (/** @type {string} */ away) => ABSENCES[away] ?? away;
  const why = ids.map((id) => `${id} ${absence(now.away.get(id) ?? "can serve again")}`);
  const left = [...was.keys()].filter((id) => !now.craft.has(id) && !now.away.has(id)).map((id) => `${id} is not in the fleet any more`);
  const isNew = (/** @type {string} */ auv) => !before?.unserved.includes(auv), lost = [...was.values()].flat().filter((auv) => !isServed.includes(auv));
  const unserved = [...new Set([...lost, ...now.unserved.filter(isNew)])];
  return [[...why, ...left].join(", "), [moved, unserved.length && `nobody serves ${unserved.join(", ")}${before ? " now" : ""}`].filter(Boolean).join("; ")].filter(Boolean).join(": ");
}
