//! Metrics of a record, comparable from run to run.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use planner::{
    angle::{direction, wrap},
    los::Reference,
    plan::Method,
    snapshot::{KeepOut, Limits, VESSEL_SEPARATION_DEFAULT, no_go_depths},
};
use serde::Serialize;

use crate::record::{AuvRow, NavigationRow, Record, Row, SurfaceCraftRow, VesselRow};

/// Distance from a vessel's side within which it is passed, m.
const PASSED_WITHIN: f64 = 200.0;

/// A mission's metrics.
#[derive(Clone, Debug, PartialEq)]
pub struct Metrics {
    /// Metrics of the surface craft, if there is one.
    pub surface_craft: Option<SurfaceCraftMetrics>,
    /// Metrics of each underwater vehicle, in the record's order.
    pub auvs: Vec<AuvMetrics>,
}

/// Metrics of the surface craft, or of several together. Distances are true ones to the goal, of several
/// to each one's part of it, over the mission by default.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceCraftMetrics {
    /// Root mean square distance to the goal, m.
    pub rms_m: f64,
    /// Mean distance, m.
    pub mean_m: f64,
    /// Distance that 95 % of the rows do not exceed, m (nearest rank).
    pub p95_m: f64,
    /// Largest distance, m.
    pub max_m: f64,
    /// Root mean square distance after the scenario's settling time, m.
    pub settled_rms_m: f64,
    /// Time within the scenario's contact range (slant) of each underwater vehicle, s.
    pub time_in_range_s: BTreeMap<String, f64>,
    /// Violations of limits and bounds.
    pub violations: Violations,
    /// Propulsion energy ∫ |thrust · surge speed| dt, J.
    pub energy_j: f64,
    /// Heading travel ∫ |r| dt, rad.
    pub heading_travel_rad: f64,
    /// Root mean square second difference of the velocity reference, per second squared, m/s³.
    pub reference_jerk: f64,
    /// Median computing time, ms; none if the caller did not measure it.
    pub solve_ms_p50: Option<f64>,
    /// Computing time that 99 % of the answers do not exceed, ms.
    pub solve_ms_p99: Option<f64>,
    /// Number of references by method.
    pub answers_by_method: AnswersByMethod,
    /// Service of the AUVs, if the goal visits them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visits: Option<VisitMetrics>,
    /// Navigation of the AUVs once settled, if the goal localises them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub localisation: Option<LocalisationMetrics>,
    /// Distance from other vessels, if there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traffic: Option<TrafficMetrics>,
}

/// Distance from other vessels, at each row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrafficMetrics {
    /// Least distance from half the length of a vessel, m.
    pub least_m: f64,
    /// Nearer than the distance to keep.
    pub too_near_m: Violation,
    /// Vessels that were nearest, and within 200 m of their side, on the craft's port side.
    pub passed_to_port: usize,
    /// The same on its starboard side.
    pub passed_to_starboard: usize,
    /// Turn from the heading to that of the first manoeuvre, rad, positive to starboard.
    pub first_turn_rad: Option<f64>,
    /// Root mean square distance to the goal during manoeuvres, m.
    pub manoeuvring_rms_m: Option<f64>,
    /// Root mean square distance to the goal after the last manoeuvre, m.
    pub afterwards_rms_m: Option<f64>,
}

/// The AUVs' own navigation once settled, over time and AUVs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LocalisationMetrics {
    /// Root-mean-square true error, m.
    pub rms_m: f64,
    /// Largest true error, m.
    pub max_m: f64,
    /// Root-mean-square error that the AUVs' filters state, m.
    pub stated_rms_m: f64,
    /// Mean squared error over its stated covariance; 2 of consistent filters.
    pub nees: f64,
}

/// Service of the AUVs, by true positions. Each cost is times its weight over the mean weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VisitMetrics {
    /// Mean cost over time and the AUVs that were alive.
    pub mean_cost: f64,
    /// Largest cost of any AUV at any time.
    pub max_cost: f64,
    /// Number of times that an AUV began to be served.
    pub visits: usize,
    /// Number of times that the guide chose another AUV than a second before.
    pub changes: usize,
    /// AUVs whose deadline passed before they were served.
    pub deadlines_missed: usize,
}

/// Violations of limits and bounds, by the true state. A name has the unit of the worst excess.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Violations {
    /// Yaw rate beyond the largest turn rate.
    pub turn_rate_radps: Violation,
    /// Surge beyond 1.01 times the largest speed reference; the loop overshoots by less than that.
    pub speed_mps: Violation,
    /// Inside a keep-out disc.
    pub keep_out_m: Violation,
    /// Inside a no-go area.
    pub no_go_m: Violation,
    /// Outside the area to stay in.
    pub area_m: Violation,
    /// Slant range to an underwater vehicle beyond the largest one.
    pub range_m: Violation,
    /// Propulsion energy beyond the available one.
    pub energy_j: Violation,
}

/// Violation of one limit, evaluated at each row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Violation {
    /// Separate episodes.
    pub count: usize,
    /// All episodes together, s.
    pub duration_s: f64,
    /// Largest excess, in the limit's unit; 0 if none.
    pub worst: f64,
}

/// Numbers of references by the planner's method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AnswersByMethod {
    /// The solved program.
    pub mpc: usize,
    /// The previous plan, continued.
    pub previous_plan: usize,
    /// The line-of-sight law.
    pub saturated_los: usize,
    /// Hold.
    pub hold: usize,
}

/// Metrics of an underwater vehicle after the scenario's settling time.
#[derive(Clone, Debug, PartialEq)]
pub struct AuvMetrics {
    /// Its name.
    pub id: String,
    /// Largest cross-track error in size, m.
    pub cross_track_max_m: f64,
    /// Largest distance to the point it follows, m.
    pub position_error_max_m: f64,
    /// Least depth, m.
    pub depth_min_m: f64,
    /// Largest depth, m.
    pub depth_max_m: f64,
    /// Least pitch, rad.
    pub pitch_min_rad: f64,
    /// Largest pitch, rad.
    pub pitch_max_rad: f64,
    /// Mean speed along the body, m/s.
    pub surge_mean_mps: f64,
}

impl Metrics {
    /// The metrics of `record`.
    pub fn of(record: &Record) -> Self {
        Self {
            surface_craft: SurfaceCraftMetrics::of(record),
            auvs: (0..record.auv_ids.len()).map(|i| AuvMetrics::of(record, i)).collect(),
        }
    }
}

impl SurfaceCraftMetrics {
    /// The metrics of `record`; none without a surface craft.
    pub fn of(record: &Record) -> Option<Self> {
        let craft: Vec<Vec<&SurfaceCraftRow>> = (0..record.rows.first()?.craft().count())
            .map(|number| record.rows.iter().filter_map(|row| row.craft().nth(number)).collect())
            .collect();
        let rows = craft.concat();
        let mut distances = distances_to_goal(&rows);
        let settled: Vec<_> = record.settled_rows().flat_map(Row::craft).collect();
        let settled = distances_to_goal(&settled);
        let at_last = |of: fn(&SurfaceCraftRow) -> f64| {
            // Not `sum`, which is −0.0 over nothing.
            craft.iter().filter_map(|rows| rows.last()).fold(0.0, |sum, row| sum + of(row))
        };
        let (rms_m, mean_m, settled_rms_m) = (rms(&distances), mean(&distances), rms(&settled));
        distances.sort_by(f64::total_cmp);
        let mut times: Vec<f64> = rows.iter().filter_map(|row| row.solve_ms).collect();
        times.sort_by(f64::total_cmp);
        Some(Self {
            rms_m,
            mean_m,
            p95_m: quantile(&distances, 95)?,
            max_m: distances[distances.len() - 1],
            settled_rms_m,
            time_in_range_s: time_in_range(record),
            violations: Violations::of(record),
            energy_j: at_last(|row| row.energy),
            heading_travel_rad: at_last(|row| row.heading_travel),
            reference_jerk: reference_jerk(&craft, record.interval),
            solve_ms_p50: quantile(&times, 50),
            solve_ms_p99: quantile(&times, 99),
            answers_by_method: AnswersByMethod::of(&rows),
            visits: VisitMetrics::of(record),
            localisation: LocalisationMetrics::of(record),
            traffic: TrafficMetrics::of_all(record),
        })
    }
}

/// Distances of craft to their goals, m; 0 of craft that never have one.
fn distances_to_goal(rows: &[&SurfaceCraftRow]) -> Vec<f64> {
    let none_has = !rows.iter().any(|row| row.has_goal());
    rows.iter().filter(|row| none_has || row.has_goal()).map(|row| row.distance()).collect()
}

impl TrafficMetrics {
    /// The metrics of the craft that came nearest to a vessel.
    fn of_all(record: &Record) -> Option<Self> {
        let each = (0..record.fleet.len()).filter_map(|number| Self::of(&record.of_craft(number)));
        each.min_by(|a, b| a.least_m.total_cmp(&b.least_m)).or_else(|| Self::of(record))
    }

    fn of(record: &Record) -> Option<Self> {
        let side = |row: &Row, vessel: &VesselRow| {
            let craft = row.surface_craft.as_ref()?;
            Some((craft.position - vessel.position).norm() - 0.5 * vessel.length)
        };
        let least = |row: &Row| row.vessels.iter().filter_map(|vessel| side(row, vessel)).reduce(f64::min);
        let least_m = record.rows.iter().filter_map(least).reduce(f64::min)?;
        let kept = record.bounds.vessel_separation.unwrap_or(VESSEL_SEPARATION_DEFAULT);
        let too_near = |row: &Row| least(row).map_or(0.0, |least| kept - least);
        // How far to starboard a vessel was when it was nearest, unless it still came nearer.
        let passed = |vessel: usize| {
            let off: Option<Vec<f64>> =
                record.rows.iter().map(|row| side(row, &row.vessels[vessel])).collect();
            let off = off?;
            let nearest = (0..off.len()).min_by(|a, b| off[*a].total_cmp(&off[*b]))?;
            let row = &record.rows[nearest];
            let craft = row.surface_craft.as_ref()?;
            let there = row.vessels[vessel].position - craft.position;
            (off[nearest] < PASSED_WITHIN && nearest + 1 < off.len())
                .then(|| direction(craft.heading).perp(&there))
        };
        let sides: Vec<f64> = (0..record.vessel_ids.len()).filter_map(passed).collect();
        let rows: Vec<&SurfaceCraftRow> = record.surface_craft_rows().map(|(_, row)| row).collect();
        let first = rows.iter().find_map(|row| Some(wrap(row.manoeuvre? - row.heading)));
        let last = rows.iter().rposition(|row| row.manoeuvre.is_some());
        let distance = |rows: &mut dyn Iterator<Item = &&SurfaceCraftRow>| {
            let distances: Vec<f64> = rows.map(|row| row.distance()).collect();
            (!distances.is_empty()).then(|| rms(&distances))
        };
        Some(Self {
            least_m,
            too_near_m: Violation::of(record, &too_near),
            passed_to_port: sides.iter().filter(|side| **side < 0.0).count(),
            passed_to_starboard: sides.iter().filter(|side| 0.0 <= **side).count(),
            first_turn_rad: first,
            manoeuvring_rms_m: distance(&mut rows.iter().filter(|row| row.manoeuvre.is_some())),
            afterwards_rms_m: last.and_then(|last| distance(&mut rows[last + 1..].iter())),
        })
    }
}

impl LocalisationMetrics {
    fn of(record: &Record) -> Option<Self> {
        let auvs = record.settled_rows().flat_map(|row| &row.auvs);
        let known: Vec<NavigationRow> = auvs.filter_map(|auv| auv.navigation).collect();
        let all = |of: fn(&NavigationRow) -> f64| known.iter().map(of).collect::<Vec<_>>();
        (!known.is_empty()).then(|| Self {
            rms_m: rms(&all(|row| row.error)),
            max_m: all(|row| row.error).into_iter().fold(0.0, f64::max),
            stated_rms_m: rms(&all(|row| row.sigma)),
            nees: mean(&all(|row| row.nees)),
        })
    }
}

impl VisitMetrics {
    fn of(record: &Record) -> Option<Self> {
        let means: Vec<f64> = record.rows.iter().filter_map(Row::mean_cost).collect();
        let auvs = record.rows.iter().flat_map(|row| &row.auvs);
        let services = auvs.filter_map(|auv| auv.service);
        let most = services.map(|service| service.cost).reduce(f64::max)?;
        let every = || 0..record.auv_ids.len();
        let served = |row: &Row, auv: usize| row.auvs[auv].service.is_some_and(|service| service.served);
        let begins = |pair: &[Row], auv: usize| !served(&pair[0], auv) && served(&pair[1], auv);
        let begun = |pair: &[Row]| every().filter(|&auv| begins(pair, auv)).count();
        let at_once = every().filter(|&auv| served(&record.rows[0], auv)).count();
        let changes = |number: usize| {
            let serves = |row: &Row| row.craft().nth(number).and_then(|craft| craft.serves);
            let chosen: Vec<usize> = record.rows.iter().filter_map(serves).collect();
            chosen.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        let is_late = |row: &Row, auv: usize| row.auvs[auv].service.is_some_and(|service| service.late);
        let late = |auv: &usize| record.rows.iter().any(|row| is_late(row, *auv));
        Some(Self {
            mean_cost: mean(&means),
            max_cost: most,
            visits: at_once + record.rows.windows(2).map(begun).sum::<usize>(),
            changes: (0..record.fleet.len().max(1)).map(changes).sum(),
            deadlines_missed: every().filter(late).count(),
        })
    }
}

impl AuvMetrics {
    fn of(record: &Record, i: usize) -> Self {
        let rows: Vec<&AuvRow> = record.settled_rows().map(|row| &row.auvs[i]).collect();
        let least = |of: fn(&AuvRow) -> f64| rows.iter().map(|row| of(row)).fold(f64::INFINITY, f64::min);
        let most = |of: fn(&AuvRow) -> f64| rows.iter().map(|row| of(row)).fold(f64::NEG_INFINITY, f64::max);
        Self {
            id: record.auv_ids[i].clone(),
            cross_track_max_m: most(|row| row.cross_track.abs()),
            position_error_max_m: most(|row| row.along_track.hypot(row.cross_track)),
            depth_min_m: least(|row| row.depth),
            depth_max_m: most(|row| row.depth),
            pitch_min_rad: least(|row| row.pitch),
            pitch_max_rad: most(|row| row.pitch),
            surge_mean_mps: mean(&rows.iter().map(|row| row.surge).collect::<Vec<_>>()),
        }
    }
}

impl Violations {
    fn of(record: &Record) -> Self {
        if record.limits.is_none() {
            return Self::default();
        }
        let bounds = &record.bounds;
        // The worst of all craft.
        let craft = |excess: &dyn Fn(&SurfaceCraftRow) -> f64| {
            Violation::of(record, &|row| row.craft().map(excess).fold(f64::NEG_INFINITY, f64::max))
        };
        let limited = |excess: fn(&SurfaceCraftRow, &Limits) -> f64| {
            let limits: Vec<_> =
                (0..record.fleet.len().max(1)).map(|number| record.limits_of(number)).collect();
            Violation::of(record, &|row| {
                let craft = row.craft().zip(&limits);
                let excesses = craft.filter_map(|(craft, limits)| Some(excess(craft, limits.as_ref()?)));
                excesses.fold(f64::NEG_INFINITY, f64::max)
            })
        };
        Self {
            turn_rate_radps: limited(|craft, limits| craft.yaw_rate.abs() - limits.turn_rate_max),
            speed_mps: limited(|craft, limits| craft.surge - 1.01 * limits.speed_max),
            keep_out_m: craft(&|craft| {
                let inside = |disc: &KeepOut| disc.radius_m - (craft.position - disc.centre()).norm();
                bounds.keep_outs.iter().map(inside).fold(0.0, f64::max)
            }),
            no_go_m: {
                let depth = no_go_depths(&bounds.no_go);
                craft(&|craft| depth(&craft.position))
            },
            area_m: craft(&|craft| outside(&bounds.area, &craft.position)),
            range_m: Violation::of(record, &|row| {
                bounds.range_max.map_or(0.0, |range| farthest(row) - range)
            }),
            energy_j: craft(&|craft| bounds.energy_max.map_or(0.0, |energy| craft.energy - energy)),
        }
    }
}

impl Violation {
    /// Violation of a limit that a row exceeds by `excess`, where positive.
    pub fn of(record: &Record, excess: &dyn Fn(&Row) -> f64) -> Self {
        let mut violation = Self::default();
        let mut inside_episode = false;
        for row in &record.rows {
            let excess = excess(row);
            let beyond = 0.0 < excess;
            if beyond {
                violation.duration_s += record.interval;
                violation.worst = violation.worst.max(excess);
            }
            violation.count += usize::from(beyond && !inside_episode);
            inside_episode = beyond;
        }
        violation
    }
}

/// Slant range from the nearest surface craft to the farthest underwater vehicle, m.
fn farthest(row: &Row) -> f64 {
    let ranges = row.auvs.iter().filter_map(|auv| slant_range(row, auv));
    ranges.fold(0.0, f64::max)
}

fn slant_range(row: &Row, auv: &AuvRow) -> Option<f64> {
    let ranges = row.craft().map(|craft| (craft.position - auv.position).norm().hypot(auv.depth));
    ranges.reduce(f64::min)
}

/// Distance of `position` outside a convex area, m; negative inside, 0 without an area.
fn outside(area: &[Vector2<f64>], position: &Vector2<f64>) -> f64 {
    let n = area.len();
    if n < 3 {
        return 0.0;
    }
    let triangle = |pair: &[Vector2<f64>]| (pair[0] - area[0]).perp(&(pair[1] - area[0]));
    let turn = area[1..].windows(2).map(triangle).sum::<f64>().signum();
    let beyond = |i: usize| {
        let side = (area[(i + 1) % n] - area[i]).normalize();
        -turn * side.perp(&(position - area[i]))
    };
    (0..n).map(beyond).fold(f64::NEG_INFINITY, f64::max)
}

impl AnswersByMethod {
    fn of(rows: &[&SurfaceCraftRow]) -> Self {
        let count = |method| rows.iter().filter(|row| row.method == Some(method)).count();
        Self {
            mpc: count(Method::Mpc),
            previous_plan: count(Method::PreviousPlan),
            saturated_los: count(Method::SaturatedLos),
            hold: count(Method::Hold),
        }
    }
}

fn time_in_range(record: &Record) -> BTreeMap<String, f64> {
    let Some(range) = record.contact_range else { return BTreeMap::new() };
    let is_near = |row: &Row, i: usize| slant_range(row, &row.auvs[i]).is_some_and(|by| by <= range);
    let seconds = |i: usize| {
        let near = record.rows.iter().filter(|row| is_near(row, i));
        // Not `sum`, which is −0.0 over nothing.
        near.fold(0.0, |seconds, _| seconds + record.interval)
    };
    let ids = record.auv_ids.iter().cloned().enumerate();
    ids.map(|(i, id)| (id, seconds(i))).collect()
}

fn reference_jerk(craft: &[Vec<&SurfaceCraftRow>], interval: f64) -> f64 {
    let velocity = |reference: &Reference| reference.heading.unit() * reference.speed;
    let jerk = |three: &[&SurfaceCraftRow]| {
        let [a, b, c] = [0, 1, 2].map(|i| velocity(&three[i].reference));
        (a - b * 2.0 + c).norm() / (interval * interval)
    };
    rms(&craft.iter().flat_map(|rows| rows.windows(3).map(jerk)).collect::<Vec<_>>())
}

/// The value that `per_cent` % of the `sorted` values do not exceed (nearest rank), if any.
fn quantile(sorted: &[f64], per_cent: usize) -> Option<f64> {
    let rank = (sorted.len() * per_cent).div_ceil(100).saturating_sub(1);
    sorted.get(rank).copied()
}

/// The mean; 0 of nothing.
pub fn mean(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    values.iter().fold(0.0, |sum, value| sum + value) / n
}

/// The root mean square; 0 of nothing.
pub fn rms(values: &[f64]) -> f64 {
    mean(&values.iter().map(|value| value * value).collect::<Vec<_>>()).sqrt()
}

#[cfg(test)]
mod tests;
