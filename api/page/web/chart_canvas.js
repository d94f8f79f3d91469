// How one chart is drawn on its canvas.

import { colour } from "./dom.js";
import { number } from "./format.js";
import { roundStep } from "./drawing.js";

/**
 * Points of a curve, of which the first `length` are valid. NaN interrupts the curve, and points that are farther apart than `gap`.
 * @typedef {{ name: string, colour: string, dash?: "solid" | "dashed" | "dotted" | "dots", x: ArrayLike<number>, y: ArrayLike<number>, length: number, gap?: number, step?: boolean }} Curve
 * @typedef {{ from: number, to: number, colour: string, name: string }} Band
 * @typedef {{ id: string, title: string, unit: string, curves: Curve[], bands?: Band[], down?: boolean, zero?: boolean, wrap?: "north" | "south" }} Chart
 * What happened at a moment of the common axis.
 * @typedef {{ t: number, words: string }} Event
 * Headings `wrap` around what is in the middle of the chart.
 * @typedef {{ chart: Chart, figure: HTMLElement, canvas: HTMLCanvasElement, legend: HTMLElement, values: HTMLElement[], low: number, high: number }} Drawn
 */

export const LEFT_PX = 54;
export const RIGHT_PX = 12;
const TOP_PX = 8, BOTTOM_PX = 20, BAND_PX = 7;
/** Height of a label, pixels. */
const LABEL_PX = 13;
/** Size of an event's mark, least distance between two, and how near a pointer must be to one, pixels. */
const EVENT_PX = 4, EVENT_APART_PX = 4, EVENT_NEAR_PX = 6;
const DASH_PATTERNS = { solid: [], dashed: [7, 5], dotted: [2, 4], dots: [] };
const LABELS = "11px system-ui, 'DejaVu Sans', sans-serif";
/** Possible steps between time labels, s. */
const TIME_STEPS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400];

/**
 * @typedef {{ from: number, to: number, cursor: number | null, events: Event[], first: boolean, drag: { from: number, to: number } | null, formatX: (x: number, step: number) => string }} Shown
 * @typedef {{ x: (value: number) => number, y: (value: number) => number, width: number, height: number }} Scales
 */

/** @param {Drawn} drawn @param {Shown} shown */
export function drawChart(drawn, shown) {
  const { canvas, chart } = drawn, ratio = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = colour("card");
  context.fillRect(0, 0, width, height);
  const [low, high] = range(chart, shown), bottom = height - BOTTOM_PX;
  /** @type {Scales} */
  const scales = {
    width, height,
    x: (value) => LEFT_PX + ((value - shown.from) / (shown.to - shown.from)) * (width - LEFT_PX - RIGHT_PX),
    y: (value) => (chart.down ? TOP_PX + ((value - low) / (high - low)) * (bottom - TOP_PX) : bottom - ((value - low) / (high - low)) * (bottom - TOP_PX)),
  };
  drawAxes(context, chart, scales, shown, [low, high]);
  context.save();
  context.beginPath();
  context.rect(LEFT_PX, 0, width - LEFT_PX - RIGHT_PX, bottom + 1);
  context.clip();
  for (const band of chart.bands ?? []) drawBand(context, band, scales, bottom);
  for (const each of chart.curves) drawCurve(context, each, chart, scales, shown);
  drawEvents(context, scales, shown, bottom);
  drawCursor(context, drawn, scales, shown, bottom);
  context.restore();
}

/** A heading as 0 to 360°, whatever is in the middle. @param {Chart} chart @param {number} value */
function written({ wrap }, value) {
  return wrap && value < 0 ? value + 360 : value;
}

/** Least and greatest that is shown. @param {Chart} chart @param {Shown} shown @returns {[number, number]} */
function range(chart, { from, to }) {
  if (chart.wrap) return chart.wrap === "north" ? [-180, 180] : [0, 360];
  let [low, high] = chart.zero ? [0, 0] : [Infinity, -Infinity];
  for (const { x, y, length } of chart.curves) {
    for (let i = 0; i < length; i += 1) {
      if (x[i] < from || x[i] > to) continue;
      if (y[i] < low) low = y[i];
      if (y[i] > high) high = y[i];
    }
  }
  if (!(low <= high)) return [0, 1];
  if (high - low < 1e-9) return [low - 0.5, high + 0.5];
  const room = 0.05 * (high - low);
  return [chart.zero && low === 0 ? 0 : low - room, high + room];
}

/** @param {CanvasRenderingContext2D} context @param {Chart} chart @param {Scales} scales @param {Shown} shown @param {[number, number]} limits */
function drawAxes(context, chart, { x, y, width, height }, { from, to, formatX }, [low, high]) {
  const bottom = height - BOTTOM_PX, step = chart.wrap ? 90 : roundStep((high - low) / 2.5), digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  context.font = LABELS;
  context.textBaseline = "middle";
  context.textAlign = "right";
  context.fillStyle = colour("soft");
  context.beginPath();
  for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9; value += step) {
    context.moveTo(LEFT_PX, Math.round(y(value)) + 0.5);
    context.lineTo(width - RIGHT_PX, Math.round(y(value)) + 0.5);
    context.fillText(number(written(chart, value), Math.min(digits, 6)), LEFT_PX - 7, y(value));
  }
  context.textAlign = "center";
  const every = (to - from) / Math.max(2, Math.min(10, (width - LEFT_PX) / 90)), xStep = TIME_STEPS.find((candidate) => candidate >= every) ?? roundStep(every);
  for (let at = Math.ceil(from / xStep) * xStep; at <= to; at += xStep) {
    context.moveTo(Math.round(x(at)) + 0.5, bottom);
    context.lineTo(Math.round(x(at)) + 0.5, bottom + 4);
    if (x(at) > LEFT_PX + 14 && x(at) < width - 24) context.fillText(formatX(at, xStep), x(at), bottom + 12);
  }
  context.strokeStyle = colour("grid");
  context.lineWidth = 1;
  context.stroke();
}

/** Each kind of band once. @param {Chart} chart */
export function bandKinds({ bands = [] }) {
  return [...new Map(bands.map((band) => [band.name, band])).values()];
}

/** @param {CanvasRenderingContext2D} context @param {Band} band @param {Scales} scales @param {number} bottom */
function drawBand(context, band, { x }, bottom) {
  context.fillStyle = colour(band.colour);
  context.fillRect(x(band.from), bottom - BAND_PX, Math.max(x(band.to) - x(band.from), 1.5), BAND_PX);
}

/** A mark for each event, and in the first chart the words of the one at the cursor. @param {CanvasRenderingContext2D} context @param {Scales} scales @param {Shown} shown @param {number} bottom */
function drawEvents(context, { x, width }, { events, from, to, cursor, first }, bottom) {
  context.strokeStyle = context.fillStyle = colour("soft");
  context.lineWidth = 1;
  context.setLineDash(DASH_PATTERNS.dotted);
  let before = -Infinity;
  for (const { t } of events) {
    const at = Math.round(x(t)) + 0.5;
    if (t < from || t > to || at - before < EVENT_APART_PX) continue;
    before = at;
    context.beginPath();
    context.moveTo(at, EVENT_PX);
    context.lineTo(at, bottom);
    context.stroke();
    context.beginPath();
    context.moveTo(at - EVENT_PX, 0);
    context.lineTo(at + EVENT_PX, 0);
    context.lineTo(at, EVENT_PX);
    context.fill();
  }
  context.setLineDash([]);
  const near = first && eventAt(events, cursor, (EVENT_NEAR_PX * (to - from)) / (width - LEFT_PX - RIGHT_PX));
  if (!near) return;
  context.font = LABELS;
  context.textBaseline = "top";
  context.textAlign = "left";
  const long = context.measureText(near.words).width, left = Math.max(LEFT_PX, Math.min(x(near.t) + EVENT_NEAR_PX, width - RIGHT_PX - long));
  context.fillStyle = colour("card");
  context.fillRect(left, EVENT_PX, long, LABEL_PX);
  context.fillStyle = colour("ink");
  context.fillText(near.words, left, EVENT_PX);
}

/** The event nearest to `t`, at most `within` from it. @param {Event[]} events @param {number | null} t @param {number} within */
function eventAt(events, t, within) {
  if (t === null) return undefined;
  const [nearest] = events.toSorted((a, b) => Math.abs(a.t - t) - Math.abs(b.t - t));
  return nearest && Math.abs(nearest.t - t) <= within ? nearest : undefined;
}

/** @param {CanvasRenderingContext2D} context @param {Curve} curve @param {Chart} chart @param {Scales} scales @param {Shown} shown */
function drawCurve(context, curve, chart, scales, shown) {
  const { x, y, length } = curve, first = Math.max(0, firstAtOrAfter(x, length, shown.from) - 1), last = Math.min(length, firstAtOrAfter(x, length, shown.to) + 1);
  context.strokeStyle = context.fillStyle = colour(curve.colour);
  context.lineWidth = curve.dash === "dashed" ? 1.6 : 2;
  context.lineJoin = "round";
  if (curve.dash === "dots") {
    const every = Math.max(1, Math.floor((last - first) / (2 * scales.width)));
    for (let i = first; i < last; i += every) if (y[i] === y[i]) context.fillRect(scales.x(x[i]) - 1, scales.y(y[i]) - 1, 2, 2);
    return;
  }
  context.setLineDash(DASH_PATTERNS[curve.dash ?? "solid"]);
  context.beginPath();
  if (last - first > 3 * scales.width) thinnedPath(context, curve, chart, scales, first, last); else wholePath(context, curve, chart, scales, first, last);
  context.stroke();
  context.setLineDash([]);
}

/** @param {CanvasRenderingContext2D} context @param {Curve} curve @param {Chart} chart @param {Scales} scales @param {number} first @param {number} last */
function wholePath(context, { x, y, step, gap = Infinity }, { wrap }, scales, first, last) {
  let open = false, before = NaN;
  for (let i = first; i < last; i += 1) {
    if (!(y[i] === y[i])) {
      open = false;
      continue;
    }
    const jumps = wrap && Math.abs(y[i] - before) > 180 || x[i] - x[i - 1] > gap, px = scales.x(x[i]), py = scales.y(y[i]);
    if (open && !jumps) {
      if (step) context.lineTo(px, scales.y(before));
      context.lineTo(px, py);
    } else context.moveTo(px, py);
    [open, before] = [true, y[i]];
  }
}

/** Least and greatest of each column of pixels: what a whole path would cover. @param {CanvasRenderingContext2D} context @param {Curve} curve @param {Chart} chart @param {Scales} scales @param {number} first @param {number} last */
function thinnedPath(context, { x, y, gap = Infinity }, { wrap }, scales, first, last) {
  let column = NaN, low = 0, high = 0, open = false, end = NaN;
  const flush = () => {
    if (!(column === column)) return;
    const jumps = wrap && Math.abs(low - end) > 180;
    if (open && !jumps) context.lineTo(column, scales.y(low)); else context.moveTo(column, scales.y(low));
    // Between two sides of the cut the pen is lifted.
    if (wrap && high - low > 180) context.moveTo(column, scales.y(high)); else if (high !== low) context.lineTo(column, scales.y(high));
    [open, end] = [true, high];
  };
  for (let i = first; i < last; i += 1) {
    const value = y[i], at = Math.round(scales.x(x[i]));
    if (!(value === value) || x[i] - x[i - 1] > gap) {
      flush();
      [column, open] = [NaN, false];
    }
    if (!(value === value)) continue;
    if (at !== column) {
      flush();
      [column, low, high] = [at, value, value];
    } else if (value < low) low = value;
    else if (value > high) high = value;
  }
  flush();
}

/** @param {CanvasRenderingContext2D} context @param {Drawn} drawn @param {Scales} scales @param {Shown} shown @param {number} bottom */
function drawCursor(context, { chart, canvas, values }, { x, y, width }, { cursor, drag, formatX, events, from, to }, bottom) {
  if (drag) {
    context.globalAlpha = 0.15;
    context.fillStyle = colour("ink");
    context.fillRect(x(Math.min(drag.from, drag.to)), 0, Math.abs(x(drag.to) - x(drag.from)), bottom);
    context.globalAlpha = 1;
  }
  const words = chart.curves.map((curve, i) => {
    const at = cursor === null ? curve.length - 1 : firstAtOrAfter(curve.x, curve.length, cursor + 1e-6) - 1;
    const value = at < 0 ? NaN : curve.y[at], text = number(written(chart, value), chart.wrap ? 0 : Math.abs(value) < 1 ? 3 : Math.abs(value) < 100 ? 2 : 0);
    if (values[i].textContent !== text) values[i].textContent = text;
    if (cursor !== null && Number.isFinite(value)) {
      context.beginPath();
      context.arc(x(cursor), y(value), 3.5, 0, 2 * Math.PI);
      context.fillStyle = colour(curve.colour);
      context.fill();
    }
    return `${curve.name} ${text}`;
  });
  const answered = cursor === null ? undefined : chart.bands?.find((band) => band.from <= cursor && cursor <= band.to);
  if (cursor !== null) {
    context.beginPath();
    context.moveTo(x(cursor), 0);
    context.lineTo(x(cursor), bottom);
    context.strokeStyle = colour("ink");
    context.lineWidth = 1;
    context.stroke();
  }
  const event = eventAt(events, cursor, (EVENT_NEAR_PX * (to - from)) / (width - LEFT_PX - RIGHT_PX));
  const label = `${chart.title}, ${chart.unit}${cursor === null ? "" : ` at ${formatX(cursor, 1)}`}: ${words.join("; ")}${answered ? `; answered by ${answered.name}` : ""}${event ? `; ${event.words}` : ""}`;
  if (canvas.getAttribute("aria-label") !== label) canvas.setAttribute("aria-label", label);
}

/** @param {ArrayLike<number>} x @param {number} length @param {number} value */
function firstAtOrAfter(x, length, value) {
  let low = 0, high = length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (x[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}
