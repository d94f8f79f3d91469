//! What is known of a live mission: a fold over its events, and the request that it comes to.

use std::collections::BTreeMap;

use planner::snapshot::{REPORTS_MAX, Snapshot};
use serde::{Deserialize, Serialize};

use crate::{
    problem::FieldError,
    wire::{
        Asc, Auv, Fallback, PlanRequest, PreviousPlan, Report, SCHEMA_VERSION,
        mission::{AscReport, Live, LiveAuv, Reports},
    },
};

/// How long the surface craft's last state is carried on by its velocity, s. After that nobody knows where it is, and
/// there is no plan.
pub(super) const ASC_AGE_MAX: f64 = 10.0;

/// How far ahead of the service's clock that of a vehicle may be, s of the mission's clock.
pub(super) const AHEAD_MAX: f64 = 1.0;

/// What the planner is asked with, but for the time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Known {
    config: Live,
    /// The newest of each vehicle, in order of time.
    reports: BTreeMap<String, Vec<Report>>,
    asc: Option<AscReport>,
    previous_plan: Option<PreviousPlan>,
}

impl Known {
    /// Nothing but what the client said when it made the mission.
    pub(super) fn new(config: Live) -> Self {
        Self {
            config,
            reports: BTreeMap::new(),
            asc: None,
            previous_plan: None,
        }
    }

    /// Takes up what was heard at `now` on the mission's clock, s: of each vehicle the newest 64 fixes, each once; of the
    /// surface craft the newest state. What is said to be of later is from before the clock was set back, and forgotten.
    pub(super) fn hear(&mut self, heard: &Reports, now: f64) {
        for kept in self.reports.values_mut() {
            kept.retain(|fix| !is_ahead(fix.t_s, now));
        }
        self.asc.take_if(|asc| is_ahead(asc.t_s, now));
        for (id, fixes) in &heard.auvs {
            let kept = self.reports.entry(id.clone()).or_default();
            for fix in fixes {
                let place = kept.partition_point(|earlier| earlier.t_s <= fix.t_s);
                let same_time = kept[..place]
                    .iter()
                    .rev()
                    .take_while(|earlier| earlier.t_s >= fix.t_s);
                if same_time.into_iter().all(|earlier| earlier != fix) {
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
    }

    /// Takes up what was answered.
    pub(super) fn answered(&mut self, plan: PreviousPlan) {
        self.previous_plan = Some(plan);
    }

    /// Of whom nothing is known that a plan at `now`, Unix time, s, could rest on: `asc`, or AUVs of the goal.
    pub(super) fn waits_for(&self, now: f64) -> Vec<String> {
        let asc = self.asc.as_ref();
        let asc = asc.filter(|asc| now - asc.t_s <= ASC_AGE_MAX && !is_ahead(asc.t_s, now));
        let asc = asc.is_none().then(|| "asc".to_owned());
        let unheard = goal_members(&self.config).filter(|id| self.fixes(id, now).next().is_none());
        asc.into_iter().chain(unheard.map(str::to_owned)).collect()
    }

    /// What is known of an AUV at `now`.
    fn fixes(&self, id: &str, now: f64) -> impl Iterator<Item = &Report> {
        let fixes = self.reports.get(id).into_iter().flatten();
        fixes.filter(move |fix| !is_ahead(fix.t_s, now))
    }

    /// When each of those that a plan rests on was last heard, Unix time, s: `asc` and the AUVs.
    pub(super) fn heard(&self) -> BTreeMap<String, f64> {
        let asc = self.asc.iter().map(|asc| ("asc".to_owned(), asc.t_s));
        let newest = |(id, fixes): (&String, &Vec<Report>)| Some((id.clone(), fixes.last()?.t_s));
        asc.chain(self.reports.iter().filter_map(newest)).collect()
    }

    /// The facts for a plan at `now` on the mission's clock, s; none as long as the mission waits for somebody. A previous
    /// plan that makes no valid snapshot, such as one that leads beyond all coordinates, is left out.
    pub(super) fn snapshot(&self, now: f64) -> Option<Result<Snapshot, Vec<FieldError>>> {
        let mut request = self.request(now)?;
        Some(Snapshot::try_from(&request).or_else(|_| {
            request.previous_plan = None;
            Snapshot::try_from(&request)
        }))
    }

    fn request(&self, now: f64) -> Option<PlanRequest> {
        if !self.waits_for(now).is_empty() {
            return None;
        }
        let asc = self.asc.as_ref()?;
        let auv = |auv: &LiveAuv| {
            let fixes: Vec<Report> = self.fixes(&auv.id, now).map(|fix| aged(fix, now)).collect();
            (!fixes.is_empty()).then(|| Auv {
                id: auv.id.clone(),
                state: None,
                reports: Some(fixes),
                path: auv.path.clone(),
                dive: auv.dive,
            })
        };
        Some(request(
            &self.config,
            now,
            carried(&asc.state, now - asc.t_s, self.previous_plan.as_ref()),
            self.config.auvs.iter().filter_map(auv).collect(),
            self.previous_plan.clone(),
        ))
    }
}

/// Whether a time lies in the future of a clock that shows `now`, s, by more than clocks differ.
fn is_ahead(time: f64, now: f64) -> bool {
    now + AHEAD_MAX < time
}

/// The AUVs that the goal names.
fn goal_members(config: &Live) -> impl Iterator<Item = &str> {
    let goal = &config.goal;
    let one = goal.auv.iter();
    let several = goal.auvs.iter().flatten();
    let weighted = goal.weights.iter().flatten().map(|(id, _)| id);
    one.chain(several).chain(weighted).map(String::as_str)
}

fn request(
    config: &Live,
    now: f64,
    asc: Asc,
    auvs: Vec<Auv>,
    previous_plan: Option<PreviousPlan>,
) -> PlanRequest {
    PlanRequest {
        schema_version: SCHEMA_VERSION.to_owned(),
        t_s: now,
        asc,
        auvs,
        goal: config.goal.clone(),
        current: config.current,
        limits: config.limits.clone(),
        craft: config.craft.clone(),
        keep_outs: config.keep_outs.clone(),
        area: config.area.clone(),
        acoustics: config.acoustics,
        surfacing_separation_m: config.surfacing_separation_m,
        forecast: config.forecast,
        fallback: Fallback::Los,
        hold: config.hold,
        deadline_ms: None,
        previous_plan,
        metadata: serde_json::Map::new(),
    }
}

/// A fix as a request takes it: what a clock dates ahead counts as from now.
fn aged(fix: &Report, now: f64) -> Report {
    Report {
        t_s: fix.t_s.min(now),
        ..*fix
    }
}

/// The surface craft `age` seconds after its state: on its way over ground, its heading and speed as they were.
fn carried(asc: &Asc, age: f64, previous: Option<&PreviousPlan>) -> Asc {
    let (sin, cos) = asc.heading_rad.sin_cos();
    let through_water = (
        asc.speed_mps * cos - asc.sway_mps * sin,
        asc.speed_mps * sin + asc.sway_mps * cos,
    );
    let current = previous.and_then(|plan| plan.current);
    let current = current.map_or((0.0, 0.0), |current| (current.north_mps, current.east_mps));
    let north = asc.ground_north_mps.unwrap_or(through_water.0 + current.0);
    let east = asc.ground_east_mps.unwrap_or(through_water.1 + current.1);
    let age = age.max(0.0);
    Asc {
        north_m: asc.north_m + north * age,
        east_m: asc.east_m + east * age,
        ..*asc
    }
}

/// The request of a mission where everybody lies still at the datum, to check by what a snapshot would be refused for.
pub(super) fn trial(config: &Live, now: f64) -> PlanRequest {
    let fix = Report {
        t_s: now,
        north_m: 0.0,
        east_m: 0.0,
        sigma_m: 1.0,
        depth_m: None,
        course_rad: None,
        speed_mps: None,
        turn_rate_radps: None,
    };
    let auv = |auv: &LiveAuv| Auv {
        id: auv.id.clone(),
        state: None,
        reports: Some(vec![fix]),
        path: auv.path.clone(),
        dive: auv.dive,
    };
    let asc = Asc {
        north_m: 0.0,
        east_m: 0.0,
        heading_rad: 0.0,
        speed_mps: 0.0,
        sway_mps: 0.0,
        yaw_rate_radps: 0.0,
        ground_north_mps: None,
        ground_east_mps: None,
    };
    request(config, now, asc, config.auvs.iter().map(auv).collect(), None)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn known() -> Known {
        let config = json!({
            "auvs": [{ "id": "a" }, { "id": "b" }],
            "goal": { "kind": "weighted", "weights": { "a": 1.0, "b": 0.0 } },
        });
        Known::new(serde_json::from_value(config).expect("has the shape"))
    }

    /// Fixes of a and b, and a state of the surface craft going north at 1 m/s, `north` m north of the datum.
    fn heard(t_s: f64, north: f64) -> Reports {
        let fix = json!([{ "t_s": t_s, "north_m": north, "east_m": 5.0, "sigma_m": 1.0 }]);
        let heard = json!({ "auvs": { "a": fix, "b": fix }, "asc": [{ "t_s": t_s, "state": { "north_m": north,
            "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 1.0, "sway_mps": 0.0, "yaw_rate_radps": 0.0 } }] });
        serde_json::from_value(heard).expect("has the shape")
    }

    #[test]
    fn the_surface_craft_is_carried_on_for_ten_seconds_and_everybody_of_the_goal_is_waited_for() {
        let mut known = known();
        assert_eq!(known.waits_for(0.0), ["asc", "a", "b"]);
        known.hear(&heard(100.0, 7.0), 100.0);
        let north = |now: f64| known.request(now).expect("all are heard").asc.north_m;
        assert_eq!([north(100.0), north(104.0), north(110.0)], [7.0, 11.0, 17.0]);
        assert_eq!(known.waits_for(110.1), ["asc"]);
    }

    #[test]
    fn the_order_in_which_fixes_come_and_how_often_changes_nothing() {
        let (mut in_order, mut shuffled) = (known(), known());
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        for &time in &times {
            in_order.hear(&heard(time, time), 100.0);
        }
        for k in 0..300 {
            let time = times[(37 * k) % 100];
            shuffled.hear(&heard(time, time), 100.0);
        }
        assert_eq!(in_order, shuffled);
        assert_eq!(in_order.reports["a"].len(), REPORTS_MAX);
        assert_eq!(in_order.reports["a"][0].t_s, 36.0);
    }

    #[test]
    fn what_was_heard_before_the_clock_was_set_back_is_not_taken_for_news() {
        let mut known = known();
        known.hear(&heard(1800.0, 500.0), 1800.0);
        // Half an hour back.
        assert_eq!(known.waits_for(0.0), ["asc", "a", "b"]);
        known.hear(&heard(1.0, 3.0), 1.0);
        let request = known.request(1.0).expect("all are heard again");
        assert_eq!(request.asc.north_m, 3.0);
        let fixes = request.auvs[0].reports.as_ref().expect("are there");
        assert_eq!(fixes.iter().map(|fix| fix.north_m).collect::<Vec<_>>(), [3.0]);
    }

    #[test]
    fn a_previous_plan_that_leads_beyond_all_coordinates_ends_no_mission() {
        let mut known = known();
        known.hear(&heard(10.0, 1e6), 10.0);
        let beyond = json!({ "trajectory": [{ "t_s": 9.0, "north_m": 2e6, "east_m": 0.0, "speed_mps": 1.0,
            "heading_rad": 0.0 }] });
        known.answered(serde_json::from_value(beyond).expect("has the shape"));
        known
            .snapshot(10.0)
            .expect("waits for nobody")
            .expect("is made without it");
    }
}
