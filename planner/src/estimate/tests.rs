//! Reports follow the filter's own model, unless a test says otherwise.

#![expect(
    clippy::disallowed_macros,
    reason = "the planner has no output, its tests print what they measured"
)]

use std::{f64::consts::FRAC_PI_2, sync::Arc};

use nalgebra::{Matrix4, Vector2, Vector4};
use proptest::prelude::*;

use super::*;
use crate::{
    estimate::{
        from_reports::{Estimator, in_order},
        kalman::Kalman,
        legs::TrackPoint,
        on_path::{PathHypothesis, Spread},
    },
    facts::{
        angle::{Course, angle_of, ned_from_body},
        auv::Auv,
        evidence::{AuvState, GroundTrack, Report},
        known_path::{DeclaredPath, KnownPath},
        path::{
            curve::{Path, Side},
            segment::Segment,
        },
        previous_plan::{PreviousEstimate, RememberedTarget},
    },
    tuned::EstimateNumbers,
};

pub(crate) const TUNED: &EstimateNumbers = &EstimateNumbers::DEFAULT;

impl Estimate {
    pub(crate) fn new(
        auv: &Auv,
        path: Option<&KnownPath>,
        now: f64,
        current: &Vector2<f64>,
        previous: Option<(RememberedTarget, f64)>,
        before: Option<&[TrackPoint]>,
        due: &dyn Fn() -> bool,
    ) -> Self {
        let estimator = Estimator {
            now,
            current: *current,
            tuned: TUNED,
            due,
        };
        estimator.estimate(auv, path, previous, before)
    }
}

/// Standard deviation of a fix and interval between two, typical of acoustic networks.
const SIGMA: f64 = 1.5;

const INTERVAL: f64 = 10.0;

/// Standard deviations of a telemetered speed and course: the filter's.
const SPEED_SIGMA: f64 = 0.03;

const COURSE_SIGMA: f64 = 0.05;

/// SplitMix64: the planner has no random numbers, and its tests need few.
/// Source: G. L. Steele et al., "Fast splittable pseudorandom number generators", 2014.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Two standard normal numbers, by Box and Muller.
    pub(crate) fn normal(&mut self) -> Vector2<f64> {
        let size = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        crate::facts::angle::direction(std::f64::consts::TAU * self.uniform()) * size
    }
}

/// Reports of a vehicle that starts with `velocity` and moves as the filter's model: `n` of them,
/// with its position and velocity at the last.
fn flight(
    random: &mut Random,
    n: usize,
    velocity: Vector2<f64>,
) -> (Vec<Report>, Vector2<f64>, Vector2<f64>) {
    let (mut position, mut velocity) = (Vector2::new(40.0, -70.0), velocity);
    let mut reports = Vec::new();
    let mut time = 500.0;
    for k in 0..n {
        if k > 0 {
            let t = INTERVAL;
            time += t;
            // The two integrals of white noise over t: variances q t and q t³/3, covariance q t²/2.
            let (first, second) = (random.normal(), random.normal());
            let scale = (TUNED.acceleration_density * t).sqrt();
            position += velocity * t + (first * 0.5 + second / 12_f64.sqrt()) * (scale * t);
            velocity += first * scale;
        }
        let telemetry = random.normal();
        // σ_u along the course; across it σ_u and the course error times the speed.
        let (speed, course) = (velocity.norm(), angle_of(&velocity));
        let across = SPEED_SIGMA.hypot(COURSE_SIGMA * speed);
        let reported =
            ned_from_body(course) * Vector2::new(speed + SPEED_SIGMA * telemetry.x, across * telemetry.y);
        reports.push(Report {
            depth_m: Some(5.0),
            turn_rate_radps: Some(0.0),
            ..Report::new(time, position + random.normal() * SIGMA, SIGMA).with_ground_track(Some(
                GroundTrack {
                    course: Course::of(&reported),
                    speed: reported.norm(),
                },
            ))
        });
    }
    (reports, position, velocity)
}

fn estimate(reports: &[Report], now: f64) -> Estimate {
    let auv = Auv::reported("a", reports.to_vec());
    Estimate::new(&auv, None, now, &Vector2::zeros(), None, None, &|| false)
}

/// The reports without telemetry.
fn positions_alone(reports: &[Report]) -> Vec<Report> {
    let bare = |report: &Report| Report {
        depth_m: None,
        course_rad: None,
        speed_mps: None,
        turn_rate_radps: None,
        ..*report
    };
    reports.iter().map(bare).collect()
}

#[test]
fn the_error_of_a_straight_vehicle_is_within_the_covariance() {
    // The normalised squared error, eᵀ P⁻¹ e, is χ² with four degrees of freedom; the sum over 200
    // seeds has 800, and 97.5 % lie below 880.3 (tabulated). Here it is less, as these vehicles go
    // straighter than the model; without telemetry half, since a vehicle of 1.8 m/s might turn.
    let run = |with_telemetry: bool| {
        let mut sum = 0.0;
        for seed in 0..200 {
            let mut random = Random(seed);
            let start = Vector2::new(1.5, -1.0);
            let (mut reports, position, velocity) = flight(&mut random, 20, start);
            if !with_telemetry {
                reports = positions_alone(&reports);
            }
            let state = estimate(&reports, 700.0).state;
            let (dp, dv) = (state.position() - position, state.velocity() - velocity);
            let error = nalgebra::Vector4::new(dp.x, dp.y, dv.x, dv.y);
            let covariance = state.covariance().expect("made of reports");
            let inverse = covariance.try_inverse().expect("positive definite");
            sum += error.dot(&(inverse * error));
        }
        sum
    };
    for with_telemetry in [true, false] {
        let sum = run(with_telemetry);
        println!(
            "telemetry {with_telemetry}: mean normalised error squared {:.2} of 4",
            sum / 200.0
        );
        assert!((300.0..=880.3).contains(&sum), "{sum}");
    }
}

#[test]
fn the_gate_reduces_the_error_with_two_percent_of_outliers() {
    let rms = |gated: bool, with_telemetry: bool| {
        let (mut sum, mut caught, mut outliers) = (0.0, 0_u32, 0_u32);
        for seed in 0..200 {
            let mut random = Random(seed);
            let (mut reports, position, _) = flight(&mut random, 20, Vector2::new(0.15, 0.12));
            let mut wild = Vec::new();
            for (i, report) in reports.iter_mut().enumerate() {
                let error = random.normal() * 20.0;
                if random.uniform() < 0.02 {
                    [report.north_m, report.east_m] = (report.position() + (error)).into();
                    wild.push(i);
                }
            }
            if !with_telemetry {
                reports = positions_alone(&reports);
            }
            let found = if gated {
                let found = estimate(&reports, 690.0);
                outliers += u32::try_from(wild.len()).expect("few");
                caught +=
                    u32::try_from(wild.iter().filter(|i| found.rejected.contains(i)).count()).expect("few");
                let newest = Kalman::new(
                    690.0 - found.state.age_s,
                    &found.state.position(),
                    &found.state.velocity(),
                    &found.state.covariance().expect("made of reports"),
                );
                newest.at(690.0, TUNED).position()
            } else {
                let (first, later) = reports.split_first().expect("not empty");
                let mut filter = Kalman::start(first, TUNED);
                for report in later {
                    filter.accept_ungated(report);
                }
                filter.position()
            };
            sum += (found - position).norm_squared();
        }
        println!(
            "gated {gated}, telemetry {with_telemetry}: {:.2} m, {caught} of {outliers} caught",
            (sum / 200.0_f64).sqrt()
        );
        (sum / 200.0).sqrt()
    };
    for with_telemetry in [true, false] {
        let (with, without) = (rms(true, with_telemetry), rms(false, with_telemetry));
        assert!(
            with < 0.8 * without,
            "{with} m with the gate, {without} m without"
        );
    }
}

#[test]
fn a_single_report_is_the_estimate() {
    let (reports, ..) = flight(&mut Random(1), 1, Vector2::new(0.2, 0.1));
    let only = estimate(&reports, 503.0);
    assert_eq!(only.rejected, [] as [usize; 0]);
    assert_eq!(only.state.position(), reports[0].position());
    assert_eq!((only.state.age_s, only.state.depth_m), (3.0, 5.0));
    // Its velocity outweighs the prior, 3 m/s, ten thousand times.
    let reported = reports[0].ground_track().expect("is reported").velocity();
    assert!((only.state.velocity() - reported).norm() < 1e-3 * reported.norm());
    let bare = estimate(&positions_alone(&reports), 503.0).state;
    assert_eq!(
        (bare.speed_mps, bare.depth_m, bare.turn_rate_radps),
        (0.0, 0.0, 0.0)
    );
}

#[test]
fn two_simultaneous_fixes_equal_one_of_half_the_variance() {
    let (reports, ..) = flight(&mut Random(2), 1, Vector2::new(0.2, 0.1));
    let first = positions_alone(&reports)[0];
    let second = Report {
        north_m: (first.position() + Vector2::new(1.0, -0.5)).x,
        east_m: (first.position() + Vector2::new(1.0, -0.5)).y,
        ..first
    };
    let both = estimate(&[first, second], 500.0).state;
    let mean = (first.position() + second.position()) * 0.5;
    assert!((both.position() - mean).norm() < 1e-12);
    let variance = both.covariance().expect("made of reports")[(0, 0)];
    assert!((variance - 0.5 * SIGMA * SIGMA).abs() < 1e-12);
}

#[test]
fn a_repeated_report_counts_once() {
    let (reports, ..) = flight(&mut Random(3), 8, Vector2::new(0.2, 0.1));
    let twice: Vec<_> = reports.iter().chain(&reports[2..5]).copied().collect();
    let (once, twice) = (estimate(&reports, 580.0), estimate(&twice, 580.0));
    assert_eq!(once.state, twice.state);
    assert_eq!(twice.rejected.len(), 3);
}

#[test]
fn one_message_over_two_links_counts_once() {
    let (reports, ..) = flight(&mut Random(3), 8, Vector2::new(0.2, 0.1));
    // The second link rounds the position, omits the depth and claims less.
    let other = |report: &Report| Report {
        north_m: report.north_m + 0.04,
        depth_m: None,
        sigma_m: 1.0,
        ..*report
    };
    let twice: Vec<_> = reports.iter().copied().chain(reports.iter().map(other)).collect();
    let (once, twice) = (estimate(&reports, 580.0), estimate(&twice, 580.0));
    assert_eq!(once.state, twice.state);
    assert_eq!(twice.rejected, (8..16).collect::<Vec<_>>());
}

#[test]
fn a_moved_vehicle_is_found_by_the_second_report() {
    let (reports, ..) = flight(&mut Random(4), 12, Vector2::new(0.2, 0.1));
    let moved = |n: usize| {
        let mut reports = reports[..n].to_vec();
        for report in &mut reports[8..] {
            [report.north_m, report.east_m] = (report.position() + (Vector2::new(300.0, 0.0))).into();
        }
        reports
    };
    assert_eq!(estimate(&moved(9), 620.0).rejected, [8]);
    let reports = moved(10);
    for reports in [&reports, &positions_alone(&reports)] {
        let found = estimate(reports, 620.0);
        assert_eq!(found.rejected, (0..8).collect::<Vec<_>>());
        assert!((found.state.position() - reports[9].position()).norm() < 3.0 * SIGMA);
        assert!(found.state.speed_mps < 0.5);
    }
}

#[test]
fn an_initial_outlier_is_not_followed() {
    let (mut reports, ..) = flight(&mut Random(5), 3, Vector2::new(0.2, 0.1));
    [reports[0].north_m, reports[0].east_m] = (reports[0].position() + (Vector2::new(0.0, 60.0))).into();
    assert_eq!(estimate(&reports, 530.0).rejected, [0]);
}

#[test]
fn the_fastest_vehicle_is_followed_without_a_reported_speed() {
    let (reports, _, velocity) = flight(&mut Random(6), 10, Vector2::new(-7.0, 7.0));
    let found = estimate(&positions_alone(&reports), 595.0);
    assert_eq!(found.rejected, [] as [usize; 0]);
    assert!((found.state.velocity() - velocity).norm() < 1.0);
}

#[test]
fn an_impossible_velocity_is_dropped_and_its_position_is_used() {
    let (mut reports, ..) = flight(&mut Random(7), 10, Vector2::new(0.2, 0.1));
    let sane = estimate(&reports, 595.0);
    reports[9].speed_mps = Some(5.0);
    let found = estimate(&reports, 595.0);
    assert_eq!(found.rejected, [] as [usize; 0]);
    assert_eq!(found.state.age_s, 5.0);
    assert!((found.state.velocity() - sane.state.velocity()).norm() < 0.1);
}

#[test]
fn a_turn_reported_more_than_a_minute_ago_is_unused() {
    let (mut reports, ..) = flight(&mut Random(8), 2, Vector2::new(0.2, 0.1));
    reports[0].turn_rate_radps = Some(0.02);
    reports[1].turn_rate_radps = None;
    let turn_rate = |now| estimate(&reports, now).state.turn_rate_radps;
    assert_eq!((turn_rate(560.0), turn_rate(560.1)), (0.02, 0.0));
}

#[test]
fn the_present_sigma_is_the_filter_s_prediction() {
    let (reports, ..) = flight(&mut Random(9), 5, Vector2::new(0.2, 0.1));
    let sigma = |now| {
        estimate(&reports, now)
            .position_sigma(TUNED)
            .expect("made of reports")
    };
    let covariance = estimate(&reports, 540.0)
        .state
        .covariance
        .expect("made of reports");
    let t = 30.0_f64;
    // p + v t with independent errors: P_pp + 2 t P_pv + t² P_vv + q t³/3 along either axis.
    let variance: f64 = (0..2)
        .map(|i| {
            covariance[i][i]
                + 2.0 * t * covariance[i][i + 2]
                + t * t * covariance[i + 2][i + 2]
                + TUNED.acceleration_density * t.powi(3) / 3.0
        })
        .sum();
    assert!((sigma(570.0) - variance.sqrt()).abs() < 1e-12);
    assert!(sigma(570.0) > sigma(540.0));
}

/// Reports of a vehicle on lanes of 60 m at 0.193 m/s, 1 m to starboard, and its last position.
fn lanes(random: &mut Random) -> (KnownPath, Vec<Report>, Vector2<f64>) {
    let path = Path::lawn_mower(Vector2::new(3.0, -7.0), 0.4, 60.0, 20.0, 4);
    let place = |time: f64| {
        let point = path.at(5.0 + 0.193 * time);
        (
            point.position + crate::facts::path::piece::starboard(point.tangent) * 1.0,
            point.tangent,
        )
    };
    let report = |k: u32| {
        let time = INTERVAL * f64::from(k);
        let (position, tangent) = place(time);
        Report::new(time, position + random.normal() * SIGMA, SIGMA).with_ground_track(Some(GroundTrack {
            course: Course::new(tangent + COURSE_SIGMA * random.normal().x),
            speed: 0.193,
        }))
    };
    let reports: Vec<_> = (0..30).map(report).collect();
    let known = KnownPath {
        path: Arc::new(path.clone()),
        horizontal_speed: 0.193,
    };
    (known, reports, place(290.0).0)
}

fn estimate_along(known: &KnownPath, reports: &[Report]) -> Estimate {
    let auv = Auv::reported("a", reports.to_vec());
    Estimate::new(&auv, Some(known), 290.0, &Vector2::zeros(), None, None, &|| false)
}

#[test]
fn a_followed_path_improves_the_estimate() {
    for (with_telemetry, gain) in [(true, 1.0), (false, 0.7)] {
        let (mut along, mut free) = (0.0, 0.0);
        for seed in 0..200 {
            let (known, mut reports, truth) = lanes(&mut Random(seed));
            if !with_telemetry {
                reports = positions_alone(&reports);
            }
            along += (estimate_along(&known, &reports).state.position() - truth).norm_squared();
            free += (estimate(&reports, 290.0).state.position() - truth).norm_squared();
        }
        let [along, free] = [along, free].map(|sum: f64| (sum / 200.0).sqrt());
        println!("telemetry {with_telemetry}: along the path {along:.2} m, free {free:.2} m");
        assert!(along < gain * free, "{along} m, {free} m");
    }
}

#[test]
fn the_error_along_a_path_is_within_the_covariance() {
    // As above, for the position alone: χ² with 400 degrees of freedom, 97.5 % quantile 457.3. Less
    // here: the vehicle keeps its exact speed and its offset.
    let squared = (0..200).map(|seed| {
        let (known, reports, truth) = lanes(&mut Random(seed));
        let state = estimate_along(&known, &reports).state;
        let covariance = state.covariance().expect("made of reports");
        assert!(covariance.cholesky().is_some());
        let position = covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let error = state.position() - truth;
        error.dot(&(position.try_inverse().expect("positive definite") * error))
    });
    let sum: f64 = squared.sum();
    assert!((50.0..=457.3).contains(&sum), "{sum}");
}

#[test]
fn a_vehicle_that_leaves_its_path_is_estimated_from_its_motion() {
    let (known, mut reports, _) = lanes(&mut Random(1));
    // It goes straight where the path turns, 15 m ahead of it.
    let start = reports[0].position() + crate::facts::angle::direction(0.4) * 40.0;
    for (k, report) in (0..30).zip(&mut reports) {
        [report.north_m, report.east_m] =
            (start + crate::facts::angle::direction(0.4) * (0.193 * INTERVAL * f64::from(k))).into();
        *report = report.with_ground_track(Some(GroundTrack {
            course: Course::new(0.4),
            speed: 0.193,
        }));
    }
    let found = estimate_along(&known, &reports);
    assert!(!found.route.expect("has a path").is_followed());
    assert_eq!(found.state, estimate(&reports, 290.0).state);
}

/// Reports every 10 s of a vehicle at `place`, positions alone.
fn reported_at(place: impl Fn(f64) -> Vector2<f64>, n: u32, random: &mut Random) -> Vec<Report> {
    let report = |k: u32| {
        let time = INTERVAL * f64::from(k);
        Report::new(time, place(time) + random.normal() * SIGMA, SIGMA)
    };
    (0..n).map(report).collect()
}

/// Fit of a vehicle with `speed` to `path` by all of `reports`.
fn route(path: &Path, speed: f64, reports: &[Report]) -> Route {
    let known = KnownPath {
        path: Arc::new(path.clone()),
        horizontal_speed: speed,
    };
    let auv = Auv::reported("a", reports.to_vec());
    let now = reports.last().expect("there are some").t_s;
    let found = Estimate::new(&auv, Some(&known), now, &Vector2::zeros(), None, None, &|| false);
    found.route.expect("has a path")
}

#[test]
fn two_turns_reveal_the_path_s_offset_and_sense() {
    let path = Path::lawn_mower(Vector2::zeros(), 0.4, 150.0, 30.0, 4);
    let (mut before, mut after, mut normalised) = (0.0, 0.0, 0.0);
    for seed in 0..40_u32 {
        let mut random = Random(seed.into());
        // Backwards on displaced lanes is forwards on their neighbours.
        for (backwards, distance) in [(false, 18.0), (true, 3.0)] {
            let shift = ned_from_body(f64::from(seed)) * Vector2::new(distance, 0.0);
            let place = |time: f64| {
                let along = if backwards {
                    path.length() - 5.0 - time
                } else {
                    5.0 + time
                };
                path.at(along).position + shift
            };
            let reports = reported_at(place, 42, &mut random);
            let [early, late] = [12, 42].map(|n| route(&path, 0.9, &reports[..n]));
            for route in [early, late] {
                assert!(
                    route.is_followed(),
                    "seed {seed}, backwards {backwards}: {route:?}"
                );
            }
            assert_eq!(late.fit.sense < 0.0, backwards, "seed {seed}: {late:?}");
            before += (early.fit.offset() - shift).norm_squared();
            let off = late.fit.offset() - shift;
            after += off.norm_squared();
            let covariance = late.fit.covariance.fixed_view::<2, 2>(2, 2).into_owned();
            normalised += off.dot(&(covariance.try_inverse().expect("positive definite") * off));
        }
    }
    let [before, after] = [before, after].map(|sum: f64| (sum / 80.0).sqrt());
    println!(
        "offset wrong by {before:.1} m on the first leg, {after:.1} m after two turns; NEES {:.1} of 2",
        normalised / 80.0
    );
    assert!(after < 3.0 && normalised / 80.0 < 4.0);
}

#[test]
fn an_undeclared_turn_radius_is_estimated() {
    let lanes = |turn_radius_m| {
        let row = |k: u32| {
            let (east, ends) = (40.0 * f64::from(k), [0.0, 200.0]);
            let [from, to] = if k.is_multiple_of(2) { [0, 1] } else { [1, 0] };
            [[ends[from], east], [ends[to], east]]
        };
        DeclaredPath {
            segments: vec![Segment::Waypoints {
                points: (0..6).flat_map(row).collect(),
                fillet_m: None,
                turn_radius_m,
                legs: vec![],
            }],
            closed: false,
            speed_mps: 1.0,
        }
    };
    let known = |path: &DeclaredPath| path.known().expect("is a path");
    let declared = lanes(None);
    let mut off = [0.0; 2];
    for (seed, radius) in (0..90_u32).zip([6.0, 10.0, 16.0].into_iter().cycle()) {
        let actual = known(&lanes(Some(radius))).path;
        let place = |time: f64| actual.at(5.0 + time).position;
        let reports = reported_at(place, 64, &mut Random(seed.into()));
        let auv = Auv {
            path: Some(declared.clone()),
            ..Auv::reported("a", reports)
        };
        let new = |auv| {
            Estimate::new(
                auv,
                Some(&known(&declared)),
                630.0,
                &Vector2::zeros(),
                None,
                None,
                &|| false,
            )
        };
        let unnamed = Auv {
            path: None,
            ..auv.clone()
        };
        // A minute later it has turned again.
        for (off, found) in off.iter_mut().zip([new(&auv), new(&unnamed)]) {
            let (fit, path) = (
                found.route.expect("has a path").fit,
                found.path.expect("has one").path,
            );
            let then = path.at(fit.along() + 110.0 + 110.0 * fit.faster()).position + fit.offset();
            *off += (then - place(740.0)).norm_squared() / 90.0;
        }
    }
    let [seen, assumed] = off.map(f64::sqrt);
    println!("{seen:.2} m off after another turn, {assumed:.2} m at the assumed rate of turn");
    assert!(seen < 0.7 * assumed);
}

#[test]
fn a_speed_over_ground_is_distinguished_from_one_through_the_water() {
    let path = Path::lawn_mower(Vector2::zeros(), 0.0, 60.0, 20.0, 8);
    let current = Vector2::new(0.2, 0.1);
    let known = KnownPath {
        path: Arc::new(path.clone()),
        horizontal_speed: 0.5,
    };
    let mut right = 0;
    for seed in 0..40_u32 {
        let over_ground = seed.is_multiple_of(2);
        let water = if over_ground { Vector2::zeros() } else { current };
        let mut along = vec![5.0];
        for second in 0..600 {
            let gamma: f64 = along[second];
            along.push(gamma + crate::facts::known_path::speed_along(0.5, &water, path.at(gamma).tangent));
        }
        let reports = |random: &mut Random| {
            let report = |k: usize| {
                let place = path.at(along[10 * k]).position;
                let t_s = INTERVAL * crate::estimate::rigid_motion::number(k);
                Report::new(t_s, place + random.normal() * SIGMA, SIGMA)
            };
            (0..60).map(report).collect::<Vec<_>>()
        };
        let auv = Auv::reported("a", reports(&mut Random(seed.into())));
        let found = Estimate::new(&auv, Some(&known), 590.0, &current, None, None, &|| false);
        let route = found.route.expect("has a path");
        assert!(route.is_followed(), "seed {seed}");
        right += u32::from(route.current == water);
    }
    println!("{right} of 40 told apart");
    assert!(38 <= right);
}

#[test]
fn a_vehicle_that_leaves_its_path_is_forecast_without_it_after_three_fixes() {
    let path = Path::lawn_mower(Vector2::zeros(), 0.4, 300.0, 30.0, 4);
    let mut late = 0;
    for seed in 0..50 {
        let place = |time: f64| {
            let there = path.at(5.0 + time.min(150.0));
            there.position + crate::facts::angle::direction(there.tangent + 1.0) * (time - 150.0).max(0.0)
        };
        let reports = reported_at(place, 20, &mut Random(seed));
        assert!(route(&path, 1.0, &reports[..16]).is_followed(), "seed {seed}");
        late += u32::from(route(&path, 1.0, &reports[..19]).is_followed());
    }
    println!("{late} of 50 vehicles that left are still taken to follow after three fixes");
    assert!(late <= 2);
}

#[test]
fn one_fix_on_the_path_keeps_the_path() {
    let (known, reports, _) = lanes(&mut Random(5));
    let only = Report::new(reports[3].t_s, reports[3].position(), SIGMA);
    let followed = |report: Report| {
        let auv = Auv::reported("a", vec![report]);
        let found = Estimate::new(
            &auv,
            Some(&known),
            report.t_s,
            &Vector2::zeros(),
            None,
            None,
            &|| false,
        );
        found.route.expect("it has a path").is_followed()
    };
    assert!(followed(only));
    // At rest, or far away, it does not follow its path.
    let still = GroundTrack {
        course: Course::new(0.0),
        speed: 0.0,
    };
    assert!(!followed(only.with_ground_track(Some(still))));
    let beside = only.position() + Vector2::new(3.0e3, 4.0e3);
    assert!(!followed(Report::new(only.t_s, beside, SIGMA)));
}

#[test]
fn a_moved_path_with_its_reports_moves_the_estimate() {
    let (known, reports, _) = lanes(&mut Random(2));
    let (turn, shift) = (ned_from_body(2.0), Vector2::new(500.0, -300.0));
    let path = Path::lawn_mower(turn * Vector2::new(3.0, -7.0) + shift, 2.4, 60.0, 20.0, 4);
    let elsewhere = KnownPath {
        path: Arc::new(path),
        ..known.clone()
    };
    let moved = |report: &Report| Report {
        north_m: (turn * report.position() + shift).x,
        east_m: (turn * report.position() + shift).y,
        course_rad: (report.ground_track().map(|track| GroundTrack {
            course: Course::new(track.course.radians() + 2.0),
            ..track
        }))
        .map(|track| track.course.radians()),
        speed_mps: (report.ground_track().map(|track| GroundTrack {
            course: Course::new(track.course.radians() + 2.0),
            ..track
        }))
        .map(|track| track.speed),
        ..*report
    };
    let here = estimate_along(&known, &reports).state;
    let there = estimate_along(&elsewhere, &reports.iter().map(moved).collect::<Vec<_>>()).state;
    assert!((turn * here.position() + shift - there.position()).norm() < 1e-9);
    assert!((turn * here.velocity() - there.velocity()).norm() < 1e-9);
    let position = |state: &AuvState| {
        state
            .covariance()
            .expect("is there")
            .fixed_view::<2, 2>(0, 0)
            .into_owned()
    };
    assert!((turn * position(&here) * turn.transpose() - position(&there)).amax() < 1e-9);
}

/// Estimated rates of a vehicle with a constant rate of turn: exact states without the rate,
/// `interval` seconds apart, each with the previous answer.
fn turn_rates_from_states(rate: f64, interval: f64, n: u32, course_error: impl Fn(u32) -> f64) -> Vec<f64> {
    let mut remembered: Option<(RememberedTarget, f64)> = None;
    let mut rates = Vec::new();
    for k in 0..n {
        let time = interval * f64::from(k);
        let auv = Auv::new(
            "a",
            AuvState::new(
                Vector2::zeros(),
                0.0,
                Course::new(1.0 + rate * time + course_error(k)),
                0.9,
            ),
        );
        let state = Estimate::new(&auv, None, time, &Vector2::zeros(), remembered, None, &|| false).state;
        rates.push(state.turn_rate_radps);
        let target = RememberedTarget {
            model: crate::facts::options::ForecastModel::ConstantVelocity,
            estimate: PreviousEstimate::from(&state),
            drift: Vector2::zeros(),
        };
        // Repeating the same state, with an answer in between, changes nothing.
        let again = Estimate::new(
            &auv,
            None,
            time,
            &Vector2::zeros(),
            Some((target, time)),
            None,
            &|| false,
        )
        .state;
        assert_eq!(again.turn_rate_radps, state.turn_rate_radps);
        remembered = Some((target, time));
    }
    rates
}

#[test]
fn an_unreported_rate_of_turn_is_estimated_from_successive_states() {
    for rate in [0.09, -0.03, 0.3] {
        for interval in [1.0, 5.0] {
            let rates = turn_rates_from_states(rate, interval, 21, |_| 0.0);
            assert_eq!(rates[0], 0.0);
            // After n states a share exp(−n Δ/τ) is missing, without insignificant rates.
            assert!((rates[20] - rate).abs() < 0.05 * rate.abs(), "{rate}: {rates:?}");
        }
    }
    // A straight course stays straight.
    assert_eq!(turn_rates_from_states(0.0, 1.0, 30, |_| 0.0), [0.0; 30]);
}

#[test]
fn course_errors_make_no_significant_turn() {
    let mut random = Random(3);
    let errors: Vec<_> = (0..400).map(|_| 0.05 * random.normal().x).collect();
    let rates = turn_rates_from_states(0.0, 1.0, 400, |k| errors[usize::try_from(k).expect("few")]);
    let rms = (rates.iter().map(|rate| rate * rate).sum::<f64>() / 400.0).sqrt();
    // As documented: the derivative of white noise through a filter of 5 s.
    assert!((0.002..0.014).contains(&rms), "{rms} rad/s");
}

#[test]
fn a_reported_rate_of_turn_is_not_estimated() {
    let (reports, ..) = flight(&mut Random(8), 3, Vector2::new(0.9, 0.1));
    let rate = |reported: [Option<f64>; 3], turned: f64| {
        let mut reports = reports.clone();
        for (k, (report, reported)) in (0_u8..).zip(reports.iter_mut().zip(reported)) {
            report.turn_rate_radps = reported;
            let course = 0.1 + turned * f64::from(k);
            *report = report.with_ground_track(Some(GroundTrack {
                course: Course::new(course),
                speed: 0.9,
            }));
            report.sigma_m = 100.0;
        }
        estimate(&reports, 525.0).state.turn_rate_radps
    };
    assert_eq!(rate([None, Some(0.02), None], 0.5), 0.02);
    // Half a radian in ten seconds without a reported rate; a tenth of that is no turn.
    assert!((rate([None; 3], 0.5) - 0.05).abs() < 1e-12);
    assert_eq!(rate([None; 3], 0.04), 0.0);
}

#[test]
fn reports_older_than_an_hour_count_if_there_are_no_others() {
    let (mut reports, ..) = flight(&mut Random(9), 5, Vector2::new(0.2, 0.1));
    for report in &mut reports[..3] {
        report.t_s -= 5000.0;
    }
    let young = estimate(&reports, 600.0);
    assert_eq!(young.rejected, [0, 1, 2]);
    assert_eq!(young.state, estimate(&reports[3..], 600.0).state);
    let old = estimate(&reports[..3], 600.0);
    assert_eq!(old.rejected, [0, 1]);
    assert_eq!(old.state.position(), reports[2].position());
    // Years of age work with and without a path.
    let (known, ..) = lanes(&mut Random(1));
    let auv = Auv::reported("a", reports);
    let ages = Estimate::new(&auv, Some(&known), 1.0e11, &Vector2::zeros(), None, None, &|| {
        false
    });
    assert!(ages.position_sigma(TUNED).is_some_and(f64::is_finite));
}

fn report(extent: f64) -> impl Strategy<Value = Report> {
    let within = -extent..extent;
    (
        (400.0..500.5_f64, within.clone(), within, 0.01..100.0_f64),
        proptest::option::of(-10.0..1000.0_f64),
        proptest::option::of((-3.1..3.1_f64, 0.0..10.0_f64)),
        proptest::option::of(-1.0..1.0_f64),
    )
        .prop_map(|((time, north, east, sigma), depth, track, turn_rate)| Report {
            depth_m: depth,
            turn_rate_radps: turn_rate,
            ..Report::new(time, Vector2::new(north, east), sigma).with_ground_track(track.map(
                |(course, speed)| GroundTrack {
                    course: Course::new(course),
                    speed,
                },
            ))
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_order_of_the_reports_has_no_effect(
        (reports, shuffled) in proptest::collection::vec(report(30.0), 1..20)
            .prop_flat_map(|reports| (Just(reports.clone()), Just(reports).prop_shuffle())),
    ) {
        let (a, b) = (estimate(&reports, 500.0), estimate(&shuffled, 500.0));
        prop_assert_eq!(&a.state, &b.state);
        let named = |reports: &[Report], rejected: &[usize]| {
            let mut named: Vec<_> = rejected.iter().map(|i| reports[*i]).collect();
            named.sort_by(in_order);
            named
        };
        prop_assert_eq!(named(&reports, &a.rejected), named(&shuffled, &b.rejected));
    }

    #[test]
    fn any_reports_give_a_finite_estimate_with_positive_definite_covariance(
        reports in prop_oneof![
            proptest::collection::vec(report(30.0), 1..=64),
            proptest::collection::vec(report(1.0e6), 1..=64),
        ],
        late in 0.0..3000.0_f64,
    ) {
        let state = estimate(&reports, 500.0 + late).state;
        let along = estimate_along(&lanes(&mut Random(1)).0, &reports).state;
        prop_assert!(along.position().norm().is_finite() && along.velocity().norm().is_finite());
        prop_assert!(along.covariance().is_some_and(|covariance| covariance.cholesky().is_some()));
        let covariance = state.covariance().expect("made of reports");
        prop_assert_eq!(covariance, covariance.transpose());
        prop_assert!(covariance.cholesky().is_some(), "{}", covariance);
        prop_assert!(state.position().norm().is_finite() && (0.0..=10.0).contains(&state.speed_mps));
        prop_assert!((0.0..=3600.0).contains(&state.age_s) && state.course().radians().is_finite());
    }

    #[test]
    fn rotating_and_moving_the_scene_rotates_and_moves_the_estimate(
        reports in proptest::collection::vec(report(30.0), 1..20),
        angle in -3.1..3.1_f64,
        (north, east, delay) in (-1.0e3..1.0e3_f64, -1.0e3..1.0e3_f64, -1.0e3..1.0e3_f64),
    ) {
        let (turn, shift) = (ned_from_body(angle), Vector2::new(north, east));
        let moved = |report: &Report| Report { t_s: report.t_s + delay, north_m: (turn * report.position() + shift).x, east_m: (turn * report.position() + shift).y, course_rad: (report.ground_track().map(|track| GroundTrack {
                course: Course::new(track.course.radians() + angle),
                ..track
            })).map(|track| track.course.radians()), speed_mps: (report.ground_track().map(|track| GroundTrack {
                course: Course::new(track.course.radians() + angle),
                ..track
            })).map(|track| track.speed), ..*report };
        let here = estimate(&reports, 500.0);
        let there = estimate(&reports.iter().map(moved).collect::<Vec<_>>(), 500.0 + delay);
        prop_assert_eq!(&here.rejected, &there.rejected);
        let (here, there) = (here.state, there.state);
        // Rounding of numbers around a thousand, amplified by almost simultaneous fixes.
        prop_assert!((turn * here.position() + shift - there.position()).norm() < 1e-6);
        prop_assert!((turn * here.velocity() - there.velocity()).norm() < 1e-6);
        let mut four = nalgebra::Matrix4::zeros();
        four.fixed_view_mut::<2, 2>(0, 0).copy_from(&turn);
        four.fixed_view_mut::<2, 2>(2, 2).copy_from(&turn);
        let (p, q) = (here.covariance().expect("is there"), there.covariance().expect("is there"));
        prop_assert!((four * p * four.transpose() - q).amax() < 1e-6 * p.amax());
    }
}

#[test]
fn the_next_turn_is_the_first_one_ahead_with_the_sense_of_motion() {
    // A square of 100 m to starboard, with corners of 10 m, from the middle of the first side.
    let corners = [(50.0, 0.0), (50.0, 100.0), (-50.0, 100.0), (-50.0, 0.0)].map(|(x, y)| Vector2::new(x, y));
    let closed = Path::waypoints(&corners, 10.0, true).expect("is a path");
    let open = Path::waypoints(&corners, 10.0, false).expect("is a path");
    let next = |path: &Path, along: f64, sense: f64| {
        let known = KnownPath {
            path: Arc::new(path.clone()),
            horizontal_speed: 0.5,
        };
        let fit = PathFit {
            state: Vector4::new(along, 0.0, 0.0, 0.0),
            covariance: Matrix4::identity(),
            sense,
            spread: Spread::default(),
        };
        let assumed = PathHypothesis {
            known: &known,
            current: Vector2::zeros(),
            speed_density: 0.0,
            roughness: None,
            tuned: TUNED,
        };
        let turn = fit.next_turn(&assumed);
        turn.map(|turn| ((turn.in_s * 0.5).round(), (turn.by_rad / FRAC_PI_2).round()))
    };
    // The open one: 90 m, an arc of 16 m, 80 m, an arc, 90 m.
    for (along, sense, expected) in [
        (40.0, 1.0, Some((50.0, 1.0))),
        (95.0, 1.0, Some((91.0, 1.0))),
        (200.0, 1.0, None),
        (250.0, -1.0, Some((49.0, -1.0))),
        (1000.0, -1.0, Some((799.0, -1.0))),
        (150.0, -1.0, Some((44.0, -1.0))),
        (50.0, -1.0, None),
    ] {
        assert_eq!(next(&open, along, sense), expected, "{along} {sense}");
    }
    let lap = closed.length();
    let begins: Vec<_> = (0..40).map(|k| f64::from(k) / 40.0 * lap).collect();
    for along in begins {
        for (sense, side) in [(1.0, 1.0), (-1.0, -1.0)] {
            let (distance, by) = next(&closed, along, sense).expect("a lap has turns");
            assert!(
                (0.0..=97.0).contains(&distance) && by == side,
                "{along} {sense} {distance} {by}"
            );
        }
    }
    let circle = Path::circle(Vector2::zeros(), 30.0, Side::Starboard, 0.0).expect("is a path");
    assert_eq!(next(&circle, 10.0, 1.0), None);
    // Bends by 11° and 14°, then a corner.
    let bent = [
        (0.0, 0.0),
        (100.0, 0.0),
        (200.0, 20.0),
        (300.0, 20.0),
        (300.0, 120.0),
    ];
    let bent = bent.map(|(x, y)| Vector2::new(x, y));
    let bent = Path::waypoints(&bent, 10.0, false).expect("is a path");
    let (distance, by) = next(&bent, 0.0, 1.0).expect("has a corner");
    assert!(
        (bent.length() - 90.0 - 16.0 - distance).abs() < 2.0 && by == 1.0,
        "{distance} {by}"
    );
}
