//! The chosen manoeuvre: the cheapest, unless the present one is almost as good.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector2;

use crate::avoid::encounter::{SPEED_UNDER_WAY, closest_approach, kind};
use crate::avoid::scene::Scene;
use crate::avoid::sentence::sentence;
use crate::avoid::trial::{Outcome, Trial};
use crate::craft::model::CraftModel;
use crate::facts::angle::{ned_from_body, wrap};
use crate::facts::previous_plan::PreviousPlan;
use crate::facts::traffic::{Avoidance, Encounter, EncounterKind, Manoeuvre, PastVessel};
use crate::predict::goal::{GoalForecast, Way};
use crate::predict::vessel::VesselForecast;
use crate::snapshot::build::Snapshot;

/// Turns that are tried, from the course to the goal, rad: the least is one that others see.
const TURNS: [f64; 8] = [0.26, 0.52, 0.79, 1.05, 1.57, 2.09, 2.62, PI];

/// Times for which a manoeuvre is held, as shares of the time until the last vessel is past.
const HOLDS: [f64; 5] = [0.35, 0.6, 0.85, 1.1, 1.4];

/// Changes of the present manoeuvre, rad and s: vessels then pass on the sides that they had.
const NEAR_TURNS: [f64; 7] = [0.0, 0.17, -0.17, 0.35, -0.35, 0.7, -0.7];
const NEAR_HOLDS: [f64; 3] = [-40.0, 0.0, 40.0];

/// Least time for which it is held, s.
const HOLD_LEAST: f64 = 20.0;

/// Speeds, as shares of the largest.
const SPEEDS: [f64; 3] = [1.0, 0.5, 0.0];

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
            other.side = met.filter(|met| met.acts).map(|encounter| encounter.starboard_m);
        }
        // 1. Straight for the goal: who would come too near?
        let direct = Trial { heading: None, speed: self.craft.limits.speed_max, until: 0.0, doubt: 1.0 };
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
            let is_time = passing.too_near.is_none_or(|time| time < share * leaves);
            let has_begun = before.is_some_and(|before| before.acts);
            acts[i] = met != EncounterKind::KeepClear && (is_time || has_begun);
        }
        // 2. The manoeuvre.
        let present = known.and_then(|known| known.manoeuvre);
        let heading = snapshot.asc.heading().radians();
        let kept = present.map(|present| Trial {
            heading: Some(wrap(present.heading_rad - heading)),
            speed: present.speed_mps,
            until: present.until_s - snapshot.t_s,
            doubt: scene.tuned.kept_doubt,
        });
        let kept = kept.filter(|kept| 0.0 < kept.until);
        let best = if acts.contains(&true) { self.best(&scene, kept, &acts, &straight) } else { None };
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
            heading_rad: wrap(trial.heading.unwrap_or(0.0) + heading),
            speed_mps: trial.speed,
            until_s: snapshot.t_s + trial.until,
        });
        let avoidance = Avoidance {
            encounters: encounters(snapshot, &scene, &outcome, &acts),
            manoeuvre,
            vessels: scene.others.iter().map(|other| past(snapshot, &other.forecast, heading)).collect(),
            sentence: sentence(snapshot, &scene, &outcome, &acts, (!is_direct).then_some(&trial)),
        };
        let waits = |i: usize| !acts[i] && scene.others[i].kind.is_some_and(EncounterKind::stands_on);
        let waiting: Vec<usize> =
            (0..acts.len()).filter(|i| waits(*i)).map(|i| scene.others[i].forecast.vessel).collect();
        let vessels = VesselForecast::all(snapshot).filter(|vessel| !waiting.contains(&vessel.vessel));
        let way = (!is_direct).then(|| Way { places: way, is_open: goal.is_reachable() });
        Some(Kept { avoidance, way, vessels: vessels.collect() })
    }

    /// The cheapest trial, with the present one `kept`; none if that is straight for the goal.
    fn best(
        &self,
        scene: &Scene<'_>,
        kept: Option<Trial>,
        acts: &[bool],
        straight: &Outcome,
    ) -> Option<(Trial, Outcome)> {
        let acting = straight.passings.iter().zip(acts).filter(|(_, acts)| **acts);
        let past = acting.map(|(passing, _)| passing.time).fold(0.0, f64::max);
        let limits = &self.craft.limits;
        let (change, doubt) = (scene.tuned.change_price, 1.0);
        let mut best: Option<(Trial, Outcome, f64)> = None;
        let mut consider = |trial: Trial, price: f64| {
            let least = best.as_ref().map_or(f64::INFINITY, |(_, _, least)| *least);
            if let Some(outcome) = scene.sail(&trial, least - price, |_| {}) {
                let cost = outcome.cost + price;
                best = Some((trial, outcome, cost));
            }
        };
        if let Some(kept) = kept {
            consider(kept, 0.0);
            for until in NEAR_HOLDS.map(|more| (kept.until + more).max(HOLD_LEAST)) {
                for turn in NEAR_TURNS {
                    for speed in [kept.speed, limits.speed_max] {
                        let heading = kept.heading.map(|heading| wrap(heading + turn));
                        consider(Trial { heading, speed, until, doubt }, change);
                    }
                }
            }
        }
        consider(Trial { heading: None, speed: limits.speed_max, until: 0.0, doubt }, change);
        let goal = &scene.goal[0];
        let wanted = goal.velocity + goal.position * scene.tuned.pursuit_rate - scene.current;
        let to_goal = wanted.y.atan2(wanted.x);
        // Who stands on does not turn to port for a vessel on its own port side (rule 17 c).
        let stands_on = |(other, acts): (&crate::avoid::scene::Other, &bool)| {
            *acts && other.kind == Some(EncounterKind::CrossingStandOn)
        };
        let to_port = if scene.others.iter().zip(acts).any(stands_on) { scene.tuned.side_price } else { 0.0 };
        'trials: for until in HOLDS.map(|share| (share * past).clamp(HOLD_LEAST, scene.tuned.look_ahead)) {
            for share in SPEEDS {
                let speed = (share * limits.speed_max).max(limits.speed_min);
                if share < 1.0 {
                    let slower = (share * wanted.norm().min(limits.speed_max)).max(limits.speed_min);
                    consider(Trial { heading: None, speed: slower, until, doubt }, change);
                }
                for turn in TURNS.into_iter().filter(|_| 0.0 < share) {
                    if (self.due)() {
                        break 'trials;
                    }
                    for (side, price) in [(1.0, 0.0), (-1.0, to_port)] {
                        let heading = Some(wrap(to_goal + side * turn));
                        consider(Trial { heading, speed, until, doubt }, change + price);
                    }
                }
            }
        }
        best.filter(|(trial, ..)| 0.0 < trial.until).map(|(trial, outcome, _)| (trial, outcome))
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
