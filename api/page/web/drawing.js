// Pictures on a canvas: north up, one scale for both axes.

import { convergence } from "./background.js";
import { colour } from "./dom.js";
import { bearing, number } from "./format.js";
import { drawNames, FONT_BOLD, FONT_SMALL } from "./lettering.js";
import { drawArrow, drawCrosses, drawEllipse, drawMark, drawVehicle } from "./symbols.js";

/**
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {import("./types.js").Frame} Frame
 * @typedef {import("./types.js").Stroke} Stroke
 * @typedef {CanvasRenderingContext2D} Context2d
 */

/** Least distance between the drawn points of a track, pixels. */
const THIN_PX = 0.7;
/** Steps of the depth colours. The last step is the greatest depth of the track. */
const DEPTH_STEPS = 6;
/** How far the colour of a track goes towards `--depth-0` at the surface and `--depth-1` at its greatest depth. */
const LIGHTER = 0.4, DARKER = 0.6;
/** Space for the buttons and the readout. */
const LABELS_FROM_PX = 74;
const WIDTHS = { solid: 2.5, dashed: 2, dotted: 2, wide: 7, thin: 1.2 };
const DASHES = { solid: [], dashed: [8, 6], dotted: [1.5, 5], wide: [], thin: [] };

/**
 * South, north, west and east bounds of a picture; none of an empty one.
 * @param {Picture} picture
 * @param {boolean} [all] with declared paths, which may be far longer than what was sailed
 */
export function pictureBounds(picture, all = true) {
  const bounds = { south: Infinity, northern: -Infinity, west: Infinity, eastern: -Infinity };
  const take = (/** @type {number} */ north, /** @type {number} */ east, around = 0) => {
    if (!Number.isFinite(north) || !Number.isFinite(east)) return;
    bounds.south = Math.min(bounds.south, north - around);
    bounds.northern = Math.max(bounds.northern, north + around);
    bounds.west = Math.min(bounds.west, east - around);
    bounds.eastern = Math.max(bounds.eastern, east + around);
  };
  // Thinning a long track moves its bounds by a pixel or so.
  for (const { track, from, to, aside } of picture.tracks) {
    if (aside) continue;
    const step = Math.max(1, Math.floor((to - from) / 2_000));
    for (let i = from; i < to; i += step) take(track.north[i], track.east[i]);
    if (to > from) take(track.north[to - 1], track.east[to - 1]);
  }
  for (const line of picture.lines) if (line.colour !== "chart" && !line.aside && (all || line.style !== "wide")) for (const [north, east] of line.points) take(north, east);
  for (const disc of picture.discs) if (disc.style === "keep-out") take(disc.north, disc.east, disc.radius);
  for (const vehicle of picture.vehicles) if (!vehicle.aside) take(vehicle.north, vehicle.east);
  for (const other of picture.beside ?? []) {
    const its = pictureBounds(other, all);
    if (its) take(its.south, its.west);
    if (its) take(its.northern, its.eastern);
  }
  return bounds.south <= bounds.northern ? bounds : null;
}

/**
 * @param {Context2d} context
 * @param {Picture} picture
 * @param {Frame} frame
 */
export function drawPicture(context, picture, frame) {
  const pen = new Pen(context, frame);
  context.fillStyle = pen.ink("water");
  context.fillRect(0, 0, frame.width, frame.height);
  drawGrid(pen);
  for (const disc of picture.discs) drawDisc(pen, disc);
  for (const line of picture.lines) drawLine(pen, line);
  for (const layer of picture.tracks) drawTrack(pen, layer);
  for (const ellipse of picture.ellipses) drawEllipse(pen, ellipse);
  drawCrosses(pen, picture.marks);
  const above = (/** @type {import("./types.js").Mark} */ { kind }) => ["stop", "handle", "label", "ring"].includes(kind);
  for (const mark of picture.marks) if (!above(mark)) drawMark(pen, mark);
  // Headings of the craft are true; courses of AUVs come from their places on the map.
  const onMap = (/** @type {{ north: number, east: number, heading: number }} */ { north, east, heading }) => heading - convergence(picture.origin, north, east);
  const arrows = picture.arrows.map((arrow) => ({ ...arrow, heading: onMap(arrow) }));
  for (const arrow of arrows) drawArrow(pen, arrow);
  for (const vehicle of picture.vehicles) drawVehicle(pen, vehicle.kind === "craft" ? { ...vehicle, heading: onMap(vehicle) } : vehicle);
  for (const mark of picture.marks) if (above(mark)) drawMark(pen, mark);
  drawFurniture(pen, picture);
  drawNames(pen, { ...picture, arrows });
}

/** A canvas with the map's scale and the theme's colours. */
export class Pen {
  /** @param {Context2d} context @param {Frame} frame */
  constructor(context, frame) {
    this.context = context;
    this.frame = frame;
    /** @type {Map<string, string>} */
    this.inks = new Map();
  }

  /** @param {string} name */
  ink(name) {
    let ink = this.inks.get(name);
    if (ink === undefined) this.inks.set(name, ink = colour(name) || name);
    return ink;
  }

  /** @param {number} east */
  x(east) {
    return this.frame.width / 2 + (east - this.frame.east) * this.frame.scale;
  }

  /** @param {number} north */
  y(north) {
    return this.frame.height / 2 - (north - this.frame.north) * this.frame.scale;
  }

  /** Strokes `path`, or what was begun last. @param {string} name @param {Stroke} style @param {number} [width] @param {Path2D} [path] */
  stroke(name, style, width = WIDTHS[style], path) {
    const { context } = this;
    context.strokeStyle = this.ink(name);
    context.lineWidth = width;
    context.setLineDash(DASHES[style]);
    context.lineCap = style === "dotted" ? "round" : "butt";
    context.lineJoin = "round";
    if (path) context.stroke(path); else context.stroke();
    context.setLineDash([]);
  }

  /** Text with an edge of the water's colour, so that it can be read over anything. @param {string} text @param {number} x @param {number} y @param {string} [ink] */
  text(text, x, y, ink = "ink") {
    const { context } = this;
    context.lineJoin = "round";
    context.lineWidth = 4;
    context.strokeStyle = this.ink("water");
    context.strokeText(text, x, y);
    context.fillStyle = this.ink(ink);
    context.fillText(text, x, y);
  }
}

/** The largest of 1, 2, 5 times a power of ten that is at most `value`. @param {number} value */
export function roundStep(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return ([5, 2, 1].find((factor) => factor * power <= value) ?? 1) * power;
}

/** @param {Pen} pen */
function drawGrid(pen) {
  const { context, frame: { width, height, scale, north, east } } = pen;
  const step = roundStep(Math.max(120 / scale, 0.1)), digits = step < 1 ? 1 : 0;
  context.font = FONT_SMALL;
  context.textBaseline = "alphabetic";
  const [left, bottom] = [east - width / 2 / scale, north - height / 2 / scale];
  context.beginPath();
  for (let at = Math.ceil(left / step) * step; pen.x(at) < width; at += step) {
    context.moveTo(pen.x(at), 0);
    context.lineTo(pen.x(at), height);
  }
  for (let at = Math.ceil(bottom / step) * step; pen.y(at) > 0; at += step) {
    context.moveTo(0, pen.y(at));
    context.lineTo(width, pen.y(at));
  }
  pen.stroke("grid", "solid", 1);
  context.textAlign = "left";
  for (let at = Math.ceil(left / step) * step; pen.x(at) < width; at += step) {
    if (70 < pen.x(at) && pen.x(at) < width - 190) pen.text(`${number(at, digits)} m E`, pen.x(at) + 4, height - 7, "soft");
  }
  for (let at = Math.ceil(bottom / step) * step; pen.y(at) > 0; at += step) {
    if (LABELS_FROM_PX < pen.y(at) && pen.y(at) < height - 24) pen.text(`${number(at, digits)} m N`, 5, pen.y(at) - 4, "soft");
  }
}

/** @param {Pen} pen @param {import("./types.js").Disc} disc */
function drawDisc(pen, { north, east, radius, colour: name, style }) {
  const { context, frame } = pen;
  context.beginPath();
  context.arc(pen.x(east), pen.y(north), radius * frame.scale, 0, 2 * Math.PI);
  if (style !== "keep-out") return pen.stroke(name, "dashed", 1);
  fillFaintly(pen, name);
  pen.stroke(name, "solid", 2);
}

/** @param {Pen} pen @param {string} name of the colour */
function fillFaintly(pen, name) {
  const { context } = pen;
  context.save();
  context.globalAlpha = 0.14;
  context.fillStyle = pen.ink(name);
  context.fill("evenodd");
  context.restore();
}

/** @param {Pen} pen @param {import("./types.js").Line} line */
function drawLine(pen, { points, colour: name, style, closed }) {
  const { context } = pen;
  if (points.length < 2) return;
  context.beginPath();
  points.forEach(([north, east], i) => (i ? context.lineTo(pen.x(east), pen.y(north)) : context.moveTo(pen.x(east), pen.y(north))));
  if (closed) context.closePath();
  if (style === "land") fillFaintly(pen, name);
  else if (style === "area") pen.stroke(name, "dashed", 2);
  else pen.stroke(name, style, name === "plan" ? 3.5 : undefined);
}

/** @param {Pen} pen @param {import("./types.js").TrackLayer} layer */
function drawTrack(pen, { track, from, to, colour: name, style, byDepth }) {
  const { depth } = track, { context } = pen;
  let deepest = 0;
  if (byDepth && depth) for (let i = from; i < to; i += 1) if (depth[i] > deepest) deepest = depth[i];
  const shaded = depth !== undefined && deepest >= 0.5;
  const levelOf = (/** @type {number} */ i) => (shaded ? Math.min(DEPTH_STEPS - 1, Math.max(0, Math.floor(((depth[i] || 0) / deepest) * DEPTH_STEPS))) : 0);
  // One path for each level, not for each stretch: four hours of dives have thousands of stretches.
  const paths = trackPaths(pen, track, from, to, levelOf);
  for (const path of paths.values()) pen.stroke(name, style, WIDTHS[style], path);
  for (const [level, path] of shaded ? paths : []) {
    const deeper = (2 * level) / (DEPTH_STEPS - 1) - 1;
    context.save();
    context.globalAlpha = Math.abs(deeper) * (deeper < 0 ? LIGHTER : DARKER);
    pen.stroke(deeper < 0 ? "depth-0" : "depth-1", style, WIDTHS[style], path);
    context.restore();
  }
}

/**
 * The stretches of a track at each depth level, as one path for each level.
 * @param {Pen} pen @param {import("./types.js").Track} track @param {number} from @param {number} to
 * @param {(i: number) => number} levelOf
 */
function trackPaths(pen, { north, east }, from, to, levelOf) {
  /** @type {Map<number, Path2D>} */
  const paths = new Map();
  let [x0, y0] = [NaN, NaN], level = -1, path = /** @type {Path2D | undefined} */ (undefined);
  for (let i = from; i < to; i += 1) {
    const x = pen.x(east[i]), y = pen.y(north[i]);
    if (!(x === x && y === y)) continue;
    const near = Math.abs(x - x0) < THIN_PX && Math.abs(y - y0) < THIN_PX;
    if (near && i < to - 1) continue;
    path?.lineTo(x, y);
    const here = levelOf(i);
    if (here !== level) {
      level = here;
      path = paths.get(level) ?? new Path2D();
      paths.set(level, path);
      path.moveTo(x, y);
    }
    [x0, y0] = [x, y];
  }
  return paths;
}

/** Scale, north, current. @param {Pen} pen @param {Picture} picture */
function drawFurniture(pen, { current }) {
  const { context, frame: { width, height, scale } } = pen;
  const metres = roundStep(Math.min(150, width / 4) / scale), end = width - 16, start = end - metres * scale;
  context.beginPath();
  context.moveTo(start, height - 18);
  context.lineTo(start, height - 12);
  context.lineTo(end, height - 12);
  context.lineTo(end, height - 18);
  pen.stroke("ink", "solid", 2);
  context.font = FONT_BOLD;
  context.textAlign = "center";
  pen.text(metres < 1 ? `${number(metres * 100, 0)} cm` : metres >= 1000 ? `${number(metres / 1000, 0)} km` : `${number(metres, 0)} m`, (start + end) / 2, height - 20);
  context.beginPath();
  for (const [dx, dy] of [[0, 14], [9, 40], [0, 33], [-9, 40]]) context.lineTo(width - 26 + dx, dy);
  context.closePath();
  context.fillStyle = pen.ink("ink");
  context.fill();
  pen.text("N", width - 26, 55);
  const speed = current ? Math.hypot(current.north_mps, current.east_mps) : 0;
  if (!current || speed < 0.005) return;
  const towards = Math.atan2(current.east_mps, current.north_mps);
  context.save();
  context.translate(width - 74, 28);
  context.rotate(towards);
  context.beginPath();
  for (const [x, y] of [[0, 14], [0, -14]]) context.lineTo(x, y);
  context.moveTo(-6, -6);
  context.lineTo(0, -14);
  context.lineTo(6, -6);
  pen.stroke("soft", "solid", 2.5);
  context.restore();
  context.font = FONT_SMALL;
  context.textAlign = "right";
  pen.text(`current ${number(speed, 2, "m/s")} to ${bearing(towards)}${current.estimated ? ", estimated" : ""}`, width - 44, 58, "soft");
}
