// Whether a mission's craft is steered now, in one state: steering; degraded, not steering or not known, and why; or a person has it.

import { duration, methodName } from "./format.js";

/**
 * @typedef {import("./types.js").MissionJson} MissionJson
 * @typedef {import("./types.js").MissionState} MissionState
 * @typedef {{ age_s?: number, said_s?: number, lost?: string, traffic?: import("./types.js").TrafficState, craft?: (id: string) => Seen }} Seen
 */

/** The plan of a running live mission is stale if it is older than so many periods: of one that nobody says to steer. */
const STALE_PERIODS = 4;

const NOT_KNOWN = "steering not known";

/** For how long it is known whether a craft is steered, after whoever steers it has said so, s. */
export const KNOWN_S = 3;

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

/** Why a craft of a fleet serves no AUV, as its state. @type {{ [away: string]: MissionState }} */
export const AWAY = {
  silent: { words: "silent", why: "no report for 10 s", tone: "bad", alarm: true },
  not_steering: { words: "not steering", why: "", tone: "bad", alarm: true },
  battery_low: { words: "battery low", why: "it has less energy left than its least share", tone: "bad", alarm: true },
  does_not_follow: { words: CRAFT_ALARMS.craft_does_not_follow, why: "", tone: "bad", alarm: true },
  person: { words: "a person has the craft", why: "", tone: "warn", alarm: false },
  returning: { words: "returning", why: "serves again once it has been well for long enough", tone: "warn", alarm: false },
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
 * The state of a mission. Traffic is no alarm, but nothing is good with it too near or not known.
 * @param {MissionJson} mission
 * @param {Seen} [seen] ages of the last plan and of the last word of whoever steers the craft, and what is not good of the traffic, if the caller knows
 *   them better, those of each craft of a fleet, and why the service is not heard
 * @returns {MissionState}
 */
export function stateOf(mission, seen = {}) {
  if (mission.status === "running" && mission.surface_craft?.length) return stateOfFleet(mission, mission.surface_craft, seen);
  const state = steeringOf(mission, seen), warned = mission.plan?.warning_codes?.includes("vessel_too_near");
  const traffic = seen.traffic ?? (warned ? { why: "vessel comes too near" } : undefined);
  if (!traffic || mission.status !== "running" || state.age_s !== undefined) return state;
  return { ...state, ...traffic, why: [state.why, traffic.why].filter(Boolean).join("; "), tone: state.tone === "good" ? "warn" : state.tone };
}

/** How bad a state is. @param {MissionState} state */
function badness({ tone, alarm }) {
  return 2 * ["", "good", "warn", "bad"].indexOf(tone) + Number(alarm);
}

/**
 * The state of a fleet is that of its worst craft, by name; all are in `craft`.
 * @param {MissionJson} mission @param {import("./types.js").CraftJson[]} fleet @param {Seen} seen @returns {MissionState}
 */
function stateOfFleet({ plan, setting, ...mission }, fleet, seen) {
  // Who knows no ages of each craft knows how long ago the answer was.
  const by = seen.age_s !== undefined && plan ? seen.age_s - plan.age_s : 0, aged = (/** @type {{ age_s: number } | undefined} */ of) => of && of.age_s + by;
  const craft = fleet.map(({ id, away, plan: its, steering }) => {
    const known = { age_s: aged(its), said_s: aged(steering), lost: seen.lost, ...seen.craft?.(id) };
    const steered = stateOf({ ...mission, plan: its, steering, surface_craft: [] }, known), isNew = !its && !steering, absent = !isNew && away && AWAY[away];
    // Whoever steers a silent craft may know why.
    const reason = away === "silent" && steering?.why && steered.words !== NOT_KNOWN && `${steered.words}: ${steering.why}`;
    const state = absent && (away === "silent" || badness(steered) < badness(absent)) ? { ...steered, ...absent, why: [absent.why, reason].filter(Boolean).join("; ") } : steered;
    const standsBy = setting?.surface_craft?.find((/** @type {{ id: string }} */ other) => other.id === id)?.serves?.length === 0;
    // Nothing is asked of it.
    return { id, standsBy, state: standsBy && state.alarm ? { ...state, tone: /** @type {"warn"} */ ("warn"), alarm: false } : state };
  });
  const worst = Math.max(...craft.map(({ state }) => badness(state))), those = craft.filter(({ state }) => badness(state) === worst), [{ state }] = those;
  const alike = those.length === craft.length && those.every(({ state: { words, why } }) => words === state.words && why === state.why);
  const words = those.map(({ id, standsBy, state: its }) => `${id}${standsBy ? ", stood down" : ""}: ${its.words}`).join("; "), newest = Math.min(...craft.map(({ state: { age_s = NaN } }) => age_s));
  const told = alike ? { words: state.tone === "good" ? state.words : `all craft: ${state.words}` } : those.length > 1 ? { words, why: "", near: undefined } : { words };
  return { ...state, ...told, age_s: Number.isNaN(newest) ? undefined : newest, craft };
}

/**
 * Whether the craft of a live mission is steered says who steers it, and nobody else.
 * @param {MissionJson} mission @param {{ age_s?: number, said_s?: number, lost?: string }} seen @returns {MissionState}
 */
function steeringOf({ status, kind, plan, scene, steering }, { age_s = plan?.age_s ?? Infinity, said_s = steering?.age_s ?? Infinity, lost = "" }) {
  if (status === "failed") return { words: "failed", why: "", tone: "bad", alarm: true };
  if (status !== "running") return { words: status, why: "", tone: "", alarm: false };
  /** @param {MissionState} state what is told while the service does not answer is no good news @returns {MissionState} */
  const unlessLost = (state) => (lost && state.tone === "good" ? { ...state, tone: "warn" } : state);
  if (kind !== "live") return unlessLost(planned(plan, []));
  const { waits_for = [] } = plan ?? {}, isOld = Number.isFinite(age_s) && age_s > ageMax(plan?.period_s ?? scene?.period_s), old = isOld ? { age_s } : {};
  const waits = waits_for.length ? [`waits for reports of ${waits_for.map((id) => (id === "asc" ? "the surface craft" : id)).join(", ")}`] : [];
  const causes = !isOld ? [] : waits.length ? waits : ["no new plan"];
  const because = (/** @type {string} */ first) => [first, ...causes].filter(Boolean).join("; ");
  if (steering && said_s <= KNOWN_S * (scene?.clock_rate ?? 1)) {
    if (steering.state === "person") return { words: "a person has the craft", why: steering.why, tone: "warn", alarm: false, ...old };
    if (steering.state === "waiting") return { words: "not steering", why: steering.why, tone: "warn", alarm: false, ...old };
    if (steering.state === "not_steering") return { words: "not steering", why: because(steering.why), tone: "bad", alarm: true, ...old };
    // Whoever steers says what is missing to call it good, and whether the plan is too old for that.
    const followed = planned(plan, waits), isWorse = steering.state === "degraded" && !followed.alarm;
    if (isWorse) return { words: "degraded", why: steering.why, tone: "bad", alarm: true, ...old };
    return steering.why && !followed.alarm ? { ...followed, why: steering.why, tone: "warn", ...old } : unlessLost({ ...followed, ...old });
  }
  if (lost) return { words: NOT_KNOWN, why: lost, tone: "bad", alarm: true, ...old };
  const unsaid = steering ? "no report from the bridge" : "nobody says whether the craft is steered";
  return { words: NOT_KNOWN, why: because(unsaid), tone: steering || isOld ? "bad" : "warn", alarm: Boolean(steering) || isOld, ...old };
}

/** What the plans amount to while they are followed, with what keeps new ones from being made. @param {MissionJson["plan"]} plan @param {string[]} causes @returns {MissionState} */
function planned(plan, causes) {
  const craft = (plan?.warning_codes ?? []).filter(isAlarm).map((code) => CRAFT_ALARMS[/** @type {keyof typeof CRAFT_ALARMS} */ (code)]);
  const degraded = plan?.outcome === "degraded" ? [degradedWords(plan.reason ?? ""), `${methodName(plan.method)} answers`] : [];
  const [words, ...others] = [...degraded.length || causes.length ? ["degraded"] : [], ...causes, ...degraded, ...craft].filter(Boolean);
  return words ? { words, why: others.join("; "), tone: "bad", alarm: true } : { words: "steering", why: "", tone: "good", alarm: false };
}

/** @param {string} reason */
function degradedWords(reason) {
  return Object.hasOwn(REASONS, reason) ? REASONS[/** @type {keyof typeof REASONS} */ (reason)] : reason.replaceAll("_", " ");
}

/** A state as the title of the tab: alarms first. @param {MissionState | null | undefined} state @param {string} title */
export function tabTitle(state, title) {
  return `${state?.alarm ? `⚠ ${state.words}${state.age_s === undefined ? "" : ` ${ageWords(state.age_s)}`} · ` : ""}${title}`;
}
