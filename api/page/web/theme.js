// Colours for the place where the screen is: by day, in the sun, at night.

import { el } from "./dom.js";

/** What people call each theme. */
const THEMES = { auto: "as the system", light: "light", dark: "dark", sun: "bright sun", night: "night, red" };
const KEPT = "theme";

/** A choice of themes, which is kept; it takes effect at once. */
export function themeChoice() {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const select = el("select", { id: "theme" }, Object.entries(THEMES).map(([name, text]) => el("option", { value: name }, text)));
  const put = () => {
    document.documentElement.dataset.theme = select.value !== "auto" ? select.value : system.matches ? "dark" : "light";
    // Canvases take their colours when they are drawn.
    dispatchEvent(new Event("themechange"));
  };
  select.value = keptTheme();
  select.addEventListener("change", () => {
    try {
      localStorage.setItem(KEPT, select.value);
    } catch {
      // A page from a file may have no place to keep it in.
    }
    put();
  });
  system.addEventListener("change", put);
  put();
  return el("label", { class: "theme" }, "Theme ", select);
}

function keptTheme() {
  try {
    const kept = localStorage.getItem(KEPT) ?? "auto";
    return Object.hasOwn(THEMES, kept) ? kept : "auto";
  } catch {
    return "auto";
  }
}
