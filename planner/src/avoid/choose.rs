//! The chosen manoeuvre: the cheapest, unless the present one is almost as good.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

use crate::avoid::encounter::{SPEED_UNDER_WAY, closest_approach, kind};
use crate::avoid::scene::Scene;
use crate::avoid::search::Search;
use crate::avoid::sentence::sentence;
use crate::avoid::trial::{Leg, Outcome, Trial};
use crate::craft::model::CraftModel;
use crate::facts::angle::{ned_from_body, wrap};
use crate::facts::previous_plan::PreviousPlan;
use crate::facts::traffic::{Avoidance, Encounter, EncounterKind, Manoeuvre, PastVessel};
use crate::predict::goal::{GoalForecast, Way};
use crate::predict::vessel::VesselForecast;
use crate::snapshot::build::Snapshot;

/// Longest time since a previous plan with a manoeuvre, s.
const REMEMBERED: f64 = 60.0;

/// Time of the way that takes the place of the goal, s: longer than a horizon.
const WAY: f64 = 120.0;

/// Chooses how the craft keeps clear of other vessels.
pub(crate) struct Avoider<'a> {
    pub(crate) craft: CraftModel,
    pub(crate) due: &'a dyn Fn() -> bool,
}

/// The chosen way, with the vessels from which the program keeps the craft clear.
pub(crate) struct Kept {
    pub(crate) avoidance: Avoidance,
    pub(crate) way: Option<Way>,
    pub(crate) vessels: Vec<VesselForecast>,
}

impl Avoider<'_> {
    /// The way to `goal` clear of the vessels of `snapshot`; none if none could come near.
    pub(crate) fn avoid(&self, snapshot: &Snapshot, goal: &GoalForecast) -> Option<Kept> {
        let mut scene = Scene::new(snapshot, goal, self.craft)?;
        let previous = snapshot.previous_plan.as_ref();
        let elapsed = previous.and_then(PreviousPlan::made_at).map(|made| snapshot.t_s - made);
        let young = elapsed.is_some_and(|elapsed| (0.0..=REMEMBERED).contains(&elapsed));
        let known = previous.and_then(|plan| plan.avoidance.as_ref()).filter(|_| young);
        let remembered = |vessel: usize| {
            let id = &snapshot.traffic[vessel].id;
            known?.encounters.iter().find(|encounter| encounter.vessel == *id)
        };
        for other in &mut scene.others {
            let met = remembered(other.forecast.vessel);
            other.kind = met.map(|encounter| encounter.kind);
            // A pass right ahead or astern has no side, and one after the look-ahead is not planned.
            let has_side = |met: &&Encounter| {
                let is_beside = 0.5 * met.passes_m < met.starboard_m.abs();
                met.acts && is_beside && met.tcpa_s < scene.tuned.look_ahead
            };
            other.side = met.filter(has_side).map(|encounter| encounter.starboard_m);
        }
        // 1. Straight for the goal: who would come too near?
        let leg = Leg { heading: None, speed: self.craft.limits.speed_max, until: 0.0 };
        let direct = Trial { leg, then: None, doubt: 1.0 };
        let straight = scene.sail(&direct, f64::INFINITY, |_| {})?;
        let course = scene.course();
        let mut acts = vec![false; scene.others.len()];
        for (i, passing) in straight.passings.iter().enumerate() {
            let other = &mut scene.others[i];
            let before = remembered(other.forecast.vessel);
            let radius = other.forecast.radius(0.0);
            let margin = if before.is_some() { scene.tuned.end_margin * radius } else { 0.0 };
            if margin <= passing.clearance && !passing.is_wrong_side {
                other.kind = None;
                continue;
            }
            // One that sails by a plan meets the craft with the velocity of that time, and gives no way.
            let is_planned = other.forecast.has_plan();
            let velocity = other.forecast.velocity_at(if is_planned { passing.time } else { 0.0 });
            let met = other.kind.unwrap_or_else(|| kind(&course, &other.forecast.position, &velocity));
            let is_to_move = met == EncounterKind::KeepClear && SPEED_UNDER_WAY <= velocity.norm();
            let met = match met {
                met if is_planned && (met.stands_on() || is_to_move) => EncounterKind::CrossingGiveWay,
                met => met,
            };
            other.kind = Some(met);
            let limits = &self.craft.limits;
            let leaves = radius / limits.speed_max + FRAC_PI_2 / limits.turn_rate_max;
            let share = if met.stands_on() { scene.tuned.late_share } else { scene.tuned.early_share };
            // A vessel that would pass clear, but barely or on the wrong side, counts from its pass.
            let is_time = passing.too_near.unwrap_or(passing.time) < share * leaves;
            let has_begun = before.is_some_and(|before| before.acts);
            acts[i] = met != EncounterKind::KeepClear && (is_time || has_begun);
        }
        // 2. The manoeuvre.
        let present = known.and_then(|known| known.manoeuvre);
        let heading = snapshot.asc.heading().radians();
        let kept = present.map(|present| Leg {
            heading: Some(wrap(present.heading_rad - heading)),
            // The limits may be others by now.
            speed: present.speed_mps.clamp(self.craft.limits.speed_min, self.craft.limits.speed_max),
            until: present.until_s - snapshot.t_s,
        });
        let kept = kept.filter(|kept| 0.0 < kept.until);
        let search = acts.contains(&true).then(|| Search::new(&scene, self.due, &acts, &straight));
        let best = search.and_then(|search| search.best(kept));
        let (trial, outcome) = best.unwrap_or((direct, straight.clone()));
        let is_direct = trial == direct;
        // 3. The answer.
        let mut way = Vec::new();
        let (dt, turned) = (scene.dt(), ned_from_body(heading));
        let mut collect = |place: Vector2<f64>| {
            let time = dt * way.len() as f64;
            if time <= WAY {
                way.push((time, snapshot.asc.position() + turned * place));
            }
        };
        if !is_direct {
            let _ = scene.sail(&trial, f64::INFINITY, &mut collect);
        }
        let manoeuvre = (!is_direct).then(|| Manoeuvre {
            heading_rad: wrap(trial.leg.heading.unwrap_or(0.0) + heading),
            speed_mps: trial.leg.speed,
            until_s: snapshot.t_s + trial.leg.until,
        });
        let avoidance = Avoidance {
            encounters: encounters(snapshot, &scene, &outcome, &acts),
            manoeuvre,
            vessels: scene.others.iter().map(|other| past(snapshot, &other.forecast, heading)).collect(),
            sentence: sentence(snapshot, &scene, &outcome, &acts, (!is_direct).then_some(&trial.leg)),
        };
        let waits = |i: usize| !acts[i] && scene.others[i].kind.is_some_and(EncounterKind::stands_on);
        let waiting: Vec<usize> =
            (0..acts.len()).filter(|i| waits(*i)).map(|i| scene.others[i].forecast.vessel).collect();
        let vessels = VesselForecast::all(snapshot).filter(|vessel| !waiting.contains(&vessel.vessel));
        let way = (!is_direct).then(|| Way { places: way, is_open: goal.is_reachable() });
        Some(Kept { avoidance, way, vessels: vessels.collect() })
    }
}

/// The averaged velocity of a vessel, whose `forecast` is in the craft's axes, for the next plan.
fn past(snapshot: &Snapshot, forecast: &VesselForecast, heading: f64) -> PastVessel {
    let (vessel, velocity) = (&snapshot.traffic[forecast.vessel], ned_from_body(heading) * forecast.velocity);
    PastVessel {
        id: vessel.id.clone(),
        t_s: snapshot.t_s - snapshot.vessel_age(vessel),
        north_mps: velocity.x,
        east_mps: velocity.y,
        count: forecast.count,
    }
}

fn encounters(snapshot: &Snapshot, scene: &Scene<'_>, outcome: &Outcome, acts: &[bool]) -> Vec<Encounter> {
    let velocity = Vector2::new(scene.speed_now, 0.0) + scene.current;
    let met = scene.others.iter().zip(&outcome.passings).zip(acts);
    met.filter_map(|((other, passing), acts)| {
        let forecast = &other.forecast;
        let (cpa_m, tcpa_s) = closest_approach(&forecast.position, &(forecast.velocity - velocity));
        Some(Encounter {
            vessel: snapshot.traffic[forecast.vessel].id.clone(),
            kind: other.kind?,
            acts: *acts,
            cpa_m,
            tcpa_s,
            passes_m: passing.distance,
            starboard_m: passing.place.y,
            separation_m: forecast.radius(0.0),
        })
    })
    .collect()
}
