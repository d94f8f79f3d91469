//! The vehicles of a scenario file: craft, goal, underwater vehicles, paths.

use std::{collections::BTreeMap, sync::Arc};

use planner::snapshot::ID_LENGTH_MAX;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{CraftFile, ITEMS_MAX, LANES_MAX, NAME_PATTERN, Point};
use crate::{
    scenario::quantity::{
        Acceleration, Angle, ClockTime, CommandDelay, Coordinate, CraftMass, Depth, LeastSpeed, Length,
        LoopLag, MissionTime, OffsetComponent, PathSpeed, Pitch, Quantity, SlantRange, Speed,
        TunedAcceleration, TunedLag, TurnRate, Weight,
    },
    world::surface_craft::random::RandomCraft,
};

/// The surface craft at the start, and its task.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceCraftFile {
    /// Its hull, thrusters and autopilot: a class, or drawn.
    pub class: SurfaceClassFile,
    /// North of the datum, m.
    pub north_m: Quantity<Coordinate>,
    /// East of the datum, m.
    pub east_m: Quantity<Coordinate>,
    /// Heading, rad, clockwise from north.
    pub heading_rad: Quantity<Angle>,
    /// Surge speed through the water, m/s.
    pub speed_mps: Quantity<Speed>,
    /// Whether its surge loop has drag feed-forward. Without it a MEDUSA takes so long to change its speed that the
    /// guidance hardly shows. A drawn craft has its own.
    // The time that it takes: docs/tuning.md#sim-drag-feed-forward.
    #[serde(default = "yes")]
    pub drag_feed_forward: bool,
    /// Its task.
    pub goal: GoalFile,
    /// Offset of the goal from what it follows: an underwater vehicle or, of several, their mean or the place nearest
    /// to all. Right above it if left out.
    pub goal_offset: Option<OffsetFile>,
    /// Slant range to an underwater vehicle that counts as contact, m.
    pub contact_range_m: Quantity<Length>,
    /// Limits given to the planner, where they differ from those of the class; those of the class if left out.
    #[serde(default)]
    pub limits: LimitsFile,
    /// Closed-loop response given to the planner; the true one if left out, none if empty.
    pub craft: Option<CraftFile>,
    /// The craft of a random class, where it was drawn before: drawing one takes as long as a mission.
    #[serde(skip)]
    pub drawn: Option<Arc<RandomCraft>>,
}

fn yes() -> bool {
    true
}

/// A class of surface craft.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceClassFile {
    /// MEDUSA: 30 kg, 1.6 m/s.
    Medusa,
    /// Otter: 3 m/s.
    Otter,
    /// A craft that the planner does not know: hull, thrusters and autopilot are drawn, and step-tested.
    Random(RandomCraftFile),
}

/// A surface craft that is drawn. What is left out is drawn too.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomCraftFile {
    /// Which craft; another one for every seed of the mission if left out.
    pub seed: Option<u64>,
    /// Dry mass, kg; drawn if left out.
    pub mass_kg: Option<Quantity<CraftMass>>,
    /// Kind of heading loop; drawn if left out.
    pub heading_loop: Option<HeadingLoopFile>,
    /// Lag that the heading loop is tuned for, the delay not counted, s; drawn if left out.
    pub heading_lag_s: Option<Quantity<TunedLag>>,
    /// What the heading loop holds; drawn if left out.
    pub heading_held: Option<HeadingHeldFile>,
    /// Kind of surge loop; drawn if left out.
    pub surge_loop: Option<SurgeLoopFile>,
    /// Lag that the surge loop is tuned for, the delay not counted, s; drawn if left out.
    pub surge_lag_s: Option<Quantity<TunedLag>>,
    /// What the surge loop holds; drawn if left out.
    pub speed_held: Option<SpeedHeldFile>,
    /// Largest acceleration that the surge loop asks for, m/s²; drawn if left out.
    pub acceleration_mps2: Option<Quantity<TunedAcceleration>>,
    /// Time until a reference reaches the loops, s; drawn if left out.
    pub delay_s: Option<Quantity<CommandDelay>>,
}

/// A kind of heading loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeadingLoopFile {
    /// Proportional-derivative.
    Pd,
    /// Proportional-integral-derivative.
    Pid,
    /// The same behind a second-order reference model.
    ReferenceModel,
    /// Heading error to a yaw rate that is limited, and that to a moment.
    Cascade,
}

/// What a heading loop holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeadingHeldFile {
    /// Where the bow points.
    Heading,
    /// Where the craft goes, over ground; where the bow points below 0.1 m/s.
    Course,
}

/// A kind of surge loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurgeLoopFile {
    /// Proportional, with drag feed-forward.
    P,
    /// Proportional-integral, with anti-windup.
    Pi,
    /// Proportional-integral, without.
    PiWindup,
}

/// What a surge loop holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpeedHeldFile {
    /// Speed through the water.
    ThroughWater,
    /// Speed over ground along the bow.
    OverGround,
}

/// What the surface craft is to do.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum GoalFile {
    /// Stay above one underwater vehicle.
    Track {
        /// Which.
        auv: String,
    },
    /// Follow several in turn.
    Intermittent {
        /// Which, in order.
        auvs: Vec<String>,
        /// Time with each, s.
        dwell_s: Quantity<MissionTime>,
        /// When the first turn of the first began, s on the surface craft's clock.
        epoch_s: Quantity<ClockTime>,
    },
    /// Stay above the mean of several.
    Midpoint {
        /// Which.
        auvs: Vec<String>,
    },
    /// Stay above the weighted mean of several.
    Weighted {
        /// How much each counts, by name, relative to the others.
        weights: BTreeMap<String, Quantity<Weight>>,
    },
    /// Stay within a slant range of every one of several, and where the worst is least.
    Range {
        /// Which.
        auvs: Vec<String>,
        /// The range, m.
        range_m: Quantity<SlantRange>,
    },
}

/// Offset of a goal from what it follows.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum OffsetFile {
    /// In fixed directions.
    Ned {
        /// How far north, m.
        north_m: Quantity<OffsetComponent>,
        /// How far east, m.
        east_m: Quantity<OffsetComponent>,
    },
    /// Along the course of what is followed, held while that rests.
    Target {
        /// How far ahead, m.
        ahead_m: Quantity<OffsetComponent>,
        /// How far to starboard, m.
        starboard_m: Quantity<OffsetComponent>,
    },
    /// Along the tangent of the path where the underwater vehicle is on it that is followed. The surface craft has
    /// to know the paths.
    Path {
        /// How far ahead, m.
        ahead_m: Quantity<OffsetComponent>,
        /// How far to starboard, m.
        starboard_m: Quantity<OffsetComponent>,
    },
}

/// Limits other than the class's.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitsFile {
    /// Slowest speed reference, m/s; the class's if left out.
    pub speed_min_mps: Option<Quantity<LeastSpeed>>,
    /// Fastest speed reference, m/s; the class's if left out.
    pub speed_max_mps: Option<Quantity<Speed>>,
    /// Largest yaw rate, rad/s; the class's if left out.
    pub turn_rate_max_radps: Option<Quantity<TurnRate>>,
    /// Largest acceleration, m/s²; the class's if left out.
    pub acceleration_max_mps2: Option<Quantity<Acceleration>>,
    /// Largest deceleration, m/s²; the class's if left out.
    pub deceleration_max_mps2: Option<Quantity<Acceleration>>,
    /// Time constant of the surge loop, s: a member of `craft`, here for files without one; that of `craft` if left out.
    pub surge_lag_s: Option<Quantity<LoopLag>>,
}

/// An underwater vehicle: its class, its path, and where it starts relative to the beginning of the path.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AuvFile {
    /// Its name: lower-case letters, digits and hyphens.
    #[schemars(length(min = 1, max = ID_LENGTH_MAX), regex(pattern = NAME_PATTERN))]
    pub id: String,
    /// Its hull, loops, navigation, speed and dive; `medusa` if left out.
    #[serde(default)]
    pub class: UnderwaterClassFile,
    /// How far north of the path's beginning it starts, m; 0 if left out.
    pub north_of_path_m: Option<Quantity<Coordinate>>,
    /// How far east of it, m; 0 if left out.
    pub east_of_path_m: Option<Quantity<Coordinate>>,
    /// Heading relative to the path's, rad, clockwise; 0 if left out.
    pub heading_off_path_rad: Option<Quantity<Angle>>,
    /// Depth at the start, m; the least of the dive if left out.
    pub depth_m: Option<Quantity<Depth>>,
    /// Leg of the dive at the start; down if left out.
    #[serde(default)]
    pub leg: LegFile,
    /// Speed along its body, m/s; the class's if left out.
    pub speed_mps: Option<Quantity<PathSpeed>>,
    /// Speed along its body over arc length, [m, m/s] at each knot, linear between, instead of `speed_mps`; none if left out.
    #[schemars(length(min = 1, max = ITEMS_MAX))]
    pub speed_profile: Option<Vec<SpeedKnot>>,
    /// Its sawtooth, where it differs from the class's; the class's if left out.
    pub dive: Option<DiveFile>,
    /// Its path.
    pub path: PathFile,
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

/// A class of underwater vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UnderwaterClassFile {
    /// MEDUSA: 0.3 m/s, 1 to 23 m at 50°; knows where it is.
    #[default]
    Medusa,
    /// Slocum glider: 0.29 m/s horizontally at 26°; knows where it is at the surface only.
    Slocum,
}

/// A leg of a dive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LegFile {
    /// Nose down.
    #[default]
    Down,
    /// Nose up.
    Up,
}

/// A sawtooth.
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
    /// Lanes joined by half circles, the first turn to starboard.
    LawnMower {
        /// Beginning of the first lane.
        from: Point,
        /// Heading of the first lane, rad.
        heading_rad: Quantity<Angle>,
        /// Length of a lane, m.
        lane_length_m: Quantity<Length>,
        /// Distance of neighbouring lanes, m.
        lane_spacing_m: Quantity<Length>,
        /// How many lanes.
        #[schemars(range(min = 1, max = LANES_MAX))]
        lanes: usize,
    },
    /// Straight legs between way-points, corners rounded by arcs.
    Waypoints {
        /// The way-points.
        points: Vec<Point>,
        /// Radius of the arcs, m.
        fillet_m: Quantity<Length>,
        /// Whether the last point leads back to the first.
        #[serde(default)]
        closed: bool,
    },
    /// A circle, round and round.
    Circle {
        /// Its centre.
        centre: Point,
        /// Its radius, m.
        radius_m: Quantity<Length>,
        /// To which side it turns.
        turn: SideFile,
        /// Where on it the path begins: direction from the centre, rad; north if left out.
        bearing_rad: Option<Quantity<Angle>>,
    },
    /// Lines and arcs that join without a kink.
    Segments {
        /// In order.
        segments: Vec<SegmentFile>,
        /// Whether the last leads back to the first.
        #[serde(default)]
        closed: bool,
    },
    /// Way-points read from a GeoJSON LineString, beside the scenario file. The scenario needs an origin.
    Geojson {
        /// Name of the file.
        file: String,
        /// Radius of the arcs at its corners, m.
        fillet_m: Quantity<Length>,
    },
}

/// A side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SideFile {
    /// Left.
    Port,
    /// Right.
    Starboard,
}

/// A piece of a path.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SegmentFile {
    /// A straight line.
    Line {
        /// Its beginning.
        from: Point,
        /// Its end.
        to: Point,
    },
    /// An arc.
    Arc {
        /// Its beginning.
        from: Point,
        /// Its centre.
        centre: Point,
        /// The angle it turns through, rad, positive to starboard.
        angle_rad: Quantity<Angle>,
    },
}
