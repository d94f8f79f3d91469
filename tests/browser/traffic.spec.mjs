// Other vessels: in a live mission, and in a snapshot.

import { expect, go, settled, test } from "./fixtures.mjs";

const picture = (page) => page.locator(".map-place canvas").first().evaluate((canvas) => canvas.toDataURL());

test("a mission among vessels shows them, says what the craft does about them, and is not green with one too near", async ({ page, played }) => {
  const watched = await played("traffic"), state = page.locator(".chip.state"), rows = page.locator(".vessels tbody");
  await watched.open();
  await watched.pass(2);
  await expect(state).toHaveText(/^steering: vessel too near: tender \d+\u00a0m(, closing)?$/);
  await expect(state).toHaveClass(/warn/);
  await expect(page.locator(".chip.good")).toHaveCount(0);
  // What is read out has no numbers that change.
  await expect(page.locator("p.unseen").first()).toHaveText("steering, vessel too near");
  await expect(rows).toHaveCount(3);
  const example = rows.filter({ hasText: "MV Example" });
  await expect(example).toContainText(/crosses from starboard: the craft acts, passes at \d+\u00a0m/);
  await expect(example).toHaveClass("acts");
  await expect(rows.filter({ hasText: "Ferry" })).toHaveClass("stale");
  await expect(page.locator(".explained")).toHaveText(/^Keeping clear of tender, which does not give way: .*, passes \d+ m ahead \(and 1 more vessel\)\.$/);
  await expect(page.locator(".legend")).toContainText("other vessel");
  const before = await picture(page);
  await page.locator(".layers summary").click();
  await page.getByRole("checkbox", { name: "other vessels" }).uncheck();
  await watched.settled();
  expect(await picture(page)).not.toBe(before);
  await watched.open("");
  const row = page.locator("tr", { has: page.getByRole("link", { name: "recorded" }) });
  await expect(row.locator(".chip.good")).toHaveCount(0);
});

test("a snapshot's vessels are drawn and listed in metres and radians as in degrees, and one without has neither", async ({ page, service }) => {
  const request = await service.get("/v1/examples/track"), origin = { lat_deg: 0, lon_deg: 0 };
  const { asc: { north_m, east_m }, t_s } = request, seen = [];
  const ship = { id: "244123456", name: "MV Example", speed_mps: 4, t_s: t_s - 10 };
  // A thousandth of a degree at the equator, on WGS 84, is 110.574 m north and 111.3195 m east.
  const metres = { ...ship, north_m: 110.574, east_m: 222.639, course_rad: -Math.PI / 2 }, degrees = { ...ship, lat_deg: 0.001, lon_deg: 0.002, course_deg: 270 };
  expect(Math.hypot(north_m, east_m)).toBeLessThan(100);
  await go(page, service, "#/plan?example=track");
  await expect(page.locator(".plan-status")).toHaveText("planned");
  for (const traffic of [[], [metres], [degrees]]) {
    await page.getByRole("textbox", { name: /^Snapshot/ }).fill(JSON.stringify({ ...request, origin, traffic }));
    const answered = page.waitForResponse("**/v1/plan/compare*");
    await page.getByRole("button", { name: "Plan", exact: true }).click();
    await answered;
    await expect(page.locator(".plan-status")).toHaveText("planned");
    await expect(page.locator(".vessels tbody")).toHaveText(traffic.map(() => /^MV Example\d+\u00a0m\d+\u00a0m(\d+\u00a0s|.*min.*|–).*; heard 10\u00a0s ago$/));
    await settled(page);
    const words = await page.locator(".vessels").allTextContents();
    seen.push({ drawn: await picture(page), words });
  }
  expect(seen[1].drawn).not.toBe(seen[0].drawn);
  expect(seen[2].words).toEqual(seen[1].words);
});
