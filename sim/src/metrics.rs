//! What a record is worth, in numbers that can be compared.

use planner::{los::Reference, plan::Method};

use crate::record::{DiverRow, Record, SurfaceCraftRow};

/// Interval between two rows, s.
const ROW_INTERVAL: f64 = 1.0;

/// A mission's metrics.
#[derive(Clone, Debug, PartialEq)]
pub struct Metrics {
    /// How the surface craft kept to its goal, where there is one.
    pub surface_craft: Option<SurfaceCraftMetrics>,
    /// How each underwater vehicle kept to its path, in the record's order.
    pub divers: Vec<DiverMetrics>,
}

/// How the surface craft kept to its goal. Distances are true ones, over the whole mission unless
/// said otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceCraftMetrics {
    /// Root mean square distance to the goal, m.
    pub rms_m: f64,
    /// Mean distance, m.
    pub mean_m: f64,
    /// Distance that 95 % of the rows stay under, m (nearest rank).
    pub p95_m: f64,
    /// Largest distance, m.
    pub max_m: f64,
    /// Root mean square distance after the scenario's settling time, m.
    pub settled_rms_m: f64,
    /// Time within the scenario's contact range (slant) of each underwater vehicle, s.
    pub time_in_range_s: Vec<f64>,
    /// True limits of the craft that it did not keep.
    pub violations: Violations,
    /// Propulsion energy ∫ |thrust · surge speed| dt, J.
    pub energy_j: f64,
    /// Heading travel ∫ |r| dt, rad.
    pub heading_travel_rad: f64,
    /// Root mean square second difference of the velocity reference, per second squared, m/s³.
    pub reference_jerk: f64,
    /// How many references each rung gave.
    pub rungs: Rungs,
}

/// Seconds in which the craft was beyond what its limits say: yaw rate above the largest turn rate, or
/// surge above the largest speed reference by more than a hundredth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violations {
    /// Separate episodes.
    pub count: usize,
    /// Seconds, all episodes together.
    pub seconds: f64,
    /// Largest yaw rate beyond its limit, rad/s; 0 if none.
    pub worst_turn_rate_radps: f64,
    /// Largest surge speed beyond its limit, m/s; 0 if none.
    pub worst_speed_mps: f64,
}

/// References by the rung of the planner's ladder that gave them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rungs {
    /// The program, solved.
    pub mpc: usize,
    /// The previous plan, followed further.
    pub previous_plan: usize,
    /// The line-of-sight law.
    pub saturated_los: usize,
    /// Hold.
    pub hold: usize,
}

/// How an underwater vehicle kept to its path and its sawtooth, after the scenario's settling time.
#[derive(Clone, Debug, PartialEq)]
pub struct DiverMetrics {
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
    #[must_use]
    pub fn of(record: &Record) -> Self {
        Self {
            surface_craft: SurfaceCraftMetrics::of(record),
            divers: (0..record.diver_ids.len())
                .map(|i| DiverMetrics::of(record, i))
                .collect(),
        }
    }
}

impl SurfaceCraftMetrics {
    fn of(record: &Record) -> Option<Self> {
        let rows: Vec<&SurfaceCraftRow> = record
            .rows
            .iter()
            .filter_map(|row| row.surface_craft.as_ref())
            .collect();
        let last = rows.last()?;
        let mut distances: Vec<f64> = rows.iter().map(|row| row.distance()).collect();
        let settled: Vec<f64> = record
            .rows
            .iter()
            .filter(|row| row.time >= record.settled_after)
            .filter_map(|row| Some(row.surface_craft.as_ref()?.distance()))
            .collect();
        let (rms_m, mean_m, settled_rms_m) = (rms(&distances), mean(&distances), rms(&settled));
        distances.sort_by(f64::total_cmp);
        Some(Self {
            rms_m,
            mean_m,
            p95_m: distances[(distances.len() * 95).div_ceil(100).saturating_sub(1)],
            max_m: distances[distances.len() - 1],
            settled_rms_m,
            time_in_range_s: time_in_range(record),
            violations: Violations::of(record, &rows),
            energy_j: last.energy,
            heading_travel_rad: last.heading_travel,
            reference_jerk: reference_jerk(&rows),
            rungs: Rungs::of(&rows),
        })
    }
}

impl DiverMetrics {
    fn of(record: &Record, i: usize) -> Self {
        let rows: Vec<&DiverRow> = record
            .rows
            .iter()
            .filter(|row| row.time >= record.settled_after)
            .map(|row| &row.divers[i])
            .collect();
        let least = |of: fn(&DiverRow) -> f64| rows.iter().map(|row| of(row)).fold(f64::INFINITY, f64::min);
        let most =
            |of: fn(&DiverRow) -> f64| rows.iter().map(|row| of(row)).fold(f64::NEG_INFINITY, f64::max);
        Self {
            id: record.diver_ids[i].clone(),
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
    fn of(record: &Record, rows: &[&SurfaceCraftRow]) -> Self {
        let Some(limits) = &record.limits else {
            return Self::default();
        };
        let mut violations = Self::default();
        let mut inside_episode = false;
        for row in rows {
            let turn_rate = row.yaw_rate.abs() - limits.turn_rate_max;
            let speed = row.surge - 1.01 * limits.speed_max;
            let beyond = turn_rate > 0.0 || speed > 0.0;
            if beyond {
                violations.seconds += ROW_INTERVAL;
                violations.worst_turn_rate_radps = violations.worst_turn_rate_radps.max(turn_rate);
                violations.worst_speed_mps = violations.worst_speed_mps.max(speed);
            }
            violations.count += usize::from(beyond && !inside_episode);
            inside_episode = beyond;
        }
        violations
    }
}

impl Rungs {
    fn of(rows: &[&SurfaceCraftRow]) -> Self {
        let count = |method| rows.iter().filter(|row| row.method == method).count();
        Self {
            mpc: count(Method::Mpc),
            previous_plan: count(Method::PreviousPlan),
            saturated_los: count(Method::SaturatedLos),
            hold: count(Method::Hold),
        }
    }
}

fn time_in_range(record: &Record) -> Vec<f64> {
    let Some(range) = record.contact_range else {
        return vec![];
    };
    let seconds = |i: usize| {
        let near = record.rows.iter().filter(|row| {
            let diver = &row.divers[i];
            row.surface_craft
                .is_some_and(|craft| (craft.position - diver.position).norm().hypot(diver.depth) <= range)
        });
        near.map(|_| ROW_INTERVAL).sum()
    };
    (0..record.diver_ids.len()).map(seconds).collect()
}

fn reference_jerk(rows: &[&SurfaceCraftRow]) -> f64 {
    let velocity = |reference: &Reference| reference.heading.unit() * reference.speed;
    let jerks: Vec<f64> = rows
        .windows(3)
        .map(|three| {
            let [a, b, c] = [0, 1, 2].map(|i| velocity(&three[i].reference));
            (a - b * 2.0 + c).norm() / (ROW_INTERVAL * ROW_INTERVAL)
        })
        .collect();
    rms(&jerks)
}

fn mean(values: &[f64]) -> f64 {
    #[expect(
        clippy::cast_precision_loss,
        reason = "a mission has thousands of rows, not 2⁵³"
    )]
    let n = values.len().max(1) as f64;
    values.iter().sum::<f64>() / n
}

fn rms(values: &[f64]) -> f64 {
    mean(&values.iter().map(|value| value * value).collect::<Vec<_>>()).sqrt()
}
