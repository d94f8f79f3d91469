// An editor of a snapshot that shows errors at their lines while the user types.

import { el, fill } from "./dom.js";
import { Refusal, send } from "./service.js";
import { lineOf, linesByPointer } from "./pointers.js";

/** @typedef {import("./service.js").FieldError} FieldError */

/** Longest pause between two keys while typing, ms. */
const TYPING_MS = 300;

/** The editor of a snapshot. Read-only until its first text is there, which would overwrite what was typed. */
export class Editor {
  /** @param {{ changed: (text: string) => void, submit: () => void }} listener */
  constructor({ changed, submit }) {
    this.changed = changed;
    this.turn = 0;
    this.timer = 0;
    this.area = el("textarea", {
      id: "snapshot", class: "editor-text", readOnly: true, spellcheck: false, autocomplete: "off", wrap: "off", "aria-describedby": "editor-errors",
      oninput: () => this.edited(), onscroll: () => { this.gutter.scrollTop = this.area.scrollTop; },
      onkeydown: (/** @type {KeyboardEvent} */ event) => {
        if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) {
          event.preventDefault();
          submit();
        }
      },
    });
    this.gutter = el("pre", { class: "editor-gutter", "aria-hidden": "true" });
    this.state = el("p", { class: "editor-state", role: "status" });
    this.errors = el("ul", { class: "editor-errors", id: "editor-errors" });
    this.element = el("div", {}, el("label", { htmlFor: "snapshot" }, "Snapshot, JSON ", el("small", {}, "(Ctrl+Enter plans it)")), el("div", { class: "editor" }, this.gutter, this.area), this.state, this.errors);
  }

  get text() {
    return this.area.value;
  }

  /** @param {string} text */
  put(text) {
    this.area.value = text;
    this.area.readOnly = false;
    this.edited();
  }

  edited() {
    this.changed(this.text);
    this.number(new Set());
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.validate(), TYPING_MS);
  }

  /** @param {Set<number>} wrong lines from 0 on */
  number(wrong) {
    const n = this.text.split("\n").length;
    fill(this.gutter, Array.from({ length: n }, (_, i) => [el("span", { class: wrong.has(i) ? "wrong" : "" }, `${i + 1}`), "\n"]).flat());
    this.gutter.scrollTop = this.area.scrollTop;
  }

  async validate() {
    const turn = ++this.turn;
    try {
      await send("/v1/plan/validate", this.text);
      if (turn === this.turn) this.show([], "valid");
    } catch (error) {
      if (turn !== this.turn) return;
      if (error instanceof Refusal) this.show(error.problem.errors, error.problem.errors.length ? "" : error.message);
      else this.show([], "not checked: the service does not answer");
    }
  }

  /** @param {FieldError[]} errors @param {string} state */
  show(errors, state) {
    const lines = linesByPointer(this.text);
    const at = errors.map((error) => lineOf(lines, error.pointer ?? ""));
    this.number(new Set(at));
    this.area.setAttribute("aria-invalid", String(errors.length > 0));
    fill(this.state, errors.length ? `${errors.length} ${errors.length === 1 ? "field is" : "fields are"} wrong` : state);
    fill(this.errors, errors.map((error, i) => el("li", {}, el("button", { type: "button", onclick: () => this.goTo(at[i]) }, `line ${at[i] + 1}`), " ",
      el("code", {}, error.pointer || error.parameter || "whole body"), " ", el("bdi", {}, error.detail),
      error.given !== undefined && el("span", { class: "given" }, ` given: ${JSON.stringify(error.given).slice(0, 200)}`))));
  }

  /** @param {number} line */
  goTo(line) {
    const before = this.text.split("\n").slice(0, line + 1), end = before.join("\n").length;
    this.area.focus();
    this.area.setSelectionRange(end - before[line].length, end);
    this.area.scrollTop = Math.max(0, (line / this.text.split("\n").length) * this.area.scrollHeight - this.area.clientHeight / 2);
  }
}
