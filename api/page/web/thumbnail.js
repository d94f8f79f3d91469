// A scenario's tracks as a small picture.

import { el, shape } from "./dom.js";

/** Width and height of a picture, in the units of its paths. */
export const SIZE = [240, 130];

/**
 * @param {{ name: string, paths: { [kind: string]: string }, keep_outs?: [number, number, number][] }} scenario
 */
export function thumbnail({ name, paths, keep_outs = [] }) {
  return el("div", { class: "thumb" }, shape("svg", { viewBox: `0 0 ${SIZE.join(" ")}`, role: "img", "aria-label": `Tracks of ${name}` },
    ...keep_outs.map(([cx, cy, r]) => shape("circle", { class: "thumb-keep-out", cx, cy, r })), ...Object.entries(paths).map(([kind, d]) => shape("path", { class: `thumb-${kind}`, d }))));
}
