// Orders from files: no-go areas from the polygons of a GeoJSON file, or a route from any other.

import { el, fill } from "./dom.js";
import { tangentPlane } from "./background.js";
import { noGoLines } from "./limits.js";
import { RouteDraft } from "./route_form.js";

/**
 * @typedef {{ polygon: Corner[], holes: Corner[][], name?: string }} Area
 * @typedef {{ lat_deg: number, lon_deg: number }} Corner
 */

/** Most bytes of a name that a mission takes, less than so many letters. */
const NAME_MAX = 16;

/** What a file that is dropped on the map, or chosen, makes of a mission. */
export class FileOrders {
  /** @param {import("./route_form.js").Give} give @param {(setting: unknown) => Promise<any>} patch @param {() => void} redraw */
  constructor(give, patch, redraw) {
    this.route = new RouteDraft(give, (paths) => patch({ paths }));
    this.route.changed = this.redraw = redraw;
    this.give = give;
    this.areas = /** @type {Area[]} */ ([]);
    /** Number of areas that the mission has. */
    this.now = 0;
    this.disabled = false;
    this.about = el("p", { class: "said", role: "status" });
    const button = (/** @type {string} */ text, /** @type {() => void} */ onclick) => el("button", { type: "button", onclick }, text);
    const change = (/** @type {Area[]} */ no_go) => give("No-go areas", () => patch({ no_go }).then((/** @type {unknown} */ answer) => (this.take([]), answer)));
    this.file = el("input", { type: "file", accept: ".geojson,.json,application/geo+json", "aria-label": "File of no-go areas", onchange: () => this.file.files?.[0] && this.takeFile(this.file.files[0]) });
    this.send = button("Send the areas", () => change(this.areas));
    this.remove = button("Remove all no-go areas", () => confirm("Remove all no-go areas of this mission?") && change([]));
    this.details = el("details", { class: "order no-go", name: "order" }, el("summary", {}, "No-go areas"), el("p", {}, "Drop a GeoJSON file of polygons on the map, or choose one. It replaces the areas that the mission has."),
      this.file, el("div", { class: "row" }, this.send, this.remove), this.about);
    this.element = el("div", {}, this.details, this.route.element);
    this.take([]);
  }

  /** Reads a file. @param {File} file */
  async takeFile(file) {
    let areas = /** @type {Area[] | null} */ (null);
    try {
      areas = areasOf(JSON.parse(await file.text()));
    } catch {
      // Another format, or damaged: the service says what is wrong with it as a route.
    }
    if (!areas?.length) return this.route.takeFile(file);
    this.details.open = true;
    this.take(areas, file.name);
  }

  /** @param {Area[]} areas @param {string} [file] */
  take(areas, file) {
    this.areas = areas;
    const corners = areas.reduce((sum, { polygon, holes }) => sum + [polygon, ...holes].flat().length, 0);
    fill(this.about, file ? `${file}: ${areas.length} areas with ${corners} corners, not sent yet` : `The mission has ${this.now || "no"} no-go areas`);
    this.send.disabled = this.disabled || !areas.length;
    this.redraw();
  }

  /** The areas to send and the route on the map. @param {Corner | null | undefined} origin @returns {import("./types.js").Line[]} */
  lines(origin) {
    const plane = origin && tangentPlane(origin);
    return [...plane ? noGoLines(this.areas, ({ lon_deg, lat_deg }) => plane(lon_deg, lat_deg)) : [], ...this.route.lines(origin)];
  }

  /** @param {import("./types.js").MissionJson} mission @param {boolean} disabled */
  became({ setting, scene }, disabled) {
    this.route.became(scene?.auvs ?? [], disabled);
    this.disabled = this.file.disabled = disabled;
    const { length = 0 } = setting?.no_go ?? scene?.no_go ?? [];
    this.remove.disabled = disabled || !length;
    this.send.disabled = disabled || !this.areas.length;
    if (this.now === length) return;
    this.now = length;
    if (!this.areas.length) this.take([]);
  }
}

/** The polygons of GeoJSON that has nothing else; null if it has. @param {any} node @param {string} [name] @returns {Area[] | null} */
function areasOf(node, name) {
  // GeoJSON repeats the first corner of each ring as its last.
  const ring = (/** @type {[number, number][]} */ corners) => corners.slice(0, -1).map(([lon_deg, lat_deg]) => ({ lat_deg, lon_deg }));
  const area = (/** @type {[number, number][][]} */ [border, ...holes]) => ({ polygon: ring(border), holes: holes.map(ring), ...name && { name: name.slice(0, NAME_MAX) } });
  const all = (/** @type {any[]} */ parts) => parts.map((part) => areasOf(part, name)).reduce((all, some) => all && some && [...all, ...some], /** @type {Area[] | null} */ ([]));
  switch (node?.type) {
    case "FeatureCollection": return all(node.features);
    case "GeometryCollection": return all(node.geometries);
    case "Feature": return areasOf(node.geometry, String(node.properties?.name ?? node.properties?.OBJNAM ?? ""));
    case "Polygon": return [area(node.coordinates)];
    case "MultiPolygon": return node.coordinates.map(area);
    default: return null;
  }
}
