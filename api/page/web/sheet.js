// Static figures: panels of lines and dots with axes, under a legend.

import { el, fill } from "./dom.js";
import { number } from "./format.js";
import { roundStep } from "./drawing.js";

/**
 * @typedef {{ name: string, colour: string, stroke: "solid" | "dashed" | "dots", points: [number, number][] }} SheetLine
 * @typedef {{ heading: string, x_label: string, y_label: string, lines: SheetLine[] }} SheetPanel
 * @typedef {{ title: string, columns: number, panels: SheetPanel[] }} Sheet
 * @typedef {{ x: (value: number) => number, y: (value: number) => number, left: number, right: number, top: number, bottom: number, limits: [number, number, number, number] }} SheetScales
 */

const SHEET_MARGIN = { left: 66, right: 14, top: 12, bottom: 44 };
const SHEET_HEIGHT_PX = 330, SHEET_RATIO = 2;

/**
 * Draws a figure into `host`.
 * @param {HTMLElement} host
 * @param {Sheet} sheet
 */
export function drawSheet(host, sheet) {
  const names = new Map(sheet.panels.flatMap((panel) => panel.lines.map((line) => [line.name, line])));
  const legend = el("ul", { class: "legend" }, Array.from(names.values(), (line) => {
    const key = el("span", { class: "swatch", "aria-hidden": "true" });
    key.style.background = line.colour;
    return el("li", {}, key, line.name, line.stroke === "dashed" && " (dashed)");
  }));
  const grid = el("div", { class: `sheet-grid sheet-columns-${Math.min(sheet.columns, 3)}` });
  const canvases = sheet.panels.map((panel) => {
    const canvas = el("canvas", { class: "sheet-canvas", role: "img", "aria-label": `${panel.heading || sheet.title}: ${panel.y_label} over ${panel.x_label}; ${panel.lines.map((line) => line.name).join(", ")}` });
    grid.append(el("figure", {}, panel.heading && el("figcaption", {}, panel.heading), canvas));
    return canvas;
  });
  const save = el("button", { type: "button", onclick: () => savePanels(sheet.title, canvases) }, "Save as PNG");
  fill(host, el("h2", {}, sheet.title), legend, grid, save);
  const draw = () => sheet.panels.forEach((panel, i) => drawPanel(canvases[i], panel));
  new ResizeObserver(draw).observe(grid);
  draw();
}

/** @param {string} title @param {HTMLCanvasElement[]} canvases */
function savePanels(title, canvases) {
  canvases.forEach((canvas, i) => canvas.toBlob((blob) => {
    if (!blob) return;
    const link = el("a", { href: URL.createObjectURL(blob), download: `${title.replace(/[^\w-]+/g, "-")}-${i + 1}.png` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }));
}

/** @param {HTMLCanvasElement} canvas @param {SheetPanel} panel */
function drawPanel(canvas, panel) {
  const width = canvas.clientWidth, height = SHEET_HEIGHT_PX;
  if (!width) return;
  canvas.style.height = `${height}px`;
  canvas.width = width * SHEET_RATIO;
  canvas.height = height * SHEET_RATIO;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.scale(SHEET_RATIO, SHEET_RATIO);
  // On white in every theme: the colours of figures are chosen for white.
  context.fillStyle = "#ffffff";
  context.fillRect(0, 0, width, height);
  const scales = sheetScales(panel, width, height);
  drawSheetAxes(context, panel, scales);
  context.beginPath();
  context.rect(scales.left, scales.top, scales.right - scales.left, scales.bottom - scales.top);
  context.save();
  context.clip();
  for (const line of panel.lines) drawSheetLine(context, line, scales);
  context.restore();
}

/** @param {SheetPanel} panel @param {number} width @param {number} height @returns {SheetScales} */
function sheetScales({ lines }, width, height) {
  const left = SHEET_MARGIN.left, right = width - SHEET_MARGIN.right, top = SHEET_MARGIN.top, bottom = height - SHEET_MARGIN.bottom;
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const { points } of lines) {
    for (const [x, y] of points) {
      if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
      [x0, x1, y0, y1] = [Math.min(x0, x), Math.max(x1, x), Math.min(y0, y), Math.max(y1, y)];
    }
  }
  if (!(x0 <= x1)) [x0, x1, y0, y1] = [0, 1, 0, 1];
  const roomX = 0.03 * (x1 - x0) || 0.5, roomY = 0.06 * (y1 - y0) || 0.5;
  [x1, y0, y1] = [x1 + roomX, y0 - roomY, y1 + roomY];
  return {
    left, right, top, bottom, limits: [x0, x1, y0, y1],
    x: (x) => left + ((x - x0) / (x1 - x0)) * (right - left),
    y: (y) => bottom - ((y - y0) / (y1 - y0)) * (bottom - top),
  };
}

/** @param {CanvasRenderingContext2D} context @param {SheetPanel} panel @param {SheetScales} scales */
function drawSheetAxes(context, { x_label, y_label }, { x, y, left, right, top, bottom, limits: [x0, x1, y0, y1] }) {
  context.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  context.strokeStyle = "#e2e6ea";
  context.fillStyle = "#33424f";
  context.lineWidth = 1;
  context.beginPath();
  const digits = (/** @type {number} */ step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const xStep = roundStep((x1 - x0) / 4), yStep = roundStep((y1 - y0) / 4);
  context.textAlign = "center";
  context.textBaseline = "top";
  for (let at = Math.ceil(x0 / xStep) * xStep; at <= x1; at += xStep) {
    context.moveTo(x(at), top);
    context.lineTo(x(at), bottom);
    context.fillText(number(at, digits(xStep)), x(at), bottom + 6);
  }
  context.fillText(x_label, (left + right) / 2, bottom + 24);
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (let at = Math.ceil(y0 / yStep) * yStep; at <= y1; at += yStep) {
    context.moveTo(left, y(at));
    context.lineTo(right, y(at));
    context.fillText(number(at, digits(yStep)), left - 7, y(at));
  }
  context.stroke();
  context.save();
  context.translate(14, (top + bottom) / 2);
  context.rotate(-Math.PI / 2);
  context.textAlign = "center";
  context.fillText(y_label, 0, 0);
  context.restore();
}

/** @param {CanvasRenderingContext2D} context @param {SheetLine} line @param {SheetScales} scales */
function drawSheetLine(context, { colour, stroke, points }, { x, y }) {
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = 2;
  context.lineJoin = "round";
  const finite = points.filter(([across, up]) => Number.isFinite(across) && Number.isFinite(up));
  if (stroke === "dots") {
    return finite.forEach(([across, up]) => {
      context.beginPath();
      context.arc(x(across), y(up), 4, 0, 2 * Math.PI);
      context.fill();
    });
  }
  context.setLineDash(stroke === "dashed" ? [9, 6] : []);
  context.beginPath();
  finite.forEach(([across, up], i) => (i ? context.lineTo(x(across), y(up)) : context.moveTo(x(across), y(up))));
  context.stroke();
  context.setLineDash([]);
}
