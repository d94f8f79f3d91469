// Colour themes: day, bright sun, night.

import { el } from "./dom.js";

/** Labels of the themes. */
const THEMES = { auto: "as the system", light: "light", dark: "dark", sun: "bright sun", night: "night, red" };
const KEPT = "theme";

/** The choice of a theme. It takes effect at once and is stored. */
export function themeChoice() {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const select = el("select", { id: "theme" }, Object.entries(THEMES).map(([name, text]) => el("option", { value: name }, text)));
  const put = () => {
    document.documentElement.dataset.theme = select.value !== "auto" ? select.value : system.matches ? "dark" : "light";
    // Canvases read their colours when they are drawn.
    dispatchEvent(new Event("themechange"));
  };
  select.value = keptTheme();
  select.addEventListener("change", () => {
    try {
      localStorage.setItem(KEPT, select.value);
    } catch {
      // A page from a file may have no storage.
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
