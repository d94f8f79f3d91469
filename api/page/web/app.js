// The shell: chooses the view from the address, sets the theme, shows the user's role.

import { el, fill } from "./dom.js";
import { ask, askJson, door, isUnreachable, Refusal, useToken } from "./service.js";
import { homeView } from "./home.js";
import { missionView } from "./live.js";
import { themeChoice } from "./theme.js";

/**
 * What a view gets from the shell. `onLeave` registers what to undo when the user leaves the view; `gone` tells whether the user left.
 * @typedef {{ role: "read-only" | "operator" | "admin", protected: boolean, go: (hash: string) => void, onLeave: (undo: () => void) => void, gone: () => boolean }} Context
 */

const main = /** @type {HTMLElement} */ (document.getElementById("main"));
/** @type {(() => void)[]} */
let leaving = [];
let shown = 0;
let access = /** @type {{ role: Context["role"], protected: boolean } | null} */ (null);

/** Asks for a token once. With a new token everything is loaded again, because its role may differ. */
const token = { dialog: /** @type {HTMLElement | null} */ (null), given: new Promise(() => {}) };
door.ask = (refused) => {
  if (token.dialog) return token.given;
  const input = el("input", { id: "token", type: "password", autocomplete: "current-password", required: true });
  const dialog = token.dialog = el("dialog", { "aria-labelledby": "token-title" }, el("form", {
    onsubmit: (/** @type {Event} */ event) => {
      event.preventDefault();
      useToken(input.value.trim());
      location.reload();
    },
  }, el("h2", { id: "token-title" }, "This service requires a token"),
  refused && el("p", { class: "notice", role: "alert" }, "The service does not know this token."),
  el("p", {}, "Create one with ", el("code", {}, "pilotfish token add NAME --role read-only"), "; for orders, with ", el("code", {}, "--role operator"), "."),
  el("label", { htmlFor: "token" }, "Token"), input, el("button", { type: "submit", class: "primary" }, "Use it in this tab")));
  document.body.append(dialog);
  dialog.addEventListener("cancel", (event) => event.preventDefault());
  dialog.showModal();
  return token.given;
};

async function whoAmI() {
  if (!access) {
    try {
      access = await askJson("/v1/access");
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      // The next view asks again. Until then no orders are offered.
      return { role: /** @type {Context["role"]} */ ("read-only"), protected: true };
    }
    const role = /** @type {HTMLElement} */ (document.getElementById("role"));
    role.hidden = !access?.protected;
    fill(role, access?.role === "read-only" ? "read-only: no orders" : access?.role);
  }
  return /** @type {{ role: Context["role"], protected: boolean }} */ (access);
}

async function route() {
  for (const undo of leaving) undo();
  leaving = [];
  const turn = ++shown, [path, query = ""] = location.hash.slice(1).split("?");
  const parameters = new URLSearchParams(query), [, view = "", id = ""] = path.split("/");
  for (const link of document.querySelectorAll("nav a")) {
    const here = link.getAttribute("href") === `#/${view === "mission" ? "" : view}`;
    if (here) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current");
  }
  document.title = "Pilotfish";
  fill(main, el("p", { class: "loading", role: "status" }, "Loading…"));
  try {
    const known = await whoAmI();
    if (turn !== shown) return;
    /** @type {Context} */
    const context = {
      ...known, gone: () => turn !== shown,
      onLeave: (undo) => { if (turn === shown) leaving.push(undo); else undo(); },
      go: (hash) => { if (location.hash === hash) route(); else location.hash = hash; },
    };
    if (view === "mission") await missionView(main, context, decoded(id));
    else if (view === "compare") {
      const { compareView } = await import("./compare.js");
      if (turn === shown) await compareView(main, context, parameters);
    } else if (view === "plan") {
      const { planView } = await import("./plan.js");
      if (turn === shown) planView(main, context, parameters);
    }
    else if (view === "") homeView(main, context);
    else fill(main, el("p", { class: "notice" }, "There is no such page. ", el("a", { href: "#/" }, "All missions")));
  } catch (error) {
    if (turn === shown) explain(error);
  }
}

/** A typed address may not be valid percent encoding. @param {string} part */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

/** @param {unknown} error */
function explain(error) {
  const words = error instanceof Refusal ? `${error.problem.title}: ${error.message}` : isUnreachable(error) ? `The service does not answer (${error instanceof Error ? error.message : error}).` : `This page failed (${error}): please report it.`;
  fill(main, el("div", { class: "notice", role: "alert" }, words, " ", el("button", { type: "button", onclick: route }, "Try again"), " ", el("a", { href: "#/" }, "All missions")));
}

document.getElementById("theme-place")?.append(themeChoice());
document.querySelector(".skip")?.addEventListener("click", (event) => {
  // The address names views, not places in them.
  event.preventDefault();
  main.focus();
});
addEventListener("hashchange", () => {
  route();
  main.focus({ preventScroll: true });
});
route();
ask("/version").then((answer) => answer.json()).then(({ version }) => {
  const place = document.getElementById("version");
  if (place) fill(place, `version ${version}`);
}).catch(() => {});
