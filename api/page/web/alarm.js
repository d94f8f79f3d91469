// What a mission's craft is steered by now, in one state: steering, degraded and why, or not steering and why.

import { duration, methodName } from "./format.js";

/**
 * @typedef {import("./types.js").MissionJson} MissionJson
 * @typedef {import("./types.js").MissionState} MissionState
 */

/** The plan of a running live mission is stale if it is older than so many periods. */
const STALE_PERIODS = 4;

/** Warnings that the craft does not do what is asked. */
const CRAFT_ALARMS = {
  craft_does_not_follow: "the craft does not follow",
  heading_does_not_respond: "the heading does not respond",
  speed_does_not_respond: "the speed does not respond",
};

/** Why a plan is degraded. Statuses of the solver are left as they are. */
const REASONS = {
  deadline: "no plan was ready before the deadline",
  certificate: "no plan could be verified",
  stale_report: "the goal's last report is too old",
};

/** Greatest age of a plan that counts, s. @param {number} [period_s] */
export function ageMax(period_s = 1) {
  return STALE_PERIODS * period_s;
}

/** An age for people, in whole seconds. @param {number} seconds */
export function ageWords(seconds) {
  return seconds < 60 ? `${Math.round(seconds)}\u00a0s` : duration(seconds);
}

/** Whether a warning is an alarm. @param {string} code */
export function isAlarm(code) {
  return Object.hasOwn(CRAFT_ALARMS, code);
}

/**
 * The state of a mission.
 * @param {MissionJson} mission
 * @param {{ age_s?: number, lost?: string }} [seen] age of the last plan, if the caller knows it better, and why the service is not heard
 * @returns {MissionState}
 */
export function stateOf({ status, kind, plan, scene }, { age_s = plan?.age_s ?? Infinity, lost = "" } = {}) {
  if (status === "failed") return { words: "failed", why: "", tone: "bad", alarm: true };
  if (status !== "running") return { words: status, why: "", tone: "", alarm: false };
  if (kind === "live" && age_s === Infinity) return { words: "not steering", why: lost || "no plan yet", tone: "warn", alarm: false };
  if (kind === "live" && age_s > ageMax(plan?.period_s ?? scene?.period_s)) {
    if (lost) return { words: "state not known", why: lost, tone: "bad", alarm: true, age_s };
    const { waits_for = [] } = plan ?? {};
    return { words: "not steering", why: waits_for.length ? `waits for reports of ${waits_for.map((id) => (id === "asc" ? "the surface craft" : id)).join(", ")}` : "no new plan", tone: "bad", alarm: true, age_s };
  }
  const craft = (plan?.warning_codes ?? []).filter(isAlarm).map((code) => CRAFT_ALARMS[/** @type {keyof typeof CRAFT_ALARMS} */ (code)]);
  if (plan?.outcome === "degraded") return { words: "degraded", why: [degradedWords(plan.reason ?? ""), `${methodName(plan.method)} answers`, ...craft].filter(Boolean).join("; "), tone: "bad", alarm: true };
  if (craft.length) return { words: craft[0], why: craft.slice(1).join(", "), tone: "bad", alarm: true };
  return { words: "steering", why: "", tone: lost ? "warn" : "good", alarm: false };
}

/** @param {string} reason */
function degradedWords(reason) {
  return Object.hasOwn(REASONS, reason) ? REASONS[/** @type {keyof typeof REASONS} */ (reason)] : reason.replaceAll("_", " ");
}

/** A state as the title of the tab: alarms first. @param {MissionState | null | undefined} state @param {string} title */
export function tabTitle(state, title) {
  return `${state?.alarm ? `⚠ ${state.words}${state.age_s === undefined ? "" : ` ${ageWords(state.age_s)}`} · ` : ""}${title}`;
}
