// What a recording amounts to: scores, and where they were worst.

/** Default start of the settled scores of a simulated mission, s. */
const SETTLED_AFTER_S = 120;

/**
 * Scores of the true distance to the goal from `from` to `to`.
 * @param {import("./recording.js").Recording} recording
 * @param {number} [from]
 * @param {number} [to]
 */
export function scores(recording, from = -Infinity, to = Infinity) {
  const { goal, craft } = recording;
  const times = goal.column("t"), distances = goal.column("distance");
  const settledFrom = (Number.isFinite(goal.first) ? goal.first : 0) + (recording.scene.settled_after_s ?? SETTLED_AFTER_S);
  const sums = { n: 0, square: 0, settledN: 0, settledSquare: 0, worst: NaN, worstAt: NaN };
  for (let i = 0; i < goal.length; i += 1) {
    const [t, d] = [times[i], distances[i]];
    if (t < from || t > to || !Number.isFinite(d)) continue;
    sums.n += 1;
    sums.square += d * d;
    if (t >= settledFrom) {
      sums.settledN += 1;
      sums.settledSquare += d * d;
    }
    if (!(d <= sums.worst)) [sums.worst, sums.worstAt] = [d, t];
  }
  const energyAt = (/** @type {number} */ t) => goal.at("energy", Math.min(t, goal.last));
  const begin = Math.max(from, goal.first);
  return {
    rms_m: Math.sqrt(sums.square / sums.n), settled_rms_m: Math.sqrt(sums.settledSquare / sums.settledN), settled_from_s: settledFrom,
    approach_share: 1 - sums.settledSquare / sums.square,
    worst_m: sums.worst, worst_at_s: sums.worstAt,
    vessel_least_m: leastDistance(recording, from, to), energy_j: energyAt(to) - (begin > goal.first ? energyAt(begin) : 0), heading_travel_rad: headingTravel(craft, from, to),
  };
}

/** Least distance of the craft from the side of another vessel; NaN without any. @param {import("./recording.js").Recording} recording @param {number} from @param {number} to */
function leastDistance({ craft, vessels }, from, to) {
  let least = NaN;
  for (const { columns: { t, north, east, length }, length: n } of vessels.values()) {
    for (let i = 0; i < n; i += 1) {
      const side = Math.hypot(north[i] - craft.at("north", t[i]), east[i] - craft.at("east", t[i])) - length[i] / 2;
      if (from <= t[i] && t[i] <= to && !(least <= side)) least = side;
    }
  }
  return least;
}

/** @param {import("./series.js").Series} craft @param {number} from @param {number} to */
function headingTravel(craft, from, to) {
  const times = craft.column("t"), headings = craft.column("heading");
  let sum = 0;
  for (let i = 1; i < craft.length; i += 1) {
    if (times[i] < from || times[i] > to) continue;
    const turn = headings[i] - headings[i - 1];
    if (Number.isFinite(turn)) sum += Math.abs(Math.atan2(Math.sin(turn), Math.cos(turn)));
  }
  return craft.length ? sum : NaN;
}

/**
 * The stretch of `length` seconds with the largest root mean square distance to the goal. The approach at the start of a simulated
 * mission is left out if the mission is longer.
 * @param {import("./recording.js").Recording} recording
 * @param {number} [length]
 * @returns {{ from: number, to: number, rms_m: number } | null}
 */
export function worstStretch(recording, length = 60) {
  const { goal, live } = recording;
  const times = goal.column("t"), distances = goal.column("distance");
  const approach = recording.scene.settled_after_s ?? SETTLED_AFTER_S;
  const begin = !live && goal.last - goal.first > 2 * approach ? goal.first + approach : goal.first;
  let start = 0, square = 0, n = 0;
  let worst = null, worstMean = -1;
  for (let end = 0; end < goal.length; end += 1) {
    if (times[end] < begin || !Number.isFinite(distances[end])) {
      start = end + 1;
      [square, n] = [0, 0];
      continue;
    }
    square += distances[end] ** 2;
    n += 1;
    while (times[end] - times[start] > length) {
      square -= distances[start] ** 2;
      n -= 1;
      start += 1;
    }
    if (times[end] - times[start] >= 0.9 * length && square / n > worstMean) {
      worstMean = square / n;
      worst = { from: times[start], to: times[end], rms_m: Math.sqrt(Math.max(worstMean, 0)) };
    }
  }
  return worst;
}
