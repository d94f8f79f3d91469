// The user's own chart under the map: a GeoJSON file, which stays in the browser.

/**
 * @typedef {import("./picture.js").Background} Background
 * @typedef {{ lat_deg: number, lon_deg: number }} Origin
 */

/** WGS 84: semi-major axis, m, and flattening. */
const SEMI_MAJOR_M = 6378137, FLATTENING = 1 / 298.257223563;
/** Mean radius of the Earth, m. */
const EARTH_RADIUS_M = 6_371_000;
/** Most points that are drawn. */
const POINTS_MAX = 200_000;

/** No chart. @type {Background} */
export const NO_BACKGROUND = { lines: [], marks: [] };

/**
 * Metres north and east of `origin`, on the plane that touches the ellipsoid there: off by 1 m at 4 km and by 10 m at 12 km. Positions of
 * the mission itself come from the service, which is exact.
 * @param {Origin} origin
 * @returns {(lon_deg: number, lat_deg: number) => [number, number]}
 */
export function tangentPlane(origin) {
  const lat = (origin.lat_deg * Math.PI) / 180, e2 = FLATTENING * (2 - FLATTENING);
  const w = Math.sqrt(1 - e2 * Math.sin(lat) ** 2);
  const meridian = (SEMI_MAJOR_M * (1 - e2)) / w ** 3, normal = SEMI_MAJOR_M / w;
  return (lon_deg, lat_deg) => {
    const east = ((((lon_deg - origin.lon_deg + 540) % 360) - 180) * Math.PI) / 180;
    return [(((lat_deg - origin.lat_deg) * Math.PI) / 180) * meridian, east * normal * Math.cos(lat)];
  };
}

/**
 * True bearings at a place less bearings on the map, rad, on a sphere. The map's north is true at `origin` alone.
 * @param {Origin | null | undefined} origin
 * @param {number} north
 * @param {number} east
 */
export function convergence(origin, north, east) {
  if (!origin) return 0;
  const lat = (origin.lat_deg * Math.PI) / 180, far = Math.hypot(north, east) / EARTH_RADIUS_M, azimuth = Math.atan2(east, north);
  const there = Math.atan2(Math.cos(lat) * Math.sin(azimuth), Math.cos(lat) * Math.cos(far) * Math.cos(azimuth) - Math.sin(lat) * Math.sin(far));
  return there - azimuth;
}

/**
 * Latitude and longitude of a place near `origin`, on the same plane.
 * @param {Origin} origin
 * @param {number} north
 * @param {number} east
 * @returns {Origin}
 */
export function placeOnEarth(origin, north, east) {
  const [perDegree] = tangentPlane(origin)(origin.lon_deg, origin.lat_deg + 1), [, perDegreeEast] = tangentPlane(origin)(origin.lon_deg + 1, origin.lat_deg);
  return { lat_deg: origin.lat_deg + north / perDegree, lon_deg: origin.lon_deg + east / perDegreeEast };
}

/**
 * Lines and points of a GeoJSON text. Throws an error that says what is wrong.
 * @param {string} text
 * @param {Origin | undefined} origin
 * @returns {Background}
 */
export function backgroundOf(text, origin) {
  if (!origin) throw new Error("GeoJSON needs positions on Earth, which this mission does not have: create the mission with an origin");
  let root;
  try {
    root = JSON.parse(text);
  } catch (error) {
    throw new Error(`this is not JSON: ${error instanceof Error ? error.message : error}`);
  }
  const place = tangentPlane(origin), background = { lines: [], marks: [] };
  let left = POINTS_MAX;
  const point = (/** @type {unknown} */ position) => {
    if (!Array.isArray(position) || typeof position[0] !== "number" || typeof position[1] !== "number") throw new Error("a position is not [longitude, latitude]");
    const [lon_deg, lat_deg] = position;
    if (!(Math.abs(lat_deg) <= 90 && Math.abs(lon_deg) <= 360)) throw new Error(`${lon_deg}, ${lat_deg} are not a longitude and a latitude: export the chart in WGS 84 (EPSG:4326)`);
    if (left-- === 0) throw new Error(`there are more than ${POINTS_MAX.toLocaleString("en")} points in it`);
    return place(lon_deg, lat_deg);
  };
  takeGeometry(root, point, background);
  if (!background.lines.length && !background.marks.length) throw new Error("the file has no points, lines or areas");
  return background;
}

/** @param {any} node @param {(position: unknown) => [number, number]} point @param {Background} into @returns {void} */
function takeGeometry(node, point, into) {
  const line = (/** @type {unknown[]} */ positions, closed = false) => into.lines.push({ points: positions.map(point), colour: "chart", style: "solid", closed });
  const dot = (/** @type {unknown} */ position) => {
    const [north, east] = point(position);
    into.marks.push({ north, east, kind: "dot", colour: "chart" });
  };
  const { coordinates } = node ?? {};
  switch (node?.type) {
    case "FeatureCollection": return node.features?.forEach((/** @type {any} */ feature) => takeGeometry(feature, point, into));
    case "Feature": return node.geometry && takeGeometry(node.geometry, point, into);
    case "GeometryCollection": return node.geometries?.forEach((/** @type {any} */ geometry) => takeGeometry(geometry, point, into));
    case "Point": return dot(coordinates);
    case "MultiPoint": return coordinates.forEach(dot);
    case "LineString": return void line(coordinates);
    case "MultiLineString": return coordinates.forEach((/** @type {unknown[]} */ part) => line(part));
    case "Polygon": return coordinates.forEach((/** @type {unknown[]} */ ring) => line(ring, true));
    case "MultiPolygon": return coordinates.flat().forEach((/** @type {unknown[]} */ ring) => line(ring, true));
    default: throw new Error("this is not GeoJSON: it has no known type");
  }
}
