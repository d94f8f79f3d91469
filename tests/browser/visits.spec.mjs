// Visits: a snapshot's schedule, and a live mission whose next visit is pinned and released.

import { expect, go, isDrawn, test } from "./fixtures.mjs";

test("a snapshot's schedule is a strip, a tour on the map, a sentence and a table, and they agree with the answer", async ({ page, service }) => {
  const request = await service.get("/v1/examples/visit"), { schedule } = await service.post("/v1/plan", request);
  await go(page, service, "#/plan?example=visit");
  await expect(page.locator(".plan-status")).toHaveText("planned");
  const strip = page.locator(".visits");
  await expect(strip.locator(".visits-next")).toHaveText(schedule.sentence);
  await expect(strip.locator(".planned")).toHaveCount(schedule.visits.length + 1);
  const rows = strip.locator(".visits-row");
  for (const [i, { auv }] of schedule.costs.entries()) {
    await expect(rows.nth(i).locator("b")).toHaveText(auv);
    await expect(rows.nth(i).locator(".planned")).toHaveCount(schedule.visits.filter((visit) => visit.auv === auv).length);
    await expect(rows.nth(i).locator(".deadline")).toHaveCount(auv in request.goal.serve_by_s ? 1 : 0);
  }
  // No name is cut, on a phone neither.
  const isCut = () => rows.locator("b").evaluateAll((names) => names.some((name) => name.scrollWidth > name.clientWidth));
  expect(await isCut()).toBe(false);
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await isCut()).toBe(false);
  await page.setViewportSize({ width: 1280, height: 800 });
  // The first visits are numbered, from the left.
  const lefts = await strip.locator(".planned").evaluateAll((bars) => bars.filter((bar) => bar.textContent).sort((a, b) => a.textContent - b.textContent).map((bar) => parseFloat(bar.style.left)));
  expect(lefts.length).toBeGreaterThanOrEqual(schedule.costs.length);
  expect(lefts).toEqual(lefts.toSorted((a, b) => a - b));
  const table = page.locator(".panel", { has: page.getByRole("heading", { name: "Visits" }) });
  await expect(table.locator("table").first().locator("tbody tr")).toHaveCount(schedule.visits.length);
  for (const { next } of schedule.alternatives) await expect(table).toContainText(`${next} first`);
  await expect.poll(() => isDrawn(page.locator(".map-place canvas"))).toBe(true);
  // Another goal has none of it.
  await go(page, service, "");
  await go(page, service, "#/plan?example=track");
  await expect(page.locator(".plan-status")).toHaveText("planned");
  await expect(page.locator(".visits")).toBeHidden();
});

test("a live mission shows what was served and what is next, which is pinned and released", async ({ page, played }) => {
  const watched = await played("visits");
  await watched.open();
  const strip = page.locator(".visits"), said = page.locator(".orders > .said"), orders = page.locator(".orders"), next = orders.getByLabel("visit next");
  const send = async () => {
    await orders.getByRole("button", { name: "Send…" }).click();
    await orders.locator("dialog").getByRole("button", { name: "Send" }).click();
    await expect(said).toHaveText("Orders: done");
  };
  await expect(strip.locator(".visits-next")).toContainText(/auv-. (now|next)/);
  // The craft starts within 20 m of the first.
  await expect(strip.locator(".visits-row").first().locator(".past").first()).toBeVisible();
  await expect(page.locator(".now").nth(1)).toContainText("cost of visits");
  await watched.passUntilOrder();
  await orders.locator("summary", { hasText: "Goal" }).click();
  await next.selectOption("auv-3");
  await send();
  await watched.passUntilOrder();
  await expect(strip.locator(".visits-row").nth(2).locator("b")).toContainText("pinned");
  await expect(strip.locator(".visits-next")).toContainText("auv-3");
  await next.selectOption("the planner chooses");
  await send();
  await watched.pass(2);
  await expect(strip).not.toContainText("pinned");
});
