//! The state of a live mission: the fold of its events, and the resulting planner request.

use std::{collections::BTreeMap, mem};

use planner::angle::Heading;
use planner::nalgebra::Vector2;
use planner::snapshot::{COORDINATE_MAX, RANGE_FROM_WITHIN, REPORTS_MAX, Snapshot, pointer_token};
use serde::{Deserialize, Serialize};

use super::clock::{MissionClock, is_ahead};
use super::{event::Event, own_craft::OwnCraft, traffic::Traffic};
use wire::{
    Asc, Auv, CraftFrame, DatumChange, DeclaredLimits, FieldError, Origin, PlanRequest, PreviousPlan, Report,
    Task, VehicleId,
    mission::{AscReport, Live, LiveAuv, Mission, Reports, Setting, Steering},
};

/// Longest extrapolation of the surface craft's last state by its velocity, s. After that its
/// position is unknown, and no plan is made.
pub(super) const ASC_AGE_MAX: f64 = 10.0;

/// Greatest age of a surface craft's state from which the planner learns, s. An extrapolated state
/// keeps heading and speed despite references, as if rudder or thruster had no effect.
const LEARNT_AGE_MAX: f64 = 2.0;

/// The planner's request without its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct MissionState {
    config: Live,
    /// The newest reports of each vehicle, in order of time.
    reports: BTreeMap<String, Vec<Report>>,
    asc: Option<AscReport>,
    /// Newest positions of the surface craft: time, s, north and east, m. They place its ranges.
    #[serde(default)]
    craft_track: Vec<[f64; 3]>,
    #[serde(default)]
    traffic: Traffic,
    /// The last report of whether the craft is steered. No plan depends on it.
    #[serde(default)]
    steering: Option<Steering>,
    previous_plan: Option<PreviousPlan>,
}

impl MissionState {
    pub(super) fn new(config: Live) -> Self {
        let craft_track = Vec::new();
        let (reports, traffic) = (BTreeMap::new(), Traffic::default());
        Self { config, reports, asc: None, craft_track, traffic, steering: None, previous_plan: None }
    }

    /// Applies an event. Only reports and changes of the setting change the state.
    pub(super) fn apply(&mut self, event: &Event, clock: &MissionClock) {
        match event {
            Event::Reported { heard, at_s } => self.take_reports(heard, clock.at(*at_s)),
            Event::Changed { setting, .. } => self.change(setting),
            Event::Created { .. }
            | Event::Ran { .. }
            | Event::Paused { .. }
            | Event::Planned(_)
            | Event::ClockSet { .. }
            | Event::Finished { .. }
            | Event::Failed { .. } => {}
        }
    }

    /// The position of the datum, if known.
    pub(super) fn origin(&self) -> Option<Origin> {
        self.config.origin
    }

    /// `true` if the first fix on Earth can become the origin: no position in metres is known yet.
    pub(super) fn may_begin(&self) -> bool {
        let config = &self.config;
        let no_vessel = self.traffic.is_empty();
        let nothing_heard = self.asc.is_none() && no_vessel && self.reports.values().all(Vec::is_empty);
        let no_path = config.auvs.iter().all(|auv| auv.path.is_none());
        let no_bounds = config.keep_outs.is_empty() && config.no_go.is_empty() && config.area.is_empty();
        config.origin.is_none() && nothing_heard && no_bounds && no_path
    }

    /// The mission's configuration, as changed so far.
    pub(super) fn config(&self) -> &Live {
        &self.config
    }

    /// Writes the setting and the datum into the mission that clients see.
    pub(super) fn show_in(&self, mission: &mut Mission) {
        mission.setting = Some(Setting::from(&self.config));
        mission.origin = self.config.origin;
    }

    /// Replaces members of the setting, and drops what the previous plan derived from the old ones.
    ///
    /// The previous trajectory and reference stay, since the craft follows them until the next
    /// plan. That plan continues the trajectory only if no other has a lower predicted cost.
    fn change(&mut self, setting: &Setting) {
        if let Some(origin) = setting.origin.flatten() {
            self.count_from(origin);
        }
        let mut replaced = setting.clone();
        replaced.exchange_with(&mut self.config);
        let Some(plan) = &mut self.previous_plan else {
            return;
        };
        let config = &self.config;
        let follows_another = |before: &Task| before.goal != config.goal.goal;
        if replaced.goal.as_ref().is_some_and(follows_another) {
            plan.goal_course_rad = None;
        }
        let is_another_craft = replaced.craft.is_some_and(|before| before != config.craft);
        let lag = |limits: Option<&DeclaredLimits>| limits.and_then(|limits| limits.surge_lag_s);
        let has_another_lag = |before: Option<_>| lag(before.as_ref()) != lag(config.limits.as_ref());
        let has_another_lag = replaced.limits.is_some_and(has_another_lag);
        if (is_another_craft || has_another_lag)
            && let Some(craft) = &mut plan.craft_estimate
        {
            craft.memory.clear();
        }
    }

    /// Puts the datum at `origin`. Known positions stay on Earth, and so do true directions.
    /// Positions that are now beyond all coordinates, such as a wrong first fix, are dropped.
    fn count_from(&mut self, origin: Origin) {
        let before = self.config.origin;
        let change = before.and_then(|before| DatumChange::new(before, origin));
        self.config.count_from(origin);
        let Some(change) = change else { return };
        let is_near = |north: f64, east: f64| north.abs().max(east.abs()) <= COORDINATE_MAX;
        for fixes in self.reports.values_mut() {
            for fix in fixes.iter_mut() {
                fix.move_position(|position| change.moved(position));
            }
            fixes.retain(|fix| is_near(fix.position().x, fix.position().y));
        }
        for [_, north, east] in &mut self.craft_track {
            change.position(north, east);
        }
        self.traffic.count_from(|north, east| change.position(north, east), is_near);
        if let Some(AscReport { state, .. }) = &mut self.asc {
            change.position(&mut state.north_m, &mut state.east_m);
        }
        let is_far = |asc: &mut AscReport| !is_near(asc.state.north_m, asc.state.east_m);
        self.asc.take_if(is_far);
        if let Some(plan) = &mut self.previous_plan {
            plan.origin = plan.origin.and(Some(origin));
            plan.move_positions(|position| change.moved(&position));
        }
    }

    /// Adds reports at `now` on the mission's clock, s. Keeps the newest 64 distinct fixes of each
    /// AUV and the newest craft state. Drops reports from before the clock was set back.
    fn take_reports(&mut self, heard: &Reports, now: f64) {
        for kept in self.reports.values_mut() {
            kept.retain(|fix| !is_ahead(fix.t_s, now));
        }
        self.asc.take_if(|asc| is_ahead(asc.t_s, now));
        self.config.origin = self.config.origin.or(heard.origin);
        self.craft_track = self.craft_track_with(heard);
        self.craft_track.retain(|[then, ..]| !is_ahead(*then, now));
        for (id, fixes) in &heard.auvs {
            let kept = self.reports.entry(id.clone()).or_default();
            for fix in fixes {
                let place = kept.partition_point(|earlier| earlier.t_s <= fix.t_s);
                let earlier = kept[..place].iter().rev();
                let mut same_time = earlier.take_while(|earlier| earlier.t_s >= fix.t_s);
                if same_time.all(|earlier| earlier != fix) {
                    kept.insert(place, *fix);
                }
            }
            let surplus = kept.len().saturating_sub(REPORTS_MAX);
            kept.drain(..surplus);
        }
        let newest = heard.asc.iter().max_by(|a, b| a.t_s.total_cmp(&b.t_s));
        if let Some(newest) = newest
            && self.asc.as_ref().is_none_or(|known| known.t_s < newest.t_s)
        {
            self.asc = Some(newest.clone());
        }
        let here = self.asc.as_ref().map(|asc| asc.state.position());
        self.traffic.take(&heard.traffic, now, here);
        self.steering.take_if(|said| is_ahead(said.t_s, now));
        let said = self.steering.iter().chain(&heard.steering);
        self.steering = said.max_by(|a, b| a.t_s.total_cmp(&b.t_s)).cloned();
    }

    /// The craft's newest positions with those in `heard`, in order of time.
    fn craft_track_with(&self, heard: &Reports) -> Vec<[f64; 3]> {
        let states = heard.asc.iter().map(|asc| [asc.t_s, asc.state.north_m, asc.state.east_m]);
        let mut track: Vec<_> = self.craft_track.iter().copied().chain(states).collect();
        track.sort_by(|a, b| a[0].total_cmp(&b[0]));
        track.dedup_by(|later, earlier| later[0] == earlier[0]);
        track.drain(..track.len().saturating_sub(REPORTS_MAX));
        track
    }

    /// Says of each range without `from` where the craft was then, and rejects those of times of
    /// which no state of the craft within 2 s is known.
    pub(super) fn place_ranges(&self, heard: &mut Reports) {
        let track = self.craft_track_with(heard);
        for (id, fixes) in &mut heard.auvs {
            fixes.retain_mut(|fix| {
                if fix.range_m.is_some() && fix.from.is_none() {
                    fix.from = position_at(&track, fix.t_s);
                }
                let is_placed = fix.range_m.is_none() || fix.from.is_some();
                if !is_placed {
                    let detail = format!(
                        "no state of the surface craft within {RANGE_FROM_WITHIN} s of the range at {:.1} s is known: post `asc` before, or say `from` \
                         where it was measured",
                        fix.t_s
                    );
                    heard.rejected.push(FieldError::new(format!("/auvs/{}", pointer_token(id)), "missing", detail));
                }
                is_placed
            });
        }
        heard.auvs.retain(|_, fixes| !fixes.is_empty());
    }

    /// The vessels that were reported, and the state of the craft.
    pub(super) fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    pub(super) fn asc(&self) -> Option<&AscReport> {
        self.asc.as_ref()
    }

    /// Velocity of the craft over ground (north, east), m/s.
    pub(super) fn velocity(&self) -> Option<Vector2<f64>> {
        let plan = self.previous_plan.as_ref();
        self.asc.as_ref().map(|asc| over_ground(&asc.state, plan))
    }

    pub(super) fn steering(&self) -> Option<&Steering> {
        self.steering.as_ref()
    }

    /// Puts this plan into the next request, and returns the previous plan.
    pub(super) fn replace_previous_plan(&mut self, plan: Option<PreviousPlan>) -> Option<PreviousPlan> {
        mem::replace(&mut self.previous_plan, plan)
    }

    /// The vehicles without the reports that a plan at `now` needs, s: `asc`, or AUVs of the goal.
    pub(super) fn waits_for(&self, now: f64) -> Vec<String> {
        let asc = self.asc.as_ref();
        let asc = asc.filter(|asc| now - asc.t_s <= ASC_AGE_MAX && !is_ahead(asc.t_s, now));
        let asc = asc.is_none().then(|| "asc".to_owned());
        let unheard = goal_members(&self.config).filter(|id| self.fixes(id, now).next().is_none());
        asc.into_iter().chain(unheard.map(str::to_owned)).collect()
    }

    /// Fixes of an AUV that are valid at `now`.
    fn fixes(&self, id: &str, now: f64) -> impl Iterator<Item = &Report> {
        let fixes = self.reports.get(id).into_iter().flatten();
        fixes.filter(move |fix| !is_ahead(fix.t_s, now))
    }

    /// Time when each vehicle, `asc` or an AUV, was last heard, on the mission's clock, s.
    pub(super) fn heard(&self) -> BTreeMap<String, f64> {
        let asc = self.asc.iter().map(|asc| ("asc".to_owned(), asc.t_s));
        let newest = |(id, fixes): (&String, &Vec<Report>)| Some((id.clone(), fixes.last()?.t_s));
        asc.chain(self.reports.iter().filter_map(newest)).collect()
    }

    /// The snapshot for a plan at `now`, s on the mission's clock, with the other craft of the
    /// service; `None` if reports are missing. Leaves out a previous plan without a valid snapshot,
    /// such as one beyond all coordinates.
    pub(super) fn snapshot(
        &self,
        now: f64,
        own: &OwnCraft,
        due: &dyn Fn() -> bool,
    ) -> Option<Result<Snapshot, Vec<FieldError>>> {
        let valid = wire::snapshot_until(self.request(now, own)?, due);
        Some(valid.or_else(|_| {
            let mut request = self.request(now, own).expect("waits for no vehicle");
            request.previous_plan = None;
            wire::snapshot_until(request, due)
        }))
    }

    /// The request for a plan at `now` on the mission's clock, s; `None` while reports are missing.
    fn request(&self, now: f64, own: &OwnCraft) -> Option<PlanRequest> {
        if !self.waits_for(now).is_empty() {
            return None;
        }
        let asc = self.asc.as_ref()?;
        let heard = |auv: &LiveAuv| {
            let fixes: Vec<Report> = self.fixes(&auv.id, now).map(|fix| aged(fix, now)).collect();
            (!fixes.is_empty()).then(|| known_by(fixes, auv))
        };
        let mut previous_plan = self.previous_plan.clone();
        if let Some(plan) = &mut previous_plan {
            if !asc.steered {
                take_motion_for_reference(plan, &asc.state);
            } else if LEARNT_AGE_MAX < now - asc.t_s {
                learn_nothing(plan, &asc.state);
            }
        }
        let before = self.previous_plan.as_ref();
        let craft = carried(&asc.state, now - asc.t_s, before, self.config.origin);
        let auvs = self.config.auvs.iter().filter_map(heard).collect();
        let mut request = request(&self.config, now, craft, auvs, previous_plan);
        request.traffic = self.traffic.with(own, request.asc.position());
        Some(PlanRequest { current: asc.current.or(request.current), ..request })
    }
}

/// Replaces the reference of `plan` by the motion of a craft that a person steers: the planner
/// learns nothing of its response, and the next reference turns from the bow.
fn take_motion_for_reference(plan: &mut PreviousPlan, asc: &Asc) {
    let over_ground = asc.ground_north_mps.zip(asc.ground_east_mps);
    let (sin, cos) = (asc.heading_rad.sin(), asc.heading_rad.cos());
    let over_ground = over_ground.map(|(north, east)| north * cos + east * sin);
    learn_nothing(plan, asc);
    if let Some(reference) = &mut plan.reference {
        reference.speed_mps = over_ground.unwrap_or(asc.speed_mps).max(0.0);
        reference.heading_rad = Some(asc.heading_rad);
    }
}

/// Takes the craft's motion as requested, so that the planner learns nothing of its response.
fn learn_nothing(plan: &mut PreviousPlan, asc: &Asc) {
    if let Some(craft) = &mut plan.craft_estimate {
        craft.asked_speed_mps = asc.speed_mps.max(0.0);
        craft.asked_heading_rad = asc.heading_rad;
    }
}

/// Interpolates a `track` at `time`, s: position (north, east), m. At an end, the nearest position
/// within the accepted time.
fn position_at(track: &[[f64; 3]], time: f64) -> Option<[f64; 2]> {
    let after = track.partition_point(|[then, ..]| *then < time);
    let is_near = |[then, ..]: &&[f64; 3]| (then - time).abs() <= RANGE_FROM_WITHIN;
    let before = after.checked_sub(1).and_then(|place| track.get(place)).filter(is_near);
    match (before, track.get(after).filter(is_near)) {
        (Some([from, north, east]), Some([to, later_north, later_east])) => {
            let share = (time - from) / (to - from);
            Some([north + share * (later_north - north), east + share * (later_east - east)])
        }
        (Some([_, north, east]), None) | (None, Some([_, north, east])) => Some([*north, *east]),
        (None, None) => None,
    }
}

fn goal_members(config: &Live) -> impl Iterator<Item = &str> {
    config.goal.goal.named().map(|VehicleId(id)| id.as_str())
}

fn request(
    config: &Live,
    now: f64,
    asc: Asc,
    auvs: Vec<Auv>,
    previous_plan: Option<PreviousPlan>,
) -> PlanRequest {
    PlanRequest {
        origin: config.origin,
        current: config.current,
        limits: config.limits,
        craft: config.craft.clone(),
        keep_outs: config.keep_outs.clone(),
        no_go: config.no_go.clone(),
        area: config.area.clone(),
        acoustics: config.acoustics,
        surfacing_separation_m: config.surfacing_separation_m,
        vessel_separation_m: config.vessel_separation_m,
        tuning: config.tuning.clone(),
        forecast: config.forecast,
        hold: config.hold,
        previous_plan,
        ..PlanRequest::new(now, asc, auvs, config.goal.clone())
    }
}

fn known_by(fixes: Vec<Report>, auv: &LiveAuv) -> Auv {
    Auv { path: auv.path.clone(), dive: auv.dive, ..Auv::reported(auv.id.as_str(), fixes) }
}

/// The fix for a request. A fix dated ahead gets the time `now`.
fn aged(fix: &Report, now: f64) -> Report {
    let t_s = fix.t_s.min(now);
    Report { t_s, ..*fix }
}

/// The surface craft `age` seconds after its state, moved over ground, with its heading and speed.
fn carried(asc: &Asc, age: f64, previous: Option<&PreviousPlan>, origin: Option<Origin>) -> Asc {
    let (place, way) = (asc.position(), over_ground(asc, previous) * age.max(0.0));
    let frame = origin.and_then(|origin| CraftFrame::new(origin, place));
    let place = frame.map_or(place + way, |frame| frame.leave(&way));
    Asc { north_m: place.x, east_m: place.y, lat_deg: None, lon_deg: None, ..*asc }
}

/// Velocity of the surface craft over ground (north, east), m/s: as reported, else by its speeds
/// through the water and the current of the previous plan.
fn over_ground(asc: &Asc, previous: Option<&PreviousPlan>) -> Vector2<f64> {
    let (sin, cos) = asc.heading_rad.sin_cos();
    let through_water = (asc.speed_mps * cos - asc.sway_mps * sin, asc.speed_mps * sin + asc.sway_mps * cos);
    let current = previous.and_then(|plan| plan.current);
    let current = current.map_or((0.0, 0.0), |current| (current.north_mps, current.east_mps));
    let north = asc.ground_north_mps.unwrap_or(through_water.0 + current.0);
    let east = asc.ground_east_mps.unwrap_or(through_water.1 + current.1);
    Vector2::new(north, east)
}

/// The request of a mission with all vehicles at rest at the datum; valid for valid missions.
pub(super) fn trial_request(config: &Live, now: f64) -> PlanRequest {
    let fix = Report::new(now, Vector2::zeros(), 1.0);
    let auvs = config.auvs.iter().map(|auv| known_by(vec![fix], auv));
    let asc = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.0);
    request(config, now, asc, auvs.collect(), None)
}

#[cfg(test)]
mod tests {
    use planner::parameters::Parameters;
    use planner::plan::{Workspace, plan};
    use serde_json::json;

    use super::*;

    fn state() -> MissionState {
        let config = json!({
            "auvs": [{ "id": "a" }, { "id": "b" }],
            "goal": { "kind": "weighted", "weights": { "a": 1.0, "b": 0.0 } },
        });
        MissionState::new(serde_json::from_value(config).expect("has the shape"))
    }

    /// Fixes of a and b, and a surface craft `north` m north of the datum, going north at 1 m/s.
    fn heard(t_s: f64, north: f64) -> Reports {
        let fix = json!([{ "t_s": t_s, "north_m": north, "east_m": 5.0, "sigma_m": 1.0 }]);
        let heard = json!({ "auvs": { "a": fix, "b": fix }, "asc": [{ "t_s": t_s, "state": { "north_m": north,
            "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 1.0, "sway_mps": 0.0, "yaw_rate_radps": 0.0 } }] });
        serde_json::from_value(heard).expect("has the shape")
    }

    fn snapshot(state: &MissionState, now: f64) -> Snapshot {
        let snapshot = state.snapshot(now, &OwnCraft::default(), &|| false);
        snapshot.expect("waits for no vehicle").expect("is valid")
    }

    #[test]
    fn the_surface_craft_is_extrapolated_for_ten_seconds_and_plans_wait_for_vehicles_of_the_goal() {
        let mut state = state();
        assert_eq!(state.waits_for(0.0), ["asc", "a", "b"]);
        state.take_reports(&heard(100.0, 7.0), 100.0);
        let north = |now: f64| state.request(now, &OwnCraft::default()).expect("all are heard").asc.north_m;
        assert_eq!([north(100.0), north(104.0), north(110.0)], [7.0, 11.0, 17.0]);
        assert_eq!(state.waits_for(110.1), ["asc"]);
    }

    #[test]
    fn order_and_repetition_of_fixes_change_nothing() {
        let (mut in_order, mut shuffled) = (state(), state());
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        for &time in &times {
            in_order.take_reports(&heard(time, time), 100.0);
        }
        for k in 0..300 {
            let time = times[(37 * k) % 100];
            shuffled.take_reports(&heard(time, time), 100.0);
        }
        assert_eq!(in_order, shuffled);
        assert_eq!(in_order.reports["a"].len(), REPORTS_MAX);
        assert_eq!(in_order.reports["a"][0].t_s, 36.0);
    }

    #[test]
    fn a_range_is_from_where_the_craft_was_and_is_rejected_if_that_is_unknown() {
        let mut state = state();
        state.take_reports(&heard(100.0, 7.0), 100.0);
        state.take_reports(&heard(101.0, 8.0), 101.0);
        let range = |t_s: f64| json!({ "t_s": t_s, "range_m": 30.0, "sigma_m": 1.0 });
        let ranges = json!({ "auvs": { "a": [range(100.5), range(97.9), range(102.9)] } });
        let mut ranges: Reports = serde_json::from_value(ranges).expect("has the shape");
        state.place_ranges(&mut ranges);
        let from: Vec<_> = ranges.auvs["a"].iter().map(|range| range.from).collect();
        assert_eq!(from, [Some([7.5, 0.0]), Some([8.0, 0.0])]);
        let rejected: Vec<_> = ranges.rejected.iter().map(|wrong| (&*wrong.pointer, &*wrong.code)).collect();
        assert_eq!(rejected, [("/auvs/a", "missing")]);
        state.take_reports(&ranges, 103.0);
        assert!(state.request(103.0, &OwnCraft::default()).is_some());
    }

    #[test]
    fn reports_from_before_the_clock_was_set_back_are_not_new() {
        let mut state = state();
        state.take_reports(&heard(1800.0, 500.0), 1800.0);
        // Half an hour back.
        assert_eq!(state.waits_for(0.0), ["asc", "a", "b"]);
        state.take_reports(&heard(1.0, 3.0), 1.0);
        let request = state.request(1.0, &OwnCraft::default()).expect("all are heard again");
        assert_eq!(request.asc.north_m, 3.0);
        let fixes = request.auvs[0].reports.as_ref().expect("are there");
        assert_eq!(fixes.iter().map(|fix| fix.north_m).collect::<Vec<_>>(), [Some(3.0)]);
    }

    /// A state with reports of 10 s and a plan of 9 s, and the same after a change.
    fn before_and_after(change: serde_json::Value) -> [MissionState; 2] {
        let mut before = state();
        before.take_reports(&heard(10.0, 1.0), 10.0);
        before.config.limits = Some(DeclaredLimits::default());
        let plan = plan(&snapshot(&before, 9.0), &Parameters::default(), &mut Workspace::default());
        before.previous_plan = Some(PreviousPlan::from(&plan));
        let mut after = before.clone();
        after.change(&serde_json::from_value(change).expect("has the shape"));
        [before, after]
    }

    #[test]
    fn a_change_keeps_the_parts_of_the_previous_plan_that_still_hold() {
        let a = json!({ "kind": "track", "auv": "a" });
        let beside = json!({ "kind": "weighted", "weights": { "a": 1.0, "b": 0.0 },
            "offset": { "frame": "ned", "north_m": 1.0, "east_m": 0.0 } });
        let disc = json!({ "north_m": 90.0, "east_m": 0.0, "radius_m": 9.0 });
        for (change, course_stays, craft_stays) in [
            (json!({ "goal": a }), false, true),
            (json!({ "goal": beside, "keep_outs": [disc] }), true, true),
            (json!({ "limits": { "speed_max_mps": 0.5 }, "craft": null }), true, true),
            (json!({ "limits": { "surge_lag_s": 0.5 } }), true, false),
            (json!({ "goal": a, "craft": { "preset": "medusa" } }), false, false),
        ] {
            let [before, after] = before_and_after(change.clone()).map(|state| state.previous_plan);
            let mut expected = before.expect("is there");
            expected.goal_course_rad = expected.goal_course_rad.filter(|_| course_stays);
            let craft = expected.craft_estimate.as_mut().expect("is there");
            craft.memory.retain(|_| craft_stays);
            assert_eq!(after, Some(expected), "{change}");
        }
    }

    #[test]
    fn another_craft_is_known_by_its_description_only_and_turns_from_the_last_reference() {
        let craft = json!({ "preset": "medusa", "relative_uncertainty": 0.0 });
        let snapshots = before_and_after(json!({ "craft": craft })).map(|state| snapshot(&state, 10.0));
        let lag = |snapshot: &Snapshot| {
            let (known, said) = (snapshot.craft_estimate(), snapshot.craft_prior());
            (known.heading.y, said.heading_lag.mean)
        };
        let [before, after] = &snapshots;
        assert_ne!(lag(before).0, lag(before).1);
        assert_eq!(lag(after).0, lag(after).1);
        let asked = |snapshot: &Snapshot| snapshot.previous_plan.as_ref().expect("is there").reference;
        assert!(asked(before).is_some());
        assert_eq!(asked(before), asked(after));
    }

    #[test]
    fn the_motion_of_a_craft_that_a_person_steers_counts_as_its_reference() {
        let [mut state, _] = before_and_after(json!({ "craft": null }));
        let asked = |state: &MissionState| {
            let plan = state
                .request(10.0, &OwnCraft::default())
                .and_then(|request| request.previous_plan)
                .expect("is there");
            let craft = plan.craft_estimate.expect("is there");
            (craft.asked_speed_mps, craft.asked_heading_rad, craft.memory)
        };
        let steered = asked(&state);
        assert_ne!((steered.0, steered.1), (1.0, 0.0));
        state.asc.as_mut().expect("is heard").steered = false;
        // The craft's motion: 1 m/s to the north. The learnt values stay.
        assert_eq!(asked(&state), (1.0, 0.0, steered.2));
    }

    #[test]
    fn nothing_is_learnt_of_a_silent_craft_and_its_references_continue() {
        let [state, _] = before_and_after(json!({ "craft": null }));
        let heard_s = state.asc.as_ref().expect("is heard").t_s;
        let previous = |age: f64| {
            let request = state.request(heard_s + age, &OwnCraft::default()).expect("waits for no vehicle");
            request.previous_plan.expect("is there")
        };
        let [fresh, old] = [0.5, 3.0].map(previous);
        assert_eq!(fresh.reference, old.reference);
        let asked = |plan: &PreviousPlan| {
            let craft = plan.craft_estimate.as_ref().expect("is there");
            (craft.asked_speed_mps, craft.asked_heading_rad)
        };
        assert_ne!(asked(&fresh), (1.0, 0.0));
        assert_eq!(asked(&old), (1.0, 0.0));
    }

    #[test]
    fn a_current_that_the_craft_observes_overrides_that_of_the_mission() {
        let mut state = state();
        state.take_reports(&heard(100.0, 7.0), 100.0);
        let east = |state: &MissionState| {
            let request = state.request(100.0, &OwnCraft::default()).expect("all are heard");
            request.current.map(|current| current.east_mps)
        };
        let current = |east: f64| serde_json::from_value(json!({ "north_mps": 0.0, "east_mps": east }));
        state.config.current = Some(current(0.1).expect("has the shape"));
        assert_eq!(east(&state), Some(0.1));
        state.asc.as_mut().expect("is heard").current = Some(current(0.3).expect("has the shape"));
        assert_eq!(east(&state), Some(0.3));
    }

    #[test]
    fn a_mission_survives_a_previous_plan_that_leads_beyond_all_coordinates() {
        let mut state = state();
        state.take_reports(&heard(10.0, 1e6), 10.0);
        let beyond = json!({ "trajectory": [{ "t_s": 9.0, "north_m": 3e6, "east_m": 0.0, "speed_mps": 1.0,
            "heading_rad": 0.0 }] });
        state.previous_plan = Some(serde_json::from_value(beyond).expect("has the shape"));
        assert_eq!(snapshot(&state, 10.0).previous_plan, None);
    }
}
