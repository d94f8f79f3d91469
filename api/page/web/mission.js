// A mission, or several runs of one on the same clock: map, time series, estimates, log.

import { auvColour, el, fill, named, oncePerFrame, swatch } from "./dom.js";
import { bearing, duration, methodName, moment, number } from "./format.js";
import { ageWords, isAlarm } from "./alarm.js";
import { scores, worstStretch } from "./scores.js";
import { PLAY_SPEEDS, Playback } from "./playback.js";
import { pictureAt, violationWords } from "./picture.js";
import { beliefsOf } from "./beliefs.js";
import { chartsOf } from "./curves.js";
import { besideLaw, explanation } from "./explanation.js";
import { chartEvents } from "./journal.js";
import { vesselsOf, vesselTable } from "./traffic.js";
import { visitsAt, VisitStrip } from "./visits.js";
import { pictureBounds } from "./drawing.js";
import { NO_BACKGROUND, backgroundOf, placeOnEarth } from "./background.js";
import { MapView } from "./map.js";
import { ChartStack } from "./chart.js";

/**
 * @typedef {import("./picture.js").Run} Run
 * @typedef {import("./picture.js").Layers} Layers
 * `age` is the age of the last plan, s; `isOld` says that it is stale; `before` is the view that this one replaces, whose moment and layers it keeps.
 * @typedef {{ fleet?: import("./fleet.js").Fleet, needed?: (t: number, playing: boolean) => void, age?: () => number, isOld?: () => boolean, before?: MissionView, side?: Node | null, below?: Node | null, signal?: AbortSignal, sideBySide?: boolean, tool?: import("./types.js").Tool }} ViewOptions
 */

/** Log entries shown, newest first. */
const LOG_SHOWN = 200;
/** Time until a log that has a pressed entry is tried again. */
const LOG_HELD_MS = 200;
/** Time shown around the worst minute, s. */
const AROUND_S = 90;
/** What is so many times as long as wide is tall. */
const TALL = 1.5;

/** @type {[keyof Layers, string, boolean][]} */
const LAYERS = [
  ["forecasts", "forecasts, 95 % ellipses", true], ["ghost", "line of sight from here", true], ["goal", "goal", true], ["fixes", "fixes", true],
  ["acoustic", "acoustic range", true], ["bounds", "keep-outs and area", true], ["paths", "paths", true], ["tour", "tour of visits", true], ["chart", "my chart", true], ["traffic", "other vessels", true],
];

const LEGEND = [
  ["craft", "surface craft"], ["plan", "plan"], ["los", "line of sight from here"], ["goal", "goal"], ["auv", "darker is deeper"], ["forecast", "forecast, 95 %"],
  ["fix", "fix"], ["refused", "fix refused"], ["keep-out", "keep out"], ["violation", "limit broken"], ["vessel", "other vessel, distance to keep"],
];

/** The view of one or more runs on one clock. */
export class MissionView {
  /**
   * @param {HTMLElement} host
   * @param {Run[]} runs
   * @param {ViewOptions} [options]
   */
  constructor(host, runs, options = {}) {
    this.runs = runs;
    this.options = options;
    const { before, signal } = options;
    this.background = before?.background ?? NO_BACKGROUND;
    /** @type {Layers} */
    this.layers = before?.layers ?? /** @type {Layers} */ (Object.fromEntries(LAYERS.map(([name, , on]) => [name, on])));
    this.left = false;
    this.draw = oncePerFrame(() => this.left || this.drawNow());
    this.playback = new Playback(this.draw);
    if (before) Object.assign(this.playback, { t: before.playback.t, from: before.playback.from, to: before.playback.to, atEnd: before.playback.atEnd, speed: before.playback.speed });
    before?.leave();
    this.drawnVersion = this.drawnLog = -1;
    this.hovered = /** @type {number | null} */ (null);
    /** Duration of the last drawing, ms. */
    this.drawMs = 0;
    this.build(host);
    addEventListener("themechange", () => { this.drawnVersion = -1; this.draw(); }, { signal });
    signal?.addEventListener("abort", () => this.leave());
    this.changed();
  }

  /** Stops drawing. */
  leave() {
    this.left = true;
    this.playback.pause();
  }

  /** Draws again, after new data. */
  changed() {
    const spans = this.runs.map(({ recording }) => recording.span).filter(([from]) => Number.isFinite(from));
    if (spans.length) this.playback.spans([Math.min(...spans.map(([from]) => from)), Math.max(...spans.map(([, to]) => to))]);
    this.draw();
  }

  get live() {
    return this.runs[0].recording.live;
  }

  /** That whose numbers are shown. */
  get run() {
    return this.options.fleet?.run ?? this.runs[0];
  }

  /** What the right end of the slider means: a simulated mission's end, which it may not have reached. */
  get sliderEnd() {
    return Math.max(this.playback.to, this.live ? -Infinity : this.end);
  }

  /** End of a simulated mission. */
  get end() {
    return this.runs[0].recording.scene.duration_s ?? this.playback.to;
  }

  /** @param {HTMLElement} host */
  build(host) {
    this.now = el("dl", { class: "now" });
    this.believed = el("dl", { class: "now" });
    this.why = el("p", { class: "explained" });
    this.warnings = el("ul", { class: "warnings" });
    this.vessels = el("section", { class: "panel", "aria-labelledby": "vessels-title", hidden: true });
    this.log = el("ol", { class: "log", tabIndex: 0, "aria-label": "Log, newest first" });
    const maps = this.places = el("div", { class: this.options.sideBySide ? "maps side-by-side" : "maps" });
    /** What the legend has. @type {string} */
    this.keyed = "\n";
    this.empty = el("div", { class: "empty", hidden: true }, beginning(this.runs[0].recording));
    const { fleet } = this.options;
    this.visits = new VisitStrip();
    this.key = el("ul", { class: "legend", "aria-label": "Legend" });
    const several = this.runs.length > 1 && !fleet;
    fill(host, el("div", { class: several ? "mission several" : "mission" },
      el("section", { class: "panel map-panel", "aria-label": "Map" }, this.empty, maps, (fleet?.strip ?? this.visits).element, this.key, this.layersForm()),
      this.transport(),
      this.options.below,
      el("div", { class: "side" },
        fleet?.panel,
        this.options.side,
        !several && this.vessels,
        !several && el("section", { class: "panel", "aria-labelledby": "now-title" }, el("h2", { id: "now-title" }, "Now", fleet && [" · ", fleet.choice]), this.why, this.now, this.warnings),
        !several && el("section", { class: "panel", "aria-labelledby": "believed-title" }, el("h2", { id: "believed-title" }, "The planner's estimates"), this.believed),
        el("section", { class: "panel", "aria-labelledby": "log-title" }, el("h2", { id: "log-title" }, "Log"), this.log)),
      el("section", { class: "panel charts", "aria-label": "Time series" }, this.chartsHost = el("div"))));
    this.maps = this.mapsIn(maps);
    this.charts = new ChartStack(this.chartsHost, {
      onCursor: (x) => this.hover(x),
      onWindow: (from, to) => this.charts?.setWindow(from, to),
      formatX: (x, step) => (this.live ? moment(x, true).slice(0, step < 60 ? 8 : 5) : moment(x, false)),
    });
    this.chartsHost.addEventListener("click", () => this.hovered !== null && !this.charts?.dragged && this.playback.seek(this.hovered));
  }

  /** @param {HTMLElement} host */
  mapsIn(host) {
    const groups = this.options.sideBySide ? this.runs.map((run) => [run]) : [this.runs];
    return groups.map((runs) => {
      const place = el("div", { class: "map-place" });
      host.append(el("figure", {}, runs.length < this.runs.length && el("figcaption", {}, swatch(runs[0].colour), runs[0].name), place));
      return { runs, view: new MapView(place, { onPick: (t) => this.hover(t), tool: this.options.tool }) };
    });
  }

  layersForm() {
    const said = el("p", { class: "said", role: "status" });
    const file = el("input", {
      type: "file", accept: ".geojson,.json,application/geo+json", id: "background-file",
      onchange: async () => {
        const [chosen] = file.files ?? [];
        if (!chosen) return;
        try {
          this.background = backgroundOf(await chosen.text(), this.runs[0].recording.mission.origin);
          fill(said, `${chosen.name}: ${this.background.lines.length} lines, ${this.background.marks.length} points, in this browser alone`);
        } catch (error) {
          fill(said, `${chosen.name}: ${error instanceof Error ? error.message : error}`);
        }
        this.draw();
      },
    });
    const boxes = LAYERS.map(([name, text, on]) => el("label", {}, el("input", {
      type: "checkbox", checked: this.layers[name] ?? on,
      onchange: (/** @type {Event} */ event) => {
        this.layers[name] = /** @type {HTMLInputElement} */ (event.target).checked;
        this.draw();
      },
    }), text));
    return el("details", { class: "layers" }, el("summary", {}, "Layers and background"), el("div", { class: "boxes" }, boxes),
      el("label", { class: "file" }, "Background from a GeoJSON file: ", file), said);
  }

  transport() {
    const { playback } = this;
    this.playButton = el("button", { type: "button", class: "play", onclick: () => playback.toggle() }, "▶ Play");
    this.slider = el("input", {
      type: "range", min: "0", max: "1000", step: "1", value: "1000", "aria-label": "Time shown",
      oninput: () => {
        if (playback.playing) playback.pause();
        playback.seek(playback.from + (Number(this.slider?.value) / 1000) * (this.sliderEnd - playback.from));
      },
      onkeydown: (/** @type {KeyboardEvent} */ event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -60, PageUp: 60 }[event.key];
        if (step === undefined) return;
        event.preventDefault();
        playback.seek(playback.t + step * (event.shiftKey ? 10 : 1));
      },
    });
    this.clock = el("output", { class: "clock" });
    const speed = el("select", { "aria-label": "Speed of the replay", onchange: () => { playback.speed = Number(speed.value); } },
      PLAY_SPEEDS.map((factor) => el("option", { value: String(factor), selected: factor === playback.speed }, `${factor}×`)));
    this.endButton = el("button", { type: "button", class: "end", onclick: () => playback.goToEnd() }, "Now");
    const worst = el("button", { type: "button", onclick: () => this.goToWorst() }, "Worst minute");
    const settled = !this.live && el("button", { type: "button", onclick: () => this.charts?.setWindow(scores(this.runs[0].recording).settled_from_s, playback.to) }, "Once settled");
    return el("div", { class: "transport", role: "group", "aria-label": "Replay" }, this.playButton, speed, this.slider, this.clock, this.endButton, worst, settled);
  }

  /** Shows the minute with the largest distance of the first run to its goal. */
  goToWorst() {
    const { recording } = this.run, worst = worstStretch(recording);
    if (!worst) return;
    this.playback.pause();
    this.playback.seek(worst.to);
    this.charts?.setWindow(worst.from - AROUND_S, worst.to + AROUND_S);
    recording.journal.happened(worst.to, "worst", `from ${moment(worst.from, this.live)}: ${number(worst.rms_m, 1, "m")} from the goal, root mean square over a minute`);
    this.draw();
  }

  /** @param {number | null} t */
  hover(t) {
    this.hovered = t;
    this.draw();
  }

  drawNow() {
    const start = performance.now();
    const { playback, options: { fleet } } = this, t = this.hovered ?? playback.t;
    const nothing = !Number.isFinite(playback.from);
    if (this.empty) this.empty.hidden = !nothing;
    if (!nothing) {
      this.options.needed?.(t, playback.playing);
      // Maps beside each other have the same axes.
      /** @type {{ runs: Run[], view: MapView }[]} */
      const maps = this.maps ?? [], pictures = maps.map(({ runs }) => pictureAt(fleet?.runsAt(t) ?? runs, t, this.layers, this.background, fleet));
      for (const [i, picture] of pictures.entries()) {
        maps[i].view.draw({ ...picture, beside: pictures.toSpliced(i, 1) });
      }
      const auvs = [...this.runs[0].recording.places.keys()], traffic = pictures.some(({ vehicles }) => vehicles.some(({ kind }) => kind === "vessel" || kind === "still"));
      const names = [...auvs, String(traffic)].join("\n");
      if (names !== this.keyed) fill(this.key ?? el("ul"), legendOf(this.runs, auvs, traffic, Boolean(fleet)));
      this.keyed = names;
      const version = this.runs.reduce((sum, { recording }) => sum + recording.version, 0);
      if (version !== this.drawnVersion) {
        // What is long from north to south gets tall maps.
        const bounds = pictureBounds(pictures[0]);
        this.places?.classList.toggle("tall", Boolean(bounds && bounds.northern - bounds.south > TALL * (bounds.eastern - bounds.west)));
        this.charts?.setCharts(chartsOf(this.runs, fleet && ((id) => fleet.colourOf(id, playback.to))));
        this.drawnVersion = version;
      }
      // Apart from the charts: an entry that has the focus keeps it while nothing happens. A pressed entry is not
      // replaced before it is released: its click would be lost.
      const entries = fleet?.entriesVersion ?? this.runs.reduce((sum, { recording }) => sum + recording.journal.version, 0);
      if (entries !== this.drawnLog && this.log?.querySelector(":active")) setTimeout(this.draw, LOG_HELD_MS);
      else if (entries !== this.drawnLog) {
        this.drawLog();
        this.charts?.setEvents(chartEvents(fleet?.marked ?? this.runs[0].recording.journal.entries));
        this.drawnLog = entries;
      }
      this.charts?.setCursor(t);
      this.charts?.draw();
      if (this.runs.length === 1 || fleet) this.drawNumbers(t);
    }
    this.drawTransport(t);
    this.drawMs = performance.now() - start;
  }

  /** @param {number} t */
  drawTransport(t) {
    const { playback, slider, clock, playButton, endButton } = this;
    if (!slider || !clock || !playButton || !endButton) return;
    const length = this.sliderEnd - playback.from;
    slider.disabled = !(length > 0);
    slider.value = String(length > 0 ? Math.round(((playback.t - playback.from) / length) * 1000) : 1000);
    slider.setAttribute("aria-valuetext", moment(t, this.live));
    clock.textContent = this.live ? moment(t, true) : `${moment(t, false)} of ${moment(this.end, false)}`;
    playButton.textContent = playback.playing ? "❚❚ Pause" : "▶ Play";
    endButton.textContent = this.live ? "Live" : "End";
    endButton.setAttribute("aria-pressed", String(playback.atEnd));
  }

  /** @param {number} t */
  drawNumbers(t) {
    const { recording } = this.run, { fleet } = this.options, { plans, goal, craft } = recording;
    const i = plans.indexAt(t), value = (/** @type {string} */ name) => (i < 0 ? NaN : plans.column(name)[i]);
    const believed = recording.predictionAt(t)?.prediction;
    const method = i < 0 ? "–" : methodName(recording.methods[value("method")]);
    const beside = (/** @type {string} */ ours, /** @type {string} */ law) => (believed ? `${ours}, line of sight ${law}` : ours);
    fill(this.why ?? el("p"), believed && explanation(believed, { heading: value("heading"), speed: value("speed"), method: recording.methods[value("method")] }));
    // At the end of a live mission the clock runs on without plans.
    const isNow = this.live && this.playback.atEnd && this.hovered === null, since = isNow ? this.options.age?.() ?? 0 : 0;
    const behind = fleet?.behind(t) ?? 0, old = behind > 0 || (since > 0 && Boolean(this.options.isOld?.()));
    this.now?.classList.toggle("old", old);
    const { origin } = recording.mission, [north, east] = ["north", "east"].map((name) => craft.at(name, t));
    const earth = origin && Number.isFinite(north) ? placeOnEarth(origin, north, east) : null;
    facts(this.now, [
      ...old ? [["last plan", `${ageWords(since + behind)} ago`]] : [],
      ["answered by", value("degraded") ? `${method}, degraded` : method],
      ["distance to the goal", number(goal.at("distance", t), 1, "m")],
      ["speed, reference", `${number(craft.at("speed", t), 2)}, ${number(value("speed"), 2, "m/s")}`],
      ["heading, reference", `${bearing(craft.at("heading", t))}, ${bearing(value("heading"))}`],
      ...believed?.cost !== undefined ? [["predicted cost", besideLaw(believed.cost, believed.line_of_sight_cost ?? NaN)]] : [],
      ["predicted RMS distance", beside(number(believed?.rms_m ?? value("rms"), 1, "m"), number(believed?.line_of_sight_rms_m, 1, "m"))],
      ["solve time, lag", `${number(value("solve_ms"), 1, "ms")}, ${number(value("late_s") * 1000, 0, "ms")}`],
      ...earth ? [["surface craft", `${number(earth.lat_deg, 6, "°")}, ${number(earth.lon_deg, 6, "°")}`]] : [],
      ...Array.from(recording.ages, ([id, ages]) => [`${id} heard`, `${duration(ages.at("age", t) + (Number.isFinite(since) ? since : 0))} ago`]),
    ]);
    fill(this.warnings ?? el("ul"), (believed?.warnings ?? []).toSorted((a, b) => Number(isAlarm(b.code)) - Number(isAlarm(a.code))).map(({ code, detail }) => el("li", { class: isAlarm(code) ? "violated" : "" }, detail)),
      (believed?.violations ?? []).map((violation) => el("li", { class: "violated" }, `${violationWords(violation)}, at ${moment(violation.t_s, this.live)}`)));
    if (fleet) fleet.draw(t, isNow);
    else this.visits?.draw(visitsAt(recording, t));
    this.drawVessels(believed ? vesselsOf(believed) : []);
    facts(this.believed, believed ? beliefsOf(believed) : [["", i < 0 ? "no plan yet" : behind ? "no plan of it at this time" : "none: loading, or the record of another law or of an earlier version"]]);
  }

  /** @param {import("./traffic.js").Vessel[]} vessels */
  drawVessels(vessels) {
    if (!this.vessels) return;
    this.vessels.hidden = !vessels.length;
    fill(this.vessels, el("h2", { id: "vessels-title" }, "Other vessels"), vesselTable(vessels));
  }

  drawLog() {
    const entries = this.options.fleet?.entries ?? this.runs.flatMap(({ name, recording }) => recording.journal.entries.map((entry) => ({ ...entry, name: this.runs.length > 1 ? name : "" })));
    entries.sort((a, b) => b.t_s - a.t_s);
    fill(this.log ?? el("ol"), entries.slice(0, LOG_SHOWN).map((entry) => el("li", {},
      el("button", { type: "button", class: "time", onclick: () => { this.playback.pause(); this.playback.seek(entry.t_s); } }, moment(entry.t_s, this.live)),
      " ", el("strong", {}, entry.kind.replaceAll("_", " ")), entry.name && [" · ", named(entry.name)], entry.text && [": ", named(entry.text)])));
  }
}

/** What a mission without a plan waits for. @param {import("./recording.js").Recording} recording */
function beginning({ live, mission: { id }, scene }) {
  if (!live) return [el("p", {}, "No plan yet.")];
  const ids = scene.auvs ?? [], [craft] = scene.surface_craft ?? [], { origin } = location, shell = (/** @type {string} */ text) => `'${text.replaceAll("'", "'\\''")}'`;
  const auvs = ids.map((name, i) => `--auv ${i + 2}=${shell(name)}`).join(" "), at = { t_s: "NOW", north_m: 0, east_m: 0 };
  const state = { north_m: 0, east_m: 0, heading_rad: 0, speed_mps: 0 };
  const report = JSON.stringify({ craft, auvs: { [ids[0] ?? "auv-1"]: [{ ...at, sigma_m: 2 }] }, asc: [{ t_s: "NOW", state }] });
  const body = shell(report).replaceAll(':"NOW"', ":'$(date +%s)'");
  return [
    el("p", {}, "No plan yet: the mission has to run, and waits for fixes of its AUVs and the state of its craft. A bridge reports them:"),
    el("pre", { class: "code" }, `pilotfish bridge mavlink --url ${origin} --mission ${id} --connect serial:/dev/ttyACM0:115200 ${auvs}${craft === undefined ? "" : ` --craft ${shell(craft)}`}`),
    el("p", {}, "So does any other program. The numbers here are examples: put in those of your vehicles (and, where tokens are used, -H 'authorization: Bearer …')."),
    el("pre", { class: "code" }, `curl -s ${origin}/v1/missions/${id}/reports -H 'content-type: application/json' -d ${body}`),
  ];
}

/** @param {HTMLElement | undefined} list @param {string[][]} pairs */
function facts(list, pairs) {
  if (!list) return;
  fill(list, pairs.map(([name, value]) => el("div", {}, name && el("dt", {}, named(name)), el("dd", {}, value))));
}

/** What is on the map, each AUV by its colour, or each craft of a fleet. @param {Run[]} runs @param {string[]} auvs @param {boolean} traffic @param {boolean} isFleet */
function legendOf(runs, auvs, traffic, isFleet) {
  const several = runs.length > 1, left = [...isFleet ? ["craft", "plan", "los", "goal"] : several ? ["craft", "plan", "los", "fix", "refused", "forecast"] : [], ...traffic ? [] : ["vessel"]], fixed = LEGEND.filter(([kind]) => !left.includes(kind));
  return [
    ...several ? runs.map(({ name, colour }) => el("li", {}, swatch(colour), isFleet ? [named(name), " and the AUVs that it serves"] : name)) : [], ...isFleet ? [] : auvs.map((id, i) => el("li", {}, swatch(auvColour(i)), named(id))),
    ...fixed.map(([kind, name]) => el("li", {}, el("span", { class: `sample sample-${kind}`, "aria-hidden": "true" }), name)),
  ];
}
