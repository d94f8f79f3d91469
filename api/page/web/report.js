// A report: recorded data in the same views as the service's page, in one file.

import { el, fill } from "./dom.js";
import { duration } from "./format.js";
import { Recording } from "./recording.js";
import { MissionView } from "./mission.js";
import { ComparisonView, runOf } from "./comparison.js";
import { drawSheet } from "./sheet.js";
import { themeChoice } from "./theme.js";

/**
 * @typedef {{ words: number, columns: string[], rows: string[][] }} BlockTable
 * @typedef {{ heading?: [number, string], paragraph?: string, table?: BlockTable, code?: [string, string], sheet?: import("./sheet.js").Sheet }} Block
 * @typedef {{ mission: import("./types.js").MissionJson, csv: string, predictions?: [number, import("./types.js").Prediction][] }} RecordedRun
 * @typedef {{ guide: string, lines: [string, string][] }} RecordedScores
 */

const data = JSON.parse(document.getElementById("data")?.textContent ?? "{}");
const host = /** @type {HTMLElement} */ (document.getElementById("main"));
document.body.prepend(el("header", { class: "top" }, el("span", { class: "brand" }, "Pilotfish"), el("span", { id: "theme-place" }, themeChoice())));
if (data.kind === "document") host.append(...data.blocks.map(blockElement));
else showRuns(data.runs ?? [], data.scores ?? []);

/** @param {RecordedRun[]} recorded @param {RecordedScores[]} scored */
function showRuns(recorded, scored) {
  const recordings = recorded.map(({ mission, csv, predictions = [] }) => {
    const recording = new Recording(mission);
    recording.takeLines(csv.split("\n"));
    for (const [t_s, prediction] of predictions) recording.keepPrediction(t_s, prediction);
    return recording;
  });
  const body = el("div"), [first] = recordings;
  fill(host, el("header", { class: "mission-head" }, el("h1", {}, data.title), el("p", { class: "about" }, first ? aboutRun(first) : "Nothing was recorded.")), body, scoresOf(scored));
  if (!first) return;
  if (recordings.length > 1) {
    const runs = recordings.map((recording, i) => runOf(recording.scene.controller ?? recording.mission.title, i, recording));
    new ComparisonView(body, runs, { name: data.title.replace(/[^\w-]+/g, "-"), over: true });
  } else new MissionView(body, [{ name: "", colour: "plan", recording: first }]);
}

/** @param {Recording} recording */
function aboutRun({ mission, scene }) {
  return [mission.title, scene.seed !== undefined && `seed ${scene.seed}`, scene.duration_s && duration(scene.duration_s), scene.information && `information given: ${scene.information}`].filter(Boolean).join(" · ");
}

/** @param {RecordedScores[]} scored */
function scoresOf(scored) {
  if (!scored.length) return null;
  const names = scored[0].lines.map(([name]) => name);
  const value = (/** @type {RecordedScores} */ { lines }, /** @type {string} */ name) => lines.find(([of]) => of === name)?.[1] ?? "";
  return el("section", { class: "panel scores" }, el("h2", {}, "Scores"), el("div", { class: "table-scroll", tabIndex: 0, role: "group", "aria-label": "Scores" },
    el("table", {}, el("thead", {}, el("tr", {}, el("td"), scored.map(({ guide }) => el("th", { scope: "col" }, guide)))),
      el("tbody", {}, names.map((name) => el("tr", {}, el("th", { scope: "row" }, name), scored.map((one) => el("td", {}, value(one, name)))))))));
}

/** @param {Block} block */
function blockElement({ heading, paragraph, table, code, sheet }) {
  if (heading) return heading[0] === 1 ? el("header", { class: "mission-head" }, el("h1", {}, marked(heading[1]))) : el(heading[0] === 2 ? "h2" : "h3", {}, marked(heading[1]));
  if (table) return blockTable(table);
  if (code) return el("section", { class: "panel" }, el("h2", {}, code[0]), el("pre", { class: "code", tabIndex: 0 }, code[1]));
  if (!sheet) return el("p", { class: "prose" }, marked(paragraph ?? ""));
  const place = el("section", { class: "panel sheet" });
  drawSheet(place, sheet);
  return place;
}

/** @param {BlockTable} table */
function blockTable({ words, columns, rows }) {
  const aligned = (/** @type {number} */ i) => ({ class: i < words && "words" });
  return el("section", { class: "panel" }, el("div", { class: "table-scroll", tabIndex: 0, role: "group", "aria-label": columns.join(", ") },
    el("table", {}, el("thead", {}, el("tr", {}, columns.map((cell, i) => el("th", { ...aligned(i), scope: "col" }, marked(cell))))),
      el("tbody", {}, rows.map((row) => el("tr", {}, row.map((cell, i) => el("td", aligned(i), marked(cell)))))))));
}

/**
 * Text between `**` is bold, between backticks code.
 * @param {string} words
 * @returns {(Node | string)[]}
 */
function marked(words) {
  return words.split(/(\*\*.+?\*\*|`.+?`)/).map((part, i) => {
    if (i % 2 === 0) return part;
    return part.startsWith("`") ? el("code", {}, part.slice(1, -1)) : el("b", {}, marked(part.slice(2, -2)));
  });
}
