// The craft of a mission that has several: whom each serves, how it is, and what of that the map, the charts and the log show.

import { ageWords, AWAY, stateOf } from "./alarm.js";
import { el, fill, named, swatch } from "./dom.js";
import { bearing, number } from "./format.js";
import { FleetRecording } from "./fleet_recording.js";
import { FleetStrip } from "./fleet_strip.js";
import { trafficState } from "./traffic.js";

/**
 * @typedef {import("./types.js").MissionJson} MissionJson
 * @typedef {import("./types.js").CraftJson} CraftJson
 * @typedef {import("./types.js").MissionState} MissionState
 * Something that had an age at a moment of the page's clock, ms.
 * @typedef {{ age: number, at: number }} Aged
 */

/** There are as many colours. */
const COLOURS = 6;
const NEVER = { age: Infinity, at: -Infinity };
/** A reference is followed for no longer, s. */
const PLAN_HELD_S = 10;
/** What log entries of one craft the charts mark: the goals of craft that visit jump all the time. */
const UNMARKED = "goal jumps";

/** What the page of a mission has of its fleet. */
export class Fleet {
  constructor() {
    /** Ages of the last plan and of the last word of whoever steers, by craft. @type {Map<string, { plan: Aged, said: Aged }>} */
    this.ages = new Map();
    this.strip = new FleetStrip();
    this.body = el("div");
    this.panel = el("section", { class: "panel", "aria-labelledby": "fleet-title" }, el("h2", { id: "fleet-title" }, "Craft"), this.body);
    this.choice = el("select", { "aria-label": "Craft whose numbers are shown", onchange: () => this.choose(this.choice.value) });
    this.chosen = "";
    this.redraw = () => {};
    this.age = () => 0;
    /** @type {MissionState | undefined} */
    this.state = undefined;
    this.shown = { t: NaN, isNow: true };
    /** @type {import("./picture.js").Run[]} */
    this.runs = [];
    this.recording = /** @type {FleetRecording} */ (/** @type {unknown} */ (undefined));
  }

  /** @param {string} id */
  choose(id) {
    this.chosen = id;
    this.redraw();
  }

  /** @param {MissionJson} mission */
  record(mission) {
    return new FleetRecording(mission);
  }

  /** The craft of a recording to show. @param {import("./recording.js").Recording} recording @param {() => void} redraw @param {() => number} age of the last plan now, s */
  show(recording, redraw, age) {
    this.recording = /** @type {FleetRecording} */ (recording);
    [this.redraw, this.age] = [redraw, age];
    this.runs = Array.from(this.recording.parts, ([name, of], i) => ({ name, colour: `craft-${(i % COLOURS) + 1}`, recording: of }));
    fill(this.choice, this.runs.map(({ name }) => el("option", { value: name, selected: name === this.chosen }, name)));
    this.chosen = this.choice.value;
    return this.runs;
  }

  /** Whether a craft has joined since. */
  isOutdated() {
    return this.recording.parts.size !== this.runs.length;
  }

  /** The run whose numbers are shown. */
  get run() {
    return this.runs.find(({ name }) => name === this.chosen) ?? this.runs[0];
  }

  /** How much older a craft's plan is than the last of others, if it is none any more, s. @param {number} t @param {import("./recording.js").Recording} [of] the one whose numbers are shown */
  behind(t, { plans } = this.run.recording) {
    const times = this.recording.plans, then = plans.at("t", t);
    // One of the newest time may still be on its way.
    return then < times.column("t")[Math.max(times.indexAt(t) - 1, 0)] ? times.at("t", t) - then : 0;
  }

  /** The craft that were in the fleet at `t`, the one whose numbers are shown first: the map follows that. @param {number} t */
  runsAt(t) {
    const then = this.recording.assignedAt(t), are = this.runs.filter(({ name }) => !then || then.craft.has(name) || then.away.has(name)), { run } = this;
    return are.includes(run) ? [run, ...are.filter((other) => other !== run)] : are.length ? are : this.runs;
  }

  /** Its AUVs at the moment shown, or now. @param {string} id @param {number} [t] @returns {string[]} */
  servedBy(id, t = this.shown.t) {
    const { recording } = this, then = recording.assignedAt(t) ?? recording.assigned[0];
    return then?.craft.get(id) ?? (then ? [] : recording.mission.surface_craft?.find((craft) => craft.id === id)?.auvs ?? []);
  }

  /** The colour of an AUV is that of the craft that serves it. @param {string} auv @param {number} t */
  colourOf(auv, t) {
    return this.runs.find(({ name }) => this.servedBy(name, t).includes(auv))?.colour ?? "soft";
  }

  /** Log entries of all craft, each with the name of its craft. */
  get entries() {
    const of = (/** @type {import("./recording.js").Recording} */ { journal }, name = "") => journal.entries.map((entry) => ({ ...entry, name }));
    return [...of(this.recording), ...this.runs.flatMap(({ name, recording }) => of(recording, name))];
  }

  get entriesVersion() {
    return this.runs.reduce((sum, { recording }) => sum + recording.journal.version, this.recording.journal.version);
  }

  /** What charts mark. */
  get marked() {
    return this.entries.filter(({ kind }) => kind !== UNMARKED).map(({ name, text, ...entry }) => ({ ...entry, text: [name, text].filter(Boolean).join(": ") }));
  }

  /** @param {string} id */
  agesOf(id) {
    let ages = this.ages.get(id);
    if (!ages) this.ages.set(id, ages = { plan: NEVER, said: NEVER });
    return ages;
  }

  /** Takes an event that tells of a craft of `mission`. @param {MissionJson} mission @param {any} event @param {(t_s: number, least: number) => Aged} ageOf @param {(plan: CraftJson["plan"]) => CraftJson["plan"]} summaryOf */
  take({ surface_craft = [] }, event, ageOf, summaryOf) {
    const id = event.craft ?? event.heard?.craft, craft = surface_craft.find((one) => one.id === id), said = event.heard?.steering?.at(-1);
    if (event.kind === "assigned") {
      const now = this.recording.assignedAt(event.t_s);
      for (const one of surface_craft) Object.assign(one, { away: now?.away.get(one.id), auvs: now?.craft.get(one.id) ?? [] });
    }
    if (!craft) return;
    const ages = this.agesOf(id);
    if (event.kind === "planned") [ages.plan, craft.plan] = [ageOf(event.t_s, event.late_s || 0), summaryOf(craft.plan)];
    if (said) {
      ages.said = ageOf(said.t_s, 0);
      craft.steering = { state: said.state, why: said.why ?? "", age_s: ages.said.age };
    }
    craft.battery = event.heard?.asc?.at(-1)?.battery ?? craft.battery;
  }

  /** An answer that was asked for at `asked`: what was heard since stays. @param {MissionJson} answer @param {MissionJson} known @param {number} asked */
  became(answer, known, asked) {
    for (const craft of answer.surface_craft ?? []) {
      const ages = this.agesOf(craft.id), before = known.surface_craft?.find(({ id }) => id === craft.id), at = performance.now();
      if (craft.plan && asked > ages.plan.at) ages.plan = { age: craft.plan.age_s, at };
      else craft.plan = before?.plan ?? craft.plan;
      if (craft.steering && asked > ages.said.at) ages.said = { age: craft.steering.age_s, at };
      else craft.steering = before?.steering ?? craft.steering;
    }
    this.recording?.each((craft) => { craft.mission = answer; });
  }

  /** What is known of a craft now. @param {(then: Aged) => number} since */
  seen(since) {
    return (/** @type {string} */ id) => {
      const { plan, said } = this.agesOf(id), craft = this.recording.craftOf(id);
      return { age_s: since(plan), said_s: since(said), traffic: craft && trafficState(craft) };
    };
  }

  /** The state now. @param {MissionState} state */
  tell(state) {
    this.state = state;
    if (this.shown.isNow) this.drawTable();
  }

  /** Enters alarms of each craft in its log, at `t`. @param {MissionState} state @param {number} t */
  logAlarms(state, t) {
    for (const { id, state: { alarm, words, why } } of state.craft ?? []) this.recording.craftOf(id)?.journal.alarmed(t, alarm && words !== "degraded" ? words : "", why);
  }

  /** Draws what there is of `t`, which `isNow` or was. @param {number} t @param {boolean} isNow */
  draw(t, isNow) {
    this.shown = { t, isNow };
    this.strip.draw(this.runs, this.recording, t, (id) => this.servedBy(id));
    this.drawTable();
  }

  drawTable() {
    const { runs, recording, shown: { t, isNow } } = this, current = recording.mission.surface_craft ?? [];
    const head = ["reference", "to the goal", "heard"], now = isNow ? recording.plans.last + this.age() : t;
    // Those that have left the fleet have no row.
    const rows = runs.filter(({ name }) => !isNow || !current.length || current.some(({ id }) => id === name)).map(({ name, colour, recording: its }) => {
      const { plans, goal, craft } = its, i = plans.indexAt(t), plan = (/** @type {string} */ of) => (i < 0 ? NaN : plans.column(of)[i]), age = now - craft.at("t", now);
      const isPlanned = !this.behind(t, its) && now - plans.at("t", t) <= PLAN_HELD_S;
      const { words, why, tone } = this.stateAt(name), auvs = this.servedBy(name), battery = isNow ? current.find(({ id }) => id === name)?.battery : undefined, distance = goal.at("distance", t);
      const values = [isPlanned ? `${number(plan("speed"), 1, "m/s")}${plan("speed") > 0 ? `, ${bearing(plan("heading"))}` : ""}` : "–", isPlanned && auvs.length ? number(distance, 0, "m") : "–", Number.isFinite(age) ? `${ageWords(Math.max(age, 0))} ago` : "–"];
      return el("tbody", {}, el("tr", {}, el("th", { scope: "rowgroup", colSpan: head.length }, swatch(colour), named(name), " ", el("span", { class: `chip ${tone}` }, words), why && el("span", { class: "why" }, " ", named(why)))),
        el("tr", {}, el("td", { colSpan: head.length }, auvs.length ? ["serves ", named(auvs.join(", "))] : "serves nobody", battery !== undefined && ` · battery ${Math.round(100 * battery)}\u00a0%`)), el("tr", { class: "values" }, values.map((text) => el("td", {}, text))));
    });
    const unserved = recording.assignedAt(t)?.unserved.join(", ");
    const left = unserved && el("tbody", {}, el("tr", {}, el("td", { colSpan: head.length }, el("span", { class: "chip bad" }, "nobody serves"), " ", named(unserved))));
    const fresh = el("table", { class: "vessels fleet" }, el("thead", {}, el("tr", {}, head.map((name) => el("th", { scope: "col" }, name)))), rows, left);
    if (this.body.innerHTML !== fresh.outerHTML) fill(this.body, fresh);
  }

  /** How a craft is now, or was: a record does not say who steered. @param {string} id @returns {Pick<MissionState, "words" | "why" | "tone">} */
  stateAt(id) {
    const { shown: { t, isNow }, recording, state } = this, one = isNow && state?.craft?.find((craft) => craft.id === id), plans = recording.craftOf(id)?.plans, i = plans?.indexAt(t) ?? -1;
    if (one) return { ...one.state, words: one.standsBy ? `stood down: ${one.state.words}` : one.state.words };
    if (isNow && recording.mission.status !== "running") return stateOf(recording.mission);
    const away = recording.assignedAt(t)?.away.get(id);
    if (away) return AWAY[away] ?? { words: away, why: "", tone: "bad" };
    if (plans && i >= 0 && plans.column("degraded")[i]) return { words: "degraded", why: "", tone: "bad" };
    return { words: "steering not recorded", why: "", tone: "" };
  }
}
