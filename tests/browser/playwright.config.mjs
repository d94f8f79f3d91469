// How the page is tested: in Debian's chromium, with one service for each worker (`fixtures.mjs`). `.ci/page-test` runs it.

import { defineConfig } from "@playwright/test";

export default defineConfig({
  testDir: ".",
  outputDir: "test-results",
  projects: [{ name: "recorded", testMatch: "*.spec.mjs", testIgnore: "real/**" }, { name: "real", testMatch: "real/*.spec.mjs", workers: 1 }],
  fullyParallel: true,
  workers: 2,
  timeout: 120_000,
  expect: { timeout: 20_000 },
  reporter: [["list"]],
  use: {
    viewport: { width: 1280, height: 800 },
    launchOptions: {
      executablePath: "/usr/bin/chromium",
      args: [
        "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
        "--disable-sync", "--js-flags=--expose-gc", "--enable-precise-memory-info",
      ],
    },
  },
});
