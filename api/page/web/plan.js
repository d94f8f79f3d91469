// One snapshot: edited, planned, compared with the laws, explained.

import { el, fill } from "./dom.js";
import { askJson, ask, isUnreachable, Refusal, send } from "./service.js";
import { ADDRESS_MAX, packed, unpacked } from "./address.js";
import { Editor } from "./editor.js";
import { copyButtons } from "./copy_as.js";
import { PlanPicture, requestVessels } from "./plan_picture.js";
import { planTables } from "./plan_tables.js";

/** @typedef {import("./app.js").Context} Context */

const KEPT = "plan-edit";

/**
 * @param {HTMLElement} root
 * @param {Context} context
 * @param {URLSearchParams} parameters
 */
export function planView(root, context, parameters) {
  document.title = "Plan one snapshot · Pilotfish";
  new PlanPage(root, context).start(parameters);
}

class PlanPage {
  /** @param {HTMLElement} root @param {Context} context */
  constructor(root, context) {
    this.context = context;
    this.turn = 0;
    /** The example as loaded, so that the address need not hold it. */
    this.example = { name: "", text: "" };
    this.status = el("p", { class: "plan-status chip", role: "status" }, "loading");
    this.examples = el("select", { id: "example", onchange: () => this.load(this.examples.value) });
    this.editor = new Editor({ changed: (text) => this.keep(text), submit: () => this.plan() });
    this.kept = el("p", { class: "said", role: "status" });
    this.refused = el("div", { class: "notice", role: "alert" });
    this.picture = new PlanPicture();
    this.tables = el("div");
    this.results = el("div", { class: "plan-results" }, this.picture.element, this.tables);
    /** Whether a plan is shown. */
    this.drawn = false;
    fill(root, el("header", { class: "mission-head" }, el("h1", {}, "Plan one snapshot"), this.status,
      el("p", { class: "about" }, "A snapshot holds what is known of the vehicles and what is wanted. The page shows the planner's answer and those of the line-of-sight laws.")),
    el("div", { class: "plan" }, el("section", { class: "panel plan-edit", "aria-label": "Snapshot" },
      el("label", { htmlFor: "example" }, "Example "), this.examples, this.editor.element,
      el("div", { class: "row" }, el("button", { type: "button", class: "primary", onclick: () => this.plan() }, "Plan"), copyButtons(() => this.editor.text)), this.kept), el("div", {}, this.refused, this.results)));
    context.onLeave(() => this.picture.leave());
  }

  /** @param {URLSearchParams} parameters */
  async start(parameters) {
    try {
      const { examples } = await askJson("/v1/examples");
      fill(this.examples, examples.map((/** @type {{ name: string, title: string }} */ { name, title }) => el("option", { value: name }, title)));
      const named = examples.some((/** @type {{ name: string }} */ { name }) => name === parameters.get("example"));
      const name = named ? /** @type {string} */ (parameters.get("example")) : examples[0].name;
      this.example = { name, text: await (await ask(`/v1/examples/${encodeURIComponent(name)}`)).text() };
      if (this.context.gone()) return;
      this.examples.value = name;
      this.editor.put(await this.edited(parameters) ?? this.example.text);
      await this.plan();
    } catch (error) {
      this.editor.area.readOnly = false;
      this.fail(error);
    }
  }

  /** What was edited before a reload. @param {URLSearchParams} parameters */
  async edited(parameters) {
    const letters = parameters.get("edit");
    if (letters === "kept") return sessionStorage.getItem(KEPT);
    if (!letters) return null;
    try {
      return await unpacked(letters);
    } catch {
      fill(this.kept, "The edits in the address cannot be read: this is the unchanged example.");
      return null;
    }
  }

  /** @param {string} name */
  async load(name) {
    this.turn += 1;
    try {
      const text = await (await ask(`/v1/examples/${encodeURIComponent(name)}`)).text();
      if (this.examples.value !== name) return;
      this.example = { name, text };
      this.editor.put(text);
      await this.plan();
    } catch (error) {
      this.fail(error);
    }
  }

  /** Puts what is edited into the address. @param {string} text */
  async keep(text) {
    const parameters = new URLSearchParams({ example: this.example.name });
    if (text !== this.example.text) {
      const letters = await packed(text);
      if (text !== this.editor.text || this.context.gone()) return;
      const fits = letters.length <= ADDRESS_MAX;
      fill(this.kept, fits ? "" : "The snapshot is too long for the address: only this tab keeps it, and a link shows the example.");
      if (!fits) sessionStorage.setItem(KEPT, text);
      parameters.set("edit", fits ? letters : "kept");
    }
    if (!this.context.gone()) history.replaceState(null, "", `#/plan?${parameters}`);
  }

  async plan() {
    const turn = ++this.turn, { text } = this.editor;
    this.say("planning", "");
    fill(this.refused);
    try {
      const answer = await send("/v1/plan/compare?explain=true", text);
      if (turn !== this.turn || this.context.gone()) return;
      this.results.classList.remove("of-before");
      this.drawn = true;
      const request = JSON.parse(text);
      this.picture.show(request, answer.plans);
      fill(this.tables, planTables(answer, requestVessels(request, answer.plans.mpc)));
      const { outcome, method, reason } = answer.plans.mpc;
      if (outcome === "ok") this.say("planned", "good"); else this.say(`degraded: ${method.replaceAll("_", " ")}${reason ? `, ${reason.replaceAll("_", " ")}` : ""}`, "warn");
    } catch (error) {
      if (turn === this.turn && !this.context.gone()) this.fail(error);
    }
  }

  /** @param {unknown} error */
  fail(error) {
    this.results.classList.add("of-before");
    const below = this.drawn ? " The plan below is the previous one." : "";
    if (error instanceof Refusal) {
      this.say("refused", "bad");
      fill(this.refused, el("strong", {}, error.problem.title), ": ", error.message || error.problem.code, ".", below);
      if (error.problem.errors.length) this.editor.show(error.problem.errors, "");
    } else if (!isUnreachable(error)) {
      this.say("failed", "bad");
      fill(this.refused, `This page failed (${error}): please report it.`, below);
    } else {
      this.say("no answer", "bad");
      fill(this.refused, `The service does not answer (${error instanceof Error ? error.message : error}).${below} Ctrl+Enter tries again.`);
    }
  }

  /** @param {string} text @param {string} kind */
  say(text, kind) {
    this.status.className = `plan-status chip ${kind}`;
    this.status.textContent = text;
  }
}
