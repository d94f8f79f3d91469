// What a page that is left open says of a mission: steering, degraded and why, not steering and why.

import { rm } from "node:fs/promises";
import { expect, go, test } from "./fixtures.mjs";
import { liveMission, startService } from "./service.mjs";

test("a mission that is steered says so, and one whose reports cease looks bad everywhere until it is steered again", async ({ page, service, complaints }) => {
  const mission = await liveMission(service, { title: "five AUVs" });
  const state = page.locator(".chip.state"), old = page.locator(".now.old");
  await go(page, service, `#/mission/${mission.id}`);
  await expect(state).toHaveText("steering");
  await expect(state).toHaveClass(/good/);
  await expect(page).toHaveTitle("five AUVs · Pilotfish");
  await expect(old).toHaveCount(0);
  await mission.stop();
  // The service extrapolates the craft for ten seconds.
  await expect(state).toHaveText(/^not steering \d+\u00a0s: waits for reports of the surface craft$/, { timeout: 40_000 });
  await expect(state).toHaveClass(/bad/);
  await expect(page.locator(".chip.good")).toHaveCount(0);
  await expect(page).toHaveTitle(/^⚠ not steering \d+\u00a0s · five AUVs · Pilotfish$/);
  await expect(old.locator("div").first()).toHaveText(/last plan\d+\u00a0s ago/);
  await expect(page.locator("p.unseen").first()).toHaveText(/^not steering, for more than \d+\u00a0s, waits for reports of the surface craft$/);
  await go(page, service, "");
  const row = page.locator("tr", { has: page.getByRole("link", { name: "five AUVs" }) });
  await expect(row.locator(".chip.bad")).toHaveText(/^not steering \d+\u00a0s$/);
  await expect(row.locator(".chip.good")).toHaveCount(0);
  await expect(page).toHaveTitle(/^⚠ not steering .* · five AUVs · Pilotfish$/);
  await go(page, service, `#/mission/${mission.id}`);
  await expect(state).toHaveText(/^not steering/);
  const t_s = Date.now() / 1000, asc = [{ t_s, state: { north_m: 0, east_m: 0, heading_rad: 0, speed_mps: 0, sway_mps: 0, yaw_rate_radps: 0 } }];
  await service.post(`/v1/missions/${mission.id}/reports`, { asc });
  await expect(state).not.toHaveText(/^not steering/);
  await expect(page).not.toHaveTitle(/not steering/);
  await service.post(`/v1/missions/${mission.id}/finish`, {});
  await expect(state).toHaveText("finished");
  expect(complaints).toEqual([]);
});

test("a degraded plan says why, in the mission, its title and the list", async ({ page, service, complaints }) => {
  const mission = await liveMission(service, { title: "silent", fixAge: 1000 });
  try {
    await go(page, service, `#/mission/${mission.id}`);
    await expect(page.locator(".chip.state.bad")).toHaveText("degraded: the goal's last report is too old; hold answers");
    await expect(page.locator(".chip.good")).toHaveCount(0);
    await expect(page).toHaveTitle("⚠ degraded · silent · Pilotfish");
    await go(page, service, "");
    const row = page.locator("tr", { has: page.getByRole("link", { name: "silent" }) });
    await expect(row.locator(".chip.bad")).toHaveText("degraded");
    await expect(row).toContainText("the goal's last report is too old");
  } finally {
    await mission.stop();
    await service.post(`/v1/missions/${mission.id}/finish`, {});
  }
  expect(complaints).toEqual([]);
});

test("a craft that does not do what is asked is an alarm", async ({ page, service, complaints }) => {
  const mission = await liveMission(service, { title: "stuck", stuck: true });
  try {
    await go(page, service, `#/mission/${mission.id}`);
    await expect(page.locator(".chip.state.bad")).toHaveText(/does not (follow|respond)/, { timeout: 60_000 });
    await expect(page).toHaveTitle(/^⚠ .*does not (follow|respond) · stuck/);
    await expect(page.locator(".warnings .violated").first()).toContainText("check");
    await go(page, service, "");
    await expect(page.locator("tr", { has: page.getByRole("link", { name: "stuck" }) }).locator(".chip.bad")).toHaveText(/does not (follow|respond)/);
  } finally {
    await mission.stop();
    await service.post(`/v1/missions/${mission.id}/finish`, {});
  }
  expect(complaints).toEqual([]);
});

test("without a service the page does not claim to know", async ({ page, complaints }) => {
  const service = await startService(), mission = await liveMission(service, { title: "cut off" });
  await go(page, service, `#/mission/${mission.id}`);
  await expect(page.locator(".chip.state")).toHaveText("steering");
  await service.kill();
  await expect(page.locator(".chip.state.bad")).toHaveText(/^state not known \d+\u00a0s: connection lost: .*; trying again$/);
  await expect(page.locator(".chip.good")).toHaveCount(0);
  await expect(page).toHaveTitle(/^⚠ state not known \d+\u00a0s · cut off/);
  await mission.stop();
  await rm(service.data, { recursive: true, force: true });
  const others = complaints.splice(0).filter((complaint) => !/ERR_(CONNECTION|INCOMPLETE|EMPTY|NETWORK)/.test(complaint) && !complaint.includes(service.url));
  expect(others).toEqual([]);
});

test("the alarm sounds only if it is asked for, until it is acknowledged, and the log has its begin and end", async ({ page, service, complaints }) => {
  await page.addInitScript(() => {
    window.rung = window.notified = 0;
    const { start } = OscillatorNode.prototype;
    OscillatorNode.prototype.start = function (...when) { window.rung += 1; return start.apply(this, when); };
    window.Notification = class { static permission = "granted"; constructor(words) { window.notified += 1; window.noticed = words; } };
  });
  const rung = () => page.evaluate(() => window.rung);
  const mission = await liveMission(service, { title: "left open" });
  await go(page, service, `#/mission/${mission.id}`);
  const button = page.getByRole("button", { name: "Alarm sound" }), acknowledge = page.getByRole("button", { name: "Acknowledge" });
  await expect(page.locator(".chip.state")).toHaveText("steering");
  await expect(button).toHaveText("Alarm sound: off");
  await mission.stop();
  await expect(page.locator(".chip.state")).toHaveText(/^not steering/, { timeout: 40_000 });
  await page.waitForTimeout(4000);
  expect(await rung()).toBe(0);
  await expect(acknowledge).toBeHidden();
  await button.click();
  await expect(button).toHaveText("Alarm sound: on");
  await expect.poll(rung, { timeout: 15_000 }).toBeGreaterThan(0);
  expect(await page.evaluate(() => [window.notified, window.noticed])).toEqual([1, "left open: not steering: waits for reports of the surface craft"]);
  const before = await rung();
  await expect.poll(rung, { timeout: 15_000 }).toBeGreaterThan(before);
  await acknowledge.click();
  const quiet = await rung();
  await page.waitForTimeout(12_000);
  expect(await rung()).toBe(quiet);
  await expect(page.locator(".log")).toContainText("alarm: not steering: waits for reports of the surface craft");
  const state = { north_m: 0, east_m: 0, heading_rad: 0, speed_mps: 0, sway_mps: 0, yaw_rate_radps: 0 };
  await service.post(`/v1/missions/${mission.id}/reports`, { asc: [{ t_s: Date.now() / 1000, state }] });
  await expect(page.locator(".log")).toContainText(/alarm over: not steering, after \d+\u00a0s/);
  await page.reload();
  await expect(button).toHaveText("Alarm sound: on");
  // What was not seen happen is in the log as well.
  await expect(page.locator(".log")).toContainText(/alarm over: not steering, after \d+\u00a0s/);
  await service.post(`/v1/missions/${mission.id}/finish`, {});
  expect(complaints).toEqual([]);
});
