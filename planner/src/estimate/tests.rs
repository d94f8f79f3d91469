//! Reports follow the filter's own model, unless a test says otherwise.

use std::{f64::consts::FRAC_PI_2, sync::Arc};

use nalgebra::{Matrix2, Matrix6, Vector6};
use proptest::prelude::*;

use super::*;
use crate::{
    estimate::{
        from_reports::{Before, Estimator, in_order},
        kalman::Kalman,
        legs::TrackPoint,
        on_path::{PathHypothesis, Spread},
        past_states::PastState,
    },
    facts::{
        known_path::speed_along,
        previous_plan::{PreviousEstimate, RememberedTarget},
    },
    tests::prelude::*,
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
        let estimator = Estimator { now, current: *current, tuned: TUNED, due };
        estimator.estimate(auv, path, Before { target: previous, track: before, ..Before::default() })
    }

    /// The estimate in still water, with the track and the past states of an earlier one.
    pub(crate) fn remembering(
        auv: &Auv,
        path: Option<&KnownPath>,
        now: f64,
        (track, states): (&[TrackPoint], &[PastState]),
    ) -> Self {
        let estimator = Estimator { now, current: Vector2::zeros(), tuned: TUNED, due: &|| false };
        estimator.estimate(auv, path, Before { track: Some(track), states, ..Before::default() })
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
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Two standard normal numbers, by Box and Muller.
    pub(crate) fn normal(&mut self) -> Vector2<f64> {
        let size = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        direction(std::f64::consts::TAU * self.uniform()) * size
    }
}

/// `n` reports of a vehicle that moves as the filter's model, with its last position and velocity.
fn flight(seed: u64, n: usize, velocity: Vector2<f64>) -> (Vec<Report>, Vector2<f64>, Vector2<f64>) {
    let mut random = Random(seed);
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
        let fix = Report::new(time, position + random.normal() * SIGMA, SIGMA);
        reports.push(Report {
            depth_m: Some(5.0),
            turn_rate_radps: Some(0.0),
            ..tracked(&fix, angle_of(&reported), reported.norm())
        });
    }
    (reports, position, velocity)
}

/// The report with a telemetered course and speed.
fn tracked(report: &Report, course: f64, speed: f64) -> Report {
    let course = Course::new(course);
    report.with_ground_track(Some(GroundTrack { course, speed }))
}

/// The report from another position.
fn placed(report: &Report, position: Vector2<f64>) -> Report {
    let mut placed = *report;
    placed.move_position(|_| position);
    placed
}

/// The report from a scene rotated by `angle`, then shifted, later by `delay`.
fn moved(report: &Report, angle: f64, shift: Vector2<f64>, delay: f64) -> Report {
    let turned = |course| Course::new(course + angle).radians();
    Report {
        t_s: report.t_s + delay,
        course_rad: report.course_rad.map(turned),
        ..placed(report, ned_from_body(angle) * report.position() + shift)
    }
}

fn estimated(auv: &Auv, known: Option<&KnownPath>, now: f64, current: Vector2<f64>) -> Estimate {
    Estimate::new(auv, known, now, &current, None, None, &|| false)
}

fn position_covariance(state: &AuvState) -> Matrix2<f64> {
    let covariance = state.covariance().expect("made of reports");
    covariance.fixed_view::<2, 2>(0, 0).into_owned()
}

fn estimate(reports: &[Report], now: f64) -> Estimate {
    let auv = Auv::reported("a", reports.to_vec());
    estimated(&auv, None, now, Vector2::zeros())
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
fn the_gate_reduces_the_error_with_two_percent_of_outliers() {
    let rms = |gated: bool, with_telemetry: bool| {
        let squares = (0..200).map(|seed| {
            let mut random = Random(1000 + seed);
            let (mut reports, position, _) = flight(seed, 20, Vector2::new(0.15, 0.12));
            for report in &mut reports {
                let error = random.normal() * 20.0;
                if random.uniform() < 0.02 {
                    *report = placed(report, report.position() + error);
                }
            }
            if !with_telemetry {
                reports = positions_alone(&reports);
            }
            let found = if gated {
                let state = estimate(&reports, 690.0).state;
                let (then, covariance) = (690.0 - state.age_s, state.covariance().expect("made of reports"));
                let newest = Kalman::new(then, &state.position(), &state.velocity(), &covariance);
                newest.at(690.0, TUNED).position()
            } else {
                let (first, later) = reports.split_first().expect("not empty");
                let mut filter = Kalman::start(first, TUNED);
                for report in later {
                    filter.accept_ungated(report);
                }
                filter.position()
            };
            (found - position).norm_squared()
        });
        (squares.sum::<f64>() / 200.0).sqrt()
    };
    for with_telemetry in [true, false] {
        let (with, without) = (rms(true, with_telemetry), rms(false, with_telemetry));
        assert!(with < 0.8 * without, "{with} m, {without} m without a gate");
    }
}

#[test]
fn a_single_report_is_the_estimate() {
    let (reports, ..) = flight(1, 1, Vector2::new(0.2, 0.1));
    let only = estimate(&reports, 503.0);
    assert_eq!(only.rejected, [] as [usize; 0]);
    assert_eq!(only.state.position(), reports[0].position());
    assert_eq!((only.state.age_s, only.state.depth_m), (3.0, 5.0));
    // Its velocity outweighs the prior, 3 m/s, ten thousand times.
    let reported = reports[0].ground_track().expect("is reported").velocity();
    near_to(only.state.velocity(), reported, 1e-3 * reported.norm());
    let bare = estimate(&positions_alone(&reports), 503.0).state;
    assert_eq!([bare.speed_mps, bare.depth_m, bare.turn_rate_radps], [0.0; 3]);
}

#[test]
fn two_simultaneous_fixes_equal_one_of_half_the_variance() {
    let (reports, ..) = flight(2, 1, Vector2::new(0.2, 0.1));
    let first = positions_alone(&reports)[0];
    let second = placed(&first, first.position() + Vector2::new(1.0, -0.5));
    let both = estimate(&[first, second], 500.0).state;
    let expected = (first.position() + second.position()) * 0.5;
    near_to(both.position(), expected, 1e-12);
    near(position_covariance(&both)[(0, 0)], 0.5 * SIGMA * SIGMA, 1e-12);
}

#[test]
fn a_repeated_report_counts_once() {
    let (reports, ..) = flight(3, 8, Vector2::new(0.2, 0.1));
    let twice: Vec<_> = reports.iter().chain(&reports[2..5]).copied().collect();
    let (once, twice) = (estimate(&reports, 580.0), estimate(&twice, 580.0));
    assert_eq!(once.state, twice.state);
    assert_eq!(twice.rejected.len(), 3);
}

#[test]
fn one_message_over_two_links_counts_once() {
    let (reports, ..) = flight(3, 8, Vector2::new(0.2, 0.1));
    // The second link rounds the position, omits the depth and claims less.
    let other = |report: &Report| Report {
        depth_m: None,
        sigma_m: 1.0,
        ..placed(report, report.position() + Vector2::new(0.04, 0.0))
    };
    let twice: Vec<_> = reports.iter().copied().chain(reports.iter().map(other)).collect();
    let (once, twice) = (estimate(&reports, 580.0), estimate(&twice, 580.0));
    assert_eq!(once.state, twice.state);
    assert_eq!(twice.rejected, (8..16).collect::<Vec<_>>());
}

#[test]
fn a_moved_vehicle_is_found_by_the_second_report() {
    let (mut reports, ..) = flight(4, 10, Vector2::new(0.2, 0.1));
    for report in &mut reports[8..] {
        *report = placed(report, report.position() + Vector2::new(300.0, 0.0));
    }
    assert_eq!(estimate(&reports[..9], 620.0).rejected, [8]);
    for reports in [&reports, &positions_alone(&reports)] {
        let found = estimate(reports, 620.0);
        assert_eq!(found.rejected, (0..8).collect::<Vec<_>>());
        near_to(found.state.position(), reports[9].position(), 3.0 * SIGMA);
        assert!(found.state.speed_mps < 0.5);
    }
}

#[test]
fn an_initial_outlier_is_not_followed() {
    let (mut reports, ..) = flight(5, 3, Vector2::new(0.2, 0.1));
    reports[0] = placed(&reports[0], reports[0].position() + Vector2::new(0.0, 60.0));
    assert_eq!(estimate(&reports, 530.0).rejected, [0]);
}

#[test]
fn the_fastest_vehicle_is_followed_without_a_reported_speed() {
    let (reports, _, velocity) = flight(6, 10, Vector2::new(-7.0, 7.0));
    let found = estimate(&positions_alone(&reports), 595.0);
    assert_eq!(found.rejected, [] as [usize; 0]);
    near_to(found.state.velocity(), velocity, 1.0);
}

#[test]
fn an_impossible_velocity_is_dropped_and_its_position_is_used() {
    let (mut reports, ..) = flight(7, 10, Vector2::new(0.2, 0.1));
    let sane = estimate(&reports, 595.0);
    reports[9].speed_mps = Some(5.0);
    let found = estimate(&reports, 595.0);
    assert_eq!((found.rejected, found.state.age_s), (vec![], 5.0));
    near_to(found.state.velocity(), sane.state.velocity(), 0.1);
}

#[test]
fn a_turn_reported_more_than_a_minute_ago_is_unused() {
    let (mut reports, ..) = flight(8, 2, Vector2::new(0.2, 0.1));
    reports[0].turn_rate_radps = Some(0.02);
    reports[1].turn_rate_radps = None;
    let turn_rate = |now| estimate(&reports, now).state.turn_rate_radps;
    assert_eq!((turn_rate(560.0), turn_rate(560.1)), (0.02, 0.0));
}

#[test]
fn the_present_sigma_is_the_filter_s_prediction() {
    let (reports, ..) = flight(9, 5, Vector2::new(0.2, 0.1));
    let sigma = |now| {
        let sigma = estimate(&reports, now).position_sigma(TUNED);
        sigma.expect("made of reports")
    };
    let p = estimate(&reports, 540.0).state.covariance.expect("made of reports");
    let (t, q) = (30.0_f64, TUNED.acceleration_density);
    // p + v t with independent errors: P_pp + 2 t P_pv + t² P_vv + q t³/3 along either axis.
    let along = |i: usize| p[i][i] + 2.0 * t * p[i][i + 2] + t * t * p[i + 2][i + 2] + q * t.powi(3) / 3.0;
    near(sigma(570.0), (along(0) + along(1)).sqrt(), 1e-12);
    assert!(sigma(570.0) > sigma(540.0));
}

/// Reports of a vehicle on lanes of 60 m at 0.193 m/s, 1 m to starboard, and its last position.
fn lanes(seed: u64) -> (KnownPath, Vec<Report>, Vector2<f64>) {
    let mut random = Random(seed);
    let path = Path::lawn_mower(Vector2::new(3.0, -7.0), 0.4, 60.0, 20.0, 4);
    let place = |time: f64| {
        let point = path.at(5.0 + 0.193 * time);
        (point.position + starboard(point.tangent), point.tangent)
    };
    let report = |k: u32| {
        let time = INTERVAL * f64::from(k);
        let (position, tangent) = place(time);
        let fix = Report::new(time, position + random.normal() * SIGMA, SIGMA);
        tracked(&fix, tangent + COURSE_SIGMA * random.normal().x, 0.193)
    };
    let (reports, end) = ((0..30).map(report).collect(), place(290.0).0);
    (known(path, 0.193), reports, end)
}

fn known(path: Path, horizontal_speed: f64) -> KnownPath {
    let path = Arc::new(path);
    KnownPath { path, horizontal_speed }
}

fn estimate_along(known: &KnownPath, reports: &[Report]) -> Estimate {
    let auv = Auv::reported("a", reports.to_vec());
    estimated(&auv, Some(known), 290.0, Vector2::zeros())
}

#[test]
fn a_followed_path_improves_the_estimate() {
    for (with_telemetry, gain) in [(true, 1.0), (false, 0.7)] {
        let (mut along, mut free) = (0.0_f64, 0.0_f64);
        for seed in 0..200 {
            let (known, mut reports, truth) = lanes(seed);
            if !with_telemetry {
                reports = positions_alone(&reports);
            }
            along += (estimate_along(&known, &reports).state.position() - truth).norm_squared();
            free += (estimate(&reports, 290.0).state.position() - truth).norm_squared();
        }
        assert!(along.sqrt() < gain * free.sqrt(), "{along} m² along the path, {free} m² free");
    }
}

#[test]
fn the_error_along_a_path_is_within_the_covariance() {
    // The normalised squared error, eᵀ P⁻¹ e, is χ² with two degrees of freedom; the sum of 200 has
    // 400, and 97.5 % lie below 457.3. Here it is less: the vehicle keeps its speed and its offset.
    let squared = (0..200).map(|seed| {
        let (known, reports, truth) = lanes(seed);
        let state = estimate_along(&known, &reports).state;
        let error = state.position() - truth;
        let inverse = position_covariance(&state).try_inverse();
        error.dot(&(inverse.expect("positive definite") * error))
    });
    let sum: f64 = squared.sum();
    assert!((50.0..=457.3).contains(&sum), "{sum}");
}

#[test]
fn a_vehicle_that_leaves_its_path_is_estimated_from_its_motion() {
    let (known, mut reports, _) = lanes(1);
    // It goes straight where the path turns, 15 m ahead of it.
    let start = reports[0].position() + direction(0.4) * 40.0;
    for (k, report) in (0..30).zip(&mut reports) {
        let there = start + direction(0.4) * (0.193 * INTERVAL * f64::from(k));
        *report = tracked(&placed(report, there), 0.4, 0.193);
    }
    let found = estimate_along(&known, &reports);
    assert!(!found.route.expect("has a path").is_followed());
    assert_eq!(found.state, estimate(&reports, 290.0).state);
}

/// Reports every 10 s of a vehicle at `place`, positions alone.
fn reported_at(mut place: impl FnMut(f64) -> Vector2<f64>, n: u32, random: &mut Random) -> Vec<Report> {
    let report = |k: u32| {
        let time = INTERVAL * f64::from(k);
        Report::new(time, place(time) + random.normal() * SIGMA, SIGMA)
    };
    (0..n).map(report).collect()
}

/// Fit of a vehicle with `speed` to `path` by all of `reports`.
fn route(path: &Path, speed: f64, reports: &[Report]) -> Route {
    let auv = Auv::reported("a", reports.to_vec());
    let now = reports.last().expect("there are some").t_s;
    let found = estimated(&auv, Some(&known(path.clone(), speed)), now, Vector2::zeros());
    found.route.expect("has a path")
}

#[test]
fn two_turns_reveal_the_path_s_offset_and_sense() {
    let path = Path::lawn_mower(Vector2::zeros(), 0.4, 150.0, 30.0, 4);
    let (mut squares, mut normalised) = (0.0_f64, 0.0);
    for seed in 0..40_u32 {
        let mut random = Random(seed.into());
        // Backwards on displaced lanes is forwards on their neighbours.
        for (sense, start, distance) in [(1.0, 5.0, 18.0), (-1.0, path.length() - 5.0, 3.0)] {
            let shift = ned_from_body(f64::from(seed)) * Vector2::new(distance, 0.0);
            let reports = reported_at(|time| path.at(start + sense * time).position + shift, 42, &mut random);
            let [early, late] = [12, 42].map(|n| route(&path, 0.9, &reports[..n]));
            assert!(early.is_followed() && late.is_followed(), "seed {seed}");
            assert_eq!(late.fit.sense.signum(), sense, "seed {seed}: {late:?}");
            let off = late.fit.offset() - shift;
            squares += off.norm_squared();
            let covariance = late.fit.covariance.fixed_view::<2, 2>(2, 2).into_owned();
            normalised += off.dot(&(covariance.try_inverse().expect("positive definite") * off));
        }
    }
    let rms = (squares / 80.0).sqrt();
    assert!(rms < 3.0 && normalised / 80.0 < 4.0, "{rms} m, {normalised}");
}

#[test]
fn an_undeclared_turn_radius_is_estimated() {
    let lanes = |turn_radius_m| {
        let row = |k: u32| {
            let (east, ends) = (40.0 * f64::from(k), [0.0, 200.0]);
            let [from, to] = if k.is_multiple_of(2) { [0, 1] } else { [1, 0] };
            [[ends[from], east], [ends[to], east]]
        };
        declared_through((0..6).flat_map(row).collect(), turn_radius_m, 1.0)
    };
    let known = |path: &DeclaredPath| path.known().expect("is a path");
    let declared = lanes(None);
    let mut off = [0.0; 2];
    for (seed, radius) in (0..90_u32).zip([6.0, 10.0, 16.0].into_iter().cycle()) {
        let actual = known(&lanes(Some(radius))).path;
        let place = |time: f64| actual.at(5.0 + time).position;
        let unnamed = Auv::reported("a", reported_at(place, 64, &mut Random(seed.into())));
        let mut named = unnamed.clone();
        named.path = Some(declared.clone());
        // A minute later it has turned again.
        for (off, auv) in off.iter_mut().zip([named, unnamed]) {
            let found = estimated(&auv, Some(&known(&declared)), 630.0, Vector2::zeros());
            let (fit, path) = (found.route.expect("has a path").fit, found.path.expect("has one").path);
            let then = path.at(fit.along() + 110.0 + 110.0 * fit.faster()).position + fit.offset();
            *off += (then - place(740.0)).norm_squared() / 90.0;
        }
    }
    let [seen, assumed] = off.map(f64::sqrt);
    assert!(seen < 0.7 * assumed, "{seen} m off, assumed {assumed} m");
}

#[test]
fn a_speed_over_ground_is_distinguished_from_one_through_the_water() {
    let path = Path::lawn_mower(Vector2::zeros(), 0.0, 60.0, 20.0, 8);
    let current = Vector2::new(0.2, 0.1);
    let mut right = 0;
    for seed in 0..40_u32 {
        let over_ground = seed.is_multiple_of(2);
        let water = if over_ground { Vector2::zeros() } else { current };
        // The arc length after each second.
        let mut along = vec![5.0];
        for second in 0..600 {
            let gamma: f64 = along[second];
            along.push(gamma + speed_along(0.5, &water, path.at(gamma).tangent));
        }
        let mut times = along.iter().step_by(10);
        let place = |_| path.at(*times.next().expect("ten minutes")).position;
        let auv = Auv::reported("a", reported_at(place, 60, &mut Random(seed.into())));
        let found = estimated(&auv, Some(&known(path.clone(), 0.5)), 590.0, current);
        let route = found.route.expect("has a path");
        assert!(route.is_followed(), "seed {seed}");
        right += u32::from(route.current == water);
    }
    assert!(38 <= right, "{right} of 40 told apart");
}

#[test]
fn a_vehicle_that_leaves_its_path_is_forecast_without_it_after_three_fixes() {
    let path = Path::lawn_mower(Vector2::zeros(), 0.4, 300.0, 30.0, 4);
    let mut late = 0;
    for seed in 0..50 {
        let place = |time: f64| {
            let there = path.at(5.0 + time.min(150.0));
            there.position + direction(there.tangent + 1.0) * (time - 150.0).max(0.0)
        };
        let reports = reported_at(place, 20, &mut Random(seed));
        assert!(route(&path, 1.0, &reports[..16]).is_followed(), "seed {seed}");
        late += u32::from(route(&path, 1.0, &reports[..19]).is_followed());
    }
    assert!(late <= 2, "{late} of 50 are still taken to follow");
}

#[test]
fn one_fix_on_the_path_keeps_the_path() {
    let (known, reports, _) = lanes(5);
    let only = Report::new(reports[3].t_s, reports[3].position(), SIGMA);
    let followed = |report: Report| {
        let auv = Auv::reported("a", vec![report]);
        let found = estimated(&auv, Some(&known), report.t_s, Vector2::zeros());
        found.route.expect("it has a path").is_followed()
    };
    assert!(followed(only));
    // At rest, or far away, it does not follow its path.
    assert!(!followed(tracked(&only, 0.0, 0.0)));
    assert!(!followed(placed(&only, only.position() + Vector2::new(3.0e3, 4.0e3))));
}

#[test]
fn a_moved_path_with_its_reports_moves_the_estimate() {
    let (here, reports, _) = lanes(2);
    let (turn, shift) = (ned_from_body(2.0), Vector2::new(500.0, -300.0));
    let path = Path::lawn_mower(turn * Vector2::new(3.0, -7.0) + shift, 2.4, 60.0, 20.0, 4);
    let moved: Vec<_> = reports.iter().map(|report| moved(report, 2.0, shift, 0.0)).collect();
    let here = estimate_along(&here, &reports).state;
    let there = estimate_along(&known(path, 0.193), &moved).state;
    near_to(there.position(), turn * here.position() + shift, 1e-9);
    near_to(there.velocity(), turn * here.velocity(), 1e-9);
    let turned = turn * position_covariance(&here) * turn.transpose();
    assert!((turned - position_covariance(&there)).amax() < 1e-9);
}

/// Estimated rates of a vehicle with a constant rate of turn: exact states without the rate,
/// `interval` seconds apart, each with the previous answer.
fn turn_rates_from_states(rate: f64, interval: f64, n: u32, course_error: impl Fn(u32) -> f64) -> Vec<f64> {
    let mut remembered: Option<(RememberedTarget, f64)> = None;
    let mut rates = Vec::new();
    for k in 0..n {
        let time = interval * f64::from(k);
        let course = 1.0 + rate * time + course_error(k);
        let auv = Auv::new("a", moving(0.0, 0.0, 0.0, course, 0.9));
        let after = |known| Estimate::new(&auv, None, time, &Vector2::zeros(), known, None, &|| false).state;
        let state = after(remembered);
        rates.push(state.turn_rate_radps);
        let target = RememberedTarget {
            model: crate::facts::options::ForecastModel::ConstantVelocity,
            estimate: PreviousEstimate::from(&state),
            drift: Vector2::zeros(),
        };
        remembered = Some((target, time));
        // Repeating the same state, with an answer in between, changes nothing.
        assert_eq!(after(remembered).turn_rate_radps, state.turn_rate_radps);
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
    let (reports, ..) = flight(8, 3, Vector2::new(0.9, 0.1));
    let rate = |reported: [Option<f64>; 3], turned: f64| {
        let of = |(k, report): (u8, &Report)| Report {
            turn_rate_radps: reported[usize::from(k)],
            sigma_m: 100.0,
            ..tracked(report, 0.1 + turned * f64::from(k), 0.9)
        };
        let reports: Vec<_> = (0..).zip(&reports).map(of).collect();
        estimate(&reports, 525.0).state.turn_rate_radps
    };
    assert_eq!(rate([None, Some(0.02), None], 0.5), 0.02);
    // Half a radian in ten seconds without a reported rate; a tenth of that is no turn.
    near(rate([None; 3], 0.5), 0.05, 1e-12);
    assert_eq!(rate([None; 3], 0.04), 0.0);
}

#[test]
fn reports_older_than_an_hour_count_if_there_are_no_others() {
    let (mut reports, ..) = flight(9, 5, Vector2::new(0.2, 0.1));
    for report in &mut reports[..3] {
        report.t_s -= 5000.0;
    }
    let young = estimate(&reports, 600.0);
    // They contradict nobody.
    assert_eq!(young.rejected, [0; 0]);
    assert_eq!(young.state, estimate(&reports[3..], 600.0).state);
    let old = estimate(&reports[..3], 600.0);
    assert_eq!(old.rejected, [0; 0]);
    assert_eq!(old.state.position(), reports[2].position());
    // Years of age work with and without a path.
    let auv = Auv::reported("a", reports);
    let ages = estimated(&auv, Some(&lanes(1).0), 1.0e11, Vector2::zeros());
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
        .prop_map(|((time, north, east, sigma), depth_m, track, turn_rate_radps)| Report {
            depth_m,
            turn_rate_radps,
            course_rad: track.map(|(course, _)| course),
            speed_mps: track.map(|(_, speed)| speed),
            ..Report::new(time, Vector2::new(north, east), sigma)
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
        let along = estimate_along(&lanes(1).0, &reports).state;
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
        let moved: Vec<_> = reports.iter().map(|report| moved(report, angle, shift, delay)).collect();
        let (here, there) = (estimate(&reports, 500.0), estimate(&moved, 500.0 + delay));
        prop_assert_eq!(&here.rejected, &there.rejected);
        let (here, there) = (here.state, there.state);
        // Rounding of numbers around a thousand, amplified by almost simultaneous fixes.
        near_to(there.position(), turn * here.position() + shift, 1e-6);
        near_to(there.velocity(), turn * here.velocity(), 1e-6);
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
    let path = |corners: &[[f64; 2]], closed| {
        let corners: Vec<_> = corners.iter().copied().map(Vector2::from).collect();
        Path::waypoints(&corners, 10.0, closed).expect("is a path")
    };
    let square = [[50.0, 0.0], [50.0, 100.0], [-50.0, 100.0], [-50.0, 0.0]];
    let (closed, open) = (path(&square, true), path(&square, false));
    let next = |path: &Path, along: f64, sense: f64| {
        let fit = PathFit {
            state: Vector6::new(along, 0.0, 0.0, 0.0, 0.0, 0.0),
            covariance: Matrix6::identity(),
            sense,
            spread: Spread::default(),
        };
        let assumed = PathHypothesis {
            known: &known(path.clone(), 0.5),
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
    for along in (0..40).map(|k| f64::from(k) / 40.0 * closed.length()) {
        for sense in [1.0, -1.0] {
            let (distance, by) = next(&closed, along, sense).expect("a lap has turns");
            assert!((0.0..=97.0).contains(&distance) && by == sense, "{along} {sense}");
        }
    }
    let circle = Path::circle(Vector2::zeros(), 30.0, Side::Starboard, 0.0).expect("is a path");
    assert_eq!(next(&circle, 10.0, 1.0), None);
    // Bends by 11° and 14°, then a corner.
    let bends = [[0.0, 0.0], [100.0, 0.0], [200.0, 20.0], [300.0, 20.0], [300.0, 120.0]];
    let bent = path(&bends, false);
    let (distance, by) = next(&bent, 0.0, 1.0).expect("has a corner");
    near(distance, bent.length() - 90.0 - 16.0, 2.0);
    assert_eq!(by, 1.0);
}
