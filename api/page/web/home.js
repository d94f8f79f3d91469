// The first page: an introduction, the missions, scenarios to run, and a link to plan one snapshot.

import { el, fill, named } from "./dom.js";
import { day, duration, methodName, number } from "./format.js";
import { ageWords, stateOf, tabTitle } from "./alarm.js";
import { Bell } from "./bell.js";
import { ask, askJson, freshKey, Refusal, send } from "./service.js";
import { refusalWords } from "./orders.js";
import { thumbnail, thumbnailKey } from "./thumbnail.js";

/**
 * @typedef {import("./app.js").Context} Context
 * @typedef {{ name: string, title: string, duration_s: number }} GalleryScenario
 */

/** Time between two requests for the list of missions, ms. */
const POLL_MS = 2_000;
/** Missions on one page of the list, and missions shown at first. */
const PAGE = 1_000, SHOWN = 50;
/** Groups of scenarios by their names: each is in the first that it fits. @type {[string, RegExp][]} */
const GROUPS = [
  ["The paper's missions", /^paper/], ["Hand-overs and turns", /^(switching|about|anti|crowded|otter)/], ["Surveys", /^(survey|fast)/], ["Visits", /^visit/], ["Ranges", /^localise/],
  ["Other vessels", /^traffic/], ["No-go areas", /^no-go/], ["Silence and faults", /^(silence|target|faults)/], ["Water and noise", /./],
];
/** Units of the costs of visits. @type {Record<string, string>} */
const COST_UNITS = { age: "s since a visit", uncertainty: "m² of variance", data: "kbit not uploaded" };
/** Speed factor of a run from the gallery: fast enough to see it end, slow enough to watch. */
const WATCHED_SPEED = 60;

/**
 * @param {HTMLElement} root
 * @param {Context} context
 */
export function homeView(root, context) {
  const stop = new AbortController();
  context.onLeave(() => stop.abort());
  const missions = el("div"), state = el("p", { class: "said", role: "status" }), gallery = el("div");
  const more = el("button", { type: "button", hidden: true }, "Show all"), bell = new Bell(stop.signal);
  fill(root,
    el("header", { class: "home-head" }, el("h1", {}, "Where should the surface craft steer, so that it is above its AUVs?"),
      el("p", {}, "Pilotfish computes this every second. Run a scenario in the simulator and watch the plans, or post the fixes of your own vehicles.")),
    context.role === "read-only" && el("p", { class: "notice" }, "Read-only: with your token you can see everything and plan snapshots. To run scenarios and give orders you need an operator's token."),
    el("section", { "aria-labelledby": "missions-title" }, el("h2", { id: "missions-title" }, "Missions"), bell.element, state, missions, more),
    el("section", { "aria-labelledby": "gallery-title" }, el("h2", { id: "gallery-title" }, "Run a scenario"),
      el("p", { class: "about" }, "Each picture shows a simulated run, beside the strongest line-of-sight law; bars are distances to the goal (RMS). ",
        el("label", {}, "Seed ", seedField()), " ", el("label", {}, "Find ", el("input", { type: "search", oninput: (/** @type {Event} */ event) => find(gallery, /** @type {HTMLInputElement} */ (event.target).value) }))), thumbnailKey(), gallery),
    el("section", { "aria-labelledby": "plan-title" }, el("h2", { id: "plan-title" }, "Plan one snapshot"),
      el("p", {}, el("a", { href: "#/plan" }, "Edit a snapshot of your vehicles as JSON"), " and see the plan, the line-of-sight laws and an explanation.")));
  showGallery(gallery, context, stop.signal);
  pollMissions({ list: missions, state, more, bell }, context, stop.signal);
}

function seedField() {
  return el("input", { id: "seed", type: "number", min: "0", max: "999999", value: "1" });
}

function seedOf() {
  const seed = Number(/** @type {HTMLInputElement | null} */ (document.getElementById("seed"))?.value);
  return Number.isInteger(seed) && seed >= 0 ? seed : 1;
}

/** @param {HTMLElement} gallery @param {Context} context @param {AbortSignal} signal */
async function showGallery(gallery, context, signal) {
  try {
    const { scenarios } = await askJson("/gallery.json", { signal });
    const groupOf = (/** @type {{ name: string }} */ { name }) => GROUPS.find(([, fits]) => fits.test(name));
    fill(gallery, GROUPS.map((group, i) => el("details", { open: !i }, el("summary", {}, group[0]),
      el("ul", { class: "gallery" }, scenarios.filter((/** @type {any} */ scenario) => groupOf(scenario) === group).map((/** @type {any} */ scenario) => card(scenario, context))))));
  } catch (error) {
    if (!signal.aborted) fill(gallery, el("p", { class: "notice" }, `The scenarios could not be loaded: ${error}`));
  }
}

/** Shows the scenarios with `words`, or all groups again. @param {HTMLElement} gallery @param {string} words */
function find(gallery, words) {
  const wanted = words.toLowerCase().split(/\s+/);
  gallery.querySelectorAll("details").forEach((group, i) => {
    const cards = [...group.querySelectorAll("li")];
    for (const each of cards) each.hidden = !wanted.every((word) => each.textContent?.toLowerCase().includes(word));
    group.hidden = cards.every((each) => each.hidden);
    group.open = words ? !group.hidden : !i;
  });
}

/** @param {any} scenario @param {Context} context */
function card(scenario, context) {
  const { rms_m, law, visits, localised_rms_m } = scenario, said = el("p", { class: "said", role: "status" }), forbidden = context.role === "read-only";
  const run = el("button", {
    type: "button", class: "primary", disabled: forbidden, "aria-label": `Run ${scenario.name}`, onclick: async () => {
      fill(said, "Starting…");
      try {
        const seed = seedOf(), key = freshKey();
        const { id } = await send("/v1/missions", { schema_version: "1.0", title: `${scenario.name}, seed ${seed}`, simulated: { scenario: scenario.name, seed } }, { key });
        await send(`/v1/missions/${id}/run`, { speed_factor: WATCHED_SPEED }, { key: `${key} run` });
        context.go(`#/mission/${id}`);
      } catch (error) {
        fill(said, error instanceof Refusal ? refusalWords(error) : `No answer: ${error}`);
      }
    },
  }, "Run");
  const compare = el("button", { type: "button", disabled: forbidden, "aria-label": `Compare ${scenario.name}`, onclick: () => context.go(`#/compare?${new URLSearchParams({ scenario: scenario.name, seed: String(seedOf()) })}`) }, "Compare");
  const bar = (/** @type {string} */ colour, /** @type {string} */ name, /** @type {number} */ value) => el("p", { class: "bar", style: `--bar: var(--${colour}); --share: ${(100 * value) / Math.max(...rms_m)}%` }, `${number(value, 2, "m")} ${name}`);
  return el("li", { class: "panel gallery-card" }, thumbnail(scenario), el("h3", {}, scenario.name), el("p", {}, scenario.title),
    el("p", { class: "about" }, duration(scenario.duration_s)), rms_m && [bar("plan", "planner", rms_m[0]), bar("los", `${methodName(law)}, tuned`, rms_m[1])],
    visits && el("p", {}, `Planner: ${visits.n} visits, mean ${number(visits.mean, 1, COST_UNITS[visits.cost])}`), localised_rms_m && el("p", {}, `Planner: AUVs ${number(localised_rms_m, 1, "m")} off (RMS)`),
    el("div", { class: "row" }, run, compare), said);
}

/** @param {{ list: HTMLElement, state: HTMLElement, more: HTMLButtonElement, bell: Bell }} places @param {Context} context @param {AbortSignal} signal */
async function pollMissions({ list, state, more, bell }, context, signal) {
  fill(list, el("p", { class: "loading" }, "Loading missions…"));
  let all = false, lost = 0, asked = 0;
  /** @type {any[]} */
  let missions = [];
  more.onclick = () => { all = true; more.hidden = true; };
  const show = () => {
    const by = (performance.now() - asked) / 1000, seen = (/** @type {any} */ { plan, steering }) => ({
      age_s: plan && plan.age_s + by, said_s: steering && steering.age_s + by, lost: lost ? "the service does not answer" : "",
    });
    const states = new Map(missions.map((mission) => [mission, stateOf(mission, seen(mission))]));
    showMissions(list, all ? missions : missions.slice(0, SHOWN), states, context);
    if (lost) return;
    const alarms = missions.filter((mission) => mission.status === "running" && states.get(mission)?.alarm), age = (/** @type {any} */ mission) => states.get(mission)?.age_s ?? 0;
    const [worst] = alarms.sort((a, b) => age(b) - age(a)), state = states.get(worst), name = worst?.title || worst?.id;
    bell.hear(worst ? `${worst.id} ${state?.words}` : "", worst && `${name}: ${state?.words}`);
    document.title = tabTitle(state, worst ? `${name} · Pilotfish` : "Pilotfish");
  };
  while (!signal.aborted) {
    list.classList.toggle("outdated", lost > 0);
    // A hidden page sends no requests, unless it is to sound an alarm.
    while (document.hidden && !bell.on && !signal.aborted) await new Promise((resume) => setTimeout(resume, POLL_MS));
    try {
      const now = performance.now();
      missions = await everyMission(signal);
      if (signal.aborted) return;
      [asked, lost] = [now, 0];
      fill(state);
      more.hidden = all || missions.length <= SHOWN;
      more.textContent = `Show all ${missions.length}`;
    } catch (error) {
      if (signal.aborted) return;
      lost ||= Date.now();
      bell.hear("no answer", "The service does not answer");
      document.title = `⚠ no answer ${ageWords((Date.now() - lost) / 1000)} · Pilotfish`;
      fill(state, error instanceof Refusal ? refusalWords(error) : `The service has not answered for ${duration((Date.now() - lost) / 1000)}; the list is out of date. Trying again.`);
    }
    // A long list costs the service more, so it is requested less often; what it says ages meanwhile.
    for (let parts = 4 * (Math.ceil(missions.length / PAGE) || 1); parts && !signal.aborted; parts -= 1) {
      if (asked) show();
      await new Promise((resume) => setTimeout(resume, POLL_MS / 4));
    }
  }
}

/** @param {AbortSignal} signal @returns {Promise<any[]>} running ones first, then the newest */
async function everyMission(signal) {
  const missions = [];
  for (let after = 0; ;) {
    const page = await askJson(`/v1/missions?limit=${PAGE}&after=${after}`, { signal });
    missions.push(...page.missions);
    if (!page.next) break;
    after = page.next;
  }
  const rank = (/** @type {any} */ mission) => ["running", "paused", "created"].indexOf(mission.status) >>> 0;
  return missions.sort((a, b) => rank(a) - rank(b) || b.created_s - a.created_s);
}

/** Columns of the list of missions. */
const COLUMNS = ["mission", "state", "answered by", "lag", "last heard", "warnings", "created"];

/**
 * Shows the missions. In existing rows only changed cells are replaced.
 * @param {HTMLElement} list
 * @param {any[]} missions
 * @param {Map<any, import("./types.js").MissionState>} states
 * @param {Context} context
 */
function showMissions(list, missions, states, context) {
  if (!missions.length) return fill(list, el("p", { class: "empty panel" }, "No missions yet. Run a scenario below, or create one through the API."));
  let body = list.querySelector("tbody");
  if (!body) {
    body = el("tbody");
    fill(list, el("div", { class: "table-scroll panel", tabIndex: 0, role: "group", "aria-label": "Missions" }, el("table", { class: "home-missions" },
      el("thead", {}, el("tr", {}, [...COLUMNS, ...context.role === "admin" ? ["delete"] : []].map((name) => el("th", { scope: "col" }, name)))), body)));
  }
  const rows = new Map(Array.from(body.rows, (row) => [row.dataset.id, row]));
  const wanted = missions.map((mission) => {
    const row = rows.get(mission.id) ?? newRow(mission, context);
    fillRow(row, mission, states.get(mission) ?? stateOf(mission));
    return row;
  });
  // A row in its place is not moved, so that it keeps the focus and its open details.
  wanted.forEach((row, i) => { if (body.rows[i] !== row) body.insertBefore(row, body.rows[i] ?? null); });
  while (body.rows.length > wanted.length) body.rows[wanted.length].remove();
}

/** @param {any} mission @param {Context} context */
function newRow(mission, context) {
  const row = el("tr", {}, el("th", { scope: "row" }, el("a", { href: `#/mission/${encodeURIComponent(mission.id)}` }, named(mission.title || mission.id)), " ", el("span", { class: "kind" }, mission.controller ? `${mission.kind}, ${methodName(mission.controller)}` : mission.kind)),
    COLUMNS.slice(1).map((name) => el("td", { class: name === "warnings" ? "notes" : "" })),
    context.role === "admin" && el("td", {}, el("button", { type: "button", class: "danger", "aria-label": `Delete ${mission.title || mission.id}`, onclick: () => remove(mission) }, "Delete")));
  row.dataset.id = mission.id;
  return row;
}

/** @param {HTMLTableRowElement} row @param {any} mission @param {import("./types.js").MissionState} state */
function fillRow(row, mission, state) {
  const { status } = mission, running = status === "running";
  // The plan of a finished mission may still be in memory; it is not shown.
  const plan = running || status === "paused" ? mission.plan : null;
  // The clock runs on between plans.
  const now = plan ? mission.t_s + (mission.kind === "live" ? plan.age_s : 0) : NaN;
  const ages = running && plan ? Object.entries(plan.heard_s).map(([id, t]) => ({ id, age: now - Number(t) })).sort((a, b) => b.age - a.age) : [];
  const [oldest] = ages, { words, why, tone, age_s } = state;
  const notes = running && plan ? [...plan.waits_for.map((/** @type {string} */ id) => `waits for ${id}`), ...plan.warnings] : [];
  const cells = [
    [el("span", { class: `chip ${tone}` }, words, age_s !== undefined && ` ${ageWords(age_s)}`), why && el("span", { class: "why" }, " ", named(why))],
    [plan && age_s === undefined ? methodName(plan.method) : "–"],
    [running && plan ? number(plan.late_s * 1000, 0, "ms") : "–"],
    oldest ? [named(oldest.id), ` ${duration(Math.max(oldest.age, 0))} ago`] : ["–"],
    notes.length ? [el("details", {}, el("summary", {}, String(notes.length)), notes.map((note) => el("p", {}, named(note))))] : ["–"],
    [day(mission.created_s)],
  ];
  row.classList.toggle("old", age_s !== undefined);
  const deletion = row.querySelector("button.danger");
  if (deletion instanceof HTMLElement) deletion.hidden = running;
  cells.forEach((content, i) => {
    const cell = row.cells[i + 1], fresh = el("td", {}, content);
    const was = cell.querySelector("details");
    // An open detail stays open, and does not count as a change.
    if (was?.open) fresh.querySelector("details")?.setAttribute("open", "");
    if (fresh.innerHTML !== cell.innerHTML) cell.replaceChildren(...fresh.childNodes);
  });
}

/** @param {any} mission */
async function remove(mission) {
  if (!confirm(`Delete ${mission.title || mission.id} and its record? This cannot be undone.`)) return;
  try {
    await ask(`/v1/missions/${encodeURIComponent(mission.id)}`, { method: "DELETE" });
  } catch (error) {
    alert(error instanceof Refusal ? refusalWords(error) : `No answer: ${error}`);
  }
}
