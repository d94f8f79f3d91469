// One cursor for all charts of the page: a line at one time, a dot on every line, and what each of them is then.
// The pointer moves it, or the arrow keys (with shift by ten samples); the legend shows and hides lines.
const SVG = "http://www.w3.org/2000/svg";
const hidden = new Set();

function shape(name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}

// A scale is two values and the pixels where they are drawn.
const pixel = ([from, to, start, end], value) => start + (end - start) * (value - from) / (to - from);
const value = ([from, to, start, end], pixel) => from + (to - from) * (pixel - start) / (end - start);
const digits = (number) => String(Number(number.toPrecision(4))).replace("-", "\u2212");

const charts = Array.from(document.querySelectorAll("figure[data-chart]"), (figure) => {
  const svg = figure.querySelector("svg");
  const cursor = svg.appendChild(shape("g", { class: "cursor" }));
  const readout = figure.appendChild(document.createElement("table"));
  readout.className = "readout";
  readout.hidden = true;
  return { ...JSON.parse(figure.dataset.chart), figure, svg, cursor, readout, map: figure.classList.contains("map") };
});
const shown = (chart) => chart.lines.filter((line) => !hidden.has(line.colour) && line.points.length > 0);

// Which point is nearest to a time; the points are in its order.
function nearest(points, time) {
  let low = 0, high = points.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (points[middle][0] < time) low = middle + 1; else high = middle;
  }
  return low > 0 && time - points[low - 1][0] < points[low][0] - time ? low - 1 : low;
}

function row(chart, colour, ...cells) {
  const line = chart.readout.insertRow();
  const sample = line.insertCell();
  if (colour) {
    const svg = sample.appendChild(shape("svg", { viewBox: "0 0 10 10" }));
    svg.append(shape("circle", { cx: 5, cy: 5, r: 5, fill: colour }));
  }
  for (const cell of cells) line.insertCell().textContent = cell;
}

let now;
function show(time) {
  now = time;
  for (const chart of charts) {
    const { x, y, cursor, readout, map, svg } = chart;
    cursor.replaceChildren();
    readout.replaceChildren();
    readout.hidden = time === undefined;
    if (time === undefined) continue;
    row(chart, null, "time", `${digits(time)} s`);
    if (map) row(chart, null, "", "east, north, m");
    else cursor.append(shape("line", { x1: pixel(x, time), x2: pixel(x, time), y1: y[2], y2: y[3] }));
    for (const { name, colour, points } of shown(chart)) {
      if (time < points[0][0] || points.at(-1)[0] < time) continue;
      const [across, up] = points[nearest(points, time)].slice(-2);
      const r = svg.viewBox.baseVal.width / (map ? 160 : 320);
      cursor.append(shape("circle", { cx: pixel(x, across), cy: pixel(y, up), r, fill: colour }));
      row(chart, colour, name, map ? `${digits(across)}, ${digits(up)}` : digits(up));
    }
    readout.classList.toggle("left", !map && pixel(x, time) > (x[2] + x[3]) / 2);
  }
}

// The time of the sample that the pointer is nearest to: beside it in time, on a map in distance.
function timeAt(chart, event) {
  const box = chart.svg.getBoundingClientRect();
  const scale = chart.svg.viewBox.baseVal.width / box.width;
  const [right, down] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
  const [first] = shown(chart);
  if (!first) return undefined;
  if (!chart.map) return first.points[nearest(first.points, value(chart.x, right))][0];
  let [time, least] = [undefined, Infinity];
  for (const { points } of shown(chart)) {
    for (const [t, across, up] of points) {
      const distance = Math.hypot(pixel(chart.x, across) - right, pixel(chart.y, up) - down);
      if (distance < least) [time, least] = [t, distance];
    }
  }
  return time;
}

for (const chart of charts) {
  for (const event of ["pointermove", "pointerdown"]) {
    chart.figure.addEventListener(event, (pointer) => show(timeAt(chart, pointer)));
  }
  chart.figure.addEventListener("pointerleave", () => show(undefined));
  chart.figure.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const [first] = shown(chart);
    if (!step || !first) return;
    event.preventDefault();
    const from = now === undefined ? 0 : nearest(first.points, now) + step * (event.shiftKey ? 10 : 1);
    show(first.points[Math.min(Math.max(from, 0), first.points.length - 1)][0]);
  });
}

for (const box of document.querySelectorAll(".legend input")) {
  const draw = () => {
    if (box.checked) hidden.delete(box.value); else hidden.add(box.value);
    const lines = `figure > svg [stroke="${box.value}"], figure > svg [fill="${box.value}"]`;
    for (const line of document.querySelectorAll(lines)) line.classList.toggle("off", !box.checked);
    show(now);
  };
  box.addEventListener("change", draw);
  // A browser that goes back remembers what was hidden.
  draw();
}
