//! What clients post.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use super::{
    both::{Current, Drift, Forecast, Origin, TrajectoryPoint},
    craft::Craft,
};

/// A snapshot of what is known now, and what the surface craft is to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanRequest {
    /// Version of this shape: `"1.0"`.
    #[schema(example = "1.0")]
    pub schema_version: String,
    /// Now, s, on any clock that all times of the request share.
    pub t_s: f64,
    /// Where the datum of all positions lies on Earth. With it, any position may be given as `lat_deg` and `lon_deg`
    /// instead of `north_m` and `east_m`, and a point of a list as an object of these two; answers have both. Default: not
    /// known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// The surface craft.
    pub asc: Asc,
    /// The underwater vehicles, 1 to 16, in any order.
    pub auvs: Vec<Auv>,
    /// What to do.
    pub goal: Goal,
    /// Current at the surface. Without it, it is taken from the surface craft's ground velocity; without that, from its
    /// positions and its speed through the water, else from `previous_plan`, else the water is taken to be still. A ground velocity that would leave a current of more than 3 m/s
    /// along an axis is set aside, with the warning `velocities_contradict`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// What the surface craft is allowed. Default: as in each member. Where `craft` is left out, they are also taken for what
    /// the craft does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// How the surface craft answers its references: what is known of it. What is not said is the preset's, or else a
    /// cautious generic craft's, and learnt from how the craft moves. Default: nothing is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<Craft>,
    /// Discs to keep out of, at most 32. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep_outs: Vec<KeepOut>,
    /// Corners [north, east] of a convex area to stay in, m: 3 to 64, in order, either way round, every corner
    /// once. Default: no limit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(example = json!([[-50.0, -50.0], [200.0, -50.0], [200.0, 150.0], [-50.0, 150.0]]))]
    pub area: Vec<[f64; 2]>,
    /// What the acoustic link needs. Default: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acoustics: Option<Acoustics>,
    /// Horizontal distance to keep from every underwater vehicle while it may be within 2 m of the surface, m, from
    /// 0.5 to 100. Default: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 5.0)]
    pub surfacing_separation_m: Option<f64>,
    /// How to guess the underwater vehicles' future. Default: `auto`.
    #[serde(default)]
    pub forecast: Forecast,
    /// What to do when no program was solved, and for a goal of which the last report is too old. Default: `los`.
    #[serde(default)]
    pub fallback: Fallback,
    /// What the last fallback level does. Default: `slow_turn`.
    #[serde(default)]
    pub hold: Hold,
    /// Time for the answer, ms, from 0.05 to 60 000, counted from the arrival of the request's head. When it comes
    /// before all programs are solved, those that are compete for the answer, or else what `fallback` says counts.
    /// Default and most: the service's own deadline, 1000 unless it was started with another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline_ms: Option<f64>,
    /// The last answer, whole: the service itself remembers nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub previous_plan: Option<PreviousPlan>,
    /// Anything; comes back in the answer. At most 4096 bytes.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

/// State of the surface craft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Asc {
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north: with `lon_deg` instead of `north_m` and `east_m`, where there is an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
    /// Heading, rad, within ±2π.
    pub heading_rad: f64,
    /// Surge speed through the water, m/s, positive ahead.
    pub speed_mps: f64,
    /// Sway speed through the water, m/s, positive to starboard. Default: 0.
    #[serde(default)]
    pub sway_mps: f64,
    /// Yaw rate, rad/s, positive clockwise seen from above. Default: 0.
    #[serde(default)]
    pub yaw_rate_radps: f64,
    /// Northward velocity over ground, m/s; together with `ground_east_mps` or not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_north_mps: Option<f64>,
    /// Eastward velocity over ground, m/s; together with `ground_north_mps` or not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_east_mps: Option<f64>,
}

/// An underwater vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Auv {
    /// Its name, unique in the request, 1 to 64 bytes.
    #[schema(example = "auv-1")]
    pub id: String,
    /// Its state as last heard of. Either this or `reports`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<AuvState>,
    /// What was heard of it lately, 1 to 64 reports in any order: the planner filters them. Either this or `state`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reports: Option<Vec<Report>>,
    /// The path that it follows, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<Path>,
    /// The sawtooth in which it dives, where that is known. Without it, its depth is taken to stay what it was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dive: Option<Dive>,
}

/// State of an underwater vehicle at the time of its last report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AuvState {
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north: with `lon_deg` instead of `north_m` and `east_m`, where there is an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Course over ground, rad, within ±2π.
    pub course_rad: f64,
    /// Horizontal speed over ground, m/s, never negative.
    pub speed_mps: f64,
    /// Rate of turn of the course, rad/s, positive clockwise. Default, and where it is 0: as the courses of this state
    /// and the one in `previous_plan.targets` tell, else 0.
    #[serde(default)]
    pub turn_rate_radps: f64,
    /// Age of the report, s. From 15 minutes on a goal that needs this AUV now is held, and limits about it no longer
    /// count; from an hour on it is taken to stay where it was. Default: 0.
    #[serde(default)]
    pub age_s: f64,
    /// Covariance of north, east, north velocity and east velocity then, row by row, in m², m²/s and m²/s²:
    /// symmetric, no eigenvalue negative. Default: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 4]; 4]>,
}

/// A measured position of an underwater vehicle, and what the vehicle said of itself then.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// When it was so, s on the request's clock: when the message was sent, not when it arrived. At most 1 s
    /// ahead, which counts as now. Of reports older than an hour the newest counts, if there is no other.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north: with `lon_deg` instead of `north_m` and `east_m`, where there is an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
    /// Standard deviation of the position along either axis, m, from 0.01 to 10,000.
    pub sigma_m: f64,
    /// Telemetered depth, m, positive down. Default: not reported; where no report states it, 0 is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_m: Option<f64>,
    /// Telemetered course over ground, rad, within ±2π; together with `speed_mps` or not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub course_rad: Option<f64>,
    /// Telemetered horizontal speed over ground, m/s, never negative; together with `course_rad` or not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<f64>,
    /// Telemetered rate of turn of the course, rad/s, positive clockwise. Default: not reported. The newest is used
    /// for 60 s; where none tells, the courses of the two newest do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_rate_radps: Option<f64>,
}

/// A path that an underwater vehicle is known to follow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Path {
    /// Its segments, in order: each begins where and in which direction the one before it ends, to a millimetre
    /// and a milliradian. At most 256, every way-point counted as one.
    pub segments: Vec<Segment>,
    /// Whether the last segment leads to the first again. A closed path of way-points alone returns to its
    /// first point by itself. An open path goes on straight beyond its ends. Default: no.
    #[serde(default)]
    pub closed: bool,
    /// Horizontal speed of the vehicle through the water, m/s, from 0.01 to 10.
    pub speed_mps: f64,
}

/// A sawtooth in which an underwater vehicle is known to dive: down until deep enough, up until shallow enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Dive {
    /// Depth at which a climb ends, m, positive down, from 0.
    pub depth_min_m: f64,
    /// Depth at which a dive ends, m, at least 0.5 below `depth_min_m`, to 12000.
    pub depth_max_m: f64,
    /// Pitch of both legs, rad, positive, from 0.05 to 1.4. With the horizontal speed through the water it gives
    /// the speed along the body, which stays the same in the reversals.
    #[schema(example = 0.873)]
    pub pitch_rad: f64,
    /// Time that a reversal takes, s, from passing the depth that ends a leg until passing it again, from 0.1 to
    /// 120. Default: 3.6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reversal_s: Option<f64>,
    /// Whether its nose was down and it got deeper at the time of its `state`. Where that is not known, its depth is
    /// forecast as the mean of both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub descending: Option<bool>,
}

/// A segment of a path. Which members are needed depends on `kind`. Points are (north, east), m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Which segment.
    pub kind: SegmentKind,
    /// `line`, `arc`: where it begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<[f64; 2]>,
    /// `line`: where it ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<[f64; 2]>,
    /// `arc`: centre of its circle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 2]>,
    /// `arc`: how far it turns, rad, positive to starboard, up to a full circle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_rad: Option<f64>,
    /// `waypoints`: where its straight legs would meet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<[f64; 2]>>,
    /// `waypoints`: radius by which corners are rounded, m; 0 only where no leg turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fillet_m: Option<f64>,
}

/// The kinds of segments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SegmentKind {
    /// A straight line: `from`, `to`.
    Line,
    /// Part of a circle: `from`, `centre`, `angle_rad`.
    Arc,
    /// Straight legs with rounded corners: `points`, `fillet_m`.
    Waypoints,
}

/// What the surface craft is to do. Which members are needed depends on `kind`.
///
/// One flat shape and not one variant per kind: serde's tagged variants forget where in the document
/// an error is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Which goal.
    pub kind: GoalKind,
    /// `track`: the vehicle to follow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub auv: Option<String>,
    /// `intermittent`: the vehicles to follow, in order. `midpoint`: those whose mean to follow. `range`: those to stay near.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub auvs: Option<Vec<String>>,
    /// `intermittent`: time spent with each, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dwell_s: Option<f64>,
    /// `intermittent`: when the first dwell of the first vehicle began, s on the request's clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epoch_s: Option<f64>,
    /// `weighted`: how much each vehicle counts in the mean, by name, relative to the others: from 0 to 10⁶,
    /// at least one above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = json!({ "auv-1": 0.7, "auv-2": 0.3 }))]
    pub weights: Option<BTreeMap<String, f64>>,
    /// `range`: slant range to stay within of each, m, from 1 to 20,000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_m: Option<f64>,
    /// Any kind: where to be, seen from what the goal follows. Default: right above it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<Offset>,
}

/// Where to be, seen from what the goal follows: a vehicle or, of several, their mean or the place nearest to all.
/// Which members are needed depends on `frame`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Offset {
    /// Along which axes.
    pub frame: OffsetFrame,
    /// `ned`: how far north, m, within ±1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub north_m: Option<f64>,
    /// `ned`: how far east, m, within ±1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub east_m: Option<f64>,
    /// `target`, `path`: how far ahead, m, within ±1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ahead_m: Option<f64>,
    /// `target`, `path`: how far to starboard, m, within ±1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub starboard_m: Option<f64>,
    /// `polar`: how far, m, from 0 to 1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_m: Option<f64>,
    /// `polar`: in which direction, rad, clockwise from north, within ±2π.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bearing_rad: Option<f64>,
}

/// The axes that an offset is given in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OffsetFrame {
    /// North and east: `north_m`, `east_m`.
    Ned,
    /// Along the course over ground of what the goal follows, held while that rests: `ahead_m`, `starboard_m`. It
    /// turns with it.
    Target,
    /// Along the tangent of the path where the vehicle is on it: `ahead_m`, `starboard_m`. For a goal that follows
    /// one vehicle at a time, whose `path` is given.
    Path,
    /// North and east, given as `range_m` and `bearing_rad`.
    Polar,
}

/// The kinds of goals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GoalKind {
    /// Stay above one vehicle: `auv`.
    Track,
    /// Follow each vehicle in turn: `auvs`, `dwell_s`, `epoch_s`.
    Intermittent,
    /// Stay above the mean of several vehicles: `auvs`.
    Midpoint,
    /// Stay above the weighted mean of several vehicles: `weights`.
    Weighted,
    /// Stay within a slant range of every vehicle, and where the worst is least: `auvs`, `range_m`.
    Range,
}

/// What the operator allows the surface craft.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Slowest speed reference through the water, m/s. Default: 0.05.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_min_mps: Option<f64>,
    /// Fastest speed reference through the water, m/s. Default: 1.5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_max_mps: Option<f64>,
    /// Largest yaw rate, rad/s. Default: what the craft can do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_rate_max_radps: Option<f64>,
    /// Largest acceleration ahead, m/s². Default: what the craft can do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceleration_max_mps2: Option<f64>,
    /// Largest deceleration, m/s², positive. Default: what the craft can do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deceleration_max_mps2: Option<f64>,
    /// Time constant of the surge loop, s, where `craft` does not say it. Default: the craft's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surge_lag_s: Option<f64>,
}

/// A disc to keep out of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepOut {
    /// Its centre, north of the datum, m.
    pub north_m: f64,
    /// Its centre, east of the datum, m.
    pub east_m: f64,
    /// Its centre's latitude, degrees, positive north: with `lon_deg` instead of `north_m` and `east_m`, where there is an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Its centre's longitude, degrees, positive east.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
    /// Its radius, m, from 0.1 to 10 000.
    pub radius_m: f64,
}

/// What the acoustic link needs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Acoustics {
    /// Slant range to every underwater vehicle to keep within, m, from 1 to 20 000. The horizontal distance that it
    /// leaves is shortened by 1.73 times the vehicle's `position_sigma_m`, so that it is kept for all but few of the
    /// places where the vehicle may be.
    pub range_max_m: f64,
}

/// What to do when no program was solved, and for a goal of which the last report is too old.
///
/// It does not choose who answers otherwise: a previous plan that is followed further, or line of sight, answers with
/// the outcome `ok` where it is predicted to do better than the solved program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fallback {
    /// The better of the previous plan and line of sight answers, or `hold` for a report that is too old. The outcome
    /// is `degraded`.
    #[default]
    Los,
    /// Refuse with 503, or with 504 where the deadline was the reason.
    None,
}

/// What the last fallback level does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// Circle slowly to starboard at the least speed that steers.
    #[default]
    SlowTurn,
    /// Stop the thrusters.
    Stop,
}

/// An earlier answer. A whole one is accepted, these members of it are read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousPlan {
    /// Where its datum lay: where the request says so too, in the same place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// Its trajectory, in order of time, at most 256 points.
    pub trajectory: Vec<TrajectoryPoint>,
    /// Course of what the goal follows when that last moved, rad, within ±2π.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_course_rad: Option<f64>,
    /// What it knew of the craft. Without it, what is learnt of the craft starts anew.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft_estimate: Option<PreviousCraft>,
    /// What it took the current for. Where the request tells a ground velocity and no current, that is averaged over
    /// half a minute.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// The reference that it gave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<PreviousReference>,
    /// What it knew of the underwater vehicles, at most 16.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub targets: Option<Vec<PreviousTarget>>,
}

/// What an earlier answer knew of the craft, of which these members are read: with how the craft moved since, they tell
/// how it answers its references.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousCraft {
    /// Speed through the water that the answer asked for, m/s.
    pub asked_speed_mps: f64,
    /// Heading that it asked for, rad.
    pub asked_heading_rad: f64,
    /// Its memory, as it was; another is none.
    pub memory: Vec<f64>,
}

/// What an earlier answer knew of an underwater vehicle, of which these members are read: with where the vehicle turned
/// out to be, they tell how it drifts. Without one of them it starts anew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousTarget {
    /// The vehicle.
    pub id: String,
    /// What it was forecast from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimate: Option<PreviousEstimate>,
    /// The forecast model used, never `auto`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forecast: Option<Forecast>,
    /// How it drifted. Beyond 0.5 m/s along either axis it counts as that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drift: Option<Drift>,
}

/// What an earlier answer forecast an underwater vehicle from, of which these members are read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousEstimate {
    /// How long ago that was then, s.
    pub age_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Northward velocity over ground, as it was reported, m/s.
    pub north_mps: f64,
    /// Eastward velocity over ground, as it was reported, m/s.
    pub east_mps: f64,
    /// Rate of turn of the course, rad/s, positive clockwise.
    pub turn_rate_radps: f64,
}

/// The reference of an earlier answer, of which these members are read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousReference {
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Heading, rad, within ±2π: the next one of `mpc` or `previous_plan` differs from it by no more than 9.7° a second,
    /// unless a keep-out is ahead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_rad: Option<f64>,
}
