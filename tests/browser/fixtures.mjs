// What every test of the page has: a service, and a page that may neither complain nor ask anything of another origin.

import { expect, test as base } from "@playwright/test";
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

export const test = base.extend({
  page: async ({ page }, use) => {
    // Tests read canvases back: on a canvas that is drawn by the processor, so that nothing warns of it and no read changes how the next picture is drawn.
    await page.addInitScript(() => {
      const { getContext } = HTMLCanvasElement.prototype;
      HTMLCanvasElement.prototype.getContext = function (kind, how) {
        return getContext.call(this, kind, kind === "2d" ? { ...how, willReadFrequently: true } : how);
      };
    });
    await use(page);
  },

  service: [async ({}, use) => {
    const service = await startService();
    await use(service);
    await service.stop();
  }, { scope: "worker" }],

  /** What the page and its requests did wrong, in words; a test that expects some takes them out. */
  complaints: async ({ page, service }, use) => {
    const complaints = [];
    page.on("console", (message) => {
      if (["error", "warning"].includes(message.type())) complaints.push(`console ${message.type()}: ${message.text()}`);
    });
    page.on("pageerror", (error) => complaints.push(`uncaught: ${error}`));
    page.on("request", (request) => {
      const { protocol, origin } = new URL(request.url());
      if (!["data:", "blob:"].includes(protocol) && origin !== service.url) complaints.push(`left the origin: ${request.url()}`);
    });
    await use(complaints);
    expect(complaints).toEqual([]);
  },
});

export { expect };
