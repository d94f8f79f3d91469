//! Writes the answer to a plan.

use std::time::Duration;

use geodesy::Datum;
use nalgebra::Vector2;
use planner::los::{LosLaw, Reference as DomainReference};
use planner::plan as domain;
use planner::plan::{Method, Plan, PlannedTarget, Predicted, SoftLimit, SolverReport, Subject};
use planner::snapshot::{
    CURRENT_MAX, Goal, LeftOut, Origin, Report, SCHEMA_VERSION, Snapshot, TrajectoryPoint, VehicleId,
    pointer_token,
};
use planner::vessel::{VESSEL_STALE, is_lost};
use serde_json::{Map, Value};

use super::{
    CraftFrame,
    digest::plan_id,
    response::{Baseline, CraftEstimate, GoalTrajectory, Learnt, Outcome, PlanResponse, Reference, Warning},
};

/// Age of a report that causes a warning, s: three of the ten-second slots in which an acoustic
/// network usually hears of every vehicle.
const REPORT_AGE_STALE: f64 = 30.0;

/// Distance from the origin that causes a warning, m: headings err by what good compasses do.
const ORIGIN_FAR: f64 = 20e3;

/// Accuracy of references, by that of the solver, m/s.
const SPEED_ROUNDING: f64 = 1e-3;

/// A plan, with everything that its answer needs.
#[derive(Clone, Debug)]
pub struct Answer<'a> {
    snapshot: &'a Snapshot,
    plan: &'a Plan,
    solve_time: Duration,
    metadata: &'a Map<String, Value>,
    plan_id: String,
    /// Place of the datum, if known.
    place: Option<(Origin, Datum)>,
    /// The snapshot's frame, if it is at the craft.
    frame: Option<CraftFrame>,
}

impl<'a> Answer<'a> {
    /// The answer to the request of `snapshot` and `metadata`; the planner took `solve_time`.
    pub fn new(
        snapshot: &'a Snapshot,
        plan: &'a Plan,
        solve_time: Duration,
        metadata: &'a Map<String, Value>,
    ) -> Self {
        Self { snapshot, plan, solve_time, metadata, plan_id: plan_id(snapshot), place: None, frame: None }
    }

    /// The same answer with latitudes and longitudes, if `origin` is a place on Earth.
    #[must_use]
    pub fn on_earth(self, origin: Option<Origin>) -> Self {
        let place = origin.and_then(|origin| Some((origin, Datum::new(&origin.into()).ok()?)));
        let frame = CraftFrame::of(self.snapshot, origin);
        Self { place, frame, ..self }
    }

    fn origin_far(&self) -> Option<Warning> {
        let (_, datum) = self.place.as_ref()?;
        let position = self.placed(&self.snapshot.asc.position());
        let distance_km = 1e-3 * position.norm();
        let turned_deg = datum.convergence(&position).to_degrees();
        let detail = format!(
            "the craft is {distance_km:.0} km from the origin, where true north is {:.2}° {} of the frame's: choose an origin \
             within {:.0} km of the work",
            turned_deg.abs(),
            if turned_deg > 0.0 { "west" } else { "east" },
            1e-3 * ORIGIN_FAR
        );
        (ORIGIN_FAR < position.norm()).then(|| warning("origin_far", "/origin", detail))
    }

    /// The planner's answer.
    pub fn planned(&self) -> PlanResponse {
        let plan = self.plan;
        let (outcome, reason) = outcome(plan.degraded);
        let asked = plan.reference_through_water;
        PlanResponse {
            outcome,
            method: plan.method,
            reason,
            solver: Some(SolverReport {
                solve_time_ms: Some(self.solve_time.as_secs_f64() * 1e3),
                ..plan.solver
            }),
            violations: plan.violations.clone(),
            ..self.along(plan.reference, asked, &plan.trajectory, plan.predicted)
        }
    }

    /// A law's answer to the same snapshot. The law starts without memory; a warning says so.
    pub fn law(&self, law: LosLaw, baseline: &domain::Baseline) -> PlanResponse {
        let reference = baseline.reference;
        let mut answer = PlanResponse {
            method: Method::from(law),
            violations: baseline.violations.clone(),
            ..self.along(reference, reference, &baseline.trajectory, baseline.predicted)
        };
        (answer.outcome, answer.reason) = outcome(baseline.degraded);
        answer.warnings.extend(no_memory(law));
        answer
    }

    /// The common part of all answers, with the line-of-sight law's outcome.
    fn along(
        &self,
        reference: DomainReference,
        asked: DomainReference,
        trajectory: &[TrajectoryPoint],
        predicted: Predicted,
    ) -> PlanResponse {
        let baseline = &self.plan.baseline;
        let (mut trajectory, mut goal) = (trajectory.to_vec(), self.plan.goal.clone());
        for at in &mut trajectory {
            (at.north_m, at.east_m, at.lat_deg, at.lon_deg) = self.place(at.north_m, at.east_m);
        }
        for at in &mut goal {
            (at.north_m, at.east_m, at.lat_deg, at.lon_deg) = self.place(at.north_m, at.east_m);
        }
        let mut targets = self.plan.targets.clone();
        for PlannedTarget { estimate: at, trajectory, track, states, ranging, .. } in &mut targets {
            (at.north_m, at.east_m, at.lat_deg, at.lon_deg) = self.place(at.north_m, at.east_m);
            for at in &mut at.places {
                (at.north_m, at.east_m, at.lat_deg, at.lon_deg) = self.place(at.north_m, at.east_m);
            }
            for at in trajectory {
                (at.north_m, at.east_m, at.lat_deg, at.lon_deg) = self.place(at.north_m, at.east_m);
            }
            let track = track.iter_mut().map(|[_, north, east]| [north, east]);
            let states = states.iter_mut().map(|[_, north, east, ..]| [north, east]);
            let gaussians = ranging.iter_mut().flat_map(|ranging| &mut ranging.gaussians);
            let means = gaussians.map(|[_, _, _, north, east, ..]| [north, east]);
            for [north, east] in track.chain(states).chain(means) {
                let place = self.placed(&Vector2::new(*north, *east));
                (*north, *east) = (place.x, place.y);
            }
        }
        let mut warnings = warnings(self.snapshot, self.plan);
        warnings.extend(targets.iter().enumerate().filter_map(|(i, target)| ambiguous(i, target)));
        warnings.extend(self.origin_far());
        // A craft that stands by has no goal, and is to stop.
        let of_a_goal = ["goal_in_no_go", "no_way", "reference_below_speed_min"];
        warnings.retain(|warning| !self.snapshot.stands_by() || !of_a_goal.contains(&&*warning.code));
        let mut schedule = self.plan.schedule.clone();
        for visit in schedule.iter_mut().flat_map(|schedule| &mut schedule.visits) {
            let place = self.placed(&Vector2::new(visit.north_m, visit.east_m));
            (visit.north_m, visit.east_m) = (place.x, place.y);
        }
        let mut figure = self.plan.figure.clone();
        if let Some(figure) = &mut figure {
            let mean = self.placed(&Vector2::new(figure.north_m, figure.east_m));
            (figure.north_m, figure.east_m) = (mean.x, mean.y);
        }
        PlanResponse {
            schema_version: SCHEMA_VERSION.to_owned(),
            plan_id: self.plan_id.clone(),
            outcome: Outcome::Ok,
            method: Method::SaturatedLos,
            reason: None,
            origin: self.place.map(|(origin, _)| origin),
            reference: Reference {
                speed_mps: reference.speed,
                heading_rad: reference.heading.radians(),
                heading_deg: reference.heading.compass_degrees(),
                valid_until_s: self.plan.valid_until,
            },
            trajectory,
            goal_course_rad: self.plan.goal_course.radians(),
            craft_estimate: self.craft_estimate(asked),
            current: self.plan.current,
            goal: GoalTrajectory { trajectory: goal },
            targets,
            schedule,
            figure,
            avoidance: self.plan.avoidance.clone(),
            baseline: Baseline {
                method: Method::SaturatedLos,
                speed_mps: baseline.reference.speed,
                heading_rad: baseline.reference.heading.radians(),
                predicted_cost: baseline.predicted.cost,
                predicted_rms_error_m: baseline.predicted.rms_error_m,
                predicted_energy_j: baseline.predicted.energy_j,
            },
            solver: None,
            predicted,
            violations: Vec::new(),
            warnings,
            metadata: self.metadata.clone(),
        }
    }

    /// Converts a position of the snapshot's frame to one from the datum, m.
    fn placed(&self, position: &Vector2<f64>) -> Vector2<f64> {
        self.frame.as_ref().map_or(*position, |frame| frame.leave(position))
    }

    /// Converts a position of the snapshot's frame to one from the datum: north and east, m;
    /// latitude and longitude, degrees, if the datum's place is known.
    fn place(&self, north_m: f64, east_m: f64) -> (f64, f64, Option<f64>, Option<f64>) {
        let position = self.placed(&Vector2::new(north_m, east_m));
        let place = self.place.map(|(_, datum)| Origin::from(datum.from_local(&position)));
        let (lat_deg, lon_deg) = place.map(|place| (place.lat_deg, place.lon_deg)).unzip();
        (position.x, position.y, lat_deg, lon_deg)
    }

    fn craft_estimate(&self, asked: DomainReference) -> CraftEstimate {
        let (known, tuned) = (&self.plan.craft, &self.snapshot.tuned().craft);
        let (heading_held, speed_held) = known.modes(self.snapshot.craft_prior());
        let learnt = |(value, sigma): (f64, f64)| Learnt { value, sigma };
        let remembered = planner::craft::CraftEstimate { position: self.placed(&known.position), ..*known };
        CraftEstimate {
            heading_lag_s: learnt(known.heading_lag(tuned)),
            heading_offset_rad: learnt(known.heading_offset()),
            heading_held,
            surge_lag_s: learnt(known.surge_lag(tuned)),
            speed_held,
            surge_bias_mps2: learnt(known.surge_disturbance()),
            sway_per_yaw_rate_s: learnt((known.drift.mean, known.drift.variance.max(0.0).sqrt())),
            follows: !known.monitor.alarm,
            asked_speed_mps: asked.speed,
            asked_heading_rad: asked.heading.radians(),
            memory: remembered.memory().to_vec(),
        }
    }
}

fn warning(code: &str, pointer: &str, detail: String) -> Warning {
    Warning { code: code.to_owned(), pointer: pointer.to_owned(), detail }
}

fn warnings(snapshot: &Snapshot, plan: &Plan) -> Vec<Warning> {
    let mut warnings = vec![];
    for (i, (auv, estimate)) in snapshot.auvs.iter().zip(snapshot.estimates()).enumerate() {
        let (id, age) = (&auv.id, estimate.state.age_s);
        if REPORT_AGE_STALE < age {
            let member = if auv.state.is_some() { "state/age_s" } else { "reports" };
            let detail = format!("{id} was last heard {age:.0} s ago; its forecast starts there");
            warnings.push(warning("stale_report", &format!("/auvs/{i}/{member}"), detail));
        }
    }
    warnings.extend(contradicted_claims(snapshot));
    warnings.extend(no_current(snapshot));
    warnings.extend(unusable_memory(snapshot));
    warnings.extend(about_the_craft(snapshot, plan));
    warnings.extend(about_traffic(snapshot, plan));
    warnings.extend(about_visits(snapshot, plan));
    warnings.extend(unknown_navigation(snapshot, plan));
    warnings.extend(not_localised(snapshot, plan));
    warnings.extend(about_no_go_areas(snapshot, plan));
    warnings
}

/// Warnings of a craft or goal in a no-go area, and of a goal to which no way leads.
fn about_no_go_areas(snapshot: &Snapshot, plan: &Plan) -> Vec<Warning> {
    let name = |i: usize| match &snapshot.no_go[i].name {
        Some(name) => format!("{name}, a no-go area"),
        None => format!("no-go area {i}"),
    };
    let craft = snapshot.no_go_at(&snapshot.asc.position()).map(|i| {
        let detail = format!("the craft is in {}: it takes the nearest way out", name(i));
        warning("craft_in_no_go", &format!("/no_go/{i}"), detail)
    });
    let goal = plan.goal_in_no_go.map(|i| {
        let detail = format!("the goal is in {}: it is followed from the nearest place outside", name(i));
        warning("goal_in_no_go", &format!("/no_go/{i}"), detail)
    });
    let closed = (!plan.goal_is_reachable).then(|| {
        let detail = "no way past the no-go areas to the goal was found that is wide enough for the craft";
        warning("no_way", "/no_go", detail.to_owned())
    });
    [craft, goal, closed].into_iter().flatten().collect()
}

/// A warning of localised vehicles whose present uncertainty nobody states.
fn unknown_navigation(snapshot: &Snapshot, plan: &Plan) -> Option<Warning> {
    let vehicles = plan.figure.iter().flat_map(|figure| &figure.vehicles);
    let unknown = vehicles.filter(|vehicle| vehicle.sigma_now_m.is_none());
    let names: Vec<_> = unknown.map(|vehicle| &*vehicle.auv.0).collect();
    let sigma = snapshot.tuned().localise.unknown_sigma;
    let detail = format!(
        "nobody says how sure {} of its position, so {sigma:.0} m along either axis is assumed: give \
         `costs_now`, or the `covariance` of its `state`",
        names.join(", ") + if names.len() == 1 { " is" } else { " are" }
    );
    (!names.is_empty()).then(|| warning("uncertainty_unknown", "/goal/costs_now", detail))
}

/// Warnings of vehicles to localise that the figure is not about.
fn not_localised(snapshot: &Snapshot, plan: &Plan) -> Vec<Warning> {
    let (Some(figure), Goal::Localise(localise)) = (&plan.figure, &snapshot.goal.goal) else {
        return Vec::new();
    };
    let is_sailed = |id: &VehicleId| figure.vehicles.iter().any(|vehicle| vehicle.auv == *id);
    let named = localise.auvs.iter().enumerate().filter(|(_, id)| 0.0 < localise.weight(id));
    let left_out = named.filter(|(_, id)| !is_sailed(id)).map(|(i, id)| {
        let detail = format!("{id} is not localised: it is not heard any more");
        warning("localise_unreachable", &format!("/goal/auvs/{i}"), detail)
    });
    left_out.collect()
}

/// Warnings of vehicles that the schedule serves late or omits.
fn about_visits(snapshot: &Snapshot, plan: &Plan) -> Vec<Warning> {
    let (Some(schedule), Goal::Visit(visits)) = (&plan.schedule, &snapshot.goal.goal) else {
        return Vec::new();
    };
    let mut warnings = Vec::new();
    for (i, id) in visits.auvs.iter().enumerate() {
        let known = schedule.costs.iter().find(|known| known.auv == *id);
        let because = match known.and_then(|known| known.left_out) {
            Some(LeftOut::Silent) => "it is not heard any more",
            Some(LeftOut::OutOfReach) if snapshot.no_go.is_empty() => {
                "the craft does not reach it in the time that is planned"
            }
            Some(LeftOut::OutOfReach) => {
                "the craft does not reach it in the time that is planned, or no way past the no-go areas leads to it"
            }
            Some(LeftOut::TooDeep) => "it is deeper than the range within which data are uploaded",
            None => continue,
        };
        let detail = format!("no visit to {id} is planned: {because}");
        warnings.push(warning("visit_unreachable", &format!("/goal/auvs/{i}"), detail));
    }
    let next = visits.next.iter();
    let next = next.map(|id| (id, "/goal/next".to_owned(), "it is not visited next"));
    let due = visits.serve_by_s.keys().map(|id| {
        let pointer = format!("/goal/serve_by_s/{}", pointer_token(&id.0));
        (id, pointer, "no visit is planned by its deadline")
    });
    for (id, pointer, what) in next.chain(due).filter(|(id, ..)| visits.weight(id) == 0.0) {
        let detail = format!("{id} counts for nothing, by its weight of 0: {what}");
        warnings.push(warning("visit_without_weight", &pointer, detail));
    }
    for id in &schedule.deadlines_missed {
        let deadline = visits.serve_by_s.get(id).copied().unwrap_or(snapshot.t_s);
        let visit = schedule.visits.iter().find(|visit| visit.auv == *id);
        let when = visit.map_or_else(
            || "no visit is planned".to_owned(),
            |visit| format!("the craft arrives {:.0} s late", visit.arrive_s - deadline),
        );
        let left = deadline - snapshot.t_s;
        let detail = if left < 0.0 {
            format!("{id} was not served by its deadline, {:.0} s ago: {when}", -left)
        } else {
            format!("{id} is not served by its deadline in {left:.0} s: {when}")
        };
        let pointer = format!("/goal/serve_by_s/{}", pointer_token(&id.0));
        warnings.push(warning("visit_deadline_missed", &pointer, detail));
    }
    warnings
}

/// Warnings of vessels of which too little is known, and of those that come too near.
fn about_traffic(snapshot: &Snapshot, plan: &Plan) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for (i, vessel) in snapshot.traffic.iter().enumerate() {
        let (age, name) = (snapshot.vessel_age(vessel), vessel.called());
        let pointer = format!("/traffic/{i}/t_s");
        if is_lost(vessel, age) {
            let detail =
                format!("the last position of {name} is {age:.0} s old: nothing keeps the craft clear of it");
            warnings.push(warning("vessel_lost", &pointer, detail));
        } else if VESSEL_STALE < age && !vessel.is_made_fast() {
            let detail = format!("the last position of {name} is {age:.0} s old: it may be elsewhere");
            warnings.push(warning("vessel_stale", &pointer, detail));
        }
    }
    let near = plan.violations.iter().filter(|broken| broken.limit == SoftLimit::VesselSeparation);
    for broken in near {
        let Some(Subject::Vessel(i)) = broken.pointer else { continue };
        let vessel = &snapshot.traffic[i];
        let detail = format!(
            "{} comes {:.0} m nearer than the distance to keep, in {:.0} s",
            vessel.called(),
            broken.amount,
            broken.t_s - snapshot.t_s
        );
        warnings.push(warning("vessel_too_near", &format!("/traffic/{i}"), detail));
    }
    warnings
}

/// Warning of the AUV number `i` that is at one of two places.
fn ambiguous(i: usize, PlannedTarget { id, estimate, .. }: &PlannedTarget) -> Option<Warning> {
    let [likelier, other] = &estimate.places[..] else {
        return None;
    };
    let detail = format!(
        "the ranges of {id} do not tell where it is: {:.0} m north, {:.0} m east (probability {:.2}), or {:.0} m north, {:.0} m east; \
         measure from beside that line, as the goal `localise` does",
        likelier.north_m, likelier.east_m, likelier.probability, other.north_m, other.east_m
    );
    Some(warning("ambiguous", &format!("/auvs/{i}/reports"), detail))
}

/// Warnings of claims in reports that their fixes contradict.
fn contradicted_claims(snapshot: &Snapshot) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for (i, (auv, estimate)) in snapshot.auvs.iter().zip(snapshot.estimates()).enumerate() {
        let evidence = if auv.state.is_some() { "state" } else { "reports" };
        let (id, pointer) = (&auv.id, format!("/auvs/{i}/{evidence}"));
        if estimate.velocity_contradicted {
            let detail = match auv.state {
                None => format!(
                    "the fixes of {id} contradict the course and speed that it reports, which are not used; 0 may mean unknown"
                ),
                Some(_) => format!(
                    "the states of {id} are not where their courses and speeds lead, which are used all the same; 0 may mean unknown"
                ),
            };
            warnings.push(warning("reported_velocity_contradicted", &pointer, detail));
        }
        if estimate.jumped {
            let detail = format!(
                "the state of {id} is where its last states do not lead, and is used: are two vehicles given under its name?"
            );
            warnings.push(warning("reports_contradict", &pointer, detail));
        }
        if let Some(route) = estimate.route.filter(|route| estimate.repeats.is_none() && !route.is_followed())
        {
            let detail = format!(
                "{id} does not follow its path (probability {:.2}): it is forecast from its motion",
                route.probability
            );
            warnings.push(warning("auv_off_route", &format!("/auvs/{i}/path"), detail));
        }
        let reports = auv.reports.as_deref().unwrap_or_default();
        if let Some((j, range, depth)) = shorter_than_depth(reports) {
            let detail = format!(
                "a range of {range:.1} m to {id} is shorter than its depth of {depth:.1} m: check the sound speed and the depth gauge"
            );
            warnings.push(warning("range_shorter_than_depth", &format!("{pointer}/{j}"), detail));
        }
        let (n_elsewhere, n_reports) = (elsewhere(reports, &estimate.rejected), estimate.looked_at);
        if ELSEWHERE_MIN <= n_elsewhere && n_reports <= 2 * n_elsewhere {
            let detail = format!(
                "{n_elsewhere} of the {n_reports} reports of {id} do not fit the others and are not used: are two vehicles reported under its name?"
            );
            warnings.push(warning("reports_contradict", &pointer, detail));
        }
        if estimate.inflation > 0.0 {
            let detail = format!(
                "the fixes of {id} scatter more than their sigma_m: {} m is added to it, as the root of the sum of squares",
                estimate.inflation
            );
            warnings.push(warning("reported_accuracy_contradicted", &pointer, detail));
        }
    }
    warnings
}

/// Largest error of a range above an AUV, in standard deviations.
const SHORTER: f64 = 4.0;

/// The first range that is shorter than the depth reported with it: its index, both, m.
fn shorter_than_depth(reports: &[Report]) -> Option<(usize, f64, f64)> {
    let mut ranges = reports.iter().enumerate().filter_map(|(j, report)| {
        Some((j, report.range_m?, report.depth_m?))
            .filter(|(_, range, depth)| range + SHORTER * report.sigma_m < *depth)
    });
    ranges.next()
}

/// Least number of fixes elsewhere; fewer are outliers.
const ELSEWHERE_MIN: usize = 4;

/// Longest time between a fix and its repetition at about the same place, s.
const TWICE_WITHIN: f64 = 1.0;

/// Number of the `rejected` fixes that do not repeat a used one.
fn elsewhere(reports: &[Report], rejected: &[usize]) -> usize {
    let is_of_used = |fix: &Report| {
        let mut used = (0..reports.len()).filter(|i| !rejected.contains(i));
        used.any(|i| {
            let used = &reports[i];
            let apart = (used.position() - fix.position()).norm();
            let is_echo = used.range_m.is_some() && fix.range_m.is_some();
            (used.t_s - fix.t_s).abs() <= TWICE_WITHIN
                && (is_echo || apart <= 3.0 * (used.sigma_m + fix.sigma_m))
        })
    };
    rejected.iter().filter(|i| !is_of_used(&reports[**i])).count()
}

/// A heading for people, degrees in [0, 360).
fn bearing_deg(heading: f64) -> f64 {
    // A rounded 360 becomes 0.
    heading.to_degrees().round().rem_euclid(360.0)
}

/// Warnings of the craft's unknown, missing and insufficient abilities.
fn about_the_craft(snapshot: &Snapshot, plan: &Plan) -> impl Iterator<Item = Warning> {
    let (prior, model) = (snapshot.craft_prior(), snapshot.craft_model());
    let unknown = (!prior.heading_declared && !prior.surge_declared).then(|| {
        let detail = format!(
            "the craft's heading and surge loops have no declared time constants: those of a cautious craft are assumed and \
             learnt from (heading {:.1} s behind, at most {:.0}°/s and {:.2} m/s²); declare them, or name a known craft",
            model.heading_lag(), model.limits.turn_rate_max.to_degrees(), model.limits.acceleration_max
        );
        warning("craft_unknown", "/craft", detail)
    });
    let monitor = &plan.craft.monitor;
    let does_not_follow = monitor.alarm.then(|| {
        let asc = &snapshot.asc;
        let detail = format!(
            "expected heading {:03.0}° and {:.2} m/s, seen {:03.0}° and {:.2} m/s: a slower craft is planned for; check \
             thrusters, rudder and autopilot",
            bearing_deg(asc.heading().radians() - monitor.heading_error),
            asc.speed_mps - monitor.speed_error,
            bearing_deg(asc.heading().radians()),
            asc.speed_mps
        );
        warning("craft_does_not_follow", "/asc", detail)
    });
    let heading_does_not_respond = plan.craft.heading_effect.is_missing().then(|| {
        let detail = format!(
            "the heading stays near {:03.0}° although turns are asked for: check rudder, steering thrusters, the autopilot's mode and the compass, or steer by hand; turns of half the rate are planned for",
            bearing_deg(snapshot.asc.heading().radians())
        );
        warning("heading_does_not_respond", "/asc/heading_rad", detail)
    });
    let speed_does_not_respond = plan.craft.speed_effect.is_missing().then(|| {
        let detail = format!(
            "the speed stays near {:.2} m/s although another is asked for: check propellers, thrusters, batteries, the autopilot's mode and the speed log, or recover the craft; half its acceleration is planned for",
            snapshot.asc.speed_mps
        );
        warning("speed_does_not_respond", "/asc/speed_mps", detail)
    });
    let speed_max = snapshot.limits().speed_max;
    let current = snapshot.current();
    let too_strong = (speed_max < current.norm()).then(|| {
        let detail = format!(
            "the current, {:.2} m/s, exceeds the craft's top speed, {speed_max:.2} m/s: the craft cannot hold a position",
            current.norm()
        );
        warning("current_exceeds_speed", "/current", detail)
    });
    let (speed_min, reference) = (snapshot.limits().speed_min, plan.reference.speed);
    let too_slow = (reference < speed_min - SPEED_ROUNDING).then(|| {
        let detail = format!(
            "the reference, {reference:.2} m/s over ground, is below limits.speed_min_mps, {speed_min:.2} m/s: against the current the \
             craft then goes {:.2} m/s through the water; check that its speed loop keeps way at so small a reference",
            plan.reference_through_water.speed
        );
        warning("reference_below_speed_min", "/limits/speed_min_mps", detail)
    });
    let through_water = plan.goal.iter().map(|goal| (goal.motion().velocity - current).norm());
    let slowest = through_water.fold(f64::INFINITY, f64::min);
    let outrun = (slowest.is_finite() && speed_max < slowest).then(|| {
        let detail = format!(
            "the goal moves through the water at {slowest:.2} m/s or more, faster than the craft, {speed_max:.2} m/s: it \
             is not caught up with"
        );
        warning("goal_unreachable", "/goal", detail)
    });
    [unknown, does_not_follow, heading_does_not_respond, speed_does_not_respond, too_strong, too_slow, outrun]
        .into_iter()
        .flatten()
}

/// Warning of a previous plan whose memory of the craft is not used.
fn unusable_memory(snapshot: &Snapshot) -> Option<Warning> {
    let unusable = snapshot.previous_plan.as_ref()?.has_unusable_memory();
    unusable.then(|| {
        let detail = "not a memory from an answer of this version: learning of the craft starts again";
        let pointer = "/previous_plan/craft_estimate/memory";
        warning("memory_not_used", pointer, detail.to_owned())
    })
}

/// Warning of a request that gives no current, with the reason.
fn no_current(snapshot: &Snapshot) -> Option<Warning> {
    if snapshot.current.is_some() {
        return None;
    }
    let previous = snapshot.previous_plan.as_ref();
    let learnt = previous.and_then(|previous| previous.craft()?.current_from_positions());
    let instead = if snapshot.asc.ground_velocity().is_none() && learnt.is_some() {
        "the current is estimated from positions and speed through the water"
    } else if snapshot.known_current().is_some() {
        "the previous plan's current is used"
    } else {
        "still water is assumed"
    };
    let Some(apparent) = snapshot.asc.apparent_current() else {
        let detail = format!("no current and no ground velocity given: {instead}");
        return Some(warning("current_unknown", "/current", detail));
    };
    let axes = [("north", apparent.x), ("east", apparent.y)];
    let (axis, speed) = axes.into_iter().find(|(_, speed)| CURRENT_MAX < speed.abs())?;
    let detail = format!(
        "less the velocity through the water it leaves a current of {speed:.2} m/s, and more than {CURRENT_MAX} m/s is \
         not used: {instead}"
    );
    let pointer = format!("/asc/ground_{axis}_mps");
    Some(warning("velocities_contradict", &pointer, detail))
}

fn outcome(degraded: Option<domain::Degraded>) -> (Outcome, Option<String>) {
    degraded.map_or((Outcome::Ok, None), |why| (Outcome::Degraded, Some(why.to_string())))
}

/// Warning of a law that would have a memory in a mission.
fn no_memory(law: LosLaw) -> Option<Warning> {
    let detail = match law {
        LosLaw::Integral => {
            "the integral of the cross-track error starts at zero: a steady error is not yet corrected"
        }
        LosLaw::WaypointBox => "the box is placed around one fix, and its 360 s begin with this request",
        LosLaw::SaturatedLos | LosLaw::TrackerFrame => return None,
    };
    let detail = format!("{}: {detail}", law.name());
    Some(warning("law_without_memory", "", detail))
}
