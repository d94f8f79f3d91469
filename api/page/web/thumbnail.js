// A scenario's tracks as a small picture.

import { el } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg", SIZE = [240, 130], MARGIN = 10;

/**
 * @param {{ name: string, planner: { tracks: { asc: [number, number][], auvs: { [id: string]: [number, number][] } } }, line_of_sight: { tracks: { asc: [number, number][] } }, keep_outs?: [number, number, number][], area?: [number, number][] }} scenario
 */
export function thumbnail({ name, planner, line_of_sight, keep_outs = [], area = [] }) {
  const auvs = Object.values(planner.tracks.auvs);
  const all = [planner.tracks.asc, ...auvs, area].flat(), norths = all.map(([north]) => north), easts = all.map(([, east]) => east);
  const middle = (/** @type {number[]} */ list) => (Math.min(...list) + Math.max(...list)) / 2, extent = (/** @type {number[]} */ list) => Math.max(Math.max(...list) - Math.min(...list), 10);
  const scale = Math.min((SIZE[0] - 2 * MARGIN) / extent(easts), (SIZE[1] - 2 * MARGIN) / extent(norths));
  const x = (/** @type {number} */ east) => (SIZE[0] / 2 + (east - middle(easts)) * scale).toFixed(1), y = (/** @type {number} */ north) => (SIZE[1] / 2 - (north - middle(norths)) * scale).toFixed(1);
  const path = (/** @type {[number, number][]} */ points, /** @type {string} */ kind, end = "") => shape("path", { class: `thumb-${kind}`, d: points.map(([north, east], i) => `${i ? "L" : "M"}${x(east)} ${y(north)}`).join("") + end });
  const svg = shape("svg", { viewBox: `0 0 ${SIZE[0]} ${SIZE[1]}`, role: "img", "aria-label": `Tracks of ${name}` });
  svg.append(...(area.length ? [path(area, "area", "Z")] : []), ...keep_outs.map(([north, east, radius]) => shape("circle", { class: "thumb-keep-out", cx: x(east), cy: y(north), r: radius * scale })),
    ...auvs.map((points) => path(points, "auv")), path(line_of_sight.tracks.asc, "los"), path(planner.tracks.asc, "plan"));
  return el("div", { class: "thumb" }, svg);
}

/** @param {string} name @param {{ [attribute: string]: string | number }} attributes */
function shape(name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  return element;
}
