// Curves over a common time axis, one canvas each. Hover, zoom and readout act on all of them.

import { el, fill, oncePerFrame } from "./dom.js";
import { number } from "./format.js";
import { bandKinds, drawChart, LEFT_PX, RIGHT_PX } from "./chart_canvas.js";

/**
 * @typedef {import("./chart_canvas.js").Chart} Chart
 * @typedef {import("./chart_canvas.js").Drawn} Drawn
 * @typedef {import("./chart_canvas.js").Event} Event
 * @typedef {{ onCursor?: (x: number | null) => void, onWindow?: (from: number, to: number) => void, formatX?: (x: number, step: number) => string }} StackOptions
 */

const HEIGHT_PX = 132;
/** A drag shorter than this is a click, pixels. */
const DRAG_PX = 6;

/** A column of charts. */
export class ChartStack {
  /** @param {HTMLElement} host @param {StackOptions} [options] */
  constructor(host, options = {}) {
    this.host = host;
    this.options = options;
    /** @type {Map<string, Drawn>} */
    this.drawn = new Map();
    this.cursor = /** @type {number | null} */ (null);
    this.chosen = /** @type {[number, number] | null} */ (null);
    /** @type {{ from: number, to: number } | null} */
    this.drag = null;
    /** Whether the next click ends a drag. */
    this.dragged = false;
    this.redraw = oncePerFrame(() => this.draw());
    this.reset = el("button", { type: "button", class: "chart-reset", hidden: true, onclick: () => this.showAll() }, "Whole time");
    this.list = el("div", { class: "chart-list" });
    /** @type {Event[]} */
    this.events = [];
    this.eventsKey = el("p", { class: "said", hidden: true }, "▾ marks what is in the log: hold the pointer over one.");
    fill(host, this.reset, this.eventsKey, this.list);
    new ResizeObserver(() => this.redraw()).observe(host);
  }

  /** @param {Chart[]} charts */
  setCharts(charts) {
    const ids = charts.map((chart) => chart.id).join();
    if (ids !== [...this.drawn.keys()].join()) {
      this.drawn = new Map(charts.map((chart) => [chart.id, this.drawn.get(chart.id) ?? this.build(chart)]));
      fill(this.list, [...this.drawn.values()].map(({ figure }) => figure));
    }
    for (const chart of charts) {
      const drawn = /** @type {Drawn} */ (this.drawn.get(chart.id));
      const keys = (/** @type {Chart} */ of) => [...of.curves, ...bandKinds(of)].map(({ name, colour: key }) => name + key).join();
      const before = keys(drawn.chart);
      drawn.chart = chart;
      if (before !== keys(chart) || !drawn.values.length) this.buildLegend(drawn);
    }
  }

  /** @param {Event[]} events */
  setEvents(events) {
    this.events = events;
    this.eventsKey.hidden = !events.length;
  }

  /** @param {number} from @param {number} to */
  setWindow(from, to) {
    /** @type {[number, number]} */
    const chosen = [from, to];
    this.chosen = from < to ? chosen : null;
    this.reset.hidden = !this.chosen;
    this.redraw();
  }

  showAll() {
    this.setWindow(0, 0);
  }

  /** @param {number | null} x */
  setCursor(x) {
    this.cursor = x;
  }

  /** @param {Chart} chart @returns {Drawn} */
  build(chart) {
    const canvas = el("canvas", { class: "chart-canvas", tabIndex: 0, role: "img", "aria-label": chart.title });
    const legend = el("span", { class: "chart-legend" });
    const figure = el("figure", { class: "chart" }, el("figcaption", {}, el("strong", {}, `${chart.title}, ${chart.unit}`), legend), canvas);
    canvas.style.height = `${HEIGHT_PX}px`;
    const drawn = { chart, figure, canvas, legend, values: [], low: 0, high: 1 };
    this.listen(drawn);
    return drawn;
  }

  /** @param {Drawn} drawn */
  buildLegend(drawn) {
    drawn.values = drawn.chart.curves.map(() => el("b"));
    fill(drawn.legend, drawn.chart.curves.map((curve, i) => el("span", {}, el("i", { class: `chart-key key-${curve.dash ?? "solid"}`, style: `border-color: var(--${curve.colour})`, "aria-hidden": "true" }), el("bdi", {}, curve.name), " ", drawn.values[i])),
      bandKinds(drawn.chart).map(({ name, colour: key }) => el("span", {}, el("i", { class: "chart-key key-band", style: `border-color: var(--${key})`, "aria-hidden": "true" }), `answered by ${name}`)));
  }

  /** @param {Drawn} drawn */
  listen({ canvas }) {
    const at = (/** @type {PointerEvent} */ event) => this.xAt(event.clientX - canvas.getBoundingClientRect().left, canvas.clientWidth);
    canvas.addEventListener("pointerdown", (event) => { if (event.pointerType === "mouse") this.drag = { from: at(event), to: at(event) }; });
    canvas.addEventListener("pointermove", (event) => {
      if (this.drag) this.drag.to = at(event);
      this.options.onCursor?.(at(event));
      this.redraw();
    });
    canvas.addEventListener("pointerup", () => {
      const { drag } = this, [from, to] = this.window();
      this.drag = null;
      this.dragged = false;
      if (!drag) return;
      const [left, right] = [Math.min(drag.from, drag.to), Math.max(drag.from, drag.to)];
      if (((right - left) / (to - from)) * canvas.clientWidth < DRAG_PX) return;
      this.dragged = true;
      this.setWindow(left, right);
      this.options.onWindow?.(left, right);
    });
    canvas.addEventListener("pointerleave", () => {
      this.drag = null;
      this.options.onCursor?.(null);
      this.redraw();
    });
    canvas.addEventListener("dblclick", () => this.showAll());
    canvas.addEventListener("blur", () => this.options.onCursor?.(null));
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key], [from, to] = this.window();
    if (event.key === "Escape") return this.showAll();
    if (!step) return;
    event.preventDefault();
    const by = step * (event.shiftKey ? 10 : 1);
    this.cursor = Math.min(Math.max((this.cursor ?? to) + by, from), to);
    this.options.onCursor?.(this.cursor);
  }

  /** What is shown of the common axis. @returns {[number, number]} */
  window() {
    if (this.chosen) return this.chosen;
    let [from, to] = [Infinity, -Infinity];
    for (const { chart } of this.drawn.values()) {
      for (const { x, length } of chart.curves) {
        if (!length) continue;
        from = Math.min(from, x[0]);
        to = Math.max(to, x[length - 1]);
      }
    }
    return from < to ? [from, to] : [Number.isFinite(from) ? from - 1 : 0, Number.isFinite(to) ? to + 1 : 1];
  }

  /** @param {number} pixel @param {number} width */
  xAt(pixel, width) {
    const [from, to] = this.window();
    return Math.min(Math.max(from + ((pixel - LEFT_PX) / (width - LEFT_PX - RIGHT_PX)) * (to - from), from), to);
  }

  draw() {
    const [from, to] = this.window();
    for (const [i, drawn] of [...this.drawn.values()].entries()) drawChart(drawn, { from, to, cursor: this.cursor, drag: this.drag, events: this.events, first: i === 0, formatX: this.options.formatX ?? ((x) => number(x, 0)) });
  }
}
