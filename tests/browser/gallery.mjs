// Flies every scenario with a surface craft, seed 1, under the planner and, where the goal is the same for both, under the line-of-sight law that is
// nearest of those that `pilotfish compare` tunes, and writes what the first page draws of them, with the gains of all laws. Where the goal visits or
// localises, it writes the planner's score instead:
//   node gallery.mjs FILE          writes it
//   node gallery.mjs FILE NAME...  flies these scenarios alone, and keeps the others
//   node gallery.mjs --check FILE  says whether it is still what is flown

import { execFile, execFileSync } from "node:child_process";
import { readFile, writeFile } from "node:fs/promises";
import { promisify } from "node:util";
import { Recording } from "../../api/page/web/recording.js";
import { scores } from "../../api/page/web/scores.js";
import { SIZE } from "../../api/page/web/thumbnail.js";
import { flown, PROGRAM, startService } from "./service.mjs";

/** A point is left out if the line without it misses it by less than this share of the extent. */
const MISS_MAX = 0.02;
const MARGIN = 10;
/** Scenarios whose goal is where the planner chooses, or that a law does not know: it sees neither vessels nor no-go areas. */
const VISITS = /^(visit|localise|traffic|no-go)-/;
/** Scenarios with several craft: a simulated mission of the service has one. */
const SEVERAL = /^fleet-/;
/** Another processor may round another way, which a long run amplifies: distances differ by no more than this share. */
const DIFFERENCE_MAX = 0.05;
/** A law that goes round the goal and not to it is no opponent. */
const AROUND = "waypoint_box";

const [check, file, ...only] = process.argv[2] === "--check" ? [true, process.argv[3]] : [false, ...process.argv.slice(2)];
const service = await startService();
try {
  const lines = execFileSync(PROGRAM, ["scenarios"], { encoding: "utf8" }).trim().split("\n");
  const listed = lines.map((line) => /^(\S+)\s+(.*)$/.exec(line).slice(1)).filter(([name, title]) => !title.includes("no surface craft") && !SEVERAL.test(name));
  const before = check || only.length ? JSON.parse(await readFile(file, "utf8")).scenarios : [];
  if (check && listed.map(([name]) => name).join() !== before.map(({ name }) => name).join()) throw new Error(`${file} has other scenarios: draw it again`);
  const scenarios = [], differ = [];
  for (const [name, title] of listed) {
    const old = before.find((scenario) => scenario.name === name);
    if (only.length && !only.includes(name)) {
      scenarios.push(old);
      continue;
    }
    // Where the goal visits or localises, there is no distance to compare.
    if (check && VISITS.test(name)) continue;
    if (check && (!old.law || old.law === AROUND)) throw new Error(`${name}: no law that goes to the goal was tuned for it: .ci/page-test --draw`);
    // Tuning takes minutes in some scenarios: a check flies with the gains that are written.
    scenarios.push({ name, title, ...await drawn(name, VISITS.test(name) ? {} : check ? { law: old.law, gains: old.gains } : tuned(name)) });
    const made = scenarios.at(-1);
    for (const [k, now] of (check && made.rms_m || []).entries()) {
      const then = old.rms_m[k];
      if (Math.abs(now - then) > DIFFERENCE_MAX * then + 0.01) differ.push(`${name}: the ${["planner", "line of sight"][k]} is now ${now} m from the goal and was ${then} m`);
    }
    console.log(`${name}: planner, line of sight: ${made.rms_m ?? "goes where it chooses"} m`);
  }
  if (differ.length) throw new Error(`draw them again, with node gallery.mjs FILE NAME...:\n${differ.join("\n")}`);
  if (!check) await writeFile(file, `{"scenarios":[\n${scenarios.map((scenario) => JSON.stringify(scenario)).join(",\n")}\n]}\n`);
} finally {
  await service.stop();
}

/** The strongest law that goes to the goal, and the gains of all in the order of `pilotfish compare`'s. */
function tuned(scenario) {
  const { mpc, ...laws } = JSON.parse(execFileSync(PROGRAM, ["compare", scenario, "--format", "json"], { encoding: "utf8" })).controllers;
  const [law] = Object.keys(laws).filter((name) => name !== AROUND).sort((a, b) => laws[a].rms_m - laws[b].rms_m);
  return { law, gains: Object.fromEntries(Object.entries(laws).map(([name, { gains }]) => [name, Object.values(gains)])) };
}

/** What visits or ranges were worth to the AUVs: their mean cost and how many visits, or how far off they are localised. */
async function worth(scenario) {
  if (!/^(visit|localise)-/.test(scenario)) return {};
  // Not synchronously: the service closes a connection that is silent, and nobody here would notice.
  const { stdout: said } = await promisify(execFile)(PROGRAM, ["simulate", scenario]), score = (key) => Number(new RegExp(`^${key}\\s+(\\S+)`, "m").exec(said)?.[1]);
  if (scenario.startsWith("localise")) return { localised_rms_m: score("localisation.rms_m") };
  const cost = /^cost = \{(\w+)/m.exec(execFileSync(PROGRAM, ["scenarios", scenario], { encoding: "utf8" }))?.[1] ?? "age";
  return { visits: { n: score("visits.visits"), cost, mean: score("visits.mean_cost") } };
}

async function drawn(scenario, { law, gains }) {
  const [planner, los] = await Promise.all(["mpc", ...law ? [law] : []].map(async (controller) => {
    const given = controller === law && { gains: Object.fromEntries(gains[law].map((value, i) => [["look_ahead_m", "along_track_gain_per_s", "integral_gain_mps"][i], value])) };
    const id = await flown(service, { scenario, seed: 1, controller, ...given }, `${scenario}: ${controller}`);
    const recording = new Recording({ ...await service.get(`/v1/missions/${id}`), scene: await service.get(`/v1/missions/${id}/scene`) });
    recording.takeLines((await (await fetch(`${service.url}/v1/missions/${id}/record?format=csv`)).text()).split("\n"));
    // A mission is some 10 MB.
    await service.delete(`/v1/missions/${id}`);
    return recording;
  }));
  const { duration_s, keep_outs, area, no_go = [] } = planner.scene;
  const craft = points(planner.craft), auvs = Array.from(planner.auvs.values(), points), all = [craft, ...auvs, area].flat(), vessels = Array.from(planner.vessels.values(), points);
  const miss = MISS_MAX * Math.max(...[0, 1].map((k) => extent(all.map((point) => point[k]))));
  const [x, y, scale] = fitted(all), path = (...lines) => lines.map((line) => drawnPath(thinned(line, miss).map(([north, east]) => [x(east), y(north)]))).join("");
  const land = no_go.flatMap(({ polygon, holes = [] }) => [polygon, ...holes]).map((ring) => `${path(ring)}z`).join("");
  const both = (key) => [planner, los].map((recording) => Math.round(1000 * scores(recording)[key]) / 1000);
  return {
    duration_s, ...await worth(scenario), ...los && { law, gains, rms_m: both("rms_m"), settled_rms_m: both("settled_rms_m") },
    paths: { ...land && { "no-go": land }, ...area.length && { area: `${path(area)}z` }, ...vessels.length && { vessel: path(...vessels) }, auv: path(...auvs), ...los && { los: path(points(los.craft)) }, plan: path(craft) },
    ...keep_outs.length && { keep_outs: keep_outs.map((disc) => [x(disc.east_m), y(disc.north_m), Math.round(disc.radius_m * scale)]) },
  };
}

/** Where an east and a north are in a picture in which all of the points are, and pixels a metre. */
function fitted(all) {
  const [norths, easts] = [0, 1].map((k) => all.map((point) => point[k])), middle = (list) => (Math.min(...list) + Math.max(...list)) / 2;
  const scale = Math.min((SIZE[0] - 2 * MARGIN) / Math.max(extent(easts), 10), (SIZE[1] - 2 * MARGIN) / Math.max(extent(norths), 10));
  return [(east) => Math.round(SIZE[0] / 2 + (east - middle(easts)) * scale), (north) => Math.round(SIZE[1] / 2 - (north - middle(norths)) * scale), scale];
}

function extent(list) {
  return Math.max(...list) - Math.min(...list);
}

/** A path of SVG in steps of whole pixels. */
function drawnPath([first, ...others]) {
  let before = first;
  const steps = others.map((point) => {
    const step = point.map((at, k) => at - before[k]);
    before = point;
    return step;
  });
  return `M${first.join(" ")}l${steps.filter(([dx, dy]) => dx || dy).flat().join(" ").replaceAll(" -", "-") || "0 0"}`;
}

function points(series) {
  return Array.from({ length: series.length }, (_, i) => [series.column("north")[i], series.column("east")[i]]);
}

/** Douglas and Peucker's thinning. */
function thinned(line, miss) {
  if (line.length < 3) return line;
  const [[n0, e0], [n1, e1]] = [line[0], line.at(-1)], length = Math.hypot(n1 - n0, e1 - e0);
  let [farthest, most] = [0, 0];
  line.forEach(([n, e], i) => {
    const off = length > 0 ? Math.abs((n - n0) * (e1 - e0) - (e - e0) * (n1 - n0)) / length : Math.hypot(n - n0, e - e0);
    if (off > most) [farthest, most] = [i, off];
  });
  if (most <= miss) return [line[0], line.at(-1)];
  return [...thinned(line.slice(0, farthest + 1), miss).slice(0, -1), ...thinned(line.slice(farthest), miss)];
}
