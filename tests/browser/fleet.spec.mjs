// A live mission of three craft and four AUVs: who serves whom, one of the craft falls silent, and another one is stood down.

import { expect, go, test } from "./fixtures.mjs";

const CRAFT = ["asc-1", "asc-2", "asc-3"];

/** How many pixels of the map have the colour of each craft. */
function pixels(page) {
  return page.locator(".map-place canvas").evaluate((canvas, n) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height), words = new Uint32Array(data.buffer), brush = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    return Array.from({ length: n }, (_, i) => {
      brush.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(`--craft-${i + 1}`).trim();
      brush.fillRect(0, 0, 1, 1);
      const [wanted] = new Uint32Array(brush.getImageData(0, 0, 1, 1).data.buffer);
      return words.filter((word) => word === wanted).length;
    });
  }, CRAFT.length);
}

/** What the table says of each craft: its state and whom it serves. */
function table(page) {
  return page.locator(".fleet tbody").evaluateAll((bodies) => bodies.map((body) => [body.querySelector("th bdi").textContent, body.querySelector(".chip").textContent, body.rows[1].textContent]));
}

test("each craft has its colour, its name, its numbers and its row, and the AUVs that it serves have its colour", async ({ page, played }) => {
  const watched = await played("fleet");
  await watched.open();
  await expect(page.locator(".chip.state")).toHaveText("steering");
  await expect(page.locator(".legend li", { hasText: "and the AUVs that it serves" })).toHaveText(CRAFT.map((id) => `${id} and the AUVs that it serves`));
  for (const id of [...CRAFT, "auv-1", "auv-4"]) await expect(page.locator(".map-place canvas")).toHaveAttribute("aria-label", new RegExp(`${id} at [−\\d]+ m north`));
  for (const n of await pixels(page)) expect(n).toBeGreaterThan(100);
  expect(await table(page)).toEqual([["asc-1", "steering", "serves auv-2"], ["asc-2", "steering", "serves auv-4"], ["asc-3", "steering", "serves auv-1, auv-3"]]);
  const rows = page.locator(".visits-row:not(.visits-times)");
  await expect(rows.locator("b")).toHaveText(CRAFT);
  await expect(rows.locator("> span")).toHaveText(["1 AUV", "1 AUV", "2 AUVs"]);
  // The third row has its numbered visits, and the names of their AUVs.
  await expect(rows.nth(2).locator(".planned")).toHaveText(["1", "2"]);
  await expect(page.locator(".charts")).toContainText("asc-3, actual");
  await expect(page.locator(".log")).toContainText("assigned: asc-1 serves auv-2; asc-2 serves auv-4; asc-3 serves auv-1, auv-3");
  const estimates = page.locator("section", { has: page.locator("#believed-title") });
  await expect(estimates).not.toContainText("auv-3");
  await page.getByLabel("Craft whose numbers are shown").selectOption("asc-3");
  await page.clock.runFor(100);
  await expect(estimates).toContainText("auv-3");
});

test("a craft that falls silent is an alarm by its name, and who takes its AUVs over is an event in words", async ({ page, played }) => {
  const watched = await played("fleet");
  await watched.open();
  const before = await pixels(page), state = page.locator(".chip.state"), log = page.locator(".log");
  await watched.pass(9);
  // Nobody says any more that it is steered.
  await expect(state).toHaveText(/^asc-2: steering not known/);
  await expect(state).toHaveClass(/bad/);
  await watched.pass(5);
  await expect(state).toHaveText("asc-2: silent: no report for 10 s");
  await expect(page).toHaveTitle(/^⚠ asc-2: silent · /);
  await expect(log).toContainText("assigned: asc-2 is silent: asc-3 serves auv-4 now");
  await expect(log).toContainText("alarm · asc-2: silent: no report for 10 s");
  expect(await table(page)).toEqual([["asc-1", "steering", "serves auv-2"], ["asc-2", "silent", "serves nobody"], ["asc-3", "steering", "serves auv-1, auv-3, auv-4"]]);
  const rows = page.locator(".visits-row:not(.visits-times)");
  await expect(rows.nth(1).locator(".away")).toHaveAttribute("title", /^asc-2, silent since/);
  await expect(rows.nth(1).locator("> span")).toHaveText("nobody");
  // Its colour has left the map but for its track: neither AUV nor plan have it.
  expect((await pixels(page))[1]).toBeLessThan(before[1]);
  await expect(page.locator(".charts")).toContainText("marks what is in the log");
  // Its own numbers are those of its last plan: none is good.
  await expect(page.locator(".fleet tbody").nth(1).locator(".values td")).toHaveText(["–", "–", /ago/]);
  await page.getByLabel("Craft whose numbers are shown").selectOption("asc-2");
  await watched.pass(1);
  await expect(page.locator(".now.old")).toContainText(/last plan1\d\u00a0s ago|last plan\d\u00a0s ago/);
  // What was so before is still known.
  await page.getByLabel("Time shown").focus();
  await page.keyboard.press("Shift+ArrowLeft");
  await page.clock.runFor(100);
  expect((await table(page))[1]).toEqual(["asc-2", "steering not recorded", "serves auv-4"]);
  await page.getByRole("button", { name: "Live" }).click();
  await watched.open("#/");
  await expect(page.locator(".home-missions .chip")).toHaveText("asc-2: silent");
  await expect(page.locator(".home-missions .chip")).toHaveClass(/bad/);
});

test("one craft is stood down, and the others are not asked for more", async ({ page, played }) => {
  const watched = await played("fleet");
  await watched.open();
  await watched.passUntilOrder();
  const orders = page.locator(".orders");
  await expect(orders.locator("summary", { hasText: /^Limits$/ })).toBeHidden();
  await orders.locator("summary", { hasText: "Craft" }).click();
  const serves = orders.getByLabel("asc-3 serves AUVs");
  await expect(serves).toBeChecked();
  // A limit of its own, and back.
  await orders.locator("summary", { hasText: "Limits of asc-1" }).click();
  await orders.getByRole("group", { name: "asc-1" }).getByLabel("fastest speed, m/s").fill("1.2");
  await orders.getByRole("button", { name: "Send…" }).click();
  await expect(orders.locator("dialog li")).toHaveText("Limits of asc-1, fastest speed, m/s: 1.2; until now: 1.5");
  await orders.getByRole("button", { name: "Back" }).click();
  await orders.getByRole("button", { name: "Discard" }).click();
  await serves.uncheck();
  await orders.getByRole("button", { name: "Send…" }).click();
  await expect(orders.locator("dialog li")).toHaveText("asc-3 stands down: it serves nobody");
  await orders.locator("dialog").getByRole("button", { name: "Send" }).click();
  await expect(orders.locator("> .said")).toHaveText("Orders: done");
  await watched.pass(4);
  expect(await table(page)).toEqual([["asc-1", "steering", "serves auv-1, auv-2, auv-3, auv-4"], ["asc-2", "silent", "serves nobody"], ["asc-3", "stood down: steering", "serves nobody"]]);
  await expect(page.locator(".log")).toContainText("assigned: asc-1 serves auv-1, auv-3, auv-4 now");
  await expect(serves).not.toBeChecked();
  // It can be taken back.
  await serves.check();
  await orders.getByRole("button", { name: "Send…" }).click();
  await expect(orders.locator("dialog li")).toHaveText("asc-3 may serve every AUV");
});

test("a fleet that waits says what to run, which the service accepts", async ({ page, service }) => {
  const live = { auvs: [{ id: "auv-9" }], surface_craft: [{ id: "the craft" }], goal: { kind: "track", auv: "auv-9" } }, { id } = await service.post("/v1/missions", { schema_version: "1.0", live });
  await service.post(`/v1/missions/${id}/run`, {});
  await go(page, service, `#/mission/${id}`);
  const [bridge, curl] = await page.locator(".empty pre").allTextContents(), [, url, body] = /^curl -s (\S+) .* -d '(.*)'$/.exec(curl);
  expect(bridge).toContain("--craft 'the craft'");
  // A craft that was never heard is no alarm, and nothing good.
  await expect(page.locator(".chip.state")).toHaveText(/steering not known/);
  await expect(page.locator(".visits")).toBeHidden();
  const report = JSON.parse(body.replaceAll("'$(date +%s)'", Math.floor(Date.now() / 1000)));
  expect((await service.post(url.slice(service.url.length), report)).rejected ?? []).toEqual([]);
  await expect(page.locator(".fleet tbody")).toContainText("serves auv-9");
  // Another client adds one.
  await service.patch(`/v1/missions/${id}`, { surface_craft: [{ id: "the craft" }, { id: "another one" }] });
  await expect(page.locator(".fleet tbody")).toHaveCount(2);
  await expect(page.getByLabel("Craft whose numbers are shown").locator("option")).toHaveText(["the craft", "another one"]);
});

for (const name of ["constructor", "<img src=x onerror=alert(1)>", "🐟".repeat(16)]) {
  test(`craft and AUVs may be called ${name}`, async ({ page, played }) => {
    const watched = await played("fleet", { renamed: { "asc-2": name, "auv-4": `${name.slice(0, 8)}4` } });
    await watched.open();
    await watched.pass(14);
    await expect(page.locator(".chip.state")).toContainText(`${name}: silent`);
    await expect(page.locator(".log")).toContainText(`${name} is silent: asc-3 serves ${name.slice(0, 8)}4 now`);
    expect((await table(page))[1].slice(0, 2)).toEqual([name, "silent"]);
    for (const width of [1280, 390]) {
      await page.setViewportSize({ width, height: 844 });
      expect(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth)).toBeLessThanOrEqual(0);
    }
    expect(await page.locator("main img").count()).toBe(0);
  });
}
