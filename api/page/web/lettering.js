// Names of the vehicles on a map: where they cover no hull and no other name, with a leader where that is not beside the vehicle.

/**
 * @typedef {import("./drawing.js").Pen} Pen
 * @typedef {{ left: number, right: number, top: number, bottom: number }} Box
 */

const FONT = "12.5px system-ui, 'DejaVu Sans', sans-serif";
export const FONT_BOLD = `600 ${FONT}`;
export const FONT_SMALL = "11px system-ui, 'DejaVu Sans', sans-serif";

/** Half the width of a hull and of a point of an arrow, pixels, and how far along an arrow those points are. */
const HULL_PX = { craft: 15, auv: 11, vessel: 14, still: 9 }, ARROW_POINT_PX = 5, ARROW_POINTS_PX = [20, 30, 38];
/** Where a name is tried, as distances from the vehicle, pixels, and as directions: right and left first. */
const DISTANCES_PX = [16, 34, 56, 84], DIRECTIONS = [[1, 0], [-1, 0], [0.8, -0.8], [0.8, 0.8], [-0.8, -0.8], [-0.8, 0.8], [0, -1], [0, 1]];
/** Of a place, in square pixels of what is covered: what a step farther and a change from the last picture cost. */
const STEP_COST = 12, CHANGE_COST = 40;
const EDGE_PX = 4, BUTTONS = { left: 0, right: 230, top: 0, bottom: 46 };

/** @param {Pen} pen @param {import("./types.js").Picture} picture */
export function drawNames(pen, { vehicles, arrows, marks }) {
  const { frame } = pen, sides = frame.sides ??= new Map();
  const taken = [BUTTONS, ...vehicles.map(({ kind, north, east }) => around(pen.x(east), pen.y(north), HULL_PX[kind]))];
  for (const { north, east, heading } of arrows) for (const far of ARROW_POINTS_PX) taken.push(around(pen.x(east) + far * Math.sin(heading), pen.y(north) - far * Math.cos(heading), ARROW_POINT_PX));
  for (const { kind, north, east } of marks) if (kind === "stop") taken.push(around(pen.x(east), pen.y(north) - 17, 10));
  for (const vehicle of vehicles) {
    const x = pen.x(vehicle.east), y = pen.y(vehicle.north);
    if (!vehicle.name || !(x > -20 && x < frame.width + 20 && y > -20 && y < frame.height + 20)) continue;
    const { context } = pen, { note } = vehicle;
    context.font = FONT_BOLD;
    const shown = shortened(context, vehicle.name, Math.min(180, frame.width / 3)), named = context.measureText(shown).width;
    context.font = FONT_SMALL;
    const width = Math.max(named, note ? context.measureText(note).width : 0);
    const { box, at, far } = namePlace(x, y, width, note ? 30 : 16, taken, frame, sides.get(vehicle.name)), right = box.right <= x;
    sides.set(vehicle.name, at);
    taken.push(box);
    if (far) drawLeader(pen, x, y, box, HULL_PX[vehicle.kind], vehicle.colour);
    context.textAlign = right ? "right" : "left";
    context.font = FONT_BOLD;
    pen.text(shown, right ? box.right : box.left, box.top + 13);
    context.font = FONT_SMALL;
    if (note) pen.text(note, right ? box.right : box.left, box.top + 27, "soft");
  }
}

/** @param {number} x @param {number} y @param {number} half @returns {Box} */
function around(x, y, half) {
  return { left: x - half, right: x + half, top: y - half, bottom: y + half };
}

/**
 * The place of a name of which least is covered.
 * @param {number} x @param {number} y @param {number} width @param {number} height @param {Box[]} taken
 * @param {{ width: number, height: number }} frame @param {number | undefined} before where it was in the last picture
 */
function namePlace(x, y, width, height, taken, frame, before) {
  let best = { box: around(x, y, 0), at: -1, far: false }, least = Infinity;
  for (const [step, distance] of DISTANCES_PX.entries()) {
    for (const [k, [across, down]] of DIRECTIONS.entries()) {
      const left = x + across * distance - (across > 0 ? 0 : across < 0 ? width : width / 2), top = y + down * distance - (down > 0 ? 0 : down < 0 ? height : height / 2);
      const box = { left, right: left + width, top, bottom: top + height }, at = step * DIRECTIONS.length + k;
      const inside = { left: Math.max(left, EDGE_PX), right: Math.min(box.right, frame.width - EDGE_PX), top: Math.max(top, EDGE_PX), bottom: Math.min(box.bottom, frame.height - EDGE_PX) };
      const cost = taken.reduce((sum, other) => sum + shared(box, other), 0) + (width * height - shared(box, inside)) + STEP_COST * step + (at === before || before === undefined ? 0 : CHANGE_COST);
      if (cost < least) [best, least] = [{ box, at, far: step > 0 }, cost];
    }
  }
  return best;
}

/** The area that two boxes share. @param {Box} a @param {Box} b */
function shared(a, b) {
  return Math.max(0, Math.min(a.right, b.right) - Math.max(a.left, b.left)) * Math.max(0, Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top));
}

/** A line from the edge of a hull to the nearest place of its name. @param {Pen} pen @param {number} x @param {number} y @param {Box} box @param {number} hull @param {string} colour */
function drawLeader(pen, x, y, box, hull, colour) {
  const toX = Math.min(Math.max(x, box.left - 2), box.right + 2), toY = Math.min(Math.max(y, box.top), box.bottom), length = Math.hypot(toX - x, toY - y);
  if (length <= hull) return;
  pen.context.beginPath();
  pen.context.moveTo(x + ((toX - x) * hull) / length, y + ((toY - y) * hull) / length);
  pen.context.lineTo(toX, toY);
  pen.stroke(colour, "thin");
}

/** @param {CanvasRenderingContext2D} context @param {string} text @param {number} width */
function shortened(context, text, width) {
  // Direction marks in a name do not affect the text around it.
  const isolate = (/** @type {string} */ of) => `\u2068${of}\u2069`;
  if (context.measureText(text).width <= width) return isolate(text);
  const letters = Array.from(text);
  while (letters.length > 1 && context.measureText(`${letters.join("")}…`).width > width) letters.pop();
  return isolate(`${letters.join("")}…`);
}
