// Where the craft may go, and where it was beyond that.

/** Tolerance of a limit, for rounding, m. */
const NOTICEABLE_M = 0.01;
/** Most violations kept. */
const BREACHES_MAX = 500;

/**
 * @typedef {import("./types.js").Breach} Breach
 * @typedef {Required<Pick<import("./types.js").Scene, "keep_outs" | "area" | "no_go">>} Bounds
 * @typedef {import("./recording.js").Recording} Recording
 */

/**
 * Polygons to keep out of, for a map: each filled but for its holes, and its borders.
 * @param {any[]} areas @param {(corner: any) => [number, number]} [placeOf] @returns {import("./types.js").Line[]}
 */
export function noGoLines(areas, placeOf = (corner) => corner) {
  return areas.flatMap(({ polygon, holes = [] }) => {
    const rings = [polygon, ...holes].map((ring) => ring.map(placeOf)), as = (/** @type {any} */ points, /** @type {any} */ style) => ({ points, colour: "bad", style, closed: true, aside: true });
    // From the border to each hole and back: the rule of even and odd leaves the holes free.
    return [as(rings.flatMap((ring) => [...ring, ring[0], rings[0][0]]), "land"), ...rings.map((ring) => as(ring, "thin"))];
  });
}

/** Limits of a recording's craft over time, and what it broke of them. */
export class Limits {
  /** @param {Recording} recording */
  constructor(recording) {
    this.recording = recording;
    /** Discs and areas of a live mission, by the time from which they count. @type {({ t: number } & Bounds)[]} */
    this.settings = [];
    this.found = /** @type {Breach[]} */ ([]);
    /** Those that go on, by their limit. @type {Map<string, Breach>} */
    this.now = new Map();
    /** Number of positions checked. */
    this.looked = 0;
  }

  /**
   * Discs and areas at `time`.
   * @param {number} time
   * @returns {Bounds}
   */
  at(time) {
    const { keep_outs, area, no_go } = this.settings.findLast(({ t }) => t <= time) ?? this.recording.scene;
    return { keep_outs: keep_outs ?? [], area: area ?? [], no_go: no_go ?? [] };
  }

  /**
   * Takes the discs and areas of a live mission's setting from `t` on.
   * @param {number} t
   * @param {{ [bound in keyof Bounds]?: Bounds[bound] | null }} setting
   */
  take(t, setting) {
    const before = this.at(t);
    const { keep_outs = before.keep_outs, area = before.area, no_go = before.no_go } = setting;
    this.settings = this.settings.filter((other) => other.t !== t).concat({ t, keep_outs: keep_outs ?? [], area: area ?? [], no_go: no_go ?? [] }).sort((a, b) => a.t - b.t);
  }

  /** Where the craft was beyond a limit until `time`: an entry for each stay, where that was farthest. @param {number} time */
  brokenUntil(time) {
    for (; this.looked < this.recording.craft.length; this.looked += 1) this.look(this.looked);
    return this.found.filter(({ t }) => t <= time);
  }

  /** @param {number} i a place of the craft */
  look(i) {
    const { found, now, recording } = this, { craft, scene: { range_max_m: range } } = recording;
    const [t, north, east] = ["t", "north", "east"].map((name) => craft.column(name)[i]), { keep_outs, area, no_go } = this.at(t);
    const take = (/** @type {string} */ key, /** @type {string} */ limit, /** @type {number} */ beyond) => {
      const open = now.get(key);
      if (!(beyond > NOTICEABLE_M)) now.delete(key);
      else if (!open) {
        const breach = { t, from: t, to: t, north, east, limit, beyond };
        now.set(key, breach);
        found.push(breach);
        if (found.length > BREACHES_MAX) found.shift();
      } else Object.assign(open, { to: t }, beyond > open.beyond && { t, north, east, beyond });
    };
    for (const disc of keep_outs) take(`disc ${disc.north_m} ${disc.east_m} ${disc.radius_m}`, "inside a keep-out", disc.radius_m - Math.hypot(north - disc.north_m, east - disc.east_m));
    no_go.forEach(({ polygon, holes = [] }, i) => take(`no-go ${i}`, "inside a no-go area", inside([polygon, ...holes], north, east)));
    if (area.length) take("area", "outside the area", outside(area, north, east));
    for (const [id, series] of range ? recording.servedAt(t) : []) {
      const [n, e, depth] = ["north", "east", "depth"].map((name) => series.at(name, t));
      take(`range ${id}`, `out of acoustic range of ${id}`, Math.hypot(north - n, east - e, depth || 0) - (range ?? Infinity));
    }
  }
}

/** Distance of a point from the border of a polygon, m. @param {[number, number][]} corners @param {number} north @param {number} east */
function off(corners, north, east) {
  return corners.reduce((nearest, [n0, e0], i) => {
    const [n1, e1] = corners[(i + 1) % corners.length], [dn, de] = [n1 - n0, e1 - e0];
    const along = Math.min(Math.max(((north - n0) * dn + (east - e0) * de) / (dn * dn + de * de || 1), 0), 1);
    return Math.min(nearest, Math.hypot(north - n0 - along * dn, east - e0 - along * de));
  }, Infinity);
}

/** Depth of a point in a polygon with holes, m; 0 outside. @param {[number, number][][]} rings @param {number} north @param {number} east */
function inside(rings, north, east) {
  const met = (/** @type {[number, number][]} */ ring) => ring.filter(([n0, e0], i) => {
    const [n1, e1] = ring[(i + 1) % ring.length];
    return north < n0 !== north < n1 && east < e0 + ((north - n0) / (n1 - n0)) * (e1 - e0);
  }).length;
  return rings.reduce((sum, ring) => sum + met(ring), 0) % 2 ? Math.min(...rings.map((ring) => off(ring, north, east))) : 0;
}

/**
 * Distance of a point outside a convex area, m; 0 inside.
 * @param {[number, number][]} corners either way round
 * @param {number} north
 * @param {number} east
 */
function outside(corners, north, east) {
  return inside([corners], north, east) ? 0 : off(corners, north, east);
}
