// Runs of one scenario and seed with several controllers: side by side on one clock, and their scores.

import { el, fill, named, swatch } from "./dom.js";
import { degrees, methodName, moment, number } from "./format.js";
import { differences } from "./differences.js";
import { scores } from "./scores.js";
import { MissionView } from "./mission.js";

/**
 * @typedef {import("./picture.js").Run} Run
 * @typedef {ReturnType<typeof scores>} Scores
 */

/** Colours of the runs, in order. */
const RUN_COLOURS = ["craft-1", "craft-2", "craft-3", "craft-4", "craft-5", "craft-6"];

/** Every metric: less is better in each, but for those with −1. @type {[string, keyof Scores, (value: number) => string, number?][]} */
const METRICS = [
  ["distance to the goal, RMS, whole mission", "rms_m", (value) => number(value, 2, "m")],
  ["distance to the goal, RMS, once settled", "settled_rms_m", (value) => number(value, 3, "m")],
  ["largest distance to the goal", "worst_m", (value) => number(value, 1, "m")],
  ["propulsion energy", "energy_j", (value) => number(value, 0, "J")],
  ["least distance from another vessel's side: more is better", "vessel_least_m", (value) => number(value, 0, "m"), -1],
  ["heading travel", "heading_travel_rad", (value) => number(degrees(value), 0, "°")],
];

/** Scores closer than this share count as equal. */
const LEVEL = 0.01;

/**
 * A run to draw.
 * @param {string} controller
 * @param {number} i
 * @param {import("./recording.js").Recording} recording
 * @returns {Run}
 */
export function runOf(controller, i, recording) {
  return { name: methodName(controller), colour: RUN_COLOURS[i % RUN_COLOURS.length], recording };
}

/** Several runs, and their scores. */
export class ComparisonView {
  /**
   * @param {HTMLElement} host
   * @param {Run[]} runs
   * @param {{ name: string, link?: string, signal?: AbortSignal, needed?: (t: number, playing: boolean) => void, over?: boolean }} about `name` begins the names of files;
   *   `signal` ends the view; `over`: every run is complete
   */
  constructor(host, runs, { name, link, signal, needed, over = false }) {
    this.signal = signal;
    this.needed = needed;
    this.over = over;
    this.runs = runs;
    this.name = name;
    this.table = el("div", { class: "table-scroll", tabIndex: 0, role: "group", "aria-label": "Scores of each run" });
    const sideBySide = el("input", { type: "checkbox", checked: true, onchange: () => this.build(sideBySide.checked) });
    const said = el("span", { role: "status" });
    const copy = async (/** @type {string} */ text) => {
      try {
        await navigator.clipboard.writeText(text);
        fill(said, "copied");
      } catch {
        // Without access to the clipboard, or without HTTPS, the link is shown instead.
        fill(said, el("code", {}, text));
      }
    };
    this.stage = el("div");
    this.why = el("ul", { class: "why-differ", "aria-label": "Where they differ" });
    this.scores = el("section", { class: "panel scores" }, el("h2", {}, "Scores"), this.why, this.table,
      el("div", { class: "row" },
        link && el("button", { type: "button", onclick: () => copy(link) }, "Copy link"),
        el("button", { type: "button", onclick: () => this.savePng() }, "Save PNG"), el("button", { type: "button", onclick: () => this.saveCsv() }, "Save CSV"),
        el("label", {}, sideBySide, "a map each"), said));
    fill(host, this.stage);
    this.build(true);
  }

  /** @param {boolean} sideBySide */
  build(sideBySide) {
    this.view = new MissionView(this.stage, this.runs, { sideBySide, before: this.view, needed: this.needed, signal: this.signal, below: this.scores });
    this.changed();
  }

  changed() {
    this.view?.changed();
    const until = this.over ? Infinity : Math.min(...this.runs.map(({ recording }) => recording.plans.last));
    fill(this.table, scoresTable(this.runs, this.over, until));
    fill(this.why, differences(this.runs, until).map((sentence) => el("li", {}, named(sentence))));
  }

  draw() {
    this.view?.draw();
  }

  /** Every map and chart in one column. */
  savePng() {
    const canvases = Array.from(this.stage.querySelectorAll("canvas")), style = getComputedStyle(document.body);
    const gap = 24 * devicePixelRatio, titled = 40 * devicePixelRatio;
    const width = Math.max(...canvases.map((canvas) => canvas.width)), height = canvases.reduce((sum, canvas) => sum + canvas.height + gap, titled);
    const sheet = Object.assign(document.createElement("canvas"), { width, height }), context = /** @type {CanvasRenderingContext2D} */ (sheet.getContext("2d"));
    context.fillStyle = style.backgroundColor;
    context.fillRect(0, 0, width, height);
    context.fillStyle = style.color;
    context.font = `${16 * devicePixelRatio}px sans-serif`;
    context.fillText(`${this.name}: ${this.runs.map((run) => run.name).join(", ")}`, gap / 2, titled * 0.65);
    let top = titled;
    for (const canvas of canvases) {
      if (canvas.width && canvas.height) context.drawImage(canvas, 0, top);
      top += canvas.height + gap;
    }
    sheet.toBlob((blob) => blob && save(blob, `${this.name}.png`));
  }

  saveCsv() {
    const results = this.runs.map(({ recording }) => scores(recording));
    const quoted = (/** @type {string} */ text) => `"${text.replaceAll('"', '""')}"`;
    const head = ["controller", ...METRICS.map(([, key]) => key), "information"].join(",");
    const rows = this.runs.map((run, i) => [quoted(run.name), ...METRICS.map(([, key]) => results[i][key]), quoted(run.recording.scene.information ?? "")].join(","));
    save(new Blob([[head, ...rows, ""].join("\n")], { type: "text/csv" }), `${this.name}.csv`);
  }
}

/** @param {Blob} blob @param {string} name */
function save(blob, name) {
  const link = el("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** @param {Run[]} runs @param {boolean} over whether all were flown to their end @param {number} until before, they are compared up to the moment that all have reached */
function scoresTable(runs, over, until) {
  const results = runs.map(({ recording }) => scores(recording, -Infinity, until));
  const rows = METRICS.filter(([, key]) => key !== "vessel_least_m" || runs[0].recording.vessels.size).map(([name, key, words, sign = 1]) => {
    const values = results.map((result) => result[key]), known = values.filter(Number.isFinite), least = Math.min(...known.map((value) => sign * value));
    const level = values.map((value) => over && Number.isFinite(value) && sign * value <= least + LEVEL * Math.abs(least));
    const nWinners = level.filter(Boolean).length, decided = known.length > 1 && nWinners < known.length;
    const winner = !decided ? "level" : runs.filter((_, i) => level[i]).map((run) => run.name).join(", ");
    return el("tr", {}, el("th", { scope: "row" }, name, key === "settled_rms_m" && ` (from ${moment(results[0].settled_from_s, false)})`), values.map((value, i) => el("td", { class: decided && level[i] ? "better" : "" }, words(value))), el("td", { class: "winner" }, over && known.length ? winner : "–"));
  });
  const gains = runs.map(({ recording: { scene } }) => el("td", { class: "information" }, gainWords(scene)));
  const information = runs.map(({ recording }) => el("td", { class: "information" }, recording.scene.information ?? "–"));
  return el("table", {},
    el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "metric (less is better, unless it says more)"), runs.map((run) => el("th", { scope: "col" }, swatch(run.colour), named(run.name))), el("th", { scope: "col" }, "best"))),
    el("tbody", {}, rows, el("tr", {}, el("th", { scope: "row" }, "gains"), gains, el("td", {})), el("tr", {}, el("th", { scope: "row" }, "information given"), information, el("td", {}))));
}

/** @param {import("./types.js").Scene} scene */
function gainWords({ controller = "mpc", gains }) {
  if (controller === "mpc" || gains === null) return "–";
  if (!gains) return "the service's, not tuned";
  const { look_ahead_m, along_track_gain_per_s, integral_gain_mps } = gains;
  return `look-ahead ${look_ahead_m} m, along-track ${along_track_gain_per_s} 1/s${integral_gain_mps ? `, integral ${integral_gain_mps} m/s` : ""}`;
}
