// A report: recorded data in the same views as the service's page, in one file.

import { el, fill } from "./dom.js";
import { duration } from "./format.js";
import { Recording } from "./recording.js";
import { MissionView } from "./mission.js";
import { ComparisonView, runOf } from "./comparison.js";
import { drawSheet } from "./sheet.js";
import { themeChoice } from "./theme.js";

/**
 * @typedef {{ mission: import("./recording.js").MissionJson, csv: string, predictions?: [number, import("./recording.js").Prediction][] }} RecordedRun
 * @typedef {{ guide: string, lines: [string, string][] }} RecordedScores
 */

const data = JSON.parse(document.getElementById("data")?.textContent ?? "{}");
const host = /** @type {HTMLElement} */ (document.getElementById("main"));
document.body.prepend(el("header", { class: "top" }, el("span", { class: "brand" }, "Pilotfish"), el("span", { id: "theme-place" }, themeChoice())));
if (data.kind === "sheets") showSheets();
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

function showSheets() {
  fill(host, el("header", { class: "mission-head" }, el("h1", {}, data.title)), (data.text ?? []).map((/** @type {string} */ text) => el("p", { class: "prose" }, text)));
  for (const table of data.tables ?? []) {
    host.append(el("section", { class: "panel" }, el("h2", {}, table.caption), el("div", { class: "table-scroll", tabIndex: 0, role: "group", "aria-label": table.caption },
      el("table", {}, el("thead", {}, el("tr", {}, table.head.map((/** @type {string} */ cell) => el("th", { scope: "col" }, cell)))),
        el("tbody", {}, table.rows.map((/** @type {string[]} */ row) => el("tr", {}, row.map((cell) => el("td", {}, cell)))))))));
  }
  for (const code of data.code ?? []) host.append(el("section", { class: "panel" }, el("h2", {}, code.caption), el("pre", { class: "code", tabIndex: 0 }, code.text)));
  for (const sheet of data.sheets ?? []) {
    const place = el("section", { class: "panel sheet" });
    host.append(place);
    drawSheet(place, sheet);
  }
}
