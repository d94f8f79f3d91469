// Draws one snapshot and both answers to it. North is up, east is right, one scale for both axes.

// Room for names beside the vehicles and for the scale below them.
const MARGIN = { left: 80, right: 120, top: 74, bottom: 84 };
const NARROW_MARGIN = { left: 98, right: 80, top: 84, bottom: 84 };
const NARROW_PX = 600;
// What stands above and below the map where the chart is to be seen without scrolling.
const BESIDE_MAP_PX = 358;
const CHART = { height: 140, left: 54, right: 26, top: 30, bottom: 24 };
const INSTANT_EVERY_S = 15;
// A reference arrow is as long as the craft would travel in this time, and never hidden by its hull.
const ARROW_S = 12, ARROW_LEAST_PX = 36;
const REPLAY_SPEED = 10;

const $ = (id) => document.getElementById(id);
let shown = null;
// Only the last thing asked for is shown, whatever is answered last.
let turn = 0;

function node(name, attributes = {}, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

function html(name, text) {
  const element = document.createElement(name);
  if (text !== undefined) element.textContent = text;
  return element;
}

const state = (name, text) => {
  document.body.dataset.state = $("status").dataset.state = name;
  $("status").textContent = text;
};

// The largest of 1, 2, 5 times a power of ten that is at most `value`.
function round(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find((factor) => factor * power <= value) * power;
}

// A unit of the drawing is a pixel of the screen, so that names keep their size on a small one.
function sized(svg, height) {
  const width = Math.max(svg.clientWidth, 280);
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  return { width, height };
}

function projection({ width, height }, points) {
  const margin = width < NARROW_PX ? NARROW_MARGIN : MARGIN;
  const norths = points.map((p) => p.north_m), easts = points.map((p) => p.east_m);
  const middle = (list) => (Math.min(...list) + Math.max(...list)) / 2;
  const extent = (list) => Math.max(...list) - Math.min(...list);
  const scale = Math.min(
    (width - margin.left - margin.right) / Math.max(extent(easts), 20),
    (height - margin.top - margin.bottom) / Math.max(extent(norths), 20),
  );
  const [north0, east0] = [middle(norths), middle(easts)];
  const x0 = (width + margin.left - margin.right) / 2, y0 = (height + margin.top - margin.bottom) / 2;
  return {
    width, height, scale,
    x: (east) => x0 + (east - east0) * scale,
    y: (north) => y0 - (north - north0) * scale,
    north: (y) => north0 + (y0 - y) / scale,
    east: (x) => east0 + (x - x0) / scale,
  };
}

const line = (map, points, starts = (i) => i === 0) =>
  points.map((p, i) => `${starts(i) ? "M" : "L"}${map.x(p.east_m).toFixed(2)} ${map.y(p.north_m).toFixed(2)}`).join("");

// A goal that changes from one vehicle to the next jumps: no line leads there.
const jumps = (points) => (i) => {
  if (i === 0) return true;
  const [a, b] = [points[i - 1], points[i]];
  const travelled = Math.hypot(a.north_mps, a.east_mps) * (b.t_s - a.t_s);
  return Math.hypot(b.north_m - a.north_m, b.east_m - a.east_m) > 2 * travelled + 1;
};

const pose = (map, p, angle) =>
  `translate(${map.x(p.east_m).toFixed(2)} ${map.y(p.north_m).toFixed(2)}) rotate(${(angle * 180 / Math.PI).toFixed(2)})`;

// Shapes point north; a positive rotation of SVG is clockwise, as headings are.
const HULL = "M0-20 9-6 9 16-9 16-9-6Z";
const TORPEDO = "M0-12C4-9 4-5 4-2V8L6 12H-6L-4 8V-2C-4-5-4-9 0-12Z";
const GHOST = "M0-10 5-2 5 8-5 8-5-2Z";

function grid(map, svg) {
  const { width, height } = map, step = round(Math.max(110 / map.scale, 1));
  for (let east = Math.ceil(map.east(0) / step) * step; map.x(east) < width; east += step) {
    svg.append(node("line", { class: "grid", x1: map.x(east), x2: map.x(east), y1: 0, y2: height }));
    // Neither in the corner of the other axis nor cut off.
    if (65 < map.x(east) && map.x(east) < width - 58)
      svg.append(node("text", { class: "coordinate", x: map.x(east) + 4, y: height - 6 }, `${+east.toFixed(3)} m E`));
  }
  for (let north = Math.ceil(map.north(height) / step) * step; map.y(north) > 0; north += step) {
    svg.append(node("line", { class: "grid", x1: 0, x2: width, y1: map.y(north), y2: map.y(north) }));
    if (18 < map.y(north) && map.y(north) < height - 24)
      svg.append(node("text", { class: "coordinate", x: 5, y: map.y(north) - 4 }, `${+north.toFixed(3)} m N`));
  }
}

// As the planner has it: the current given, else ground velocity less velocity through the water.
function knownCurrent({ current, asc }) {
  if (current) return { ...current, estimated: false };
  if (typeof asc.ground_north_mps !== "number") return null;
  const [cos, sin] = [Math.cos(asc.heading_rad), Math.sin(asc.heading_rad)], sway = asc.sway_mps ?? 0;
  return {
    north_mps: asc.ground_north_mps - (cos * asc.speed_mps - sin * sway),
    east_mps: asc.ground_east_mps - (sin * asc.speed_mps + cos * sway),
    estimated: true,
  };
}

function furniture(map, svg, current) {
  const { width, height } = map;
  const length = round(Math.min(150, width / 4) / map.scale), end = width - 28, start = end - length * map.scale;
  svg.append(node("path", { class: "frame", d: `M${start} ${height - 32}v7h${end - start}v-7` }));
  svg.append(node("text", { class: "name", x: (start + end) / 2, y: height - 34, "text-anchor": "middle", id: "scale" }, `${length} m`));
  svg.append(node("path", { class: "frame solid", d: `M${width - 30} 18l10 30-10-7-10 7Z` }));
  svg.append(node("text", { class: "name", x: width - 30, y: 64, "text-anchor": "middle" }, "N"));
  const speed = current ? Math.hypot(current.north_mps, current.east_mps) : 0;
  if (speed > 0) {
    const angle = Math.atan2(current.east_mps, current.north_mps) * 180 / Math.PI;
    const estimated = current.estimated ? ", estimated" : "";
    svg.append(node("path", { class: "frame", id: "current", d: "M0 16V-16M-6-8 0-16 6-8", transform: `translate(${width - 120} 30) rotate(${angle})` }));
    svg.append(node("text", { class: "name minor", x: width - 52, y: 66, "text-anchor": "end" }, `current ${speed.toFixed(2)} m/s${estimated}`));
  }
}

function arrow(map, from, reference, kind) {
  const length = Math.max(reference.speed_mps * ARROW_S * map.scale, ARROW_LEAST_PX);
  return node("path", {
    class: `reference ${kind}`, id: `reference-${kind}`, transform: pose(map, from, reference.heading_rad),
    d: `M0 0V${-length}M-6 ${9 - length}L0 ${-length}L6 ${9 - length}`,
  });
}

function at(points, t) {
  const i = points.findIndex((p) => p.t_s >= t);
  if (i <= 0) return points[i < 0 ? points.length - 1 : 0];
  const [a, b] = [points[i - 1], points[i]], f = (t - a.t_s) / (b.t_s - a.t_s);
  const mix = (key) => a[key] + f * (b[key] - a[key]);
  const turn = b.heading_rad - a.heading_rad;
  const heading_rad = a.heading_rad + f * Math.atan2(Math.sin(turn), Math.cos(turn));
  return { t_s: t, north_m: mix("north_m"), east_m: mix("east_m"), heading_rad };
}

function drawMap(request, { mpc, saturated_los: los }) {
  const svg = $("map");
  const targets = mpc.targets.map((target) => target.trajectory);
  // Where each was when it was last heard of, from its state or from its reports.
  const states = mpc.targets.map(({ estimate }) => estimate);
  const height = Math.min(Math.max(innerHeight - BESIDE_MAP_PX, 320), 560);
  const map = projection(sized(svg, height), [request.asc, ...states, ...mpc.trajectory, ...los.trajectory, ...targets.flat(), ...mpc.goal.trajectory]);
  svg.replaceChildren();
  grid(map, svg);
  svg.append(node("path", { id: "track-goal", class: "track goal", d: line(map, mpc.goal.trajectory, jumps(mpc.goal.trajectory)) }));
  targets.forEach((points) => svg.append(node("path", { class: "track target", d: line(map, points) })));
  svg.append(node("path", { id: "track-los", class: "track los", d: line(map, los.trajectory) }));
  svg.append(node("path", { id: "track-mpc", class: "track mpc", d: line(map, mpc.trajectory) }));
  const start = mpc.trajectory[0].t_s, end = mpc.trajectory.at(-1).t_s;
  for (const [kind, plan] of [["los", los], ["mpc", mpc]])
    for (let t = start + INSTANT_EVERY_S; t <= end; t += INSTANT_EVERY_S) {
      const p = at(plan.trajectory, t);
      const dot = node("circle", { class: `instant ${kind}`, cx: map.x(p.east_m), cy: map.y(p.north_m), r: kind === "mpc" ? 5 : 4 });
      dot.append(node("title", {}, `${kind === "mpc" ? "plan" : "line of sight"}, +${t - start} s`));
      svg.append(dot);
    }
  svg.append(arrow(map, request.asc, los.reference, "los"), arrow(map, request.asc, mpc.reference, "mpc"));
  svg.append(node("path", { class: "hull", id: "asc", d: HULL, transform: pose(map, request.asc, request.asc.heading_rad) }));
  mpc.targets.forEach(({ id, estimate: auv }, i) => {
    const course = request.auvs[i].state?.course_rad ?? Math.atan2(auv.east_mps, auv.north_mps);
    svg.append(node("path", { class: "auv", d: TORPEDO, transform: pose(map, auv, course) }));
    svg.append(node("text", { class: "name", x: map.x(auv.east_m) + 18, y: map.y(auv.north_m) + 1 }, id));
    svg.append(node("text", { class: "name minor", x: map.x(auv.east_m) + 18, y: map.y(auv.north_m) + 15 }, `${+auv.depth_m.toFixed(1)} m deep`));
  });
  svg.append(node("text", { class: "name", x: map.x(request.asc.east_m) - 20, y: map.y(request.asc.north_m) + 5, "text-anchor": "end" }, "ASC"));
  const ghosts = node("g", { id: "ghosts" });
  svg.append(ghosts);
  furniture(map, svg, knownCurrent(request));
  return (t) => {
    ghosts.replaceChildren();
    if (t <= start) return;
    const goal = at(mpc.goal.trajectory, t);
    ghosts.append(node("circle", { class: "ghost goal", cx: map.x(goal.east_m), cy: map.y(goal.north_m), r: 5 }));
    for (const [kind, plan] of [["los", los], ["mpc", mpc]]) {
      const p = at(plan.trajectory, t);
      ghosts.append(node("path", { class: `ghost ${kind}`, d: GHOST, transform: pose(map, p, p.heading_rad) }));
    }
  };
}

function drawChart({ mpc, saturated_los: los }) {
  const svg = $("chart"), { left, right, top, bottom } = CHART;
  const { width, height } = sized(svg, CHART.height);
  const distances = (plan) => plan.trajectory.map((p, i) => {
    const goal = plan.goal.trajectory[i];
    return { t: p.t_s - plan.trajectory[0].t_s, d: Math.hypot(p.north_m - goal.north_m, p.east_m - goal.east_m) };
  });
  const series = { los: distances(los), mpc: distances(mpc) };
  const all = [...series.los, ...series.mpc];
  const tMax = Math.max(...all.map((p) => p.t)), dMax = Math.max(...all.map((p) => p.d), 0.1) * 1.05;
  const x = (t) => left + (width - left - right) * t / tMax, y = (d) => height - bottom - (height - top - bottom) * d / dMax;
  svg.replaceChildren(node("text", { class: "name", x: 14, y: 19 }, "Predicted distance to the goal"));
  const [dStep, tStep] = [round(dMax / 2), round(tMax / (width < NARROW_PX ? 3 : 5))];
  for (let d = 0; d <= dMax; d += dStep) {
    svg.append(node("line", { class: "axis", x1: left, x2: width - right, y1: y(d), y2: y(d) }));
    svg.append(node("text", { class: "coordinate", x: left - 7, y: y(d) + 4, "text-anchor": "end" }, `${+d.toFixed(3)} m`));
  }
  for (let t = 0; t <= tMax; t += tStep)
    svg.append(node("text", { class: "coordinate", x: x(t), y: height - 8, "text-anchor": "middle" }, `+${t} s`));
  for (const [kind, points] of Object.entries(series))
    svg.append(node("path", { class: `track ${kind}`, d: points.map((p, i) => `${i ? "L" : "M"}${x(p.t).toFixed(2)} ${y(p.d).toFixed(2)}`).join("") }));
  const cursor = node("line", { class: "frame", y1: top, y2: height - bottom, visibility: "hidden" });
  svg.append(cursor);
  return (t) => {
    cursor.setAttribute("visibility", t > 0 ? "visible" : "hidden");
    cursor.setAttribute("x1", x(t));
    cursor.setAttribute("x2", x(t));
  };
}

function drawNumbers({ mpc, saturated_los: los }) {
  const rows = [
    ["Speed reference", (p) => p.reference.speed_mps, 2, "m/s"],
    ["Heading reference", (p) => p.reference.heading_deg, 1, "°"],
    ["Predicted RMS error", (p) => p.predicted.rms_error_m, 2, "m", true],
    ["Predicted energy", (p) => p.predicted.energy_j, 0, "J", true],
    ["Predicted cost", (p) => p.predicted.cost, 1, "", true],
    ["Method", (p) => p.method.replaceAll("_", " ")],
    ["Solver", (p) => p.solver ? `${p.solver.iterations} iterations` : "–"],
    ["Solve time", (p) => p.solver?.solve_time_ms, 2, "ms"],
  ];
  const text = (value, digits, unit) =>
    typeof value === "number" ? `${value.toFixed(digits)} ${unit}`.replace(" °", "°") : value ?? "–";
  $("numbers").tBodies[0].replaceChildren(...rows.map(([name, of, digits, unit, less]) => {
    const row = html("tr"), values = [of(mpc), of(los)];
    const cells = values.map((value) => html("td", text(value, digits, unit)));
    if (less && values[0] !== values[1]) cells[values[0] < values[1] ? 0 : 1].className = "better";
    const header = html("th", name);
    header.scope = "row";
    row.append(header, ...cells);
    return row;
  }));
  const notes = mpc.warnings.map((w) => `${w.pointer}: ${w.detail}`);
  if (mpc.outcome === "degraded") notes.unshift(`Degraded answer: ${mpc.reason}`);
  $("notes").replaceChildren(...notes.map((note) => html("p", note)));
}

function legend() {
  const swatch = (...content) => { const svg = node("svg", { viewBox: "-15 -7 30 14" }); svg.append(...content); return svg; };
  const stroke = (kind) => swatch(node("path", { class: `track ${kind}`, d: "M-13 0H13" }));
  const shape = (kind, d) => swatch(node("path", { class: kind, d, transform: "rotate(90) scale(.6)" }));
  const entries = [
    [shape("hull", HULL), "surface craft"], [shape("auv", TORPEDO), "underwater vehicle"], [stroke("mpc"), "plan"],
    [stroke("los"), "line of sight"], [stroke("target"), "vehicle forecast"], [stroke("goal"), "goal"],
  ];
  $("legend").replaceChildren(...entries.map(([picture, name]) => {
    const entry = html("span");
    entry.append(picture, name);
    return entry;
  }), html("span", `dots every ${INSTANT_EVERY_S} s · arrows: references, ${ARROW_S} s of travel, at least a hull long`));
}

function fail(problem) {
  state("error", problem.title);
  const errors = problem.errors.length ? problem.errors : [{ pointer: "", detail: problem.detail }];
  $("errors").replaceChildren(...errors.map((error) => {
    const item = html("li");
    item.append(html("code", error.pointer || problem.code), ` ${error.detail}`);
    return item;
  }));
}

function draw({ request, plans }) {
  const t0 = plans.mpc.trajectory[0].t_s;
  const [moveMap, moveChart] = [drawMap(request, plans), drawChart(plans)];
  shown = {
    request, plans,
    length: plans.mpc.trajectory.at(-1).t_s - t0,
    move: (t) => {
      moveMap(t0 + t);
      moveChart(t);
      $("clock").textContent = `+${t.toFixed(0)} s`;
      $("moment").setAttribute("aria-valuetext", `${t.toFixed(0)} seconds from now`);
    },
  };
  shown.move($("moment").value * shown.length);
}

async function post(mine) {
  state("busy", "planning");
  $("errors").replaceChildren();
  const body = $("body").value;
  const answer = await ask("/v1/plan/compare", { method: "POST", headers: { "content-type": "application/json" }, body });
  const content = await answer.json();
  if (mine !== turn) return;
  if (!answer.ok) return fail(content);
  const { plans } = content;
  $("moment").value = 0;
  draw({ request: JSON.parse(body), plans });
  drawNumbers(plans);
  if (plans.mpc.outcome === "ok") state("ready", "planned");
  else state("ready", `degraded: ${plans.mpc.method.replaceAll("_", " ")}`);
}

// Asks the service, and the user for a token where the service wants one.
async function ask(path, options = {}) {
  for (;;) {
    const token = sessionStorage.getItem("token");
    const headers = { ...options.headers, ...(token && { authorization: `Bearer ${token}` }) };
    const answer = await fetch(path, { ...options, headers });
    if (answer.status !== 401) return answer;
    await tokenGiven();
  }
}

async function tokenGiven() {
  state("error", "needs a token");
  const form = $("access");
  form.hidden = false;
  $("token").focus();
  await new Promise((given) => form.addEventListener("submit", (event) => {
    event.preventDefault();
    sessionStorage.setItem("token", $("token").value.trim());
    given();
  }, { once: true }));
  form.hidden = true;
}

const guarded = (action) => async (...all) => {
  const mine = ++turn;
  try {
    await action(mine, ...all);
  } catch (error) {
    if (mine === turn) fail({ title: "no answer", code: "page", detail: String(error), errors: [] });
  }
};

async function load(mine) {
  state("busy", "loading");
  const text = await (await ask(`/v1/examples/${encodeURIComponent($("example").value)}`)).text();
  if (mine !== turn) return;
  $("body").value = text;
  await post(mine);
}

let playing = null;
function play() {
  if (playing) { cancelAnimationFrame(playing); playing = null; $("play").textContent = "▶ Play"; return; }
  $("play").textContent = "❚❚ Pause";
  let last = performance.now();
  const step = (now) => {
    const next = +$("moment").value + (now - last) / 1000 * REPLAY_SPEED / (shown?.length ?? 1);
    last = now;
    $("moment").value = Math.min(next, 1);
    shown?.move($("moment").value * shown.length);
    if (next < 1) playing = requestAnimationFrame(step);
    else { playing = null; $("play").textContent = "▶ Play"; }
  };
  if (+$("moment").value >= 1) $("moment").value = 0;
  playing = requestAnimationFrame(step);
}

async function start(mine) {
  legend();
  const { examples } = await (await ask("/v1/examples")).json();
  $("example").replaceChildren(...examples.map(({ name, title }) => new Option(title, name)));
  const asked = new URLSearchParams(location.search).get("example");
  if (examples.some(({ name }) => name === asked)) $("example").value = asked;
  $("example").addEventListener("change", guarded(load));
  $("request").addEventListener("submit", guarded((mine, event) => { event.preventDefault(); return post(mine); }));
  $("moment").addEventListener("input", () => shown?.move($("moment").value * shown.length));
  $("play").addEventListener("click", play);
  addEventListener("resize", () => shown && draw(shown));
  await load(mine);
}

guarded(start)();
