//! Accepted ranges of the facts, for the checks of requests and for the `OpenAPI` document.

use std::{f64::consts::TAU, ops::RangeInclusive};

/// Most AUVs in one snapshot.
pub const AUVS_MAX: usize = 16;

/// Most rows of a localised vehicle's errors over time: now, and each twentieth of a trial.
pub const FIGURE_ROWS_MAX: usize = 21;

/// Most surface craft in a fleet.
pub const CRAFT_MAX: usize = 6;

/// Most points in a previous plan's trajectory.
pub const TRAJECTORY_POINTS_MAX: usize = 256;

/// Largest coordinate, m; one local datum cannot serve a larger area as a plane.
pub const COORDINATE_MAX: f64 = 1.0e6;

/// Largest time, s: past the year 5000 on a Unix clock, with exact milliseconds.
pub const TIME_MAX: f64 = 1.0e11;

/// Least height of a sawtooth's leg, m. Assumption: a depth gauge and a pitch loop need it.
pub const LEG_HEIGHT_MIN: f64 = 0.5;

/// Largest component of an offset, m; farther away, a craft accompanies no vehicle.
pub const OFFSET_MAX: f64 = 1.0e3;

/// Fastest current along an axis, m/s. Assumption: AUVs do not operate in tidal races.
pub const CURRENT_MAX: f64 = 3.0;

/// Longest name of a vehicle, bytes.
pub const ID_LENGTH_MAX: usize = 64;

/// Most reports of one AUV: more than ten minutes at one every ten seconds.
pub const REPORTS_MAX: usize = 64;

/// Oldest report, s: any that a clock can show. Age alone is not an error.
pub const REPORT_AGE_MAX: f64 = 2.0 * TIME_MAX;

/// Largest time of a report after now, s, which counts as now: a mission's clock drift.
pub const REPORT_AHEAD_MAX: f64 = 1.0;

/// Least standard deviation of a reported position, m: below receivers', and numerically harmless.
pub const REPORT_SIGMA_MIN: f64 = 0.001;

/// Largest standard deviation of a reported position, m; a larger one carries no information.
pub const REPORT_SIGMA_MAX: f64 = 1.0e5;

/// A measured slant range, m: from a modem at the hull to the largest range of a modem.
pub(crate) const REPORT_RANGE: RangeInclusive<f64> = 0.1..=2.0e4;

/// Largest time between a range and a known position of the craft, s.
pub const RANGE_FROM_WITHIN: f64 = 2.0;

/// Most discs to keep out of.
pub const KEEP_OUTS_MAX: usize = 32;

/// Radius of a keep-out, m: from the resolution of a craft's position to a large harbour.
pub const KEEP_OUT_RADIUS: RangeInclusive<f64> = 0.1..=1.0e4;

/// Most no-go areas.
pub const NO_GO_MAX: usize = 256;

/// Most corners of all no-go areas: a harbour's chart, or a coast of 100 km at 10 m.
pub const NO_GO_CORNERS_MAX: usize = 10_000;

/// Number of corners of an area.
pub const AREA_CORNERS: RangeInclusive<usize> = 3..=64;

/// Acoustic range, m: from the least distance of a craft to the largest range of a modem.
pub const ACOUSTIC_RANGE: RangeInclusive<f64> = 1.0..=2.0e4;

/// Distance to keep from a surfaced AUV, m. Assumption: from half a small craft's length on.
pub const SURFACING_SEPARATION: RangeInclusive<f64> = 0.5..=100.0;

/// Most vessels in one snapshot.
pub const VESSELS_MAX: usize = 64;

/// Number of points of a vessel's plan.
pub const VESSEL_PLAN_LENGTH: RangeInclusive<usize> = 0..=32;

/// Time for which a craft of a fleet still serves an AUV that it hands over, s.
pub const HAND_OVER: RangeInclusive<f64> = 0.0..=600.0;

/// Distance to keep from a vessel, m: from a craft's own half length to that of a large ship.
pub const VESSEL_SEPARATION: RangeInclusive<f64> = 1.0..=2000.0;

/// The range of a member of a JSON object, by its name.
pub type Range = (&'static str, RangeInclusive<f64>);

/// Maps a number, such as a distribution, to another one, from its place, its range and its value.
pub type MapNumber<'a, N, M> = &'a mut dyn FnMut(&str, &RangeInclusive<f64>, Option<&N>) -> Option<M>;

const COORDINATE: RangeInclusive<f64> = -COORDINATE_MAX..=COORDINATE_MAX;
pub(crate) const DEPTH: RangeInclusive<f64> = -10.0..=DEPTH_MAX;
const TURN_RATE: RangeInclusive<f64> = -1.0..=1.0;
const AUV_SPEED: RangeInclusive<f64> = 0.0..=AUV_SPEED_MAX;
const CURRENT_SPEED: RangeInclusive<f64> = -CURRENT_MAX..=CURRENT_MAX;

/// Largest speed of an AUV, m/s.
pub(crate) const AUV_SPEED_MAX: f64 = 10.0;

/// Largest depth, m: the oceans' deepest.
const DEPTH_MAX: f64 = 12_000.0;

/// Coordinates in an earlier answer, m; forecasts and filters may leave the accepted area.
pub(crate) const FORESEEN: RangeInclusive<f64> = -2.0 * COORDINATE_MAX..=2.0 * COORDINATE_MAX;

/// An angle, rad; more than a turn is a mistake, such as degrees.
pub const ANGLE: RangeInclusive<f64> = -TAU..=TAU;

/// Names of directions, clockwise from north, in degrees and in radians.
pub const DIRECTIONS: [[&str; 2]; 3] =
    [["heading_deg", "heading_rad"], ["course_deg", "course_rad"], ["bearing_deg", "bearing_rad"]];

/// Time on the client's clock, s.
pub const TIME: RangeInclusive<f64> = -TIME_MAX..=TIME_MAX;

/// State of the surface craft.
pub(crate) const ASC: [Range; 6] = [
    ("north_m", COORDINATE),
    ("east_m", COORDINATE),
    ("heading_rad", ANGLE),
    ("speed_mps", -5.0..=20.0),
    ("sway_mps", -5.0..=5.0),
    ("yaw_rate_radps", -3.0..=3.0),
];

/// Velocity of the surface craft over ground.
pub(crate) const ASC_GROUND: [Range; 2] =
    [("ground_north_mps", -25.0..=25.0), ("ground_east_mps", -25.0..=25.0)];

/// State of an AUV.
pub(crate) const AUV_STATE: [Range; 7] = [
    ("north_m", COORDINATE),
    ("east_m", COORDINATE),
    ("depth_m", DEPTH),
    ("course_rad", ANGLE),
    ("speed_mps", AUV_SPEED),
    ("turn_rate_radps", TURN_RATE),
    ("age_s", 0.0..=REPORT_AGE_MAX),
];

/// An element of a covariance, in m², m²/s or m²/s².
pub const COVARIANCE: RangeInclusive<f64> = -1.0e10..=1.0e10;

/// A report, whose position or range is given.
pub(crate) const REPORT: [Range; 4] = [
    ("north_m", COORDINATE),
    ("east_m", COORDINATE),
    ("range_m", REPORT_RANGE),
    ("sigma_m", REPORT_SIGMA_MIN..=REPORT_SIGMA_MAX),
];

/// Travel time of sound: 20 km and back, and a modem's longest delay; from cold fresh water to warm
/// brine.
pub(crate) const TRAVEL_TIME: [Range; 3] =
    [("time_s", 0.0..=90.0), ("reply_delay_s", 0.0..=60.0), ("sound_speed_mps", 1.35e3..=1.65e3)];

/// Telemetry of a vehicle.
pub(crate) const TELEMETRY: [Range; 4] =
    [("depth_m", DEPTH), ("course_rad", ANGLE), ("speed_mps", AUV_SPEED), ("turn_rate_radps", TURN_RATE)];

/// Speed along a path; slower vehicles do not follow one.
pub(crate) const PATH: [Range; 1] = [("speed_mps", 0.01..=10.0)];

/// A leg of a path.
pub(crate) const LEG: [Range; 2] = [("speed_mps", 0.01..=10.0), ("depth_m", 0.0..=DEPTH_MAX)];

/// A sawtooth. The least `depth_max_m` is the leg's least height below `depth_min_m`.
pub(crate) const DIVE: [Range; 4] = [
    // No vehicle flies.
    ("depth_min_m", 0.0..=DEPTH_MAX - LEG_HEIGHT_MIN),
    ("depth_max_m", LEG_HEIGHT_MIN..=DEPTH_MAX),
    // From the least slope of a dive to 80°, where a heading loses its meaning.
    ("pitch_rad", 0.05..=1.4),
    // Assumption: from the quickest pitch loop to a large glider's.
    ("reversal_s", 0.1..=120.0),
];

/// A goal that follows vehicles in turn.
pub(crate) const GOAL_IN_TURN: [Range; 2] = [("dwell_s", 1.0..=1.0e6), ("epoch_s", TIME)];

/// Slant range to stay within: the ranges of acoustic modems.
pub(crate) const GOAL_RANGE: [Range; 1] = [("range_m", 1.0..=2.0e4)];

/// A goal that visits vehicles.
pub(crate) const GOAL_VISIT: [Range; 2] = [("within_m", 1.0..=5.0e3), ("dwell_min_s", 0.0..=3600.0)];

/// A goal that localises vehicles.
pub(crate) const GOAL_LOCALISE: [Range; 5] = [
    ("growth_m2ps", 1.0e-6..=1.0e6),
    ("sigma_m", REPORT_SIGMA_MIN..=REPORT_SIGMA_MAX),
    ("sigma_rad", 0.0..=1.0),
    ("interval_s", 0.1..=3600.0),
    ("stand_off_m", 0.0..=OFFSET_MAX),
];

/// The figure of an earlier answer.
pub(crate) const FIGURE: [Range; 9] = [
    ("north_m", FORESEEN),
    ("east_m", FORESEEN),
    ("axis_rad", -2.0 * TAU..=2.0 * TAU),
    ("ahead_m", FORESEEN),
    ("starboard_m", FORESEEN),
    ("semi_ahead_m", 0.0..=COORDINATE_MAX),
    ("semi_starboard_m", 0.0..=COORDINATE_MAX),
    ("rate_radps", -20.0..=20.0),
    ("phase_rad", -2.0 * TAU..=2.0 * TAU),
];

/// Cost of an unserved vehicle. The bounds prevent overflow of costs that grow for years.
pub(crate) const VISIT_UNCERTAINTY: [Range; 4] = [
    ("growth_m2ps", 1.0e-6..=1.0e6),
    ("sigma_m", REPORT_SIGMA_MIN..=REPORT_SIGMA_MAX),
    ("sigma_rad", 0.0..=1.0),
    ("interval_s", 0.1..=3600.0),
];

/// The same for data.
pub(crate) const VISIT_DATA: [Range; 3] =
    [("growth_kbps", 0.0..=1.0e6), ("upload_kbps", 0.001..=1.0e6), ("range_max_m", ACOUSTIC_RANGE)];

/// Present cost of a vehicle, s, m² or kbit.
pub const VISIT_COST: RangeInclusive<f64> = 0.0..=1.0e12;

/// Cost in an earlier answer: grown since, and possibly a sum over vehicles.
pub(crate) const SCHEDULED_COST: RangeInclusive<f64> = 0.0..=1.0e24;

/// Most visits of a schedule in an answer.
pub const VISITS_MAX: usize = 32;

/// A visit of an earlier answer.
pub(crate) const VISIT: [Range; 6] = [
    ("arrive_s", -2.0 * TIME_MAX..=2.0 * TIME_MAX),
    ("leave_s", -2.0 * TIME_MAX..=2.0 * TIME_MAX),
    ("north_m", FORESEEN),
    ("east_m", FORESEEN),
    ("cost_before", SCHEDULED_COST),
    ("cost_after", SCHEDULED_COST),
];

/// A vehicle in the schedule of an earlier answer.
pub(crate) const SERVED_VEHICLE: [Range; 3] = [
    ("cost", SCHEDULED_COST),
    // The diagonal between the farthest places.
    ("heard_within_m", 0.0..=5.0 * COORDINATE_MAX),
    ("unheard_s", 0.0..=REPORT_AGE_MAX),
];

/// Weight of an AUV in a mean; only ratios count, and the sum cannot overflow.
pub const WEIGHT: RangeInclusive<f64> = 0.0..=1.0e6;

const OFFSET_BY: RangeInclusive<f64> = -OFFSET_MAX..=OFFSET_MAX;

/// An offset in fixed directions.
pub(crate) const OFFSET_NED: [Range; 2] = [("north_m", OFFSET_BY), ("east_m", OFFSET_BY)];

/// An offset that turns with the followed point.
pub(crate) const OFFSET_AHEAD: [Range; 2] = [("ahead_m", OFFSET_BY), ("starboard_m", OFFSET_BY)];

/// An offset by range and bearing.
pub(crate) const OFFSET_POLAR: [Range; 2] = [("range_m", 0.0..=OFFSET_MAX), ("bearing_rad", ANGLE)];

/// Largest speed reference, m/s. The lower bound depends on the slowest speed.
pub const SPEED_MAX_MOST: f64 = 20.0;

/// Limits of the operator, without the largest speed.
pub(crate) const LIMITS: [Range; 4] = [
    ("speed_min_mps", 0.0..=2.0),
    ("turn_rate_max_radps", 0.01..=3.0),
    ("acceleration_max_mps2", 0.001..=5.0),
    ("deceleration_max_mps2", 0.001..=5.0),
];

/// Limits that no snapshot checks alone: one depends on the slowest speed, one is the craft's.
pub const LIMITS_ALONE: [Range; 2] =
    [("speed_max_mps", 0.0..=SPEED_MAX_MOST), ("surge_lag_s", TIME_CONSTANT)];

/// Tuning by clients. Weights are at most ten times their default (acceleration a hundred times),
/// so the prices of limits exceed any goal's; that of position is positive, to follow a goal.
pub(crate) const TUNING: [Range; 7] = [
    ("position_weight_per_m2", 0.01..=10.0),
    ("velocity_weight_per_m2ps2", 0.0..=150.0),
    ("acceleration_weight_per_m2ps4", 0.0..=1.0e4),
    ("terminal_position_weight_per_m2", 0.0..=100.0),
    ("terminal_velocity_weight_per_m2ps2", 0.0..=1500.0),
    // At 10/J every preset craft stays where it is.
    ("energy_weight_per_j", 0.0..=10.0),
    ("scp_iterations", 1.0..=10.0),
];

/// An interval of the horizon, s.
pub const STEP: RangeInclusive<f64> = 0.1..=10.0;

/// Number of intervals: at most four times the default, and fewer than a trajectory's points.
pub const STEPS_COUNT: RangeInclusive<usize> = 2..=120;

/// The horizon, s: from the start of a slow heading loop's turn to the limit of any forecast.
pub(crate) const HORIZON: RangeInclusive<f64> = 5.0..=600.0;

/// Largest number of intervals times SCP iterations, which bounds the time: 5 × the default's.
pub(crate) const STEPS_TIMES_ITERATIONS_MOST: usize = 300;

/// Time constant of a loop, s: 0 follows at once; more than a minute is no closed loop.
pub const TIME_CONSTANT: RangeInclusive<f64> = 0.0..=60.0;

/// Integral time of a speed loop, s: the integrator then equals the proportional part.
pub const INTEGRAL_TIME: RangeInclusive<f64> = 0.5..=600.0;

const LOOP_DELAY: RangeInclusive<f64> = 0.0..=10.0;
const LOOP_ACCELERATION: RangeInclusive<f64> = 0.001..=10.0;
const POWER_COEFFICIENT: RangeInclusive<f64> = 0.0..=1.0e6;

/// A description of the craft, without its loops and power.
pub(crate) const CRAFT: [Range; 2] = [
    ("sway_per_yaw_rate_s", -5.0..=20.0),
    // From certain to about an order of magnitude.
    ("relative_uncertainty", 0.0..=2.0),
];

/// A heading loop.
pub(crate) const HEADING_LOOP: [Range; 5] = [
    ("time_constant_s", TIME_CONSTANT),
    ("natural_frequency_radps", 0.02..=20.0),
    ("damping", 0.1..=5.0),
    ("delay_s", LOOP_DELAY),
    ("rate_max_radps", 0.001..=3.0),
];

/// A speed loop.
pub(crate) const SURGE_LOOP: [Range; 5] = [
    ("time_constant_s", TIME_CONSTANT),
    ("delay_s", LOOP_DELAY),
    ("acceleration_max_mps2", LOOP_ACCELERATION),
    ("deceleration_max_mps2", LOOP_ACCELERATION),
    ("integral_time_s", INTEGRAL_TIME),
];

/// Propulsion power.
pub(crate) const POWER: [Range; 2] =
    [("linear_w_per_mps", POWER_COEFFICIENT), ("cubic_w_per_mps3", POWER_COEFFICIENT)];

/// A current, and a drift.
pub(crate) const CURRENT: [Range; 2] = [("north_mps", CURRENT_SPEED), ("east_mps", CURRENT_SPEED)];

/// A disc to keep out of.
pub(crate) const KEEP_OUT: [Range; 3] =
    [("north_m", COORDINATE), ("east_m", COORDINATE), ("radius_m", KEEP_OUT_RADIUS)];

/// Another vessel, as far as it is known.
pub(crate) const VESSEL: [Range; 8] = [
    ("t_s", TIME),
    ("north_m", COORDINATE),
    ("east_m", COORDINATE),
    ("course_rad", ANGLE),
    ("speed_mps", 0.0..=60.0),
    ("heading_rad", ANGLE),
    ("length_m", 1.0..=500.0),
    ("sigma_m", 0.0..=1.0e4),
];

/// A point of a vessel's plan.
pub(crate) const VESSEL_PLAN: [Range; 3] =
    [("0", -2.0 * TIME_MAX..=2.0 * TIME_MAX), ("1", FORESEEN), ("2", FORESEEN)];

/// The averaged velocity of a vessel in an earlier answer.
pub(crate) const PAST_VESSEL: [Range; 4] =
    [("t_s", TIME), ("north_mps", -60.0..=60.0), ("east_mps", -60.0..=60.0), ("count", 1.0..=1.0e6)];

/// The manoeuvre of an earlier answer.
pub(crate) const MANOEUVRE: [Range; 3] =
    [("heading_rad", ANGLE), ("speed_mps", 0.0..=40.0), ("until_s", -2.0 * TIME_MAX..=2.0 * TIME_MAX)];

/// A point of an earlier trajectory.
pub(crate) const TRAJECTORY_POINT: [Range; 5] = [
    // Forecast points are later than now.
    ("t_s", -2.0 * TIME_MAX..=2.0 * TIME_MAX),
    ("north_m", FORESEEN),
    ("east_m", FORESEEN),
    // A craft at 40 m/s with the largest declared sideslip in its fastest turn.
    ("speed_mps", 0.0..=2.0e3),
    ("heading_rad", ANGLE),
];

/// Estimate of an AUV in an earlier answer.
pub(crate) const PREVIOUS_ESTIMATE: [Range; 7] = [
    ("age_s", 0.0..=REPORT_AGE_MAX),
    ("north_m", FORESEEN),
    ("east_m", FORESEEN),
    ("depth_m", DEPTH),
    ("north_mps", -20.0..=20.0),
    ("east_mps", -20.0..=20.0),
    ("turn_rate_radps", TURN_RATE),
];

/// The reference of an earlier answer.
pub(crate) const PREVIOUS_REFERENCE: [Range; 2] = [("speed_mps", 0.0..=40.0), ("heading_rad", ANGLE)];

/// Requested reference in an earlier answer.
pub(crate) const PREVIOUS_ASKED: [Range; 2] = [("asked_speed_mps", 0.0..=40.0), ("asked_heading_rad", ANGLE)];

/// Ranges of numbers by the name of their shape in `/openapi.json`. A shape may occur twice.
pub fn ranges_by_shape() -> impl Iterator<Item = (&'static str, Range)> {
    let tables: [(&str, &'static [Range]); 41] = [
        (
            "PlanRequest",
            &[
                ("t_s", TIME),
                ("surfacing_separation_m", SURFACING_SEPARATION),
                ("vessel_separation_m", VESSEL_SEPARATION),
            ],
        ),
        (
            "Live",
            &[
                ("surfacing_separation_m", SURFACING_SEPARATION),
                ("vessel_separation_m", VESSEL_SEPARATION),
                ("hand_over_s", HAND_OVER),
            ],
        ),
        ("Asc", &ASC),
        ("Asc", &ASC_GROUND),
        ("AuvState", &AUV_STATE),
        ("Report", &REPORT),
        ("Report", &TELEMETRY),
        ("Path", &PATH),
        ("Leg", &LEG),
        ("Dive", &DIVE),
        ("Goal", &GOAL_IN_TURN),
        ("Goal", &GOAL_RANGE),
        ("Goal", &GOAL_VISIT),
        ("Goal", &GOAL_LOCALISE),
        ("Figure", &FIGURE),
        ("VisitCost", &VISIT_UNCERTAINTY),
        ("VisitCost", &VISIT_DATA),
        ("Visit", &VISIT),
        ("ServedVehicle", &SERVED_VEHICLE),
        ("Offset", &OFFSET_NED),
        ("Offset", &OFFSET_AHEAD),
        ("Offset", &OFFSET_POLAR),
        ("Limits", &LIMITS),
        ("Tuning", &TUNING),
        ("Craft", &CRAFT),
        ("HeadingLoop", &HEADING_LOOP),
        ("SurgeLoop", &SURGE_LOOP),
        ("Power", &POWER),
        ("KeepOut", &KEEP_OUT),
        ("Vessel", &VESSEL),
        ("Manoeuvre", &MANOEUVRE),
        ("PastVessel", &PAST_VESSEL),
        ("TravelTime", &TRAVEL_TIME),
        ("Acoustics", &[("range_max_m", ACOUSTIC_RANGE)]),
        ("Current", &CURRENT),
        ("Drift", &CURRENT),
        ("TrajectoryPoint", &TRAJECTORY_POINT),
        ("PreviousPlan", &[("goal_course_rad", ANGLE)]),
        ("PreviousEstimate", &PREVIOUS_ESTIMATE),
        ("PreviousReference", &PREVIOUS_REFERENCE),
        ("PreviousCraft", &PREVIOUS_ASKED),
    ];
    let of = |(shape, ranges): (&'static str, &'static [Range])| {
        ranges.iter().cloned().map(move |range| (shape, range))
    };
    tables.into_iter().flat_map(of)
}
