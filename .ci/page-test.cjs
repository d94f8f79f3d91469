// Every example is drawn, nothing complains, nothing leaves this machine, a wrong snapshot is explained.
// PILOTFISH_URL says where the server is; --report FILE names a page that `pilotfish compare` wrote, --mission FILE one of
// `pilotfish simulate`. The README's pictures are drawn into --drawn DIR and compared with those in --committed DIR.

const assert = require("node:assert/strict");
const { readFileSync } = require("node:fs");
const { join } = require("node:path");
const { pathToFileURL } = require("node:url");
const { parseArgs } = require("node:util");
const { chromium } = require("playwright-core");

const PICTURES = ["page.png", "report.png"];
// Of a picture's pixels; another font alone is some 3 %.
const PICTURE_DIFFERENCE_MAX = 0.06;
const SCREENSHOT_EXAMPLE = "intermittent";
const FLAGS = [
  "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync",
];

// What the page and its requests did wrong, in words.
function listen(page, server) {
  const complaints = [];
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) complaints.push(`console ${message.type()}: ${message.text()}`);
  });
  page.on("pageerror", (error) => complaints.push(`uncaught: ${error}`));
  page.on("requestfailed", (request) => complaints.push(`failed: ${request.url()} ${request.failure().errorText}`));
  page.on("response", (response) => {
    if (!response.ok()) complaints.push(`${response.status()}: ${response.url()}`);
  });
  page.on("request", (request) => {
    if (new URL(request.url()).origin !== server) complaints.push(`left this machine: ${request.url()}`);
  });
  return complaints;
}

// The page says that it is busy before it asks, so whatever it says after the answer is about this answer.
async function answered(page, action, state) {
  const [response] = await Promise.all([page.waitForResponse("**/v1/plan/compare"), action()]);
  await response.finished();
  const status = page.locator("#status:not([data-state=busy])");
  const errors = await status.waitFor().then(() => page.locator("#errors").textContent());
  assert.equal(await status.getAttribute("data-state"), state, errors);
}

// Where the law answers, both tracks of a picture are the same one; no picture is one of before.
async function checkTracks(page, name, seen) {
  const before = new Set(seen);
  for (const track of ["track-mpc", "track-los"]) {
    const d = await page.locator(`path#${track}`).getAttribute("d");
    assert.match(d, /^M[-\d. ]+(L[-\d. ]+)+$/, `${name}: ${track} is drawn`);
    assert.ok(!before.has(d), `${name}: ${track} is not a picture of before`);
    seen.add(d);
  }
}

// The first answer comes last, and the page shows the second.
async function checkHaste(page, first, second) {
  await answered(page, () => page.locator("#example").selectOption(second), "ready");
  const wanted = await page.locator("path#track-mpc").getAttribute("d");
  let held = true;
  await page.route("**/v1/plan/compare", async (route) => {
    const late = held;
    held = false;
    if (late) await new Promise((resume) => setTimeout(resume, 1000));
    await route.continue();
  });
  const both = [];
  page.on("response", (response) => { if (response.url().endsWith("/compare")) both.push(response); });
  const asked = page.waitForRequest("**/v1/plan/compare");
  await page.locator("#example").selectOption(first);
  await asked;
  await page.locator("#example").selectOption(second);
  while (both.length < 2) await page.waitForTimeout(50);
  await both[1].finished();
  await page.waitForTimeout(200);
  assert.equal(await page.locator("path#track-mpc").getAttribute("d"), wanted, "the answer asked for last is shown");
  assert.match(await page.locator("#body").inputValue(), /intermittent/);
  await page.unroute("**/v1/plan/compare");
}

// All of both pictures at once, every name at its full size, no title cut off.
async function checkLayout(page) {
  const chart = await page.locator("#chart").boundingBox();
  assert.ok(chart.y + chart.height <= page.viewportSize().height, `the chart ends at ${chart.y + chart.height} px`);
  await page.setViewportSize({ width: 390, height: 844 });
  const name = page.locator("#map .name").first();
  await name.waitFor();
  const scale = await name.evaluate((element) => element.getScreenCTM().a);
  assert.ok(scale > 0.9, `names are drawn at ${scale} of their size`);
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(overflow <= 0, `the page is ${overflow} px too wide`);
  await page.setViewportSize({ width: 1280, height: 800 });
}

async function checkEstimatedCurrent(page) {
  const right = await page.locator("#body").inputValue();
  const request = JSON.parse(right);
  delete request.current;
  Object.assign(request.asc, { heading_rad: 0, speed_mps: 0.2, sway_mps: 0, ground_north_mps: 0.2, ground_east_mps: 0.1 });
  await page.locator("#body").fill(JSON.stringify(request));
  await answered(page, () => page.locator("#request button").click(), "ready");
  assert.match(await page.locator("#map").textContent(), /current 0\.10 m\/s, estimated/);
  assert.match(await page.locator("#current").getAttribute("transform"), /rotate\(90/);
  await page.locator("#body").fill(right);
  await answered(page, () => page.locator("#request button").click(), "ready");
}

async function checkReplay(page) {
  await page.locator("#moment").fill("0.5");
  assert.match(await page.locator("#moment").getAttribute("aria-valuetext"), /^\d+ seconds from now$/);
  assert.notEqual(await page.locator("#clock").textContent(), "+0 s");
  assert.equal(await page.locator("#ghosts .ghost").count(), 3, "goal, plan and line of sight");
  await page.locator("#moment").fill("0");
}

// A report is one file: it draws from that alone.
async function checkReport(browser, file) {
  const address = pathToFileURL(file);
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  const complaints = listen(page, address.origin);
  await page.goto(address.href);
  await page.locator("#map figure > svg").waitFor();
  assert.ok(await page.locator("#over-time figure > svg > polyline").count() >= 16, "the lines of the planner and the laws near it are drawn");
  assert.equal(await page.locator("thead th").count(), 6, "metrics of the planner and five laws");
  await checkCursor(page);
  assert.deepEqual(complaints, []);
  await page.close();
}

// The pointer over one chart shows all charts at that time; the legend takes a line out of all of them.
async function checkCursor(page) {
  const charts = await page.locator("figure[data-chart]").count();
  await page.locator("#over-time figure").first().hover();
  assert.equal(await page.locator(".readout:visible").count(), charts, "every chart says its values");
  const times = await page.locator(".readout tr:first-child").allTextContents();
  assert.equal(new Set(times).size, 1, `one time in all charts: ${times}`);
  const lines = () => page.locator("#over-time .readout").first().locator("tr").count();
  const before = await lines();
  await page.locator(".legend input").last().uncheck();
  await page.locator("#over-time figure").first().hover();
  assert.equal(await lines(), before - 1, "a line that is switched off has no value");
}

async function checkRefusal(page, complaints) {
  const right = await page.locator("#body").inputValue();
  const wrong = JSON.parse(right);
  wrong.asc.heading_rad = 19;
  await page.locator("#body").fill(JSON.stringify(wrong));
  await answered(page, () => page.locator("#request button").click(), "error");
  assert.deepEqual(await page.locator("#errors code").allTextContents(), ["/asc/heading_rad"]);
  // Chromium writes every status above 399 to the console; nothing else may be there.
  const refusal = complaints.splice(0);
  assert.equal(refusal.length, 2, refusal.join("\n"));
  assert.ok(refusal.every((complaint) => complaint.includes("422")), refusal.join("\n"));

  await page.locator("#body").fill(right);
  await answered(page, () => page.locator("#request button").click(), "ready");
  assert.equal(await page.locator("#errors li").count(), 0, "the error is gone with its cause");
}

// The share of pixels that differ visibly between two PNG files of one size; 1 where the sizes differ. Characters are
// drawn a little differently by other versions of fonts and browser.
async function difference(browser, files) {
  const page = await browser.newPage();
  const images = files.map((file) => `data:image/png;base64,${readFileSync(file, "base64")}`);
  const share = await page.evaluate(async (sources) => {
    const pixels = await Promise.all(sources.map(async (source) => {
      const bitmap = await createImageBitmap(await (await fetch(source)).blob());
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, bitmap.width, bitmap.height);
    }));
    const [a, b] = pixels;
    if (a.width !== b.width || a.height !== b.height) return 1;
    let differing = 0;
    for (let i = 0; i < a.data.length; i += 4) {
      if ([0, 1, 2].some((channel) => Math.abs(a.data[i + channel] - b.data[i + channel]) > 48)) differing += 1;
    }
    return differing / (a.width * a.height);
  }, images);
  await page.close();
  return share;
}

// The README's pictures are what the program draws today.
async function checkPictures(browser, drawn, committed) {
  for (const name of PICTURES) {
    const share = await difference(browser, [drawn, committed].map((folder) => join(folder, name)));
    const percent = (100 * share).toFixed(2);
    assert.ok(
      share <= PICTURE_DIFFERENCE_MAX,
      `docs/${name} differs in ${percent} % of its pixels from ${join(drawn, name)}: look at both, then .ci/page-test --draw`,
    );
    console.log(`docs/${name}: ${percent} % of its pixels differ from today's`);
  }
}

async function pictureOfReport(browser, file, picture) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  await page.goto(pathToFileURL(file).href);
  await page.locator("#map svg").first().waitFor();
  await page.screenshot({ path: picture });
  await page.close();
}

async function main() {
  const { values: { drawn, committed, report, mission } } = parseArgs({
    options: Object.fromEntries(["drawn", "committed", "report", "mission"].map((name) => [name, { type: "string" }])),
  });
  const url = process.env.PILOTFISH_URL;
  assert.equal(new URL(url).hostname, "127.0.0.1");
  const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: FLAGS });
  try {
    const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
    const complaints = listen(page, new URL(url).origin);
    await answered(page, () => page.goto(url), "ready");

    const { examples } = await (await fetch(`${url}/v1/examples`)).json();
    assert.ok(examples.length > 0);
    const seen = new Set();
    for (const { name } of examples) {
      await answered(page, () => page.goto(`${url}/?example=${name}`), "ready");
      await checkTracks(page, name, seen);
    }
    // By hand what the address did before.
    await answered(page, () => page.locator("#example").selectOption(SCREENSHOT_EXAMPLE), "ready");
    await page.screenshot({ path: join(drawn, "page.png") });
    await checkLayout(page);
    await checkReplay(page);
    await checkEstimatedCurrent(page);
    await checkHaste(page, "track", SCREENSHOT_EXAMPLE);
    assert.deepEqual(complaints, []);
    await checkRefusal(page, complaints);
    assert.deepEqual(complaints, []);
    await checkReport(browser, report);
    await pictureOfReport(browser, mission, join(drawn, "report.png"));
    if (committed) await checkPictures(browser, drawn, committed);
    console.log(`${examples.length} examples drawn; a wrong snapshot explained; no complaint, no request off loopback`);
  } finally {
    await browser.close();
  }
}

main().catch((error) => {
  console.error(error);
  process.exitCode = 1;
});
