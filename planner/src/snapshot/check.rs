//! The checks of a request, field by field.

mod evidence;
mod localise;
mod traffic;
mod visit;

use std::collections::{BTreeMap, HashSet};
use std::fmt;
use std::ops::RangeInclusive;

use nalgebra::Vector2;

use crate::coast::shape::shape_faults;
use crate::craft::description::CraftDescription;
use crate::facts::asc::{Asc, DeclaredLimits, Limits};
use crate::facts::auv::{Auv, Dive, VehicleId};
use crate::facts::bounds::{bounds_faults, separation_fault};
use crate::facts::evidence::Report;
use crate::facts::field_error::{FieldError, pointer_token};
use crate::facts::goal::{Goal, Names, Offset, Task};
use crate::facts::known_path::{DeclaredPath, KnownPath};
use crate::facts::no_go::{NoGo, no_go_lengths, no_go_numbers};
use crate::facts::previous_plan::{PreviousPlan, PreviousTarget};
use crate::facts::ranges::{
    ANGLE, AREA_CORNERS, ASC, ASC_GROUND, AUVS_MAX, CURRENT, DIVE, FIGURE_ROWS_MAX, ID_LENGTH_MAX,
    KEEP_OUTS_MAX, LEG_HEIGHT_MIN, LIMITS, LIMITS_ALONE, PATH, PREVIOUS_ASKED, PREVIOUS_ESTIMATE,
    PREVIOUS_REFERENCE, REPORTS_MAX, Range, SPEED_MAX_MOST, TIME, TRAJECTORY_POINT, TRAJECTORY_POINTS_MAX,
    VESSELS_MAX, VISITS_MAX, WEIGHT,
};
use crate::facts::reference::TrajectoryPoint;
use crate::facts::water::{Current, Drift};
use crate::path::SEGMENTS_MAX;
use crate::snapshot::request::PlanRequest;

/// All faults of a request, in the order of its fields.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct InvalidRequest(pub Vec<FieldError>);

impl PlanRequest {
    /// Checks all fields; estimates nothing.
    ///
    /// # Errors
    /// All faults in order. A list that is too long is alone: names are compared with each other.
    pub fn check(&self) -> Result<(), InvalidRequest> {
        self.known_paths().map(drop)
    }

    /// The known path of each AUV, if the request has no fault.
    pub(crate) fn known_paths(&self) -> Result<Vec<Option<KnownPath>>, InvalidRequest> {
        let mut check = Check::default();
        check.lengths(self);
        if !check.invalid.is_empty() {
            return Err(InvalidRequest(check.invalid));
        }
        let paths = check.members(self);
        if check.invalid.is_empty() { Ok(paths) } else { Err(InvalidRequest(check.invalid)) }
    }
}

/// The faults that `check` finds.
fn found(check: impl FnOnce(&mut Check)) -> Vec<FieldError> {
    let mut found = Check::default();
    check(&mut found);
    found.invalid
}

impl Report {
    /// Its faults at time `now`, s, by member within `field`.
    pub fn faults(&self, field: &str, now: f64) -> Vec<FieldError> {
        found(|check| check.report(field, self, now))
    }
}

impl Asc {
    /// Its faults, by member within `field`.
    pub fn faults(&self, field: &str) -> Vec<FieldError> {
        found(|check| check.asc(field, self))
    }
}

impl Task {
    /// Its faults as the goal of a request with these `auvs`, by member within `goal`.
    pub fn faults(&self, auvs: &[Auv]) -> Vec<FieldError> {
        found(|check| {
            check.goal_length(&self.goal);
            check.goal(self, auvs);
        })
    }
}

impl VehicleId {
    /// The faults of the name at `place`.
    pub(crate) fn faults(&self, place: &str) -> Vec<FieldError> {
        found(|check| check.name(place, self))
    }
}

impl Current {
    /// Its faults, by member within `field`.
    pub fn faults(&self, field: &str) -> Vec<FieldError> {
        found(|check| check.current(field, self))
    }
}

/// The faults of `no_go`, by field; shapes are looked at once the numbers are in their ranges.
pub fn no_go_faults(no_go: &[NoGo]) -> Vec<FieldError> {
    let mut faults = no_go_lengths(no_go);
    for check in [no_go_numbers, shape_faults] {
        if faults.is_empty() {
            faults = check(no_go);
        }
    }
    faults
}

#[derive(Default)]
pub(crate) struct Check {
    pub(crate) invalid: Vec<FieldError>,
}

impl Check {
    pub(crate) fn fail(&mut self, place: fmt::Arguments<'_>, code: &str, detail: &str) {
        self.invalid.push(FieldError::new(place, code, detail));
    }

    /// The given name is the fault.
    pub(crate) fn fail_name(&mut self, place: fmt::Arguments<'_>, code: &str, detail: &str, id: &VehicleId) {
        self.invalid.push(FieldError::new(place, code, detail).given(&*id.0));
    }

    pub(crate) fn within(&mut self, place: fmt::Arguments<'_>, given: f64, range: &RangeInclusive<f64>) {
        self.invalid.extend(FieldError::outside(place, given, range));
    }

    pub(crate) fn length(&mut self, place: fmt::Arguments<'_>, given: usize, range: &RangeInclusive<usize>) {
        self.invalid.extend(FieldError::of_length(place, given, range, "items"));
    }

    fn lengths(&mut self, request: &PlanRequest) {
        self.length(format_args!("/auvs"), request.auvs.len(), &(1..=AUVS_MAX));
        for (i, auv) in request.auvs.iter().enumerate() {
            if let Some(reports) = &auv.reports {
                self.length(format_args!("/auvs/{i}/reports"), reports.len(), &(1..=REPORTS_MAX));
            }
            if let Some(path) = &auv.path {
                let place = format_args!("/auvs/{i}/path/segments");
                self.length(place, path.count(), &(1..=SEGMENTS_MAX));
            }
        }
        self.goal_length(&request.goal.goal);
        self.length(format_args!("/keep_outs"), request.keep_outs.len(), &(0..=KEEP_OUTS_MAX));
        self.length(format_args!("/traffic"), request.traffic.len(), &(0..=VESSELS_MAX));
        self.invalid.extend(no_go_lengths(&request.no_go));
        if !request.area.is_empty() {
            self.length(format_args!("/area"), request.area.len(), &AREA_CORNERS);
        }
        if let Some(previous) = &request.previous_plan {
            let n_targets = previous.targets.iter().flatten().count();
            let mut at_most = |most: usize, list: &str, n: usize| {
                self.length(format_args!("/previous_plan/{list}"), n, &(0..=most));
            };
            at_most(TRAJECTORY_POINTS_MAX, "trajectory", previous.trajectory.len());
            at_most(AUVS_MAX, "targets", n_targets);
            if let Some(schedule) = &previous.schedule {
                at_most(VISITS_MAX, "schedule/visits", schedule.visits.len());
                at_most(AUVS_MAX, "schedule/costs", schedule.costs.len());
            }
            if let Some(avoidance) = &previous.avoidance {
                at_most(VESSELS_MAX, "avoidance/encounters", avoidance.encounters.len());
                at_most(VESSELS_MAX, "avoidance/vessels", avoidance.vessels.len());
            }
            if let Some(figure) = &previous.figure {
                at_most(AUVS_MAX, "figure/vehicles", figure.vehicles.len());
                for (i, vehicle) in figure.vehicles.iter().enumerate() {
                    let place = format!("figure/vehicles/{i}/over_time");
                    at_most(FIGURE_ROWS_MAX, &place, vehicle.over_time.len());
                }
            }
        }
    }

    fn goal_length(&mut self, goal: &Goal) {
        let (place, n) = match goal.names() {
            Names::One(_) => return,
            Names::List(auvs) => ("/goal/auvs", auvs.len()),
            Names::Weights(weights) => ("/goal/weights", weights.len()),
        };
        self.length(format_args!("{place}"), n, &(1..=AUVS_MAX));
    }

    /// Checks everything but the lengths of lists.
    fn members(&mut self, request: &PlanRequest) -> Vec<Option<KnownPath>> {
        self.within(format_args!("/t_s"), request.t_s, &TIME);
        self.asc("/asc", &request.asc);
        let paths = self.auvs(&request.auvs, request.t_s);
        self.goal(&request.goal, &request.auvs);
        if let Some(current) = &request.current {
            self.current("/current", current);
        }
        if let Some(limits) = &request.limits {
            self.limits(limits);
        }
        let area: Vec<_> = request.area.iter().copied().map(Vector2::from).collect();
        let bounds = bounds_faults(&request.keep_outs, &area, request.range_max());
        self.invalid.extend(bounds);
        self.invalid.extend(no_go_faults(&request.no_go));
        self.invalid.extend(separation_fault(request.surfacing_separation_m));
        self.traffic(&request.traffic, request.vessel_separation_m);
        if let Some(tuning) = &request.tuning {
            self.invalid.extend(tuning.faults("/tuning"));
        }
        if let Some(previous) = &request.previous_plan {
            self.previous_plan(previous);
        }
        self.invalid.extend(request.craft.iter().flat_map(CraftDescription::faults));
        paths
    }

    /// Checks each of `values` against its range.
    pub(crate) fn numbers<const N: usize>(&mut self, field: &str, ranges: &[Range; N], values: [f64; N]) {
        self.given(field, ranges, values.map(Some));
    }

    /// Checks each of the given `values` against its range.
    pub(crate) fn given<const N: usize>(
        &mut self,
        field: &str,
        ranges: &[Range; N],
        values: [Option<f64>; N],
    ) {
        for ((name, range), value) in ranges.iter().zip(values) {
            if let Some(value) = value {
                self.within(format_args!("{field}/{name}"), value, range);
            }
        }
    }

    /// Checks each number of a kind against its range, as it maps it, by member within `field`.
    pub(crate) fn each_within(
        &mut self,
        field: &str,
    ) -> impl FnMut(&str, &RangeInclusive<f64>, Option<&f64>) -> Option<f64> {
        move |place, range, given| {
            let (_, member) = place.rsplit_once('.').unwrap_or_default();
            self.within(format_args!("{field}/{member}"), *given?, range);
            given.copied()
        }
    }

    fn asc(&mut self, field: &str, asc: &Asc) {
        let values =
            [asc.north_m, asc.east_m, asc.heading_rad, asc.speed_mps, asc.sway_mps, asc.yaw_rate_radps];
        self.numbers(field, &ASC, values);
        let ground = [asc.ground_north_mps, asc.ground_east_mps];
        let n_given = ground.iter().flatten().count();
        for ((name, range), value) in ASC_GROUND.iter().zip(ground) {
            let place = format_args!("{field}/{name}");
            match value {
                Some(value) => self.within(place, value, range),
                None if n_given == 1 => {
                    let detail = "give both components of the ground velocity, or neither";
                    self.fail(place, "missing", detail);
                }
                None => {}
            }
        }
    }

    fn auvs(&mut self, auvs: &[Auv], now: f64) -> Vec<Option<KnownPath>> {
        let mut paths = Vec::with_capacity(auvs.len());
        let mut seen = HashSet::new();
        for (i, auv) in auvs.iter().enumerate() {
            self.name(&format!("/auvs/{i}/id"), &auv.id);
            if !seen.insert(&auv.id) {
                self.fail_name(format_args!("/auvs/{i}/id"), "duplicate", "duplicate name", &auv.id);
            }
            self.evidence(i, auv, now);
            paths.push(auv.path.as_ref().and_then(|path| self.path(i, path)));
            if let Some(dive) = &auv.dive {
                self.dive(i, dive);
            }
        }
        paths
    }

    fn name(&mut self, place: &str, id: &VehicleId) {
        let too_long = FieldError::of_length(place, id.0.len(), &(1..=ID_LENGTH_MAX), "bytes");
        self.invalid.extend(too_long);
        if id.0.chars().any(char::is_control) {
            let detail = "a name has no control characters";
            self.fail_name(format_args!("{place}"), "control_character", detail, id);
        }
    }

    /// The path, if its segments join.
    fn path(&mut self, auv: usize, path: &DeclaredPath) -> Option<KnownPath> {
        let place = format!("/auvs/{auv}/path");
        self.numbers(&place, &PATH, [path.speed_mps]);
        let known = path.known().map_err(|fault| self.invalid.push(fault.within(&place)));
        known.ok()
    }

    fn dive(&mut self, auv: usize, dive: &Dive) {
        let mut ranges = DIVE;
        // If the other depth is invalid, this one keeps its full range.
        if ranges[0].1.contains(&dive.depth_min_m) {
            ranges[1].1 = dive.depth_min_m + LEG_HEIGHT_MIN..=*DIVE[1].1.end();
        }
        let values = [dive.depth_min_m, dive.depth_max_m, dive.pitch_rad, dive.reversal()];
        self.numbers(&format!("/auvs/{auv}/dive"), &ranges, values);
    }

    fn goal(&mut self, task: &Task, auvs: &[Auv]) {
        match task.goal.names() {
            Names::One(auv) => self.vehicle(format_args!("/goal/auv"), auv, auvs),
            Names::List(named) => self.vehicles(named, auvs),
            Names::Weights(weights) => self.weights(weights, auvs),
        }
        match &task.goal {
            // Checked with the names.
            Goal::Weighted { .. } => {}
            Goal::Localise(localise) => self.localise(localise),
            Goal::Visit(visits) => self.visits(visits),
            goal => drop(goal.map(&mut self.each_within("/goal"))),
        }
        if let (Goal::Localise(_), Some(_)) = (&task.goal, &task.offset) {
            let detail = "a goal that localises chooses the craft's place itself";
            self.fail(format_args!("/goal/offset"), "unexpected", detail);
        } else if let Some(offset) = &task.offset {
            self.offset(offset, &task.goal, auvs);
        }
    }

    fn weights(&mut self, weights: &BTreeMap<VehicleId, f64>, auvs: &[Auv]) {
        for (id, weight) in weights {
            let name = pointer_token(&id.0);
            self.vehicle(format_args!("/goal/weights/{name}"), id, auvs);
            self.within(format_args!("/goal/weights/{name}"), *weight, &WEIGHT);
        }
        if weights.values().all(|weight| *weight == 0.0) {
            self.no_weight();
        }
    }

    fn no_weight(&mut self) {
        self.fail(format_args!("/goal/weights"), "all_zero", "at least one weight must be above 0");
    }

    fn offset(&mut self, offset: &Offset, goal: &Goal, auvs: &[Auv]) {
        let _ = offset.map(&mut self.each_within("/goal/offset"));
        if !matches!(offset, Offset::Path { .. }) {
            return;
        }
        let place = format_args!("/goal/offset/frame");
        if !goal.follows_one() {
            let detail = "an offset along a path needs a goal that follows one vehicle at a time";
            return self.fail(place, "no_path", detail);
        }
        let named = |id: &VehicleId| auvs.iter().find(|auv| auv.id == *id);
        for auv in goal.vehicles().filter_map(named).filter(|auv| auv.path.is_none()) {
            self.fail_name(place, "no_path", "this vehicle has no `path`", &auv.id);
        }
    }

    fn vehicles(&mut self, named: &[VehicleId], auvs: &[Auv]) {
        let mut seen = HashSet::new();
        for (i, id) in named.iter().enumerate() {
            self.vehicle(format_args!("/goal/auvs/{i}"), id, auvs);
            if !seen.insert(id) {
                self.fail_name(format_args!("/goal/auvs/{i}"), "duplicate", "duplicate name", id);
            }
        }
    }

    fn vehicle(&mut self, place: fmt::Arguments<'_>, id: &VehicleId, auvs: &[Auv]) {
        if !auvs.iter().any(|auv| auv.id == *id) {
            self.fail_name(place, "unknown_vehicle", "no vehicle in `auvs` has this id", id);
        }
    }

    fn current(&mut self, field: &str, current: &Current) {
        self.numbers(field, &CURRENT, [current.north_mps, current.east_mps]);
    }

    fn previous_plan(&mut self, previous: &PreviousPlan) {
        self.trajectory(&previous.trajectory);
        for (i, target) in previous.targets.iter().flatten().enumerate() {
            self.previous_target(&format!("/previous_plan/targets/{i}"), target);
        }
        if let Some(course) = previous.goal_course_rad {
            self.within(format_args!("/previous_plan/goal_course_rad"), course, &ANGLE);
        }
        if let Some(current) = &previous.current {
            self.current("/previous_plan/current", current);
        }
        if let Some(craft) = &previous.craft_estimate {
            let asked = [craft.asked_speed_mps, craft.asked_heading_rad];
            self.numbers("/previous_plan/craft_estimate", &PREVIOUS_ASKED, asked);
        }
        if let Some(reference) = &previous.reference {
            let heading = reference.heading_rad.unwrap_or(0.0);
            let numbers = [reference.speed_mps, heading];
            self.numbers("/previous_plan/reference", &PREVIOUS_REFERENCE, numbers);
        }
        if let Some(schedule) = &previous.schedule {
            self.schedule(schedule);
        }
        if let Some(figure) = &previous.figure {
            self.figure(figure);
        }
        if let Some(avoidance) = &previous.avoidance {
            self.avoidance(avoidance);
        }
    }

    fn limits(&mut self, declared: &DeclaredLimits) {
        let limits = Limits::from(declared);
        let [slowest, others @ ..] = LIMITS;
        self.numbers("/limits", &[slowest], [limits.speed_min]);
        // The gap keeps the speed cone and the forward half-plane apart.
        let least_top_speed = if limits.speed_min.is_finite() { limits.speed_min + 0.05 } else { 0.05 };
        self.within(
            format_args!("/limits/speed_max_mps"),
            limits.speed_max,
            &(least_top_speed..=SPEED_MAX_MOST),
        );
        let values = [limits.turn_rate_max, limits.acceleration_max, limits.deceleration_max];
        self.numbers("/limits", &others, values);
        if let Some(lag) = declared.surge_lag_s {
            self.within(format_args!("/limits/surge_lag_s"), lag, &LIMITS_ALONE[1].1);
        }
    }

    fn trajectory(&mut self, points: &[TrajectoryPoint]) {
        let field = "/previous_plan/trajectory";
        for (i, point) in points.iter().enumerate() {
            let values = [point.t_s, point.north_m, point.east_m, point.speed_mps, point.heading_rad];
            self.numbers(&format!("{field}/{i}"), &TRAJECTORY_POINT, values);
        }
        for (i, pair) in points.windows(2).enumerate() {
            let [before, after] = pair else { continue };
            if after.t_s <= before.t_s {
                let place = format_args!("{field}/{}/t_s", i + 1);
                self.invalid.push(FieldError::not_increasing(place, after.t_s, before.t_s));
            }
        }
    }

    /// Checks the given members, also those of an incomplete target, which is not used.
    fn previous_target(&mut self, field: &str, target: &PreviousTarget) {
        if let Some(known) = target.estimate {
            let values = [
                known.age_s,
                known.north_m,
                known.east_m,
                known.depth_m,
                known.north_mps,
                known.east_mps,
                known.turn_rate_radps,
            ];
            self.numbers(&format!("{field}/estimate"), &PREVIOUS_ESTIMATE, values);
        }
        if let Some(Drift { north_mps, east_mps }) = target.drift {
            self.numbers(&format!("{field}/drift"), &CURRENT, [north_mps, east_mps]);
        }
    }
}
