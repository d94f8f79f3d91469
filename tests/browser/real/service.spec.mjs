// What only the real service can show of the page: it is killed under a page that is open, and comes back.

import { rm } from "node:fs/promises";
import { expect, expected, go, test } from "../fixtures.mjs";
import { liveMission, startService } from "../service.mjs";

test("a mission is seen on after the service was killed and started again, without a reload", async ({ page, origins, complaints }) => {
  const first = await startService(), mission = await liveMission(first, { title: "killed" }), state = page.locator(".chip.state");
  origins.push(first.url);
  let second;
  try {
    await go(page, first, `#/mission/${mission.id}`);
    await expect(state).toHaveText("steering");
    await expect(page.locator(".chips")).toContainText("connected");
    await page.evaluate(() => { window.here = true; });
    await first.kill();
    await expect(page.locator(".chips")).toContainText("connection lost");
    await expect(state).toHaveText(/^steering not known( \d+\u00a0s)?: connection lost: .*; trying again$/);
    second = await startService({ data: first.data, port: first.port });
    await expect(state).toHaveText("steering");
    await expect(page.locator(".chips")).toContainText("connected");
    const clock = page.locator(".clock"), then = await clock.textContent();
    await expect(clock).not.toHaveText(then ?? "");
    expect(await page.evaluate(() => window.here)).toBe(true);
  } finally {
    await mission.stop();
    await (second ?? first).kill();
    await rm(first.data, { recursive: true, force: true });
  }
  // What a browser writes to its console while nothing answers.
  expect(expected(complaints, /ERR_(CONNECTION|INCOMPLETE|EMPTY|NETWORK)/)).toBe(true);
});
