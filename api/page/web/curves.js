// The time series of recordings.

import { auvColour } from "./dom.js";
import { degrees, methodName } from "./format.js";

/**
 * @typedef {import("./picture.js").Run} Run
 * @typedef {import("./series.js").Series} Series
 * @typedef {import("./chart_canvas.js").Chart} Chart
 * @typedef {import("./chart_canvas.js").Curve} Curve
 */

/** Plans farther apart than this leave a gap in the strip of methods, s. */
const GAP_S = 30;
/** A gap in a curve is so many times its usual interval, which is that of so many samples, and at least so long, s. */
const GAP_TIMES = 5, SAMPLES = 31, GAP_MIN_S = 5;
/** An AUV that is always heard within so many seconds gets no chart of ages. */
const AGE_SHOWN_S = 1.5;
/** Colours of the methods. A previous plan has the planner's colour. */
const ANSWERS = { mpc: "plan", previous_plan: "plan", saturated_los: "los", hold: "bad" };

/** Columns in degrees, made once for each length of their series. @type {WeakMap<Series, Map<string, { length: number, values: Float64Array, low: number }>>} */
const inDegrees = new WeakMap();

/** Of the sides of the compass the one that is steered more often: the chart is cut at the other. @param {Run[]} runs @returns {"north" | "south"} */
function mostly(runs) {
  let sum = 0;
  for (const { recording: { craft } } of runs) {
    const column = craft.column("heading"), step = Math.max(1, Math.floor(craft.length / 1_000));
    for (let i = 0; i < craft.length; i += step) sum += Math.cos(column[i]) || 0;
  }
  return sum > 0 ? "north" : "south";
}

/**
 * Headings of a series in degrees, `low` to `low` + 360.
 * @param {Series} series
 * @param {string} name
 * @param {number} low
 */
function headings(series, name, low) {
  let columns = inDegrees.get(series);
  if (!columns) inDegrees.set(series, columns = new Map());
  let known = columns.get(name);
  const column = series.column(name);
  if (!known || known.values.length < column.length || known.low !== low) {
    known = { length: 0, values: new Float64Array(column.length), low };
    columns.set(name, known);
  }
  // Late rows may be inserted before the last ones.
  for (let i = Math.max(0, Math.min(known.length, series.length) - 64); i < series.length; i += 1) {
    known.values[i] = ((((degrees(column[i]) - low) % 360) + 360) % 360) + low;
  }
  known.length = series.length;
  return known.values;
}

/** The interval that interrupts a curve: some times the usual one. @param {ArrayLike<number>} times @param {number} length */
function gapOf(times, length) {
  const some = Array.from({ length: SAMPLES }, (_, i) => 1 + Math.floor((i * (length - 1)) / SAMPLES)).map((i) => times[i] - times[i - 1]);
  return Math.max(GAP_MIN_S, GAP_TIMES * some.sort((a, b) => a - b)[SAMPLES >> 1]);
}

/**
 * @param {Series} series @param {ArrayLike<number> | string} y @param {string} name @param {string} colour
 * @param {Partial<Curve>} [how]
 * @returns {Curve}
 */
function curve(series, y, name, colour, how = {}) {
  return { x: series.column("t"), y: typeof y === "string" ? series.column(y) : y, length: series.length, gap: gapOf(series.column("t"), series.length), name, colour, ...how };
}

/**
 * The charts of `runs` that have data.
 * @param {Run[]} runs
 * @param {(auv: string) => string} [colourOf] an AUV, unless each has a colour of its own
 * @returns {Chart[]}
 */
export function chartsOf(runs, colourOf) {
  const one = runs.length === 1, first = runs[0].recording, middle = mostly(runs), low = middle === "north" ? -180 : 0;
  const each = (/** @type {(run: Run, colour: string, name: string) => Curve[]} */ of) => runs.flatMap((run) => of(run, one ? "plan" : run.colour, one ? "" : run.name));
  const label = (/** @type {string} */ name, /** @type {string} */ what) => [name, what].filter(Boolean).join(", ");
  /** @type {Chart[]} */
  const charts = [
    {
      id: "distance", title: first.live ? "Distance to the goal, estimated" : "Distance to the goal", unit: "m", zero: true,
      curves: each(({ recording }, colour, name) => [curve(recording.goal, "distance", name || "distance", colour)]), bands: one ? answersOf(first) : [],
    },
    {
      id: "errors", title: "Along and across the goal's course", unit: "m",
      curves: each(({ recording }, colour, name) => [
        curve(recording.goal, "along", label(name, "along, ahead +"), colour), curve(recording.goal, "cross", label(name, "across, starboard +"), one ? "los" : colour, { dash: "dashed" }),
      ]),
    },
    {
      id: "speed", title: "Speed through the water", unit: "m/s",
      curves: each(({ recording }, colour, name) => [
        curve(recording.plans, "speed", label(name, "reference"), one ? "soft" : colour, { dash: "dashed", step: true }), curve(recording.craft, "speed", label(name, "actual"), colour),
      ]),
    },
    {
      id: "heading", title: "Heading", unit: "°", wrap: middle,
      curves: each(({ recording }, colour, name) => [
        curve(recording.plans, headings(recording.plans, "heading", low), label(name, "reference"), one ? "soft" : colour, { dash: "dashed", step: true }),
        curve(recording.craft, headings(recording.craft, "heading", low), label(name, "actual"), colour),
      ]),
    },
    { id: "depth", title: "Depth", unit: "m", down: true, zero: true, curves: auvCurves(first.places, "depth", colourOf) },
    { id: "age", title: "Time since each AUV was heard", unit: "s", zero: true, curves: auvCurves(first.ages, "age", colourOf).filter(isLate) },
    {
      id: "energy", title: "Propulsion energy", unit: "J", zero: true,
      curves: each(({ recording }, colour, name) => [curve(recording.goal, "energy", name || "energy", colour)]),
    },
    {
      id: "solve", title: "Solve time", unit: "ms", zero: true,
      curves: each(({ recording }, colour, name) => [curve(recording.plans, "solve_ms", name || "solve time", colour, { dash: "dots" })]),
    },
  ];
  return charts.map((chart) => ({ ...chart, curves: chart.curves.filter(shows) })).filter((chart) => chart.curves.length);
}

/** @param {Map<string, Series>} map @param {string} column @param {(auv: string) => string} [colourOf] */
function auvCurves(map, column, colourOf) {
  return Array.from(map, ([id, series], i) => curve(series, column, id, colourOf?.(id) ?? auvColour(i), { dash: i % 2 ? "dashed" : "solid" }));
}

/** Whether an AUV was ever silent for longer than from one plan to the next. @param {Curve} of */
function isLate({ y, length }) {
  for (let i = 0; i < length; i += 1) if (y[i] > AGE_SHOWN_S) return true;
  return false;
}

/** @param {Curve} of */
function shows({ y, length }) {
  for (let i = 0; i < length; i += Math.max(1, Math.floor(length / 200))) if (Number.isFinite(y[i])) return true;
  return length > 0 && Number.isFinite(y[length - 1]);
}

/** @type {WeakMap<Series, { length: number, bands: import("./chart_canvas.js").Band[] }>} */
const bandsOf = new WeakMap();

/**
 * The method of the plans over time.
 * @param {import("./recording.js").Recording} recording
 */
function answersOf({ plans, methods }) {
  const known = bandsOf.get(plans) ?? { length: 0, bands: [] };
  const times = plans.column("t"), column = plans.column("method"), { bands } = known;
  for (let i = known.length; i < plans.length; i += 1) {
    const last = bands.at(-1), method = methods[column[i]], name = methodName(method === "previous_plan" ? "mpc" : method);
    const sooner = last && times[i] - last.to < GAP_S;
    if (last && sooner) last.to = times[i];
    if (!last || !sooner || last.name !== name) bands.push({ from: times[i], to: times[i], colour: ANSWERS[/** @type {keyof typeof ANSWERS} */ (method)] ?? "los", name });
  }
  bandsOf.set(plans, { length: plans.length, bands });
  return bands;
}
