// Ten hours of missions without faults, both craft: no plan in them is an alarm on the page or in the bridge's status line. `node nominal.mjs [HOURS]`

import { readFile } from "node:fs/promises";
import { stateOf } from "../../api/page/web/alarm.js";
import { flown, startService } from "./service.mjs";

/** Scenarios without faults: of a MEDUSA, and of an Otter. */
const SCENARIOS = ["calm", "otter", "cross-current", "survey-lanes", "switching", "survey-declared", "noisy-fixes", "fast-lawn-mower", "visit-near", "otter"];

/** The warnings that are alarms of the bridge, from its source. */
const source = await readFile(new URL("../../api/bridge/src/follow/reporting.rs", import.meta.url), "utf8");
const [, NOT_HEARD] = /const NOT_HEARD: &str = "(\w+)"/.exec(source);
const TOLD = [.../const NOT_FOLLOWED: \[&str; \d+\] = \[([^\]]*)\]/.exec(source)[1].matchAll(/"(\w+)"/g)].map(([, code]) => code);

const hours = Number(process.argv[2] ?? 10), service = await startService();
let flown_s = 0, n_alarms = 0;
try {
  for (let n = 0; flown_s < hours * 3600; n += 1) {
    const scenario = SCENARIOS[n % SCENARIOS.length], seed = 1 + Math.floor(n / SCENARIOS.length);
    const id = await flown(service, { scenario, seed }, scenario), mission = await service.get(`/v1/missions/${id}`);
    const record = await fetch(`${service.url}/v1/missions/${id}/events?after=0`).then((answer) => answer.text());
    const plans = record.split("\n").filter((line) => line.startsWith("data:")).map((line) => JSON.parse(line.slice(5))).filter(({ kind }) => kind === "planned");
    const seen = {};
    for (const { outcome, reason, method, prediction } of plans) {
      const codes = (prediction.warnings ?? []).map(({ code }) => code);
      const state = stateOf({ ...mission, status: "running", plan: { outcome, reason, method, warning_codes: codes } });
      const said = [...(state.alarm ? [`page: ${state.words} ${state.why}`] : []), ...codes.filter((code) => TOLD.includes(code)).map((code) => `bridge: ${code}`), ...(reason ? [`bridge: ${reason}`] : [])];
      if (codes.includes(NOT_HEARD)) seen[`told, no alarm: ${NOT_HEARD}`] = (seen[`told, no alarm: ${NOT_HEARD}`] ?? 0) + 1;
      for (const words of said) seen[words] = (seen[words] ?? 0) + 1;
      if (said.length) n_alarms += 1;
    }
    flown_s += plans.at(-1).t_s - plans[0].t_s;
    console.log(`${scenario}, seed ${seed}: ${plans.length} plans, ${(flown_s / 3600).toFixed(2)} h so far${Object.entries(seen).map(([words, times]) => `; ${words} × ${times}`).join("")}`);
    await service.delete(`/v1/missions/${id}`);
  }
} finally {
  await service.stop();
}
console.log(`${(flown_s / 3600).toFixed(1)} h, ${n_alarms} plans with an alarm; the bridge's alarms are degraded plans, ${TOLD.join(", ")}`);
process.exitCode = n_alarms ? 1 : 0;
