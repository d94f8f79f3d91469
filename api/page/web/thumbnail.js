// A scenario's tracks as a small picture.

import { auvColour, el, shape, swatch } from "./dom.js";

/** Width and height of a picture, in the units of its paths. */
export const SIZE = [240, 130];
/** Scenarios have no more AUVs. */
const AUVS_IN_KEY = 5;

/**
 * @param {{ name: string, paths: { [kind: string]: string }, keep_outs?: [number, number, number][] }} scenario
 */
export function thumbnail({ name, paths, keep_outs = [] }) {
  return el("div", { class: "thumb" }, shape("svg", { viewBox: `0 0 ${SIZE.join(" ")}`, role: "img", "aria-label": `Tracks of ${name}` },
    ...keep_outs.map(([cx, cy, r]) => shape("circle", { class: "thumb-keep-out", cx, cy, r })), ...Object.entries(paths).flatMap(([kind, d]) => (kind === "auv" ? tracksOf(d) : [shape("path", { class: `thumb-${kind}`, d })]))));
}

/** The AUVs' tracks, each in its colour: each begins with a move. @param {string} paths */
function tracksOf(paths) {
  return paths.split(/(?=M)/).map((d, i) => {
    const track = shape("path", { class: "thumb-auv", d });
    // The page's policy allows no style in an attribute.
    track.style.stroke = `var(--${auvColour(i)})`;
    return track;
  });
}

/** What the pictures show. */
export function thumbnailKey() {
  const sample = (/** @type {string} */ kind, /** @type {string} */ name) => el("li", {}, el("span", { class: `sample sample-${kind}`, "aria-hidden": "true" }), name);
  return el("ul", { class: "legend thumb-key", "aria-label": "Key of the pictures" }, sample("plan", "planner"), sample("los", "strongest line of sight, tuned"),
    Array.from({ length: AUVS_IN_KEY }, (_, i) => el("li", {}, swatch(auvColour(i)), `AUV ${i + 1}`)), sample("keep-out", "keep out"), sample("vessel", "other vessel"));
}
