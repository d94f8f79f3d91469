// Starts the service as the README says, and posts to it like a client.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

export const PROGRAM = process.env.PILOTFISH ?? new URL("../../target/debug/pilotfish", import.meta.url).pathname;

/** Ticks of one step: so few that a busy machine makes them in the ten seconds that the service gives an answer. */
const STEP = 5;
/** How fast a craft turns and gathers way. */
const TURN_RADPS = 0.2, ACCELERATION_MPS2 = 0.06;
const KEEP_OUTS = [{ north_m: 60, east_m: 12, radius_m: 8 }], CRAFT = { north_m: -15, east_m: 10, heading_rad: 0, speed_mps: 0.2, sway_mps: 0, yaw_rate_radps: 0 };

const within = (value, most) => Math.min(Math.max(value, -most), most);

/** A service on a free port of this machine, in a directory of its own unless `data` says which. */
export async function startService({ data, port = 0, token } = {}) {
  const directory = data ?? await mkdtemp(join(tmpdir(), "pilotfish-page-"));
  // No setting of the machine that the tests run on counts.
  const env = Object.fromEntries(Object.entries(process.env).filter(([name]) => !name.startsWith("PILOTFISH_")));
  // With a deadline that no machine misses: an answer in time is no matter of the page.
  const child = spawn(PROGRAM, ["serve", "--port", String(port), "--data", directory, "--log", "warn", "--deadline-ms", "60000"], { env, stdio: ["ignore", "pipe", "inherit"] });
  const [greeting] = await Promise.race([once(createInterface({ input: child.stdout }), "line"), once(child, "exit").then(() => { throw new Error("the service did not start"); })]);
  const url = /http:\/\/[^ ]*[0-9]/.exec(greeting)[0];
  const headers = { "content-type": "application/json", ...(token && { authorization: `Bearer ${token}` }) };
  const call = async (method, path, body) => {
    const answer = await fetch(`${url}${path}`, { method, headers, body: body === undefined ? undefined : JSON.stringify(body) });
    if (!answer.ok) throw new Error(`${method} ${path}: ${answer.status} ${await answer.text()}`);
    return answer.status === 204 ? undefined : answer.json();
  };
  return {
    url, data: directory, pid: child.pid, port: Number(new URL(url).port),
    post: (path, body) => call("POST", path, body),
    patch: (path, body) => call("PATCH", path, body),
    get: (path) => call("GET", path),
    /** The newest plan of a mission: its first, as soon as it is there. */
    plan: async (mission) => (await call("GET", `/v1/missions/${mission}/reference?wait_s=20&after=0`)).plan,
    /** The events of a mission, once it is over. */
    ended: async (mission) => (await fetch(`${url}/v1/missions/${mission}/events?after=0`, { headers })).text(),
    delete: (path) => call("DELETE", path),
    async kill() {
      child.kill("SIGKILL");
      if (child.exitCode === null && child.signalCode === null) await once(child, "exit");
    },
    async stop() {
      await this.kill();
      if (!data) await rm(directory, { recursive: true, force: true });
    },
  };
}

/** A simulated mission that was flown for `ticks`, or to its end, and is over. */
export async function flown(service, simulated, title, ticks) {
  const { id } = await service.post("/v1/missions", { schema_version: "1.0", title, simulated });
  if (ticks) {
    await stepped(service, id, ticks);
    await service.post(`/v1/missions/${id}/finish`, {});
  } else await service.post(`/v1/missions/${id}/run`, {});
  await service.ended(id);
  if ((await service.get(`/v1/missions/${id}`)).status !== "finished") throw new Error(`${id} failed`);
  return id;
}

/** Flies a simulated mission on for `ticks`. */
export async function stepped(service, id, ticks) {
  for (let left = ticks; left > 0; left -= STEP) await service.post(`/v1/missions/${id}/step`, { ticks: Math.min(left, STEP) });
}

/** A built-in scenario in which everything comes ten times as early. */
export async function hastened(name) {
  const text = await readFile(new URL(`../../sim/scenarios/${name}.toml`, import.meta.url), "utf8");
  return { scenario_file: text.replace(/^(duration_s|settled_after_s|from_s|until_s) = (\d+)$/gm, (_, key, seconds) => `${key} = ${seconds / 10}`) };
}

/** A live mission that is not run: what was reported is all that it has, and no time passes in it. */
export async function posed(service, { ids = ["auv-1", "auv-2"], title = "posed", origin, no_go } = {}) {
  const live = { auvs: ids.map((id) => ({ id })), goal: { kind: "track", auv: ids[0] }, keep_outs: KEEP_OUTS, origin, no_go };
  const { id, created_s } = await service.post("/v1/missions", { schema_version: "1.0", title, live }), t_s = created_s - 1;
  const auvs = Object.fromEntries(ids.map((name, i) => [name, [{ t_s, north_m: 0, east_m: 25 * i, depth_m: 8, sigma_m: 1 }]]));
  await service.post(`/v1/missions/${id}/reports`, { auvs, asc: [{ t_s, state: CRAFT }] });
  return id;
}

/** A craft turns and gathers way as its reference says, if it has one, and goes on for `step` seconds. */
function sail(craft, reference, step) {
  if (reference) {
    const { heading_rad, speed_mps } = reference, turn = Math.atan2(Math.sin(heading_rad - craft.heading_rad), Math.cos(heading_rad - craft.heading_rad));
    const heading = craft.heading_rad + within(turn, TURN_RADPS * step);
    craft.heading_rad = Math.atan2(Math.sin(heading), Math.cos(heading));
    craft.speed_mps += within(speed_mps - craft.speed_mps, ACCELERATION_MPS2 * step);
  }
  craft.north_m += step * craft.speed_mps * Math.cos(craft.heading_rad);
  craft.east_m += step * craft.speed_mps * Math.sin(craft.heading_rad);
}

/**
 * A live mission of `ids`, whose AUVs go north beside each other, and a craft that does what its references say, reported once a second of the mission's
 * clock. A fix in ten is far off. Fixes are `fixAge` seconds old; a `stuck` craft does not move. It says with each report that it is steered, or what it is to
 * `say`, and what `traffic` is after so many seconds, at the moment that is passed to it.
 */
export async function liveMission(service, { ids = ["auv-1", "auv-2"], clockRate = 1, title = "a live mission", origin, goal, fixAge = 0, stuck = false, no_go, traffic = () => [] } = {}) {
  const live = { auvs: ids.map((id) => ({ id })), goal: goal ?? { kind: "track", auv: ids[0] }, clock_rate: clockRate, keep_outs: KEEP_OUTS, origin, no_go };
  const { id, created_s } = await service.post("/v1/missions", { schema_version: "1.0", title, live });
  await service.post(`/v1/missions/${id}/run`, {});
  const clock = () => created_s + clockRate * (Date.now() / 1000 - created_s);
  const start = clock();
  let craft = { ...CRAFT }, last = start, n = 0, stopped = false, word = { state: "steering" };
  const tick = async () => {
    const t_s = clock() - 0.05 * clockRate, step = Math.min(t_s - last, 5);
    last = t_s;
    const current = await service.get(`/v1/missions/${id}/reference`).catch(() => null);
    sail(craft, stuck ? null : current?.plan.reference, step);
    n += 1;
    const auvs = Object.fromEntries(ids.map((name, i) => {
      const north_m = 0.2 * (t_s - start) + Math.sin(n * 1.7 + i), east_m = 25 * i + Math.cos(n * 2.3 + i) + (n % 10 === 9 && i === 0 ? 60 : 0);
      return [name, [{ t_s: t_s - fixAge, north_m, east_m, depth_m: 8 + 6 * Math.sin((t_s - start) / 40 + i), sigma_m: 1 }]];
    }));
    await service.post(`/v1/missions/${id}/reports`, { auvs, asc: [{ t_s, state: craft }], traffic: traffic(t_s - start, t_s), ...word && { steering: [{ t_s: clock(), ...word }] } });
  };
  const run = (async () => {
    while (!stopped) {
      await tick().catch(() => {});
      await new Promise((resume) => setTimeout(resume, Math.max(1000 / clockRate, 20)));
    }
  })();
  return { id, say: (now) => { word = now; }, stop: () => { stopped = true; return run; } };
}

/**
 * A live mission of several craft that share AUVs, which go to and fro on lanes beside each other; its goal visits them unless `goal` says another. Each craft does
 * what its references say, and says that it is steered, or what it is to `say`; of one that is told to say `null` nothing is heard.
 */
export async function fleetMission(service, { craft = ["asc-1", "asc-2", "asc-3"], ids = Array.from({ length: 6 }, (_, i) => `auv-${i + 1}`), goal, clockRate = 1, period_s = 1, title = "a fleet" } = {}) {
  const live = {
    auvs: ids.map((id) => ({ id })), surface_craft: craft.map((id, i) => ({ id, limits: { speed_max_mps: 1.5 + 0.1 * i } })), goal: { kind: "visit", auvs: ids, ...goal },
    clock_rate: clockRate, period_s, keep_outs: KEEP_OUTS, vessel_separation_m: 10,
  };
  const { id, created_s } = await service.post("/v1/missions", { schema_version: "1.0", title, live }), path = `/v1/missions/${id}`;
  await service.post(`${path}/run`, {});
  const clock = () => created_s + clockRate * (Date.now() / 1000 - created_s), words = new Map(craft.map((name) => [name, { state: "steering" }]));
  const craftAt = new Map(craft.map((name, i) => [name, { ...CRAFT, north_m: 80 * i - 120, east_m: -40 * i }]));
  let last = clock(), stopped = false;
  const start = last, tick = async () => {
    const t_s = clock() - 0.05 * clockRate, step = Math.min(t_s - last, 5), after = t_s - start;
    last = t_s;
    const auvs = Object.fromEntries(ids.map((name, i) => [name, [{ t_s, north_m: 65 * (i - ids.length / 2) + 15 * Math.sin(after / 200 + i), east_m: 150 * Math.sin(after / 250 + 1.3 * i), depth_m: 8 + (i % 3), sigma_m: 1 }]]));
    await Promise.all([service.post(`${path}/reports`, { auvs }), ...Array.from(craftAt, async ([name, state]) => {
      const word = words.get(name), given = await service.get(`${path}/reference?craft=${name}`).catch(() => null);
      sail(state, word?.state === "steering" ? given?.plan.reference : null, step);
      if (word) await service.post(`${path}/reports`, { craft: name, asc: [{ t_s, state }], steering: [{ t_s: clock(), ...word }] });
    })]);
  };
  const run = (async () => {
    while (!stopped) {
      await tick().catch(() => {});
      await new Promise((resume) => setTimeout(resume, Math.max(1000 / clockRate, 50)));
    }
  })();
  return { id, say: (name, now) => words.set(name, now), stop: () => { stopped = true; return run; } };
}
