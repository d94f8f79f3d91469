// Visits to AUVs: those that were and those that are planned as a strip below the map, the tour on the map, the schedule in words.

import { auvColour, el, fill, named, shape } from "./dom.js";
import { duration, moment, number } from "./format.js";

/**
 * @typedef {import("./types.js").Visit} Visit
 * @typedef {import("./types.js").ServedAuv} ServedAuv
 * @typedef {import("./types.js").Schedule} Schedule
 * @typedef {import("./types.js").Service} Service
 * @typedef {import("./types.js").Visits} Visits
 */

/** An AUV within this horizontal distance is served, unless the goal says another, m. */
const WITHIN_M = 20;
/** Plans farther apart end a visit, s. */
const PAUSE_S = 30;
/** The least time shown before and after now, s, and the most that a deadline extends it to. */
export const SHOWN_MIN_S = 300, DEADLINE_SHOWN_S = 7200;
/** Possible steps between times, s, and how many there are at most. */
const VISIT_STEPS = [60, 120, 300, 600, 900, 1800, 3600, 7200, 14_400], STEPS_MAX = 5;
/** Most stops of a tour that a map shows. */
const STOPS_MAX = 9;
/** Alternatives in words, the best ones. */
const ALTERNATIVES_MAX = 3;
const PINNED = " · pinned";
export const LEFT_OUT = { silent: "not heard", out_of_reach: "out of reach", too_deep: "too deep" };

/** Of each recording, what its craft served among the plans looked at. @type {WeakMap<import("./recording.js").Recording, { within: number, looked: number, found: Service[] }>} */
const servicesOf = new WeakMap();

/**
 * What the craft of `recording` served until `t`, in order: a record has no visits, but who was near the craft.
 * @param {import("./recording.js").Recording} recording @param {number} t @param {number} [within]
 */
function servedUntil(recording, t, within = WITHIN_M) {
  let known = servicesOf.get(recording);
  if (known?.within !== within) servicesOf.set(recording, known = { within, looked: 0, found: [] });
  const { craft, places, plans } = recording, times = plans.column("t"), { found } = known;
  for (; known.looked < plans.length; known.looked += 1) {
    const at = times[known.looked];
    for (const [auv, series] of places) {
      if (!(Math.hypot(craft.at("north", at) - series.at("north", at), craft.at("east", at) - series.at("east", at)) <= within)) continue;
      const last = found.findLast((service) => service.auv === auv);
      if (last && at - last.to <= PAUSE_S) last.to = at;
      else found.push({ auv, from: at, to: at });
    }
  }
  return found.filter(({ from }) => from <= t).map((service) => ({ ...service, to: Math.min(service.to, t) }));
}

/**
 * What a mission's page shows of visits at `t`.
 * @param {import("./recording.js").Recording} recording @param {number} t
 * @returns {Visits}
 */
export function visitsAt(recording, t) {
  const believed = recording.predictionAt(t)?.prediction, goal = recording.mission.setting?.goal ?? recording.scene.goal, { live } = recording;
  const clock = (/** @type {number} */ time) => (live ? moment(time, true).slice(0, 5) : moment(time, false));
  // A fallback may have no schedule.
  const none = believed && goal?.kind !== "visit" ? undefined : null;
  return { schedule: believed?.schedule ?? none, goal, now: t, past: servedUntil(recording, t, goal?.within_m), begin: recording.span[0], clock, order: [...recording.places.keys()] };
}

/** The visits until each AUV has been met. @param {Schedule} schedule */
export function tourOf({ visits }) {
  const last = visits.findLastIndex(({ auv }, i) => visits.findIndex((other) => other.auv === auv) === i);
  return visits.slice(0, Math.min(last + 1, STOPS_MAX));
}

/**
 * Puts the tour from the craft (north, east) on a map.
 * @param {import("./types.js").Picture} picture @param {[number, number]} craft @param {number} now @param {Visits} shown
 * @param {string} [colour] of all of it
 */
export function addTour(picture, craft, now, { schedule, order, clock }, colour = "") {
  if (!schedule) return;
  const stops = tourOf(schedule);
  picture.lines.push({ points: [craft, ...stops.map((stop) => /** @type {[number, number]} */ ([stop.north_m, stop.east_m]))], colour: colour || "soft", style: "thin", name: "tour" });
  stops.forEach((stop, i) => {
    // A visit that is on is where the craft is. An AUV that is visited again has the number of its next visit.
    const isNext = stops.findIndex(({ auv }) => auv === stop.auv) === i;
    if (isNext && now < stop.arrive_s) picture.marks.push({ north: stop.north_m, east: stop.east_m, kind: "stop", text: String(i + 1), colour: colour || auvColour(order.indexOf(stop.auv)), title: `visit ${i + 1}: ${visitWords(stop, schedule, clock)}` });
  });
}

/** @param {Visit} visit @param {Schedule} schedule @param {(t: number) => string} clock */
export function visitWords({ auv, arrive_s, leave_s, cost_before, cost_after }, { unit }, clock) {
  return `${auv}, ${clock(arrive_s)} to ${clock(leave_s)}, from ${costWords(cost_before, unit)} to ${costWords(cost_after, unit)}`;
}

/** @param {number} cost @param {Schedule["unit"]} unit */
export function costWords(cost, unit) {
  if (unit === "s") return duration(cost);
  return unit === "m2" ? number(cost, cost < 10 ? 1 : 0, "m²") : cost < 10_000 ? number(cost, 0, "kbit") : number(cost / 1000, 0, "Mbit");
}

/** What the schedule costs, and what others would. @param {Schedule} schedule @returns {[string, string][]} */
export function scheduleWords({ unit, cost, bound, exact, alternatives }) {
  const missed = (/** @type {number} */ n) => (n ? `, ${n} deadline${n > 1 ? "s" : ""} missed` : "");
  return [
    ["cost of visits", `${costWords(cost, unit)}, at least ${costWords(bound, unit)}; ${exact ? "every" : "not every"} sequence compared`],
    ...alternatives.slice(0, ALTERNATIVES_MAX).map(({ next, cost: other, deadlines_missed }) => /** @type {[string, string]} */ ([`${next} first`, `${costWords(other, unit)}${missed(deadlines_missed)}`])),
  ];
}

/** A row for each AUV: when it was served and will be, its cost, its deadline. */
export class VisitStrip {
  constructor() {
    this.sentence = el("p", { class: "visits-next" });
    this.rows = el("div", { class: "visits-rows", role: "img" });
    const key = ["past", "served", "planned", "planned, numbered as on the map", "cost", "cost", "deadline", "serve by"];
    this.element = el("section", { class: "visits", "aria-label": "Visits", hidden: true }, this.sentence, this.rows,
      el("p", { class: "visits-key" }, key.map((word, i) => (i % 2 ? word : el("i", { class: word })))));
    /** Those of the last schedule. @type {ServedAuv[]} */
    this.served = [];
  }

  /** @param {Visits} shown */
  draw(shown) {
    const { schedule, goal, now, past = [], begin, clock } = shown, visits = schedule?.visits ?? [];
    if (schedule) this.served = schedule.costs;
    else if (!this.served.length && goal?.kind === "visit") this.served = (goal.auvs ?? []).map((auv) => ({ auv, cost: NaN }));
    this.element.hidden = schedule === undefined || !this.served.length;
    if (this.element.hidden) return;
    const deadlines = Object.values(goal?.serve_by_s ?? {}).filter((time) => time < now + DEADLINE_SHOWN_S);
    const to = Math.max(now + SHOWN_MIN_S, ...visits.map((visit) => visit.leave_s), ...deadlines), from = Math.max(Math.min(begin, now), 2 * now - to);
    const most = Math.max(...this.served.map(({ cost }) => cost || 0), ...visits.map(({ cost_before }) => cost_before));
    const x = (/** @type {number} */ t) => Math.min(Math.max((t - from) / (to - from), 0), 1) * 100;
    const bar = (/** @type {string} */ kind, /** @type {number} */ start, /** @type {number} */ end, /** @type {string} */ title, text = "") => from <= end && start <= to && el("i", { class: kind, title, style: `left: ${x(start)}%; width: ${x(end) - x(start)}%` }, text);
    this.rows.style.setProperty("--names", `min(${Math.max(...this.served.map(({ auv }) => `${auv}${goal?.next === auv ? PINNED : ""}`.length)) + 1}ch, 42%)`);
    fill(this.sentence, schedule ? named(schedule.sentence) : "");
    fill(this.rows, this.served.map((served) => el("div", { class: "visits-row" }, el("b", {}, named(served.auv), goal?.next === served.auv && PINNED),
      el("div", { class: "lane", style: `color: var(--${auvColour(shown.order.indexOf(served.auv))})` },
        costCurve(visits.filter(({ auv }) => auv === served.auv), [now, served.cost], ([t, cost]) => [x(t), 100 - 90 * (cost / most || 0)]),
        past.map(({ auv, from: start, to: end }) => auv === served.auv && bar("past", start, end, `${auv}, served ${clock(start)} to ${clock(end)}`)),
        schedule && tourMarks(schedule).map(([visit, text]) => visit.auv === served.auv && bar("planned", Math.max(visit.arrive_s, now), visit.leave_s, visitWords(visit, schedule, clock), text)),
        served.left_out && el("span", { class: "left-out" }, `left out: ${LEFT_OUT[served.left_out]}`), deadlineMark(served, shown, bar)),
      el("span", {}, schedule && costWords(served.cost, schedule.unit)))),
    el("div", { class: "visits-row visits-times" }, el("b"), el("div", { class: "lane" }, times(from, to, now).map((t) => el("span", { style: `left: ${x(t)}%` }, clock(t))), el("i", { style: `left: ${x(now)}%` }))));
    this.rows.setAttribute("aria-label", schedule ? `Planned: ${visits.map((visit) => visitWords(visit, schedule, clock)).join("; ")}` : "");
  }
}

/** Visits with their numbers on the map. @param {Schedule} schedule @returns {[Visit, string][]} */
function tourMarks(schedule) {
  const { length } = tourOf(schedule);
  return schedule.visits.map((visit, i) => [visit, i < length ? String(i + 1) : ""]);
}

/** The area below an AUV's cost, from now to its last visit. @param {Visit[]} visits @param {number[]} now @param {(knot: number[]) => number[]} place */
function costCurve(visits, now, place) {
  const knots = [now, ...visits.flatMap(({ arrive_s, leave_s, cost_before, cost_after }) => [[Math.max(arrive_s, now[0]), arrive_s < now[0] ? now[1] : cost_before], [leave_s, cost_after]])];
  const points = [[now[0], 0], ...knots, [knots[knots.length - 1][0], 0]].map(place).join(" ");
  return shape("svg", { viewBox: "0 0 100 100", preserveAspectRatio: "none" }, shape("polygon", { points }));
}

/** @param {ServedAuv} served @param {Visits} shown @param {(kind: string, start: number, end: number, title: string) => import("./dom.js").Child} bar */
export function deadlineMark({ auv, served_by_s = -Infinity }, { schedule, goal, clock }, bar) {
  const serve_by_s = goal?.serve_by_s ?? {}, deadline = Object.hasOwn(serve_by_s, auv) ? serve_by_s[auv] : undefined;
  if (deadline === undefined) return null;
  const [kind, words] = deadline <= served_by_s ? ["met", ", served"] : schedule?.deadlines_missed?.includes(auv) ? ["late", ", will be missed"] : ["", ""];
  return bar(`deadline ${kind}`, deadline, deadline, `${auv}: serve by ${clock(deadline)}${words}`);
}

/** Times of the axis: whole steps before and after now. @param {number} from @param {number} to @param {number} now */
export function times(from, to, now) {
  const step = VISIT_STEPS.find((candidate) => (to - from) / candidate <= STEPS_MAX) ?? to - from, first = Math.ceil((from - now) / step);
  return Array.from({ length: Math.floor((to - now) / step) - first + 1 }, (_, i) => now + (first + i) * step);
}
