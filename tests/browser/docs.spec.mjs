// The documentation at /docs: calls are read, found and tried where the service runs.

import { createRequire } from "node:module";
import { readFile } from "node:fs/promises";
import { expect, expected, go, test } from "./fixtures.mjs";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const HOSTILE = "<img src=x onerror=alert(1)></script><script>alert(1)</script>";

async function open(page, service, call) {
  await page.goto(`${service.url}/docs#${call}`);
  const view = page.locator(`#${call}`);
  await view.getByRole("button", { name: "Try it" }).waitFor();
  return view;
}

test("a plan is asked for with the example, and the answer is shown", async ({ page, service }) => {
  const view = await open(page, service, "plan");
  await expect(view.getByLabel("curl")).toContainText(`curl -s -X POST '${service.url}/v1/plan'`);
  await view.getByRole("button", { name: "Try it" }).click();
  await expect(view.locator(".answer .chip")).toHaveText(/^200/);
  await expect(view.getByLabel("Headers")).toContainText("application/json");
  const plan = JSON.parse(await view.getByLabel("Answer").textContent());
  expect(plan.method).toBe("mpc");
  expect(plan.reference.heading_deg).toBeGreaterThanOrEqual(0);
});

test("every call that has a body has an example that the service accepts", async ({ page, service }) => {
  const document = await service.get("/openapi.json");
  const { id } = await service.post("/v1/missions", { schema_version: "1.0", live: { auvs: [{ id: "auv-1" }], goal: { kind: "track", auv: "auv-1" } } });
  const bodies = Object.entries(document.paths).flatMap(([path, item]) => Object.values(item).filter((call) => call.requestBody?.content["application/json"]).map((call) => [path, call.operationId]));
  expect(bodies.length).toBeGreaterThan(7);
  await service.post(`/v1/missions/${id}/run`, {});
  for (const [path, call] of bodies) {
    const view = await open(page, service, call);
    // Steps and speed are a simulated mission's.
    const { id: simulated } = await service.post("/v1/missions", { schema_version: "1.0", simulated: { scenario: "calm" } });
    if (path.includes("{id}")) await view.getByRole("textbox", { name: /^id/ }).fill(/step|run/.test(call) ? simulated : id);
    await view.getByRole("button", { name: "Try it" }).click();
    await expect(view.locator(".answer .chip"), call).toHaveText(/^20[01]/);
  }
});

test("plans come first", async ({ page, service }) => {
  await open(page, service, "plan");
  await expect(page.getByRole("heading", { level: 2 }).first()).toHaveText("plan");
});

test("a search leaves the calls that have its words, and a refusal is shown as it is", async ({ page, service, complaints }) => {
  await page.goto(`${service.url}/docs`);
  await page.getByLabel("Search").fill("missions reports");
  await expect(page.locator("#post_reports")).toBeVisible();
  await expect(page.locator("#plan")).toBeHidden();
  const view = await open(page, service, "get_mission");
  await view.getByRole("textbox", { name: /^id/ }).fill("none/../x");
  await view.getByRole("button", { name: "Try it" }).click();
  await expect(view.locator(".answer .chip")).toHaveText(/^404/);
  await expect(view.getByLabel("Answer")).toContainText("no_mission");
  // The browser itself reports the status.
  expect(expected(complaints, /404/)).toBe(true);
});

test("texts of the document and of answers stay text", async ({ page, service, complaints }) => {
  page.on("dialog", (dialog) => { complaints.push(`a dialog opened: ${dialog.message()}`); dialog.dismiss(); });
  await page.route("**/openapi.json", async (route) => {
    const document = await (await route.fetch()).json(), { post } = document.paths["/v1/plan"];
    Object.assign(post, { summary: HOSTILE, description: HOSTILE, tags: [HOSTILE] });
    document.info.description = HOSTILE;
    Object.assign(document.components.schemas.PlanRequest.properties, { [HOSTILE]: { type: "string", description: HOSTILE, default: HOSTILE } });
    await route.fulfill({ json: document });
  });
  await page.route("**/v1/plan", (route) => route.fulfill({ contentType: "text/html", body: HOSTILE }));
  const view = await open(page, service, "plan");
  await view.getByRole("button", { name: "Try it" }).click();
  await expect(view.getByLabel("Answer")).toHaveText(HOSTILE);
  expect(await page.locator("main img, main script").count()).toBe(0);
});

test("nothing serious is found in any theme, wide and on a phone, and nothing is wider than the screen", async ({ page, service, complaints }) => {
  const view = await open(page, service, "patch_mission");
  await view.getByRole("textbox", { name: /^id/ }).fill("none");
  await view.getByRole("button", { name: "Try it" }).click();
  await expect(view.locator(".answer .chip")).toBeVisible();
  await page.evaluate(await readFile(AXE, "utf8"));
  for (const theme of ["light", "dark", "sun", "night"]) {
    await page.locator("#theme").selectOption(theme);
    for (const width of [1280, 390]) {
      await page.setViewportSize({ width, height: 844 });
      const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
      const serious = violations.filter(({ impact }) => ["serious", "critical"].includes(impact));
      expect(serious.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.target.join(" ")).join(" | ")}`), `${theme}, ${width} px`).toEqual([]);
      expect(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), `${width} px`).toBeLessThanOrEqual(0);
    }
  }
  expect(expected(complaints, /404/)).toBe(true);
});

test("the page of missions loads nothing of it", async ({ page, service }) => {
  const loaded = [];
  page.on("request", (request) => loaded.push(new URL(request.url()).pathname));
  await go(page, service, "");
  expect(loaded.filter((path) => path.startsWith("/docs"))).toEqual([]);
});
