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
  await expect(page.locator("p.unseen")).toHaveText(/^not steering, for more than \d+\u00a0s, waits for reports of the surface craft$/);
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
