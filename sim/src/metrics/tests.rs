use planner::{angle::Heading, snapshot::Limits};

use super::*;
use crate::record::{AuvReference, Bounds, KnownSurfaceCraft, Service};

/// One row a second: a craft `north` metres ahead of a goal at the datum, an AUV 3 m below it.
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
            serves: None,
            predicted_rms: None,
            solve_ms: None,
            reference: Reference {
                speed: 0.5,
                heading: Heading::new(0.0),
            },
            method: Some(Method::Mpc),
            goal: Vector2::zeros(),
            energy: f64::from(k),
            heading_travel: 0.1 * f64::from(k),
        }),
        auvs: vec![AuvRow {
            position: Vector2::zeros(),
            depth: 3.0,
            pitch: -0.1,
            heading: 0.0,
            surge: 0.3,
            current: Vector2::zeros(),
            reference: AuvReference {
                surge: 0.3,
                pitch: -0.1,
                heading: 0.0,
            },
            path_point: Vector2::zeros(),
            known: None,
            service: None,
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
        faults: vec![],
        paths: vec![],
        auv_ids: vec!["auv-1".into()],
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
fn distance_metrics_match_a_calculation_by_hand() {
    let metrics = surface_craft_metrics(&record(&[6.0, 8.0, 0.0, 1.0]));
    assert!((metrics.rms_m - (101.0_f64 / 4.0).sqrt()).abs() < 1e-12);
    assert!((metrics.mean_m - 15.0 / 4.0).abs() < 1e-12);
    assert_eq!((metrics.p95_m, metrics.max_m), (8.0, 8.0));
    assert!(
        (metrics.settled_rms_m - 0.5_f64.sqrt()).abs() < 1e-12,
        "rows from 2 s on"
    );
    // A slant range of 5 m at a depth of 3 m is a horizontal distance of 4 m.
    assert_eq!(metrics.time_in_range_s.into_values().collect::<Vec<_>>(), [2.0]);
    assert!((metrics.energy_j - 3.0).abs() < 1e-12 && (metrics.heading_travel_rad - 0.3).abs() < 1e-12);
}

#[test]
fn solve_times_are_reported_only_if_measured() {
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
fn p95_is_the_nearest_rank() {
    let north: Vec<f64> = (1..=100).map(f64::from).collect();
    assert_eq!(surface_craft_metrics(&record(&north)).p95_m, 95.0);
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
    let Violation {
        count,
        duration_s,
        worst,
    } = violations.turn_rate_radps;
    assert_eq!((count, duration_s), (1, 2.0));
    assert!((worst - 0.2).abs() < 1e-12);
    let speed = violations.speed_mps;
    assert_eq!((speed.count, speed.duration_s), (1, 1.0));
    assert!((speed.worst - 0.3).abs() < 1e-12);
}

#[test]
fn bounds_are_judged_by_the_true_position() {
    // The craft is 4, 0 and −6 m north of the AUV, which is 3 m deep; energy grows by 1 J a row.
    let mut record = record(&[4.0, 0.0, -6.0]);
    let square = [(-5.0, -5.0), (-5.0, 5.0), (5.0, 5.0), (5.0, -5.0)];
    record.bounds = Bounds {
        keep_outs: vec![KeepOut::new(Vector2::new(3.0, 0.0), 1.5)],
        area: square.map(|(north, east)| Vector2::new(north, east)).to_vec(),
        range_max: Some(6.0),
        energy_max: Some(1.5),
    };
    let Violations {
        keep_out_m,
        area_m,
        range_m,
        energy_j,
        ..
    } = surface_craft_metrics(&record).violations;
    let worst = [keep_out_m, area_m, range_m, energy_j].map(|violation| {
        assert_eq!((violation.count, violation.duration_s), (1, 1.0));
        violation.worst
    });
    for (worst, by_hand) in worst.into_iter().zip([0.5, 1.0, 45_f64.sqrt() - 6.0, 0.5]) {
        assert!((worst - by_hand).abs() < 1e-12, "{worst} and {by_hand}");
    }
    record.bounds.area.reverse();
    assert_eq!(surface_craft_metrics(&record).violations.area_m, area_m);
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
fn answers_are_counted_by_method() {
    let mut record = record(&[0.0; 4]);
    craft(&mut record, 2).method = Some(Method::Hold);
    let answers = surface_craft_metrics(&record).answers_by_method;
    assert_eq!(
        answers,
        AnswersByMethod {
            mpc: 3,
            hold: 1,
            ..AnswersByMethod::default()
        }
    );
}

#[test]
fn an_auv_is_measured_against_its_path() {
    let metrics = Metrics::of(&record(&[0.0; 4]));
    assert_eq!(metrics.auvs[0].cross_track_max_m, 4.0);
    assert_eq!(metrics.auvs[0].position_error_max_m, 5.0);
    assert_eq!(metrics.auvs[0].pitch_max_rad, -0.1);
}

#[test]
fn visits_count_at_their_beginning_and_costs_only_of_living_vehicles() {
    let mut record = record(&[0.0; 6]);
    assert_eq!(Metrics::of(&record).surface_craft.expect("has one").visits, None);
    record.auv_ids.push("auv-2".into());
    let service = |cost: f64, served: bool| {
        Some(Service {
            cost,
            served,
            late: cost == 9.0,
        })
    };
    // The first is served, left, and served again; the second is served late, once, and dies.
    let [one, two] = [
        [
            (0.0, true),
            (1.0, false),
            (2.0, false),
            (0.0, true),
            (0.0, true),
            (1.0, false),
        ]
        .map(Some),
        [
            Some((7.0, false)),
            Some((8.0, false)),
            Some((9.0, false)),
            Some((0.0, true)),
            None,
            None,
        ],
    ];
    for (k, row) in record.rows.iter_mut().enumerate() {
        row.auvs.push(row.auvs[0]);
        for (auv, is) in row.auvs.iter_mut().zip([one[k], two[k]]) {
            auv.service = is.and_then(|(cost, served)| service(cost, served));
        }
        row.surface_craft.as_mut().expect("has one").serves =
            [None, Some(1), Some(1), Some(1), Some(0), Some(0)][k];
    }
    let visits = Metrics::of(&record).surface_craft.expect("has one").visits;
    // Row by row: 3.5, 4.5, 5.5, 0 of two, 0 and 1 of one.
    let expected = VisitMetrics {
        mean_cost: 14.5 / 6.0,
        max_cost: 9.0,
        visits: 3,
        changes: 1,
        deadlines_missed: 1,
    };
    assert_eq!(visits, Some(expected));
}
