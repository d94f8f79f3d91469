// axe-core finds nothing serious on any view, in any theme; the keyboard alone is enough.

import { createRequire } from "node:module";
import { expect, go, test } from "./fixtures.mjs";
import { flown, liveMission } from "./service.mjs";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const THEMES = ["light", "dark", "sun", "night"];

async function findings(page) {
  // By the debugger: the page's own policy lets no script in but its own.
  await page.evaluate(() => delete window.axe);
  await page.evaluate(await (await import("node:fs/promises")).readFile(AXE, "utf8"));
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  return violations.filter(({ impact }) => ["serious", "critical"].includes(impact)).map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.target.join(" ")).join(" | ")}`);
}

test("nothing serious is found on any view in any theme, wide and on a phone", async ({ page, service, complaints }) => {
  test.setTimeout(300_000);
  const stored = await flown(service, { scenario: "crowded", seed: 1 }, "stored");
  const live = await liveMission(service, { title: "live" }), degraded = await liveMission(service, { title: "degraded", fixAge: 1000 });
  try {
    const views = ["", `#/mission/${stored}`, `#/mission/${live.id}`, `#/mission/${degraded.id}`, "#/compare?scenario=calm&seed=1", "#/plan?example=crowded"];
    for (const view of views) {
      await go(page, service, view);
      if (view.includes("compare")) await expect(page.locator(".notice")).toContainText("Flown", { timeout: 60_000 });
      await page.waitForTimeout(1500);
      for (const [i, theme] of THEMES.entries()) {
        await page.locator("#theme").selectOption(theme);
        // Each part of the orders is open in one of the themes.
        if (view.includes(live.id)) await page.locator(".order summary").nth(i).click();
        for (const width of [1280, 390]) {
          await page.setViewportSize({ width, height: 844 });
          expect(await findings(page), `${view}, ${theme}, ${width} px`).toEqual([]);
          expect(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), `${view} at ${width} px`).toBeLessThanOrEqual(0);
        }
      }
    }
  } finally {
    for (const mission of [live, degraded]) {
      await mission.stop();
      await service.post(`/v1/missions/${mission.id}/finish`, {});
    }
  }
  expect(complaints).toEqual([]);
});

test("the keyboard alone goes from the first page into a mission and through its time", async ({ page, service, complaints }) => {
  const id = await flown(service, { scenario: "calm", seed: 2 }, "by keyboard");
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
  expect(complaints).toEqual([]);
});
