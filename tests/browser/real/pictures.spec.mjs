// The pictures of README, docs/page.md and docs/routes.md are what the program draws: with PILOTFISH_DRAW they are drawn anew, else compared.

import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { expect, go, settled, test } from "../fixtures.mjs";
import { flown, PROGRAM } from "../service.mjs";

const DOCS = new URL("../../../docs/", import.meta.url).pathname;
const DRAW = Boolean(process.env.PILOTFISH_DRAW);
/** Of a picture's pixels; another font alone is some 3 %. */
const DIFFERENCE_MAX = 0.08;
/** Shortly before the AUV to follow changes: the planner leaves, line of sight does not. */
const HAND_OVER = "00:03:54";

test.setTimeout(600_000);

test("the README's pictures are what is drawn today", async ({ page, service }) => {
  const folder = await mkdtemp(join(tmpdir(), "pilotfish-pictures-"));
  const id = await flown(service, { scenario: "switching", seed: 1 }, "switching, seed 1");
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator(".chips")).toContainText("finished");
  await expect(page.locator(".mission-head progress")).toBeHidden();
  const [, minutes, seconds] = HAND_OVER.split(":").map(Number), t = 60 * minutes + seconds;
  await page.getByLabel("Time shown").fill(String(Math.round((1000 * t) / 1919)));
  await page.getByRole("button", { name: "Keep the surface craft in the middle" }).click();
  await page.getByRole("button", { name: "Nearer" }).click();
  await expect(page.locator(".now").nth(1)).toContainText("heading lag");
  await unchanging(page);
  await picture(page, folder, "page.png");

  execFileSync(PROGRAM, ["simulate", "crowded", "--untimed", "--report", join(folder, "mission.html")], { stdio: "ignore" });
  await page.goto(pathToFileURL(join(folder, "mission.html")).href);
  await expect(page.locator(".chart canvas").first()).toBeVisible();
  await unchanging(page);
  await picture(page, folder, "report.png");

  for (const [name, scenario, time] of [["route-found.png", "survey-lanes", 1100], ["route-left.png", "survey-resumed", 1300]]) {
    execFileSync(PROGRAM, ["simulate", scenario, "--untimed", "--report", join(folder, "mission.html")], { stdio: "ignore" });
    await page.goto(pathToFileURL(join(folder, "mission.html")).href);
    await page.getByLabel("Time shown").fill(String(Math.round((1000 * time) / 1500)));
    await unchanging(page);
    await picture(page, folder, name);
  }

  await go(page, service, "#/compare?scenario=switching&seed=1");
  await expect(page.locator(".notice")).toContainText("Flown");
  await unchanging(page);
  await picture(page, folder, "compare.png");
  await rm(folder, { recursive: true });
});

/** What differs from run to run is not in the pictures: when the mission was made. */
async function unchanging(page) {
  await page.locator(".about").evaluateAll((all) => all.forEach((about) => { about.textContent = about.textContent.replace(/created \S+ \S+ UTC/, "created today"); }));
  await settled(page);
}

async function picture(page, folder, name) {
  const drawn = join(DRAW ? DOCS : folder, name);
  await page.screenshot({ path: drawn });
  if (DRAW) return;
  const share = await difference(page, [drawn, join(DOCS, name)]);
  expect(share, `docs/${name} differs in ${(100 * share).toFixed(2)} % of its pixels: look at it, then .ci/page-test --draw`).toBeLessThanOrEqual(DIFFERENCE_MAX);
}

/** The share of pixels that differ visibly between two PNG files of one size; 1 where the sizes differ. */
async function difference(page, files) {
  const sources = await Promise.all(files.map((file) => readFile(file, "base64")));
  return page.evaluate(async (all) => {
    const pixels = await Promise.all(all.map(async (source) => {
      const bytes = Uint8Array.from(atob(source), (letter) => letter.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, bitmap.width, bitmap.height);
    }));
    const [a, b] = pixels;
    if (a.width !== b.width || a.height !== b.height) return 1;
    let differing = 0;
    for (let i = 0; i < a.data.length; i += 4) if ([0, 1, 2].some((k) => Math.abs(a.data[i + k] - b.data[i + k]) > 48)) differing += 1;
    return differing / (a.width * a.height);
  }, sources);
}
