// What the page takes, and what browsers cost the planner: `node measure.mjs four-hours` and `node measure.mjs browsers`, for docs/page.md.
// No test: a quarter of an hour, and figures of the machine it is on, of the program that PILOTFISH names: target/release/pilotfish.

import { readFile } from "node:fs/promises";
import { chromium } from "@playwright/test";
import config from "./playwright.config.mjs";
import { liveMission, startService } from "./service.mjs";

const AUVS = ["auv-1", "auv-2", "auv-3"];
/** Four hours of plans, one a second of the mission's clock, which goes so many times as fast as the wall's. */
const PLANS = Number(process.env.PLANS ?? 14_400), CLOCK_RATE = 20;
const MISSIONS = 5, BROWSERS = 20, WATCHED_S = 60;
const FRAMES_S = 20;

const sleep = (ms) => new Promise((resume) => setTimeout(resume, ms));
const quantile = (sorted, q) => sorted[Math.min(Math.floor(q * sorted.length), sorted.length - 1)];
const spread = (values) => {
  const sorted = [...values].sort((a, b) => a - b);
  return `median ${quantile(sorted, 0.5).toFixed(2)}, 99 % ${quantile(sorted, 0.99).toFixed(2)}, largest ${sorted.at(-1).toFixed(2)}`;
};

async function open(browser, service, id) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  let bytes = 0;
  const network = await page.context().newCDPSession(page);
  await network.send("Network.enable");
  network.on("Network.dataReceived", ({ dataLength }) => { bytes += dataLength; });
  page.on("pageerror", (error) => console.log(`uncaught: ${error}`));
  const began = performance.now();
  await page.goto(`${service.url}/#/mission/${id}`);
  const drawn = () => {
    const canvas = document.querySelector(".map-place canvas");
    if (!canvas?.width) return false;
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(new Uint32Array(data.buffer)).size > 8;
  };
  await page.waitForFunction(drawn, undefined, { polling: 20 });
  const first_ms = performance.now() - began;
  await page.locator(".chips", { hasText: "connected" }).waitFor({ timeout: 120_000 });
  return { page, first_ms, whole_ms: performance.now() - began, bytes: () => bytes };
}

/** Heap after a collection, and how far apart frames came and how long the page's own work held them up. */
async function look(page, name) {
  const { heap_mb, frames, tasks } = await page.evaluate(async (duration_ms) => {
    const frames = [], tasks = [];
    new PerformanceObserver((list) => tasks.push(...list.getEntries().map((entry) => entry.duration))).observe({ entryTypes: ["longtask"] });
    const end = performance.now() + duration_ms;
    for (let last = performance.now(); last < end;) {
      await new Promise(requestAnimationFrame);
      const now = performance.now();
      frames.push(now - last);
      last = now;
    }
    window.gc?.();
    return { heap_mb: performance.memory.usedJSHeapSize / 1e6, frames, tasks };
  }, FRAMES_S * 1000);
  console.log(`${name}: heap ${heap_mb.toFixed(1)} MB; frames ${spread(frames)} ms apart; tasks over 50 ms: ${tasks.length}${tasks.length ? `, ${spread(tasks)} ms` : ""}`);
}

async function fourHours(browser) {
  const service = await startService();
  const mission = await liveMission(service, { ids: AUVS, clockRate: CLOCK_RATE, origin: { lat_deg: 59.4, lon_deg: 10.5 } });
  const plans = async () => (await service.get("/v1/missions?limit=1000")).missions[0].sequence;
  while (await plans() < 100) await sleep(500);
  const early = await open(browser, service, mission.id);
  console.log(`opened at the beginning: first picture ${early.first_ms.toFixed(0)} ms`);
  await look(early.page, "at the beginning");
  for (const began = Date.now(); Date.now() - began < 1000 * (PLANS / CLOCK_RATE - 25);) {
    await sleep(60_000);
    console.log(`${((Date.now() - began) / 60_000).toFixed(0)} min: event ${await plans()}`);
  }
  await look(early.page, "the same page at the end");
  const late = await open(browser, service, mission.id);
  console.log(`opened at the end: first picture ${late.first_ms.toFixed(0)} ms, all of the history ${late.whole_ms.toFixed(0)} ms, ${(late.bytes() / 1e6).toFixed(2)} MB`);
  await look(late.page, "the second page at the end");
  if (process.env.SHOTS) await early.page.screenshot({ path: `${process.env.SHOTS}/four-hours.png` });
  const planned = (await (await fetch(`${service.url}/v1/missions/${mission.id}/record?format=csv&kinds=planned`)).text()).split("\n").filter((row) => row.includes(",planned,")).length;
  console.log(`${planned} plans`);
  await mission.stop();
  await service.stop();
}

async function browsers(browser) {
  const service = await startService();
  const { pid } = service;
  const missions = [];
  for (let i = 0; i < MISSIONS; i += 1) missions.push(await liveMission(service, { ids: AUVS, title: `mission ${i}` }));
  await sleep(10_000);
  const watch = async (name) => {
    const cpu = async () => (await readFile(`/proc/${pid}/stat`, "utf8")).split(") ")[1].split(" ").slice(11, 13).reduce((sum, ticks) => sum + Number(ticks), 0);
    const from = await Promise.all(missions.map(async ({ id }) => (await service.get(`/v1/missions/${id}`)).sequence));
    const busy = await cpu();
    await sleep(WATCHED_S * 1000);
    const load = ((await cpu()) - busy) / WATCHED_S;
    const events = (await Promise.all(missions.map(async ({ id }, i) => {
      const text = await (await fetch(`${service.url}/v1/missions/${id}/record?format=events_ndjson&kinds=planned&after=${from[i]}`)).text();
      return text.split("\n").filter(Boolean).map((line) => JSON.parse(line));
    })));
    const missed = events.flatMap((ones) => ones.slice(1).map(({ t_s }, i) => Math.round(t_s - ones[i].t_s) - 1)).reduce((sum, n) => sum + n, 0);
    const all = events.flat();
    console.log(`${name}: ${all.length} plans, ${missed} missed; begun late by ${spread(all.map(({ late_s }) => 1000 * late_s))} ms; solved in ${spread(all.map(({ solve_time_ns }) => solve_time_ns / 1e6))} ms; the service ${load.toFixed(1)} % of a core`);
  };
  await watch("no browser");
  const pages = [];
  for (let i = 0; i < BROWSERS; i += 1) pages.push(await open(await browser.newContext(), service, missions[i % MISSIONS].id));
  await watch(`${BROWSERS} browsers`);
  const connected = await Promise.all(pages.map(({ page }) => page.locator(".chips", { hasText: "connected" }).count()));
  console.log(`${connected.filter(Boolean).length} of ${BROWSERS} still connected`);
  await Promise.all(missions.map((mission) => mission.stop()));
  await service.stop();
}

const what = { "four-hours": fourHours, browsers }[process.argv[2]];
if (!what) throw new Error("which: four-hours or browsers");
const browser = await chromium.launch(config.use.launchOptions);
await what(browser);
await browser.close();
