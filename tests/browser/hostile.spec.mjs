// Names from outside are text, whatever is in them, wherever they reach the page.

import { expect, expected, go, test } from "./fixtures.mjs";
import { flown, posed } from "./service.mjs";

const HOSTILE = {
  markup: "<img src=x onerror=alert(1)>",
  turned: "\u202eabc\u2066\u200fdef\u202d",
  emoji: "🐟".repeat(16),
  script: "</script><script>alert(1)</script>",
};

for (const [kind, name] of Object.entries(HOSTILE)) {
  test(`names with ${kind} stay text on every view`, async ({ page, service, played, complaints }) => {
    page.on("dialog", (dialog) => { complaints.push(`a dialog opened: ${dialog.message()}`); dialog.dismiss(); });
    const images = () => page.locator("main img").count();
    const example = await service.get("/v1/examples/track");
    example.auvs[0].id = example.goal.auv = name;
    example.traffic = [{ id: name, name, north_m: 300, east_m: 100, speed_mps: 4, course_rad: Math.PI }];
    example.metadata = { [name]: name };
    await go(page, service, "#/plan");
    await page.getByRole("textbox", { name: /^Snapshot/ }).fill(JSON.stringify(example, null, 1));
    await page.getByRole("textbox", { name: /^Snapshot/ }).press("Control+Enter");
    await expect(page.locator(".plan-status")).toContainText("planned");
    await expect(page.locator(".vessels")).toContainText(name);
    expect(await images()).toBe(0);
    await noOverflow(page);

    const watched = await played("steered", { renamed: { "auv-1": name, "auv-2": `${name.slice(0, 8)}2`, recorded: name, "a note": name } });
    await watched.open("");
    await expect(page.locator("main")).toContainText(name);
    await noOverflow(page);
    await watched.open();
    await watched.pass(1);
    await expect(page.locator("h1")).toHaveText(name);
    await expect(page.locator(".log")).toContainText(name);
    await expect(page.locator(".now").first()).toContainText(name);
    await page.locator(".order summary", { hasText: "Goal" }).click();
    await page.getByLabel("what to do").selectOption("visit");
    await page.getByRole("button", { name: "Send…" }).click();
    await expect(page.locator(".orders dialog li").first()).toContainText(name);
    await page.getByRole("button", { name: "Back" }).click();
    expect(await images()).toBe(0);
    for (const width of [1280, 390]) {
      await page.setViewportSize({ width, height: 844 });
      await noOverflow(page);
    }
  });
}

test("AUVs with names of JavaScript, and of members of a goal, are in a weighted goal or not, as it says", async ({ page, service }) => {
  const id = await posed(service, { ids: ["constructor", "toString", "bearing_rad"] }), orders = page.locator(".orders");
  await go(page, service, `#/mission/${id}`);
  await orders.locator(".order summary", { hasText: "Goal" }).click();
  await orders.getByLabel("what to do").selectOption("weighted");
  await orders.getByRole("checkbox", { name: "toString" }).uncheck();
  await orders.getByLabel("weight").last().fill("2");
  await orders.getByRole("button", { name: "Send…" }).click();
  await expect(orders.locator("dialog li")).toHaveText(["Goal: stay above the weighted mean of constructor, bearing_rad; until now: stay above constructor", "Goal, weight of constructor: 1", "Goal, weight of bearing_rad: 2"]);
  await orders.locator("dialog").getByRole("button", { name: "Send" }).click();
  await expect(orders.locator(".said[role=status]").last()).toHaveText("Orders: done");
  expect((await service.get(`/v1/missions/${id}`)).setting.goal.weights).toEqual({ constructor: 1, bearing_rad: 2 });
  await expect(orders.getByRole("checkbox", { name: "toString" })).not.toBeChecked();
});

test("a hostile title of a scenario's run stays text in its mission and its comparison", async ({ page, service, complaints }) => {
  const id = await flown(service, { scenario: "calm", seed: 1 }, `${HOSTILE.markup}${HOSTILE.turned}`, 10);
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator("h1")).toContainText("<img src=x");
  await go(page, service, `#/compare?scenario=${encodeURIComponent(HOSTILE.markup)}&seed=1`);
  await expect(page.locator(".notice")).toContainText("no such scenario");
  await page.goto(`${service.url}/#/mission/${encodeURIComponent(HOSTILE.markup)}`);
  await expect(page.locator(".notice")).toContainText("no such mission");
  expect(await page.locator("main img").count()).toBe(0);
  expect(expected(complaints, /404/)).toBe(true);
});

async function noOverflow(page) {
  expect(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth)).toBeLessThanOrEqual(0);
}
