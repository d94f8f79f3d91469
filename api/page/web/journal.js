// What happened in a mission, in words.

import { ageWords } from "./alarm.js";

/** @typedef {import("./types.js").LogEntry} LogEntry */

/** Most entries kept. */
const ENTRIES_MAX = 2_000;

/** The log of a mission. */
export class Journal {
  /** @param {import("./types.js").Fault[]} [faults] of a simulated mission, which enter the log when their time has come */
  constructor(faults = []) {
    /** @type {LogEntry[]} */
    this.entries = [];
    /** Counts the changes. */
    this.version = 0;
    /** The alarm that has not ended, and since when. */
    this.alarm = { words: "", t: NaN, entry: /** @type {LogEntry | undefined} */ (undefined) };
    /** When a live mission ran again after a pause. */
    this.ranAt = -Infinity;
    this.coming = faults.flatMap(({ from_s, until_s, what }) => [
      { t_s: from_s, kind: "fault", text: what }, ...until_s === undefined || until_s === null ? [] : [{ t_s: until_s, kind: "fault over", text: what }],
    ]).sort((a, b) => a.t_s - b.t_s);
  }

  /** Enters the faults that have begun or ended until `t`. @param {number} t */
  until(t) {
    while (this.coming.length && this.coming[0].t_s <= t) {
      const [{ t_s, kind, text }] = this.coming.splice(0, 1);
      this.happened(t_s, kind, text);
    }
  }

  /** An alarm begins at `t`; without `words` it ends. @param {number} t @param {string} words @param {string} [why] */
  alarmed(t, words, why = "") {
    const { alarm } = this, text = [words, why].filter(Boolean).join(": ");
    if (words === alarm.words) {
      // Why is known a little later.
      if (alarm.entry && alarm.entry.text !== text) {
        alarm.entry.text = text;
        this.version += 1;
      }
      return;
    }
    if (alarm.words) this.happened(t, "alarm over", `${alarm.words}, after ${ageWords(Math.max(t - alarm.t, 0))}`);
    this.alarm = { words, t, entry: words ? this.happened(t, "alarm", text) : undefined };
  }

  /** @param {number} t_s @param {string} kind @param {string} text */
  happened(t_s, kind, text) {
    this.version += 1;
    if (kind === "ran") this.ranAt = t_s;
    const entry = { t_s, kind, text };
    this.entries.push(entry);
    if (this.entries.length > ENTRIES_MAX) this.entries.splice(0, this.entries.length - ENTRIES_MAX);
    return entry;
  }
}

/** @param {any} event */
export function eventWords(event) {
  if (event.kind === "created") return event.mission?.title ?? "";
  if (event.kind === "failed") return event.reason;
  if (event.kind === "clock_set") return `by ${event.by_s.toFixed(1)} s`;
  if (event.kind === "ran" && event.speed_factor) return `${event.speed_factor} times as fast as life`;
  if (event.kind === "changed") return Object.keys(event.setting).join(", ").replaceAll("_", " ");
  return "";
}

/** Kinds of entries that charts mark. */
const MARKED = new Set(["goal jumps", "fault", "fault over", "alarm", "alarm over", "degraded", "recovered", "changed", "paused", "ran", "note", "gap", "clock_set", "assigned"]);

/** What charts mark, in order of time. @param {LogEntry[]} entries */
export function chartEvents(entries) {
  const chosen = entries.filter(({ kind }) => MARKED.has(kind)).sort((a, b) => a.t_s - b.t_s);
  return chosen.map(({ t_s, kind, text }) => ({ t: t_s, words: [kind.replaceAll("_", " "), text].filter(Boolean).join(": ") }));
}
