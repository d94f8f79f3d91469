// The figure that the craft sails about the AUVs that it localises, as a line on the map.

/** @typedef {import("./types.js").Figure} Figure */

/** Points of the line. */
const POINTS = 72;

/** @param {Figure} figure @returns {[number, number][]} (north, east), m */
export function figureLine({ north_m, east_m, axis_rad, ahead_m, starboard_m, semi_ahead_m, semi_starboard_m }) {
  const [sin, cos] = [Math.sin(axis_rad), Math.cos(axis_rad)];
  return Array.from({ length: POINTS + 1 }, (_, i) => {
    const phase = (2 * Math.PI * i) / POINTS, ahead = ahead_m + semi_ahead_m * Math.cos(phase), starboard = starboard_m + semi_starboard_m * Math.sin(phase);
    return [north_m + cos * ahead - sin * starboard, east_m + sin * ahead + cos * starboard];
  });
}

/**
 * The places at one of which an AUV is, as marks. @param {string} id @param {[number, number, number][]} places (north, east, probability) @param {string} colour @returns {import("./types.js").Mark[]}
 */
export function placeMarks(id, places, colour) {
  return places.flatMap(([north, east, probability]) => [
    { north, east, kind: "ring", colour }, { north, east, kind: "label", colour, text: `${id}? ${Math.round(100 * probability)} %` },
  ]);
}

/**
 * 95 % ellipses of the AUVs' own navigation: on the figure, and if the craft stayed above.
 * @param {Figure} figure @param {(id: string) => [number, number] | undefined} placeOf @returns {import("./types.js").Ellipse[]}
 */
export function figureEllipses({ vehicles }, placeOf) {
  return vehicles.flatMap(({ auv, sigma_m, sigma_above_m }) => {
    const [north, east] = placeOf(auv) ?? [];
    if (north === undefined || east === undefined) return [];
    return /** @type {[number, string][]} */ ([[sigma_m, "goal"], [sigma_above_m, "los"]]).map(([sigma, colour]) => ({ north, east, covariance: [sigma ** 2 / 2, 0, sigma ** 2 / 2], colour }));
  });
}
