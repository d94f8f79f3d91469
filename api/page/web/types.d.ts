// The page's data: what the service sends, and what the map and the strip of visits draw. Not served.

export type Violation = { pointer?: string, limit: string, t_s: number, amount: number, unit: string };

export type PredictedAuv = { id: string, positions: [number, number][], depths_m: number[], covariances_m2: [number, number, number][], places?: [number, number, number][], age_s: number,
  heard?: { t_s: number, north_m: number, east_m: number }, refused_t_s?: number[], drift: [number, number], route?: RouteFit,
  dive?: { depth_min_m: number, depth_max_m: number } };

export type RouteFit = { probability: number, north_m: number, east_m: number, next_turn?: { in_s: number, sigma_s: number, by_rad: number },
  repeats?: { pattern: "lanes" | "laps" | "other", times: number, period_m: number, leg_m: number, spacing_m: number } };

export type Prediction = { after_s: number[], asc: [number, number][], goal: [number, number][], line_of_sight: [number, number][], auvs: PredictedAuv[],
  line_of_sight_reference: { speed_mps: number, heading_rad: number }, rms_m: number, line_of_sight_rms_m: number, cost?: number, line_of_sight_cost?: number,
  current?: [number, number], craft: { [name: string]: number | boolean }, violations: Violation[],
  warnings: { code: string, pointer: string, detail: string }[], schedule?: Schedule, figure?: Figure, avoidance?: Avoidance, vessels?: PredictedVessel[] };

export type PredictedVessel = { id: string, name?: string, position: [number, number], velocity?: [number, number], separation_m?: number, age_s: number };
export type Encounter = { vessel: string, kind: string, acts: boolean, cpa_m: number, tcpa_s: number, passes_m: number, separation_m: number };
export type Avoidance = { encounters: Encounter[], manoeuvre?: { heading_rad: number, speed_mps: number, until_s: number }, sentence: string };

export type LocalisedVehicle = { auv: string, sigma_now_m?: number, sigma_m: number, sigma_above_m: number, over_time?: [number, number, number][] };
export type Figure = { kind: string, north_m: number, east_m: number, axis_rad: number, ahead_m: number, starboard_m: number, semi_ahead_m: number, semi_starboard_m: number,
  vehicles: LocalisedVehicle[], sentence: string };

export type Breach = { t: number, from: number, to: number, north: number, east: number, limit: string, beyond: number };

export type Gains = { look_ahead_m: number, along_track_gain_per_s: number, integral_gain_mps?: number };

export type Fault = { from_s: number, until_s?: number | null, what: string };

/** A polygon to keep out of, and its holes. */
export type NoGo = { polygon: [number, number][], holes?: [number, number][][], name?: string };

export type Scene = { duration_s?: number, settled_after_s?: number, period_s?: number, scenario?: string, seed?: number, controller?: string, gains?: Gains | null, information?: string, faults?: Fault[], clock_rate?: number, auvs?: string[], surface_craft?: string[], origin?: { lat_deg: number, lon_deg: number },
  keep_outs?: { north_m: number, east_m: number, radius_m: number }[], area?: [number, number][], no_go?: NoGo[], range_max_m?: number,
  paths?: { [id: string]: [number, number][] }, goal?: VisitGoal };

export type MissionJson = { id: string, title: string, kind: string, status: string, t_s: number, plan?: PlanSummary, created_s?: number, sequence?: number, revision?: number, speed_factor?: number,
  origin?: { lat_deg: number, lon_deg: number }, setting?: any, scene?: Scene, steering?: Steering, surface_craft?: CraftJson[] };

export type Steering = { state: string, why: string, age_s: number };

/** Who serves whom in a fleet since `t_s`, and why others do not. */
export type Assigned = { t_s: number, craft: Map<string, string[]>, away: Map<string, string>, unserved: string[] };

/** A craft of a fleet. */
export type CraftJson = { id: string, auvs: string[], away?: string, plan?: PlanSummary, steering?: Steering, battery?: number };

/** What the last plan of a mission amounts to. */
export type PlanSummary = { outcome: string, reason?: string, method: string, age_s: number, period_s: number, waits_for: string[], warnings: string[], warning_codes?: string[] };

/** `words` with `why` says whether a mission's craft is steered now; `near` names the vessel that is too near, with numbers that change; `age_s` is
 * the age of the last plan, where that is too old; `craft` has the states of a fleet's craft. */
export type MissionState = { words: string, why: string, tone: "" | "good" | "warn" | "bad", alarm: boolean, near?: string, age_s?: number,
  craft?: { id: string, standsBy: boolean, state: MissionState }[] };
export type TrafficState = { why: string, near?: string };

export type LogEntry = { t_s: number, kind: string, text: string };

/** Columns of a track, of which the first `length` rows are valid. */
export type Track = { t: ArrayLike<number>, north: ArrayLike<number>, east: ArrayLike<number>, depth?: ArrayLike<number>, length: number };

export type Stroke = "solid" | "dashed" | "dotted" | "wide" | "thin";

export type TrackLayer = { track: Track, from: number, to: number, colour: string, style: Stroke, byDepth?: boolean, name: string, aside?: boolean };

/** What is `aside` is not what the map is fitted to. */
export type Vehicle = { kind: "craft" | "auv" | "vessel" | "still", north: number, east: number, heading: number, colour: string, name?: string, note?: string, stale?: boolean, aside?: boolean };

export type Line = { points: [number, number][], colour: string, style: Stroke | "area" | "land", closed?: boolean, name?: string, aside?: boolean };

export type Disc = { north: number, east: number, radius: number, colour: string, style: "keep-out" | "acoustic" | "separation" };

export type Ellipse = { north: number, east: number, covariance: [number, number, number], colour: string };

export type Mark = { north: number, east: number, kind: "fix" | "refused" | "violation" | "dot" | "stop" | "handle" | "label" | "ring", colour: string, title?: string, text?: string };

export type Arrow = { north: number, east: number, heading: number, length_m: number, colour: string };

export type Picture = { tracks: TrackLayer[], lines: Line[], discs: Disc[], ellipses: Ellipse[], marks: Mark[], arrows: Arrow[], vehicles: Vehicle[],
  current: { north_mps: number, east_mps: number, estimated: boolean } | null, origin: { lat_deg: number, lon_deg: number } | null, label: string, beside?: Picture[] };

export type Place = { north: number, east: number };

/** What is drawn over a picture by hand. */
export type Overlay = { lines: Line[], discs: Disc[], marks: Mark[] };

/** What is drawn and moved on the map. `press` says whether it takes what is pressed at a place, and gets its moves until `release`; `near` is in m.
 * `aims` says whether a tap goes to it, `draws` whether the map is to hold still for it. */
export type Tool = { overlay: (picture: Picture, frame: Frame) => Overlay, press: (at: Place, near: number) => boolean, move: (at: Place) => void, release: () => void,
  tap: (at: Place, near: number) => void, aims: () => boolean, draws: () => boolean, takeFile?: (file: File) => void };

/** `scale` is pixels a metre; `north`, `east` are in the middle; `sides` says where names were in the last picture. */
export type Frame = { width: number, height: number, scale: number, north: number, east: number, sides?: Map<string, number> };

export type Visit = { auv: string, arrive_s: number, leave_s: number, north_m: number, east_m: number, cost_before: number, cost_after: number };

export type ServedAuv = { auv: string, cost: number, served_by_s?: number, heard_within_m?: number, unheard_s?: number, left_out?: "silent" | "out_of_reach" | "too_deep" };

export type Schedule = { unit: "s" | "m2" | "kbit", visits: Visit[], costs: ServedAuv[], cost: number, bound: number, exact: boolean, sentence: string, deadlines_missed?: string[],
  alternatives: { next: string, cost: number, deadlines_missed: number }[] };

export type VisitGoal = { kind?: string, auvs?: string[], within_m?: number, serve_by_s?: { [auv: string]: number }, next?: string };

export type Service = { auv: string, from: number, to: number };

/** `schedule` is none while it is loading; `past` has what was served until `now`; `clock` writes a time on the axis. */
export type Visits = { schedule?: Schedule | null, goal?: VisitGoal, now: number, past?: Service[], begin: number, clock: (t: number) => string, order: string[] };
