// What the craft of a fleet do over time, a row for each: whom they served and will visit, or whom they serve, and when they were away.

import { el, fill, named, swatch } from "./dom.js";
import { DEADLINE_SHOWN_S, deadlineMark, LEFT_OUT, SHOWN_MIN_S, times, tourOf, visitsAt, visitWords } from "./visits.js";

/**
 * @typedef {import("./picture.js").Run} Run
 * @typedef {{ at: number, text: string }} Label
 */

/** Width of a letter of a label, and of what it stands beside, pixels. */
const LETTER_PX = 6.4, MARK_PX = 22;
/** What the widths of names and numbers beside the lanes leave is not known before they are drawn: lanes are as wide at least, px. */
const LANE_MIN_PX = 160;
/** For how long it is shown whom craft served that do not visit, s. */
const SERVED_SHOWN_S = 3600;
/** So many times as far as the last visit is, its number has room, too. */
const ROOM = 1.05;
/** An absence as its row says it. @type {{ [away: string]: string }} */
const AWAY_WORDS = { silent: "silent", not_steering: "not steering", battery_low: "battery low", does_not_follow: "does not follow", person: "a person has it", returning: "returning" };

/** A row for each craft. */
export class FleetStrip {
  constructor() {
    this.sentence = el("p", { class: "visits-next" });
    this.rows = el("div", { class: "visits-rows", role: "img" });
    this.key = el("p", { class: "visits-key" });
    this.element = el("section", { class: "visits of-fleet", "aria-label": "What each craft does", hidden: true }, this.sentence, this.rows, this.key);
  }

  /**
   * @param {Run[]} runs @param {import("./fleet_recording.js").FleetRecording} recording @param {number} t
   * @param {(id: string) => string[]} servedBy
   */
  draw(runs, recording, t, servedBy) {
    this.element.hidden = false;
    const all = runs.map((run) => ({ ...run, shown: visitsAt(run.recording, t) })), visits = all.some(({ shown }) => shown.goal?.kind === "visit"), [{ shown: { goal, clock } }] = all;
    // Until each AUV was visited.
    const stops = all.flatMap(({ shown: { schedule } }) => (schedule ? tourOf(schedule) : [])), deadlines = Object.values(goal?.serve_by_s ?? {}).filter((time) => time < t + DEADLINE_SHOWN_S);
    const to = visits ? Math.max(t + SHOWN_MIN_S, ...stops.map((stop) => t + ROOM * (stop.leave_s - t)), ...deadlines) : t, from = Math.max(Math.min(recording.span[0], t), visits ? 2 * t - to : t - SERVED_SHOWN_S);
    const x = (/** @type {number} */ time) => Math.min(Math.max((time - from) / (to - from || 1), 0), 1) * 100;
    const names = Math.max(...runs.map(({ name }) => name.length)), lane = Math.max(this.rows.clientWidth - 9 * names - 100, LANE_MIN_PX);
    /** What has no room has no words. @param {string} text @param {number} start @param {number} end */
    const fitting = (text, start, end) => (((x(end) - x(start)) * lane) / 100 > LETTER_PX * text.length + 4 ? text : "");
    const bar = (/** @type {string} */ kind, /** @type {number} */ start, /** @type {number} */ end, /** @type {string} */ title, text = "") => from <= end && start <= to && el("i", { class: kind, title, style: `left: ${x(start)}%; width: ${x(end) - x(start)}%` }, text);
    const changes = recording.assigned.filter(({ t_s }) => from < t_s && t_s <= t);
    this.rows.style.setProperty("--names", `min(${names + 3}ch, 42%)`);
    fill(this.sentence, visits && all.flatMap(({ name, shown: { schedule } }) => (schedule?.visits.length ? [`${name}: ${schedule.visits[0].auv} next`] : [])).join(" · "));
    fill(this.rows, all.map(({ name, colour, shown }) => {
      const { schedule, past = [] } = shown, serves = this.serving(recording, name, from, t), tour = schedule ? tourOf(schedule) : [];
      const labels = visits ? [...past.filter(({ auv, from: start, to: end }) => !fitting(auv, start, end)).map(({ auv, to: end }) => ({ at: end, text: auv })), ...tour.map(({ auv, arrive_s }) => ({ at: Math.max(arrive_s, t), text: auv }))] : [];
      const starts = [t, ...serves.filter(({ away }) => away).map(({ start }) => start), ...past.map(({ from: start }) => start), ...tour.map(({ arrive_s }) => arrive_s)].map(x);
      return el("div", { class: "visits-row" }, el("b", {}, swatch(colour), named(name)), el("div", { class: "lane", style: `color: var(--${colour})` },
        serves.map(({ start, end, auvs, away }) => (away ? bar("away", start, end, `${name}, ${AWAY_WORDS[away] ?? away} since ${clock(start)}`, fitting(AWAY_WORDS[away] ?? away, start, end)) : !visits && auvs.length > 0 && bar("serves", start, end, `${name} serves ${auvs.join(", ")} from ${clock(start)}`, fitting(auvs.join(", "), start, end) || fitting(countWords(auvs.length), start, end)))),
        changes.map(({ t_s }) => bar("change", t_s, t_s, `${clock(t_s)}: who serves whom changed`)),
        visits && past.map(({ auv, from: start, to: end }) => bar("past", start, end, `${auv}, served ${clock(start)} to ${clock(end)}`, fitting(auv, start, end))),
        schedule && tour.map((visit, i) => bar("planned", Math.max(visit.arrive_s, t), visit.leave_s, visitWords(visit, schedule, clock), String(i + 1))),
        spaced(labels.map(({ at, text }) => ({ at: x(at), text })), starts, lane).map(({ at, text }) => el("span", { class: "auv-label", style: `left: ${at}%` }, text)),
        schedule && schedule.costs.map((served) => deadlineMark(served, shown, bar)), schedule?.costs.map(({ auv, left_out }) => left_out && el("span", { class: "left-out" }, `${auv} left out: ${LEFT_OUT[left_out]}`))),
      el("span", {}, countWords(servedBy(name).length)));
    }), el("div", { class: "visits-row visits-times" }, el("b"), el("div", { class: "lane" }, times(from, to, t).map((time) => el("span", { style: `left: ${x(time)}%` }, clock(time))), el("i", { style: `left: ${x(t)}%` }))));
    const key = visits ? [["past", "served"], ["planned", "planned, numbered as on the map"], ["deadline", "serve by"]] : [["serves", "serves"]];
    fill(this.key, [...key, ["away", "away"], ["change", "who serves whom changed"]].flatMap(([kind, words]) => [el("i", { class: kind }), words]));
    this.rows.setAttribute("aria-label", all.map(({ name, shown: { schedule } }) => `${name} serves ${servedBy(name).join(", ") || "nobody"}${schedule?.visits.length ? `, planned: ${tourOf(schedule).map((visit) => visitWords(visit, schedule, clock)).join("; ")}` : ""}`).join(". "));
  }

  /** Whom a craft served from `from` to `t`, and when it was away. @param {import("./fleet_recording.js").FleetRecording} recording @param {string} id @param {number} from @param {number} t */
  serving({ assigned }, id, from, t) {
    /** @type {{ start: number, end: number, auvs: string[], away?: string }[]} */
    const found = [];
    assigned.filter(({ t_s }) => t_s <= t).forEach(({ t_s, craft, away }, i, all) => {
      const end = all[i + 1]?.t_s ?? t, part = { start: Math.max(t_s, from), end, auvs: craft.get(id) ?? [], away: away.get(id) }, last = found.at(-1);
      if (last && last.away === part.away && (part.away || String(last.auvs) === String(part.auvs))) last.end = end;
      else if (end >= from) found.push(part);
    });
    return found;
  }
}

/** @param {number} n */
function countWords(n) {
  return n ? `${n} AUV${n > 1 ? "s" : ""}` : "nobody";
}

/** Those labels that cover nothing, from left to right: neither each other nor what begins at one of `starts`. @param {Label[]} labels in percent of a lane of so many pixels @param {number[]} starts @param {number} lane */
function spaced(labels, starts, lane) {
  let free = -Infinity;
  return labels.sort((a, b) => a.at - b.at).filter(({ at, text }) => {
    const px = (at * lane) / 100, end = px + MARK_PX + LETTER_PX * text.length;
    if (px < free || end > lane || starts.some((start) => start > at && (start * lane) / 100 < end)) return false;
    free = end;
    return true;
  });
}
