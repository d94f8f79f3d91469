//! A plan's predictions, thinned for people: small enough to keep with every plan of a mission.

use nalgebra::{Matrix2, Vector2};
use planner::{
    plan::{Plan, PlannedTarget, RouteFit, Violation},
    snapshot::{Auv, Avoidance, Dive, Figure, Schedule, Snapshot},
    vessel::{VesselNow, vessels_now},
};
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use super::CraftFrame;
use super::response::{PlanResponse, Warning};

/// Most times: a picture of some hundred pixels shows no more.
const TIMES_MAX: usize = 13;
/// Positions and depths are kept to a centimetre, angles and speeds to 1/10,000.
const CENTI: f64 = 100.0;
const TEN_THOUSANDTH: f64 = 10_000.0;

/// A plan's predictions at some of its times. Positions are (north, east) from the datum, m.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Prediction {
    /// The times, s after the plan's, ascending.
    pub after_s: Vec<f64>,
    /// The planned trajectory.
    pub asc: Vec<[f64; 2]>,
    /// Expected positions of the goal.
    pub goal: Vec<[f64; 2]>,
    /// Visits of underwater vehicles, for a goal of the kind `visit`.
    pub schedule: Option<Schedule>,
    /// The figure that the craft sails, for a goal of the kind `localise`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub figure: Option<Figure>,
    /// Encounters with other vessels, and the manoeuvre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub avoidance: Option<Avoidance>,
    /// The vessels of the request that the plan still knows of, as forecast.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vessels: Vec<PredictedVessel>,
    /// Trajectory of the line-of-sight law.
    pub line_of_sight: Vec<[f64; 2]>,
    /// The underwater vehicles.
    pub auvs: Vec<PredictedAuv>,
    /// Reference of the line-of-sight law.
    pub line_of_sight_reference: SteerBy,
    /// Predicted distance to the goal over the plan's horizon, root mean square, m.
    pub rms_m: f64,
    /// The same for the line-of-sight law, m.
    pub line_of_sight_rms_m: f64,
    /// Predicted cost, by which the answer was chosen, m² s; none in plans of earlier versions.
    pub cost: Option<f64>,
    /// Predicted cost of the line-of-sight law, m² s.
    pub line_of_sight_cost: Option<f64>,
    /// Current (north, east) that the plan uses, m/s, if known.
    pub current: Option<[f64; 2]>,
    /// Estimate of the craft.
    pub craft: PredictedCraft,
    /// Soft limits that the plan does not keep.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub violations: Vec<Violation>,
    /// Warnings of the answer.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
}

/// Expected positions of an underwater vehicle at the times of a prediction.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PredictedAuv {
    /// The vehicle.
    pub id: String,
    /// Positions.
    pub positions: Vec<[f64; 2]>,
    /// Depths, m, positive down.
    pub depths_m: Vec<f64>,
    /// Covariances of the positions: of north, of north and east, of east, m².
    pub covariances_m2: Vec<[f64; 3]>,
    /// Two possible places (north, east), m, with their probabilities, if the ranges do not tell
    /// which is right. The positions are then their mean.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<[f64; 3]>,
    /// Age of the newest report that the forecast rests on, s.
    pub age_s: f64,
    /// The newest fix; none if the request gave a state.
    pub heard: Option<Heard>,
    /// Times of fixes that the estimate does not use, on the mission's clock, s.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub refused_t_s: Vec<f64>,
    /// Part of its velocity (north, east) that reports and model do not explain, m/s.
    pub drift: [f64; 2],
    /// Its fit to its path or to a repeated track, at its newest report.
    pub route: Option<RouteFit>,
    /// The sawtooth in which it dives, by its reported depths.
    pub dive: Option<Dive>,
}

/// A vessel now, by its last position.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PredictedVessel {
    /// Its identity.
    pub id: String,
    /// Its name.
    pub name: Option<String>,
    /// Position (north, east) from the datum, m.
    pub position: [f64; 2],
    /// Velocity over ground (north, east), m/s, if known.
    pub velocity: Option<[f64; 2]>,
    /// Distance that the craft keeps from that position, m.
    pub separation_m: f64,
    /// Age of the last position, s.
    pub age_s: f64,
}

/// A fix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Heard {
    /// Time of sending, on the mission's clock, s.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
}

/// A speed and a heading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SteerBy {
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Heading, rad, in (−π, π].
    pub heading_rad: f64,
}

/// Likeliest values of the craft's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PredictedCraft {
    /// Lag of the heading behind a steadily turning reference, s.
    pub heading_lag_s: f64,
    /// Steady offset of the heading from its reference, rad.
    pub heading_offset_rad: f64,
    /// Lag of the speed behind a steadily rising reference, s.
    pub surge_lag_s: f64,
    /// Disturbance of the speed loop: its acceleration at zero error, m/s².
    pub surge_bias_mps2: f64,
    /// Sway per surge and yaw rate, s.
    pub sway_per_yaw_rate_s: f64,
    /// `true` if the craft moves as predicted.
    pub follows: bool,
}

/// The vessel as people see it.
fn vessel(
    snapshot: &Snapshot,
    seen: &VesselNow,
    placed: &impl Fn(&Vector2<f64>) -> [f64; 2],
) -> PredictedVessel {
    let vessel = &snapshot.traffic[seen.vessel];
    PredictedVessel {
        id: vessel.id.0.clone(),
        name: vessel.name.clone(),
        position: placed(&seen.position),
        velocity: seen.velocity.map(|velocity| [rounded(velocity.x, CENTI), rounded(velocity.y, CENTI)]),
        separation_m: rounded(seen.separation, CENTI),
        age_s: rounded(snapshot.vessel_age(vessel), CENTI),
    }
}

impl Prediction {
    /// The predictions of `plan`, made for `snapshot` and answered by `answer`.
    pub fn of(snapshot: &Snapshot, plan: &Plan, answer: &PlanResponse) -> Self {
        let kept = evenly(answer.trajectory.len());
        let at = |north: f64, east: f64| [rounded(north, CENTI), rounded(east, CENTI)];
        let frame = CraftFrame::of(snapshot, answer.origin);
        let placed = |position: &Vector2<f64>| {
            let position = frame.as_ref().map_or(*position, |frame| frame.leave(position));
            at(position.x, position.y)
        };
        let craft = &answer.craft_estimate;
        let fine = |value: f64| rounded(value, TEN_THOUSANDTH);
        let pick =
            |point: &dyn Fn(usize) -> Option<[f64; 2]>| kept.iter().filter_map(|&i| point(i)).collect();
        let known = snapshot.auvs.iter().zip(&answer.targets).zip(&plan.position_covariances);
        Self {
            after_s: kept.iter().map(|&i| rounded(answer.trajectory[i].t_s - snapshot.t_s, CENTI)).collect(),
            asc: pick(&|i| answer.trajectory.get(i).map(|p| at(p.north_m, p.east_m))),
            goal: pick(&|i| answer.goal.trajectory.get(i).map(|p| at(p.north_m, p.east_m))),
            schedule: answer.schedule.clone().map(few_digits),
            figure: answer.figure.clone(),
            avoidance: answer.avoidance.clone(),
            vessels: vessels_now(snapshot).map(|seen| vessel(snapshot, &seen, &placed)).collect(),
            line_of_sight: pick(&|i| plan.baseline.trajectory.get(i).map(|p| placed(&p.position()))),
            auvs: known
                .map(|((auv, target), covariances)| PredictedAuv::of(auv, target, covariances, &kept, placed))
                .collect(),
            line_of_sight_reference: SteerBy {
                speed_mps: fine(answer.baseline.speed_mps),
                heading_rad: fine(answer.baseline.heading_rad),
            },
            rms_m: fine(answer.predicted.rms_error_m),
            line_of_sight_rms_m: fine(answer.baseline.predicted_rms_error_m),
            cost: Some(rounded(answer.predicted.cost, CENTI)),
            line_of_sight_cost: Some(rounded(answer.baseline.predicted_cost, CENTI)),
            current: answer.current.map(|current| [current.north_mps, current.east_mps].map(fine)),
            craft: PredictedCraft {
                heading_lag_s: fine(craft.heading_lag_s.value),
                heading_offset_rad: fine(craft.heading_offset_rad.value),
                surge_lag_s: fine(craft.surge_lag_s.value),
                surge_bias_mps2: fine(craft.surge_bias_mps2.value),
                sway_per_yaw_rate_s: fine(craft.sway_per_yaw_rate_s.value),
                follows: craft.follows,
            },
            violations: answer.violations.clone(),
            warnings: answer.warnings.clone(),
        }
    }
}

impl PredictedAuv {
    fn of(
        auv: &Auv,
        target: &PlannedTarget,
        covariances: &[Matrix2<f64>],
        kept: &[usize],
        placed: impl Fn(&Vector2<f64>) -> [f64; 2],
    ) -> Self {
        let estimate = &target.estimate;
        let reports = auv.reports.as_deref().unwrap_or_default();
        let fixes = reports.iter().filter(|report| !report.is_range());
        let newest = fixes.max_by(|a, b| a.t_s.total_cmp(&b.t_s));
        let rounded_to = |per_unit: f64| move |value: f64| rounded(value, per_unit);
        let positions = kept.iter().filter_map(|&i| target.trajectory.get(i));
        let depths = kept.iter().filter_map(|&i| target.depths_m.get(i));
        let covariances = kept.iter().filter_map(|&i| covariances.get(i));
        Self {
            id: target.id.0.clone(),
            positions: positions.map(|point| [point.north_m, point.east_m].map(rounded_to(CENTI))).collect(),
            depths_m: depths.copied().map(rounded_to(CENTI)).collect(),
            covariances_m2: covariances.map(|of| [of.m11, of.m12, of.m22].map(three_digits)).collect(),
            places: estimate
                .places
                .iter()
                .map(|at| [at.north_m, at.east_m, at.probability].map(rounded_to(CENTI)))
                .collect(),
            age_s: rounded(estimate.age_s, CENTI),
            heard: newest.map(|report| {
                let [north_m, east_m] = placed(&report.position());
                Heard { t_s: report.t_s, north_m, east_m }
            }),
            refused_t_s: estimate.rejected.iter().filter_map(|&i| Some(reports.get(i)?.t_s)).collect(),
            drift: [target.drift.north_mps, target.drift.east_mps].map(rounded_to(TEN_THOUSANDTH)),
            route: estimate.route,
            dive: estimate.dive,
        }
    }
}

/// At most [`TIMES_MAX`] indices below `n`, with the first and the last.
fn evenly(n: usize) -> Vec<usize> {
    let last = n.saturating_sub(1);
    let most = TIMES_MAX.min(n);
    (0..most).map(|k| if most < 2 { 0 } else { k * last / (most - 1) }).collect()
}

/// Rounds the visits and present costs of a schedule for people.
fn few_digits(mut schedule: Schedule) -> Schedule {
    for visit in &mut schedule.visits {
        let values = [
            &mut visit.arrive_s,
            &mut visit.leave_s,
            &mut visit.north_m,
            &mut visit.east_m,
            &mut visit.cost_before,
            &mut visit.cost_after,
        ];
        for value in values {
            *value = rounded(*value, CENTI);
        }
    }
    for vehicle in &mut schedule.costs {
        for value in [&mut vehicle.cost, &mut vehicle.heard_within_m, &mut vehicle.unheard_s] {
            *value = rounded(*value, CENTI);
        }
    }
    schedule
}

/// Rounds to three significant digits: an ellipse is drawn to half a percent.
fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().expect("is a number")
}

/// Rounds to the nearest 1/`per_unit`. No zero is negative.
fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_few_ascending_and_reach_both_ends() {
        for n in [0, 1, 2, 12, 13, 14, 61, 200] {
            let kept = evenly(n);
            assert!(kept.len() <= TIMES_MAX && kept.len() == n.min(TIMES_MAX));
            assert!(kept.windows(2).all(|pair| pair[0] < pair[1]), "{n}: {kept:?}");
            assert_eq!((kept.first(), kept.last()), ((0 < n).then_some(&0), n.checked_sub(1).as_ref()));
        }
    }

    #[test]
    fn rounded_numbers_are_near_and_short() {
        assert_eq!(rounded(12.344_9, CENTI), 12.34);
        assert_eq!(serde_json::to_string(&rounded(-0.001, CENTI)).expect("is a number"), "0.0");
        assert_eq!([252.715_5, -0.016_649, 0.0].map(three_digits), [253.0, -0.0166, 0.0]);
    }
}
