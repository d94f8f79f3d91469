// The plan of a snapshot and the answers of the laws: map, distance over time, replay.

import { figureEllipses, figureLine, placeMarks } from "./figure.js";
import { auvColour, el, fill, swatch } from "./dom.js";
import { methodName, number } from "./format.js";
import { MapView } from "./map.js";
import { ChartStack } from "./chart.js";
import { noGoLines } from "./limits.js";
import { violationWords } from "./picture.js";
import { tangentPlane } from "./background.js";
import { addVessels, vesselsOf } from "./traffic.js";
import { addTour, VisitStrip } from "./visits.js";

/**
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {{ t_s: number, north_m: number, east_m: number, heading_rad: number }} TrajectoryPoint
 */

/** Colours of the answers; the first two are shown from the start. @type {[string, string][]} */
const ANSWER_COLOURS = [["mpc", "plan"], ["saturated_los", "los"], ["saturated_los_tracker_frame", "craft-4"], ["integral_los", "craft-5"], ["waypoint_box", "craft-6"]];
const SHOWN_FIRST = 2, ARROW_S = 12, REPLAY_SPEED = 10;
/** Points of a forecast from one ellipse to the next. */
const ELLIPSE_EVERY = 6;

/** The picture of a comparison. */
export class PlanPicture {
  constructor() {
    this.shown = new Set(ANSWER_COLOURS.slice(0, SHOWN_FIRST).map(([name]) => name));
    this.after = 0;
    this.frame = 0;
    /** @type {any} */
    this.request = null;
    /** @type {{ [name: string]: any }} */
    this.plans = {};
    const place = el("div", { class: "map-place" }), charts = el("div"), errors = el("div");
    this.visits = new VisitStrip();
    this.boxes = el("div", { class: "plan-laws row", role: "group", "aria-label": "Answers shown" });
    this.playButton = el("button", { type: "button", onclick: () => this.toggle() }, "▶ Play");
    this.slider = el("input", { type: "range", min: "0", max: "1000", value: "0", "aria-label": "Time of the forecast", oninput: () => { this.stop(); this.after = Number(this.slider.value) / 1000 * this.length; this.draw(); } });
    this.clock = el("output", { class: "clock" }, "now");
    this.element = el("div", {}, el("section", { class: "panel map-panel", "aria-label": "Map of the snapshot" }, place, this.visits.element, this.boxes),
      el("div", { class: "transport", role: "group", "aria-label": "Replay" }, this.playButton, this.slider, this.clock), el("section", { class: "panel charts", "aria-label": "Predicted distance to the goal" }, charts),
      this.errorsPanel = el("section", { class: "panel charts", "aria-label": "Expected errors of the AUVs" }, errors));
    this.map = new MapView(place);
    this.charts = new ChartStack(charts, { onCursor: (x) => { if (x !== null) { this.stop(); this.after = x; this.draw(); } }, formatX: (x) => `+${number(x, 0)} s` });
    this.errors = new ChartStack(errors, { formatX: (x) => `+${number(x / 60, 0)} min`, onCursor: (x) => { this.errors.setCursor(x); this.errors.draw(); } });
    this.redraw = () => this.draw();
    addEventListener("themechange", this.redraw);
  }

  get length() {
    const trajectory = this.plans.mpc?.trajectory ?? [];
    return trajectory.length ? trajectory.at(-1).t_s - trajectory[0].t_s : 1;
  }

  /** @param {any} request @param {{ [name: string]: any }} plans */
  show(request, plans) {
    [this.request, this.plans, this.after] = [request, plans, 0];
    fill(this.boxes, ANSWER_COLOURS.filter(([name]) => plans[name]).map(([name, colour]) => el("label", {}, el("input", {
      type: "checkbox", checked: this.shown.has(name), onchange: (/** @type {Event} */ event) => {
        if (/** @type {HTMLInputElement} */ (event.target).checked) this.shown.add(name); else this.shown.delete(name);
        this.draw();
      },
    }), swatch(colour), methodName(name))));
    this.map.fit();
    this.draw();
  }

  draw() {
    if (!this.plans.mpc) return;
    const { after } = this;
    this.slider.value = String(Math.round((after / this.length) * 1000));
    this.clock.textContent = after < 0.5 ? "now" : `+${number(after, 0, "s")}`;
    this.slider.setAttribute("aria-valuetext", `${number(after, 0)} seconds from now`);
    this.map.draw(this.picture());
    this.visits.draw(this.schedule());
    this.charts.setCharts([this.distances()]);
    this.charts.setCursor(after);
    this.charts.draw();
    const errors = this.expectedErrors();
    this.errorsPanel.hidden = !errors.curves.length;
    this.errors.setCharts([errors]);
    this.errors.draw();
  }

  /** @returns {import("./types.js").Visits} */
  schedule() {
    const { request, plans: { mpc }, after } = this, begin = mpc.trajectory[0].t_s;
    return { schedule: mpc.schedule, goal: request.goal, now: begin + after, begin, clock: (t) => (Math.abs(t - begin) < 1 ? "now" : `+${number((t - begin) / 60, 0, "min")}`), order: mpc.targets.map((/** @type {any} */ target) => target.id) };
  }

  /** @returns {Picture} */
  picture() {
    const { request, plans, after } = this, { mpc } = plans;
    const start = mpc.trajectory[0].t_s;
    const line = (/** @type {any[]} */ points) => points.map((point) => /** @type {[number, number]} */ ([point.north_m, point.east_m]));
    /** @type {Picture} */
    const picture = { tracks: [], lines: [], discs: [], ellipses: [], marks: [], arrows: [], vehicles: [], current: currentOf(mpc, request), origin: mpc.origin ?? null, label: "" };
    for (const disc of request.keep_outs ?? []) {
      const [north, east] = placeOf(disc, mpc.origin);
      picture.discs.push({ north, east, radius: disc.radius_m, colour: "bad", style: "keep-out" });
    }
    picture.lines.push(...noGoLines(request.no_go ?? [], (corner) => placeOf(corner, mpc.origin)));
    if (request.area?.length) picture.lines.push({ points: request.area.map((/** @type {any} */ point) => placeOf(point, mpc.origin)), colour: "bad", style: "area", closed: true });
    for (const stretch of stretches(mpc.goal.trajectory)) picture.lines.push({ points: line(stretch), colour: "goal", style: "wide" });
    for (const [i, target] of mpc.targets.entries()) this.addTarget(picture, target, auvColour(i), request.acoustics?.range_max_m);
    for (const [name, colour] of ANSWER_COLOURS.toReversed()) {
      const plan = plans[name];
      if (!plan || !this.shown.has(name)) continue;
      picture.lines.push({ points: line(plan.trajectory), colour, style: name === "mpc" ? "solid" : "dashed" });
      picture.arrows.push({ north: mpc.trajectory[0].north_m, east: mpc.trajectory[0].east_m, heading: plan.reference.heading_rad, length_m: plan.reference.speed_mps * ARROW_S, colour });
      const there = at(plan.trajectory, start + after);
      if (after > 0.5) picture.vehicles.push({ kind: "craft", north: there.north_m, east: there.east_m, heading: there.heading_rad, colour });
      for (const violation of name === "mpc" ? plan.violations : []) {
        const place = at(plan.trajectory, violation.t_s);
        picture.marks.push({ north: place.north_m, east: place.east_m, kind: "violation", colour: "bad", title: violationWords(violation) });
      }
    }
    if (mpc.figure) {
      const placeOf = (/** @type {string} */ id) => mpc.targets.filter((/** @type {any} */ target) => target.id === id).map((/** @type {any} */ { trajectory: [first] }) => /** @type {[number, number]} */ ([first.north_m, first.east_m]))[0];
      picture.lines.push({ points: figureLine(mpc.figure), colour: "goal", style: "dashed" });
      picture.ellipses.push(...figureEllipses(mpc.figure, placeOf));
    }
    addVessels(picture, requestVessels(request, mpc), this.length, after);
    const [first] = mpc.trajectory;
    addTour(picture, [first.north_m, first.east_m], start + after, this.schedule());
    picture.vehicles.push({ kind: "craft", north: first.north_m, east: first.east_m, heading: request.asc.heading_rad ?? first.heading_rad, colour: "hull", name: "surface craft" });
    for (const [id, reports] of rawReports(request)) for (const [i, report] of reports.entries()) this.addReport(picture, id, i, report);
    picture.label = `Map of the snapshot ${this.clock.textContent}: ${picture.vehicles.map((vehicle) => vehicle.name && `${vehicle.name} at ${number(vehicle.north, 0)} m north, ${number(vehicle.east, 0)} m east`).filter(Boolean).join("; ")}`;
    return picture;
  }

  /** @param {Picture} picture @param {any} target @param {string} colour @param {number | undefined} range */
  addTarget(picture, target, colour, range) {
    const points = target.trajectory, now = at(points, points[0].t_s + this.after), i = nearest(points, points[0].t_s + this.after);
    picture.lines.push({ points: points.map((/** @type {any} */ point) => [point.north_m, point.east_m]), colour, style: "dotted" });
    picture.marks.push(...placeMarks(target.id, (target.estimate.places ?? []).map((/** @type {any} */ at) => [at.north_m, at.east_m, at.probability]), colour));
    points.forEach((/** @type {any} */ point, /** @type {number} */ k) => {
      const variance = target.position_sigma_m[k] ** 2 / 2;
      if (k % ELLIPSE_EVERY === 0 || k === points.length - 1) picture.ellipses.push({ north: point.north_m, east: point.east_m, covariance: [variance, 0, variance], colour });
    });
    const next = points[Math.min(i + 1, points.length - 1)], before = points[Math.max(Math.min(i, points.length - 2), 0)], { estimate } = target;
    const heading = Math.hypot(next.north_m - before.north_m, next.east_m - before.east_m) > 1e-6 ? Math.atan2(next.east_m - before.east_m, next.north_m - before.north_m) : Math.atan2(estimate.east_mps, estimate.north_mps);
    const depth = target.depths_m[i] ?? estimate.depth_m;
    picture.vehicles.push({ kind: "auv", north: now.north_m, east: now.east_m, heading, colour, name: target.id, note: `${number(depth, 1, "m")} deep` });
    if (range) picture.discs.push({ north: now.north_m, east: now.east_m, radius: Math.sqrt(Math.max(range ** 2 - depth ** 2, 0)), colour: "fix", style: "acoustic" });
  }

  /** @param {Picture} picture @param {string} id @param {number} i @param {any} report */
  addReport(picture, id, i, report) {
    const [north, east] = placeOf(report, this.plans.mpc.origin);
    const refused = this.plans.mpc.targets.find((/** @type {any} */ target) => target.id === id)?.estimate.rejected.includes(i);
    picture.marks.push({ north, east, kind: refused ? "refused" : "fix", colour: refused ? "bad" : "fix", title: `${id}: fix ${i}${refused ? ", refused" : ""}` });
  }

  /** @returns {import("./chart.js").Chart} */
  distances() {
    const curves = ANSWER_COLOURS.filter(([name]) => this.plans[name] && this.shown.has(name)).map(([name, colour]) => {
      const { trajectory, goal } = this.plans[name], [{ t_s: start }] = trajectory;
      return {
        name: methodName(name), colour, dash: /** @type {"solid" | "dashed"} */ (name === "mpc" ? "solid" : "dashed"), length: trajectory.length,
        x: trajectory.map((/** @type {TrajectoryPoint} */ point) => point.t_s - start),
        y: trajectory.map((/** @type {TrajectoryPoint} */ point, /** @type {number} */ i) => Math.hypot(point.north_m - goal.trajectory[i].north_m, point.east_m - goal.trajectory[i].east_m)),
      };
    });
    return { id: "distance", title: "Predicted distance to the goal", unit: "m", zero: true, curves };
  }

  /** Errors of the AUVs' own navigation over the next minutes, on the figure and without it. @returns {import("./chart.js").Chart} */
  expectedErrors() {
    const { figure, targets } = this.plans.mpc, vehicles = /** @type {import("./types.js").LocalisedVehicle[]} */ (figure?.vehicles ?? []);
    const curves = vehicles.flatMap(({ auv, over_time: rows = [] }) => {
      const i = targets.findIndex((/** @type {any} */ { id }) => id === auv), x = rows.map(([after]) => after);
      const curve = (/** @type {string} */ name, /** @type {1 | 2} */ column, /** @type {"solid" | "dashed"} */ dash) => ({ name, colour: auvColour(i), dash, x, y: rows.map((row) => row[column]), length: rows.length });
      return rows.length ? [curve(auv, 1, "solid"), curve(`${auv}, if it stayed above`, 2, "dashed")] : [];
    });
    return { id: "errors", title: "Expected error of each AUV", unit: "m", zero: true, curves };
  }

  toggle() {
    if (this.frame) return this.stop();
    if (this.after >= this.length - 0.5) this.after = 0;
    this.playButton.textContent = "❚❚ Pause";
    let last = performance.now();
    const step = (/** @type {number} */ now) => {
      this.after = Math.min(this.after + ((now - last) / 1000) * REPLAY_SPEED, this.length);
      last = now;
      this.draw();
      if (this.after >= this.length) this.stop(); else this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
  }

  leave() {
    this.stop();
    removeEventListener("themechange", this.redraw);
  }

  stop() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.playButton.textContent = "▶ Play";
  }
}

/**
 * Where a position of a request is, [north, east] in m: given so, or in degrees.
 * @param {any} position
 * @param {import("./background.js").Origin | undefined} origin
 * @returns {[number, number]}
 */
function placeOf(position, origin) {
  if (Array.isArray(position)) return [position[0], position[1]];
  return origin && typeof position.lat_deg === "number" ? tangentPlane(origin)(position.lon_deg, position.lat_deg) : [position.north_m, position.east_m];
}

/** The vessels of a request, as its plan forecasts them. @param {any} request @param {any} mpc */
export function requestVessels({ traffic = [] }, { trajectory, avoidance, origin }) {
  const now = trajectory[0].t_s, asc = trajectory.map((/** @type {any} */ point) => placeOf(point, origin)), after_s = trajectory.map((/** @type {any} */ { t_s }) => t_s - now);
  const vessels = traffic.map((/** @type {any} */ vessel) => {
    const { id, name, status, t_s = now, speed_mps } = vessel, age_s = now - t_s, [north, east] = placeOf(vessel, origin);
    const angle = (/** @type {string} */ of) => vessel[`${of}_rad`] ?? (vessel[`${of}_deg`] * Math.PI) / 180, course = ["course", "heading"].map(angle).find(Number.isFinite);
    const speed = ["at_anchor", "moored", "aground"].includes(status) ? 0 : speed_mps, way = speed === 0 ? [0, 0] : [Math.cos(course), Math.sin(course)].map((share) => share * speed);
    const velocity = way.every(Number.isFinite) ? way : undefined, [vn, ve] = velocity ?? [0, 0];
    return { id, name, age_s, velocity, position: [north + vn * age_s, east + ve * age_s] };
  });
  return vesselsOf({ asc, after_s, avoidance, vessels });
}

/** @param {any} mpc @param {any} request */
function currentOf(mpc, request) {
  return mpc.current ? { north_mps: mpc.current.north_mps, east_mps: mpc.current.east_mps, estimated: !request.current } : null;
}

/** @param {any} request @returns {[string, any[]][]} */
function rawReports(request) {
  return (request.auvs ?? []).map((/** @type {any} */ auv) => [auv.id, auv.reports ?? []]);
}

/** A goal that changes from one vehicle to the next jumps: no line leads there. @param {any[]} points @returns {any[][]} */
function stretches(points) {
  /** @type {any[][]} */
  const found = [];
  points.forEach((point, i) => {
    const before = points[i - 1];
    const jumps = !before || Math.hypot(point.north_m - before.north_m, point.east_m - before.east_m) > 2 * Math.hypot(before.north_mps, before.east_mps) * (point.t_s - before.t_s) + 1;
    if (jumps) found.push([]);
    found[found.length - 1].push(point);
  });
  return found;
}

/** @param {any[]} points @param {number} t */
function nearest(points, t) {
  const i = points.findIndex((point) => point.t_s >= t);
  return i < 0 ? points.length - 1 : i;
}

/** @param {any[]} points @param {number} t @returns {any} */
function at(points, t) {
  const i = nearest(points, t);
  if (i === 0) return points[0];
  const [a, b] = [points[i - 1], points[i]], f = Math.min((t - a.t_s) / (b.t_s - a.t_s), 1);
  const turn = (b.heading_rad ?? 0) - (a.heading_rad ?? 0), mix = (/** @type {string} */ key) => a[key] + f * (b[key] - a[key]);
  return { t_s: t, north_m: mix("north_m"), east_m: mix("east_m"), heading_rad: (a.heading_rad ?? 0) + f * Math.atan2(Math.sin(turn), Math.cos(turn)) };
}
