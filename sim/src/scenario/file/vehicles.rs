//! The vehicles of a scenario file: craft, goal, underwater vehicles, paths.

use std::{collections::BTreeMap, sync::Arc};

use planner::craft::{CraftDescription, HeadingReference, SpeedReference};
use planner::path::Side;
use planner::snapshot::{AUVS_MAX, DeclaredLimits, Goal, ID_LENGTH_MAX, Offset, Tuning};
use planner::tuned::Tuned;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};

use super::{ITEMS_MAX, LANES_MAX, NAME_PATTERN, Point, yes};
use crate::{
    scenario::quantity::{
        Angle, CommandDelay, Coordinate, CraftMass, Damping, Depth, Distribution, Length, LostShare,
        OffsetComponent, PathSpeed, Pitch, Quantity, Share, Speed, TunedAcceleration, TunedLag, WeavePeriod,
    },
    world::{
        dive::Leg,
        surface_craft::random::{HeadingLoopKind, RandomCraft, SurgeLoopKind},
        underwater_vehicle::UnderwaterClass,
    },
};

/// The surface craft at the start, and its task.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceCraftFile {
    /// Name among several: lower-case letters, digits and hyphens; one craft is `asc` if left out.
    #[schemars(length(min = 1, max = ID_LENGTH_MAX), regex(pattern = NAME_PATTERN))]
    pub id: Option<String>,
    /// The AUVs that it may serve among several craft; all if left out.
    #[schemars(length(max = AUVS_MAX))]
    pub serves: Option<Vec<String>>,
    /// Hull, thrusters and autopilot.
    pub class: SurfaceClassFile,
    /// North at the start, m.
    pub north_m: Quantity<Coordinate>,
    /// East at the start, m.
    pub east_m: Quantity<Coordinate>,
    /// Heading, rad, clockwise from north.
    pub heading_rad: Quantity<Angle>,
    /// Surge speed through the water, m/s.
    pub speed_mps: Quantity<Speed>,
    /// `true`: the surge loop has drag feed-forward; a random craft ignores this.
    // The response times: docs/rationale.md#sim-drag-feed-forward.
    #[serde(default = "yes")]
    pub drag_feed_forward: bool,
    /// Its goal.
    #[serde(deserialize_with = "Goal::outside")]
    pub goal: Goal<Distribution>,
    /// Offset of the goal from the point that it follows; none if left out.
    #[serde(default, deserialize_with = "offset")]
    pub goal_offset: Option<Offset<Distribution>>,
    /// Slant range that counts as contact, m.
    pub contact_range_m: Quantity<Length>,
    /// Limits given to the planner; those of the class if left out.
    #[serde(default)]
    pub limits: DeclaredLimits<Distribution>,
    /// Closed-loop response given to the planner; the true one if left out, none if empty.
    pub craft: Option<CraftDescription<Distribution>>,
    /// Weights of the planner's cost, its horizon and iterations; the planner's own if left out.
    pub tuning: Option<Tuning>,
    /// Tuned numbers of the planner by table and name, such as `parameters.estimate.gate`; the
    /// planner's own if left out.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, BTreeMap<String, f64>>")]
    pub parameters: Tuned,
    /// A random craft drawn earlier, because a draw takes as long as a mission.
    #[serde(skip)]
    pub drawn: Option<Arc<RandomCraft>>,
}

fn offset<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Offset<Distribution>>, D::Error> {
    Offset::outside(from).map(Some)
}

/// A class of surface craft.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceClassFile {
    /// MEDUSA: 30 kg, 1.6 m/s.
    Medusa,
    /// Otter: 3 m/s.
    Otter,
    /// A random craft, unknown to the planner.
    Random(RandomCraftFile),
}

/// A random surface craft. Members that are left out are drawn.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomCraftFile {
    /// Seed of the craft; the mission's seed if left out.
    pub seed: Option<u64>,
    /// Dry mass, kg; drawn if left out.
    pub mass_kg: Option<Quantity<CraftMass>>,
    /// Kind of heading loop; drawn if left out.
    pub heading_loop: Option<HeadingLoopKind>,
    /// Design lag of the heading loop without the delay, s; drawn if left out.
    pub heading_lag_s: Option<Quantity<TunedLag>>,
    /// Kind of heading reference; drawn if left out.
    pub heading_held: Option<HeadingReference>,
    /// Kind of surge loop; drawn if left out.
    pub surge_loop: Option<SurgeLoopKind>,
    /// Design lag of the surge loop without the delay, s; drawn if left out.
    pub surge_lag_s: Option<Quantity<TunedLag>>,
    /// Kind of speed reference; drawn if left out.
    pub speed_held: Option<SpeedReference>,
    /// Largest acceleration that the surge loop commands, m/s²; drawn if left out.
    pub acceleration_mps2: Option<Quantity<TunedAcceleration>>,
    /// Time until a reference reaches the loops, s; drawn if left out.
    pub delay_s: Option<Quantity<CommandDelay>>,
}

/// An underwater vehicle: its class, its path, and its start relative to the beginning of the path.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AuvFile {
    /// Name: lower-case letters, digits and hyphens.
    #[schemars(length(min = 1, max = ID_LENGTH_MAX), regex(pattern = NAME_PATTERN))]
    pub id: String,
    /// Hull, loops, navigation, speed and dive; `medusa` if left out.
    #[serde(default)]
    pub class: UnderwaterClass,
    /// Start, north of the path's beginning, m; 0 if left out.
    pub north_of_path_m: Option<Quantity<Coordinate>>,
    /// Start, east of the path's beginning, m; 0 if left out.
    pub east_of_path_m: Option<Quantity<Coordinate>>,
    /// Heading at the start less the path's, rad; 0 if left out.
    pub heading_off_path_rad: Option<Quantity<Angle>>,
    /// Depth at the start, m; the least depth of the dive if left out.
    pub depth_m: Option<Quantity<Depth>>,
    /// Leg of the dive at the start; down if left out.
    #[serde(default)]
    pub leg: Leg,
    /// Speed along its body, m/s; the class's if left out.
    pub speed_mps: Option<Quantity<PathSpeed>>,
    /// Speed along its body, linear between knots, instead of `speed_mps`; none if left out.
    #[schemars(length(min = 1, max = ITEMS_MAX))]
    pub speed_profile: Option<Vec<SpeedKnot>>,
    /// Its sawtooth dive; the class's if left out.
    pub dive: Option<DiveFile>,
    /// Error of its own navigation, added to its class's; none if left out.
    pub navigation_error: Option<NavigationErrorFile>,
    /// Deviations from its path that are none of its navigation; none if left out.
    #[serde(default)]
    pub tracking_error: TrackingErrorFile,
    /// Its declaration to a surface craft that knows paths; `plan` if left out.
    #[serde(default)]
    pub declares: Declares,
    /// Its path; it repeats a `track` if left out.
    pub path: Option<PathFile>,
    /// Name of a CSV file with a recorded track that it repeats; it follows its `path` if left out.
    pub track: Option<String>,
}

/// Error of a vehicle's own navigation, by which it follows its path: estimate less position.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NavigationErrorFile {
    /// North, at the start, m; 0 if left out.
    pub north_m: Option<Quantity<Coordinate>>,
    /// East, at the start, m; 0 if left out.
    pub east_m: Option<Quantity<Coordinate>>,
    /// Growth, as a share of the distance through the water; 0 if left out.
    pub drift_share: Option<Quantity<Share>>,
    /// Direction of growth, rad; 0 if left out.
    pub drift_heading_rad: Option<Quantity<Angle>>,
    /// `true`: a satellite fix at a depth of 1 m or less ends it.
    #[serde(default)]
    pub fix_at_surface: bool,
}

/// Deviations of a vehicle from its path, which no plan contains.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackingErrorFile {
    /// Weave about its path; none if left out.
    pub weave: Option<WeaveFile>,
    /// Distance beyond each way-point at which it turns, m; negative: before it, so that it cuts
    /// the corner; 0 if left out. It is back on its path within four times that.
    pub turns_late_m: Option<Quantity<OffsetComponent>>,
    /// Share of its speed that it loses nose down; 0 if left out.
    pub slower_diving_share: Option<Quantity<LostShare>>,
}

/// A weave, as far as its hull can follow it.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WeaveFile {
    /// Amplitude, m: √2 times the standard deviation.
    pub amplitude_m: Quantity<Length>,
    /// Period, s, of the spectrum's peak if damped.
    pub period_s: Quantity<WeavePeriod>,
    /// Relative damping of a stationary random weave: the width of its spectrum; a sine if left
    /// out.
    pub damping: Option<Quantity<Damping>>,
}

/// A vehicle's declaration of its path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Declares {
    /// Its path, as planned.
    #[default]
    Plan,
    /// Its track, as it will sail it.
    Sailed,
}

/// A knot of a speed profile.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpeedKnot {
    /// Arc length from the beginning of the path, m.
    pub along_m: Quantity<Coordinate>,
    /// Speed along the body there, m/s.
    pub speed_mps: Quantity<PathSpeed>,
}

/// A sawtooth dive.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiveFile {
    /// Depth at which a climb ends, m.
    pub depth_min_m: Quantity<Depth>,
    /// Depth at which a dive ends, m.
    pub depth_max_m: Quantity<Depth>,
    /// Pitch of both legs, rad, positive.
    pub pitch_rad: Quantity<Pitch>,
}

/// A horizontal path.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PathFile {
    /// Lanes joined by half circles; the first turn is to starboard.
    LawnMower {
        /// Beginning of the first lane.
        from: Point,
        /// Heading of the first lane, rad.
        heading_rad: Quantity<Angle>,
        /// Length of a lane, m.
        lane_length_m: Quantity<Length>,
        /// Distance of neighbouring lanes, m.
        lane_spacing_m: Quantity<Length>,
        /// Number of lanes.
        #[schemars(range(min = 1, max = LANES_MAX))]
        lanes: usize,
    },
    /// Legs between way-points, with rounded corners.
    Waypoints {
        /// The way-points.
        points: Vec<Point>,
        /// Radius of all corners, m, for which legs must have room; none if left out.
        fillet_m: Option<Quantity<Length>>,
        /// Turn radius where legs have room, m, unknown to the surface craft; 10 m if left out.
        turn_radius_m: Option<Quantity<Length>>,
        /// `true`: the last point leads back to the first.
        #[serde(default)]
        closed: bool,
    },
    /// A circle, repeated without end.
    Circle {
        /// Centre.
        centre: Point,
        /// Radius, m.
        radius_m: Quantity<Length>,
        /// Side to which it turns.
        turn: Side,
        /// Bearing of the beginning from the centre, rad; north if left out.
        bearing_rad: Option<Quantity<Angle>>,
    },
    /// Lines and arcs; neighbours share a tangent.
    Segments {
        /// The pieces, in order.
        segments: Vec<SegmentFile>,
        /// `true`: the last piece leads back to the first.
        #[serde(default)]
        closed: bool,
    },
    /// Way-points of a GeoJSON LineString. Requires `origin`.
    Geojson {
        /// Name of the file, beside the scenario file.
        file: String,
        /// Radius of its corners, m.
        fillet_m: Quantity<Length>,
    },
    /// A random survey, of which a surface craft that knows paths knows the way-points alone.
    RandomSurvey {
        /// Seed of the survey; the mission's seed if left out.
        seed: Option<u64>,
        /// Its pattern; drawn if left out.
        pattern: Option<SurveyPattern>,
        /// Beginning; the datum if left out.
        from: Option<Point>,
        /// Heading of the first leg, rad; drawn if left out.
        heading_rad: Option<Quantity<Angle>>,
        /// Longest lane or leg, m, at least 8 turn radii; drawn from 8 to 30 turn radii if left
        /// out.
        leg_m: Option<Quantity<Length>>,
        /// Distance of lanes, m, at least 2 turn radii; drawn from 2 to 6 turn radii if left out.
        spacing_m: Option<Quantity<Length>>,
        /// Turn radius, m; 10 m if left out.
        turn_radius_m: Option<Quantity<Length>>,
    },
}

/// Pattern of a survey.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurveyPattern {
    /// Parallel lanes, one after the other.
    LawnMower,
    /// One leg, to and fro without end.
    ThereAndBack,
    /// A rectangle, round and round.
    Box,
    /// Two lanes and two half circles, round and round.
    Racetrack,
    /// Legs that grow, each at a right angle to the last.
    ExpandingSquare,
    /// Way-points without a pattern.
    Waypoints,
    /// Parallel lanes of different lengths; never drawn.
    UnequalLanes,
    /// A spiral outwards; never drawn.
    Spiral,
    /// A figure of eight, without end; never drawn.
    FigureOfEight,
}

impl SurveyPattern {
    /// Those that are drawn.
    pub const DRAWN: [Self; 6] = [
        Self::LawnMower,
        Self::ThereAndBack,
        Self::Box,
        Self::Racetrack,
        Self::ExpandingSquare,
        Self::Waypoints,
    ];
}

/// A piece of a path.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SegmentFile {
    /// A straight line.
    Line {
        /// Beginning.
        from: Point,
        /// End.
        to: Point,
    },
    /// An arc.
    Arc {
        /// Beginning.
        from: Point,
        /// Centre.
        centre: Point,
        /// Angle, rad, positive to starboard.
        angle_rad: Quantity<Angle>,
    },
}
