use planner::{angle::Heading, snapshot::Limits};

use super::*;
use crate::{
    guide::LosGuide,
    mission::run,
    record::{Bounds, Service, VesselRow},
    scenario::Scenario,
    tests::near,
};

/// One row a second: a craft `north` metres ahead of a goal at the datum, an AUV 3 m below it.
fn record(north: &[f64]) -> Record {
    let scenario = Scenario::named("paper-tracking").expect("exists");
    let mut guide = LosGuide::new(planner::parameters::Parameters::default().los);
    let seconds = f64::from(u32::try_from(north.len()).expect("few"));
    let mut record = run(&scenario.lasting(seconds), &mut guide, 0, &mut |_| {}).expect("runs");
    record.bounds = Bounds::default();
    (record.contact_range, record.limits) = (Some(5.0), Some(Limits::MEDUSA));
    (record.settled_after, record.plant) = (2.0, None);
    for ((k, north), row) in (0..).zip(north).zip(&mut record.rows) {
        let auv = &mut row.auvs[0];
        (auv.position, auv.path_point) = (Vector2::zeros(), Vector2::zeros());
        (auv.depth, auv.pitch) = (3.0, -0.1);
        (auv.along_track, auv.cross_track) = (3.0, -4.0);
        let craft = row.surface_craft.as_mut().expect("has one");
        (craft.position, craft.goal) = (Vector2::new(*north, 0.0), Vector2::zeros());
        (craft.surge, craft.yaw_rate, craft.method) = (0.5, 0.0, Some(Method::Mpc));
        craft.reference = Reference { speed: 0.5, heading: Heading::new(0.0) };
        (craft.energy, craft.heading_travel) = (f64::from(k), 0.1 * f64::from(k));
    }
    record
}

fn craft(record: &mut Record, k: usize) -> &mut SurfaceCraftRow {
    record.rows[k].surface_craft.as_mut().expect("made with one")
}

fn surface_craft_metrics(record: &Record) -> SurfaceCraftMetrics {
    Metrics::of(record).surface_craft.expect("made with one")
}

#[test]
fn distance_metrics_match_a_calculation_by_hand() {
    let metrics = surface_craft_metrics(&record(&[6.0, 8.0, 0.0, 1.0]));
    near(metrics.rms_m, (101.0_f64 / 4.0).sqrt(), 1e-12);
    near(metrics.mean_m, 15.0 / 4.0, 1e-12);
    assert_eq!((metrics.p95_m, metrics.max_m), (8.0, 8.0));
    // Rows from 2 s on.
    near(metrics.settled_rms_m, 0.5_f64.sqrt(), 1e-12);
    // A slant range of 5 m at a depth of 3 m is a horizontal distance of 4 m.
    assert_eq!(metrics.time_in_range_s.into_values().collect::<Vec<_>>(), [2.0]);
    near(metrics.energy_j, 3.0, 1e-12);
    near(metrics.heading_travel_rad, 0.3, 1e-12);
    // The nearest rank.
    let north: Vec<f64> = (1..=100).map(f64::from).collect();
    assert_eq!(surface_craft_metrics(&record(&north)).p95_m, 95.0);
}

#[test]
fn solve_times_are_reported_only_if_measured() {
    let mut record = record(&[0.0; 200]);
    assert_eq!(surface_craft_metrics(&record).solve_ms_p50, None);
    for k in 0..200_u32 {
        craft(&mut record, k as usize).solve_ms = Some(f64::from(200 - k));
    }
    let metrics = surface_craft_metrics(&record);
    let found = [metrics.solve_ms_p50, metrics.solve_ms_p99];
    assert_eq!(found, [Some(100.0), Some(198.0)]);
}

#[test]
fn each_excursion_counts_once_and_the_worst_excess_is_kept() {
    let mut record = record(&[0.0; 6]);
    assert_eq!(surface_craft_metrics(&record).violations, Violations::default());
    let most = Limits::MEDUSA.turn_rate_max;
    craft(&mut record, 1).yaw_rate = most + 0.1;
    craft(&mut record, 2).yaw_rate = -most - 0.2;
    craft(&mut record, 4).surge = 1.01 * Limits::MEDUSA.speed_max + 0.3;
    let violations = surface_craft_metrics(&record).violations;
    for (violation, duration, worst) in
        [(violations.turn_rate_radps, 2.0, 0.2), (violations.speed_mps, 1.0, 0.3)]
    {
        assert_eq!((violation.count, violation.duration_s), (1, duration));
        near(violation.worst, worst, 1e-12);
    }
}

#[test]
fn bounds_are_judged_by_the_true_position() {
    // The craft is 4, 0 and −6 m north of the AUV, which is 3 m deep; energy grows by 1 J a row.
    let mut record = record(&[4.0, 0.0, -6.0]);
    let square = [[-5.0, -5.0], [-5.0, 5.0], [5.0, 5.0], [5.0, -5.0]];
    record.bounds = Bounds {
        keep_outs: vec![KeepOut::new(Vector2::new(3.0, 0.0), 1.5)],
        area: square.map(Vector2::from).to_vec(),
        range_max: Some(6.0),
        energy_max: Some(1.5),
        vessel_separation: None,
        no_go: Vec::new(),
    };
    let broken = surface_craft_metrics(&record).violations;
    for (violation, worst) in [
        (broken.keep_out_m, 0.5),
        (broken.area_m, 1.0),
        (broken.range_m, 45_f64.sqrt() - 6.0),
        (broken.energy_j, 0.5),
    ] {
        assert_eq!((violation.count, violation.duration_s), (1, 1.0));
        near(violation.worst, worst, 1e-12);
    }
    record.bounds.area.reverse();
    assert_eq!(surface_craft_metrics(&record).violations.area_m, broken.area_m);
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
    near(surface_craft_metrics(&record).reference_jerk, expected, 1e-12);
}

#[test]
fn answers_are_counted_by_method() {
    let mut record = record(&[0.0; 4]);
    craft(&mut record, 2).method = Some(Method::Hold);
    let expected = AnswersByMethod { mpc: 3, hold: 1, ..AnswersByMethod::default() };
    assert_eq!(surface_craft_metrics(&record).answers_by_method, expected);
}

#[test]
fn an_auv_is_measured_against_its_path() {
    let auv = &Metrics::of(&record(&[0.0; 4])).auvs[0];
    let found = [auv.cross_track_max_m, auv.position_error_max_m, auv.pitch_max_rad];
    assert_eq!(found, [4.0, 5.0, -0.1]);
}

#[test]
fn visits_count_at_their_beginning_and_costs_only_of_living_vehicles() {
    let mut record = record(&[0.0; 6]);
    assert_eq!(surface_craft_metrics(&record).visits, None);
    record.auv_ids.push("auv-2".into());
    // Costs by row; served at 0. The first is served, left, and served again; the second is served
    // late, once, and dies.
    let costs = [
        [Some(0.0), Some(1.0), Some(2.0), Some(0.0), Some(0.0), Some(1.0)],
        [Some(7.0), Some(8.0), Some(9.0), Some(0.0), None, None],
    ];
    let serves = [None, Some(1), Some(1), Some(1), Some(0), Some(0)];
    for (k, row) in record.rows.iter_mut().enumerate() {
        row.auvs.push(row.auvs[0]);
        for (auv, costs) in row.auvs.iter_mut().zip(costs) {
            auv.service = costs[k].map(|cost| Service { cost, served: cost == 0.0, late: cost == 9.0 });
        }
        row.surface_craft.as_mut().expect("has one").serves = serves[k];
    }
    // Row by row: 3.5, 4.5, 5.5, 0 of two, 0 and 1 of one.
    let expected =
        VisitMetrics { mean_cost: 14.5 / 6.0, max_cost: 9.0, visits: 3, changes: 1, deadlines_missed: 1 };
    assert_eq!(surface_craft_metrics(&record).visits, Some(expected));
}

#[test]
fn traffic_is_measured_where_a_vessel_was_nearest_and_by_the_first_manoeuvre() {
    let mut record = record(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(surface_craft_metrics(&record).traffic, None);
    record.vessel_ids = ["met", "far", "comes"].map(String::from).into();
    for (k, row) in (0..).zip(&mut record.rows) {
        let time = f64::from(k);
        let at = |north: f64, east: f64| VesselRow {
            position: Vector2::new(north, east),
            course: 0.0,
            speed: 1.0,
            length: 8.0,
        };
        // One passes 30 m to port after 2 s, one stays away, one still comes nearer on starboard.
        row.vessels = vec![at(2.0 + 10.0 * (2.0 - time), -30.0), at(0.0, 300.0), at(5.0, 100.0 - time)];
        let craft = row.surface_craft.as_mut().expect("has one");
        (craft.heading, craft.manoeuvre) = (0.1, (k == 2 || k == 3).then_some(0.6));
    }
    let found = surface_craft_metrics(&record).traffic.expect("has vessels");
    assert_eq!((found.passed_to_port, found.passed_to_starboard), (1, 0));
    near(found.least_m, 26.0, 1e-12);
    // 30 m are kept: broken within 34 m of its middle, from 1 to 3 s (31.95, 30, 31.95 m).
    assert_eq!((found.too_near_m.count, found.too_near_m.duration_s), (1, 3.0));
    near(found.first_turn_rad.expect("turns"), 0.5, 1e-12);
    near(found.manoeuvring_rms_m.expect("turns"), 6.5_f64.sqrt(), 1e-12);
    near(found.afterwards_rms_m.expect("turns"), 20.5_f64.sqrt(), 1e-12);
}
