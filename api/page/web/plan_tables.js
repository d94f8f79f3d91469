// The tables of a comparison: answers side by side, the program, its cost, its solver.

import { el } from "./dom.js";
import { avoidanceWords } from "./explanation.js";
import { bearing, methodName, number } from "./format.js";
import { violationWords } from "./picture.js";
import { vesselTable } from "./traffic.js";
import { costWords, scheduleWords } from "./visits.js";

/** @type {[string, (plan: any) => number | string, ((value: number) => string)?, boolean?][]} name, value, words, whether less is better */
const ROWS = [
  ["speed reference", (plan) => plan.reference.speed_mps, (value) => number(value, 2, "m/s")],
  ["heading reference", (plan) => plan.reference.heading_rad, bearing],
  ["predicted RMS distance", (plan) => plan.predicted.rms_error_m, (value) => number(value, 2, "m"), true],
  ["predicted energy", (plan) => plan.predicted.energy_j, (value) => number(value, 0, "J"), true],
  ["predicted cost", (plan) => plan.predicted.cost, (value) => number(value, 1), true],
  ["limits broken", (plan) => plan.violations.length, (value) => number(value, 0), true],
];

/**
 * @param {any} answer of `POST /v1/plan/compare`
 * @param {import("./traffic.js").Vessel[]} vessels
 * @returns {HTMLElement[]}
 */
export function planTables({ plans, explanation }, vessels) {
  const names = Object.keys(plans), { mpc } = plans;
  const notes = [...mpc.violations.map((/** @type {any} */ violation) => violationWords(violation)), ...mpc.warnings.map((/** @type {any} */ warning) => `${warning.pointer}: ${warning.detail}`)];
  const sections = [section("Answers", table(["", ...names.map(methodName)], ROWS.map(([name, of, words = String, less]) => {
    const values = names.map((each) => of(plans[each])), least = Math.min(...values.map(Number)), decided = less && values.some((value) => value !== least);
    return [name, ...values.map((value) => ({ text: words(Number(value)), better: decided && value === least }))];
  })), notes.length > 0 && el("ul", { class: "warnings" }, notes.map((note) => el("li", {}, el("bdi", {}, note)))))];
  const { solver, schedule, figure, avoidance } = mpc;
  if (schedule) {
    const { unit, visits } = schedule, minutes = (/** @type {number} */ t) => ({ text: `+${number((t - mpc.trajectory[0].t_s) / 60, 1, "min")}` });
    sections.push(section("Visits", table(["", "arrival", "departure", "cost before", "cost after"], visits.map((/** @type {import("./types.js").Visit} */ visit) => [visit.auv, minutes(visit.arrive_s), minutes(visit.leave_s), { text: costWords(visit.cost_before, unit) }, { text: costWords(visit.cost_after, unit) }])),
      table([], scheduleWords(schedule).map(([name, text]) => [name, { text }]))));
  }
  if (figure) {
    const metres = (/** @type {number | undefined} */ value) => ({ text: value === undefined ? "not known" : number(value, 1, "m") });
    sections.push(section("Figure", table(["error, root mean square", "now", "on the figure", "if it stayed above"], figure.vehicles.map((/** @type {import("./types.js").LocalisedVehicle} */ vehicle) => [vehicle.auv, metres(vehicle.sigma_now_m), metres(vehicle.sigma_m), metres(vehicle.sigma_above_m)])), el("p", { class: "said" }, figure.sentence)));
  }
  if (vessels.length) sections.push(section("Other vessels", ...vesselTable(vessels), Boolean(avoidance?.sentence) && el("p", { class: "said" }, avoidanceWords(avoidance))));
  if (solver) {
    const facts = [["status", solver.status], ["SCP iterations", solver.scp_iterations], ["interior-point iterations", solver.iterations], ["time", number(solver.solve_time_ms, 2, "ms")],
      ...Object.entries(solver.residuals ?? {}).map(([name, value]) => [`${name} residual`, Number(value).toExponential(1)])];
    sections.push(section("Solver", table([], facts.map(([name, value]) => [String(name), { text: String(value) }]))));
  }
  if (explanation) sections.push(...explained(explanation, names));
  else sections.push(el("p", { class: "said" }, "The service had no time left to explain this plan: cost by term, slack and the solver's log are missing. Plan again to get them."));
  return sections;
}

/**
 * @param {any} explanation
 * @param {string[]} laws in the order of the answers
 */
function explained({ program, cost_terms, slack, log }, laws) {
  const words = (/** @type {string} */ name) => name.replaceAll("_", " ");
  const terms = Object.keys(cost_terms[laws[0]] ?? {});
  return [
    section("Cost by term", table(["", ...laws.map(methodName)], terms.map((term) => [words(term), ...laws.map((law) => ({ text: number(cost_terms[law]?.[term] ?? NaN, 2) }))]))),
    section("Slack: soft limits that the program could not keep", slack.length ? table(["limit", "when", "by"], slack.map((/** @type {any} */ item) => [words(item.limit), { text: `+${number(item.after_s, 0, "s")}` }, { text: number(item.amount, 3, item.unit) }])) : el("p", { class: "said" }, "none")),
    section("Program", table([], Object.entries(program).map(([name, value]) => [words(name), { text: String(value) }]))),
    section("Solver log", table(["subproblem", "status", "iterations", "primal residual", "dual residual", "gap"], log.map((/** @type {any} */ entry, /** @type {number} */ i) => [String(i + 1), { text: words(entry.status) }, { text: String(entry.iterations) }, ...["primal", "dual", "gap"].map((name) => ({ text: entry.residuals ? entry.residuals[name].toExponential(1) : "–" }))]))),
  ];
}

/** @param {string} title @param {...(HTMLElement | false)} content */
function section(title, ...content) {
  return el("section", { class: "panel" }, el("h2", {}, title), content);
}

/** @param {string[]} head @param {(string | { text: string, better?: boolean })[][]} rows */
function table(head, rows) {
  return el("div", { class: "table-scroll", tabIndex: 0, role: "group", "aria-label": "Table" }, el("table", {},
    head.length > 0 && el("thead", {}, el("tr", {}, head.map((name) => el(name ? "th" : "td", name ? { scope: "col" } : {}, name)))),
    el("tbody", {}, rows.map((row) => el("tr", {}, row.map((cell) => (typeof cell === "string" ? el("th", { scope: "row" }, cell) : el("td", { class: cell.better ? "better" : "" }, cell.text))))))));
}
