//! The state of a live mission: the fold of its events, and the resulting planner request.

use std::collections::{BTreeMap, BTreeSet};

use planner::angle::Heading;
use planner::fleet::Member;
use planner::nalgebra::Vector2;
use planner::snapshot::{COORDINATE_MAX, RANGE_FROM_WITHIN, REPORTS_MAX, pointer_token};
use serde::{Deserialize, Serialize};

use super::clock::{MissionClock, is_ahead};
use super::craft_state::{Absence, CraftNow, CraftState, CraftView, position_at};
use super::{event::Event, own_craft::OwnCraft, traffic::Traffic};
use wire::{
    Asc, Auv, CraftDescription, DatumChange, DeclaredLimits, FieldError, FleetRequest, Origin, PlanRequest,
    PreviousPlan, Report, VehicleId, Vessel,
    mission::{Assigned, Away, Live, LiveAuv, LiveCraft, Mission, Reports, Setting, Steering, SteeringState},
};

/// The planner's request without its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct MissionState {
    config: Live,
    /// The newest reports of each vehicle, in order of time.
    reports: BTreeMap<String, Vec<Report>>,
    /// The craft of a mission that has one, without a name.
    #[serde(flatten)]
    alone: CraftState,
    /// The craft of a fleet, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    fleet: BTreeMap<String, CraftState>,
    /// The last change of who serves whom in a fleet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    assigned: Option<Box<Assigned>>,
    #[serde(default)]
    traffic: Traffic,
}

/// Who is away from a fleet, and the absence of each craft after that.
#[derive(Debug, Default)]
pub(super) struct Absences {
    pub(super) away: BTreeMap<String, Away>,
    pub(super) after: AbsenceOf,
}

pub(super) type AbsenceOf = BTreeMap<String, Option<Absence>>;

impl MissionState {
    pub(super) fn new(config: Live) -> Self {
        let fleet = config.surface_craft.iter().map(|craft| (craft.id.0.clone(), CraftState::default()));
        let (fleet, alone) = (fleet.collect(), CraftState::default());
        let (reports, traffic) = (BTreeMap::new(), Traffic::default());
        Self { config, reports, alone, fleet, assigned: None, traffic }
    }

    /// Applies an event. Only reports, assignments and changes of the setting change the state.
    pub(super) fn apply(&mut self, event: &Event, clock: &MissionClock) {
        match event {
            Event::Reported { heard, at_s } => self.take_reports(heard, clock.at(*at_s)),
            Event::Changed { setting, .. } => self.change(setting),
            Event::Assigned(assigned) => drop(self.replace_assigned(Some(assigned.clone()))),
            Event::Created { .. }
            | Event::Ran { .. }
            | Event::Paused { .. }
            | Event::Planned(_)
            | Event::ClockSet { .. }
            | Event::Finished { .. }
            | Event::Failed { .. } => {}
        }
    }

    /// Takes who serves whom, and returns who did before.
    pub(super) fn replace_assigned(&mut self, assigned: Option<Box<Assigned>>) -> Option<Box<Assigned>> {
        std::mem::replace(&mut self.assigned, assigned)
    }

    /// `true` if the mission is that of a fleet.
    pub(super) fn is_of_fleet(&self) -> bool {
        !self.config.surface_craft.is_empty()
    }

    /// The craft in the order of way, with the names of a fleet's.
    pub(super) fn each_craft(&self) -> impl Iterator<Item = (Option<&str>, &CraftState)> {
        let alone = (!self.is_of_fleet()).then_some((None, &self.alone));
        let names = self.config.surface_craft.iter().map(|craft| &*craft.id.0);
        let fleet = names.filter_map(|id| Some((Some(id), self.fleet.get(id)?)));
        alone.into_iter().chain(fleet)
    }

    /// The craft of that name, or the one of a mission of one.
    pub(super) fn craft(&self, id: Option<&str>) -> Option<&CraftState> {
        id.map_or(Some(&self.alone), |id| self.fleet.get(id))
    }

    pub(super) fn craft_mut(&mut self, id: Option<&str>) -> Option<&mut CraftState> {
        match id {
            None => Some(&mut self.alone),
            Some(id) => self.fleet.get_mut(id),
        }
    }

    fn all_craft_mut(&mut self) -> impl Iterator<Item = &mut CraftState> {
        [&mut self.alone].into_iter().chain(self.fleet.values_mut())
    }

    /// The last change of who serves whom in a fleet.
    pub(super) fn assigned(&self) -> Option<&Assigned> {
        self.assigned.as_deref()
    }

    pub(super) fn origin(&self) -> Option<Origin> {
        self.config.origin
    }

    /// `true` if the first fix on Earth can become the origin: no position in metres is known yet.
    pub(super) fn may_begin(&self) -> bool {
        let config = &self.config;
        let no_vessel = self.traffic.is_empty();
        let no_craft = self.each_craft().all(|(_, craft)| craft.asc.is_none());
        let nothing_heard = no_craft && no_vessel && self.reports.values().all(Vec::is_empty);
        let no_path = config.auvs.iter().all(|auv| auv.path.is_none());
        let no_bounds = config.keep_outs.is_empty() && config.no_go.is_empty() && config.area.is_empty();
        config.origin.is_none() && nothing_heard && no_bounds && no_path
    }

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
        let before = self.config.clone();
        setting.clone().exchange_with(&mut self.config);
        let names = self.config.surface_craft.iter().map(|craft| craft.id.0.clone());
        let mut known = std::mem::take(&mut self.fleet);
        self.fleet = names.map(|id| (id.clone(), known.remove(&id).unwrap_or_default())).collect();
        let Self { config, alone, fleet, .. } = self;
        let craft =
            [(None, alone)].into_iter().chain(fleet.iter_mut().map(|(id, craft)| (Some(&**id), craft)));
        for (id, craft) in craft {
            let Some(plan) = &mut craft.previous_plan else { continue };
            if before.goal.goal != config.goal.goal {
                plan.goal_course_rad = None;
            }
            let described = |config: &Live| {
                let (limits, craft) = of_craft(config, id);
                (limits.and_then(|limits| limits.surge_lag_s), craft.cloned())
            };
            if described(&before) != described(config)
                && let Some(craft) = &mut plan.craft_estimate
            {
                craft.memory.clear();
            }
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
        self.traffic.count_from(|north, east| change.position(north, east), is_near);
        self.all_craft_mut().for_each(|craft| craft.count_from(origin, &change, is_near));
    }

    /// Adds reports at `now` on the mission's clock, s. Keeps the newest 64 distinct fixes of each
    /// AUV and the newest craft state. Drops reports from before the clock was set back.
    fn take_reports(&mut self, heard: &Reports, now: f64) {
        for kept in self.reports.values_mut() {
            kept.retain(|fix| !is_ahead(fix.t_s, now));
        }
        self.all_craft_mut().for_each(|craft| craft.forget_after(now));
        self.config.origin = self.config.origin.or(heard.origin);
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
        if let Some(craft) = self.craft_mut(heard.craft.as_deref()) {
            craft.take(heard);
        }
        // Where craft are that are heard, or else where they were.
        let place = |craft: &CraftState| craft.asc.as_ref().map(|asc| asc.state.position());
        let all = || self.each_craft().map(|(_, craft)| craft);
        let mut here: Vec<_> = all().filter(|craft| craft.is_heard(now)).filter_map(place).collect();
        if here.is_empty() {
            here = all().filter_map(place).collect();
        }
        self.traffic.take(&heard.traffic, now, &here);
    }

    /// Says of each range without `from` where the craft was then, and rejects those of times of
    /// which no state of the craft within 2 s is known.
    pub(super) fn place_ranges(&self, heard: &mut Reports) {
        let craft = self.craft(heard.craft.as_deref());
        let track = craft.map_or_else(Vec::new, |craft| craft.track_with(heard));
        for (id, fixes) in &mut heard.auvs {
            let list = format!("/auvs/{}/", pointer_token(id));
            // A report's number in the body counts those that were rejected before.
            let rejected = heard.rejected.iter().filter_map(|wrong| wrong.pointer.strip_prefix(&list));
            let rejected = rejected.filter_map(|place| place.split('/').next()?.parse().ok());
            let rejected: BTreeSet<usize> = rejected.collect();
            let mut numbers = (0..).filter(|number| !rejected.contains(number));
            fixes.retain_mut(|fix| {
                let number = numbers.next().unwrap_or_default();
                fix.measure();
                if fix.is_range() && fix.from.is_none() {
                    fix.from = position_at(&track, fix.t_s);
                }
                let is_placed = !fix.is_range() || fix.from.is_some();
                if !is_placed {
                    let detail = format!(
                        "no state of the surface craft within {RANGE_FROM_WITHIN} s of the range at {:.1} s is known: post `asc` before, or say `from` \
                         where it was measured",
                        fix.t_s
                    );
                    heard.rejected.push(FieldError::new(format!("{list}{number}"), "missing", detail));
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

    /// The last report of whether the craft is steered; of a fleet, the worst.
    pub(super) fn steering(&self) -> Option<&Steering> {
        let said = self.each_craft().filter_map(|(_, craft)| craft.steering.as_ref());
        said.max_by_key(|said| severity(said.state))
    }

    /// The vehicles without the reports that a plan at `now` needs, s: the surface craft, if none
    /// is heard, or AUVs of the goal.
    pub(super) fn waits_for(&self, now: f64) -> Vec<String> {
        let is_heard = self.each_craft().any(|(_, craft)| craft.is_heard(now));
        let craft = self.each_craft().filter(|_| !is_heard).map(|(id, _)| name(id));
        let unheard = goal_members(&self.config).filter(|id| self.fixes(id, now).next().is_none());
        craft.chain(unheard.map(str::to_owned)).collect()
    }

    /// Fixes of an AUV that are valid at `now`.
    fn fixes(&self, id: &str, now: f64) -> impl Iterator<Item = &Report> {
        let fixes = self.reports.get(id).into_iter().flatten();
        fixes.filter(move |fix| !is_ahead(fix.t_s, now))
    }

    /// Time when each vehicle was last heard, on the mission's clock, s.
    pub(super) fn heard(&self) -> BTreeMap<String, f64> {
        let craft = self.each_craft().filter_map(|(id, craft)| Some((name(id), craft.asc.as_ref()?.t_s)));
        let newest = |(id, fixes): (&String, &Vec<Report>)| Some((id.clone(), fixes.last()?.t_s));
        craft.chain(self.reports.iter().filter_map(newest)).collect()
    }

    /// Who is away from the fleet at `now`, s.
    pub(super) fn absences(&self, now: f64) -> Absences {
        let (mut away, mut after) = (BTreeMap::new(), BTreeMap::new());
        let planned_at = self.fleet.values().filter_map(CraftState::planned_at);
        let newest = planned_at.fold(f64::NEG_INFINITY, f64::max);
        let all = &self.config.surface_craft;
        for (id, craft) in &self.fleet {
            let described = all.iter().find(|described| described.id.0 == *id);
            let battery_min = described.and_then(|described| described.battery_min);
            let (why, absence) = craft.away(now, battery_min);
            // After a silence of all, or of the service, nobody has been away.
            let has_missed = craft.planned_at().is_some_and(|at| at < newest);
            let is_absent = why != Some(Away::Silent) || has_missed;
            after.insert(id.clone(), if is_absent { absence } else { craft.absence });
            away.extend(why.map(|why| (id.clone(), why)));
        }
        // A craft that follows badly, or not for long, is better than none.
        let may_serve = |craft: &LiveCraft, auv: &str| {
            craft.serves.as_ref().is_none_or(|serves| serves.iter().any(|served| served.0 == auv))
        };
        let is_present = |craft: &&LiveCraft| !away.contains_key(&craft.id.0);
        let alone: Vec<&str> = goal_members(&self.config)
            .filter(|auv| !all.iter().filter(is_present).any(|craft| may_serve(craft, auv)))
            .collect();
        let needed = all.iter().filter(|craft| alone.iter().any(|auv| may_serve(craft, auv)));
        for craft in needed {
            let can = |why: &Away| {
                matches!(why, Away::DoesNotFollow | Away::Returning | Away::Waiting | Away::BatteryLow)
            };
            if away.get(&craft.id.0).is_some_and(can) {
                away.remove(&craft.id.0);
            }
        }
        Absences { away, after }
    }

    /// Takes the absence of each craft, and returns the one before.
    pub(super) fn replace_absences(&mut self, mut after: AbsenceOf) -> AbsenceOf {
        for (id, absence) in &mut after {
            if let Some(craft) = self.fleet.get_mut(id) {
                std::mem::swap(&mut craft.absence, absence);
            }
        }
        after
    }

    pub(super) fn fleet_view(&self, now: f64) -> Vec<CraftView> {
        let away = self.absences(now).away;
        let assignment = self.assigned.as_ref().map(|assigned| &assigned.assignment);
        let served = |id: &str| {
            let place = assignment.and_then(|all| all.craft.iter().position(|part| part.id.0 == id));
            let auvs = assignment.zip(place).into_iter().flat_map(|(all, place)| all.serves(place));
            auvs.map(|auv| auv.0.clone()).collect()
        };
        let named = self.each_craft().filter_map(|(id, craft)| Some((id?, craft)));
        named
            .map(|(id, craft)| CraftView {
                id: id.to_owned(),
                auvs: served(id),
                away: away.get(id).copied(),
                steering: craft.steering.clone(),
                battery: craft.battery(),
            })
            .collect()
    }

    /// The request for a plan at `now` on the mission's clock, s, with the other craft of the
    /// service; `None` while reports are missing.
    pub(super) fn request(&self, now: f64, own: &OwnCraft) -> Option<PlanRequest> {
        if !self.waits_for(now).is_empty() {
            return None;
        }
        self.request_of((None, &self.alone), now, (own, &[]))
    }

    /// The request for a fleet, as [`Self::request`], with those craft that are `away`.
    pub(super) fn fleet_request(
        &self,
        now: f64,
        own: &OwnCraft,
        away: &BTreeMap<String, Away>,
    ) -> Option<FleetRequest> {
        if !self.waits_for(now).is_empty() {
            return None;
        }
        let is_silent = |id: &str| away.get(id) == Some(&Away::Silent);
        let silent =
            self.each_craft().filter_map(|(id, craft)| Some((id.filter(|id| is_silent(id))?, craft)));
        let silent: Vec<_> = silent.filter_map(|(id, craft)| craft.as_silent_vessel(id.into())).collect();
        let member = |described: &LiveCraft| {
            let id = &*described.id.0;
            let craft = self.fleet.get(id)?;
            let request = self.request_of((Some(id), craft), now, (own, &silent))?;
            Some(as_member(described, away.contains_key(id), request))
        };
        let (craft, unheard): (Vec<_>, Vec<_>) =
            self.config.surface_craft.iter().partition(|craft| !is_silent(&craft.id.0));
        let craft: Vec<Member> = craft.into_iter().filter_map(member).collect();
        let first = craft.first()?;
        let gone = unheard.into_iter().map(|described| {
            let previous_plan = self.fleet.get(&described.id.0).and_then(|craft| craft.previous_plan.clone());
            as_member(described, true, PlanRequest { previous_plan, ..first.request.clone() })
        });
        let gone = gone.collect();
        let before = self.assigned.as_ref().map(|assigned| assigned.assignment.clone());
        Some(FleetRequest::new(craft, before, gone).handing_over(self.config.hand_over_s.unwrap_or(0.0)))
    }

    fn request_of(
        &self,
        (id, craft): (Option<&str>, &CraftState),
        now: f64,
        (own, silent): (&OwnCraft, &[Vessel]),
    ) -> Option<PlanRequest> {
        let CraftNow { asc, previous_plan, current } = craft.at(now, self.config.origin)?;
        let heard = |auv: &LiveAuv| {
            let fixes: Vec<Report> = self.fixes(&auv.id, now).map(|fix| aged(fix, now)).collect();
            (!fixes.is_empty()).then(|| known_by(fixes, auv))
        };
        let auvs = self.config.auvs.iter().filter_map(heard).collect();
        let mut request = request((&self.config, id), now, asc, auvs, previous_plan);
        let is_craft = |id: &str| self.fleet.contains_key(id);
        request.traffic = self.traffic.with((own, silent), request.asc.position(), is_craft);
        request.current = current.or(request.current);
        Some(request)
    }
}

/// The craft as a member of its fleet. It may serve AUVs once they are heard.
fn as_member(described: &LiveCraft, is_away: bool, request: PlanRequest) -> Member {
    let is_heard = |id: &&VehicleId| request.auvs.iter().any(|auv| auv.id == **id);
    let serves = described.serves.as_ref();
    let serves = serves.map(|serves| serves.iter().filter(is_heard).cloned().collect());
    Member { id: described.id.clone(), serves, is_away, place_before: 0, request }
}

/// The order in which states of steering call for an operator.
fn severity(state: SteeringState) -> u8 {
    match state {
        SteeringState::Steering => 0,
        SteeringState::Waiting => 1,
        SteeringState::Person => 2,
        SteeringState::Degraded => 3,
        SteeringState::NotSteering => 4,
    }
}

/// The name of a craft in lists of vehicles.
fn name(id: Option<&str>) -> String {
    id.unwrap_or("asc").to_owned()
}

fn goal_members(config: &Live) -> impl Iterator<Item = &str> {
    config.goal.goal.named().map(|VehicleId(id)| id.as_str())
}

/// Limits and description of the craft of that name, or of the one of a mission of one.
fn of_craft<'a>(
    config: &'a Live,
    id: Option<&str>,
) -> (Option<DeclaredLimits>, Option<&'a CraftDescription>) {
    match id {
        None => (config.limits, config.craft.as_ref()),
        Some(id) => {
            let craft = config.surface_craft.iter().find(|craft| craft.id.0 == id);
            craft.map_or((None, None), |craft| (craft.limits, craft.craft.as_ref()))
        }
    }
}

fn request(
    (config, id): (&Live, Option<&str>),
    now: f64,
    asc: Asc,
    auvs: Vec<Auv>,
    previous_plan: Option<PreviousPlan>,
) -> PlanRequest {
    let (limits, craft) = of_craft(config, id);
    PlanRequest {
        origin: config.origin,
        current: config.current,
        limits,
        craft: craft.cloned(),
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

/// The request of a mission with all vehicles at rest at the datum, for the craft of that name, if
/// it is one of a fleet; valid for valid missions.
pub(super) fn trial_request((config, id): (&Live, Option<&str>), now: f64) -> PlanRequest {
    let fix = Report::new(now, Vector2::zeros(), 1.0);
    let auvs = config.auvs.iter().map(|auv| known_by(vec![fix], auv));
    let asc = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.0);
    request((config, id), now, asc, auvs.collect(), None)
}

#[cfg(test)]
mod tests {
    use planner::parameters::Parameters;
    use planner::plan::{Workspace, plan};
    use planner::snapshot::Snapshot;
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
        let request = state.request(now, &OwnCraft::default()).expect("waits for no vehicle");
        wire::snapshot(request).expect("is valid")
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
        ranges.rejected =
            vec![FieldError::new("/auvs/a/0/range_m", "out_of_range", "was the first in the body")];
        state.place_ranges(&mut ranges);
        let from: Vec<_> = ranges.auvs["a"].iter().map(|range| range.from).collect();
        assert_eq!(from, [Some([7.5, 0.0]), Some([8.0, 0.0])]);
        let rejected: Vec<_> = ranges.rejected.iter().map(|wrong| (&*wrong.pointer, &*wrong.code)).collect();
        assert_eq!(rejected, [("/auvs/a/0/range_m", "out_of_range"), ("/auvs/a/2", "missing")]);
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
        before.alone.previous_plan = Some(PreviousPlan::from(&plan));
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
            let [before, after] = before_and_after(change.clone()).map(|state| state.alone.previous_plan);
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
        state.alone.asc.as_mut().expect("is heard").steered = false;
        // The craft's motion: 1 m/s to the north. The learnt values stay.
        assert_eq!(asked(&state), (1.0, 0.0, steered.2));
    }

    #[test]
    fn nothing_is_learnt_for_ten_seconds_after_a_person_handed_the_craft_back() {
        let [mut state, _] = before_and_after(json!({ "craft": null }));
        state.alone.asc.as_mut().expect("is heard").steered = false;
        let mut asked = |t_s: f64| {
            state.take_reports(&heard(t_s, t_s), t_s);
            let request = state.request(t_s, &OwnCraft::default()).expect("waits for no vehicle");
            let plan = request.previous_plan.expect("is there");
            let craft = plan.craft_estimate.expect("is there");
            (plan.reference.map(|asked| asked.speed_mps), craft.asked_speed_mps, craft.asked_heading_rad)
        };
        let [first, last, then] = [11.0, 20.9, 21.0].map(&mut asked);
        assert_eq!([(first.1, first.2), (last.1, last.2)], [(1.0, 0.0); 2]);
        assert_ne!((then.1, then.2), (1.0, 0.0));
        // Its references go on.
        assert_eq!(first.0, then.0);
    }

    #[test]
    fn nothing_is_learnt_of_a_silent_craft_and_its_references_continue() {
        let [state, _] = before_and_after(json!({ "craft": null }));
        let heard_s = state.alone.asc.as_ref().expect("is heard").t_s;
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
        state.alone.asc.as_mut().expect("is heard").current = Some(current(0.3).expect("has the shape"));
        assert_eq!(east(&state), Some(0.3));
    }
}
