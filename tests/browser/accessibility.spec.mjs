// axe-core finds nothing serious on any view, in any theme; the keyboard alone is enough.

import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { expect, go, test } from "./fixtures.mjs";
import { flown } from "./service.mjs";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const THEMES = ["light", "dark", "sun", "night"];

async function findings(page) {
  // By the debugger: the page's own policy lets no script in but its own. It has the browser's clock where the page has the test's.
  if (!await page.evaluate(() => Boolean(window.axe))) await page.evaluate(`((setTimeout) => {${await readFile(AXE, "utf8")}})(window.later ?? setTimeout)`);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  return violations.filter(({ impact }) => ["serious", "critical"].includes(impact)).map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.target.join(" ")).join(" | ")}`);
}

/** Nothing is found in what the page shows, in any theme, wide and on a phone, and nothing is wider than the screen. */
async function isAccessible(page, view, themed = async () => {}) {
  for (const [i, theme] of THEMES.entries()) {
    await page.locator("#theme").selectOption(theme);
    await themed(i);
    for (const width of [1280, 390]) {
      await page.setViewportSize({ width, height: 844 });
      expect(await findings(page), `${view}, ${theme}, ${width} px`).toEqual([]);
      expect(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), `${view} at ${width} px`).toBeLessThanOrEqual(0);
    }
  }
}

test("nothing serious is found on views of stored missions and of a snapshot in any theme, wide and on a phone", async ({ page, service }) => {
  const stored = [];
  for (const controller of ["mpc", "saturated_los"]) stored.push(await flown(service, { scenario: "crowded", seed: 1, controller }, controller, 60));
  await go(page, service, `#/mission/${stored[0]}`);
  await expect(page.locator(".mission-head progress")).toBeHidden();
  await isAccessible(page, "a stored mission");
  await go(page, service, `#/compare?missions=${stored}`);
  await expect(page.locator(".notice")).toContainText("did not run to its end");
  await isAccessible(page, "a comparison");
  await go(page, service, "#/plan?example=crowded");
  await expect(page.locator(".plan-status")).toHaveText("planned");
  await isAccessible(page, "a snapshot");
});

for (const name of ["steered", "degraded", "traffic", "fleet"]) {
  test(`nothing serious is found on views of the mission that was recorded as ${name}`, async ({ page, played }) => {
    const watched = await played(name);
    await watched.open("");
    await isAccessible(page, "the first page");
    await watched.open();
    await watched.pass(name === "fleet" ? 14 : 1);
    // Each part of the orders is open in one of the themes.
    await isAccessible(page, "the mission", async (i) => {
      await page.locator(".order > summary:visible").nth(i).click();
      await watched.settled();
    });
  });
}

test("the keyboard alone goes from the first page into a mission and through its time", async ({ page, service }) => {
  const id = await flown(service, { scenario: "calm", seed: 2 }, "by keyboard", 120);
  await go(page, service, "");
  const link = page.getByRole("link", { name: "by keyboard" });
  await link.waitFor();
  for (let i = 0; i < 200 && !(await link.evaluate((element) => element === document.activeElement)); i += 1) await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await expect(page).toHaveURL(new RegExp(id));
  const slider = page.getByLabel("Time shown");
  await expect(page.locator(".chips")).toContainText("finished");
  await expect(slider).toBeEnabled();
  await expect(page.locator(".mission-head progress")).toBeHidden();
  for (let i = 0; i < 60 && !(await slider.evaluate((element) => element === document.activeElement)); i += 1) await page.keyboard.press("Tab");
  const clock = page.locator(".clock"), before = await clock.textContent();
  await page.keyboard.press("PageDown");
  await expect(clock).not.toHaveText(before ?? "");
  for (const landmark of ["banner", "navigation", "main", "contentinfo"]) await expect(page.getByRole(landmark)).toHaveCount(1);
});
