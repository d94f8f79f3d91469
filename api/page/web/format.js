// Numbers for people, in the units of the documentation.

const MINUS = "\u2212";
const NOTHING = "–";

/**
 * @param {number | null | undefined} value
 * @param {number} [digits] after the point
 * @param {string} [unit]
 */
export function number(value, digits = 1, unit = "") {
  if (value === null || value === undefined || !Number.isFinite(value)) return NOTHING;
  const text = value.toFixed(digits);
  const signed = Number(text) === 0 ? text.replace("-", "") : text.replace("-", MINUS);
  if (!unit) return signed;
  return unit === "°" ? `${signed}°` : `${signed}\u00a0${unit}`;
}

/** @param {number} radians */
export function degrees(radians) {
  return (radians * 180) / Math.PI;
}

/**
 * A heading or course for people, 0 to 360°.
 * @param {number | null | undefined} radians
 */
export function bearing(radians) {
  if (radians === null || radians === undefined || !Number.isFinite(radians)) return NOTHING;
  const wrapped = ((degrees(radians) % 360) + 360) % 360;
  return `${wrapped.toFixed(0).padStart(3, "0") === "360" ? "000" : wrapped.toFixed(0).padStart(3, "0")}°`;
}

/**
 * A length of time: `48 s`, `12 min 05 s`, `3 h 07 min`.
 * @param {number | null | undefined} seconds
 */
export function duration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NOTHING;
  const sign = seconds < 0 ? MINUS : "", total = Math.abs(seconds);
  const pad = (/** @type {number} */ value) => String(Math.floor(value)).padStart(2, "0");
  if (total < 60) return `${sign}${total < 10 ? total.toFixed(1) : total.toFixed(0)}\u00a0s`;
  if (total < 3600) return `${sign}${Math.floor(total / 60)}\u00a0min ${pad(total % 60)}\u00a0s`;
  return `${sign}${Math.floor(total / 3600)}\u00a0h ${pad((total % 3600) / 60)}\u00a0min`;
}

/**
 * A moment on a mission's clock: `1:02:03` since the start of a simulated one, the time of day (UTC) of a live one.
 * @param {number} seconds
 * @param {boolean} live
 */
export function moment(seconds, live) {
  if (!Number.isFinite(seconds)) return NOTHING;
  if (live) return `${new Date(seconds * 1000).toISOString().slice(11, 19)} UTC`;
  const total = Math.max(0, Math.round(seconds));
  const pad = (/** @type {number} */ value) => String(value).padStart(2, "0");
  const hours = Math.floor(total / 3600), rest = `${pad(Math.floor(total / 60) % 60)}:${pad(total % 60)}`;
  return hours > 0 ? `${hours}:${rest}` : rest;
}

/**
 * A day and time, UTC.
 * @param {number} unix seconds
 */
export function day(unix) {
  return `${new Date(unix * 1000).toISOString().slice(0, 16).replace("T", " ")} UTC`;
}

/** What answers, for people. */
const METHODS = {
  mpc: "planner",
  previous_plan: "previous plan",
  saturated_los: "line of sight",
  saturated_los_tracker_frame: "line of sight, tracker frame",
  integral_los: "integral line of sight",
  waypoint_box: "waypoints around a box",
  hold: "hold",
};

/** @param {string} method */
export function methodName(method) {
  return Object.hasOwn(METHODS, method) ? METHODS[/** @type {keyof typeof METHODS} */ (method)] : method.replaceAll("_", " ");
}
