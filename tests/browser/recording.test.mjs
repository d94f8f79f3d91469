// What the page makes of records and events, without a browser.

import { test } from "node:test";
import { expect } from "@playwright/test";
import { stateOf } from "../../api/page/web/alarm.js";
import { backgroundOf } from "../../api/page/web/background.js";
import { Recording } from "../../api/page/web/recording.js";
import { scores, worstStretch } from "../../api/page/web/scores.js";
import { chartsOf } from "../../api/page/web/curves.js";
import { differences } from "../../api/page/web/differences.js";
import { explanation } from "../../api/page/web/explanation.js";
import { assignedWords, FleetRecording } from "../../api/page/web/fleet_recording.js";
import { chartEvents } from "../../api/page/web/journal.js";
import { OrderDraft, valueAt, withValue } from "../../api/page/web/order_draft.js";
import { pictureBounds } from "../../api/page/web/drawing.js";
import { pictureAt } from "../../api/page/web/picture.js";
import { addVessels, trafficState, vesselsOf } from "../../api/page/web/traffic.js";
import { visitsAt } from "../../api/page/web/visits.js";

const recording = (mission = {}) => new Recording({ id: "m", title: "", kind: "live", status: "running", t_s: 0, scene: {}, ...mission });
const asc = (t_s, north_m, east_m) => ({ t_s, state: { north_m, east_m, heading_rad: 0, speed_mps: 1 } });
const same = (unix) => unix;
let sequence = 0;
const take = (into, event) => into.takeEvent(sequence += 1, event, same);
const reported = (into, t, north, east) => take(into, { kind: "reported", at_s: t, heard: { asc: [asc(t, north, east)] } });

test("a disc counts from when it was put there until it was taken away", () => {
  const disc = { north_m: 0, east_m: 0, radius_m: 5 }, live = recording({ scene: { keep_outs: [] } });
  reported(live, 10, 0, 0);
  take(live, { kind: "changed", at_s: 20, setting: { keep_outs: [disc] } });
  reported(live, 30, 1, 0);
  reported(live, 40, 4, 0);
  take(live, { kind: "changed", at_s: 50, setting: { keep_outs: null } });
  reported(live, 60, 0, 0);
  expect([15, 35, 55].map((t) => live.limits.at(t).keep_outs.length)).toEqual([0, 1, 0]);
  const [breach, ...others] = live.limits.brokenUntil(100);
  expect(others).toEqual([]);
  expect(breach).toMatchObject({ t: 30, north: 1, beyond: 4, limit: "inside a keep-out" });
  expect(live.limits.brokenUntil(20)).toEqual([]);
});

test("a stay outside the area is marked where it is farthest, whichever way its corners are listed", () => {
  const corners = [[0, 0], [100, 0], [100, 50], [0, 50]];
  for (const area of [corners, corners.toReversed()]) {
    const live = recording({ scene: { area } });
    for (const [t, north, east] of [[1, 50, 25], [2, 103, 54], [3, 106, 58], [4, 90, 25], [5, 50, -2]]) reported(live, t, north, east);
    const found = live.limits.brokenUntil(10);
    expect(found.map(({ t }) => t)).toEqual([3, 5]);
    // 6 m north and 8 m east of a corner; 2 m off an edge.
    expect(found.map(({ beyond }) => beyond)).toEqual([10, 2]);
  }
});

test("out of acoustic range is by the slant range to where the AUV was", () => {
  const simulated = recording({ kind: "simulated", scene: { range_max_m: 50 } });
  const lines = ["sequence,kind,t_s,vehicle,north_m,east_m,depth_m", "1,truth,1,asc,40,0,", "1,truth,1,auv-1,0,0,40", "2,truth,2,asc,20,0,", "2,truth,2,auv-1,0,0,40"];
  simulated.takeLines(lines);
  // 40 m beside and 40 m below is 56.6 m away.
  expect(simulated.limits.brokenUntil(5).map(({ t, beyond }) => [t, Math.round(10 * beyond)])).toEqual([[1, 66]]);
});

test("vessels of a simulated mission are drawn from its record and from its events, in each of several runs, and how near they were is scored", () => {
  const layers = { forecasts: true, goal: true, fixes: true, ghost: true, acoustic: true, bounds: true, paths: true, chart: false, tour: true, traffic: true }, background = { lines: [], marks: [] };
  const ofRecord = recording({ kind: "simulated" }), ofEvents = recording({ kind: "simulated" });
  ofRecord.takeLines(["sequence,kind,t_s,vehicle,north_m,east_m,length_m,course_rad,speed_mps", "1,truth,1,asc,0,0,,,", "1,vessel,1,ship,40,30,20,3.1,5", "2,truth,2,asc,0,0,,,", "2,vessel,2,ship,0,35,20,3.1,5", "3,truth,3,asc,0,0,,,", "3,vessel,3,ship,-40,30,20,3.1,5"]);
  for (const [t, north_m, east_m] of [[1, 40, 30], [2, 0, 35], [3, -40, 30]]) {
    const asc = { north_m: 0, east_m: 0, depth_m: 0, heading_rad: 0, speed_mps: 1 }, truth = { asc, auvs: {}, goal_north_m: 0, goal_east_m: 0, distance_m: 0, energy_j: 0, vessels: { ship: { north_m, east_m, course_rad: 3.1, speed_mps: 5, length_m: 20 } } };
    take(ofEvents, { kind: "planned", t_s: t, late_s: 0, solve_time_ns: 0, outcome: "ok", method: "mpc", reference: { speed_mps: 1, heading_rad: 0 }, truth });
  }
  for (const simulated of [ofRecord, ofEvents]) {
    const run = (name) => ({ name, colour: "craft-1", recording: simulated }), drawn = pictureAt([run("one"), run("two")], 2.5, layers, background);
    const [ship, ...others] = drawn.vehicles.filter(({ kind }) => kind === "vessel");
    expect([others, ship.north, ship.east, ship.heading, ship.name]).toEqual([[], 0, 35, 3.1, "ship"]);
    expect(drawn.tracks.find(({ name }) => name === "ship")).toMatchObject({ to: 2 });
    // 35 m off, less half of 20 m.
    expect(scores(simulated).vessel_least_m).toBe(25);
    // Where the planner believes it to be is drawn instead.
    const asc = [[0, 0], [1, 0]], goal = asc, line_of_sight = asc, vessels = [{ id: "ship", position: [3, 34], velocity: [-5, 0], age_s: 1, separation_m: 45 }];
    simulated.keepPrediction(2, { asc, goal, line_of_sight, after_s: [0, 1], auvs: [], vessels });
    expect(pictureAt([run("one")], 2, layers, background).vehicles.filter(({ kind }) => kind === "vessel").map(({ north }) => north)).toEqual(simulated.plans.length ? [3] : [0]);
  }
});

test("fixes of a simulated mission are where and when they were sent, and those that were refused are known", () => {
  const simulated = recording({ kind: "simulated" });
  simulated.takeLines([
    "sequence,kind,t_s,vehicle,north_m,east_m,age_s", "1,known,10,auv-1,5,6,2.5", "2,known,11,auv-1,5,6,3.5", "3,known,12,auv-1,9,9,2", "3,refused,10,auv-1,,,", "4,known,13,auv-2,,,0",
  ]);
  const fixes = simulated.fixes.get("auv-1");
  expect(Array.from(fixes.column("t").subarray(0, fixes.length))).toEqual([7.5, 10]);
  expect(simulated.refused.get("auv-1").last).toBe(10);
  expect(simulated.fixes.has("auv-2")).toBe(false);
  const event = {
    kind: "planned", t_s: 12, late_s: 0, solve_time_ns: 1e6, outcome: "ok", method: "mpc", reference: { speed_mps: 1, heading_rad: 0 }, truth: { asc: { north_m: 0, east_m: 0 }, auvs: {} },
    prediction: { goal: [], asc: [[0, 0]], auvs: [{ id: "auv-1", age_s: 2, heard: { t_s: 10.0004, north_m: 9, east_m: 9 }, refused_t_s: [10], positions: [[0, 0]], depths_m: [1] }] },
  };
  const streamed = recording({ kind: "simulated" });
  take(streamed, event);
  expect([streamed.fixes.get("auv-1").first, streamed.refused.get("auv-1").first]).toEqual([10, 10]);
});

test("the errors along and across a live goal are of where the plan takes the craft to be, as the distance is", () => {
  const live = recording();
  const planned = (t_s, goal, at) => ({
    kind: "planned", t_s, late_s: 0, solve_time_ns: 1e6, outcome: "ok", method: "mpc", reference: { speed_mps: 1, heading_rad: 0 },
    prediction: { goal: [goal], asc: [at], auvs: [] },
  });
  reported(live, 0, -100, -100);
  take(live, planned(1, [0, 0], [-3, 4]));
  take(live, planned(2, [1, 0], [-2, 4]));
  const at = (name) => live.goal.at(name, 2);
  // The goal goes north: behind is negative, east is to starboard.
  expect([at("distance"), at("along"), at("cross")]).toEqual([5, -3, 4]);
});

test("a gap's events are put where they belong", () => {
  const live = recording();
  reported(live, 1, 1, 0);
  sequence += 1;
  const missed = sequence;
  reported(live, 3, 3, 0);
  live.takeAny(missed, { kind: "reported", at_s: 2, heard: { asc: [asc(2, 2, 0)] } }, same);
  expect(Array.from(live.craft.column("north").subarray(0, 3))).toEqual([1, 2, 3]);
  expect(live.sequence).toBe(sequence);
});

test("a gap that is filled tells of its own hand-overs and degraded plans, and of no others, and is no alarm", () => {
  const live = recording({ scene: { period_s: 1 } });
  // The goal goes north at 1 m/s, and from 300 s on it is another one, 500 m east. The plan of 200 s is degraded.
  const planned = (t_s) => ({ kind: "planned", t_s, late_s: 0, solve_time_ns: 1e6, outcome: t_s === 200 ? "degraded" : "ok", method: "mpc", reference: { speed_mps: 1, heading_rad: 0 },
    prediction: { goal: [[t_s, t_s < 300 ? 0 : 500]], asc: [[t_s - 3, t_s < 300 ? 0 : 500]], auvs: [] } });
  const at = (t) => live.takeEvent(t, planned(t), same), fill = (from, to) => { for (let t = from; t <= to; t += 1) live.takeAny(t, planned(t), same); };
  for (let t = 1; t <= 10; t += 1) at(t);
  live.takeEvent(NaN, { kind: "gap", from: 11, to: 600 }, same);
  // The stream goes on while the gap is fetched.
  fill(11, 150);
  at(601);
  fill(151, 600);
  at(602);
  expect(live.journal.entries.map(({ t_s, kind }) => [t_s, kind])).toEqual([[10, "gap"], [200, "degraded"], [201, "recovered"], [300, "goal jumps"]]);
  expect(live.handOvers.map(({ t }) => t)).toEqual([300]);
  // Three metres behind, in the gap as after it.
  for (const t of [5, 155, 400, 602]) expect(live.goal.at("along", t)).toBeCloseTo(-3, 9);
  // Later silence is an alarm again.
  at(640);
  expect(live.journal.entries.slice(-2).map(({ t_s, kind }) => [t_s, kind])).toEqual([[606, "alarm"], [640, "alarm over"]]);
});

test("settled scores and the worst minute begin where the scenario says that it has settled", () => {
  const flown = recording({ kind: "simulated", scene: { settled_after_s: 300 } });
  const rows = Array.from({ length: 900 }, (_, t) => `${t + 1},truth,${t},asc,0,0,${t},0,${t < 200 ? 50 : t < 500 ? 2 : 1}`);
  flown.takeLines(["sequence,kind,t_s,vehicle,north_m,east_m,goal_north_m,goal_east_m,goal_distance_m", ...rows]);
  const expected = Math.sqrt((200 * 4 + 400) / 600);
  expect(scores(flown).settled_rms_m).toBeCloseTo(expected, 9);
  expect(worstStretch(flown).rms_m).toBeCloseTo(2, 9);
});

test("a chart in the coordinates of a projection is refused", () => {
  const chart = (coordinates) => backgroundOf(JSON.stringify({ type: "LineString", coordinates }), { lat_deg: 38.41, lon_deg: -9.12 });
  expect(chart([[-9.12, 38.41], [-9.12, 38.42]]).lines).toHaveLength(1);
  for (const place of [[482113.2, 4251234.5], [163100.1, 68.2], [-9.12, 91.5]]) expect(() => chart([place])).toThrow(/EPSG:4326/);
});

test("past visits are when the craft was as near as the goal says, and a long silence ends one", () => {
  // At 1 m/s past an AUV that lies 12 m beside its track at 50 m: within 20 m of it from 16 m before to 16 m behind.
  const line = (kind, t, vehicle, north, east) => `${t},${kind},${t},${vehicle},${north},${east},0`, seconds = Array.from({ length: 101 }, (_, t) => t);
  const lines = [...seconds, 200, 201].flatMap((t) => [line("truth", t, "asc", Math.min(t, 100), 0), line("truth", t, "auv-1", 50, 12), line("truth", t, "auv-2", 100, 0), line("planned", t, "", "", "")]);
  const past = (t, within_m) => {
    const simulated = recording({ kind: "simulated", scene: { goal: { kind: "visit", auvs: ["auv-1", "auv-2"], within_m } } });
    simulated.takeLines(["sequence,kind,t_s,vehicle,north_m,east_m,depth_m", ...lines]);
    return visitsAt(simulated, t).past;
  };
  expect(past(300)).toEqual([{ auv: "auv-1", from: 34, to: 66 }, { auv: "auv-2", from: 80, to: 100 }, { auv: "auv-2", from: 200, to: 201 }]);
  expect(past(50)).toEqual([{ auv: "auv-1", from: 34, to: 50 }]);
  expect(past(300, 13)[0]).toEqual({ auv: "auv-1", from: 45, to: 55 });
});

test("time without plans is in the log as an alarm with its begin and end, unless the mission was paused", () => {
  const live = recording({ scene: { period_s: 1 } }), plan = (t_s) => take(live, { kind: "planned", t_s, reference: {}, method: "mpc", outcome: "ok" });
  [1, 2, 3, 40, 41].forEach(plan);
  expect(live.journal.entries).toMatchObject([{ t_s: 7, kind: "alarm", text: "no new plan" }, { t_s: 40, kind: "alarm over", text: "no new plan, after 33\u00a0s" }]);
  const { length } = live.journal.entries;
  take(live, { kind: "paused", at_s: 42 });
  take(live, { kind: "ran", at_s: 90 });
  [91, 92].forEach(plan);
  expect(live.journal.entries.slice(length).map(({ kind }) => kind)).toEqual(["paused", "ran"]);
});

test("a declared path, however long, is not in the first fit of the map, and is in that of everything", () => {
  const track = { north: [0, 10], east: [0, 20], t: [0, 1], length: 2 };
  const picture = { tracks: [{ track, from: 0, to: 2 }], lines: [{ points: [[0, 0], [900, 0]], style: "wide" }], discs: [], vehicles: [] };
  expect(pictureBounds(picture, false)).toEqual({ south: 0, northern: 10, west: 0, eastern: 20 });
  expect(pictureBounds(picture).northern).toBe(900);
});

test("maps beside each other are fitted to all of their runs", () => {
  const nowhere = { tracks: [], lines: [], discs: [], ellipses: [], marks: [], arrows: [], vehicles: [], current: null, origin: null, label: "" };
  const [here, there] = [[0, 0], [300, -40]].map(([north, east]) => ({ ...nowhere, vehicles: [{ kind: "craft", north, east, heading: 0, colour: "hull" }] }));
  const bounds = pictureBounds({ ...here, beside: [there] });
  expect(bounds).toEqual({ south: 0, northern: 300, west: -40, eastern: 0 });
  expect(pictureBounds({ ...there, beside: [here] })).toEqual(bounds);
});

test("headings around north are one line in the middle of their chart, and so are those around south", () => {
  const shown = (degrees) => {
    const live = recording();
    degrees.forEach((heading, t) => take(live, { kind: "reported", at_s: t, heard: { asc: [{ t_s: t, state: { north_m: 0, east_m: 0, heading_rad: heading * Math.PI / 180, speed_mps: 1 } }] } }));
    const { wrap, curves } = chartsOf([{ name: "", colour: "plan", recording: live }]).find(({ id }) => id === "heading");
    return [wrap, ...Array.from(curves[0].y).slice(0, degrees.length).map(Math.round)];
  };
  expect(shown([350, 10, -5])).toEqual(["north", -10, 10, -5]);
  expect(shown([170, 190, -175])).toEqual(["south", 170, 190, 185]);
});

test("distance, along and across are those of one moment, from the table as from the stream", () => {
  // Reported at 0 s as going north at 1 m/s; two seconds later the planner takes it for 2 m north, and the goal is 3 m ahead and 4 m to starboard.
  const columns = "sequence,kind,t_s,vehicle,north_m,east_m,heading_rad,speed_mps,goal_north_m,goal_east_m,goal_distance_m,method,outcome";
  const fromTable = recording(), streamed = recording();
  fromTable.takeLines([columns, "1,asc_state,0,asc,0,0,0,1,,,,,", "2,planned,1,,,,,,4.8,4,,mpc,ok", "3,planned,2,,,,,,5,4,5,mpc,ok"]);
  reported(streamed, 0, 0, 0);
  for (const [t_s, north, craft] of [[1, 4.8, 1], [2, 5, 2]]) take(streamed, { kind: "planned", t_s, reference: {}, method: "mpc", outcome: "ok", prediction: { goal: [[north, 4]], asc: [[craft, 0]], auvs: [] } });
  for (const { goal } of [fromTable, streamed]) {
    const [distance, along, cross] = ["distance", "along", "cross"].map((name) => goal.at(name, 2));
    expect(distance).toBeCloseTo(5, 9);
    expect(along).toBeCloseTo(-3, 9);
    expect(cross).toBeCloseTo(-4, 9);
  }
});

/** A simulated mission of a craft at `places` (seconds to north, m) whose goal is at 0 m, and from `jump` on at 70 m. */
function handedOver(places, jump, scene = {}) {
  const simulated = recording({ kind: "simulated", scene: { settled_after_s: 10, ...scene } });
  simulated.takeLines(["sequence,kind,t_s,vehicle,north_m,east_m,goal_north_m,goal_east_m,goal_distance_m,energy_j",
    ...places.map((north, t) => `${t},truth,${t},asc,${north},0,${t < jump ? 0 : 70},0,${Math.abs((t < jump ? 0 : 70) - north)},0`)]);
  return simulated;
}

test("a craft left for the next goal when it was last at the former one, and one that waits for the hand-over has not left", () => {
  // At the goal until 100 s, then 1 m/s to the next one, which counts from 130 s on.
  const early = handedOver(Array.from({ length: 200 }, (_, t) => Math.min(Math.max(t - 100, 0), 70)), 130);
  // Half a metre counts as at the goal: it leaves that after half a second of way.
  expect(early.handOvers).toEqual([{ t: 130, off: 40, left: 29 }]);
  const [entry] = early.journal.entries;
  expect(entry).toMatchObject({ t_s: 130, kind: "goal jumps", text: "by 70 m; the craft left 29 s before and is 40 m from it" });
  // It sways by 0.3 m, as waves do.
  const late = handedOver(Array.from({ length: 200 }, (_, t) => (t < 130 ? 0.3 * Math.sin(t) : Math.min(t - 130, 70))), 130);
  expect(late.handOvers).toMatchObject([{ t: 130, left: 0 }]);
  const [sentence] = differences([{ name: "planner", colour: "", recording: early }, { name: "law", colour: "", recording: late }], Infinity);
  expect(sentence).toBe("At the hand-over: planner left 29\u00a0s before and was 40\u00a0m off; law had not left and was 70\u00a0m off.");
});

test("a craft that its goal outruns, or that had not come to it, has not left it", () => {
  // The goal goes north at 0.9 m/s, and from 240 s on it is another one at 350 m north of the craft or east of its way; the craft follows at 0.5 m/s.
  const leftAt = (from, [north, east]) => {
    const simulated = recording({ kind: "simulated" }), rows = Array.from({ length: 241 }, (_, t) => {
      const [craft, goal] = [from + 0.5 * t, t < 240 ? [0.9 * t, 0] : [north, east]];
      return `${t + 1},truth,${t},asc,${craft},0,${goal.join()},${Math.hypot(craft - goal[0], goal[1])}`;
    });
    simulated.takeLines(["sequence,kind,t_s,vehicle,north_m,east_m,goal_north_m,goal_east_m,goal_distance_m", ...rows]);
    return simulated.handOvers.map(({ left }) => left);
  };
  expect(leftAt(0, [470, 0])).toEqual([0]);
  expect(leftAt(0, [120, 350])).toEqual([0]);
  // It begins 20 m behind.
  expect(leftAt(-20, [120, 350])).toEqual([0]);
});

test("runs are told apart by the limits that they broke, the minute in which they differ and the approach", () => {
  const disc = { north_m: 50, east_m: 0, radius_m: 5 }, still = (north) => handedOver(Array.from({ length: 200 }, (_, t) => (t < 10 ? 20 - 2 * t : north(t))), Infinity, { keep_outs: [disc], period_s: 1 });
  const run = (name, north) => ({ name, colour: "", recording: still(north) });
  const near = run("planner", () => 0), far = run("law", (t) => (t >= 100 && t < 110 ? 47 : 0));
  const sentences = differences([near, far], Infinity);
  // 47 m is 2 m within the disc of 5 m about 50 m.
  expect(sentences[0]).toBe("Inside a keep-out: law for 10\u00a0s, by up to 2.0\u00a0m; no other.");
  // 47 m for ten of a minute's 61 rows.
  expect(sentences[1]).toContain(`planner 0.00\u00a0m, law ${(47 * Math.sqrt(10 / 61)).toFixed(2)}\u00a0m`);
  // All of the one's distance is from its approach, of the other's a part.
  expect(sentences.length).toBe(2);
  expect(differences([near, near], Infinity)[0]).toContain("The approach until 00:10 makes 100 to 100\u00a0% of the squared distances");
});

test("each run has as many hand-overs as it had, and an approach that is not over is not judged", () => {
  const run = (name, jumps) => {
    const simulated = recording({ kind: "simulated", scene: { settled_after_s: 300 } }), rows = Array.from({ length: 400 }, (_, t) => {
      const goal = 70 * jumps.filter((jump) => jump <= t).length;
      return `${t + 1},truth,${t},asc,0,0,${goal},0,${goal + 1}`;
    });
    simulated.takeLines(["sequence,kind,t_s,vehicle,north_m,east_m,goal_north_m,goal_east_m,goal_distance_m", ...rows]);
    return { name, colour: "", recording: simulated };
  };
  const runs = [run("planner", [350]), run("law", [350, 360, 370]), run("other", [])];
  expect(differences(runs, Infinity)).toContain("At their hand-overs (medians): planner, 1, had not left and was 71\u00a0m off; law, 3, had not left and was 141\u00a0m off; other had none.");
  expect(differences(runs.toReversed(), Infinity)[0]).toContain("law, 3, had not left");
  expect(differences(runs, 60)).toEqual([]);
  // One metre for 300 s of 350: once the approach is over, its share is said.
  expect(differences(runs, 349)).toEqual(["The approach until 05:00 makes 86 to 86\u00a0% of the squared distances of the whole mission: compare what was kept once settled."]);
});

test("faults are in the log once they have come, and over once they are", () => {
  const simulated = recording({ kind: "simulated", scene: { faults: [{ from_s: 20, what: "auv-1 loses power" }, { from_s: 5, until_s: 15, what: "no GNSS" }] } });
  const planned = (t_s) => simulated.takePlan({ t_s, sequence: t_s, reference: {}, method: "mpc", outcome: "ok", reason: "", solve_ms: 1, late_s: 0, rms_m: 1 });
  planned(10);
  expect(simulated.journal.entries).toEqual([{ t_s: 5, kind: "fault", text: "no GNSS" }]);
  planned(30);
  expect(simulated.journal.entries.map(({ t_s, kind }) => [t_s, kind])).toEqual([[5, "fault"], [15, "fault over"], [20, "fault"]]);
  expect(chartEvents(simulated.journal.entries).at(-1)).toEqual({ t: 20, words: "fault: auv-1 loses power" });
});

test("a plan says what it does otherwise than line of sight, and why", () => {
  const after_s = [0, 10, 20, 30], track = (...norths) => norths.map((north) => [north, 0]);
  const prediction = { after_s, goal: track(0, 0, 70, 70), asc: track(0, 10, 30, 50), line_of_sight: track(0, 0, 0, 20), rms_m: 20, line_of_sight_rms_m: 45, line_of_sight_reference: { heading_rad: 0, speed_mps: 0.2 } };
  expect(explanation(prediction, { heading: Math.PI / 2, speed: 1, method: "mpc" })).toBe("The plan steers 90° more to starboard and 0.80\u00a0m/s faster than line of sight would: within 20\u00a0s the goal is another one, 40\u00a0m from the craft on the plan, 70\u00a0m by line of sight.");
  expect(explanation({ ...prediction, goal: track(0, 0, 0, 0) }, { heading: 0, speed: 0.2, method: "mpc" })).toBe("Plan and line of sight steer the same.");
  expect(explanation({ ...prediction, goal: track(0, 0, 0, 0) }, { heading: -0.1, speed: 0.2, method: "mpc" })).toBe("The plan steers 6° more to port than line of sight would: until 30\u00a0s from now it expects 20.0\u00a0m to the goal (RMS), by line of sight 45.0\u00a0m.");
  // The cost decides, and may be less where the distance is larger.
  const still = { ...prediction, goal: track(0, 0, 0, 0), cost: 10, line_of_sight_cost: 12, rms_m: 9.6, line_of_sight_rms_m: 3.7 };
  expect(explanation(still, { heading: 0, speed: 0.5, method: "previous_plan" })).toBe("The plan steers 0.30\u00a0m/s faster than line of sight would: until 30\u00a0s from now that costs 16.7\u00a0% less than line of sight; it expects 9.6\u00a0m to the goal (RMS), by line of sight 3.7\u00a0m.");
  // A law with other gains is no plan.
  for (const method of ["saturated_los", "hold"]) expect(explanation(still, { heading: 0, speed: 0.5, method })).toBe("");
});

test("AUVs with names of JavaScript, and of members of a goal, are words of their own in what is sent", () => {
  const draft = new OrderDraft(() => {}), ids = ["constructor", "toString", "bearing_rad", "__proto__"];
  draft.became({ goal: { kind: "weighted", weights: Object.fromEntries(ids.slice(0, 1).map((id) => [id, 1])) } });
  expect(ids.map((id) => valueAt(draft.now, ["goal", "weights", id]))).toEqual([1, undefined, undefined, undefined]);
  draft.edit(ids.reduce((now, id) => withValue(now, ["goal", "weights", id], 2), draft.now));
  draft.edit(withValue(draft.now, ["goal", "serve_by_s", "epoch_s"], 0));
  expect(draft.words().slice(1)).toEqual(["Goal, weight of constructor: 2; until now: 1", ...ids.slice(1).map((id) => `Goal, weight of ${id}: 2; until now: not set`), "Goal, serve by, for epoch_s: 00:00:00 UTC; until now: not set"]);
  expect(Object.keys(draft.patch().goal.weights)).toEqual(ids);
});

test("nothing is good while the service does not answer, of a simulated mission neither", () => {
  const plan = { outcome: "ok", method: "mpc", age_s: 0, period_s: 1, waits_for: [], warnings: [] }, mission = { id: "m", title: "", status: "running", t_s: 0, plan };
  const toneOf = (kind, seen) => stateOf({ ...mission, kind, steering: { state: "steering", why: "", age_s: 0 } }, seen).tone;
  for (const kind of ["simulated", "live"]) expect([toneOf(kind, {}), toneOf(kind, { lost: "no answer" })]).toEqual(["good", "warn"]);
});

test("steering with a reservation of whoever steers is not green, and no alarm", () => {
  const plan = { outcome: "ok", method: "mpc", age_s: 0, period_s: 1, waits_for: [], warnings: [] }, why = "the position does not move";
  const state = stateOf({ id: "m", title: "", status: "running", kind: "live", t_s: 0, plan, steering: { state: "steering", why, age_s: 0 } });
  expect(state).toEqual({ words: "steering", why, tone: "warn", alarm: false });
});

test("whoever steers judges the age of the plan, and the page only of a craft that nobody says to steer", () => {
  const plan = { outcome: "ok", method: "mpc", age_s: 9, period_s: 1, waits_for: [], warnings: [] }, mission = { id: "m", title: "", status: "running", kind: "live", t_s: 0, plan };
  const toneOf = (steering) => stateOf({ ...mission, steering: steering && { age_s: 0, why: "", ...steering } }).tone;
  const said = [{ state: "steering" }, { state: "steering", why: "no new plan" }, { state: "degraded" }, { state: "not_steering" }, { state: "steering", age_s: 4 }, undefined];
  expect(said.map(toneOf)).toEqual(["good", "warn", "bad", "bad", "bad", "bad"]);
});

/** A craft that goes north at 2 m/s, and what it knows of the vessels. */
const among = (vessels, avoidance) => ({ after_s: [0, 5], asc: [[0, 0], [10, 0]], goal: [], auvs: [], warnings: [], violations: [], vessels, avoidance });
const vessel = (id, position, velocity, age_s = 0) => ({ id, position, velocity, separation_m: 50, age_s });
const met = (id, acts) => ({ vessel: id, kind: "head_on", acts, cpa_m: 7, tcpa_s: 60, passes_m: 90, separation_m: 50 });

test("vessels are listed from those that the craft acts for, and the others with the nearest point of two straight courses", () => {
  // Both reach (100, 0) after 50 s; one is 40 m abeam on the same course; one passed the craft and goes on; of one no speed is known.
  const listed = vesselsOf(among([vessel("slow", [30, 0]), vessel("gone", [-60, 80], [0, 1]), vessel("beside", [0, 40], [2, 0]), vessel("meets", [100, 200], [0, -4]), vessel("ahead", [900, 0], [-4, 0])], { encounters: [met("ahead", true)], sentence: "" }));
  expect(listed.map(({ id }) => id)).toEqual(["ahead", "slow", "beside", "gone", "meets"]);
  const of = Object.fromEntries(listed.map(({ id, cpa, tcpa, closes }) => [id, [cpa, tcpa, closes]]));
  expect(of).toEqual({ ahead: [7, 60, true], slow: [NaN, 0, false], beside: [40, 0, false], gone: [100, 0, false], meets: [0, 50, true] });
});

test("the map is fitted to vessels that are met or near, and to no others", () => {
  const drawn = (encounters) => {
    const picture = { tracks: [], lines: [], discs: [], marks: [], vehicles: [{ kind: "craft", north: 0, east: 0, heading: 0, colour: "hull" }] };
    addVessels(picture, vesselsOf(among([vessel("near", [90, 0], [0, 1]), vessel("far", [0, 5000], [0, -9])], { encounters, sentence: "" })), 60);
    return pictureBounds(picture);
  };
  expect(drawn([])).toEqual({ south: 0, northern: 90, west: 0, eastern: 0 });
  expect(drawn([met("far", false)]).eastern).toBe(5000);
});

test("nothing is good with a vessel too near, and that is no alarm; a vessel beyond its distance changes nothing", () => {
  const mission = { status: "running", kind: "live", plan: { outcome: "ok", method: "mpc", age_s: 0, period_s: 1, waits_for: [], warnings: [] }, steering: { state: "steering", why: "", age_s: 1 } };
  const live = recording(), plan = (t_s, position, velocity) => take(live, { kind: "planned", t_s, late_s: 0, outcome: "ok", method: "mpc", reference: {}, prediction: among([vessel("MV Example", position, velocity)]) });
  const state = () => stateOf(mission, { traffic: trafficState(live) });
  plan(1, [40, 32], [0, 0]);
  expect(state()).toMatchObject({ words: "steering", why: "", tone: "good" });
  plan(2, [40, 28], [0, 0]);
  expect(state()).toMatchObject({ words: "steering", why: "vessel too near", near: "MV Example 49\u00a0m, closing", tone: "warn", alarm: false });
  plan(3, [-30, 0], [0, 0]);
  expect(state().near).toBe("MV Example 30\u00a0m");
  expect(stateOf(mission, { traffic: trafficState(live), lost: "the service does not answer" }).tone).toBe("warn");
  // An alarm stays one, and a plan that is too old tells no distance.
  expect(stateOf({ ...mission, steering: { state: "not_steering", why: "no heartbeat", age_s: 1 } }, { traffic: trafficState(live) })).toMatchObject({ why: "no heartbeat; vessel too near", tone: "bad", alarm: true });
  expect(stateOf(mission, { traffic: trafficState(live), age_s: 9, said_s: 9 }).near).toBe(undefined);
  // The list of missions knows the warning alone.
  expect(stateOf({ ...mission, plan: { ...mission.plan, warning_codes: ["vessel_too_near"] } })).toMatchObject({ why: "vessel comes too near", tone: "warn", alarm: false });
});

test("a mission that heard vessels is not good when it has heard none for 3 min, at anchor 6 min, even when they are forgotten", () => {
  const heard = (age_s, velocity, after = []) => {
    const live = recording(), plan = (t_s, vessels) => take(live, { kind: "planned", t_s, late_s: 0, outcome: "ok", method: "mpc", reference: {}, prediction: among(vessels) });
    plan(1000, [vessel("a", [900, 0], [1, 0], 2000), vessel("b", [900, 0], velocity, age_s)]);
    for (const t_s of after) plan(t_s, undefined);
    return trafficState(live)?.why;
  };
  const none = "no other vessel heard for 3 min";
  expect([[179, [1, 0]], [181, [1, 0]], [181, undefined], [359, [0, 0]], [361, [0, 0]]].map(([age, velocity]) => heard(age, velocity))).toEqual([undefined, none, none, undefined, none]);
  expect(heard(0, [1, 0], [1179])).toBe(undefined);
  expect(heard(0, [1, 0], [1179, 5000])).toBe(none);
  expect(trafficState(recording())).toBe(undefined);
});

test("a manoeuvre explains the plan, whatever answers", () => {
  const plan = { ...among([]), line_of_sight: [], line_of_sight_reference: { speed_mps: 1, heading_rad: 0 }, rms_m: 1, line_of_sight_rms_m: 1 };
  const avoidance = { encounters: [], manoeuvre: { heading_rad: 1, speed_mps: 1, until_s: 9 }, sentence: "giving way to MV Example: turns 40° to starboard, passes 90 m astern" };
  for (const method of ["mpc", "saturated_los"]) expect(explanation({ ...plan, avoidance }, { heading: 1, speed: 1, method })).toBe("Giving way to MV Example: turns 40° to starboard, passes 90 m astern.");
  expect(explanation({ ...plan, avoidance: { ...avoidance, manoeuvre: undefined } }, { heading: 0, speed: 1, method: "mpc" })).toMatch(/^Plan and line of sight steer the same/);
});

const one = (id, { age_s = 0.5, said_s = 0.5, away, state = "steering", said = "", warning_codes = [], auvs = [] } = {}) => ({
  id, auvs, away, plan: { outcome: "ok", method: "mpc", age_s, period_s: 1, waits_for: [], warnings: [], warning_codes }, steering: { state, why: said, age_s: said_s },
});
const fleetOf = (...surface_craft) => ({ id: "m", title: "", kind: "live", status: "running", t_s: 0, plan: surface_craft[0].plan, steering: surface_craft[0].steering, surface_craft });

test("a fleet is as its worst craft, by name, and good only if all are", () => {
  const well = [one("a"), one("b"), one("c")], state = (...craft) => stateOf(fleetOf(...craft));
  expect(state(...well)).toMatchObject({ words: "steering", tone: "good", alarm: false });
  for (let i = 0; i < 3; i += 1) {
    const worst = (how) => state(...well.with(i, one(well[i].id, how)));
    expect(worst({ away: "silent", age_s: 40, said_s: 40 })).toMatchObject({ words: `${well[i].id}: silent`, why: "no report for 10 s", tone: "bad", alarm: true });
    // Whoever steers it may be heard, and know why.
    expect(worst({ away: "silent", age_s: 40, state: "not_steering", said: "the position stays the same" })).toMatchObject({ words: `${well[i].id}: silent`, why: "no report for 10 s; not steering: the position stays the same" });
    // The last word of who steers it is too old before the service says that it is silent.
    expect(worst({ said_s: 5 })).toMatchObject({ words: `${well[i].id}: steering not known`, tone: "bad", alarm: true });
    expect(worst({ state: "not_steering", away: "not_steering" })).toMatchObject({ words: `${well[i].id}: not steering`, alarm: true });
    expect(worst({ warning_codes: ["craft_does_not_follow"], away: "does_not_follow" })).toMatchObject({ words: `${well[i].id}: the craft does not follow`, alarm: true });
    expect(worst({ state: "person", away: "person" })).toMatchObject({ words: `${well[i].id}: a person has the craft`, tone: "warn", alarm: false });
    expect(worst({ away: "returning" })).toMatchObject({ words: `${well[i].id}: returning`, tone: "warn", alarm: false });
  }
  const silent = one("a", { away: "silent", age_s: 40, said_s: 40 });
  expect(state(silent, one("b", { said_s: 9 }), one("c"))).toMatchObject({ words: "a: silent; b: steering not known", alarm: true, age_s: undefined });
  // One that an order has stood down is no alarm, and no good news.
  expect(stateOf({ ...fleetOf(silent, ...well.slice(1)), setting: { surface_craft: [{ id: "a", serves: [] }] } })).toMatchObject({ words: "a, stood down: silent", tone: "warn", alarm: false });
  // Without an answer of the service nothing is known of any; a list knows how long ago it had one.
  expect(stateOf(fleetOf(...well), { age_s: 9, said_s: 9, lost: "the service does not answer" })).toMatchObject({ words: "all craft: steering not known", why: "the service does not answer", alarm: true, age_s: 9 });
  // A craft that was never heard may be on its way.
  expect(state({ id: "a", auvs: [], away: "silent" }, ...well.slice(1))).toMatchObject({ words: "a: steering not known", tone: "warn", alarm: false });
});

test("what of who serves whom is new is told in words, with why", () => {
  const of = (craft, away = {}, unserved = []) => ({ t_s: 0, craft: new Map(Object.entries(craft)), away: new Map(Object.entries(away)), unserved }), before = of({ a: ["1", "2"], b: ["3"] });
  expect(assignedWords(undefined, before)).toBe("a serves 1, 2; b serves 3");
  expect(assignedWords(before, of({ b: ["3", "1", "2"] }, { a: "silent" }))).toBe("a is silent: b serves 1, 2 now");
  expect(assignedWords(of({ b: ["3"] }, { a: "silent" }), of({ a: [], b: ["3"] }, { a: "returning" }))).toBe("a is well again");
  expect(assignedWords(of({ a: [], b: ["1", "3"] }, { a: "returning" }), of({ a: ["1"], b: ["3"] }))).toBe("a can serve again: a serves 1 now");
  expect(assignedWords(undefined, of({ b: ["3"] }, {}, ["1"]))).toBe("b serves 3; nobody serves 1");
  expect(assignedWords(before, of({ b: ["3"] }))).toBe("a is not in the fleet any more: nobody serves 1, 2 now");
});

test("each craft of a fleet has its own track, plans and log, and they share the AUVs, from a table and from events", () => {
  const made = () => new FleetRecording({ id: "m", title: "", kind: "live", status: "running", t_s: 0, scene: { auvs: ["1", "2"], surface_craft: ["a", "b"] } });
  const place = (north_m) => ({ north_m, east_m: 0, heading_rad: 0, speed_mps: 1 });
  const prediction = (north, auv) => ({ after_s: [0, 1], asc: [[north, 0], [north + 1, 0]], goal: [[north + 5, 0]], line_of_sight: [], auvs: [{ id: auv, positions: [[north + 5, 1]], depths_m: [9], covariances_m2: [], age_s: 1, drift: [0, 0] }], rms_m: 1, vessels: [{ id: "b", position: [0, 0], age_s: 0 }, { id: "ship", position: [0, 0], age_s: 0 }] });
  const planned = (craft, north, auv) => ({ kind: "planned", craft, t_s: 11, late_s: 0, solve_time_ns: 1e6, outcome: "ok", method: "mpc", reference: { speed_mps: 1, heading_rad: 0 }, prediction: prediction(north, auv) });
  const streamed = made(), events = [
    { kind: "reported", at_s: 10, heard: { craft: "a", asc: [{ t_s: 10, state: place(1) }] } }, { kind: "reported", at_s: 10, heard: { craft: "b", asc: [{ t_s: 10, state: place(100) }], auvs: { 1: [{ t_s: 9, north_m: 6, east_m: 1, sigma_m: 1 }] } } },
    planned("a", 2, "1"), planned("b", 101, "2"), { kind: "assigned", t_s: 11, assignment: { craft: [{ id: "a", auvs: ["1"] }, { id: "b", auvs: ["2"] }] } }, { kind: "changed", at_s: 12, setting: { keep_outs: [{ north_m: 100, east_m: 0, radius_m: 5 }] } },
    { kind: "reported", at_s: 13, heard: { craft: "b", asc: [{ t_s: 13, state: place(102) }] } }, { kind: "assigned", t_s: 14, assignment: { craft: [{ id: "a", auvs: ["1", "2"] }], unserved: ["3"] }, away: { b: "silent" } },
  ];
  events.forEach((event, i) => streamed.takeEvent(i + 1, event, same));
  const loaded = made();
  loaded.takeLines([
    "sequence,kind,t_s,vehicle,north_m,east_m,depth_m,heading_rad,speed_mps,sway_mps,sigma_m,age_s,reference_speed_mps,reference_heading_rad,method,outcome,reason,solve_ms,late_s,predicted_rms_m,goal_north_m,goal_east_m,goal_distance_m",
    "1,asc_state,10,a,1,0,,0,1,,,,,,,,,,,,,,", "2,asc_state,10,b,100,0,,0,1,,,,,,,,,,,,,,", "2,fix,9,1,6,1,,,,,1,,,,,,,,,,,,",
    "3,planned,11,a,,,,,,,,,1,0,mpc,ok,,1,0,1,7,0,5", "3,estimated,11,1,7,1,9,,,,,1,,,,,,,,,,,", "4,planned,11,b,,,,,,,,,1,0,mpc,ok,,1,0,1,106,0,5", "4,estimated,11,2,106,1,9,,,,,1,,,,,,,,,,,",
    "5,assigned,11,1,,,,,,,,,,,,,a,,,,,,", "6,changed,12,,,,,,,,,,,,,,,,,,,,", "7,asc_state,13,b,102,0,,0,1,,,,,,,,,,,,,,",
  ]);
  for (const event of [events[4], events[5], events[7]]) loaded.takePast(event, same);
  for (const fleet of [streamed, loaded]) {
    const [a, b] = fleet.parts.values();
    expect([a.craft.length, b.craft.length, a.plans.length, b.plans.length, fleet.plans.length]).toEqual([1, 2, 1, 1, 1]);
    expect([a.craft.at("north", 12), b.craft.at("north", 12), b.craft.at("north", 13)]).toEqual([1, 100, 102]);
    expect([a.goal.at("north", 12), b.goal.at("north", 12)]).toEqual([7, 106]);
    for (const part of [a, b]) expect([part.places.get("1").at("north", 12), part.places.get("2").at("north", 12), part.fixes.get("1").length]).toEqual([7, 106, 1]);
    expect(fleet.plans.column("sequence")[0]).toBe(3);
    expect([12, 14].map((t) => fleet.serverOf("2", t))).toEqual(["b", "a"]);
    expect(fleet.journal.entries.filter(({ kind }) => kind === "assigned").map(({ text }) => text)).toEqual(["a serves 1; b serves 2", "b is silent: a serves 2 now; nobody serves 3 now"]);
    expect([fleet.assignedAt(11).unserved, fleet.assignedAt(14).unserved]).toEqual([[], ["3"]]);
    expect(chartEvents(fleet.journal.entries).map(({ words }) => words)).toContain("assigned: b is silent: a serves 2 now; nobody serves 3 now");
    // A disc counts for each craft from when it was put there.
    expect([a, b].map(({ limits }) => limits.brokenUntil(20).length)).toEqual([0, 1]);
  }
  // A craft that serves nobody has a plan, which is a stop, and no goal.
  streamed.takeEvent(20, { ...planned("b", 103, "2"), t_s: 15, prediction: { ...prediction(103, "2"), auvs: [] } }, same);
  loaded.takeLines(["20,planned,15,b,,,,,,,,,0,0,hold,ok,,1,0,1,106,0,5"]);
  for (const fleet of [streamed, loaded]) expect([fleet.parts.get("b").plans.length, fleet.parts.get("b").goal.length]).toEqual([2, 1]);
  const [a, b] = streamed.parts.values(), none = { fixes: false, goal: true, bounds: true, forecasts: true, traffic: true };
  // Another craft of the fleet is no other vessel.
  expect(a.predictionAt(11).prediction.vessels.map(({ id }) => id)).toEqual(["ship"]);
  const runs = [["a", "craft-1", a], ["b", "craft-2", b]].map(([name, colour, part]) => ({ name, colour, recording: part }));
  const pictureOf = (t) => pictureAt(runs, t, none, { lines: [], marks: [] }, { colourOf: (auv, at) => runs.find(({ name }) => name === streamed.serverOf(auv, at))?.colour ?? "soft" });
  const coloursAt = (t) => Object.fromEntries(pictureOf(t).vehicles.map(({ name, colour }) => [name, colour]));
  expect(coloursAt(13)).toMatchObject({ a: "craft-1", b: "craft-2", 1: "craft-1", 2: "craft-2" });
  expect(coloursAt(14)).toMatchObject({ a: "craft-1", b: "craft-2", 1: "craft-1", 2: "craft-1" });
  expect(pictureOf(13).lines.filter(({ name }) => name === "plan").map(({ colour }) => colour)).toEqual(["craft-1", "craft-2"]);
});

test("a craft of a fleet that is stood down has its whole list sent, and is taken back", () => {
  const draft = new OrderDraft(() => {}), craft = [{ id: "a", limits: { speed_max_mps: 2, speed_min_mps: null } }, { id: "b", serves: ["1"] }];
  draft.settle({ goal: { kind: "track", auv: "1" }, surface_craft: craft });
  expect(draft.edited).toEqual([]);
  draft.edit({ surface_craft: withValue(draft.now, ["surface_craft", 1, "serves"], []).surface_craft });
  expect(draft.words()).toEqual(["b stands down: it serves nobody"]);
  expect(draft.patch()).toEqual({ surface_craft: [{ id: "a", limits: { speed_max_mps: 2 } }, { id: "b", serves: [] }] });
  draft.edit({ surface_craft: withValue(draft.now, ["surface_craft", 1, "serves"], ["1"]).surface_craft });
  expect(draft.edited).toEqual([]);
  draft.edit({ surface_craft: withValue(draft.now, ["surface_craft", 1, "serves"], undefined).surface_craft });
  expect(draft.words()).toEqual(["b may serve every AUV"]);
});
