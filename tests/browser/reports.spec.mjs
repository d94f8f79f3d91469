// Reports: the same views on recorded data, one file each, without a network.

import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { expect, isDrawn, test } from "./fixtures.mjs";
import { PROGRAM } from "./service.mjs";

// One worker makes the reports.
test.describe.configure({ mode: "default" });

/** Of the trial's log, rows that are identified: enough for every sheet, in a quarter of the time. */
const LOG_ROWS = 1500;

let folder;
const file = (name) => join(folder, name);

test.beforeAll(async () => {
  // What is computed takes as long as it takes.
  test.setTimeout(0);
  folder = await mkdtemp(join(tmpdir(), "pilotfish-reports-"));
  const run = (...args) => execFileSync(PROGRAM, args, { stdio: ["ignore", "ignore", "ignore"] });
  run("simulate", "crowded", "--duration-s", "300", "--untimed", "--report", file("mission.html"));
  run("simulate", "paper-path-following", "--untimed", "--report", file("alone.html"));
  run("compare", "about-face", "--duration-s", "60", "--report", file("comparison.html"));
  run("simulate", "--trial", "otter", "--seed", "3", "--out", file("otter.csv"));
  const rows = (await readFile(file("otter.csv"), "utf8")).split("\n");
  await writeFile(file("otter.csv"), `${rows.slice(0, LOG_ROWS).join("\n")}\n`);
  run("identify", file("otter.csv"), "--report", file("craft.html"), "--craft", file("craft.json"));
});

test.afterAll(() => rm(folder, { recursive: true, force: true }));

test("a mission's report is the mission view: map, charts, what was believed", async ({ page }) => {
  await page.goto(pathToFileURL(file("mission.html")).href);
  await expect(page.locator("h1")).toHaveText("crowded, seed 1");
  await expect.poll(() => isDrawn(page.locator(".map-place canvas"))).toBe(true);
  expect(await page.locator(".chart").count()).toBeGreaterThan(4);
  await page.getByLabel("Time shown").fill("500");
  await expect(page.locator(".now").nth(1)).toContainText("heading lag");
  const chart = page.locator(".chart canvas").first();
  await chart.hover({ position: { x: 300, y: 60 } });
  const times = await page.locator(".chart canvas").evaluateAll((all) => all.map((canvas) => /at (.*?):? /.exec(canvas.getAttribute("aria-label") ?? "")?.[1]));
  expect(new Set(times).size, `one time in all charts: ${times}`).toBe(1);
  await expect(page.locator(".scores")).toContainText("rms_m");
});

test("reports of an AUV alone, of a comparison and of a craft are drawn", async ({ page }) => {
  await page.goto(pathToFileURL(file("alone.html")).href);
  await expect.poll(() => isDrawn(page.locator(".map-place canvas"))).toBe(true);
  await page.goto(pathToFileURL(file("comparison.html")).href);
  await expect(page.locator(".map-place canvas")).toHaveCount(5);
  await expect(page.locator(".scores").first()).toContainText("planner");
  await expect(page.locator(".information").nth(1)).toContainText(/^look-ahead \d+ m, along-track [\d.]+ 1\/s/);
  await page.goto(pathToFileURL(file("craft.html")).href);
  await expect(page.locator(".sheet-canvas")).toHaveCount(6);
  await expect.poll(() => isDrawn(page.locator(".sheet-canvas").first())).toBe(true);
});

test("a report needs nothing but itself", async () => {
  const text = await readFile(file("mission.html"), "utf8");
  for (const loads of ["<link", "@import", "url(", " src=\""]) expect(text.includes(loads), loads).toBe(false);
});
