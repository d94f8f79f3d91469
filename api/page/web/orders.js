// Orders to a mission, for callers whose role allows them.

import { el, fill } from "./dom.js";
import { RouteDraft } from "./route_form.js";
import { freshKey, Refusal, send } from "./service.js";

/**
 * @typedef {import("./app.js").Context} Context
 * @typedef {import("./types.js").MissionJson} MissionJson
 */

/** Speed factors of a simulated mission. Without one it runs as fast as possible. */
const RUN_SPEEDS = [1, 10, 60, 300];
/** Dwell time of the offered intermittent goal, s. */
const DWELL_S = 240;
/** Range of a new goal that stays in range, m. */
const RANGE_M = 100;

/**
 * The form of orders, the function that updates it, and a live mission's route to send.
 * @param {MissionJson} mission
 * @param {Context} context
 * @param {(mission: MissionJson) => void} done
 */
export function ordersOf(mission, context, done) {
  const said = el("p", { class: "said", role: "status" });
  const path = `/v1/missions/${encodeURIComponent(mission.id)}`;
  const give = async (/** @type {string} */ what, /** @type {() => Promise<any>} */ action, /** @type {(answer: any) => void} */ then = done) => {
    fill(said, `${what}…`);
    try {
      then(await action());
      fill(said, `${what}: done`);
    } catch (error) {
      fill(said, `${what}: `, error instanceof Refusal ? refusalWords(error) : `no answer (${error}); try again`);
    }
  };
  const order = (/** @type {string} */ what, /** @type {string} */ call, /** @type {unknown} */ body = undefined) => give(what, () => send(`${path}/${call}`, body, { key: freshKey() }));
  const speed = el("select", { "aria-label": "Speed of the simulation" }, el("option", { value: "" }, "as fast as possible"), RUN_SPEEDS.map((factor) => el("option", { value: String(factor), selected: factor === 60 }, `${factor}×`)));
  const run = el("button", { type: "button", class: "primary", onclick: () => order("Run", "run", mission.kind === "simulated" && speed.value ? { speed_factor: Number(speed.value) } : {}) }, "Run");
  const pause = el("button", { type: "button", onclick: () => order("Pause", "pause") }, "Pause");
  const finish = el("button", { type: "button", class: "danger", onclick: () => confirm("End this mission? It cannot be resumed.") && order("Finish", "finish") }, "Finish");
  // The setting is changed only if the mission is still as the page shows it.
  let revision = mission.revision;
  const patch = (/** @type {unknown} */ setting) => send(path, setting, { method: "PATCH", key: freshKey(), ifMatch: revision });
  const pin = pinForm((value) => give("Next visit", () => patch({ goal: value })));
  const goal = goalForm((value) => give("Change of goal", () => patch({ goal: value })), said);
  const route = new RouteDraft(give, (paths) => patch({ paths }));
  const readOnly = context.role === "read-only" && el("p", { class: "why" }, "Read-only: orders need an operator's token.");
  const element = el("section", { class: "panel orders", "aria-labelledby": "orders-title" }, el("h2", { id: "orders-title" }, "Orders"), readOnly,
    el("div", { class: "row" }, run, mission.kind === "simulated" && speed, pause, finish), mission.kind === "live" && [pin.element, goal.element, route.element], said);
  const became = (/** @type {MissionJson} */ { revision: shown, status, setting, scene }) => {
    revision = shown;
    const over = status === "finished" || status === "failed", forbidden = context.role === "read-only";
    run.disabled = speed.disabled = forbidden || over || status === "running";
    pause.disabled = forbidden || status !== "running";
    finish.disabled = forbidden || over;
    pin.became(setting?.goal, forbidden || over);
    goal.became(setting?.goal, scene?.auvs ?? [], forbidden || over);
    route.became(scene?.auvs ?? [], forbidden || over);
    element.classList.toggle("over", over);
  };
  return { element, became, route: mission.kind === "live" ? route : undefined };
}

/** @param {Refusal} refusal */
export function refusalWords({ problem, message }) {
  const errors = problem.errors.map((error) => `${error.pointer ?? error.parameter ?? ""} ${error.detail}`.trim());
  return [message || problem.title, ...errors].join("; ");
}

/** Pins the next visit of a goal that visits, and releases it. @param {(goal: unknown) => void} change */
function pinForm(change) {
  let goal = /** @type {any} */ (null);
  const auv = el("select", { "aria-label": "AUV to visit next" });
  const pin = el("button", { type: "button", onclick: () => change({ ...goal, next: auv.value }) }, "Pin");
  const release = el("button", { type: "button", onclick: () => { const { next, ...free } = goal; change(free); } }, "Release");
  const element = el("div", { class: "row pin", hidden: true }, "Next", auv, pin, release);
  const became = (/** @type {any} */ now, /** @type {boolean} */ disabled) => {
    const visits = now?.kind === "visit";
    element.hidden = !visits;
    auv.disabled = pin.disabled = disabled;
    release.disabled = disabled || !now?.next;
    if (visits && JSON.stringify(now) !== JSON.stringify(goal)) fill(auv, now.auvs.map((/** @type {string} */ id) => el("option", { value: id, selected: id === now.next }, id)));
    goal = now;
  };
  return { element, became };
}

/**
 * @param {(goal: unknown) => void} change
 * @param {HTMLElement} said
 */
function goalForm(change, said) {
  const text = el("textarea", { rows: 4, spellcheck: false, "aria-label": "New goal, as JSON" });
  const offers = el("select", { "aria-label": "Goals to start from", onchange: () => { text.value = offers.value; } });
  const button = el("button", {
    type: "button", onclick: () => {
      try {
        change(JSON.parse(text.value));
      } catch (error) {
        fill(said, `The goal is not JSON: ${error instanceof Error ? error.message : error}`);
      }
    },
  }, "Change the goal");
  const element = el("details", { class: "goal" }, el("summary", {}, "Change of goal"), offers, text, button);
  let shown = "";
  const became = (/** @type {any} */ goal, /** @type {string[]} */ auvs, /** @type {boolean} */ disabled) => {
    text.disabled = offers.disabled = button.disabled = disabled;
    const now = JSON.stringify(goal) + auvs.join();
    if (now === shown || !goal) return;
    shown = now;
    text.value = JSON.stringify(goal);
    const entries = [["the current goal", goal], ...auvs.map((auv) => [`track ${auv}`, { kind: "track", auv }])];
    if (auvs.length > 1) entries.push(["midpoint of all", { kind: "midpoint", auvs }], ["in turn", { kind: "intermittent", auvs, dwell_s: DWELL_S, epoch_s: 0 }], ["in range of all", { kind: "range", auvs, range_m: RANGE_M }], ["visit each", { kind: "visit", auvs }]);
    fill(offers, entries.map(([name, value]) => el("option", { value: JSON.stringify(value) }, name)));
  };
  return { element, became };
}
