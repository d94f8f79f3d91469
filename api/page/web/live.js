// A mission of the service: its past from the record, its present from the event stream, and orders to it.

import { el, fill, named } from "./dom.js";
import { day, methodName, number } from "./format.js";
import { ageMax, ageWords, KNOWN_S, stateOf, tabTitle } from "./alarm.js";
import { ask, askJson, follow, lines, Patience, Refusal } from "./service.js";
import { Recording } from "./recording.js";
import { MissionView } from "./mission.js";
import { Bell } from "./bell.js";
import { Predictions } from "./predictions.js";
import { ordersOf } from "./orders.js";
import { trafficState } from "./traffic.js";

/**
 * @typedef {import("./app.js").Context} Context
 * @typedef {import("./types.js").MissionJson} MissionJson
 */

/** Time between two requests for the mission's state, ms. Its events tell what is urgent. */
const LOOK_MS = 5_000;
/** Time between two looks at the state, and the time after which the page was asleep in between, ms. */
const TICK_MS = 1_000, ASLEEP_MS = 3_000;
/** Ages of a stale plan that are said to a screen reader, s. It would read out one that changes every second. */
const AGES_SAID_S = [0, 5, 10, 30, 60, 300, 900, 3600, 6 * 3600, 86_400];

/**
 * Shows the mission called `id`.
 * @param {HTMLElement} root
 * @param {Context} context
 * @param {string} id
 */
export async function missionView(root, context, id) {
  const stop = new AbortController();
  context.onLeave(() => stop.abort());
  const said = el("p", { class: "loading", role: "status" }, "Loading the mission…");
  fill(root, said);
  const path = `/v1/missions/${encodeURIComponent(id)}`;
  const [mission, scene] = await Promise.all([askJson(path, { signal: stop.signal }), askJson(`${path}/scene`, { signal: stop.signal })]);
  mission.scene = scene;
  const fleet = mission.setting?.surface_craft?.length ? new (await import("./fleet.js")).Fleet() : undefined;
  if (context.gone()) return;
  new LiveMission(root, context, mission, stop.signal, fleet).start();
}

class LiveMission {
  /** @param {HTMLElement} root @param {Context} context @param {MissionJson} mission @param {AbortSignal} signal @param {import("./fleet.js").Fleet} [fleet] */
  constructor(root, context, mission, signal, fleet) {
    this.context = context;
    this.mission = mission;
    this.signal = signal;
    this.fleet = fleet;
    this.recording = this.record();
    this.link = { name: "loading", detail: "" };
    /** Age of the last plan, s of the mission's clock, and when it had that age, ms of the page's clock: the two may differ. */
    this.freshest = { age: Infinity, at: -Infinity };
    /** The same of the last word of whoever steers the craft. */
    this.said = { age: Infinity, at: -Infinity };
    /** The mission's clock by the last answer, and when the page had that, ms. */
    this.heard = { t_s: NaN, at: NaN };
    /** When the state was looked at last, and whether the page slept since and does not know yet. */
    this.ticked = performance.now();
    this.waking = this.unanswered = this.wasOld = false;
    this.spoken = el("p", { class: "unseen", role: "status" });
    this.title = el("h1", {}, named(mission.title || mission.id));
    this.state = el("p", { class: "chips" });
    this.about = el("p", { class: "about" });
    this.bell = new Bell(signal);
    this.progress = el("progress", { max: 1, value: 0, "aria-label": "History loaded" });
    this.notice = el("div", { class: "notice", role: "alert" });
    this.orders = ordersOf(mission, context, { done: (changed) => this.became(changed), redraw: () => this.view?.draw() });
    this.body = el("div");
    fill(root, el("header", { class: "mission-head" }, el("a", { href: "#/", class: "back" }, "All missions"), this.title, this.spoken, this.state, this.progress, el("div", { class: "row under" }, this.about, this.bell.element)), this.notice, this.body);
    /** @type {MissionView} */
    this.view = this.viewOf(this.recording);
    this.became(mission);
  }

  record() {
    return this.fleet?.record(this.mission) ?? new Recording(this.mission);
  }

  /** @param {Recording} recording @returns {MissionView} */
  viewOf(recording) {
    const { fleet } = this, runs = fleet?.show(recording, () => this.view.draw(), () => this.planAge()) ?? [{ name: "", colour: "plan", recording }];
    const predictions = new Predictions(recording, { signal: this.signal, fetched: () => this.view.draw(), lost: () => this.linked("lost", "the service does not answer") });
    return new MissionView(this.body, runs, { fleet, before: this.view, side: this.orders.element, tool: this.orders.tool, signal: this.signal, needed: (t, playing) => predictions.need(t, playing), age: () => this.planAge(), isOld: () => this.isOld() });
  }

  /** Age of the last plan now, on the mission's clock, s. */
  planAge() {
    return this.recording.live && this.mission.status === "running" ? this.sincePlan() : 0;
  }

  sincePlan() {
    return this.since(this.freshest);
  }

  /** What is now the age of something that had an age at a moment, s of the mission's clock. @param {{ age: number, at: number }} then */
  since({ age, at }) {
    return age + ((performance.now() - at) / 1000) * this.clockRate();
  }

  /** The age of what happened at `t_s`, now. After a break the stream begins with what is old. @param {number} t_s @param {number} least */
  ageOf(t_s, least) {
    const now = this.since({ age: this.heard.t_s, at: this.heard.at });
    return { age: Math.max(least, now - t_s || 0), at: performance.now() };
  }

  clockRate() {
    return this.mission.scene?.clock_rate ?? 1;
  }

  /** Whether what is shown of the present is of a stale plan. */
  isOld() {
    return this.now().age_s !== undefined;
  }

  /** The state now, by what was heard last. */
  now() {
    const lost = this.link.name === "lost" ? this.link.detail : this.unanswered ? "the service does not answer" : "";
    const craft = this.fleet?.seen((then) => this.since(then));
    return stateOf(this.mission, { age_s: this.planAge(), said_s: this.since(this.said), traffic: trafficState(this.recording), craft, lost: lost && `connection lost: ${lost}; trying again` });
  }

  /** Browsers let a hidden page sleep for up to a minute: what it knows then is too old to tell, and is asked first. */
  async tick() {
    const now = performance.now(), slept = now - this.ticked > ASLEEP_MS;
    this.ticked = now;
    if (slept && !this.waking) {
      this.waking = true;
      await this.look();
      this.waking = false;
    }
    if (!this.waking) this.drawState();
  }

  async start() {
    const tick = setInterval(() => this.tick(), TICK_MS), look = setInterval(() => this.look(), LOOK_MS);
    this.signal.addEventListener("abort", () => { clearInterval(tick); clearInterval(look); clearTimeout(this.forgetting); });
    try {
      await Promise.all([this.preview(), this.loadHistory()]);
      if (this.signal.aborted) return;
      await follow(this.mission.id, this.recording.sequence, {
        take: (sequence, event) => this.take(sequence, event),
        state: (name, detail) => this.linked(name, detail),
      }, this.signal);
    } catch (error) {
      if (!this.signal.aborted) this.failed(error);
    }
  }

  /** Shows the present while the past is still loading. */
  async preview() {
    if (!this.mission.plan) return;
    const reference = `/v1/missions/${encodeURIComponent(this.mission.id)}/reference`, asked = this.mission.surface_craft?.map(({ id }) => `${reference}?craft=${encodeURIComponent(id)}`) ?? [reference];
    try {
      const answers = await Promise.all(asked.map((path) => askJson(path, { signal: this.signal })));
      if (this.recording.plans.length) return;
      const shown = this.record();
      for (const { plan, t_s, sequence, craft } of answers) shown.takeAny(sequence, { ...previewOf(plan, t_s), craft }, (unix) => unix);
      this.view = this.viewOf(shown);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
    }
  }

  /** Loads the past, and starts again if the connection is lost. */
  async loadHistory() {
    const patience = new Patience();
    while (!this.signal.aborted) {
      try {
        const past = await this.past();
        this.progress.hidden = true;
        this.recording = past;
        this.view = this.viewOf(past);
        this.drawState();
        return;
      } catch (error) {
        if (this.signal.aborted) return;
        // A busy service is asked again. Other refusals are final.
        if (error instanceof Refusal && error.problem.status < 429) throw error;
        this.linked("lost", error instanceof Refusal ? error.message : "the service does not answer");
      }
      await patience.wait();
    }
  }

  /** The record until now, and the settings, which its table does not have. */
  async past() {
    const past = this.record(), record = `/v1/missions/${encodeURIComponent(this.mission.id)}/record`;
    for await (const some of lines(await ask(`${record}?format=csv`, { signal: this.signal }))) {
      past.takeLines(some);
      this.progress.value = past.sequence / Math.max(this.mission.sequence ?? 1, 1);
    }
    if (past.live) {
      for await (const some of lines(await ask(`${record}?format=events_ndjson&kinds=changed${this.fleet ? ",assigned" : ""}`, { signal: this.signal }))) {
        for (const event of some.filter(Boolean).map((line) => JSON.parse(line))) past.takePast(event, (unix) => this.clock(unix));
      }
    }
    return past;
  }

  /** @param {number} sequence @param {any} event */
  take(sequence, event) {
    // The record counts all positions from the new origin. A mission may become that of a fleet, or no longer be it.
    const { origin, surface_craft: craft } = event.kind === "changed" ? event.setting : {};
    if (origin || (craft !== undefined && Boolean(craft?.length) !== Boolean(this.fleet))) return location.reload();
    if (event.kind === "changed" && event.setting.paths) this.lookAtPaths();
    this.recording.takeEvent(sequence, event, (unix) => this.clock(unix));
    this.unanswered = false;
    this.fleet?.take(this.mission, event, (t_s, least) => this.ageOf(t_s, least), (plan) => summaryOf(event, { ...this.mission, plan }));
    if (this.fleet?.isOutdated()) this.view = this.viewOf(this.recording);
    if (event.kind === "planned") {
      this.freshest = this.ageOf(event.t_s, event.late_s || 0);
      this.mission.plan = summaryOf(event, this.mission);
      this.drawState();
    }
    else if (event.kind === "gap") this.fillGap(event);
    else if (event.kind !== "reported") this.look();
    else this.hear(event.heard.steering ?? []);
    this.view.changed();
  }

  /** What whoever steers the craft says is drawn anew as soon as it is too old. @param {{ t_s: number, state: string, why?: string }[]} said */
  hear(said) {
    const last = said.at(-1);
    if (!last) return;
    this.said = this.ageOf(last.t_s, 0);
    this.mission.steering = { state: last.state, why: last.why ?? "", age_s: this.said.age };
    this.forgetInTime();
    this.drawState();
  }

  forgetInTime() {
    clearTimeout(this.forgetting);
    this.forgetting = setTimeout(() => this.drawState(), Math.max(KNOWN_S - this.since(this.said) / this.clockRate(), 0) * 1000 + 1);
  }

  /** Fetches the paths that were changed. */
  async lookAtPaths() {
    try {
      this.mission.scene = await askJson(`/v1/missions/${encodeURIComponent(this.mission.id)}/scene`, { signal: this.signal });
      this.view.draw();
    } catch {
      // The map shows the paths before; a reload fetches them.
    }
  }

  /** Fetches the events that a slow reader of the stream missed. @param {{ from: number, to: number }} gap */
  async fillGap({ from, to }) {
    try {
      const path = `/v1/missions/${encodeURIComponent(this.mission.id)}/record?format=events_ndjson&after=${from - 1}&max_events=${to - from + 1}`;
      for await (const some of lines(await ask(path, { signal: this.signal }))) {
        for (const event of some.filter(Boolean).map((line) => JSON.parse(line))) this.recording.takeAny(event.sequence, event, (unix) => this.clock(unix));
      }
      this.view.changed();
    } catch {
      // The page's log shows the gap; a reload fills it.
    }
  }

  /** The mission's clock at a Unix time. @param {number} unix */
  clock(unix) {
    const created = this.mission.created_s ?? 0;
    return this.recording.live ? created + this.clockRate() * (unix - created) : unix;
  }

  /** @param {string} name @param {string} detail */
  linked(name, detail) {
    if (this.link.name === "lost" && name === "live") this.look();
    this.link = { name, detail };
    this.drawState();
  }

  async look() {
    const asked = performance.now();
    try {
      this.became(await askJson(`/v1/missions/${encodeURIComponent(this.mission.id)}`, { signal: this.signal }), asked);
      this.unanswered = false;
    } catch (error) {
      if (error instanceof Refusal && error.problem.status === 404) this.failed(error);
      else this.unanswered = !this.signal.aborted && asked > this.freshest.at;
    }
  }

  /** @param {MissionJson} answer @param {number} [asked] when it was asked for, ms: a plan that was heard since is newer */
  became(answer, asked = performance.now()) {
    const known = this.mission.scene, mission = { ...answer, scene: answer.scene ?? known };
    if (answer.plan && asked > this.freshest.at) this.freshest = { age: answer.plan.age_s, at: performance.now() };
    else mission.plan = this.mission.plan ?? answer.plan;
    if (answer.steering && asked > this.said.at) this.said = { age: answer.steering.age_s, at: performance.now() };
    else mission.steering = this.mission.steering ?? answer.steering;
    mission.origin ??= known?.origin;
    this.fleet?.became(mission, this.mission, asked);
    this.mission = this.recording.mission = mission;
    this.heard = { t_s: mission.t_s + (answer.plan?.age_s ?? 0), at: performance.now() };
    this.orders.became(mission);
    const { scene = {}, created_s } = mission;
    const given = scene.information ? [" · information given: ", scene.information] : [];
    fill(this.about, mission.kind === "simulated" ? `simulated, ${scene.scenario ?? "own scenario"}, seed ${scene.seed ?? 1}${scene.controller ? `, controller: ${methodName(scene.controller)}` : ""}` : "live", created_s ? ` · created ${day(created_s)}` : "", ...given);
    this.drawState();
  }

  drawState() {
    const { mission, link, recording } = this, state = this.now();
    const { words, why, tone, age_s, near } = state, running = mission.status === "running";
    document.title = tabTitle(state, `${mission.title || mission.id} · Pilotfish`);
    this.fleet?.tell(state);
    this.bell.hear(state.alarm ? words : "", `${mission.title || mission.id}: ${words}${why && `: ${why}`}`);
    this.logAlarm(state);
    const chips = [chip([words, age_s !== undefined && ` ${ageWords(age_s)}`, why && `: ${why}`, near && `: ${near}`].filter(Boolean).join(""), `state ${tone}`)];
    if (running) {
      chips.push(chip("running", ""));
      if (link.name === "live") chips.push(chip("connected", tone === "good" ? "good" : ""));
      if (link.name === "lost" && tone !== "bad") chips.push(chip(`connection lost: ${link.detail}; trying again`, "bad"));
      const late = recording.plans.at("late_s", Infinity);
      if (late > 0.5) chips.push(chip(`lag ${number(late, 1, "s")}`, "warn"));
    } else if (link.name === "over" && link.detail) chips.push(chip(link.detail, "bad"));
    if (age_s !== undefined) {
      this.view?.draw();
      if (!this.wasOld) this.look();
    }
    this.wasOld = age_s !== undefined;
    const fresh = el("p", {}, chips);
    if (fresh.innerHTML !== this.state.innerHTML) fill(this.state, ...fresh.childNodes);
    const said = [words, age_s !== undefined && `for more than ${ageWords(AGES_SAID_S.findLast((step) => step < age_s) ?? 0)}`, why].filter(Boolean).join(", ");
    if (said !== this.spoken.textContent) fill(this.spoken, said);
  }

  /** Alarms in the log, which has degraded plans by itself. @param {import("./types.js").MissionState} state */
  logAlarm(state) {
    const { recording, mission } = this, { alarm, words, why, age_s } = state;
    if (!recording.live || !recording.plans.length) return;
    const begin = age_s !== undefined && !recording.journal.alarm.words;
    if (this.fleet) return this.fleet.logAlarms(state, recording.plans.last + this.sincePlan());
    recording.journal.alarmed(recording.plans.last + (begin ? ageMax(mission.plan?.period_s) : this.sincePlan()), alarm && words !== "degraded" ? words : "", why);
  }

  /** @param {unknown} error */
  failed(error) {
    fill(this.notice, error instanceof Refusal ? `${error.problem.title}: ${error.message}` : `No answer: ${error}`, " ",
      el("button", { type: "button", onclick: () => location.reload() }, "Load again"));
  }
}

/** @param {string} text @param {string} kind */
function chip(text, kind) {
  return el("span", { class: `chip ${kind}` }, named(text));
}

/** What an event's plan amounts to. @param {any} event @param {MissionJson} mission @returns {import("./types.js").PlanSummary} */
function summaryOf({ outcome, reason, method, late_s, prediction }, { plan, scene }) {
  const warnings = prediction?.warnings ?? [];
  return {
    ...plan, outcome, reason, method, age_s: late_s || 0, period_s: plan?.period_s ?? scene?.period_s ?? 1, waits_for: [],
    warnings: warnings.map((/** @type {any} */ { detail }) => detail), warning_codes: warnings.map((/** @type {any} */ { code }) => code),
  };
}

/**
 * An answer as the event of a plan, so that it is drawn like one.
 * @param {any} plan
 * @param {number} t_s
 */
function previewOf(plan, t_s) {
  const point = (/** @type {any} */ at) => [at.north_m, at.east_m];
  const after_s = plan.trajectory.map((/** @type {any} */ at) => at.t_s - t_s);
  const circle = (/** @type {number} */ sigma) => [sigma ** 2 / 2, 0, sigma ** 2 / 2];
  const prediction = {
    after_s, asc: plan.trajectory.map(point), goal: plan.goal.trajectory.map(point), line_of_sight: [],
    auvs: plan.targets.map((/** @type {any} */ target) => ({
      id: target.id, positions: target.trajectory.map(point), depths_m: target.depths_m, covariances_m2: target.position_sigma_m.map(circle), age_s: target.estimate.age_s,
      drift: [target.drift.north_mps, target.drift.east_mps], route: target.estimate.route,
    })),
    line_of_sight_reference: plan.baseline, rms_m: plan.predicted.rms_error_m, line_of_sight_rms_m: plan.baseline.predicted_rms_error_m,
    craft: { follows: plan.craft_estimate.follows }, violations: plan.violations, warnings: plan.warnings, schedule: plan.schedule,
  };
  const [asc] = plan.trajectory;
  const auvs = Object.fromEntries(prediction.auvs.map((/** @type {any} */ auv) => [auv.id, { north_m: auv.positions[0][0], east_m: auv.positions[0][1], depth_m: auv.depths_m[0], heading_rad: NaN }]));
  const [goal_north_m, goal_east_m] = prediction.goal[0] ?? [NaN, NaN];
  const truth = { asc: { ...asc, speed_mps: NaN }, auvs, goal_north_m, goal_east_m, distance_m: NaN, energy_j: NaN };
  return { kind: "planned", t_s, late_s: NaN, solve_time_ns: (plan.solver?.solve_time_ms ?? NaN) * 1e6, outcome: plan.outcome, method: plan.method, reason: plan.reason, reference: plan.reference, prediction, truth };
}
