// The table of what those who watch see after a fault: `cargo run -p tests --bin voyages -- --shown | node shown.mjs`.
// Fails if anything is good three seconds after a fault.

import { readFileSync } from "node:fs";

import { stateOf, tabTitle } from "../../api/page/web/alarm.js";

let mission, at = 0, good = 0;
const rows = ["| fault | after | page | title | status line | ground station |", "|---|--:|---|---|---|---|"];
for (const look of readFileSync(0, "utf8").trim().split("\n").map((line) => JSON.parse(line))) {
  if (look.mission) (mission = look.mission, at = look.t_s);
  const by = look.t_s - at, { plan, steering } = mission;
  const lost = look.mission ? "" : "connection lost: the service does not answer; trying again";
  const state = stateOf(mission, { age_s: plan && plan.age_s + by, said_s: steering && steering.age_s + by, lost });
  const line = look.line.split(/, (?=GUIDED|HOLD|mode|no autopilot|autopilot)/)[0], isSilent = 3 <= look.silent_s;
  const text = isSilent ? `no heartbeat of the bridge; before: ${look.text}` : look.text;
  const isGood = [state.tone === "good", !isSilent && line === "steering", !isSilent && look.text === "Pilotfish steering"];
  good += Number(!look.is_over && 3 <= look.after_s && isGood.some(Boolean));
  const mark = (/** @type {number} */ k, /** @type {string} */ words) => isGood[k] ? `**${words}**` : words;
  const after = `${look.is_over ? "over, " : ""}${look.after_s} s`, page = [state.words, state.why].filter(Boolean).join(": ");
  rows.push(`| ${look.fault} | ${after} | ${mark(0, `${page} (${state.tone})`)} | ${tabTitle(state, "a voyage")} | ${mark(1, line)} | ${mark(2, text)} |`);
}
console.log(rows.join("\n"));
console.log(`\n${good} looks with something good 3 s or more after a fault`);
process.exitCode = good ? 1 : 0;
