// Every example is drawn, nothing complains, nothing leaves this machine, a wrong snapshot is explained.
// PILOTFISH_URL says where the server is.

const assert = require("node:assert/strict");
const { parseArgs } = require("node:util");
const { chromium } = require("playwright-core");

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

async function checkTracks(page, name, seen) {
  for (const track of ["track-mpc", "track-los"]) {
    const d = await page.locator(`path#${track}`).getAttribute("d");
    assert.match(d, /^M[-\d. ]+(L[-\d. ]+)+$/, `${name}: ${track} is drawn`);
    assert.ok(!seen.has(d), `${name}: ${track} is not a picture of before`);
    seen.add(d);
  }
}

async function checkReplay(page) {
  await page.locator("#moment").fill("0.5");
  assert.notEqual(await page.locator("#clock").textContent(), "+0 s");
  assert.equal(await page.locator("#ghosts .ghost").count(), 3, "goal, plan and line of sight");
  await page.locator("#moment").fill("0");
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

async function main() {
  const { values: { screenshot } } = parseArgs({ options: { screenshot: { type: "string" } } });
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
    if (screenshot) await page.screenshot({ path: screenshot });
    await checkReplay(page);
    assert.deepEqual(complaints, []);
    await checkRefusal(page, complaints);
    assert.deepEqual(complaints, []);
    console.log(`${examples.length} examples drawn; a wrong snapshot explained; no complaint, no request off loopback`);
  } finally {
    await browser.close();
  }
}

main().catch((error) => {
  console.error(error);
  process.exitCode = 1;
});
