// What stands at one place of a picture: vehicles, arrows, marks, ellipses.

import { FONT_BOLD } from "./lettering.js";

/** @typedef {import("./drawing.js").Pen} Pen */

/** 95 % of a normal distribution in the plane lies within √5.991 standard deviations. */
const CHI_SQUARED_95 = 5.991;
const ARROW_MIN_PX = 36;
/** Half a side of a handle, and the radius of the ring around an AUV that is ordered, pixels. */
const HANDLE_PX = 6, RING_PX = 16;
/** Opacity of a vessel that may be elsewhere. */
const STALE_ALPHA = 0.5;
/** Shapes point north: hulls and torpedoes, of some 20 pixels. @type {{ [kind: string]: [number, number][] }} */
const SHAPES = {
  craft: [[0, -17], [8, -5], [8, 13], [-8, 13], [-8, -5]],
  auv: [[0, -11], [3.5, -6], [3.5, 7], [6, 11], [-6, 11], [-3.5, 7], [-3.5, -6]],
  vessel: [[0, -17], [5, -9], [6, 4], [4, 13], [-4, 13], [-6, 4], [-5, -9]],
  still: [[0, -9], [9, 0], [0, 9], [-9, 0]],
};

/** @param {Pen} pen @param {import("./types.js").Ellipse} ellipse */
export function drawEllipse(pen, { north, east, covariance: [nn, ne, ee], colour: name }) {
  const mean = (nn + ee) / 2, spread = Math.hypot((nn - ee) / 2, ne);
  const [major, minor] = [mean + spread, mean - spread].map((variance) => Math.sqrt(CHI_SQUARED_95 * Math.max(variance, 0)) * pen.frame.scale);
  if (!(major > 1)) return;
  // The major axis is turned clockwise from north by half the angle of (nn − ee, 2 ne).
  const turned = 0.5 * Math.atan2(2 * ne, nn - ee) - Math.PI / 2, { context } = pen;
  context.beginPath();
  context.ellipse(pen.x(east), pen.y(north), major, minor, turned, 0, 2 * Math.PI);
  pen.stroke(name, "dotted", 1.5);
}

/** @param {Pen} pen @param {import("./types.js").Mark} mark */
export function drawMark(pen, { north, east, kind, colour: name, text = "" }) {
  const { context } = pen, x = pen.x(east), y = pen.y(north);
  context.beginPath();
  if (kind === "dot") {
    context.arc(x, y, 3, 0, 2 * Math.PI);
    context.fillStyle = pen.ink(name);
    return context.fill();
  }
  if (kind === "ring") {
    context.arc(x, y, RING_PX, 0, 2 * Math.PI);
    return pen.stroke(name, "solid", 3);
  }
  if (kind === "handle") {
    context.rect(x - HANDLE_PX, y - HANDLE_PX, 2 * HANDLE_PX, 2 * HANDLE_PX);
    context.fillStyle = pen.ink("card");
    context.fill();
    return pen.stroke(name, "solid", 2);
  }
  if (kind === "label") {
    context.font = FONT_BOLD;
    context.textAlign = "center";
    return pen.text(text, x, y - 9, name);
  }
  if (kind === "stop") {
    // Above its place: an AUV may be there.
    context.arc(x, y - 17, 9, 0, 2 * Math.PI);
    context.fillStyle = pen.ink("card");
    context.fill();
    pen.stroke(name, "solid", 2);
    context.font = FONT_BOLD;
    context.textAlign = "center";
    context.fillStyle = pen.ink("ink");
    return context.fillText(text, x, y - 12.5);
  }
  if (kind === "violation") {
    context.moveTo(x, y - 10);
    context.lineTo(x + 9, y + 6);
    context.lineTo(x - 9, y + 6);
    context.closePath();
    context.fillStyle = pen.ink(name);
    context.fill();
    context.font = FONT_BOLD;
    context.textAlign = "center";
    context.fillStyle = pen.ink("card");
    return context.fillText("!", x, y + 4.5);
  }
}

/** Fixes, upright, and refused ones, turned: hundreds, so that each kind is one stroke. @param {Pen} pen @param {import("./types.js").Mark[]} marks */
export function drawCrosses(pen, marks) {
  for (const [kind, r, turned, width] of /** @type {["fix" | "refused", number, number, number][]} */ ([["fix", 3.5, 0, 1.5], ["refused", 5, Math.PI / 4, 2.5]])) {
    const path = new Path2D(), crosses = marks.filter((mark) => mark.kind === kind), [dx, dy] = [r * Math.cos(turned), r * Math.sin(turned)];
    for (const { north, east } of crosses) {
      const x = pen.x(east), y = pen.y(north);
      path.moveTo(x - dx, y - dy);
      path.lineTo(x + dx, y + dy);
      path.moveTo(x + dy, y - dx);
      path.lineTo(x - dy, y + dx);
    }
    if (crosses.length) pen.stroke(crosses[0].colour, "solid", width, path);
  }
}

/** @param {Pen} pen @param {import("./types.js").Arrow} arrow */
export function drawArrow(pen, { north, east, heading, length_m, colour: name }) {
  const { context, frame } = pen;
  if (!Number.isFinite(north + east + heading)) return;
  const length = Math.max((length_m || 0) * frame.scale, ARROW_MIN_PX);
  context.save();
  context.translate(pen.x(east), pen.y(north));
  context.rotate(heading);
  context.beginPath();
  context.moveTo(0, 0);
  context.lineTo(0, -length);
  context.moveTo(-6, 9 - length);
  context.lineTo(0, -length);
  context.lineTo(6, 9 - length);
  pen.stroke(name, "solid", 2.5);
  context.restore();
}

/** @param {Pen} pen @param {import("./types.js").Vehicle} vehicle */
export function drawVehicle(pen, { kind, north, east, heading, colour: name, stale }) {
  const { context } = pen;
  if (!Number.isFinite(north + east)) return;
  context.save();
  context.translate(pen.x(east), pen.y(north));
  context.rotate(Number.isFinite(heading) ? heading : 0);
  if (stale) context.globalAlpha = STALE_ALPHA;
  context.beginPath();
  SHAPES[kind].forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.closePath();
  context.fillStyle = pen.ink(name);
  context.fill();
  pen.stroke("water", "solid", 1.5);
  context.restore();
}
