// The page that runs one scenario and seed with several controllers and shows the runs side by side.

import { el, fill } from "./dom.js";
import { methodName } from "./format.js";
import { ask, askJson, follow, freshKey, lines, Patience, Refusal, send } from "./service.js";
import { refusalWords } from "./orders.js";
import { Recording } from "./recording.js";
import { Predictions } from "./predictions.js";
import { ComparisonView, runOf } from "./comparison.js";

/**
 * @typedef {import("./app.js").Context} Context
 * @typedef {import("./types.js").MissionJson} MissionJson
 * @typedef {import("./picture.js").Run} Run
 * `law` is the strongest, `gains` are those of each law that was tuned for the scenario, in the order of `GAINS`.
 * @typedef {{ name: string, law?: string, gains?: { [law: string]: number[] } }} Tuned
 * @typedef {{ scenario: string, seed: string, controllers: string[] }} Chosen
 */

/** Names of gains in the order of the gallery. */
const GAINS = ["look_ahead_m", "along_track_gain_per_s", "integral_gain_mps"];
const CONTROLLERS = ["mpc", "saturated_los", "saturated_los_tracker_frame", "integral_los", "waypoint_box"];
/** The planner's opponent where the gallery has no tuned law. */
const OPPONENT = "saturated_los";
/** Most runs of one comparison: one for each colour. */
const RUNS_MAX = 6;
/** Time between two redraws while runs go on, ms. */
const REDRAW_MS = 500;
/** A run is complete if its last plan is so near its end, s. */
const END_S = 1.5;
/** Most attempts at one run. */
const FLIGHTS_MAX = 20;

/**
 * @param {HTMLElement} root
 * @param {Context} context
 * @param {URLSearchParams} parameters
 */
export async function compareView(root, context, parameters) {
  const stop = new AbortController();
  context.onLeave(() => stop.abort());
  const { scenarios } = await askJson("/gallery.json", { signal: stop.signal });
  if (context.gone()) return;
  const tuned = (/** @type {string} */ name) => scenarios.find((/** @type {Tuned} */ one) => one.name === name);
  const scenario = parameters.get("scenario") ?? "", seed = parameters.get("seed") ?? "1";
  const known = (parameters.get("controllers") ?? "").split(",").filter((name) => CONTROLLERS.includes(name));
  const controllers = known.length ? known : usual(tuned(scenario)), ids = (parameters.get("missions") ?? "").split(",").filter(Boolean).slice(0, RUNS_MAX);
  document.title = scenario ? `${scenario}, seed ${seed}: compare · Pilotfish` : "Compare · Pilotfish";
  const form = el("div", {}, chooser(context, scenarios, { scenario, seed, controllers })), body = el("div"), said = el("div", { class: "notice", role: "status" });
  fill(root, el("header", { class: "mission-head" }, el("h1", {}, "Compare"),
    el("p", { class: "about" }, "Several controllers in one scenario, with the same water and the same noise. Each line-of-sight law has the gains that are best in this scenario with seed 1, as ",
      el("code", {}, "pilotfish compare"), " finds them, or the service's where the table says so.")), form, said, body);
  try {
    if (ids.length) {
      const missions = await Promise.all(ids.map((id) => stored(id, stop.signal)));
      fill(form, chooser(context, scenarios, chosenIn(missions)));
      await show(body, said, missions, stop.signal);
    } else if (!scenario) fill(said, "Choose a scenario and controllers, then run them.");
    else if (!tuned(scenario)) fill(said, "There is no such scenario: choose one from the list.");
    else if (context.role === "read-only") fill(said, "Read-only: a comparison creates missions, which needs an operator's token. You can open the link of an existing comparison.");
    else await show(body, said, await Promise.all(controllers.map((controller) => begin(scenario, Number(seed), controller, gainsOf(tuned(scenario), controller)))), stop.signal);
  } catch (error) {
    if (!stop.signal.aborted) fill(said, error instanceof Refusal ? refusalWords(error) : `No answer: ${error instanceof Error ? error.message : error}`);
  }
}

/** The planner and its strongest opponent. @param {Tuned} [scenario] */
function usual(scenario) {
  return ["mpc", scenario?.law ?? OPPONENT];
}

/** Gains of a law that were tuned for a scenario. @param {Tuned} scenario @param {string} law */
function gainsOf({ gains = {} }, law) {
  const values = gains[law];
  return values && /** @type {import("./types.js").Gains} */ (Object.fromEntries(values.map((value, i) => [GAINS[i], value])));
}

/** What made these missions; no scenario if they have different ones. @param {MissionJson[]} missions */
function chosenIn(missions) {
  const [{ scenario = "", seed = 1 } = {}] = missions.map(({ scene }) => scene);
  const alike = missions.every(({ scene }) => scene?.scenario === scenario);
  return { scenario: alike ? scenario : "", seed: String(seed), controllers: missions.map(({ scene }) => scene?.controller ?? "mpc") };
}

/** @param {Context} context @param {Tuned[]} scenarios @param {Chosen} chosen */
function chooser(context, scenarios, chosen) {
  const none = !scenarios.some(({ name }) => name === chosen.scenario) && el("option", { value: "" }, "choose one");
  const scenario = el("select", { id: "compare-scenario", required: true }, none, scenarios.map(({ name }) => el("option", { value: name, selected: name === chosen.scenario }, name)));
  const seed = el("input", { id: "compare-seed", type: "number", min: "0", max: "999999", step: "1", value: chosen.seed, required: true });
  const boxes = CONTROLLERS.map((name) => el("input", { type: "checkbox", value: name, checked: chosen.controllers.includes(name) })), notes = CONTROLLERS.map(() => el("span"));
  const of = () => scenarios.find(({ name }) => name === scenario.value);
  const note = () => CONTROLLERS.forEach((name, i) => fill(notes[i], of()?.law === name && " (strongest here)"));
  scenario.addEventListener("change", () => {
    for (const box of boxes) box.checked = usual(of()).includes(box.value);
    note();
  });
  note();
  const go = (/** @type {Event} */ event) => {
    event.preventDefault();
    const controllers = boxes.filter((box) => box.checked).map((box) => box.value);
    context.go(`#/compare?${new URLSearchParams({ scenario: scenario.value, seed: seed.value, controllers: (controllers.length ? controllers : usual(of())).join() })}`);
  };
  return el("form", { class: "panel chooser", onsubmit: go },
    el("label", {}, "Scenario ", scenario), el("label", {}, "Seed ", seed),
    el("fieldset", {}, el("legend", {}, "Controllers"), CONTROLLERS.map((name, i) => el("label", {}, boxes[i], methodName(name), notes[i]))),
    el("button", { type: "submit", class: "primary", disabled: context.role === "read-only" }, "Run and compare"));
}

/**
 * Shows the runs while they go on, to their end.
 * @param {HTMLElement} body @param {HTMLElement} said
 * @param {MissionJson[]} missions
 * @param {AbortSignal} signal
 */
async function show(body, said, missions, signal) {
  const runs = missions.map((mission, i) => runOf(mission.scene?.controller ?? "mpc", i, new Recording(mission)));
  const [{ scenario = "own scenario", seed = 1 } = {}] = missions.map(({ scene }) => scene);
  const alike = missions.every(({ scene }) => scene?.scenario === scenario && scene?.seed === seed);
  const link = new URL(`#/compare?${new URLSearchParams({ missions: missions.map(({ id }) => id).join() })}`, location.href).href;
  /** @type {ComparisonView} */
  let view;
  const predictions = runs.map(({ recording }) => new Predictions(recording, { signal, fetched: () => view.draw() }));
  view = new ComparisonView(body, runs, { name: `${scenario}-seed-${seed}`, link, signal, needed: (t, playing) => predictions.forEach((each) => each.need(t, playing)) });
  const bars = runs.map((run) => el("progress", { max: 1, value: 0, "aria-label": run.name })), links = runs.map(() => el("span", { class: "said" }));
  fill(said, runs.map((run, i) => el("label", { class: "flying" }, run.name, " ", bars[i], links[i])));
  let changed = false;
  const redraw = setInterval(() => {
    runs.forEach(({ recording }, i) => { bars[i].value = share(recording); });
    if (changed) view.changed();
    changed = false;
  }, REDRAW_MS);
  signal.addEventListener("abort", () => clearInterval(redraw));
  const ends = await Promise.allSettled(runs.map(({ recording }, i) => watch(recording, { changed: () => { changed = true; }, lost: (words) => fill(links[i], words) }, signal)));
  clearInterval(redraw);
  if (signal.aborted) return;
  view.over = true;
  view.changed();
  const broken = ends.flatMap((end, i) => (end.status === "rejected" ? [`${runs[i].name}: ${end.reason instanceof Error ? end.reason.message : end.reason}`] : []));
  const short = runs.filter(({ recording }) => !isWhole(recording)).map((run) => `${run.name} did not run to its end`);
  if (!alike) short.unshift("These missions have different scenarios or seeds: their scores cannot be compared");
  fill(said, broken.length ? broken.join("; ") : [short.length ? `${short.join("; ")}. ` : "Flown and kept as missions: ", ...missions.flatMap((mission, i) => [i > 0 && ", ", el("a", { href: `#/mission/${encodeURIComponent(mission.id)}` }, runs[i].name)]), ". This link shows the same runs again."]);
}

/** The part of it that is done, 0 to 1. @param {Recording} recording */
function share({ plans, scene }) {
  return Math.min(plans.last / (scene.duration_s ?? Infinity), 1) || 0;
}

/** @param {Recording} recording */
function isWhole({ plans, scene }) {
  return plans.last >= (scene.duration_s ?? Infinity) - END_S;
}

/** @param {string} id @param {AbortSignal} [signal] @returns {Promise<MissionJson>} */
async function stored(id, signal) {
  const path = `/v1/missions/${encodeURIComponent(id)}`;
  const [mission, scene] = await Promise.all([askJson(path, { signal }), askJson(`${path}/scene`, { signal })]);
  return { ...mission, scene, origin: scene.origin };
}

/**
 * Creates and starts the mission of one run, once for each version of the service, unless it was interrupted.
 * @param {string} scenario @param {number} seed @param {string} controller @param {import("./types.js").Gains} [gains]
 */
async function begin(scenario, seed, controller, gains) {
  const { version } = await askJson("/version");
  const simulated = { scenario, seed, ...controller !== "mpc" && { controller }, ...gains && { gains } };
  const title = `${scenario}, seed ${seed}: ${methodName(controller)}`;
  for (let flight = 1; flight <= FLIGHTS_MAX; flight += 1) {
    const key = ["compare", version, scenario, seed, controller, ...gains ? [Object.values(gains).join("/")] : [], ...flight > 1 ? [flight] : []].join(" ");
    const { id } = await send("/v1/missions", { schema_version: "1.0", title, simulated }, { key });
    const mission = await stored(id);
    const cut = mission.status === "failed" || (mission.status === "finished" && mission.t_s < (mission.scene?.duration_s ?? 0) - END_S);
    if (cut) continue;
    if (["created", "paused"].includes(mission.status)) await send(`/v1/missions/${id}/run`, {}, { key: freshKey() });
    return mission;
  }
  throw new Error(`${title} was interrupted ${FLIGHTS_MAX} times: delete its missions`);
}

/**
 * Fills `recording` with the past and the coming events, to the end.
 * @param {Recording} recording @param {{ changed: () => void, lost: (words: string) => void }} view @param {AbortSignal} signal
 */
async function watch(recording, { changed, lost }, signal) {
  const { id } = recording.mission, patience = new Patience();
  for (;;) {
    try {
      recording.newTable();
      for await (const some of lines(await ask(`/v1/missions/${encodeURIComponent(id)}/record?format=csv`, { signal }))) recording.takeLines(some);
      break;
    } catch (error) {
      if (signal.aborted || error instanceof Refusal && error.problem.status < 429) throw error;
      lost("waiting for the service");
    }
    await patience.wait();
  }
  changed();
  await follow(id, recording.sequence, {
    take: (sequence, event) => {
      recording.takeEvent(sequence, event, (unix) => unix);
      changed();
    },
    state: (name, detail) => lost(name === "lost" ? `${detail}; trying again` : ""),
  }, signal);
}
