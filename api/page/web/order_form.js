// Orders by hand: the goal, keep-outs, the area and the limits of a live mission, in fields and on the map, sent together.

import { el, fill, named } from "./dom.js";
import { Refusal } from "./service.js";
import { CHOICES, GOALS, labelOf, LABELS, OrderDraft, standsDown, valueAt, withValue } from "./order_draft.js";
import { dragged, handlesOf, orderOverlay, tapped } from "./order_map.js";

/**
 * @typedef {import("./order_draft.js").Path} Path
 * @typedef {import("./types.js").Place} Place
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {{ input: HTMLInputElement | HTMLSelectElement, wrong: HTMLElement, show: () => void, timed?: boolean }} Field a timed one is of a moment, which it has as minutes from now
 */

/** What a cost of a kind begins with. */
const COST_BEGINS = { age: {}, uncertainty: { fixes: "usbl", growth_m2ps: 0.02 }, data: { growth_kbps: 1, upload_kbps: 10, range_max_m: 200 } };
/** Numbers of an offset by its frame, and of a cost. @type {{ [of: string]: string[] }} */
const NUMBERS = {
  ned: ["north_m", "east_m"], polar: ["range_m", "bearing_rad"], target: ["ahead_m", "starboard_m"], path: ["ahead_m", "starboard_m"],
  uncertainty: ["growth_m2ps", "sigma_m", "sigma_rad", "interval_s"], data: ["growth_kbps", "upload_kbps", "range_max_m"],
};
const LIMITS = ["speed_max_mps", "speed_min_mps", "turn_rate_max_radps", "acceleration_max_mps2", "deceleration_max_mps2"];
const SECTIONS = [["goal", "Goal"], ["keep_outs", "Keep-outs"], ["area", "Working area"], ["limits", "Limits"], ["surface_craft", "Craft"]];

/** @param {string} of @returns {string[][]} */
function optionsOf(of) {
  return Object.entries(CHOICES[of]);
}

/** The form, and the tool that draws on the map what it has. */
export class OrderForm {
  /** @param {(patch: object) => Promise<void>} send shows how it went, and throws what was refused @param {() => void} redraw draws the map again */
  constructor(send, redraw) {
    this.send = send;
    this.redraw = redraw;
    this.draft = new OrderDraft(() => this.show());
    /** @type {string[]} */
    this.auvs = [];
    /** @type {Map<string, Field>} */
    this.fields = new Map();
    /** What is being pressed: a handle, or where something is drawn. @type {{ drag: (at: Place) => any, moved: boolean, draws?: boolean } | null} */
    this.held = null;
    this.armed = this.shape = this.section = "";
    this.t_s = 0;
    /** The middle of the map. @type {Place} */
    this.middle = { north: 0, east: 0 };
    /** Whom craft of a fleet may serve that stand down, if they did before. @type {Map<string, string[] | undefined>} */
    this.served = new Map();
    /** The number that is being typed. @type {HTMLInputElement | null} */
    this.typing = null;
    /** @type {Picture | undefined} */
    this.picture = undefined;
    /** @type {import("./order_map.js").Handle[]} */
    this.handles = [];
    /** @type {{ [section: string]: { body: HTMLElement, details: HTMLDetailsElement, wrong: HTMLElement } }} */
    this.sections = Object.fromEntries(SECTIONS.map(([name, title]) => {
      const body = el("div"), wrong = el("p", { class: "wrong", role: "alert" });
      const details = el("details", { class: "order", name: "order", ontoggle: () => this.opened(name, details.open) }, el("summary", {}, title), body, wrong);
      return [name, { body, details, wrong }];
    }));
    const button = (/** @type {string} */ text, /** @type {() => void} */ onclick, kind = "") => el("button", { type: "button", class: kind, onclick }, text);
    this.undo = button("Undo", () => this.draft.undo());
    this.bar = el("div", { class: "row order-bar", hidden: true }, button("Send…", () => this.confirm(), "primary"), this.undo, button("Discard", () => this.draft.discard()));
    this.fieldset = el("fieldset", { class: "plain" }, Object.values(this.sections).map(({ details }) => details), this.bar);
    this.dialog = el("dialog", { "aria-labelledby": "order-title" });
    this.element = el("div", {}, this.fieldset, this.dialog);
  }

  /** @param {string} name @param {boolean} open */
  opened(name, open) {
    if (open) this.section = name;
    else if (this.section === name) this.section = "";
    // The event may come after something in the open section was pressed.
    this.arm(this.armed === this.section ? this.armed : "");
  }

  /** What the next drag or tap on the map draws. @param {string} section */
  arm(section) {
    this.armed = section;
    if (section) this.section = section;
    for (const button of this.element.querySelectorAll(".draws")) button.setAttribute("aria-pressed", String(section !== ""));
    this.redraw();
  }

  /** @param {import("./types.js").MissionJson} mission @param {boolean} disabled @returns {string} what another client changed of what is edited or asked here */
  became({ setting, scene, t_s }, disabled) {
    this.fieldset.disabled = disabled;
    if (disabled) this.arm("");
    [this.auvs, this.t_s] = [scene?.auvs ?? [], t_s];
    const { draft, dialog } = this, { base } = draft, both = draft.became(setting).map((member) => SECTIONS.find(([name]) => name === member)?.[1]).join(", ");
    if (!this.shape) this.show();
    for (const { timed, show } of this.fields.values()) if (timed) show();
    const asks = dialog.open && (disabled || draft.base !== base);
    if (asks) dialog.close();
    // The words of the dialog were of the mission as it was.
    return [both && `${both}: changed by another client meanwhile; what you send replaces that`, asks && "The mission was changed while you were asked: look, and send again"].filter(Boolean).join(". ");
  }

  /** Shows the draft: the fields anew where others are needed, else what is in them. */
  show() {
    const { draft, sections } = this, { goal, keep_outs, area, surface_craft: craft } = draft.now;
    const shape = JSON.stringify([goal?.kind, goal?.offset?.frame, goal?.cost?.kind, Object.keys(goal?.weights ?? {}), keep_outs.length, area.length, this.auvs, craft.map(({ id }) => id)]);
    if (shape !== this.shape) {
      const focused = [...this.fields].find(([, { input }]) => input === document.activeElement)?.[0];
      this.shape = shape;
      this.fields.clear();
      fill(sections.goal.body, goal ? this.goalFields(goal) : "");
      fill(sections.keep_outs.body, this.drawButton("keep_outs", "Draw a disc", "Drag on the map from centre to edge, or tap."), keep_outs.map((_, i) => this.row(`${i + 1}`, ["keep_outs", i], ["north_m", "east_m", "radius_m"])), this.addButton("keep_outs", "Add a disc"));
      fill(sections.area.body, this.drawButton("area", "Draw", "Drag a rectangle on the map, or tap corners, which must go round a convex area."), area.map((_, i) => this.row(`${i + 1}`, ["area", i], ["0", "1"])), this.addButton("area", "Add a corner"),
        area.length > 0 && el("button", { type: "button", onclick: () => draft.edit({ area: [] }) }, "Remove the area"));
      fill(sections.limits.body, LIMITS.map((member) => this.number(["limits", member])));
      // Each craft of a fleet has its own limits.
      [sections.limits.details.hidden, sections.surface_craft.details.hidden] = [craft.length > 0, !craft.length];
      fill(sections.surface_craft.body, craft.map(({ id }, i) => this.craftFields(id, i)));
      if (focused) this.fields.get(focused)?.input.focus();
    }
    for (const { show } of this.fields.values()) show();
    this.bar.hidden = !draft.edited.length && !draft.before.length;
    this.undo.disabled = !draft.before.length;
    this.redraw();
  }

  /** Puts a value at a path. @param {Path} path @param {unknown} value @param {boolean} [goesOn] */
  put(path, value, goesOn) {
    this.draft.edit({ [path[0]]: withValue(this.draft.now, path, value)[path[0]] ?? {} }, goesOn);
  }

  /** @param {Path} path @param {string} label @param {HTMLInputElement | HTMLSelectElement} input @param {() => void} show @param {boolean} [timed] */
  field(path, label, input, show, timed) {
    const pointer = `/${path.map((part) => String(part).replaceAll("~", "~0").replaceAll("/", "~1")).join("/")}`, wrong = el("span", { class: "wrong", role: "alert" });
    this.fields.set(pointer, { input, wrong, show, timed });
    return el("label", { class: "field" }, named(label), input, wrong);
  }

  /** A number, which may be left out; one with a `name` of its own is shown as it is. @param {Path} path @param {string} [name] @param {{ timed?: boolean, shown?: (value: number) => number, read?: (shown: number) => number }} [how] */
  number(path, name, how = {}) {
    const member = path[path.length - 1], [label, scale = 1] = name ? [name] : labelOf(member) ?? [String(member)], { shown = (value) => value * scale, read = (value) => value / scale } = how;
    const input = el("input", {
      type: "number", step: "any", onchange: () => { this.typing = null; }, oninput: () => {
        // What is typed in one go is one step.
        const goesOn = this.typing === input;
        this.typing = input;
        this.put(path, Number.isFinite(input.valueAsNumber) ? read(input.valueAsNumber) : undefined, goesOn);
      },
    });
    return this.field(path, label, input, () => {
      if (this.typing === input) return;
      const value = valueAt(this.draft.now, path);
      input.value = typeof value === "number" ? String(unpadded(shown(value))) : "";
    }, how.timed);
  }

  /** A moment, in minutes from now. @param {Path} path @param {string} name */
  minutes(path, name) {
    return this.number(path, name, { timed: true, shown: (at) => Math.round((at - this.t_s) / 6) / 10, read: (minutes) => Math.round(this.t_s + 60 * minutes) });
  }

  /** @param {Path} path @param {string} label @param {string[][]} options @param {(chosen: string) => void} [chosen] */
  choice(path, label, options, chosen = (value) => this.put(path, value || undefined)) {
    const input = el("select", { onchange: () => chosen(input.value) }, options.map(([value, text]) => el("option", { value }, text)));
    return this.field(path, label, input, () => { input.value = valueAt(this.draft.now, path) ?? options[0]?.[0]; });
  }

  /** Numbers of a disc or a corner. @param {string} title @param {Path} path @param {string[]} members */
  row(title, path, members) {
    const [section, i] = /** @type {["keep_outs" | "area", number]} */ (path);
    const remove = el("button", { type: "button", "aria-label": `Remove ${section === "area" ? "corner" : "disc"} ${title}`, onclick: () => this.draft.edit({ [section]: this.draft.now[section].filter((_, k) => k !== i) }) }, "×");
    return el("div", { class: "order-row", role: "group", "aria-label": `${section === "area" ? "Corner" : "Disc"} ${title}` }, el("b", {}, title),
      members.map((member) => this.number([...path, section === "area" ? Number(member) : member], labelOf(member)?.[0] ?? (member === "0" ? "north, m" : "east, m"))), remove);
  }

  /** @param {string} section @param {string} text @param {string} how */
  drawButton(section, text, how) {
    return el("p", {}, el("button", { type: "button", class: "draws", "aria-pressed": "false", onclick: () => this.arm(this.armed === section ? "" : section) }, text), ` ${how}`);
  }

  /** For the keyboard: in the middle of the map, to be moved by its numbers. @param {string} section @param {string} text */
  addButton(section, text) {
    return el("button", { type: "button", onclick: () => this.draft.edit(tapped(section, this.draft.now, this.middle)) }, text);
  }

  /** @param {any} goal */
  goalFields(goal) {
    const { auvs } = this, { isOfOne, hasNoOffset, numbers = [] } = GOALS[goal.kind] ?? {}, members = (/** @type {string[]} */ names, /** @type {string[]} */ ...path) => names.map((name) => this.number(["goal", ...path, name]));
    const visits = goal.kind === "visit" && [
      this.choice(["goal", "next"], "visit next", [["", "the planner chooses"], ...auvs.map((id) => [id, id])]),
      this.choice(["goal", "cost", "kind"], LABELS["cost/kind"][0], optionsOf("cost/kind"), (kind) => this.put(["goal", "cost"], { kind, ...COST_BEGINS[/** @type {keyof typeof COST_BEGINS} */ (kind)] })), members(NUMBERS[goal.cost?.kind] ?? [], "cost"),
      goal.cost?.kind === "uncertainty" && this.choice(["goal", "cost", "fixes"], LABELS.fixes[0], optionsOf("fixes"), (fixes) => {
        // The distance and the time of a visit depend on it: the service's own.
        const { within_m: _, dwell_min_s: __, ...others } = this.draft.now.goal;
        this.draft.edit({ goal: { ...others, cost: { ...others.cost, fixes } } });
      }),
      this.choice(["goal", "reduce"], LABELS.reduce[0], optionsOf("reduce")),
    ];
    const reduced = goal.kind === "localise" && [this.choice(["goal", "fixes"], LABELS.fixes[0], optionsOf("fixes")), this.choice(["goal", "reduce"], LABELS.reduce[0], optionsOf("reduce"))];
    return [
      this.choice(["goal", "kind"], "what to do", Object.entries(GOALS).map(([kind, { title }]) => [kind, title]), (kind) => this.draft.edit({ goal: this.goalOf(kind) })), isOfOne ? this.choice(["goal", "auv"], "AUV", auvs.map((id) => [id, id])) : auvs.map((id) => this.member(goal, id)),
      members(numbers), goal.kind === "intermittent" && this.minutes(["goal", "epoch_s"], "begins with the first in, min"), visits, reduced, !hasNoOffset && this.choice(["goal", "offset", "frame"], LABELS["offset/frame"][0], [["", "right above"], ...optionsOf("offset/frame")], (frame) => this.put(["goal", "offset"], frame ? { frame, ...Object.fromEntries(NUMBERS[frame].map((name) => [name, 0])) } : undefined)),
      members(NUMBERS[goal.offset?.frame] ?? [], "offset"), el("p", { class: "about" }, "On the map: tap an AUV, drag what is marked."),
    ].flat(2);
  }

  /** A craft of a fleet: whether it serves, and its limits. @param {string} id @param {number} i */
  craftFields(id, i) {
    const input = el("input", { type: "checkbox", onchange: () => this.put(["surface_craft", i, "serves"], input.checked ? this.served.get(id) : []) });
    const show = () => {
      const craft = this.draft.now.surface_craft[i];
      input.checked = !standsDown(craft);
      if (input.checked) this.served.set(id, craft?.serves);
    };
    this.fields.set(`serves ${id}`, { input, wrong: el("span"), show });
    return el("div", { role: "group", "aria-label": id }, el("div", { class: "order-row" }, el("label", {}, input, named(id), " serves AUVs")),
      el("details", {}, el("summary", {}, "Limits of ", named(id)), LIMITS.map((member) => this.number(["surface_craft", i, "limits", member]))));
  }

  /** An AUV of a goal of several. @param {any} goal @param {string} id */
  member(goal, id) {
    const input = el("input", { type: "checkbox", onchange: () => this.toggle(id) }), show = () => { input.checked = this.isIn(id); };
    this.fields.set(`in ${id}`, { input, wrong: el("span"), show });
    return el("div", { class: "order-row" }, el("label", {}, input, named(id)), GOALS[goal.kind]?.weighs && this.number(["goal", "weights", id], "weight"),
      goal.kind === "visit" && this.minutes(["goal", "serve_by_s", id], "serve by, min"));
  }

  /** @param {string} id */
  isIn(id) {
    const { goal } = this.draft.now;
    return goal.kind === "weighted" ? Object.hasOwn(goal.weights ?? {}, id) : (goal.auvs ?? []).includes(id);
  }

  /** Takes an AUV into the goal, or out of it. @param {string} id */
  toggle(id) {
    const { goal } = this.draft.now, isIn = this.isIn(id);
    if (goal.kind === "weighted") return this.put(["goal", "weights", id], isIn ? undefined : 1);
    this.put(["goal", "auvs"], isIn ? goal.auvs.filter((/** @type {string} */ other) => other !== id) : [...goal.auvs ?? [], id]);
  }

  /** A goal of another kind. @param {string} kind */
  goalOf(kind) {
    const { auvs } = this, { offset } = this.draft.now.goal, { isOfOne, hasNoOffset, begins } = GOALS[kind];
    const of = isOfOne ? { auv: auvs[0] } : kind === "weighted" ? { weights: Object.fromEntries(auvs.map((id) => [id, 1])) } : { auvs };
    return { kind, ...of, ...begins?.(this.t_s), ...!hasNoOffset && offset && { offset } };
  }

  confirm() {
    const { dialog, draft } = this, words = draft.words();
    fill(dialog, el("h2", { id: "order-title" }, words.length ? "Send these changes?" : "Nothing is changed"), el("ul", { class: "changes" }, words.map((line) => el("li", {}, named(line)))), el("div", { class: "row" },
      words.length > 0 && el("button", { type: "button", class: "primary", onclick: () => { dialog.close(); this.give(); } }, "Send"), el("button", { type: "button", onclick: () => dialog.close() }, "Back")));
    dialog.showModal();
  }

  async give() {
    for (const { wrong } of [...this.fields.values(), ...Object.values(this.sections)]) fill(wrong);
    for (const { input } of this.fields.values()) input.removeAttribute("aria-invalid");
    try {
      await this.send(this.draft.patch());
    } catch (error) {
      if (error instanceof Refusal) error.problem.errors.toReversed().forEach(({ pointer = "", detail }) => this.refused(pointer, detail));
    }
  }

  /** Shows an error of the service at its field, or at its section. @param {string} pointer @param {string} detail */
  refused(pointer, detail) {
    const section = this.sections[pointer.split("/")[1]], field = this.fields.get(pointer) ?? this.fields.get(`${pointer}/0`);
    if (!section) return;
    section.details.open = true;
    fill(field?.wrong ?? section.wrong, field ? detail : `${pointer}: ${detail}`);
    field?.input.setAttribute("aria-invalid", "true");
    field?.input.focus();
  }

  /** @param {Place} at @param {number} near @returns {boolean} */
  press(at, near) {
    const distance = (/** @type {Place} */ other) => Math.hypot(other.north - at.north, other.east - at.east), { now } = this.draft, { armed } = this;
    const handle = this.handles.filter((each) => distance(each) < near).sort((a, b) => distance(a) - distance(b))[0];
    this.held = handle ? { drag: handle.drag, moved: false } : armed ? { drag: (to) => dragged(armed, now, at, to), moved: false, draws: true } : null;
    return this.held !== null;
  }

  /** @param {Place} at */
  move(at) {
    if (!this.held) return;
    const part = this.held.drag(at);
    this.draft.edit({ [this.section]: part[this.section] }, this.held.moved);
    this.held.moved = true;
  }

  release() {
    if (this.held?.draws && this.held.moved) this.arm("");
    this.held = null;
  }

  /** @param {Place} at @param {number} near */
  tap(at, near) {
    if (this.held && !this.held.draws) return;
    if (this.armed) {
      this.draft.edit(tapped(this.armed, this.draft.now, at));
      if (this.armed === "keep_outs") this.arm("");
    } else if (this.section === "goal" && !this.fieldset.disabled) this.choose(at, near);
  }

  /** The AUV at a place: that to stay above, that to visit next, or one more or less. @param {Place} at @param {number} near */
  choose(at, near) {
    const { goal } = this.draft.now, auv = this.picture?.vehicles.find(({ kind, name, north, east }) => kind === "auv" && name && Math.hypot(north - at.north, east - at.east) < near)?.name;
    if (!auv || !this.auvs.includes(auv)) return;
    if (goal.kind === "track") this.put(["goal", "auv"], auv);
    else if (goal.kind === "visit") this.put(["goal", "next"], goal.next === auv ? undefined : auv);
    else this.toggle(auv);
  }

  aims() {
    return !this.fieldset.disabled && (this.draws() || this.section === "goal");
  }

  draws() {
    return this.armed !== "";
  }

  /** @param {Picture} picture @param {Place} frame */
  overlay(picture, frame) {
    [this.picture, this.middle] = [picture, frame];
    this.handles = this.fieldset.disabled ? [] : handlesOf(this.section, this.draft.now, picture);
    return orderOverlay(this.section, this.draft, this.handles, picture);
  }
}

/** A number without the digits that single precision adds to it: an autopilot's 1.2 m/s comes as 1.2000000476837158. @param {number} value */
function unpadded(value) {
  const short = Number(value.toPrecision(7));
  return Math.abs(Math.fround(short) - value) <= 1e-12 * Math.abs(value) ? short : Number(value.toPrecision(12));
}
