// A route for an AUV of a live mission: of a file, which the service reads, or of way-points clicked on the map.

import { el, fill } from "./dom.js";
import { tangentPlane } from "./background.js";
import { askJson } from "./service.js";

/**
 * @typedef {[number, number] | { lat_deg: number, lon_deg: number }} WayPoint as a path takes it
 * @typedef {{ kind: string, points: WayPoint[], turn_radius_m?: number, legs?: object[] }} WayPoints
 * @typedef {{ path: { segments: WayPoints[], closed: boolean, speed_mps?: number }, notes?: string[] }} RouteOfFile
 * @typedef {(what: string, action: () => Promise<any>, done?: (answer: any) => void) => void} Give
 */

/** No way-points. @type {RouteOfFile} */
const NO_ROUTE = { path: { segments: [{ kind: "waypoints", points: [] }], closed: false } };

/** The form, and the route as it is so far. */
export class RouteDraft {
  /** @param {Give} give @param {(paths: { [auv: string]: unknown }) => Promise<any>} patch */
  constructor(give, patch) {
    this.give = give;
    this.route = NO_ROUTE;
    /** Draws the map again. */
    this.changed = () => {};
    this.about = el("p", { class: "said" });
    this.auv = el("select", { "aria-label": "AUV of the route" });
    this.name = el("input", { type: "text", placeholder: "of several routes, the name", "aria-label": "Name of the route in the file" });
    this.speed = el("input", { type: "number", min: "0.01", max: "10", step: "any", placeholder: "speed, m/s", "aria-label": "Speed along the route, m/s" });
    this.file = el("input", { type: "file", "aria-label": "Route file", onchange: () => this.file.files?.[0] && this.takeFile(this.file.files[0]) });
    this.pick = el("input", { type: "checkbox" });
    const button = (/** @type {string} */ text, /** @type {() => void} */ onclick) => el("button", { type: "button", onclick }, text);
    const change = (/** @type {unknown} */ path) => give("Change of the route", () => patch({ [this.auv.value]: path }));
    this.buttons = [
      button("Send the route", () => change(this.path())),
      button("Clear", () => this.take(NO_ROUTE)),
      button("The AUV follows no known route", () => change(null)),
    ];
    this.element = el("details", { class: "order route", name: "order" }, el("summary", {}, "Route of an AUV"), el("p", {}, "Drop a file of a planning tool on the map, choose one, or click way-points."),
      this.auv, this.file, this.name, el("label", {}, this.pick, "click way-points on the map"), this.speed, el("div", { class: "row" }, this.buttons), this.about);
  }

  /** Whether taps on the map are way-points. */
  get picks() {
    return this.element.open && this.pick.checked && !this.pick.disabled;
  }

  /** Reads a file. @param {File} file */
  takeFile(file) {
    const name = this.name.value ? `?name=${encodeURIComponent(this.name.value)}` : "";
    const headers = { "content-type": "application/octet-stream" };
    this.element.open = true;
    this.give(file.name, () => askJson(`/v1/routes${name}`, { method: "POST", headers, body: file }), (route) => this.take(route));
  }

  /** A click on the map. @param {number} north @param {number} east */
  place(north, east) {
    const { path } = this.route, [segment] = path.segments;
    const points = [...segment.points, /** @type {WayPoint} */ ([Number(north.toFixed(2)), Number(east.toFixed(2))])];
    this.take({ ...this.route, path: { ...path, segments: [{ ...segment, points, legs: undefined }] } });
  }

  /** @param {RouteOfFile} route */
  take(route) {
    this.route = route;
    const { segments, closed, speed_mps } = route.path;
    if (speed_mps) this.speed.value = String(speed_mps);
    fill(this.about, [`${segments[0].points.length} way-points${closed ? ", closed" : ""}`, ...route.notes ?? []].join("; "));
    this.changed();
  }

  /** The route as a mission takes it. */
  path() {
    return { ...this.route.path, speed_mps: Number(this.speed.value) };
  }

  /** The route on the map. @param {{ lat_deg: number, lon_deg: number } | null | undefined} origin @returns {import("./types.js").Line[]} */
  lines(origin) {
    const plane = origin && tangentPlane(origin);
    const { segments, closed } = this.route.path;
    const points = segments[0].points.flatMap((point) => {
      if (Array.isArray(point)) return [point];
      return plane ? [plane(point.lon_deg, point.lat_deg)] : [];
    });
    return points.length ? [{ points, colour: "goal", style: "dashed", closed, name: "route to send" }] : [];
  }

  /** @param {string[]} auvs @param {boolean} disabled */
  became(auvs, disabled) {
    for (const control of [this.auv, this.file, this.name, this.speed, this.pick, ...this.buttons]) control.disabled = disabled;
    if (auvs.join() !== Array.from(this.auv.options, ({ value }) => value).join()) fill(this.auv, auvs.map((auv) => el("option", { value: auv }, auv)));
  }
}
