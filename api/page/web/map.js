// The map: one scale for north and east, north up. It pans, zooms, follows the craft, and describes what is under the pointer.

import { el, fill, oncePerFrame } from "./dom.js";
import { number } from "./format.js";
import { drawPicture, pictureBounds } from "./drawing.js";
import { placeOnEarth } from "./background.js";
import { Measure } from "./measure.js";

/**
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {import("./types.js").Tool} Tool
 * @typedef {import("./types.js").Frame} Frame
 */

/** Margin around the fitted content, and more of it above, where the buttons are, pixels. */
const MARGIN_PX = 56, BUTTONS_PX = 20;
/** Least extent of a fitted view, m. */
const EXTENT_MIN_M = 30;
const SCALE_MIN = 0.0005, SCALE_MAX = 200;
/** A step of zoom, and of the arrow keys as a share of the view. */
const ZOOM_STEP = 1.4, PAN_SHARE = 0.15;
/** A pointer that moved less counts as a tap, pixels. */
const TAP_PX = 4;
/** Distance within which a pointer and a finger are over an object, pixels. */
const NEAR_PX = 14, FINGER_PX = 24;
/** For so long a tap of a finger shows the moment of a track, ms. */
const TAPPED_MS = 5_000;
/** Half the length of the cross at the middle, where a key puts what a tap puts elsewhere, pixels. */
const AIM_PX = 12;

/** A map in the element `host`. */
export class MapView {
  /** @param {HTMLElement} host @param {{ onPick?: (t: number | null) => void, tool?: Tool }} [options] */
  constructor(host, { onPick, tool } = {}) {
    this.onPick = onPick;
    this.orders = tool;
    this.canvas = el("canvas", { class: "map-canvas", tabIndex: 0, role: "img", "aria-label": "Map" });
    this.readout = el("p", { class: "map-readout", "aria-hidden": "true" });
    /** @type {Picture | null} */
    this.picture = null;
    /** @type {Frame} */
    this.frame = { width: 0, height: 0, scale: 1, north: 0, east: 0 };
    this.fitted = true;
    this.placed = false;
    /** Of the moment that a finger picked. @type {ReturnType<typeof setTimeout> | undefined} */
    this.released = undefined;
    /** Whether declared paths are fitted too. */
    this.all = this.following = false;
    /** Those that are down, whether each is where it came down, and whether the tool has it. @type {Map<number, { x: number, y: number, still: boolean, held: boolean }>} */
    this.pointers = new Map();
    this.redraw = oncePerFrame(() => this.drawNow());
    const button = (/** @type {string} */ text, /** @type {string} */ label, /** @type {() => void} */ action) => el("button", { type: "button", "aria-label": label, title: label, onclick: action }, text);
    this.followButton = button("◎", "Keep the surface craft in the middle", () => this.follow(!this.following));
    this.measured = el("p", { class: "unseen", role: "status" });
    this.measure = new Measure(() => {
      fill(this.measured, this.measure.words()?.whole ?? "");
      this.redraw();
    });
    this.measureButton = button("↔", "Measure distance and bearing: tap, or drag from place to place", () => this.toMeasure(!this.measure.on));
    this.measureButton.setAttribute("aria-pressed", "false");
    fill(host, this.canvas, el("div", { class: "map-buttons", role: "group", "aria-label": "Map view" },
      button("+", "Nearer", () => this.zoom(ZOOM_STEP)), button("−", "Farther", () => this.zoom(1 / ZOOM_STEP)), button("⤢", "Fit all", () => this.fit()), this.followButton, this.measureButton), this.readout, this.measured);
    this.follow(false);
    new ResizeObserver(() => this.redraw()).observe(host);
    this.listen();
  }

  /** @param {Picture} picture */
  draw(picture) {
    this.picture = picture;
    if (this.canvas.getAttribute("aria-label") !== picture.label) this.canvas.setAttribute("aria-label", picture.label);
    this.drawNow();
  }

  /** Fits all content, and keeps fitting until the user pans or zooms. */
  fit() {
    this.fitted = this.all = true;
    this.placed = false;
    this.follow(false);
  }

  /** @param {boolean} on */
  follow(on) {
    this.following = on;
    if (on) this.fitted = false;
    this.followButton.setAttribute("aria-pressed", String(on));
    this.redraw();
  }

  /** @param {boolean} on */
  toMeasure(on) {
    this.measure.turn(on);
    this.measureButton.setAttribute("aria-pressed", String(on));
  }

  /** What a tap goes to. @returns {Tool | undefined} */
  get tool() {
    return this.measure.on ? this.measure : this.orders;
  }

  /** What tools draw over the picture. @param {Picture} picture @returns {Picture} */
  withTools(picture) {
    const { north, east, scale } = this.frame, aim = AIM_PX / scale, drawn = [this.orders, this.measure].flatMap((tool) => tool?.overlay(picture, this.frame) ?? []);
    /** @type {import("./types.js").Line[]} */
    const cross = this.tool?.aims() && this.canvas.matches(":focus-visible") ? [[[north - aim, east], [north + aim, east]], [[north, east - aim], [north, east + aim]]].map((points) => ({ points: /** @type {[number, number][]} */ (points), colour: "ink", style: "thin" })) : [];
    return {
      ...picture, lines: [...picture.lines, ...drawn.flatMap(({ lines }) => lines), ...cross], discs: [...picture.discs, ...drawn.flatMap(({ discs }) => discs)],
      marks: [...picture.marks, ...drawn.flatMap(({ marks }) => marks)],
    };
  }

  drawNow() {
    const { canvas, picture } = this, ratio = devicePixelRatio;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!picture || !width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    this.place(picture, width, height);
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawPicture(context, this.withTools(picture), this.frame);
  }

  /** @param {Picture} picture @param {number} width @param {number} height */
  place(picture, width, height) {
    const { frame } = this;
    Object.assign(frame, { width, height });
    // Nothing moves away under a pointer that draws.
    if (this.placed && (this.pointers.size || this.tool?.draws())) return;
    const craft = picture.vehicles.find((vehicle) => vehicle.kind === "craft");
    if (this.following && craft) Object.assign(frame, { north: craft.north, east: craft.east });
    if (!this.fitted) return;
    const bounds = pictureBounds(picture, this.all) ?? pictureBounds(picture);
    if (!bounds) return;
    const extent = (/** @type {number} */ from, /** @type {number} */ to) => Math.max(to - from, EXTENT_MIN_M);
    const margin = Math.min(MARGIN_PX, width / 6);
    this.placed = true;
    Object.assign(frame, {
      east: (bounds.west + bounds.eastern) / 2,
      scale: Math.min((width - 2 * margin) / extent(bounds.west, bounds.eastern), (height - 2 * margin - BUTTONS_PX) / extent(bounds.south, bounds.northern)),
    });
    frame.north = (bounds.south + bounds.northern) / 2 + BUTTONS_PX / 2 / frame.scale;
  }

  /**
   * @param {number} factor
   * @param {{ x: number, y: number }} [about] stays where it is on the screen
   */
  zoom(factor, about = { x: this.frame.width / 2, y: this.frame.height / 2 }) {
    const { frame } = this, before = this.at(about);
    this.fitted = false;
    frame.scale = Math.min(Math.max(frame.scale * factor, SCALE_MIN), SCALE_MAX);
    const after = this.at(about);
    frame.north += before.north - after.north;
    frame.east += before.east - after.east;
    this.redraw();
  }

  /** @param {{ x: number, y: number }} pixel */
  at({ x, y }) {
    const { width, height, scale, north, east } = this.frame;
    return { north: north - (y - height / 2) / scale, east: east + (x - width / 2) / scale };
  }

  /** @param {number} dx pixels to the right @param {number} dy pixels down */
  pan(dx, dy) {
    this.fitted = false;
    if (this.following) this.follow(false);
    this.frame.east -= dx / this.frame.scale;
    this.frame.north += dy / this.frame.scale;
    this.redraw();
  }

  listen() {
    const { canvas, pointers } = this;
    const place = (/** @type {MouseEvent} */ event) => {
      const box = canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    canvas.addEventListener("wheel", (event) => {
      // The wheel without a key scrolls the page.
      if (!event.ctrlKey && !event.shiftKey && document.activeElement !== canvas) return;
      event.preventDefault();
      this.zoom(ZOOM_STEP ** (-event.deltaY / 100), place(event));
    }, { passive: false });
    const reach = (/** @type {PointerEvent} */ event) => (event.pointerType === "mouse" ? NEAR_PX : FINGER_PX) / this.frame.scale;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      const at = place(event), held = !pointers.size && Boolean(this.tool?.press(this.at(at), reach(event)));
      pointers.set(event.pointerId, { ...at, still: true, held });
    });
    canvas.addEventListener("pointermove", (event) => this.moved(event.pointerId, place(event)));
    canvas.addEventListener("pointerup", (event) => {
      const pointer = pointers.get(event.pointerId);
      pointers.delete(event.pointerId);
      if (pointer?.still) {
        // A finger cannot hover: a tap shows the readout, and the moment for a while. It picks none if a tool takes it.
        const isFinger = event.pointerType !== "mouse";
        this.hover(place(event), !this.tool?.aims());
        clearTimeout(this.released);
        if (isFinger) this.released = setTimeout(() => this.onPick?.(null), TAPPED_MS);
        this.tool?.tap(this.at(place(event)), reach(event));
      }
      if (pointer?.held) this.tool?.release();
    });
    canvas.addEventListener("pointercancel", (event) => {
      if (pointers.get(event.pointerId)?.held) this.tool?.release();
      pointers.delete(event.pointerId);
    });
    for (const name of ["focus", "blur"]) canvas.addEventListener(name, () => this.redraw());
    canvas.addEventListener("pointerleave", (event) => {
      if (event.pointerType !== "mouse") return;
      fill(this.readout);
      this.onPick?.(null);
    });
    canvas.addEventListener("dragover", (event) => this.orders?.takeFile && event.preventDefault());
    canvas.addEventListener("drop", (event) => {
      const file = event.dataTransfer?.files[0];
      if (!this.orders?.takeFile || !file) return;
      event.preventDefault();
      this.orders.takeFile(file);
    });
    canvas.addEventListener("dblclick", () => this.tool?.aims() || this.fit());
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { width, height, north, east, scale } = this.frame, aims = this.tool?.aims();
    const put = () => this.tool?.tap({ north, east }, NEAR_PX / scale);
    /** @type {{ [key: string]: () => void }} */
    const actions = {
      "+": () => this.zoom(ZOOM_STEP), "=": () => this.zoom(ZOOM_STEP), "-": () => this.zoom(1 / ZOOM_STEP), 0: () => this.fit(), f: () => this.follow(!this.following),
      m: () => this.toMeasure(!this.measure.on), ...aims && { Enter: put, " ": put }, ...this.measure.on && { Escape: () => this.toMeasure(false) },
      ArrowUp: () => this.pan(0, height * PAN_SHARE), ArrowDown: () => this.pan(0, -height * PAN_SHARE), ArrowLeft: () => this.pan(width * PAN_SHARE, 0), ArrowRight: () => this.pan(-width * PAN_SHARE, 0),
    };
    const action = actions[event.key];
    if (!action || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    action();
  }

  /** @param {number} pointer @param {{ x: number, y: number }} to */
  moved(pointer, to) {
    const from = this.pointers.get(pointer);
    if (!from) return this.hover(to);
    if (from.still && Math.hypot(to.x - from.x, to.y - from.y) < TAP_PX) return;
    if (from.held && this.pointers.size === 1) {
      from.still = this.fitted = false;
      return this.tool?.move(this.at(to));
    }
    const others = [...this.pointers].filter(([id]) => id !== pointer).map(([, point]) => point);
    this.pointers.set(pointer, { ...from, ...to, still: false });
    if (others.length) {
      const [other] = others, spread = (/** @type {{ x: number, y: number }} */ point) => Math.hypot(point.x - other.x, point.y - other.y);
      this.zoom(spread(to) / Math.max(spread(from), 1), { x: (to.x + other.x) / 2, y: (to.y + other.y) / 2 });
    } else this.pan(to.x - from.x, to.y - from.y);
  }

  /** Says where the pointer is and what is there. @param {{ x: number, y: number }} pixel @param {boolean} [picks] whether the moment of a track there is shown */
  hover(pixel, picks = true) {
    const { picture, frame } = this;
    if (!picture) return;
    const { north, east } = this.at(pixel), near = NEAR_PX / frame.scale;
    const distance = (/** @type {{ north: number, east: number }} */ thing) => Math.hypot(thing.north - north, thing.east - east);
    const mark = picture.marks.filter((each) => each.title).sort((a, b) => distance(a) - distance(b)).find((each) => distance(each) < near);
    const earth = picture.origin && placeOnEarth(picture.origin, north, east);
    const words = [`${number(north, 1, "m")} N, ${number(east, 1, "m")} E`, earth && `${earth.lat_deg.toFixed(6)}°, ${earth.lon_deg.toFixed(6)}°`, mark?.title].filter(Boolean);
    fill(this.readout, words.join(" · "));
    if (picks) this.onPick?.(this.pickTime(north, east, near));
  }

  /** When the nearest track was there; null where none is near. @param {number} north @param {number} east @param {number} near */
  pickTime(north, east, near) {
    let time = null, least = near;
    for (const { track, from, to, colour } of this.picture?.tracks ?? []) {
      if (colour === "goal") continue;
      for (let i = from; i < to; i += 1) {
        const dn = track.north[i] - north;
        if (dn > least || dn < -least) continue;
        const distance = Math.hypot(dn, track.east[i] - east);
        if (distance < least) [time, least] = [track.t[i], distance];
      }
    }
    return time;
  }
}
