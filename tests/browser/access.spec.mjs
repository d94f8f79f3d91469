// A protected service: it asks for a token, and says what that may do.

import { execFileSync } from "node:child_process";
import { expect, expected, test } from "./fixtures.mjs";
import { PROGRAM, startService } from "./service.mjs";

test("with a read-only token the page looks, says so, and orders nothing", async ({ page, origins, complaints }) => {
  const open = await startService();
  origins.push(open.url);
  const { id } = await open.post("/v1/missions", { schema_version: "1.0", title: "protected", simulated: { scenario: "calm" } });
  const token = execFileSync(PROGRAM, ["token", "add", "watcher", "--role", "read-only", "--data", open.data], { encoding: "utf8" }).match(/pf_\S+|\S{30,}/)[0];
  try {
    await page.goto(`${open.url}/`);
    await page.getByRole("textbox", { name: "Token" }).fill("wrong");
    await page.getByRole("button", { name: "Use it in this tab" }).click();
    await expect(page.getByRole("alert")).toContainText("does not know this token");
    await page.getByRole("textbox", { name: "Token" }).fill(token);
    await page.getByRole("button", { name: "Use it in this tab" }).click();
    await expect(page.locator("#role")).toHaveText("read-only: no orders");
    await expect(page.locator("main")).toContainText("Read-only");
    await expect(page.getByRole("button", { name: "Run paper-tracking", exact: true })).toBeDisabled();
    await page.getByRole("link", { name: "protected" }).click();
    await expect(page.locator("h1")).toHaveText("protected");
    await expect(page.locator(".orders")).toContainText("Read-only");
    await expect(page.getByRole("button", { name: "Run", exact: true })).toBeDisabled();
    await page.goto(`${open.url}/#/plan`);
    await expect(page.locator(".plan-status")).toHaveText("planned");
    expect((await (await fetch(`${open.url}/v1/missions/${id}`, { headers: { authorization: `Bearer ${token}` } })).json()).status).toBe("created");
  } finally {
    // The page asks for nothing while the service ends.
    await page.goto("about:blank");
    await open.stop();
  }
  expect(expected(complaints, /401/)).toBe(true);
});
