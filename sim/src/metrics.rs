//! What a record is worth, in numbers that can be compared.

use nalgebra::Vector2;
use planner::{los::Reference, plan::Method, snapshot::KeepOut};

use crate::record::{DiverRow, Record, Row, SurfaceCraftRow};

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
    /// Time of an answer, median, ms; none where nobody held a clock.
    pub solve_ms_p50: Option<f64>,
    /// Time of an answer that 99 % do not exceed, ms.
    pub solve_ms_p99: Option<f64>,
    /// How many references each rung gave.
    pub rungs: Rungs,
}

/// Limits of the craft and bounds of its scenario, as it truly kept them: none is judged by what was known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violations {
    /// Yaw rate beyond the largest turn rate, rad/s.
    pub turn_rate: Violation,
    /// Surge beyond the largest speed reference by more than a hundredth, m/s: the loop's own overshoot is none.
    pub speed: Violation,
    /// Inside a disc to keep out of, m.
    pub keep_out: Violation,
    /// Outside the area to stay in, m.
    pub area: Violation,
    /// Slant range to an underwater vehicle beyond the one to keep within, m.
    pub range: Violation,
    /// Propulsion energy beyond what there is, J.
    pub energy: Violation,
}

/// How far and how often one limit was not kept, seen once a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violation {
    /// Separate episodes.
    pub count: usize,
    /// All episodes together, s.
    pub seconds: f64,
    /// Largest excess, in the limit's unit; 0 if none.
    pub worst: f64,
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
            energy_j: last.energy,
            heading_travel_rad: last.heading_travel,
            reference_jerk: reference_jerk(&rows, record.interval),
            solve_ms_p50: quantile(&times, 50),
            solve_ms_p99: quantile(&times, 99),
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
    fn of(record: &Record) -> Self {
        let Some(limits) = &record.limits else {
            return Self::default();
        };
        let bounds = &record.bounds;
        let craft = |excess: &dyn Fn(&SurfaceCraftRow) -> f64| {
            Violation::of(record, &|row| row.surface_craft.as_ref().map_or(0.0, excess))
        };
        Self {
            turn_rate: craft(&|craft| craft.yaw_rate.abs() - limits.turn_rate_max),
            speed: craft(&|craft| craft.surge - 1.01 * limits.speed_max),
            keep_out: craft(&|craft| {
                let inside = |disc: &KeepOut| disc.radius - (craft.position - disc.centre).norm();
                bounds.keep_outs.iter().map(inside).fold(0.0, f64::max)
            }),
            area: craft(&|craft| outside(&bounds.area, &craft.position)),
            range: Violation::of(record, &|row| {
                bounds.range_max.map_or(0.0, |range| farthest(row) - range)
            }),
            energy: craft(&|craft| bounds.energy_max.map_or(0.0, |energy| craft.energy - energy)),
        }
    }
}

impl Violation {
    /// Of a limit that a row exceeds by `excess`, where that is positive.
    pub(crate) fn of(record: &Record, excess: &dyn Fn(&Row) -> f64) -> Self {
        let mut violation = Self::default();
        let mut inside_episode = false;
        for row in &record.rows {
            let excess = excess(row);
            let beyond = 0.0 < excess;
            if beyond {
                violation.seconds += record.interval;
                violation.worst = violation.worst.max(excess);
            }
            violation.count += usize::from(beyond && !inside_episode);
            inside_episode = beyond;
        }
        violation
    }
}

/// Slant range from the surface craft to the farthest underwater vehicle, m.
fn farthest(row: &Row) -> f64 {
    let ranges = row.divers.iter().filter_map(|diver| slant_range(row, diver));
    ranges.fold(0.0, f64::max)
}

fn slant_range(row: &Row, diver: &DiverRow) -> Option<f64> {
    let craft = row.surface_craft.as_ref()?;
    Some((craft.position - diver.position).norm().hypot(diver.depth))
}

/// How far outside a convex area `position` is, m, measured across its nearest side's line; negative inside,
/// and 0 where there is no area.
fn outside(area: &[Vector2<f64>], position: &Vector2<f64>) -> f64 {
    let n = area.len();
    if n < 3 {
        return 0.0;
    }
    let turn = (area[1] - area[0]).perp(&(area[2] - area[1])).signum();
    let beyond = |i: usize| {
        let side = (area[(i + 1) % n] - area[i]).normalize();
        -turn * side.perp(&(position - area[i]))
    };
    (0..n).map(beyond).fold(f64::NEG_INFINITY, f64::max)
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
        let near = record
            .rows
            .iter()
            .filter(|row| slant_range(row, &row.divers[i]).is_some_and(|distance| distance <= range));
        // Not `sum`, which is −0.0 over nothing.
        near.fold(0.0, |seconds, _| seconds + record.interval)
    };
    (0..record.diver_ids.len()).map(seconds).collect()
}

fn reference_jerk(rows: &[&SurfaceCraftRow], interval: f64) -> f64 {
    let velocity = |reference: &Reference| reference.heading.unit() * reference.speed;
    let jerks: Vec<f64> = rows
        .windows(3)
        .map(|three| {
            let [a, b, c] = [0, 1, 2].map(|i| velocity(&three[i].reference));
            (a - b * 2.0 + c).norm() / (interval * interval)
        })
        .collect();
    rms(&jerks)
}

/// The value that `per_cent` % of the `sorted` ones do not exceed (nearest rank); none of none.
fn quantile(sorted: &[f64], per_cent: usize) -> Option<f64> {
    let rank = (sorted.len() * per_cent).div_ceil(100).saturating_sub(1);
    sorted.get(rank).copied()
}

fn mean(values: &[f64]) -> f64 {
    #[expect(
        clippy::cast_precision_loss,
        reason = "a mission has thousands of rows, not 2⁵³"
    )]
    let n = values.len().max(1) as f64;
    values.iter().fold(0.0, |sum, value| sum + value) / n
}

fn rms(values: &[f64]) -> f64 {
    mean(&values.iter().map(|value| value * value).collect::<Vec<_>>()).sqrt()
}

#[cfg(test)]
mod tests {
    use planner::{angle::Heading, snapshot::Limits};

    use super::*;
    use crate::record::{Bounds, DiverReference, KnownSurfaceCraft};

    /// A craft `north` metres ahead of a goal at the datum, once a second; one diver 3 m below the datum.
    fn record(north: &[f64]) -> Record {
        let row = |(k, north): (u32, &f64)| Row {
            time: f64::from(k),
            surface_craft: Some(SurfaceCraftRow {
                position: Vector2::new(*north, 0.0),
                heading: 0.0,
                surge: 0.5,
                sway: 0.0,
                yaw_rate: 0.0,
                thrust_port: 0.0,
                thrust_starboard: 0.0,
                current: Vector2::zeros(),
                known: KnownSurfaceCraft {
                    time: f64::from(k),
                    position: Vector2::new(*north, 0.0),
                    heading: Heading::new(0.0),
                    surge: 0.5,
                    current: None,
                },
                predicted_rms: None,
                solve_ms: None,
                reference: Reference {
                    speed: 0.5,
                    heading: Heading::new(0.0),
                },
                method: Method::Mpc,
                goal: Vector2::zeros(),
                energy: f64::from(k),
                heading_travel: 0.1 * f64::from(k),
            }),
            divers: vec![DiverRow {
                position: Vector2::zeros(),
                depth: 3.0,
                pitch: -0.1,
                heading: 0.0,
                surge: 0.3,
                current: Vector2::zeros(),
                reference: DiverReference {
                    surge: 0.3,
                    pitch: -0.1,
                    heading: 0.0,
                },
                path_point: Vector2::zeros(),
                known: None,
                along_track: 3.0,
                cross_track: -4.0,
            }],
        };
        Record {
            scenario: "made-by-hand".into(),
            title: String::new(),
            guide: String::new(),
            seed: 0,
            interval: 1.0,
            origin: None,
            bounds: Bounds::default(),
            paths: vec![],
            diver_ids: vec!["auv-1".into()],
            settled_after: 2.0,
            contact_range: Some(5.0),
            limits: Some(Limits::MEDUSA),
            plant: None,
            rows: (0..).zip(north).map(row).collect(),
        }
    }

    fn craft(record: &mut Record, k: usize) -> &mut SurfaceCraftRow {
        record.rows[k].surface_craft.as_mut().expect("made with one")
    }

    fn surface_craft_metrics(record: &Record) -> SurfaceCraftMetrics {
        Metrics::of(record).surface_craft.expect("made with one")
    }

    #[test]
    fn distances_are_summed_up_as_by_hand() {
        let metrics = surface_craft_metrics(&record(&[6.0, 8.0, 0.0, 1.0]));
        assert!((metrics.rms_m - (101.0_f64 / 4.0).sqrt()).abs() < 1e-12);
        assert!((metrics.mean_m - 15.0 / 4.0).abs() < 1e-12);
        assert_eq!((metrics.p95_m, metrics.max_m), (8.0, 8.0));
        assert!(
            (metrics.settled_rms_m - 0.5_f64.sqrt()).abs() < 1e-12,
            "rows from 2 s on"
        );
        // Slant range 5 m over a depth of 3 m: 4 m and less.
        assert_eq!(metrics.time_in_range_s, [2.0]);
        assert!((metrics.energy_j - 3.0).abs() < 1e-12 && (metrics.heading_travel_rad - 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_solve_time_is_one_that_was_measured() {
        let mut record = record(&[0.0; 200]);
        assert_eq!(surface_craft_metrics(&record).solve_ms_p50, None);
        for k in 0..200_u32 {
            craft(&mut record, k as usize).solve_ms = Some(f64::from(200 - k));
        }
        let metrics = surface_craft_metrics(&record);
        assert_eq!(
            (metrics.solve_ms_p50, metrics.solve_ms_p99),
            (Some(100.0), Some(198.0))
        );
    }

    #[test]
    fn ninety_five_percent_of_the_rows_stay_under_p95() {
        let north: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(surface_craft_metrics(&record(&north)).p95_m, 95.0);
    }

    #[test]
    fn separate_excursions_count_separately_and_by_their_worst() {
        let mut record = record(&[0.0; 6]);
        assert_eq!(surface_craft_metrics(&record).violations, Violations::default());
        let most = Limits::MEDUSA.turn_rate_max;
        craft(&mut record, 1).yaw_rate = most + 0.1;
        craft(&mut record, 2).yaw_rate = -most - 0.2;
        craft(&mut record, 4).surge = 1.01 * Limits::MEDUSA.speed_max + 0.3;
        let violations = surface_craft_metrics(&record).violations;
        let Violation {
            count,
            seconds,
            worst,
        } = violations.turn_rate;
        assert_eq!((count, seconds), (1, 2.0));
        assert!((worst - 0.2).abs() < 1e-12);
        assert_eq!((violations.speed.count, violations.speed.seconds), (1, 1.0));
        assert!((violations.speed.worst - 0.3).abs() < 1e-12);
    }

    #[test]
    fn bounds_are_judged_by_where_the_craft_truly_was() {
        // The craft is 4, 0 and −6 m north of the diver, which is 3 m deep; energy grows by 1 J a row.
        let mut record = record(&[4.0, 0.0, -6.0]);
        let square = [(-5.0, -5.0), (-5.0, 5.0), (5.0, 5.0), (5.0, -5.0)];
        record.bounds = Bounds {
            keep_outs: vec![KeepOut {
                centre: Vector2::new(3.0, 0.0),
                radius: 1.5,
            }],
            area: square.map(|(north, east)| Vector2::new(north, east)).to_vec(),
            range_max: Some(6.0),
            energy_max: Some(1.5),
        };
        let Violations {
            keep_out,
            area,
            range,
            energy,
            ..
        } = surface_craft_metrics(&record).violations;
        let worst = [keep_out, area, range, energy].map(|violation| {
            assert_eq!((violation.count, violation.seconds), (1, 1.0));
            violation.worst
        });
        for (worst, by_hand) in worst.into_iter().zip([0.5, 1.0, 45_f64.sqrt() - 6.0, 0.5]) {
            assert!((worst - by_hand).abs() < 1e-12, "{worst} and {by_hand}");
        }
        record.bounds.area.reverse();
        assert_eq!(surface_craft_metrics(&record).violations.area, area);
    }

    #[test]
    fn a_steady_reference_has_no_jerk_and_a_single_step_has_two_differences() {
        let mut record = record(&[0.0; 6]);
        assert_eq!(surface_craft_metrics(&record).reference_jerk, 0.0);
        for k in 3..6 {
            craft(&mut record, k).reference.speed += 0.4;
        }
        // Second differences 0, 0.4, −0.4, 0.
        let expected = (2.0 * 0.16_f64 / 4.0).sqrt();
        assert!((surface_craft_metrics(&record).reference_jerk - expected).abs() < 1e-12);
    }

    #[test]
    fn rungs_are_counted() {
        let mut record = record(&[0.0; 4]);
        craft(&mut record, 2).method = Method::Hold;
        let rungs = surface_craft_metrics(&record).rungs;
        assert_eq!(
            rungs,
            Rungs {
                mpc: 3,
                hold: 1,
                ..Rungs::default()
            }
        );
    }

    #[test]
    fn a_diver_is_measured_against_its_path() {
        let metrics = Metrics::of(&record(&[0.0; 4]));
        assert_eq!(metrics.divers[0].cross_track_max_m, 4.0);
        assert_eq!(metrics.divers[0].position_error_max_m, 5.0);
        assert_eq!(metrics.divers[0].pitch_max_rad, -0.1);
    }
}
