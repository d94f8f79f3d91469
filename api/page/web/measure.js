// The measuring tool of a map: distance and true bearing from the craft, from the place before, or along a drag.

import { number } from "./format.js";
import { convergence } from "./background.js";

/**
 * @typedef {import("./types.js").Place} Place
 * @typedef {import("./types.js").Picture} Picture
 * An end that is on a vehicle moves with it.
 * @typedef {Place & { name?: string }} End
 */

/** A tool that measures while it is `on`. */
export class Measure {
  /** @param {() => void} changed */
  constructor(changed) {
    this.changed = changed;
    this.on = false;
    /** @type {End | null} */
    this.from = this.to = null;
    /** @type {Picture | null} */
    this.picture = null;
  }

  /** @param {boolean} on */
  turn(on) {
    this.on = on;
    this.from = this.to = null;
    this.changed();
  }

  /** The vehicle near a place, or the place. @param {Place} at @param {number} near @returns {End} */
  end(at, near) {
    const vehicle = this.picture?.vehicles.find(({ name, north, east }) => name && Math.hypot(north - at.north, east - at.east) < near);
    return { north: at.north, east: at.east, name: vehicle?.name };
  }

  /** @param {Place} at @param {number} near */
  press(at, near) {
    this.pressed = this.end(at, near);
    this.near = near;
    return true;
  }

  /** @param {Place} at */
  move(at) {
    this.from = this.pressed ?? null;
    this.to = this.end(at, this.near ?? 0);
    this.changed();
  }

  release() {}

  /** @param {Place} at @param {number} near */
  tap(at, near) {
    const craft = this.picture?.vehicles.find(({ kind }) => kind === "craft");
    this.from = this.to ?? (craft ? { north: craft.north, east: craft.east, name: craft.name } : this.end(at, near));
    this.to = this.end(at, near);
    this.changed();
  }

  aims() {
    return this.on;
  }

  draws() {
    return this.on;
  }

  /** Where an end is now. @param {End} end @returns {End} */
  now(end) {
    return { ...end, ...end.name && this.picture?.vehicles.find(({ name }) => name === end.name) };
  }

  /** What is measured, in words: the whole of it, and in short. */
  words() {
    const { picture } = this;
    if (!this.from || !this.to || !picture) return null;
    const [a, b] = [this.now(this.from), this.now(this.to)], distance = Math.hypot(b.north - a.north, b.east - a.east);
    const turn = ((Math.atan2(b.east - a.east, b.north - a.north) + convergence(picture.origin, a.north, a.east)) * 180) / Math.PI;
    const short = `${number(distance, 1, "m")}, ${((turn + 360) % 360).toFixed(1).padStart(5, "0").replace("360.0", "000.0")}°`;
    return { a, b, short, whole: [a.name && `from ${a.name}`, b.name && `to ${b.name}`, short].filter(Boolean).join(" ") };
  }

  /** @param {Picture} picture @returns {import("./types.js").Overlay} */
  overlay(picture) {
    this.picture = picture;
    const found = this.words();
    if (!found) return { lines: [], discs: [], marks: [] };
    const { a, b, short } = found, ends = [a, b].map(({ north, east }) => /** @type {import("./types.js").Mark} */ ({ north, east, kind: "dot", colour: "ink" }));
    return {
      lines: [{ points: [[a.north, a.east], [b.north, b.east]], colour: "ink", style: "solid", name: "measured" }], discs: [],
      marks: [...ends, { north: (a.north + b.north) / 2, east: (a.east + b.east) / 2, kind: "label", colour: "ink", text: short }],
    };
  }
}
