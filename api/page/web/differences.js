// Where runs of one mission differ, and why, in sentences that their records show.

import { moment, number } from "./format.js";
import { scores } from "./scores.js";

/** @typedef {import("./picture.js").Run} Run */

/** From this share of the squared distances on, the approach decides what is counted over the whole mission. */
const APPROACH_SHARE = 0.5;
/** Stretches that are compared, s, and by how much their distances differ at least, m. */
const STRETCH_S = 60, DIFFERENCE_MIN_M = 0.2;
/** A place of a track lies at most so far from the moment that it stands for, s. */
const STEP_S = 1.5;

/**
 * What the runs did differently until `until`.
 * @param {Run[]} runs
 * @param {number} until
 * @returns {string[]}
 */
export function differences(runs, until) {
  const known = runs.filter(({ recording }) => recording.goal.length);
  if (known.length < 2) return [];
  const handedOver = handOvers(known, until);
  return [handedOver, brokenLimits(known, until), handedOver ? "" : mostApart(known, until), approach(known, until)].filter(Boolean);
}

/** @param {Run} run @param {number} until */
function handOversOf({ recording }, until) {
  return recording.handOvers.filter(({ t }) => t <= until);
}

/** When each left for the next AUV, and how far off it was. @param {Run[]} runs @param {number} until */
function handOvers(runs, until) {
  const lists = runs.map((run) => handOversOf(run, until)), n = lists[0].length, isSame = lists.every(({ length }) => length === n);
  if (lists.every(({ length }) => !length)) return "";
  const each = runs.map((run, i) => {
    const all = lists[i], times = isSame ? "" : `, ${all.length},`;
    if (!all.length) return `${run.name} had none`;
    const left = middle(all.map((one) => one.left)), off = number(middle(all.map((one) => one.off)), 0, "m");
    return `${run.name}${times} ${left ? `left ${number(left, 0, "s")} before` : "had not left"} and was ${off} off`;
  });
  return `${!isSame ? "At their hand-overs (medians)" : n === 1 ? "At the hand-over" : `At ${n} hand-overs (medians)`}: ${each.join("; ")}.`;
}

/** @param {Run[]} runs @param {number} until */
function brokenLimits(runs, until) {
  /** @type {Map<string, string[]>} */
  const by = new Map();
  for (const { name, recording } of runs) {
    /** @type {Map<string, { time: number, most: number }>} */
    const sums = new Map();
    for (const { from, to, limit, beyond } of recording.limits.brokenUntil(until)) {
      const sum = sums.get(limit) ?? { time: 0, most: 0 };
      sums.set(limit, { time: sum.time + to - from + (recording.scene.period_s ?? 1), most: Math.max(sum.most, beyond) });
    }
    for (const [limit, { time, most }] of sums) by.set(limit, [...by.get(limit) ?? [], `${name} for ${number(time, 0, "s")}, by up to ${number(most, 1, "m")}`]);
  }
  return Array.from(by, ([limit, each]) => `${limit[0].toUpperCase()}${limit.slice(1)}: ${each.join("; ")}${each.length < runs.length ? "; no other" : ""}.`).join(" ");
}

/** The minute in which their distances differ most, once settled. @param {Run[]} runs @param {number} until */
function mostApart(runs, until) {
  const [{ recording: { goal } }] = runs, sums = runs.map(({ recording }) => squaresOf(recording.goal));
  let found = { apart: DIFFERENCE_MIN_M, from: NaN, rms: /** @type {number[]} */ ([]) };
  for (let from = settledFrom(runs[0]); from + STRETCH_S <= Math.min(goal.last, until) + STEP_S; from += STRETCH_S / 2) {
    const rms = runs.map(({ recording }, i) => rmsOf(recording.goal, sums[i], from, from + STRETCH_S)), apart = Math.max(...rms) - Math.min(...rms);
    if (apart > found.apart) found = { apart, from, rms };
  }
  if (!found.rms.length) return "";
  return `They differ most in the minute from ${moment(found.from, false)}: ${runs.map(({ name }, i) => `${name} ${number(found.rms[i], 2, "m")}`).join(", ")}.`;
}

/** How many distances there are before each row, and the sum of their squares. @param {import("./series.js").Series} goal */
function squaresOf(goal) {
  const distances = goal.column("distance"), sums = { n: new Float64Array(goal.length + 1), square: new Float64Array(goal.length + 1) };
  for (let i = 0; i < goal.length; i += 1) {
    const isKnown = Number.isFinite(distances[i]);
    sums.n[i + 1] = sums.n[i] + (isKnown ? 1 : 0);
    sums.square[i + 1] = sums.square[i] + (isKnown ? distances[i] ** 2 : 0);
  }
  return sums;
}

/** @param {import("./series.js").Series} goal @param {ReturnType<typeof squaresOf>} sums @param {number} from @param {number} to */
function rmsOf(goal, { n, square }, from, to) {
  const at = goal.indexAt(from), begin = at >= 0 && goal.column("t")[at] === from ? at : at + 1, end = goal.indexAt(to) + 1;
  return Math.sqrt((square[end] - square[begin]) / (n[end] - n[begin]));
}

/** @param {Run[]} runs @param {number} until */
function approach(runs, until) {
  if (until < settledFrom(runs[0])) return "";
  const shares = runs.map(({ recording }) => scores(recording, -Infinity, until).approach_share);
  if (!shares.every((share) => share >= APPROACH_SHARE)) return "";
  return `The approach until ${moment(settledFrom(runs[0]), false)} makes ${number(100 * Math.min(...shares), 0)} to ${number(100 * Math.max(...shares), 0, "%")} of the squared distances of the whole mission: compare what was kept once settled.`;
}

/** @param {Run} run */
function settledFrom({ recording }) {
  return scores(recording).settled_from_s;
}

/** @param {number[]} values */
function middle(values) {
  const sorted = values.toSorted((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}
