//! The one place where an observation is checked, field by field, and becomes a snapshot.

mod evidence;

use std::{
    collections::{BTreeMap, HashSet},
    fmt,
    ops::RangeInclusive,
};

use nalgebra::Vector2;

use crate::{
    facts::{
        asc::{AscState, Limits},
        auv::{Auv, Dive, VehicleId},
        bounds::{bounds_faults, separation_fault},
        goal::{Goal, Offset},
        invalid_field::{InvalidField, InvalidReason},
        known_path::KnownPath,
        path::segment::InvalidPath,
        ranges::{
            AUVS_MAX, COORDINATE_MAX, CURRENT_MAX, ID_LENGTH_MAX, LEG_HEIGHT_MIN, OFFSET_MAX, REPORT_AGE_MAX,
            TIME_MAX, TRAJECTORY_POINTS_MAX,
        },
        reference::{PreviousTarget, Reference, TrajectoryPoint},
    },
    snapshot::observation::{Observation, PreviousPlan},
};

/// Largest coordinate of an earlier answer, m: it foresees what leaves the area that is accepted, and so may a filter.
const FORESEEN_MAX: f64 = 2.0 * COORDINATE_MAX;

/// Largest speed of an earlier answer, m/s: that of a craft that was taken to go at 40 m/s and drifts in its fastest turn as
/// much as may be declared.
const FORESEEN_SPEED_MAX: f64 = 2.0e3;

/// Largest time of an earlier answer, s: it foresees what comes after now.
const FORESEEN_TIME_MAX: f64 = 2.0 * TIME_MAX;

/// Slowest speed along a path, m/s: what is slower does not follow one.
const PATH_SPEED_MIN: f64 = 0.01;

/// Shallowest depth at which a climb can end, m: no vehicle flies.
const DEPTH_MIN: f64 = 0.0;

/// Deepest depth, m: of the oceans.
const DEPTH_MAX: f64 = 12_000.0;

/// Pitch of the legs of a sawtooth, rad: from what is still no level flight to 80°, where a heading ends.
const DIVE_PITCH: RangeInclusive<f64> = 0.05..=1.4;

/// Time that a reversal takes, s. Assumption: from the quickest pitch loop to a large glider's.
const REVERSAL: RangeInclusive<f64> = 0.1..=120.0;

/// Shortest and longest slant range to stay within, m: what an acoustic modem may be reference for.
const RADIUS_MIN: f64 = 1.0;

const RADIUS_MAX: f64 = 2.0e4;

/// Largest weight of an AUV in a mean: only ratios count, and the sum must not overflow.
const WEIGHT_MAX: f64 = 1.0e6;

/// Every reason why an observation is no snapshot, in the order of its fields.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct InvalidObservation(pub Vec<InvalidField>);

/// Everything that is wrong with `observation`, in the order of its fields.
pub(crate) fn faults(observation: &Observation) -> Vec<InvalidField> {
    let mut check = Check::default();
    check.within(format_args!("t_s"), observation.time, -TIME_MAX..=TIME_MAX);
    check.asc(&observation.asc);
    check.auvs(&observation.auvs, observation.time);
    check.goal(&observation.goal, &observation.auvs);
    if let Some(offset) = &observation.offset {
        check.offset(offset, observation);
    }
    if let Some(current) = &observation.current {
        check.current("current", current);
    }
    check.limits(&observation.limits);
    let (keep_outs, area) = (&observation.keep_outs, &observation.area);
    check
        .invalid
        .extend(bounds_faults(keep_outs, area, observation.range_max));
    check
        .invalid
        .extend(separation_fault(observation.surfacing_separation));
    if let Some(previous) = &observation.previous_plan {
        check.trajectory(&previous.trajectory);
        check.previous_targets(&previous.targets);
        if let Some(course) = previous.goal_course {
            let angle = -std::f64::consts::PI..=std::f64::consts::PI;
            check.within(
                format_args!("previous_plan/goal_course_rad"),
                course.radians(),
                angle,
            );
        }
        if let Some(current) = &previous.current {
            check.current("previous_plan/current", current);
        }
        check.previous_references(previous);
    }
    check.invalid.extend(observation.craft.faults());
    check.invalid
}

#[derive(Default)]
pub(crate) struct Check {
    pub(crate) invalid: Vec<InvalidField>,
}

impl Check {
    pub(crate) fn fail(&mut self, field: fmt::Arguments<'_>, reason: InvalidReason) {
        self.invalid.push(InvalidField {
            field: field.to_string(),
            reason,
        });
    }

    pub(crate) fn within(&mut self, field: fmt::Arguments<'_>, given: f64, range: RangeInclusive<f64>) {
        if !range.contains(&given) {
            let (least, most) = range.into_inner();
            self.fail(field, InvalidReason::OutOfRange { given, least, most });
        }
    }

    pub(crate) fn length(&mut self, field: fmt::Arguments<'_>, given: usize, range: RangeInclusive<usize>) {
        if !range.contains(&given) {
            let (least, most) = range.into_inner();
            self.fail(field, InvalidReason::Length { given, least, most });
        }
    }

    fn asc(&mut self, asc: &AscState) {
        self.within(
            format_args!("asc/north_m"),
            asc.position.x,
            -COORDINATE_MAX..=COORDINATE_MAX,
        );
        self.within(
            format_args!("asc/east_m"),
            asc.position.y,
            -COORDINATE_MAX..=COORDINATE_MAX,
        );
        self.within(format_args!("asc/speed_mps"), asc.surge, -5.0..=20.0);
        self.within(format_args!("asc/sway_mps"), asc.sway, -5.0..=5.0);
        self.within(format_args!("asc/yaw_rate_radps"), asc.yaw_rate, -3.0..=3.0);
        if let Some(ground) = &asc.ground_velocity {
            self.within(format_args!("asc/ground_north_mps"), ground.x, -25.0..=25.0);
            self.within(format_args!("asc/ground_east_mps"), ground.y, -25.0..=25.0);
        }
        // Heading wraps whatever finite angle it is given; NaN and ∞ survive the wrap as NaN.
        self.within(
            format_args!("asc/heading_rad"),
            asc.heading.radians(),
            -std::f64::consts::PI..=std::f64::consts::PI,
        );
    }

    fn auvs(&mut self, auvs: &[Auv], now: f64) {
        self.length(format_args!("auvs"), auvs.len(), 1..=AUVS_MAX);
        let mut seen = HashSet::new();
        for (i, auv) in auvs.iter().enumerate() {
            self.length(format_args!("auvs/{i}/id"), auv.id.0.len(), 1..=ID_LENGTH_MAX);
            if auv.id.0.chars().any(char::is_control) {
                let given = auv.id.0.clone();
                self.fail(
                    format_args!("auvs/{i}/id"),
                    InvalidReason::ControlCharacter { given },
                );
            }
            if !seen.insert(&auv.id) {
                let given = auv.id.0.clone();
                self.fail(format_args!("auvs/{i}/id"), InvalidReason::Duplicate { given });
            }
            self.evidence(i, &auv.evidence, now);
            if let Some(known) = &auv.path {
                self.path(i, known);
            }
            if let Some(dive) = &auv.dive {
                self.dive(i, dive);
            }
        }
    }

    /// A path put together from lengths and angles has not been checked before.
    fn path(&mut self, auv: usize, known: &KnownPath) {
        if let Err(InvalidPath(InvalidField { field, reason })) = known.path.check() {
            self.fail(format_args!("auvs/{auv}/path/{field}"), reason);
        }
        let speed = format_args!("auvs/{auv}/path/speed_mps");
        self.within(speed, known.horizontal_speed, PATH_SPEED_MIN..=10.0);
    }

    fn dive(&mut self, auv: usize, dive: &Dive) {
        let depth_min = DEPTH_MIN..=DEPTH_MAX - LEG_HEIGHT_MIN;
        // Where the other depth is none, this one's range is still to be named.
        let least_depth = if depth_min.contains(&dive.depth_min) {
            dive.depth_min + LEG_HEIGHT_MIN
        } else {
            LEG_HEIGHT_MIN
        };
        for (name, value, range) in [
            ("depth_min_m", dive.depth_min, depth_min),
            ("depth_max_m", dive.depth_max, least_depth..=DEPTH_MAX),
            ("pitch_rad", dive.pitch, DIVE_PITCH),
            ("reversal_s", dive.reversal, REVERSAL),
        ] {
            self.within(format_args!("auvs/{auv}/dive/{name}"), value, range);
        }
    }

    fn goal(&mut self, goal: &Goal, auvs: &[Auv]) {
        match goal {
            Goal::Track { auv } => self.vehicle(format_args!("goal/auv"), auv, auvs),
            Goal::Intermittent {
                auvs: named,
                dwell,
                epoch,
            } => {
                self.vehicles(named, auvs);
                self.within(format_args!("goal/dwell_s"), *dwell, 1.0..=1.0e6);
                self.within(format_args!("goal/epoch_s"), *epoch, -TIME_MAX..=TIME_MAX);
            }
            Goal::Midpoint { auvs: named } => self.vehicles(named, auvs),
            Goal::Weighted { weights } => self.weights(weights, auvs),
            Goal::Range { auvs: named, radius } => {
                self.vehicles(named, auvs);
                self.within(format_args!("goal/range_m"), *radius, RADIUS_MIN..=RADIUS_MAX);
            }
        }
    }

    fn weights(&mut self, weights: &BTreeMap<VehicleId, f64>, auvs: &[Auv]) {
        self.length(format_args!("goal/weights"), weights.len(), 1..=AUVS_MAX);
        for (id, weight) in weights {
            // The field is a JSON pointer (RFC 6901), and a name may hold what separates its parts.
            let name = id.0.replace('~', "~0").replace('/', "~1");
            self.vehicle(format_args!("goal/weights/{name}"), id, auvs);
            self.within(format_args!("goal/weights/{name}"), *weight, 0.0..=WEIGHT_MAX);
        }
        if weights.values().all(|weight| *weight == 0.0) {
            self.fail(format_args!("goal/weights"), InvalidReason::AllZero);
        }
    }

    fn offset(&mut self, offset: &Offset, observation: &Observation) {
        let (names, offset_by) = match offset {
            Offset::Ned(by) => (["north_m", "east_m"], by),
            Offset::Target(by) | Offset::Path(by) => (["ahead_m", "starboard_m"], by),
        };
        for (name, value) in names.into_iter().zip(offset_by.iter()) {
            let field = format_args!("goal/offset/{name}");
            self.within(field, *value, -OFFSET_MAX..=OFFSET_MAX);
        }
        if !matches!(offset, Offset::Path(_)) {
            return;
        }
        let field = format_args!("goal/offset/frame");
        match &observation.goal {
            Goal::Track { .. } | Goal::Intermittent { .. } => {
                for auv in observation.goal.vehicles().filter_map(|id| observation.auv(id)) {
                    if auv.path.is_none() {
                        let given = Some(auv.id.0.clone());
                        self.fail(field, InvalidReason::NoPath { given });
                    }
                }
            }
            Goal::Midpoint { .. } | Goal::Weighted { .. } | Goal::Range { .. } => {
                self.fail(field, InvalidReason::NoPath { given: None });
            }
        }
    }

    fn vehicles(&mut self, named: &[VehicleId], auvs: &[Auv]) {
        self.length(format_args!("goal/auvs"), named.len(), 1..=AUVS_MAX);
        let mut seen = HashSet::new();
        for (i, id) in named.iter().enumerate() {
            self.vehicle(format_args!("goal/auvs/{i}"), id, auvs);
            if !seen.insert(id) {
                let given = id.0.clone();
                self.fail(format_args!("goal/auvs/{i}"), InvalidReason::Duplicate { given });
            }
        }
    }

    fn vehicle(&mut self, field: fmt::Arguments<'_>, id: &VehicleId, auvs: &[Auv]) {
        if !auvs.iter().any(|auv| auv.id == *id) {
            self.fail(field, InvalidReason::UnknownVehicle { given: id.0.clone() });
        }
    }

    fn current(&mut self, field: &str, current: &Vector2<f64>) {
        for (axis, speed) in [("north_mps", current.x), ("east_mps", current.y)] {
            self.within(format_args!("{field}/{axis}"), speed, -CURRENT_MAX..=CURRENT_MAX);
        }
    }

    /// The previous reference and the command made of it; where they are equal, the JSON has only the latter.
    fn previous_references(&mut self, previous: &PreviousPlan) {
        let (reference, command) = (previous.reference, previous.command);
        let apart = previous.craft.is_some() || command.is_some() && command != reference;
        if let Some(reference) = reference.filter(|_| apart) {
            let names = ["asked_speed_mps", "asked_heading_rad"];
            self.reference("previous_plan/craft_estimate", names, &reference);
        }
        if let Some(command) = if apart { command } else { reference } {
            self.reference("previous_plan/reference", ["speed_mps", "heading_rad"], &command);
        }
    }

    fn reference(&mut self, field: &str, [speed, heading]: [&str; 2], reference: &Reference) {
        self.within(format_args!("{field}/{speed}"), reference.speed, 0.0..=40.0);
        let angle = -std::f64::consts::PI..=std::f64::consts::PI;
        self.within(
            format_args!("{field}/{heading}"),
            reference.heading.radians(),
            angle,
        );
    }

    fn limits(&mut self, limits: &Limits) {
        self.within(format_args!("limits/speed_min_mps"), limits.speed_min, 0.0..=2.0);
        // The least gap keeps the speed cone and the forward half-plane from closing on each other.
        let least_top_speed = if limits.speed_min.is_finite() {
            limits.speed_min + 0.05
        } else {
            0.05
        };
        self.within(
            format_args!("limits/speed_max_mps"),
            limits.speed_max,
            least_top_speed..=20.0,
        );
        self.within(
            format_args!("limits/turn_rate_max_radps"),
            limits.turn_rate_max,
            0.01..=3.0,
        );
        self.within(
            format_args!("limits/acceleration_max_mps2"),
            limits.acceleration_max,
            0.001..=5.0,
        );
        self.within(
            format_args!("limits/deceleration_max_mps2"),
            limits.deceleration_max,
            0.001..=5.0,
        );
    }

    fn trajectory(&mut self, points: &[TrajectoryPoint]) {
        let field = "previous_plan/trajectory";
        self.length(format_args!("{field}"), points.len(), 0..=TRAJECTORY_POINTS_MAX);
        for (i, point) in points.iter().enumerate() {
            let angle = -std::f64::consts::PI..=std::f64::consts::PI;
            for (name, value, range) in [
                ("t_s", point.time, -FORESEEN_TIME_MAX..=FORESEEN_TIME_MAX),
                ("north_m", point.position.x, -FORESEEN_MAX..=FORESEEN_MAX),
                ("east_m", point.position.y, -FORESEEN_MAX..=FORESEEN_MAX),
                ("speed_mps", point.speed, 0.0..=FORESEEN_SPEED_MAX),
                ("heading_rad", point.heading.radians(), angle),
            ] {
                self.within(format_args!("{field}/{i}/{name}"), value, range);
            }
        }
        for (i, pair) in points.windows(2).enumerate() {
            let [before, after] = pair else { continue };
            if after.time <= before.time {
                let reason = InvalidReason::NotIncreasing {
                    given: after.time,
                    before: before.time,
                };
                self.fail(format_args!("{field}/{}/t_s", i + 1), reason);
            }
        }
    }

    fn previous_targets(&mut self, targets: &[PreviousTarget]) {
        let field = "previous_plan/targets";
        self.length(format_args!("{field}"), targets.len(), 0..=AUVS_MAX);
        for (i, target) in targets.iter().enumerate() {
            for (name, value, range) in [
                ("age_s", target.report_age, 0.0..=REPORT_AGE_MAX),
                ("north_m", target.position.x, -FORESEEN_MAX..=FORESEEN_MAX),
                ("east_m", target.position.y, -FORESEEN_MAX..=FORESEEN_MAX),
                ("depth_m", target.depth, -10.0..=DEPTH_MAX),
                ("north_mps", target.velocity.x, -20.0..=20.0),
                ("east_mps", target.velocity.y, -20.0..=20.0),
                ("turn_rate_radps", target.turn_rate, -1.0..=1.0),
            ] {
                self.within(format_args!("{field}/{i}/estimate/{name}"), value, range);
            }
            self.current(&format!("{field}/{i}/drift"), &target.drift);
        }
    }
}
