// Orders by hand: drawn on the map of a live mission or typed beside it, and sent as one change; and what is measured on maps.

import { expect, go, test } from "./fixtures.mjs";
import { flown, posed } from "./service.mjs";

/** The page of a live mission, its map and its orders; `sent` has the bodies and the conditions of its changes. */
async function opened(page, service) {
  const id = await posed(service), sent = [];
  page.on("request", (request) => request.method() === "PATCH" && sent.push({ body: request.postDataJSON(), ifMatch: request.headers()["if-match"] }));
  await go(page, service, `#/mission/${id}`);
  const map = page.locator(".map-place canvas"), orders = page.locator(".orders");
  // The map has no places before the record is there.
  await expect(map).toHaveAttribute("aria-label", /auv-2 at/);
  const open = (title) => orders.locator("summary", { hasText: title }).click();
  const send = async () => {
    await orders.getByRole("button", { name: "Send…" }).click();
    const words = await orders.locator("dialog li").allTextContents();
    await orders.locator("dialog").getByRole("button", { name: "Send" }).click();
    return words;
  };
  const setting = async () => (await service.get(`/v1/missions/${id}`)).setting;
  return { id, sent, map, orders, open, send, setting, said: orders.locator(".said[role=status]").last() };
}

/** Where a pixel of the map is, by what the map says of it. */
async function placeAt(page, map, { x, y }) {
  await map.hover({ position: { x, y } });
  const [, north, east] = /([−\d.]+)\s+m N, ([−\d.]+)\s+m E/.exec(await page.locator(".map-readout").textContent());
  return [north, east].map((text) => Number(text.replace("−", "-")));
}

async function drag(page, map, from, to) {
  const { x, y } = await map.boundingBox();
  await page.mouse.move(x + from.x, y + from.y);
  await page.mouse.down();
  await page.mouse.move(x + (from.x + to.x) / 2, y + (from.y + to.y) / 2);
  await page.mouse.move(x + to.x, y + to.y);
  await page.mouse.up();
}

test("a keep-out that is drawn on the map is sent with the mission's revision", async ({ page, service }) => {
  const { id, sent, map, orders, send, setting, said } = await opened(page, service);
  const { revision } = await service.get(`/v1/missions/${id}`);
  // What is pressed as soon as its section is open stays pressed: the section's own event comes later.
  await orders.locator("details", { hasText: "Keep-outs" }).evaluate((section) => {
    section.open = true;
    section.querySelector(".draws").click();
  });
  const [from, to] = [{ x: 300, y: 200 }, { x: 330, y: 240 }];
  const [north, east] = await placeAt(page, map, from), [, edge] = [await placeAt(page, map, from), await placeAt(page, map, to)];
  await drag(page, map, from, to);
  // The fields have what was drawn, and send what is put there.
  const drawn = orders.getByRole("group", { name: "Disc 2" }), radius = Math.hypot(edge[0] - north, edge[1] - east);
  await expect(drawn.getByLabel("north, m")).toHaveValue(String(north));
  await expect(drawn.getByLabel("east, m")).toHaveValue(String(east));
  expect(Math.abs(Number(await drawn.getByLabel("radius, m").inputValue()) - radius)).toBeLessThan(0.3);
  const disc = { north_m: 10, east_m: 0, radius_m: 6 };
  for (const [label, value] of [["north, m", disc.north_m], ["east, m", disc.east_m], ["radius, m", disc.radius_m]]) await drawn.getByLabel(label).fill(String(value));
  const words = await send();
  expect(words).toHaveLength(1);
  expect(words[0]).toContain("New keep-out: 6.0");
  await expect(said).toHaveText("Orders: done");
  const keep_outs = [{ north_m: 60, east_m: 12, radius_m: 8 }, disc];
  expect(sent).toEqual([{ body: { keep_outs }, ifMatch: `"${revision}"` }]);
  expect((await setting()).keep_outs).toEqual(keep_outs);
});

test("handles move and size what is ordered, and each step is undone before it is sent", async ({ page, service }) => {
  const { sent, map, orders, open, send, setting, said } = await opened(page, service);
  await open("Working area");
  await orders.getByRole("button", { name: "Draw", exact: true }).click();
  await drag(page, map, { x: 60, y: 100 }, { x: 700, y: 560 });
  const corner = orders.getByRole("group", { name: "Corner 1" }).getByLabel("north, m"), first = await corner.inputValue();
  await drag(page, map, { x: 60, y: 100 }, { x: 60, y: 70 });
  expect(Number(await corner.inputValue())).toBeGreaterThan(Number(first));
  await orders.getByRole("button", { name: "Undo" }).click();
  await expect(corner).toHaveValue(first);
  await open("Keep-outs");
  await orders.getByRole("group", { name: "Disc 1" }).getByRole("button", { name: "Remove disc 1" }).click();
  const words = await send();
  expect(words).toEqual([expect.stringMatching(/^No keep-out any more: 8\.0\sm around 60\.0\sm N, 12\.0\sm E$/), expect.stringMatching(/^Working area: 4 corners, .* until now: none$/)]);
  await expect(said).toHaveText("Orders: done");
  expect(Object.keys(sent[0].body).sort()).toEqual(["area", "keep_outs"]);
  expect(sent[0].body.keep_outs).toBe(null);
  expect((await setting()).area).toHaveLength(4);
  // Nothing is left to send.
  await expect(orders.getByRole("button", { name: "Send…" })).toBeHidden();
});

test("a goal of every kind is chosen, an AUV is tapped, and what the service refuses is said at its field", async ({ page, service, complaints }) => {
  const { id, map, orders, open, send, setting, said } = await opened(page, service);
  const kind = orders.getByLabel("what to do"), sends = async (goal) => {
    const words = await send();
    await expect(said).toHaveText("Orders: done");
    expect((await setting()).goal).toMatchObject(goal);
    return words;
  };
  await open("Goal");
  // The second AUV goes 25 m east of the first: the cross of the keyboard is put there.
  await map.focus();
  // A map that is zoomed stays as it is.
  await map.press("-");
  const label = await map.getAttribute("aria-label"), [north, east] = /auv-2 at ([−\d]+) m north, ([−\d]+) m east/.exec(label).slice(1).map((text) => Number(text.replace("−", "-")));
  const box = await map.boundingBox(), [n0, e0] = await placeAt(page, map, { x: 200, y: 300 }), [n1, e1] = await placeAt(page, map, { x: 300, y: 200 });
  const x = 200 + ((east - e0) / (e1 - e0)) * 100, y = 300 - ((north - n0) / (n1 - n0)) * 100;
  await page.mouse.click(box.x + x, box.y + y);
  expect(await sends({ kind: "track", auv: "auv-2" })).toEqual(["Goal: stay above auv-2; until now: stay above auv-1"]);
  const both = ["auv-1", "auv-2"];
  for (const [name, goal] of [["midpoint", { auvs: both }], ["intermittent", { auvs: both, dwell_s: 240 }], ["range", { auvs: both, range_m: 100 }], ["weighted", { weights: { "auv-1": 1, "auv-2": 1 } }], ["visit", { auvs: both }]]) {
    await kind.selectOption(name);
    await sends({ kind: name, ...goal });
    if (name !== "intermittent") continue;
    await expect(orders.getByLabel("begins with the first in, min")).toHaveValue("0");
    await orders.getByLabel("begins with the first in, min").fill("5");
    expect(await sends({ kind: name })).toEqual([expect.stringMatching(/^Goal, begins with the first at: ..:..:.. UTC; until now: ..:..:.. UTC$/)]);
    const { goal: { epoch_s } } = await setting();
    expect(Math.abs(epoch_s - (await service.get(`/v1/missions/${id}`)).t_s - 300)).toBeLessThan(1);
  }
  await orders.getByLabel("serve by, min").first().fill("10");
  await orders.getByLabel("visit next").selectOption("auv-2");
  await orders.getByLabel("served within, m").fill("30");
  expect(await sends({ kind: "visit", next: "auv-2", within_m: 30 })).toEqual(expect.arrayContaining([expect.stringContaining("auv-2 next"), expect.stringContaining("served within, m: 30")]));
  await kind.selectOption("track");
  await orders.getByLabel("where to be").selectOption("polar");
  await orders.getByLabel("range, m").fill("20");
  await orders.getByLabel("bearing, °").fill("90");
  await sends({ kind: "track", offset: { frame: "polar", range_m: 20 } });
  expect(Math.abs((await setting()).goal.offset.bearing_rad - Math.PI / 2)).toBeLessThan(1e-9);
  await kind.selectOption("range");
  await orders.getByLabel("range, m").first().fill("0.5");
  await send();
  const wrong = orders.locator(".field", { has: page.locator("[aria-invalid=true]") });
  await expect(wrong).toContainText("range, m");
  await expect(wrong).toContainText("must be from 1 to 20000");
  expect(complaints.splice(0).every((complaint) => complaint.includes("422"))).toBe(true);
  await orders.getByRole("button", { name: "Discard" }).click();
  await expect(kind).toHaveValue("track");
});

test("the map follows the craft while the goal is open, and holds still while a disc is to be drawn, and a deadline comes nearer", async ({ page, played }) => {
  const watched = await played("steered"), orders = page.locator(".orders"), map = page.locator(".map-place canvas");
  await watched.open();
  const open = (title) => orders.locator("summary", { hasText: title }).click();
  const middle = { x: 200, y: 200 }, at = async () => {
    await watched.settled();
    return placeAt(page, map, middle);
  };
  await open("Goal");
  await page.getByRole("button", { name: "Keep the surface craft in the middle" }).click();
  const from = await at();
  await watched.pass(5);
  expect(Math.hypot(...(await at()).map((now, k) => now - from[k]))).toBeGreaterThan(1);
  await open("Keep-outs");
  await orders.getByRole("button", { name: "Draw a disc" }).click();
  const held = await at();
  await watched.pass(3);
  expect(await at()).toEqual(held);
  await open("Goal");
  await orders.getByLabel("what to do").selectOption("visit");
  const deadline = orders.getByLabel("serve by, min").first();
  await deadline.fill("10");
  await deadline.press("Tab");
  await watched.pass(3);
  await expect(deadline).toHaveValue("9.9");
});

test("on a phone the state and a map stay on the screen while an order is given", async ({ page, service }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  const { map, open, orders } = await opened(page, service);
  await open("Keep-outs");
  await orders.getByText("Route of an AUV").evaluate((last) => last.scrollIntoView({ block: "end" }));
  for (const shown of [map, page.locator(".chips"), orders.getByRole("button", { name: "Add a disc" })]) await expect(shown).toBeInViewport({ ratio: 0.9 });
  await expect(page.locator(".top")).not.toBeInViewport();
});

test("limits are typed in their units, and sent in SI units", async ({ page, service }) => {
  const { id, sent, orders, open, send, said } = await opened(page, service);
  await open("Limits");
  await orders.getByLabel("fastest speed, m/s").fill("0.3");
  await orders.getByLabel("largest turn rate, °/s").fill("6");
  const words = await send();
  expect(words).toEqual(["Limits, fastest speed, m/s: 0.3; until now: not set", "Limits, largest turn rate, °/s: 6; until now: not set"]);
  await expect(said).toHaveText("Orders: done");
  expect(sent[0].body.limits.speed_max_mps).toBe(0.3);
  expect(Math.abs(sent[0].body.limits.turn_rate_max_radps - Math.PI / 30)).toBeLessThan(1e-9);
  // Numbers of an autopilot have single precision: its 1.2 m/s and 45.8 °/s.
  await service.patch(`/v1/missions/${id}`, { limits: { speed_max_mps: Math.fround(1.2), turn_rate_max_radps: (Math.fround(45.8) * Math.PI) / 180 } });
  await expect(orders.getByLabel("fastest speed, m/s")).toHaveValue("1.2");
  await expect(orders.getByLabel("largest turn rate, °/s")).toHaveValue("45.8");
});

test("an order on a mission that was changed meanwhile is refused, kept, and sent again", async ({ page, service, complaints }) => {
  const { id, sent, orders, open, send, setting, said } = await opened(page, service);
  await open("Limits");
  await orders.getByLabel("fastest speed, m/s").fill("0.8");
  // The first order comes with a revision that the mission does not have, as if the page had not heard of a change.
  await page.route((url) => url.pathname.endsWith(id), (route) => {
    const request = route.request(), headers = request.headers();
    return route.continue({ headers: request.method() === "PATCH" && sent.length === 1 ? { ...headers, "if-match": '"999"' } : headers });
  });
  await send();
  await expect(said).toContainText("changed");
  expect((await setting()).limits).toBe(null);
  expect(complaints.splice(0).every((complaint) => complaint.includes("412"))).toBe(true);
  await expect(orders.getByLabel("fastest speed, m/s")).toHaveValue("0.8");
  await send();
  await expect(said).toHaveText("Orders: done");
  expect((await setting()).limits).toMatchObject({ speed_max_mps: 0.8 });
  expect(sent).toHaveLength(2);
});

test("a question that another client's change overtakes closes, and sends nothing before it is asked again", async ({ page, service }) => {
  const { id, sent, orders, open, send, setting, said } = await opened(page, service);
  await open("Limits");
  await orders.getByLabel("fastest speed, m/s").fill("0.8");
  await orders.getByRole("button", { name: "Send…" }).click();
  await expect(orders.locator("dialog")).toBeVisible();
  const answer = await fetch(`${service.url}/v1/missions/${id}`, { method: "PATCH", headers: { "content-type": "application/json" }, body: JSON.stringify({ limits: { speed_max_mps: 0.5 } }) });
  expect(answer.status).toBe(200);
  await expect(orders.locator("dialog")).toBeHidden();
  await expect(said).toContainText("Limits: changed by another client meanwhile");
  await expect(said).toContainText("look, and send again");
  expect(sent).toEqual([]);
  expect((await setting()).limits.speed_max_mps).toBe(0.5);
  expect(await send()).toEqual(["Limits, fastest speed, m/s: 0.8; until now: 0.5"]);
  await expect(said).toHaveText("Orders: done");
});

test("the keyboard alone draws a keep-out and sends it", async ({ page, service }) => {
  const { map, orders, open, setting, said } = await opened(page, service);
  await open("Keep-outs");
  await orders.getByRole("button", { name: "Draw a disc" }).press("Enter");
  await map.press("ArrowUp");
  await page.keyboard.press("Enter");
  await expect(orders.getByRole("group", { name: "Disc 2" })).toBeVisible();
  await orders.getByRole("button", { name: "Add a disc" }).press("Enter");
  const third = orders.getByRole("group", { name: "Disc 3" });
  await third.getByLabel("north, m").press("ArrowUp");
  await orders.getByRole("button", { name: "Send…" }).press("Enter");
  await page.keyboard.press("Enter");
  await expect(said).toHaveText("Orders: done");
  expect((await setting()).keep_outs).toHaveLength(3);
});

test("distance and bearing are measured between two places, and from the craft", async ({ page, service }) => {
  const id = await flown(service, { scenario: "switching", seed: 1 }, "measured", 60);
  await go(page, service, `#/mission/${id}`);
  await expect(page.locator(".mission-head progress")).toBeHidden();
  const map = page.locator(".map-place canvas"), said = page.locator(".map-place [role=status]");
  const measured = async () => /([\d.]+)\sm, ([\d.]+)°/.exec(await said.textContent()).slice(1).map(Number);
  const truth = ([n0, e0], [n1, e1]) => [Math.hypot(n1 - n0, e1 - e0), ((Math.atan2(e1 - e0, n1 - n0) * 180) / Math.PI + 360) % 360];
  const [from, to] = [{ x: 150, y: 450 }, { x: 620, y: 330 }], places = [await placeAt(page, map, from), await placeAt(page, map, to)];
  await page.getByRole("button", { name: /^Measure/ }).click();
  await drag(page, map, from, to);
  const [distance, bearing] = await measured(), [exact, direction] = truth(...places);
  // Places are read to 0.1 m.
  expect(Math.abs(distance - exact)).toBeLessThan(0.3);
  expect(Math.abs(bearing - direction)).toBeLessThan(0.2);
  await page.keyboard.press("m");
  await expect(said).toBeEmpty();
  await page.keyboard.press("m");
  await map.click({ position: from });
  await expect(said).toContainText("from surface craft");
  const [, north, east] = /surface craft at ([−\d]+) m north, ([−\d]+) m east/.exec(await map.getAttribute("aria-label"));
  const craft = [north, east].map((text) => Number(text.replace("−", "-")));
  expect(Math.abs((await measured())[0] - truth(craft, places[0])[0])).toBeLessThan(1);
  // The next tap goes on from there.
  await map.click({ position: to });
  expect(Math.abs((await measured())[0] - exact)).toBeLessThan(0.3);
  await map.press("Escape");
  await expect(page.getByRole("button", { name: /^Measure/ })).toHaveAttribute("aria-pressed", "false");
});
