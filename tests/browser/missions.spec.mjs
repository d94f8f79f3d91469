// Missions: from the gallery to the end, scrubbed, compared; live ones watched and steered.

import { expect, go, isDrawn, settled, test } from "./fixtures.mjs";
import { flown, hastened, posed, stepped } from "./service.mjs";

const picture = (page) => page.locator(".map-place canvas").first().evaluate((canvas) => canvas.toDataURL());

test("a scenario runs from the gallery to its end, and any moment of it can be looked at", async ({ page, service }) => {
  // The page begins it at a speed to watch. Here it is begun so slowly that it is not over before it is paused.
  const runs = [];
  await page.route("**/v1/missions/*/run", (route) => {
    runs.push(route.request().postDataJSON());
    return route.continue(runs.length === 1 ? { postData: { speed_factor: 0.1 } } : {});
  });
  await go(page, service, "");
  // Of the groups the first is open, until something is looked for.
  await expect(page.getByRole("heading", { name: "paper-midpoint" })).toBeVisible();
  await expect(page.getByRole("heading", { name: "about-face" })).toBeHidden();
  await page.getByLabel("Find").fill("about opposite");
  await expect(page.locator(".gallery-card:visible")).toHaveCount(1);
  const card = page.locator(".gallery-card", { has: page.getByRole("heading", { name: "about-face", exact: true }) });
  await card.getByRole("button", { name: /^Run/ }).click();
  await expect(page.locator(".mission-head h1")).toContainText("about-face");
  await expect(page.locator(".chips")).toContainText("running");
  await expect.poll(() => isDrawn(page.locator(".map-place canvas").first())).toBe(true);
  // The rest as fast as it can.
  await page.getByRole("button", { name: "Pause", exact: true }).click();
  await expect(page.locator(".chips")).toContainText("paused");
  await page.getByLabel("Speed of the simulation").selectOption("as fast as possible");
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await service.ended(page.url().split("/").at(-1));
  await expect(page.locator(".chips")).toContainText("finished");
  expect(runs).toEqual([{ speed_factor: 60 }, {}]);

  const slider = page.getByLabel("Time shown"), clock = page.locator(".clock"), map = page.locator(".map-place canvas").first();
  await slider.fill("500");
  await expect(clock).toHaveText(/^0[45]:\d\d of 10:00/);
  const middle = await clock.textContent();
  await slider.press("ArrowRight");
  await expect(clock).not.toHaveText(middle ?? "");
  await expect(page.locator(".now").nth(1)).toContainText("heading lag");
  const before = await map.evaluate((canvas) => canvas.toDataURL());
  await slider.fill("200");
  await expect.poll(() => map.evaluate((canvas) => canvas.toDataURL())).not.toBe(before);
  await page.getByRole("button", { name: "Worst minute" }).click();
  await expect(page.locator(".log")).toContainText("root mean square over a minute");
  // It plays thirty times as fast as life.
  await slider.fill("200");
  await expect(clock).toHaveText("02:00 of 10:00");
  await page.clock.install();
  await page.clock.pauseAt(Date.now() + 3_600_000);
  await page.getByRole("button", { name: /Play/ }).click();
  await page.clock.runFor(1000);
  await expect(clock).toHaveText(/^02:(29|30) of 10:00$/);
  await expect(page.getByRole("button", { name: /Pause/ }).last()).toBeVisible();
});

test("the list names the controllers of simulated missions, and cards say what visits and ranges were worth", async ({ page, service }) => {
  for (const controller of [undefined, "saturated_los"]) await service.post("/v1/missions", { schema_version: "1.0", title: `by ${controller}`, simulated: { scenario: "calm", controller } });
  await service.post("/v1/missions", { schema_version: "1.0", title: "by nobody", live: { auvs: [{ id: "auv-1" }], goal: { kind: "track", auv: "auv-1" } } });
  await go(page, service, "#/");
  for (const [title, kind] of [["by undefined", "simulated, planner"], ["by saturated_los", "simulated, line of sight"], ["by nobody", "live"]]) {
    await expect(page.locator("tr", { hasText: title }).locator(".kind")).toHaveText(kind);
  }
  const { scenarios } = await service.get("/gallery.json"), costs = { age: "s since a visit", uncertainty: "m² of variance", data: "kbit not uploaded" };
  for (const { name, visits, localised_rms_m } of scenarios.filter((scenario) => /^(visit|localise)-/.test(scenario.name))) {
    const words = visits ? `Planner: ${visits.n} visits, mean ${visits.mean.toFixed(1)} ${costs[visits.cost]}` : `Planner: AUVs ${localised_rms_m.toFixed(1)} m off (RMS)`;
    await expect(page.locator(".gallery-card", { has: page.getByRole("heading", { name, exact: true, includeHidden: true }) })).toContainText(words);
  }
});

test("the slider of a simulated mission that is under way is as full as its time is over", async ({ page, service }) => {
  const { id } = await service.post("/v1/missions", { schema_version: "1.0", title: "under way", simulated: { scenario: "about-face", seed: 1 } });
  await stepped(service, id, 151);
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator(".clock")).toHaveText("02:30 of 10:00");
  await expect(page.getByLabel("Time shown")).toHaveValue("250");
  await page.getByLabel("Time shown").fill("900");
  await expect(page.locator(".clock")).toHaveText("02:30 of 10:00");
  await page.getByLabel("Time shown").fill("125");
  await expect(page.locator(".clock")).toHaveText("01:15 of 10:00");
});

test("two controllers are compared on one clock, with a winner, and the information that each has", async ({ page, service }) => {
  // One was begun before and broken off: it is flown again.
  const { version } = await service.get("/version");
  const begun = await fetch(`${service.url}/v1/missions`, {
    method: "POST", headers: { "content-type": "application/json", "idempotency-key": `compare ${version} about-face 1 mpc` },
    body: JSON.stringify({ schema_version: "1.0", title: "about-face, seed 1: planner", simulated: { scenario: "about-face", seed: 1 } }),
  });
  const { id } = await begun.json();
  await service.post(`/v1/missions/${id}/step`, { ticks: 3 });
  await service.post(`/v1/missions/${id}/finish`, {});
  const runs = [];
  page.on("response", (answer) => { if (answer.url().endsWith("/run")) runs.push(answer.url().split("/").at(-2)); });
  // Of no known controller, it is one of the usual.
  await go(page, service, "#/compare?scenario=about-face&seed=1&controllers=nonsense");
  await expect.poll(() => runs.length).toBe(2);
  for (const run of runs) await service.ended(run);
  await expect(page.locator(".notice")).toContainText("Flown");
  await expect(page.locator(".notice a")).toHaveText(["planner", "line of sight, tracker frame"]);
  await expect(page.locator(".notice a").first()).not.toHaveAttribute("href", `#/mission/${id}`);
  const rms = page.locator(".scores tbody tr").first();
  await expect(rms.locator("td.better")).toHaveCount(1);
  await expect(rms.locator(".winner")).toHaveText("planner");
  await expect(page.locator(".scores")).toContainText("information given");
  await expect(page.locator(".information").last()).not.toHaveText("–");
  // The opponent is the strongest law, with the gains that are tuned for the scenario.
  await expect(page.getByLabel("line of sight, tracker frame (strongest here)")).toBeChecked();
  await expect(page.locator(".scores")).toContainText(/look-ahead \d+ m, along-track [\d.]+ 1\/s/);
  await expect(page.locator(".map-place canvas")).toHaveCount(2);
  const { missions } = await service.get("/v1/missions?limit=1000");
  expect(missions.filter(({ title }) => title.startsWith("about-face, seed 1: ")).map(({ status }) => status)).toEqual(["finished", "finished", "finished"]);
  // The same address shows the same runs, and makes no others. Both maps say what was planned, also of runs that were flown before.
  await page.reload();
  await expect(page.locator(".notice")).toContainText("Flown");
  expect((await service.get("/v1/missions?limit=1000")).missions.filter(({ title }) => title.startsWith("about-face, seed 1: "))).toHaveLength(3);
  const fetched = page.waitForResponse((answer) => answer.url().includes("kinds=planned"));
  await page.getByLabel("Time shown").fill("300");
  expect((await (await fetch((await fetched).url())).text()).includes('"prediction"')).toBe(true);
  // A moment that was chosen stays when the maps are put together: 300 of the slider's 1000 steps.
  const clock = page.locator(".clock"), chosen = await clock.textContent();
  expect(chosen).toMatch(/^0[23]:\d\d of 10:00/);
  await page.getByLabel("a map each").uncheck();
  await expect(page.locator(".map-place canvas")).toHaveCount(1);
  await expect(clock).toHaveText(chosen);
  await page.getByLabel("a map each").check();
  for (const [name, ending] of [["Save PNG", ".png"], ["Save CSV", ".csv"]]) {
    const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name }).click()]);
    expect(saved.suggestedFilename()).toBe(`about-face-seed-1${ending}`);
  }
  // A link to the missions themselves is for everybody who may read.
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.getByRole("button", { name: "Copy link" }).click();
  await expect(page.locator(".scores .row")).toContainText("copied");
  const link = await page.evaluate(() => navigator.clipboard.readText());
  expect(link).toContain("missions=");
  await page.goto(link);
  await page.reload();
  await expect(page.locator(".notice")).toContainText("Flown");
  await expect(page.locator(".scores tbody tr").first().locator(".winner")).toHaveText("planner");
  await expect(page.locator("#compare-scenario")).toHaveValue("about-face");
});

test("what two runs did otherwise is said, also of runs that are not whole", async ({ page, service }) => {
  const ids = [];
  for (const controller of ["mpc", "saturated_los_tracker_frame"]) ids.push(await flown(service, { scenario: "switching", seed: 1, controller }, `cut: ${controller}`, 300));
  await go(page, service, `#/compare?missions=${ids}`);
  await expect(page.locator(".notice")).toContainText("planner did not run to its end");
  await expect(page.locator(".why-differ")).toContainText(/At the hand-over: planner left \d+\u00a0s before and was \d+\u00a0m off; line of sight, tracker frame had not left/);
});

test("runs along a line from south to north have taller maps than others", async ({ page, service }) => {
  const heights = [];
  for (const scenario of ["paper-tracking", "survey-lanes"]) {
    const ids = [];
    for (const controller of ["mpc", "saturated_los"]) ids.push(await flown(service, { scenario, seed: 1, controller }, `${scenario}: ${controller}`, 60));
    await go(page, service, `#/compare?missions=${ids}`);
    await expect(page.locator(".notice")).toContainText("did not run to its end");
    await settled(page);
    heights.push((await page.locator(".map-place").first().boundingBox()).height);
  }
  expect(heights[0]).toBeGreaterThan(1.3 * heights[1]);
});

test("a live mission that waits says what to run, which the service accepts", async ({ page, service }) => {
  const { id } = await service.post("/v1/missions", { schema_version: "1.0", live: { auvs: [{ id: "auv-9" }], goal: { kind: "track", auv: "auv-9" } } });
  await service.post(`/v1/missions/${id}/run`, {});
  await go(page, service, `#/mission/${id}`);
  const [bridge, curl] = await page.locator(".empty pre").allTextContents(), [, url, body] = /^curl -s (\S+) .* -d '(.*)'$/.exec(curl);
  expect(bridge).toContain(`pilotfish bridge mavlink --url ${service.url} --mission ${id} `);
  expect(url).toBe(`${service.url}/v1/missions/${id}/reports`);
  await expect(page.getByRole("heading", { name: "Now" })).toBeHidden();
  const report = JSON.parse(body.replaceAll("'$(date +%s)'", Math.floor(Date.now() / 1000)));
  expect((await service.post(url.slice(service.url.length), report)).rejected ?? []).toEqual([]);
  await expect(page.getByRole("heading", { name: "Now" })).toBeVisible();
  await expect(page.locator(".empty")).toBeHidden();
});

test("a time without data is a gap in a chart, with few points and with many", async ({ page, service }) => {
  await go(page, service, "");
  const dark = await page.evaluate(async () => {
    const [{ drawChart }, { chartsOf }, { Recording }] = await Promise.all(["/chart_canvas.js", "/curves.js", "/recording.js"].map((path) => import(path)));
    return [1, 0.01].map((step) => {
      const recording = new Recording({ id: "m", kind: "live", status: "running", scene: {} });
      for (let t = 0; t < 100; t += step) if (t < 40 || t > 66) recording.takeGoal(t, 0, 0, 50, NaN);
      const [chart] = chartsOf([{ name: "", colour: "plan", recording }]), canvas = document.body.appendChild(document.createElement("canvas"));
      canvas.style.cssText = "width: 600px; height: 132px";
      drawChart({ chart, canvas, values: chart.curves.map(() => document.createElement("b")) }, { from: 0, to: 100, cursor: null, events: [], first: false, drag: null, formatX: String });
      const context = canvas.getContext("2d"), ratio = canvas.width / 600, plain = context.getImageData(canvas.width - 2, 2, 1, 1).data.join();
      // A column of pixels at these times, above the axis and between the lines of the grid.
      return [20, 53, 90].map((t) => {
        const { data } = context.getImageData(Math.round((54 + (t / 100) * (600 - 66)) * ratio), 0, 1, Math.round(40 * ratio));
        let n = 0;
        for (let i = 0; i < data.length; i += 4) if (data.slice(i, i + 4).join() !== plain && data[i + 2] > data[i] + 60) n += 1;
        return n > 0;
      });
    });
  });
  expect(dark).toEqual([[true, false, true], [true, false, true]]);
});

test("the faults of a scenario are in the log of its mission, in its charts, and in what the controller is said to know", async ({ page, service }) => {
  const id = await flown(service, { ...await hastened("faults"), seed: 1 }, "with faults");
  await go(page, service, `#/mission/${id}`);
  const log = page.locator(".log");
  for (const words of ["fault: the port thruster delivers 60 % of its thrust", "fault over: the craft has no GNSS position", "fault: auv-1 loses power and sends nothing"]) await expect(log).toContainText(words);
  await expect(page.locator(".about").first()).toContainText("at once and exact, except while a fault stops its messages");
  // Moved to the fault, the chart says it.
  await expect(page.locator(".mission-head progress")).toBeHidden();
  await log.getByRole("button", { name: "02:30" }).click();
  await expect(page.locator(".chart-canvas").first()).toHaveAttribute("aria-label", /fault: auv-1 loses power/);
  await expect(page.locator(".explained")).toContainText("line of sight");
  await expect(page.locator(".now").first()).toContainText(/predicted cost(as much as|[\d.]+\u00a0% (less|more) than) line of sight/);
});

test("a stored mission says what its planner believed at any time, in a browser that does not go through streams by itself, too", async ({ page, service }) => {
  await page.addInitScript(() => { delete ReadableStream.prototype[Symbol.asyncIterator]; });
  const id = await flown(service, { scenario: "noisy-fixes", seed: 3 }, "stored", 60);
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator(".chips")).toContainText("finished");
  await expect.poll(() => isDrawn(page.locator(".map-place canvas").first())).toBe(true);
  await page.getByLabel("Time shown").fill("300");
  await expect(page.locator(".now").nth(1)).toContainText("95 %");
  await expect(page.locator(".map-place canvas").first()).toHaveAttribute("aria-label", /m from the goal/);
});

test("on the first page what is open stays open, and what has the focus keeps it, while missions go on", async ({ page, played }) => {
  const watched = await played("steered"), row = page.locator("tr", { has: page.getByRole("link", { name: "recorded" }) });
  await watched.open("");
  await row.locator("a").focus();
  await row.locator("summary").click();
  await row.locator("a").focus();
  await page.evaluate(() => { document.querySelector("tbody tr").marked = true; });
  const lags = new Set();
  for (let second = 0; second < 6; second += 1) {
    await watched.pass(1);
    lags.add(await row.locator("td").nth(2).textContent());
    expect(await row.locator("a").evaluate((link) => link === document.activeElement)).toBe(true);
    expect(await row.locator("details").evaluate((details) => details.open)).toBe(true);
    expect(await page.evaluate(() => document.querySelector("tbody tr").marked)).toBe(true);
  }
  expect(lags.size, `lags ${[...lags]}`).toBeGreaterThan(1);
  // What runs is not offered for deletion.
  await expect(row.getByText("Delete")).toBeHidden();
});

test("a route file is dropped on the map, way-points are clicked, and both become the AUV's path", async ({ page, service, complaints }) => {
  const id = await posed(service, { title: "routed", origin: { lat_deg: 38.41, lon_deg: -9.12 } });
  const paths = async () => (await service.get(`/v1/missions/${id}/scene`)).paths;
  await go(page, service, `#/mission/${id}`);
  const map = page.locator(".map-place canvas"), said = page.locator(".orders > .said");
  await expect(map).toHaveAttribute("aria-label", /auv-2 at/);
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
  await expect(said).toHaveText("Change of the route: done");
  expect(Object.keys(await paths())).toEqual(["auv-1", "auv-2"]);
  await expect(page.locator(".log")).toContainText("paths");
});

test("a file of polygons is dropped on the map, drawn before it is sent, and becomes the mission's no-go areas", async ({ page, service, complaints }) => {
  const id = await posed(service, { title: "coast", origin: { lat_deg: 38.41, lon_deg: -9.12 } });
  const noGo = async () => (await service.get(`/v1/missions/${id}`)).setting.no_go ?? [];
  await go(page, service, `#/mission/${id}`);
  const map = page.locator(".map-place canvas"), said = page.locator(".orders > .said"), areas = page.locator(".order.no-go");
  await expect(map).toHaveAttribute("aria-label", /auv-2 at/);
  const drop = async (features) => map.dispatchEvent("drop", { dataTransfer: await page.evaluateHandle((text) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([text], "coast.geojson"));
    return transfer;
  }, JSON.stringify({ type: "FeatureCollection", features })) });
  const square = (lat, lon, half) => [[lon - half, lat - half], [lon + half, lat - half], [lon + half, lat + half], [lon - half, lat + half], [lon - half, lat - half]];
  const feature = (name, ...coordinates) => ({ type: "Feature", properties: { name }, geometry: { type: "Polygon", coordinates } });
  const before = await picture(page);
  await drop([feature("atoll", square(38.4105, -9.12, 0.0004), square(38.4105, -9.12, 0.0002)), feature("rock", square(38.4092, -9.1205, 0.0001))]);
  await expect(areas).toContainText("coast.geojson: 2 areas with 12 corners, not sent yet");
  await settled(page);
  const drafted = await picture(page);
  expect(drafted).not.toBe(before);
  expect(await noGo()).toEqual([]);
  await areas.getByRole("button", { name: "Send the areas" }).click();
  await expect(said).toHaveText("No-go areas: done");
  const [{ name, polygon, holes }, rock] = await noGo();
  expect([name, polygon.length, holes.map((ring) => ring.length), rock.name]).toEqual(["atoll", 4, [4], "rock"]);
  // Four ten-thousandths of a degree of the meridian are 44.4 m.
  expect(Math.max(...polygon.map(([north]) => north)) - Math.min(...polygon.map(([north]) => north))).toBeCloseTo(88.8, 0);
  await expect(areas).toContainText("The mission has 2 no-go areas");
  // What the service refuses is said, and what is a route is none.
  await drop([feature("bow tie", [[-9.12, 38.41], [-9.119, 38.411], [-9.12, 38.411], [-9.119, 38.41], [-9.12, 38.41]])]);
  await areas.getByRole("button", { name: "Send the areas" }).click();
  await expect(said).toContainText("crosses the side after");
  expect(complaints.splice(0).every((complaint) => complaint.includes("422"))).toBe(true);
  page.once("dialog", (dialog) => dialog.accept());
  await areas.getByRole("button", { name: "Remove all no-go areas" }).click();
  await expect(said).toHaveText("No-go areas: done");
  expect(await noGo()).toEqual([]);
});

test("a no-go area is drawn by taps beside those that the mission has, a corner is moved and one removed, and it is sent", async ({ page, service }) => {
  const rock = { name: "rock", polygon: [[60, 60], [70, 60], [70, 70]] };
  const id = await posed(service, { title: "drawn", no_go: [rock] });
  const noGo = async () => (await service.get(`/v1/missions/${id}`)).setting.no_go;
  await go(page, service, `#/mission/${id}`);
  const map = page.locator(".map-place canvas"), said = page.locator(".orders > .said"), areas = page.locator(".order.no-go"), readout = page.locator(".map-readout");
  await expect(map).toHaveAttribute("aria-label", /auv-2 at/);
  await areas.locator("summary").click();
  await expect(areas).toContainText("The mission has 1 no-go area");
  await areas.getByRole("button", { name: "Draw" }).click();
  const tapped = [];
  for (const [x, y] of [[300, 160], [300, 80], [380, 80], [380, 160], [340, 40]]) {
    await map.click({ position: { x, y } });
    tapped.push((await readout.textContent()).replaceAll("−", "-").match(/(-?[\d.]+)\u00a0m N, (-?[\d.]+)\u00a0m E/).slice(1).map(Number));
  }
  await expect(areas).toContainText("On the map: 2 areas with 8 corners, not sent yet");
  // The last corner is taken away, and the third one moved to where that was.
  await map.click({ position: { x: 340, y: 40 } });
  const box = await map.boundingBox();
  await page.mouse.move(box.x + 380, box.y + 80);
  await page.mouse.down();
  await page.mouse.move(box.x + 360, box.y + 60);
  await page.mouse.move(box.x + 340, box.y + 40);
  await page.mouse.up();
  expect(await noGo()).toEqual([rock]);
  await areas.getByRole("button", { name: "Send the areas" }).click();
  await expect(said).toHaveText("No-go areas: done");
  const [first, { polygon }] = await noGo();
  expect(first).toEqual(rock);
  expect(polygon).toEqual([tapped[0], tapped[1], tapped[4], tapped[3]]);
  await expect(areas).toContainText("The mission has 2 no-go areas");
});

test("a live mission is watched as it happens, and its goal is changed", async ({ page, played }) => {
  const watched = await played("ordered");
  await watched.open("");
  await page.getByRole("link", { name: "recorded" }).click();
  await page.locator("main h1", { hasText: "recorded" }).waitFor();
  await watched.pass(1);
  await expect(page.locator(".chips")).toContainText("connected");
  const clock = page.locator(".clock"), now = await clock.textContent();
  await watched.passUntilOrder();
  expect(await clock.textContent()).not.toBe(now);
  await expect(page.locator(".now").first()).toContainText("auv-2 heard");
  await page.locator(".order summary", { hasText: "Goal" }).click();
  await page.locator(".field", { hasText: /^AUV/ }).locator("select").selectOption("auv-2");
  await page.getByRole("button", { name: "Send…" }).click();
  await page.locator(".orders dialog").getByRole("button", { name: "Send" }).click();
  await expect(page.locator(".orders > .said")).toHaveText("Orders: done");
  await watched.pass(1);
  await expect(page.locator(".log")).toContainText("changed");
  // An entry of the log that is pressed is clicked, although the log gains another before it is let go.
  const live = page.getByRole("button", { name: "Live", exact: true });
  await expect(live).toHaveAttribute("aria-pressed", "true");
  const oldest = page.locator(".log button").last();
  await oldest.hover();
  await page.mouse.down();
  await watched.pass(3);
  await expect(page.locator(".chips")).toContainText("paused");
  await expect(page.locator(".log")).not.toContainText("paused");
  // What is above the log may have grown by a line.
  await oldest.hover();
  await page.mouse.up();
  await watched.settled();
  await expect(live).toHaveAttribute("aria-pressed", "false");
  await watched.pass(1);
  await expect(page.locator(".log")).toContainText("paused");
});
