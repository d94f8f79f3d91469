//! Claims of 3 mm to 20 km for fixes at all rates, true and false; vehicles on lanes.

#![expect(
    clippy::disallowed_macros,
    reason = "the planner has no output, its tests print what they measured"
)]

use super::{
    interacting::Interacting,
    kalman::Kalman,
    screening::ScreenedReports,
    tests::{Random, TUNED},
};
use crate::tests::prelude::*;

const CLAIMS: [f64; 10] = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 30.0, 300.0, 2.0e4];
const INTERVALS: [f64; 7] = [0.2, 1.0, 3.0, 10.0, 30.0, 60.0, 120.0];
const N_FLIGHTS: u64 = 40;

/// Telemetered velocity of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Says {
    Nothing,
    /// σ 0.05 rad of the course, 0.03 m/s of the speed.
    Truth,
    /// Speed 0, from a vehicle that does not know it.
    Zero,
    /// Speed in knots.
    Knots,
    /// Course off by 90°.
    OtherCourse,
}

#[derive(Clone, Copy, Debug)]
struct Case {
    speed: f64,
    interval: f64,
    claimed: f64,
    actual: f64,
    says: Says,
}

impl Case {
    /// A vehicle whose fixes have the claimed accuracy, or of 1 m.
    fn new(says: Says, speed: f64, interval: f64, claimed: f64, is_true: bool) -> Self {
        Self { speed, interval, claimed, actual: if is_true { claimed } else { 1.0 }, says }
    }

    /// Reports of ten minutes, from 6 to the most in a request.
    #[expect(clippy::cast_possible_truncation, reason = "6 to 64")]
    fn n(&self) -> u32 {
        (600.0 / self.interval).clamp(6.0, 64.0) as u32
    }
}

/// Reports, and the position at the last one.
fn flight(case: Case, n: u32, seed: u64) -> (Vec<(usize, Report)>, Vector2<f64>) {
    let mut random = Random(seed);
    let heading = std::f64::consts::TAU * random.uniform();
    let path = Path::lawn_mower(Vector2::new(3.0, -7.0), heading, 100.0, 20.0, 200);
    let start = 2000.0 * random.uniform();
    let mut truth = Vector2::zeros();
    let reports = (0..n).map(|k| {
        let time = case.interval * f64::from(k);
        let point = path.at(start + case.speed * time);
        truth = point.position;
        let errors = random.normal();
        let (speed, course, speed_sigma) = match case.says {
            Says::Nothing | Says::Truth => (case.speed, point.tangent, 0.03),
            Says::Zero => (0.0, 0.0, 0.0),
            Says::Knots => (case.speed * 1.944, point.tangent, 0.03),
            Says::OtherCourse => (case.speed, point.tangent + 1.571, 0.03),
        };
        let track = (case.says != Says::Nothing).then(|| GroundTrack {
            course: Course::new(course + 0.05 * errors.x),
            speed: (speed + speed_sigma * errors.y).max(0.0),
        });
        let fix = Report::new(time, truth + random.normal() * case.actual, case.claimed);
        (usize::try_from(k).expect("few"), fix.with_ground_track(track))
    });
    (reports.collect(), truth)
}

#[derive(Debug, Default)]
struct Outcome {
    rms: f64,
    nees: f64,
}

fn outcome(case: Case, estimate: impl Fn(&[(usize, Report)]) -> Kalman) -> Outcome {
    let n = N_FLIGHTS as f64;
    let mut sum = Outcome::default();
    for seed in 0..N_FLIGHTS {
        let (reports, truth) = flight(case, case.n(), seed);
        let found = estimate(&reports).at(reports.last().expect("6 or more").1.t_s, TUNED);
        let error = found.position() - truth;
        sum.rms += error.norm_squared() / n;
        let covariance = found.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        sum.nees += error.dot(&(covariance.try_inverse().expect("positive definite") * error)) / (2.0 * n);
    }
    sum.rms = sum.rms.sqrt();
    sum
}

/// The estimate from unscreened reports.
fn before(reports: &[(usize, Report)]) -> Kalman {
    Interacting::track(reports, TUNED).filter.combined()
}

fn after(reports: &[(usize, Report)]) -> Kalman {
    screened(reports.to_vec()).track.filter.combined()
}

fn screened(reports: Vec<(usize, Report)>) -> ScreenedReports<'static> {
    ScreenedReports::new(reports, TUNED, &|| false)
}

/// The estimate with known accuracy and no velocities.
fn knowing(actual: f64) -> impl Fn(&[(usize, Report)]) -> Kalman {
    move |reports| {
        let known = |(number, report): &(usize, Report)| {
            (*number, Report::new(report.t_s, report.position(), actual))
        };
        before(&reports.iter().map(known).collect::<Vec<_>>())
    }
}

#[test]
fn a_speed_that_becomes_0_is_contradicted_by_the_third_fix() {
    for (speed, interval) in [(0.5, 20.0), (0.9, 10.0), (1.5, 10.0), (3.0, 5.0)] {
        let case = Case::new(Says::Truth, speed, interval, 1.5, true);
        let is_late = |seed: &u64| {
            let (mut reports, _) = flight(case, 23, *seed);
            for (_, report) in &mut reports[20..] {
                report.speed_mps = Some(0.0);
            }
            !screened(reports).velocity_contradicted
        };
        let late = (0..200).filter(is_late).count();
        assert!(late <= 10, "{speed} m/s: {late} of 200");
    }
}

#[test]
fn a_fix_of_unusual_accuracy_discards_no_other() {
    let typical = Case::new(Says::Truth, 0.9, 10.0, 1.5, true);
    for odd in [0.001, 0.003, 2.0e4, 1.0e5] {
        let mut rejected = 0;
        for seed in 0..100 {
            let (reports, _) = flight(typical, 30, seed);
            for place in [0, 12, 29] {
                let mut reports = reports.clone();
                reports[place].1.sigma_m = odd;
                rejected += reports.len() - screened(reports).track.used.len();
            }
        }
        // The gate itself refuses one in a thousand of 9000.
        assert!(rejected < 30, "σ {odd} m: {rejected}");
    }
}

#[test]
fn a_vehicle_carried_at_12_metres_per_second_is_at_its_fixes() {
    let fix = |k: u32| {
        let time = 10.0 * f64::from(k);
        (0, Report::new(time, Vector2::new(12.0 * time, 0.0), 1.5))
    };
    let found = after(&(0..20).map(fix).collect::<Vec<_>>());
    near_to(found.position(), Vector2::new(12.0 * 190.0, 0.0), 5.0);
}

#[test]
fn a_second_return_of_a_ping_inflates_no_accuracy() {
    let case = Case::new(Says::Nothing, 1.0, 10.0, 1.5, true);
    for seed in 0..N_FLIGHTS {
        let (reports, truth) = flight(case, 20, seed);
        let last = reports.last().expect("20").1.t_s;
        let echoed = reports.into_iter().flat_map(|(number, report)| {
            let echo = Report::new(report.t_s, report.position() + Vector2::new(40.0, 30.0), 1.5);
            [(2 * number, report), (2 * number + 1, echo)]
        });
        let screened = screened(echoed.collect());
        assert_eq!(screened.inflation, 0.0, "seed {seed}");
        let found = screened.track.filter.combined().at(last, TUNED);
        near_to(found.position(), truth, 6.0);
    }
}

mod slow {
    use super::*;

    #[test]
    fn overconfident_fixes_get_their_true_weight() {
        for (says, speed) in
            [(Says::Nothing, 0.05), (Says::Nothing, 0.2), (Says::Nothing, 0.9), (Says::Truth, 0.9)]
        {
            for (claimed, interval) in CLAIMS.iter().flat_map(|claimed| INTERVALS.map(|t| (*claimed, t))) {
                let case = Case::new(says, speed, interval, claimed, false);
                let (old, new) = (outcome(case, before), outcome(case, after));
                println!("{case:?}: {old:.2?} → {new:.2?}");
                assert!(new.rms < 1.01 * old.rms, "{case:?}: {old:?}, {new:?}");
                // Between fixes 30 s apart the motion exceeds the error: no innovation shows it.
                if claimed < 1.0 && interval <= 10.0 {
                    assert!(new.nees < 2.2, "{case:?}: {new:?}");
                    let known = outcome(Case { claimed: 1.0, ..case }, before);
                    assert!(new.rms < 1.25 * known.rms, "{case:?}: {new:?}, {known:?}");
                }
            }
        }
    }

    #[test]
    fn true_claims_are_kept() {
        let (mut flights, mut doubted) = (0_u32, 0_u32);
        for says in [Says::Nothing, Says::Truth] {
            for (sigma, interval) in CLAIMS.iter().flat_map(|sigma| INTERVALS.map(|t| (*sigma, t))) {
                // Fixes farther apart than a lane show no velocity.
                for speed in [0.05, 0.9, 3.0].into_iter().filter(|speed| speed * interval < 100.0) {
                    let case = Case::new(says, speed, interval, sigma, true);
                    for seed in 0..N_FLIGHTS {
                        let screened = screened(flight(case, case.n(), seed).0);
                        flights += 1;
                        doubted += u32::from(screened.inflation > 0.0 || screened.velocity_contradicted);
                    }
                }
            }
        }
        println!("{doubted} of {flights} doubted");
        assert!(1000 * doubted < flights, "{doubted} of {flights}");
    }

    #[test]
    fn a_contradicted_velocity_is_unused() {
        for says in [Says::Zero, Says::Knots, Says::OtherCourse] {
            for sigma in [0.01, 0.3, 1.0, 3.0] {
                for interval in [0.2, 1.0, 3.0, 10.0, 30.0, 60.0] {
                    let case = Case::new(says, 0.9, interval, sigma, true);
                    let (new, known) = (outcome(case, after), outcome(case, knowing(sigma)));
                    println!("{case:?}: {:.2?} → {new:.2?}", outcome(case, before));
                    // At one fix in 0.2 s, speeds in knots are detected in most flights only.
                    assert!(new.rms < 1.45 * known.rms + 0.05, "{case:?}: {new:?}, {known:?}");
                }
            }
        }
    }
}
