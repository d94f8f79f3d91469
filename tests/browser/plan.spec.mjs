// One snapshot: planned, edited into an error and back, kept over a reload.

import { expect, expected, go, isDrawn, settled, test } from "./fixtures.mjs";

const status = (page) => page.locator(".plan-status");
const editor = (page) => page.getByLabel(/^Snapshot, JSON/);
/** The page checks what is typed when nothing was typed for a while: the test says when. */
const TYPED_MS = 1_000;

/** Opens an example with the test's clock, and returns what types a text. */
async function opened(page, service, example) {
  await page.clock.install();
  await page.clock.pauseAt(Date.now() + 3_600_000);
  await go(page, service, `#/plan?example=${example}`);
  await expect(status(page)).toHaveText("planned");
  return async (text) => {
    await editor(page).fill(text);
    await page.clock.runFor(TYPED_MS);
  };
}

test("every example is planned and drawn", async ({ page, service }) => {
  const { examples } = await service.get("/v1/examples");
  expect(examples.length).toBeGreaterThan(5);
  const seen = new Set();
  for (const { name } of examples) {
    await go(page, service, "");
    await go(page, service, `#/plan?example=${name}`);
    await expect(status(page), name).toHaveText(/planned|degraded/);
    const map = page.locator(".map-place canvas");
    await expect.poll(() => isDrawn(map), { message: name }).toBe(true);
    seen.add(await map.evaluate((canvas) => canvas.toDataURL()));
  }
  expect(seen.size, "no two pictures are the same").toBe(examples.length);
});

test("a plan that localises draws the AUVs' expected errors over the next minutes, and other plans none", async ({ page, service }) => {
  await go(page, service, "#/plan?example=localise");
  await expect(status(page)).toHaveText("planned");
  const { figure: { vehicles } } = await service.post("/v1/plan", await service.get("/v1/examples/localise"));
  const panel = page.getByRole("region", { name: "Expected errors of the AUVs" }), canvas = panel.locator("canvas");
  await expect.poll(() => isDrawn(canvas)).toBe(true);
  // Without a cursor the legend has the last values.
  for (const { auv, over_time } of vehicles) {
    const [, onFigure, above] = over_time.at(-1);
    await expect(canvas).toHaveAttribute("aria-label", new RegExp(`${auv} ${onFigure.toFixed(2)};.*${auv}, if it stayed above ${above.toFixed(2)}`));
  }
  await page.getByLabel("Example").selectOption("track");
  await expect(panel).toBeHidden();
});

test("an error stands at its field as one types, the old plan is dimmed, and both go with the error", async ({ page, service, complaints }) => {
  const type = await opened(page, service, "track");
  const right = await editor(page).inputValue();
  const wrong = right.replace(/"heading_rad": [-\d.]+/, '"heading_rad": 19');
  expect(wrong).not.toBe(right);
  await type(wrong);
  const error = page.locator(".editor-errors li");
  await expect(error).toHaveCount(1);
  await expect(error).toContainText("/asc/heading_rad");
  const line = 1 + right.split("\n").findIndex((text) => text.includes("heading_rad"));
  await expect(error.getByRole("button")).toHaveText(`line ${line}`);
  await expect(page.locator(".editor-gutter .wrong")).toHaveText(String(line));
  await editor(page).press("Control+Enter");
  await expect(status(page)).toHaveText("refused");
  await expect(page.locator(".plan-results")).toHaveClass(/of-before/);
  // Chromium writes every status above 399 to the console; nothing else may be there.
  // One for the check as one types, one for the plan that was asked for.
  await expect.poll(() => complaints.length).toBe(2);
  expect(complaints.splice(0).every((complaint) => complaint.includes("422"))).toBe(true);
  await type("{");
  await expect(page.locator(".editor-state")).not.toHaveText("valid");
  await expect.poll(() => complaints.length).toBeGreaterThan(0);
  expect(complaints.splice(0).every((complaint) => complaint.includes("400"))).toBe(true);
  await type(right);
  await expect(page.locator(".editor-state")).toHaveText("valid");
  await expect(error).toHaveCount(0);
  await editor(page).press("Control+Enter");
  await expect(status(page)).toHaveText("planned");
  await expect(page.locator(".plan-results")).not.toHaveClass(/of-before/);
});

test("discs, areas and fixes in degrees are drawn where the same ones in metres are", async ({ page, service }) => {
  const { keep_outs: [disc], area, ...request } = await service.get("/v1/examples/crowded");
  // A degree of latitude and of longitude at the equator, on WGS 84.
  const north_per_deg = 110_574.28, east_per_deg = 111_319.49, origin = { lat_deg: 0, lon_deg: 12 };
  const place = (north_m, east_m) => ({ lat_deg: north_m / north_per_deg, lon_deg: 12 + east_m / east_per_deg });
  const land = [[-40, -40], [-40, 10], [-20, 10], [-20, -20]];
  const inMetres = { ...request, origin, keep_outs: [disc], area, no_go: [{ polygon: land }] };
  const inDegrees = { ...inMetres, keep_outs: [{ ...place(disc.north_m, disc.east_m), radius_m: disc.radius_m }], area: area.map(([north, east]) => place(north, east)), no_go: [{ polygon: land.map(([north, east]) => place(north, east)) }] };
  const elsewhere = { ...inDegrees, keep_outs: [{ ...place(disc.north_m, disc.east_m + 20), radius_m: disc.radius_m }] };
  // One answer for all three, so that the request's own places alone differ.
  const answer = await service.post("/v1/plan/compare", inMetres);
  await page.route("**/v1/plan/compare*", (route) => route.fulfill({ json: answer }));
  const type = await opened(page, service, "crowded");
  const draw = async (snapshot) => {
    await type(JSON.stringify(snapshot));
    await expect(page.locator(".editor-state")).toHaveText("valid");
    await Promise.all([page.waitForResponse("**/v1/plan/compare*"), editor(page).press("Control+Enter")]);
    await expect(status(page)).toHaveText("planned");
    await page.clock.runFor(TYPED_MS);
    // How many values are visibly other than those of the first picture.
    return page.locator(".map-place canvas").evaluate((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      window.first ??= data;
      return data.filter((value, i) => Math.abs(value - window.first[i]) > 60).length;
    });
  };
  await draw(inMetres);
  expect(await draw(elsewhere)).toBeGreaterThan(1000);
  expect(await draw({ ...inDegrees, no_go: [] })).toBeGreaterThan(300);
  // The plane is a millimetre off here, which no line shows; a label of the grid stands on whole pixels, and one may go to the next: some 200 values.
  expect(await draw(inDegrees)).toBeLessThan(300);
});

test("the example and its edits survive a reload", async ({ page, service }) => {
  const type = await opened(page, service, "crowded");
  const edited = (await editor(page).inputValue()).replace('"t_s": 220', '"t_s": 221');
  await type(edited);
  await expect(page).toHaveURL(/edit=/);
  await page.reload();
  await expect(status(page)).toHaveText("planned");
  expect(await editor(page).inputValue()).toBe(edited);
  await expect(page.locator("#example")).toHaveValue("crowded");
});

test("nothing can be typed before the example is there, which would overwrite it", async ({ page, service }) => {
  let send;
  const held = new Promise((resume) => { send = resume; });
  await page.route("**/v1/examples/track", async (route) => { await held; await route.continue(); });
  await go(page, service, "#/plan?example=track");
  await expect(editor(page)).not.toBeEditable();
  send();
  await expect(editor(page)).toBeEditable();
  await expect(status(page)).toHaveText("planned");
});

test("the answer that was asked for last is shown, whatever comes back first", async ({ page, service }) => {
  await go(page, service, "#/plan?example=intermittent");
  await expect(status(page)).toHaveText("planned");
  const map = page.locator(".map-place canvas");
  const canned = async (name) => service.post("/v1/plan/compare", await service.get(`/v1/examples/${name}`));
  const [track, intermittent] = await Promise.all(["track", "intermittent"].map(canned));
  // The one that was asked for first comes last.
  let release;
  const held = new Promise((resume) => { release = resume; });
  await page.route("**/v1/plan/compare*", async (route) => {
    const first = JSON.parse(route.request().postData()).goal.kind === "track";
    if (first) await held;
    await route.fulfill({ json: first ? track : intermittent });
    if (!first) release();
  });
  await page.getByRole("button", { name: "Plan", exact: true }).click();
  await expect(status(page)).toHaveText("planned");
  const wanted = await map.evaluate((canvas) => canvas.toDataURL());
  const answers = [];
  page.on("response", (response) => { if (response.url().includes("/compare")) answers.push(response); });
  const asked = page.waitForRequest("**/v1/plan/compare*");
  await page.locator("#example").selectOption("track");
  await asked;
  await page.locator("#example").selectOption("intermittent");
  await expect.poll(() => answers.length).toBe(2);
  await settled(page);
  expect(await map.evaluate((canvas) => canvas.toDataURL())).toBe(wanted);
});

test("the plan is explained: program, cost by term, slack, solver log, and as a command", async ({ page, service, complaints }) => {
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await go(page, service, "#/plan?example=crowded");
  await expect(status(page)).toHaveText("planned");
  for (const title of ["Answers", "Solver", "Cost by term", "Program", "Solver log"]) await expect(page.getByRole("heading", { name: title, exact: true })).toBeVisible();
  await expect(page.getByRole("heading", { name: /^Slack/ })).toBeVisible();
  for (const [kind, begins] of [["curl", "curl -s "], ["Python", "import json"], ["Rust", "// [dependencies]"]]) {
    await page.getByRole("button", { name: kind, exact: true }).click();
    await expect(page.locator(".copy-as .said")).toContainText(kind);
    expect(await page.evaluate(() => navigator.clipboard.readText())).toMatch(begins);
  }
  // A value that would end a raw text of Rust's does not end this one.
  await editor(page).fill('{"metadata": "\\"####; evil(); //"}');
  await page.getByRole("button", { name: "Rust", exact: true }).click();
  await expect.poll(() => page.evaluate(() => navigator.clipboard.readText())).toContain("evil");
  expect(await page.evaluate(() => navigator.clipboard.readText())).toContain('let snapshot = r#####"');
  expected(complaints, /422/);
});
