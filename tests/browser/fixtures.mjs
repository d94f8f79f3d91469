// What every test of the page has: a service, and a page that may neither complain nor ask anything of another origin.

import { expect, test as base } from "@playwright/test";
import { play } from "./recorded.mjs";
import { startService } from "./service.mjs";

/** Goes to a view and waits until something of it is there. */
export async function go(page, service, hash) {
  await page.goto(`${service.url}/${hash}`);
  await page.locator("main h1").first().waitFor();
}

/** Whether a canvas has anything on it but one colour. */
export async function isDrawn(canvas) {
  return canvas.evaluate((element) => {
    const { width, height } = element;
    if (!width || !height) return false;
    const data = element.getContext("2d").getImageData(0, 0, width, height).data;
    const seen = new Set();
    for (let i = 0; i < data.length; i += 4) seen.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
    return seen.size > 8;
  });
}

/** Returns when the page has read every answer, and has drawn it. */
export async function settled(page) {
  await page.evaluate(async () => {
    await window.readUntil(0);
    // What is to be drawn is drawn in the next frame.
    for (let frame = 0; frame < 2; frame += 1) await new Promise(requestAnimationFrame);
  });
}

/** In the page, before its own scripts. */
function prepare() {
  // Tests read canvases back: on a canvas that is drawn by the processor, so that nothing warns of it and no read changes how the next picture is drawn.
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, how) {
    return getContext.call(this, kind, kind === "2d" ? { ...how, willReadFrequently: true } : how);
  };
  window.later = window.setTimeout;
  // Counts the answers that are waited for, and what was read of streams.
  let pending = 0, read = 0;
  const counted = (call) => async function (...args) {
    pending += 1;
    try {
      return await call.apply(this, args);
    } finally {
      pending -= 1;
    }
  };
  window.fetch = counted(window.fetch);
  for (const name of ["json", "text"]) Response.prototype[name] = counted(Response.prototype[name]);
  const { read: next } = ReadableStreamDefaultReader.prototype;
  ReadableStreamDefaultReader.prototype.read = async function () {
    const some = await next.call(this);
    if (typeof some.value === "string") read += some.value.length;
    return some;
  };
  /** Returns when no answer is waited for and so many letters of streams were read, with what the page does then at once. */
  window.readUntil = async (letters) => {
    const turn = () => new Promise((resume) => {
      const { port1, port2 } = new MessageChannel();
      port1.onmessage = resume;
      port2.postMessage(null);
    });
    do await turn(); while (pending > 0 || read < letters);
    await turn();
    if (pending > 0) await window.readUntil(letters);
  };
}

export const test = base.extend({
  page: async ({ page }, use) => {
    await page.addInitScript(prepare);
    await use(page);
  },

  service: [async ({}, use) => {
    const service = await startService();
    await use(service);
    await service.stop();
  }, { scope: "worker" }],

  /** Plays a recording to the page (`recorded.mjs`). */
  played: async ({ page, service, origins }, use) => {
    const all = [];
    await use(async (name, how) => {
      all.push(await play(page, service, name, how));
      origins.push(all.at(-1).url);
      return all.at(-1);
    });
    for (const each of all) await each.close();
  },

  /** Where the page may ask. */
  origins: async ({ service }, use) => use([service.url]),

  /** What the page and its requests did wrong, in words; a test that expects some takes them out. */
  complaints: [async ({ page, origins }, use) => {
    const complaints = [];
    page.on("console", (message) => {
      if (["error", "warning"].includes(message.type())) complaints.push(`console ${message.type()}: ${message.text()}`);
    });
    page.on("pageerror", (error) => complaints.push(`uncaught: ${error}`));
    page.on("request", (request) => {
      const { protocol, origin } = new URL(request.url());
      if (!["data:", "blob:", "file:"].includes(protocol) && !origins.includes(origin)) complaints.push(`left the origin: ${request.url()}`);
    });
    await use(complaints);
    expect(complaints).toEqual([]);
  }, { auto: true }],
});

/** Takes out the complaints with `words`, and says whether there were some. */
export function expected(complaints, words) {
  const others = complaints.filter((complaint) => !words.test(complaint)), { length } = complaints;
  complaints.splice(0, length, ...others);
  return others.length < length;
}

export { expect };
