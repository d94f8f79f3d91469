// What a page that is left open says of a mission: steering; degraded, not steering or not known, and why; or that a person has the craft.

import { expect, expected, test } from "./fixtures.mjs";

test("a mission that is steered says so, and one whose reports cease looks bad everywhere until it is steered again, by the service's clock", async ({ page, played }) => {
  // The page is on a tablet that is an hour ahead.
  const watched = await played("steered", { ahead_s: 3600 });
  const state = page.locator(".chip.state"), old = page.locator(".now.old"), heard = page.locator(".now").first().locator("div", { hasText: "auv-2 heard" });
  await watched.open();
  for (let second = 0; second < 8; second += 1) {
    await watched.pass(1);
    await expect(state).toHaveText("steering");
    await expect(state).toHaveClass(/good/);
    await expect(page).toHaveTitle("recorded · Pilotfish");
    await expect(old).toHaveCount(0);
  }
  await expect(page.locator(".chips")).toContainText("connected");
  await expect(heard).toHaveText(/auv-2 heard[01]\.\d\u00a0s ago/);
  // Reports cease after 12 s, and the service extrapolates the craft for ten more.
  await watched.pass(25);
  await expect(state).toHaveText(/^steering not known \d+\u00a0s: no report from the bridge; waits for reports of the surface craft$/);
  await expect(state).toHaveClass(/bad/);
  await expect(page.locator(".chip.good")).toHaveCount(0);
  await expect(page).toHaveTitle(/^⚠ steering not known \d+\u00a0s · recorded · Pilotfish$/);
  await expect(old.locator("div").first()).toHaveText(/last plan\d+\u00a0s ago/);
  await expect(page.locator("p.unseen").first()).toHaveText(/^steering not known, for more than \d+\u00a0s, no report from the bridge; waits for reports of the surface craft$/);
  const then = await heard.textContent();
  await watched.pass(1);
  expect(await heard.textContent()).not.toBe(then);
  await watched.open("");
  const row = page.locator("tr", { has: page.getByRole("link", { name: "recorded" }) });
  await expect(row.locator(".chip.bad")).toHaveText(/^steering not known \d+\u00a0s$/);
  await expect(row.locator(".chip.good")).toHaveCount(0);
  await expect(page).toHaveTitle(/^⚠ steering not known .* · recorded · Pilotfish$/);
  await watched.open();
  await expect(state).toHaveText(/^steering not known/);
  await watched.pass(36);
  await expect(state).not.toHaveText(/^steering not known/);
  await expect(page).not.toHaveTitle(/not known/);
  await watched.pass(4);
  await expect(state).toHaveText("finished");
});

test("what is shown of the steering is what who steers says, and three seconds after the last word it is not known, though plans go on", async ({ page, played }) => {
  const watched = await played("handed"), state = page.locator(".chip.state"), seen = [];
  await watched.open();
  for (let second = 0; second < 20; second += 1) {
    await watched.pass(1);
    const words = await state.textContent();
    if (words !== seen.at(-1)) seen.push(words);
    expect(/good/.test(await state.getAttribute("class"))).toBe(words === "steering");
    expect(await page.locator(".chip.good").count()).toBe(words === "steering" ? 2 : 0);
    expect(await page.title()).toMatch(/not (steering|known)/.test(words) ? /^⚠ (not steering|steering not known) · recorded/ : /^recorded/);
  }
  const person = "a person has the craft: the autopilot left its guided mode", dead = "not steering: no heartbeat of the autopilot";
  expect(seen).toEqual(["steering", person, dead, "steering", "steering not known: no report from the bridge"]);
  await watched.open("");
  const row = page.locator("tr", { has: page.getByRole("link", { name: "recorded" }) });
  await expect(row.locator(".chip.bad")).toHaveText("steering not known");
});

test("a degraded plan says why, in the mission, its title and the list, and on a phone before the legend and not cut off", async ({ page, played }) => {
  const watched = await played("degraded");
  await page.setViewportSize({ width: 390, height: 844 });
  await watched.open();
  await watched.pass(2);
  await expect(page.locator(".chip.state.bad")).toHaveText("degraded: the goal's last report is too old; hold answers");
  await expect(page.locator(".chip.good")).toHaveCount(0);
  await expect(page).toHaveTitle("⚠ degraded · recorded · Pilotfish");
  const top = async (selector) => (await page.locator(selector).boundingBox()).y;
  const [map, now, orders, legend] = await Promise.all([".map-place", "#now-title", ".orders", ".legend"].map(top));
  expect(map).toBeLessThan(Math.min(now, orders));
  expect(Math.max(now, orders)).toBeLessThan(legend);
  await watched.open("");
  const row = page.locator("tr", { has: page.getByRole("link", { name: "recorded" }) }), chip = row.locator(".chip.bad");
  await expect(chip).toHaveText("degraded");
  await expect(row).toContainText("the goal's last report is too old");
  const { x, width } = await chip.boundingBox();
  expect(x + width).toBeLessThan(380);
});

test("a craft that does not do what is asked is an alarm", async ({ page, played }) => {
  const watched = await played("stuck");
  await watched.open();
  await watched.pass(1);
  await expect(page.locator(".chip.state.bad")).toHaveText(/does not (follow|respond)/);
  await expect(page).toHaveTitle(/^⚠ .*does not (follow|respond) · recorded/);
  await expect(page.locator(".warnings .violated").first()).toContainText("check");
  await watched.open("");
  await expect(page.locator("tr", { has: page.getByRole("link", { name: "recorded" }) }).locator(".chip.bad")).toHaveText(/does not (follow|respond)/);
});

test("without a service the page does not claim to know, and goes on without a reload when it is back", async ({ page, played, complaints }) => {
  const watched = await played("steered"), state = page.locator(".chip.state"), clock = page.locator(".clock");
  await watched.open();
  await watched.pass(1);
  await expect(state).toHaveText("steering");
  await page.evaluate(() => { window.here = true; });
  watched.cut();
  await expect(page.locator(".chips")).toContainText(/connection lost: the (service does not answer|stream ended); trying again/);
  await watched.pass(8);
  await expect(page.locator(".chip.state.bad")).toHaveText(/^steering not known( \d+\u00a0s)?: connection lost: .*; trying again$/);
  await expect(page.locator(".chip.good")).toHaveCount(0);
  await expect(page).toHaveTitle(/^⚠ steering not known( \d+\u00a0s)? · recorded/);
  watched.mend();
  // The next attempt comes within ten seconds; the answer to it is waited for.
  const back = page.waitForResponse((answer) => answer.url().includes("/events?"));
  await watched.pass(2);
  await page.clock.runFor(10_000);
  await back;
  const then = await clock.textContent();
  await watched.pass(1);
  await expect(page.locator(".chips")).toContainText("connected");
  expect(await clock.textContent()).not.toBe(then);
  expect(await page.evaluate(() => window.here)).toBe(true);
  // What a browser writes to its console while nothing answers.
  expect(expected(complaints, /ERR_(CONNECTION|INCOMPLETE|EMPTY|NETWORK)/)).toBe(true);
});

test("a service that takes a question and does not answer it is not waited for longer than 15 s", async ({ page, played }) => {
  const watched = await played("degraded");
  await watched.open();
  await page.route((url) => url.pathname.endsWith(watched.id), () => {});
  for (const ms of [5_000, 15_000, 1_000]) await page.clock.runFor(ms);
  await expect(page.locator(".chips")).toContainText("connection lost: the service does not answer");
});

test("the alarm sounds only if it is asked for, until it is acknowledged, and the log has its begin and end", async ({ page, played }) => {
  await page.addInitScript(() => {
    window.rung = window.notified = 0;
    const { start } = OscillatorNode.prototype;
    OscillatorNode.prototype.start = function (...when) { window.rung += 1; return start.apply(this, when); };
    window.Notification = class { static permission = "granted"; constructor(words) { window.notified += 1; window.noticed = words; } };
  });
  const rung = () => page.evaluate(() => window.rung);
  const watched = await played("steered");
  await watched.open();
  const button = page.getByRole("button", { name: "Alarm sound" }), acknowledge = page.getByRole("button", { name: "Acknowledge" });
  await watched.pass(1);
  await expect(page.locator(".chip.state")).toHaveText("steering");
  await expect(button).toHaveText("Alarm sound: off");
  await watched.pass(33);
  await expect(page.locator(".chip.state")).toHaveText(/^steering not known/);
  expect(await rung()).toBe(0);
  await expect(acknowledge).toBeHidden();
  await button.click();
  await expect(button).toHaveText("Alarm sound: on");
  // The browser lets the page sound.
  await expect(page.locator(".bell .said")).toBeEmpty();
  await watched.pass(1);
  expect(await rung()).toBe(2);
  expect(await page.evaluate(() => [window.notified, window.noticed])).toEqual([1, "recorded: steering not known: no report from the bridge; waits for reports of the surface craft"]);
  await watched.pass(8);
  expect(await rung()).toBe(2);
  await watched.pass(3);
  expect(await rung()).toBe(4);
  await acknowledge.click();
  await watched.pass(12);
  expect(await rung()).toBe(4);
  await expect(page.locator(".log")).toContainText("alarm: steering not known: no report from the bridge; waits for reports of the surface craft");
  await watched.pass(12);
  await expect(page.locator(".log")).toContainText(/alarm over: steering not known, after \d+\u00a0s/);
  await page.reload();
  await watched.settled();
  await expect(button).toHaveText("Alarm sound: on");
  // What was not seen happen is in the log as well.
  await expect(page.locator(".log")).toContainText(/alarm over: no new plan, after \d+\u00a0s/);
});
