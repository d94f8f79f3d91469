// Records anew, from live missions of the real service, what the tests of the page play (`recorded.mjs`): `.ci/page-test --record`, 75 s on a machine
// that has nothing else to do; `node record.mjs NAME` records one alone. Whether the service still answers so, `recordings.spec.mjs` says.

import { mkdir, writeFile } from "node:fs/promises";
import { fleetMission, liveMission, startService } from "./service.mjs";

/** Of the history, the table has the rows of so many last events, and of schedules of a fleet there are so many visits. */
const ROWS_OF = 6, ROWS_OF_FLEET = 30, VISITS_OF_FLEET = 5;
const TITLE = "recorded";

/** Each mission: how it is made, until when it goes on before the page opens it, and what is recorded of it. */
const MISSIONS = {
  // Steered; then reports cease until one comes, and it ends.
  steered: {
    how: {}, opened: planned(3), async then({ service, mission, path, wait }) {
      await wait(planned(12));
      await mission.stop();
      await wait(silent(45));
      const state = { north_m: 0, east_m: 0, heading_rad: 0, speed_mps: 0, sway_mps: 0, yaw_rate_radps: 0 };
      await service.post(`${path}/reports`, { asc: [{ t_s: Date.now() / 1000, state }], steering: [{ t_s: Date.now() / 1000, state: "steering" }] });
      await wait(planned(2));
      await service.post(`${path}/finish`, {});
    },
  },
  // A person takes the craft, gives it back, and takes the telemetry away: plans go on.
  handed: {
    how: {}, opened: planned(3), async then({ mission, wait }) {
      await wait(planned(2));
      mission.say({ state: "person", why: "the autopilot left its guided mode" });
      await wait(planned(4));
      mission.say({ state: "not_steering", why: "no heartbeat of the autopilot" });
      await wait(planned(4));
      mission.say({ state: "steering" });
      await wait(planned(3));
      mission.say(null);
      await wait(planned(6));
    },
  },
  // Its goal is changed by the page, and it is paused by another client.
  ordered: {
    how: {}, opened: planned(3), async then({ service, path, wait, order }) {
      await wait(planned(3));
      await order({ goal: { kind: "track", auv: "auv-2" } });
      await wait(planned(2));
      await service.post(`${path}/pause`, {});
    },
  },
  // The goal is too old to plan with.
  degraded: { how: { fixAge: 1000 }, opened: planned(2), then: ({ wait }) => wait(planned(3)) },
  // The craft does not do what is asked.
  stuck: { how: { stuck: true }, opened: ({ mission }) => mission.plan?.warning_codes.some((code) => /does_not_(follow|respond)/.test(code)), then: ({ wait }) => wait(planned(2)) },
  // A ship crosses from starboard, a tender keeps too near, and one that was last heard 150 s ago may be elsewhere.
  traffic: {
    how: {
      traffic: (after, t_s) => [
        { id: "244123456", name: "MV Example", t_s, north_m: 5, east_m: 500 - 4 * after, course_rad: -Math.PI / 2, speed_mps: 4, length_m: 90 },
        { id: "tender", t_s, north_m: -45 + 0.3 * after, east_m: -10, course_rad: 0, speed_mps: 0.3, length_m: 8 },
        { id: "244000001", name: "Ferry", t_s: t_s - after - 150, north_m: 2000, east_m: -3000, course_rad: 0, speed_mps: 6 },
      ],
    },
    opened: planned(4), then: ({ wait }) => wait(planned(6)),
  },
  // The page pins the next visit, and releases it.
  visits: {
    how: { ids: ["auv-1", "auv-2", "auv-3"], goal: { kind: "visit", auvs: ["auv-1", "auv-2", "auv-3"] } }, opened: planned(4), async then({ wait, order }) {
      const goal = (await wait(planned(1))).setting.goal;
      await order({ goal: { ...goal, next: "auv-3" } });
      await wait(planned(2));
      await order({ goal });
      await wait(planned(2));
    },
  },
  // Of three craft one is silent, which is then out of the fleet; the page stands another one down.
  fleet: {
    make: fleetMission, how: { ids: ["auv-1", "auv-2", "auv-3", "auv-4"], period_s: 2 }, opened: ({ events }) => planned(12)({ events, from: 0 }), async then({ mission, wait, order }) {
      await wait(planned(3));
      mission.say("asc-2", null);
      await wait(({ mission: { surface_craft: craft } }) => craft[1].away === "silent" && !craft[1].auvs.length);
      const { setting } = await wait(planned(4));
      await order({ surface_craft: setting.surface_craft.map((craft) => (craft.id === "asc-3" ? { ...craft, serves: [] } : craft)) });
      await wait(planned(4));
    },
  },
};

/** So many plans were made since the wait began. */
function planned(n) {
  return ({ events, from }) => events.slice(from).filter(({ event }) => event === "planned").length >= n;
}

/** No plan was made for so long. */
function silent(seconds) {
  return ({ mission }) => mission.plan.age_s > seconds;
}

/** An event of a fleet without the end of its schedule. */
function shortened(event) {
  if (event.data.craft) event.data.prediction?.schedule?.visits.splice(VISITS_OF_FLEET);
  return event;
}

/** Calls `take` with each event of a mission's stream. */
async function follow(url, path, take, signal) {
  const answer = await fetch(`${url}${path}/events?after=0`, { signal });
  let rest = "";
  for await (const text of answer.body.pipeThrough(new TextDecoderStream())) {
    const parts = (rest + text).split("\n\n");
    rest = parts.pop();
    for (const part of parts) {
      const fields = Object.fromEntries(part.split("\n").map((line) => [line.slice(0, line.indexOf(":")), line.slice(line.indexOf(":") + 1).trimStart()]));
      if (fields.data) take(shortened({ id: Number(fields.id), event: fields.event, data: JSON.parse(fields.data) }));
    }
  }
}

/** The members of `now` that differ from those of `before`. */
function difference(before, now) {
  if (Object.keys(before).some((key) => !(key in now)) || Object.keys(before.plan ?? {}).some((key) => !(key in (now.plan ?? {})))) throw new Error("a member of the mission's answer is gone: the recording has no form for that");
  const differing = (a, b) => Object.fromEntries(Object.entries(b).filter(([key, value]) => JSON.stringify(a[key]) !== JSON.stringify(value)));
  const { plan, ...others } = differing(before, now);
  return { ...others, ...plan && { plan: differing(before.plan ?? {}, plan) } };
}

async function record(service, { make = liveMission, how, opened, then }) {
  const mission = await make(service, { title: TITLE, ...how }), path = `/v1/missions/${mission.id}`;
  const events = [], frames = [], stop = new AbortController();
  let began = NaN, last = await service.get(path), scene;
  const at = () => Math.round(1000 * (Date.now() / 1000 - began)) / 1000;
  const followed = follow(service.url, path, (event) => {
    events.push(event);
    if (began) frames.push({ at: at(), ...event });
  }, stop.signal).catch((error) => { if (!stop.signal.aborted) throw error; });
  const look = async () => {
    const now = await service.get(path), seen = await service.get(`${path}/scene`);
    if (began) frames.push({ at: at(), mission: difference(last, now) });
    if (began && JSON.stringify(seen) !== JSON.stringify(scene)) frames.push({ at: at(), scene: seen });
    [last, scene] = [now, seen];
    return now;
  };
  /** Looks at the mission once a second until `isSo`. */
  const wait = async (isSo) => {
    const from = events.length;
    while (!isSo({ events, from, mission: await look() })) await new Promise((resume) => setTimeout(resume, 1000));
    return last;
  };
  const order = async (body) => {
    const answer = await service.patch(path, body);
    frames.push({ at: at(), order: { method: "PATCH", path: "", body }, answer });
    last = answer;
  };
  try {
    await wait(opened);
    const csv = await (await fetch(`${service.url}${path}/record?format=csv`)).text(), craft = scene.surface_craft;
    const references = craft && Object.fromEntries(await Promise.all(craft.map(async (name) => [name, await service.get(`${path}/reference?craft=${name}`)])));
    const opening = { mission: await look(), scene, ...craft ? { references } : { reference: await service.get(`${path}/reference`) }, csv, events: [] }, rows_of = craft ? ROWS_OF_FLEET : ROWS_OF;
    began = Date.now() / 1000;
    const [head, ...rows] = csv.split("\n"), sequence = Number(rows.at(-2).split(",")[0]);
    opening.csv = [head, ...rows.filter((row) => !row || Number(row.split(",")[0]) > sequence - rows_of)].join("\n");
    opening.events = events.filter(({ id, event }) => id > sequence - rows_of || event === "assigned");
    await service.post(`${path}/reports`, { notes: [{ t_s: Date.now() / 1000, text: "a note" }] });
    await then({ service, mission, path, wait, order });
    await look();
    return { opening, frames };
  } finally {
    await mission.stop();
    stop.abort();
    await followed;
  }
}

const service = await startService();
try {
  await mkdir(new URL("recordings/", import.meta.url), { recursive: true });
  await Promise.all(Object.entries(MISSIONS).filter(([name]) => [undefined, name].includes(process.argv[2])).map(async ([name, how]) => {
    const { opening, frames } = await record(service, how);
    await writeFile(new URL(`recordings/${name}.ndjson`, import.meta.url), [opening, ...frames].map((line) => `${JSON.stringify(line)}\n`).join(""));
  }));
} finally {
  await service.stop();
}
