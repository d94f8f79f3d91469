// Plays a mission on the page, and keeps a picture of each step, for the moving picture at the top of the README:
//   node animation.mjs FOLDER      writes FOLDER/0000.png and so on; animation.py makes one file of them
// It is the hand-over of `switching` at 240 s: the planner leaves before it, line of sight (dashed) does not.

import { mkdir } from "node:fs/promises";
import { join } from "node:path";
import { chromium } from "@playwright/test";
import config from "./playwright.config.mjs";
import { flown, startService } from "./service.mjs";

const SCENARIO = { scenario: "switching", seed: 1 };
/** The time that is shown, s of the mission, and how much of it passes from picture to picture. */
const [FROM, TO, STEP] = [176, 296, 1.2];
const SIZE = { width: 1000, height: 464 };

const folder = process.argv[2];
await mkdir(folder, { recursive: true });
const service = await startService(), browser = await chromium.launch(config.use.launchOptions);
try {
  const id = await flown(service, SCENARIO, "switching, seed 1");
  const page = await browser.newPage({ viewport: SIZE, colorScheme: "light" });
  await page.goto(`${service.url}/#/mission/${id}`);
  const progress = page.locator(".mission-head progress"), time = page.getByLabel("Time shown");
  await progress.waitFor({ state: "hidden" });
  await page.getByRole("button", { name: "Keep the surface craft in the middle" }).click();
  // What moves, and no more: orders are over, and names of missions say nothing to a stranger.
  await page.evaluate(() => {
    for (const each of document.querySelectorAll("body > header, .mission-head, .about")) /** @type {HTMLElement} */ (each).hidden = true;
    for (const each of document.querySelectorAll("details")) each.hidden = true;
    for (const title of document.querySelectorAll("h2")) if (title.textContent === "Orders") title.closest("section, .panel")?.remove();
    for (const button of document.querySelectorAll("button")) if (["Worst minute", "Once settled", "End"].includes(button.textContent ?? "")) button.remove();
  });
  for (let i = 0; i < 6; i += 1) await page.getByRole("button", { name: "Nearer" }).click();
  const duration = 1919;
  for (let i = 0; FROM + i * STEP <= TO; i += 1) {
    await time.fill(String(Math.round((1000 * (FROM + i * STEP)) / duration)));
    // What is to be drawn is drawn in the next frame.
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
    await page.screenshot({ path: join(folder, `${String(i).padStart(4, "0")}.png`) });
  }
} finally {
  await browser.close();
  await service.stop();
}
