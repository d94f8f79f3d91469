// Missions: from the gallery to the end, scrubbed, compared; live ones watched, steered, and seen through a restart.

import { rm } from "node:fs/promises";
import { expect, go, isDrawn, test } from "./fixtures.mjs";
import { flown, liveMission, startService } from "./service.mjs";

test("a scenario runs from the gallery to its end, and any moment of it can be looked at", async ({ page, service, complaints }) => {
  await go(page, service, "");
  const card = page.locator(".gallery-card", { has: page.getByRole("heading", { name: "switching", exact: true }) });
  await card.getByRole("button", { name: /^Run/ }).click();
  await expect(page.locator(".mission-head h1")).toContainText("switching");
  await expect(page.locator(".chips")).toContainText("running");
  await expect.poll(() => isDrawn(page.locator(".map-place canvas").first())).toBe(true);
  // It was begun at a speed to watch; the rest as fast as it can.
  await page.getByRole("button", { name: "Pause", exact: true }).click();
  await expect(page.locator(".chips")).toContainText("paused");
  await page.getByLabel("Speed of the simulation").selectOption("as fast as possible");
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await expect(page.locator(".chips")).toContainText("finished", { timeout: 60_000 });

  const slider = page.getByLabel("Time shown"), clock = page.locator(".clock");
  await slider.fill("500");
  await expect(clock).toHaveText(/^16:00/);
  const middle = await clock.textContent();
  await slider.press("ArrowRight");
  await expect(clock).not.toHaveText(middle ?? "");
  await expect(page.locator(".now").nth(1)).toContainText("heading lag");
  const before = await page.locator(".map-place canvas").first().evaluate((canvas) => canvas.toDataURL());
  await slider.fill("200");
  await expect.poll(() => page.locator(".map-place canvas").first().evaluate((canvas) => canvas.toDataURL())).not.toBe(before);
  await page.getByRole("button", { name: "Worst minute" }).click();
  await expect(page.locator(".log")).toContainText("root mean square over a minute");
  await page.getByRole("button", { name: /Play/ }).click();
  await expect(page.getByRole("button", { name: /Pause/ }).last()).toBeVisible();
  expect(complaints).toEqual([]);
});

test("the slider of a simulated mission that is under way is as full as its time is over", async ({ page, service, complaints }) => {
  const { id } = await service.post("/v1/missions", { schema_version: "1.0", title: "under way", simulated: { scenario: "switching", seed: 1 } });
  for (const ticks of [...Array(8).fill(60), 1]) await service.post(`/v1/missions/${id}/step`, { ticks });
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator(".clock")).toHaveText("08:00 of 32:00");
  await expect(page.getByLabel("Time shown")).toHaveValue("250");
  await page.getByLabel("Time shown").fill("900");
  await expect(page.locator(".clock")).toHaveText("08:00 of 32:00");
  await page.getByLabel("Time shown").fill("125");
  await expect(page.locator(".clock")).toHaveText("04:00 of 32:00");
  await service.post(`/v1/missions/${id}/finish`, {});
  expect(complaints).toEqual([]);
});

test("two controllers are compared on one clock, with a winner, and the information that each has", async ({ page, service, complaints }) => {
  await go(page, service, "#/compare?scenario=switching&seed=1");
  await expect(page.locator(".notice")).toContainText("Flown", { timeout: 90_000 });
  const rms = page.locator(".scores tbody tr").first();
  await expect(rms.locator("td.better")).toHaveCount(1);
  await expect(rms.locator(".winner")).toHaveText("planner");
  await expect(page.locator(".scores")).toContainText("information given");
  await expect(page.locator(".information").last()).not.toHaveText("–");
  // The opponent is the strongest law, with the gains that are tuned for the scenario, and what it did otherwise is said.
  await expect(page.getByLabel("line of sight, tracker frame (strongest here)")).toBeChecked();
  await expect(page.locator(".scores")).toContainText("look-ahead 1 m, along-track 0.1 1/s");
  await expect(page.locator(".why-differ")).toContainText(/At \d hand-overs \(medians\): planner left \d+\u00a0s before and was \d+\u00a0m off; line of sight, tracker frame had not left/);
  await expect(page.locator(".map-place canvas")).toHaveCount(2);
  const { missions } = await service.get("/v1/missions?limit=1000");
  expect(missions.filter(({ title }) => title.startsWith("switching, seed 1: ")).map(({ status }) => status)).toEqual(["finished", "finished"]);
  // The same address shows the same runs, and makes no others. Both maps say what was planned, also of runs that were flown before.
  await page.reload();
  await expect(page.locator(".notice")).toContainText("Flown", { timeout: 60_000 });
  expect((await service.get("/v1/missions?limit=1000")).missions.length).toBe(missions.length);
  const fetched = page.waitForResponse((answer) => answer.url().includes("kinds=planned"));
  await page.getByLabel("Time shown").fill("300");
  expect((await (await fetched).text()).includes('"prediction"')).toBe(true);
  // A moment that was chosen stays when the maps are put together: 300 of the slider's 1000 steps.
  const clock = page.locator(".clock");
  await expect(clock).toHaveText("09:36 of 32:00");
  await page.getByLabel("a map each").uncheck();
  await expect(page.locator(".map-place canvas")).toHaveCount(1);
  await expect(clock).toHaveText("09:36 of 32:00");
  await page.getByLabel("a map each").check();
  for (const [name, ending] of [["Save PNG", ".png"], ["Save CSV", ".csv"]]) {
    const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name }).click()]);
    expect(saved.suggestedFilename()).toBe(`switching-seed-1${ending}`);
  }
  // A link to the missions themselves is for everybody who may read.
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.getByRole("button", { name: "Copy link" }).click();
  await expect(page.locator(".scores .row")).toContainText("copied");
  const link = await page.evaluate(() => navigator.clipboard.readText());
  expect(link).toContain("missions=");
  await page.goto(link);
  await page.reload();
  await expect(page.locator(".notice")).toContainText("Flown", { timeout: 60_000 });
  await expect(page.locator(".scores tbody tr").first().locator(".winner")).toHaveText("planner");
  await expect(page.locator("#compare-scenario")).toHaveValue("switching");
  expect(complaints).toEqual([]);
});

test("the faults of a scenario are in the log of its mission, in its charts, and in what the controller is said to know", async ({ page, service, complaints }) => {
  const id = await flown(service, { scenario: "faults", seed: 1 }, "with faults");
  await go(page, service, `#/mission/${id}`);
  const log = page.locator(".log");
  for (const words of ["fault: the port thruster delivers 60 % of its thrust", "fault over: the craft has no GNSS position", "fault: auv-1 loses power and sends nothing"]) await expect(log).toContainText(words);
  await expect(page.locator(".about").first()).toContainText("at once and exact, except while a fault stops its messages");
  // Moved to the fault, the chart says it.
  await log.getByRole("button", { name: "25:00" }).click();
  await expect(page.locator(".chart-canvas").first()).toHaveAttribute("aria-label", /fault: auv-1 loses power/);
  await expect(page.locator(".explained")).toContainText("line of sight");
  await expect(page.locator(".now").first()).toContainText("predicted cost, least answers");
  expect(complaints).toEqual([]);
});

test("a comparison of no known controller is one of the usual, and one that was broken off is flown again", async ({ page, service, complaints }) => {
  await go(page, service, "#/compare?scenario=calm&seed=7&controllers=nonsense");
  await expect(page.locator(".notice")).toContainText("Flown", { timeout: 60_000 });
  const { version } = await service.get("/version");
  const begun = await fetch(`${service.url}/v1/missions`, {
    method: "POST", headers: { "content-type": "application/json", "idempotency-key": `compare ${version} calm 8 mpc` },
    body: JSON.stringify({ schema_version: "1.0", title: "calm, seed 8: planner", simulated: { scenario: "calm", seed: 8 } }),
  });
  const { id } = await begun.json();
  await service.post(`/v1/missions/${id}/step`, { ticks: 3 });
  await service.post(`/v1/missions/${id}/finish`, {});
  await go(page, service, "#/compare?scenario=calm&seed=8");
  await expect(page.locator(".notice")).toContainText("Flown", { timeout: 60_000 });
  expect(complaints).toEqual([]);
});

test("streams are read in a browser that does not go through them by itself", async ({ page, service, complaints }) => {
  await page.addInitScript(() => { delete ReadableStream.prototype[Symbol.asyncIterator]; });
  const id = await flown(service, { scenario: "calm", seed: 4 }, "read by hand");
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator(".chips")).toContainText("finished");
  await expect.poll(() => isDrawn(page.locator(".map-place canvas").first())).toBe(true);
  expect(complaints).toEqual([]);
});

test("on the first page what is open stays open, and what has the focus keeps it, while missions go on", async ({ page, service, complaints }) => {
  const mission = await liveMission(service, { title: "open", ids: ["auv-1", "never-heard"] });
  try {
    // An AUV that is never heard is one that its mission waits for.
    await go(page, service, "");
    const row = page.locator("tr", { has: page.getByRole("link", { name: "open", exact: true }) });
    await row.locator("a").focus();
    const lag = row.locator("td").nth(2), before = await lag.textContent();
    await expect(lag).not.toHaveText(before ?? "", { timeout: 30_000 });
    expect(await row.locator("a").evaluate((link) => link === document.activeElement)).toBe(true);
    // What runs is not offered for deletion.
    await expect(row.getByText("Delete")).toBeHidden();
    await page.evaluate(() => { document.querySelector("tbody tr").marked = true; });
    await page.waitForTimeout(5000);
    expect(await page.evaluate(() => document.querySelector("tbody tr").marked)).toBe(true);
  } finally {
    await mission.stop();
    await service.post(`/v1/missions/${mission.id}/finish`, {});
  }
  expect(complaints).toEqual([]);
});

test("a mission whose reports cease is stale, by the service's clock and not by the browser's", async ({ page, service, complaints }) => {
  // A tablet that is an hour ahead.
  await page.addInitScript(() => { const { now } = Date; Date.now = () => now() + 3_600_000; });
  const mission = await liveMission(service, { title: "ceases" });
  await go(page, service, `#/mission/${mission.id}`);
  await expect(page.locator(".chips")).toContainText("connected");
  await expect(page.locator(".now").first()).toContainText("auv-2 heard");
  await page.waitForTimeout(3000);
  await expect(page.locator(".chips")).not.toContainText("not steering");
  await mission.stop();
  await expect(page.locator(".chips")).toContainText("not steering", { timeout: 60_000 });
  const heard = page.locator(".now").first().locator("div", { hasText: "auv-2 heard" }), then = await heard.textContent();
  await expect(heard).not.toHaveText(then ?? "", { timeout: 10_000 });
  await service.post(`/v1/missions/${mission.id}/finish`, {});
  expect(complaints).toEqual([]);
});

test("a route file is dropped on the map, way-points are clicked, and both become the AUV's path", async ({ page, service, complaints }) => {
  const origin = { lat_deg: 38.41, lon_deg: -9.12 }, mission = await liveMission(service, { title: "routed", origin });
  const paths = async () => (await service.get(`/v1/missions/${mission.id}/scene`)).paths;
  try {
    await go(page, service, `#/mission/${mission.id}`);
    await expect(page.locator(".chips")).toContainText("connected");
    const map = page.locator(".map-place canvas"), said = page.locator(".orders > .said");
    const drop = async (text) => map.dispatchEvent("drop", { dataTransfer: await page.evaluateHandle((text) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([text], "survey.kml"));
      return transfer;
    }, text) });
    const kml = (lat) => `<kml><Placemark><LineString><coordinates>-9.12,38.41 -9.12,${lat} -9.1195,${lat}</coordinates></LineString></Placemark></kml>`;
    await drop(kml(98.412));
    await expect(said).toContainText("line 1: latitude 98.412");
    expect(complaints.splice(0).every((complaint) => complaint.includes("422"))).toBe(true);
    await drop(kml(38.412));
    await expect(page.locator(".orders")).toContainText("3 way-points");
    await page.getByLabel("Speed along the route, m/s").fill("0.5");
    await page.getByRole("button", { name: "Send the route" }).click();
    await expect(said).toContainText("Change of the route: done");
    // Two thousandths of a degree of the meridian are 222 m.
    const [north] = (await paths())["auv-1"].at(-1);
    expect(Math.abs(north - 222)).toBeLessThan(1);

    await page.getByRole("button", { name: "Clear" }).click();
    await page.getByLabel("click way-points on the map").check();
    await page.getByLabel("AUV of the route").selectOption("auv-2");
    for (const [x, y] of [[100, 150], [100, 60], [200, 60]]) await map.click({ position: { x, y } });
    await page.getByRole("button", { name: "Send the route" }).click();
    await expect.poll(async () => Object.keys(await paths())).toEqual(["auv-1", "auv-2"]);
    await expect(page.locator(".log")).toContainText("paths");
  } finally {
    await mission.stop();
    await service.post(`/v1/missions/${mission.id}/finish`, {});
  }
  expect(complaints).toEqual([]);
});

test("a live mission that a script posts is watched as it happens, and its goal is changed", async ({ page, service, complaints }) => {
  const mission = await liveMission(service, { title: "watched" });
  try {
    await go(page, service, "");
    await page.getByRole("link", { name: "watched" }).click();
    await expect(page.locator(".chips")).toContainText("connected");
    const clock = page.locator(".clock"), now = await clock.textContent();
    await expect(clock).not.toHaveText(now ?? "", { timeout: 10_000 });
    await expect(page.locator(".now").first()).toContainText("auv-2 heard");
    await page.locator(".order summary", { hasText: "Goal" }).click();
    await page.locator(".field", { hasText: /^AUV/ }).locator("select").selectOption("auv-2");
    await page.getByRole("button", { name: "Send…" }).click();
    await page.locator(".orders dialog").getByRole("button", { name: "Send" }).click();
    await expect(page.locator(".log")).toContainText("changed");
    expect((await service.get(`/v1/missions/${mission.id}`)).setting.goal).toEqual({ kind: "track", auv: "auv-2" });
    // An entry of the log that is pressed is clicked, although the log gains another before it is let go.
    const live = page.getByRole("button", { name: "Live", exact: true });
    await expect(live).toHaveAttribute("aria-pressed", "true");
    await page.locator(".log button").last().hover();
    await page.mouse.down();
    await service.post(`/v1/missions/${mission.id}/pause`, {});
    await expect(page.locator(".chips")).toContainText("paused");
    // The log is drawn a frame or two after the chips.
    await page.waitForTimeout(500);
    await page.mouse.up();
    await expect(live).toHaveAttribute("aria-pressed", "false");
    await expect(page.locator(".log")).toContainText("paused");
  } finally {
    await mission.stop();
    await service.post(`/v1/missions/${mission.id}/finish`, {});
  }
  expect(complaints).toEqual([]);
});

test("a mission is seen on after the server was killed and started again, without a reload", async ({ page, complaints }) => {
  const first = await startService();
  const mission = await liveMission(first, { title: "killed" });
  let second;
  try {
    await go(page, first, `#/mission/${mission.id}`);
    await expect(page.locator(".chips")).toContainText("connected");
    await page.evaluate(() => { window.here = true; });
    await first.kill();
    await expect(page.locator(".chips")).toContainText("connection lost");
    second = await startService({ data: first.data, port: first.port });
    await expect(page.locator(".chips")).toContainText("connected", { timeout: 30_000 });
    const { sequence } = await second.get(`/v1/missions/${mission.id}`);
    const clock = page.locator(".clock"), then = await clock.textContent();
    await expect(clock).not.toHaveText(then ?? "", { timeout: 10_000 });
    expect(await page.evaluate(() => window.here)).toBe(true);
    expect(sequence).toBeGreaterThan(0);
  } finally {
    await mission.stop();
    await (second ?? first).kill();
    await rm(first.data, { recursive: true, force: true });
    // What a browser writes to its console while nothing answers, and what names another service's port.
    const others = complaints.splice(0).filter((complaint) => !/ERR_(CONNECTION|INCOMPLETE|EMPTY|NETWORK)/.test(complaint) && !complaint.includes(first.url));
    expect(others).toEqual([]);
  }
});

test("a stored mission says what its planner believed at any time", async ({ page, service, complaints }) => {
  const id = await flown(service, { scenario: "noisy-fixes", seed: 3 }, "stored");
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator(".chips")).toContainText("finished");
  await page.getByLabel("Time shown").fill("300");
  await expect(page.locator(".now").nth(1)).toContainText("95 %");
  await expect(page.locator(".map-place canvas").first()).toHaveAttribute("aria-label", /m from the goal/);
  expect(complaints).toEqual([]);
});

test("on a phone the numbers and the orders come before the legend, and no state is cut off", async ({ page, service, complaints }) => {
  const mission = await liveMission(service, { title: "on a phone", fixAge: 1000 });
  try {
    await page.setViewportSize({ width: 390, height: 844 });
    await go(page, service, `#/mission/${mission.id}`);
    await expect(page.locator(".chip.state")).toContainText("degraded");
    const top = async (selector) => (await page.locator(selector).boundingBox()).y;
    const [map, now, orders, legend] = await Promise.all([".map-place", "#now-title", ".orders", ".legend"].map(top));
    expect(map).toBeLessThan(Math.min(now, orders));
    expect(Math.max(now, orders)).toBeLessThan(legend);
    await go(page, service, "");
    const chip = page.locator("tr", { has: page.getByRole("link", { name: "on a phone" }) }).locator(".chip");
    await expect(chip).toHaveText("degraded");
    const { x, width } = await chip.boundingBox();
    expect(x + width).toBeLessThan(380);
  } finally {
    await mission.stop();
    await service.post(`/v1/missions/${mission.id}/finish`, {});
  }
  expect(complaints).toEqual([]);
});
