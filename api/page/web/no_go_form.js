// No-go areas: drawn and changed on the map, or from the polygons of a GeoJSON file; any other file is a route.

import { el, fill } from "./dom.js";
import { tangentPlane } from "./background.js";
import { noGoLines } from "./limits.js";
import { RouteDraft } from "./route_form.js";

/**
 * @typedef {{ polygon: Corner[], holes?: Corner[][], name?: string }} Area
 * @typedef {{ lat_deg: number, lon_deg: number } | [number, number]} Corner
 * @typedef {import("./types.js").Place} Place
 */

/** Most corners that are marked on the map. */
const MARKED_MAX = 300;

/** Said of a drawing that began from other areas than the mission has now. */
const STALE = "The mission's areas changed meanwhile: end the drawing, and begin it again";

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
    /** Areas that the mission has. @type {Area[]} */
    this.own = [];
    /** Whether taps on the map draw, the area that they draw, and the corner that is pressed. */
    this.drawing = false;
    /** The mission's areas from which the drawing began, as JSON. */
    this.begun = /** @type {string | undefined} */ (undefined);
    this.drawn = /** @type {Area | undefined} */ (undefined);
    this.held = /** @type {{ ring: Corner[], i: number } | undefined} */ (undefined);
    this.disabled = false;
    /** Where a corner is on the map. @type {(corner: Corner) => [number, number]} */
    this.placeOf = () => [NaN, NaN];
    this.about = el("p", { class: "said", role: "status" });
    const button = (/** @type {string} */ text, /** @type {() => void} */ onclick) => el("button", { type: "button", onclick }, text);
    const change = (/** @type {Area[]} */ no_go) => give("No-go areas", () => patch({ no_go }).then((/** @type {unknown} */ answer) => (this.take([]), answer)));
    this.file = el("input", { type: "file", accept: ".geojson,.json,application/geo+json", "aria-label": "File of no-go areas", onchange: () => this.file.files?.[0] && this.takeFile(this.file.files[0]) });
    this.pen = button("Draw", () => this.draw(!this.drawing));
    this.send = button("Send the areas", () => change(this.areas));
    this.remove = button("Remove all no-go areas", () => confirm("Remove all no-go areas of this mission?") && change([]));
    this.details = el("details", { class: "order no-go", name: "order", ontoggle: () => this.details.open || this.draw(false) }, el("summary", {}, "No-go areas"),
      el("p", {}, this.pen, " Tap the corners of an area on the map, in order. Drag a corner to move it, tap it to remove it."),
      el("p", {}, "Or drop a GeoJSON file of polygons on the map, or choose one. It replaces the areas that the mission has."), this.file, el("div", { class: "row" }, this.send, this.remove), this.about);
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
    [this.drawn, this.held, this.begun] = [undefined, undefined, undefined];
    this.take(areas, file.name);
  }

  /** @param {Area[]} areas @param {string} [file] */
  take(areas, file) {
    this.areas = areas;
    const corners = areas.reduce((sum, { polygon, holes = [] }) => sum + [polygon, ...holes].flat().length, 0);
    if (!areas.length) {
      this.begun = undefined;
      this.draw(false);
    }
    fill(this.about, this.isStale ? STALE : file ? `${file}: ${areas.length} area${areas.length === 1 ? "" : "s"} with ${corners} corners, not sent yet` : `The mission has ${this.own.length || "no"} no-go area${this.own.length === 1 ? "" : "s"}`);
    this.send.disabled = this.disabled || this.isStale || !areas.length;
    this.redraw();
  }

  /** Whether the mission's areas changed since a drawing began from them. */
  get isStale() {
    return this.begun !== undefined && this.begun !== JSON.stringify(this.own);
  }

  /** Begins an area on the map, beside those that the mission has, or ends that. @param {boolean} on */
  draw(on) {
    [this.drawing, this.drawn] = [on, undefined];
    this.pen.setAttribute("aria-pressed", String(on));
    if (on && !this.areas.length) [this.areas, this.begun] = [structuredClone(this.own), JSON.stringify(this.own)];
    // Nothing was drawn, or of what is gone.
    if (!on && (this.isStale || this.begun === JSON.stringify(this.areas))) [this.areas, this.begun] = [[], undefined];
    this.redraw();
  }

  /** Each ring, and where its corners are, m. @returns {{ ring: Corner[], i: number, north: number, east: number }[]} */
  corners() {
    const rings = this.areas.flatMap(({ polygon, holes = [] }) => [polygon, ...holes]);
    return rings.flatMap((ring) => ring.map((corner, i) => ({ ring, i, north: this.placeOf(corner)[0], east: this.placeOf(corner)[1] })));
  }

  /** The corners that can be moved and removed: of many, those of the area that is drawn alone. */
  marked() {
    const all = this.corners();
    return all.length <= MARKED_MAX ? all : all.filter(({ ring }) => ring === this.drawn?.polygon);
  }

  /** Whether taps on the map are for areas, or for the route. */
  draws() {
    return this.drawing || this.route.picks;
  }

  aims() {
    return this.draws();
  }

  /** @param {Place} at @param {number} near */
  press(at, near) {
    if (!this.drawing) return false;
    const off = (/** @type {Place} */ { north, east }) => Math.hypot(north - at.north, east - at.east);
    [this.held] = this.marked().filter((corner) => off(corner) < near).sort((a, b) => off(a) - off(b));
    return this.held !== undefined;
  }

  /** @param {Place} at */
  move(at) {
    if (!this.held) return;
    this.held.ring[this.held.i] = cornerAt(at);
    this.take(this.areas, "On the map");
  }

  release() {
    this.held = undefined;
  }

  /** @param {Place} at */
  tap(at) {
    if (!this.drawing) return this.route.place(at.north, at.east);
    if (this.held) {
      this.held.ring.splice(this.held.i, 1);
      for (const area of this.areas) area.holes = area.holes?.filter((hole) => hole.length);
      return this.take(this.areas.filter(({ polygon }) => polygon.length), "On the map");
    }
    if (!this.drawn?.polygon.length) this.areas.push(this.drawn = { polygon: [], holes: [] });
    this.drawn.polygon.push(cornerAt(at));
    this.take(this.areas, "On the map");
  }

  /** What is drawn, with the areas to send and the route. @param {import("./types.js").Overlay} drawn @param {import("./background.js").Origin | null | undefined} origin @returns {import("./types.js").Overlay} */
  over(drawn, origin) {
    const plane = origin && tangentPlane(origin);
    this.placeOf = (corner) => (Array.isArray(corner) ? corner : plane ? plane(corner.lon_deg, corner.lat_deg) : [NaN, NaN]);
    const marks = (this.drawing ? this.marked() : []).map(({ north, east }) => ({ north, east, kind: /** @type {const} */ ("handle"), colour: "button" }));
    return { ...drawn, lines: [...drawn.lines, ...noGoLines(this.areas, this.placeOf), ...this.route.lines(origin)], marks: [...drawn.marks, ...marks] };
  }

  /** @param {import("./types.js").MissionJson} mission @param {boolean} disabled */
  became({ setting, scene }, disabled) {
    this.route.became(scene?.auvs ?? [], disabled);
    this.disabled = this.file.disabled = this.pen.disabled = disabled;
    if (disabled && this.drawing) this.draw(false);
    const own = setting?.no_go ?? scene?.no_go ?? [], isOther = JSON.stringify(this.own) !== JSON.stringify(own);
    this.remove.disabled = disabled || !own.length;
    this.own = own;
    this.send.disabled = disabled || this.isStale || !this.areas.length;
    if (isOther && !this.areas.length) this.take([]);
    if (this.isStale) fill(this.about, STALE);
  }
}

/** @param {Place} at @returns {Corner} */
function cornerAt({ north, east }) {
  return [Number(north.toFixed(1)), Number(east.toFixed(1))];
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
