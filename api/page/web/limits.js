// Where the craft may go, and where it was beyond that.

/** Tolerance of a limit, for rounding, m. */
const NOTICEABLE_M = 0.01;
/** Most violations kept. */
const BREACHES_MAX = 500;

/**
 * @typedef {import("./types.js").Breach} Breach
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./recording.js").Recording} Recording
 */

/** Limits of a recording's craft over time, and what it broke of them. */
export class Limits {
  /** @param {Recording} recording */
  constructor(recording) {
    this.recording = recording;
    /** Discs and area of a live mission, by the time from which they count. @type {{ t: number, keep_outs: Scene["keep_outs"], area: Scene["area"] }[]} */
    this.settings = [];
    this.found = /** @type {Breach[]} */ ([]);
    /** Those that go on, by their limit. @type {Map<string, Breach>} */
    this.now = new Map();
    /** Number of positions checked. */
    this.looked = 0;
  }

  /**
   * Discs and area at `time`.
   * @param {number} time
   * @returns {{ keep_outs: { north_m: number, east_m: number, radius_m: number }[], area: [number, number][] }}
   */
  at(time) {
    const { keep_outs, area } = this.settings.findLast(({ t }) => t <= time) ?? this.recording.scene;
    return { keep_outs: keep_outs ?? [], area: area ?? [] };
  }

  /**
   * Takes the discs and area of a live mission's setting from `t` on.
   * @param {number} t
   * @param {{ keep_outs?: Scene["keep_outs"] | null, area?: Scene["area"] | null }} setting
   */
  take(t, setting) {
    const before = this.at(t);
    const { keep_outs = before.keep_outs, area = before.area } = setting;
    this.settings = this.settings.filter((other) => other.t !== t).concat({ t, keep_outs: keep_outs ?? [], area: area ?? [] }).sort((a, b) => a.t - b.t);
  }

  /** Where the craft was beyond a limit until `time`: an entry for each stay, where that was farthest. @param {number} time */
  brokenUntil(time) {
    for (; this.looked < this.recording.craft.length; this.looked += 1) this.look(this.looked);
    return this.found.filter(({ t }) => t <= time);
  }

  /** @param {number} i a place of the craft */
  look(i) {
    const { found, now, recording } = this, { craft, scene: { range_max_m: range } } = recording;
    const [t, north, east] = ["t", "north", "east"].map((name) => craft.column(name)[i]), { keep_outs, area } = this.at(t);
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
    if (area.length) take("area", "outside the area", outside(area, north, east));
    for (const [id, series] of range ? recording.places : []) {
      const [n, e, depth] = ["north", "east", "depth"].map((name) => series.at(name, t));
      take(`range ${id}`, `out of acoustic range of ${id}`, Math.hypot(north - n, east - e, depth || 0) - (range ?? Infinity));
    }
  }
}

/**
 * Distance of a point outside a convex area, m; 0 inside.
 * @param {[number, number][]} corners either way round
 * @param {number} north
 * @param {number} east
 */
function outside(corners, north, east) {
  let [nearest, left, right] = [Infinity, false, false];
  corners.forEach(([n0, e0], i) => {
    const [n1, e1] = corners[(i + 1) % corners.length], [dn, de] = [n1 - n0, e1 - e0];
    const along = Math.min(Math.max(((north - n0) * dn + (east - e0) * de) / (dn * dn + de * de || 1), 0), 1);
    nearest = Math.min(nearest, Math.hypot(north - n0 - along * dn, east - e0 - along * de));
    const side = dn * (east - e0) - de * (north - n0);
    left ||= side < 0;
    right ||= side > 0;
  });
  return left && right ? nearest : 0;
}
