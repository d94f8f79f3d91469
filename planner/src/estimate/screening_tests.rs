//! Claims of 3 mm to 20 km for fixes at all rates, true and false; vehicles on lanes.

#![expect(
    clippy::disallowed_macros,
    reason = "the planner has no output, its tests print what they measured"
)]

use nalgebra::Vector2;

use super::{
    interacting::Interacting,
    kalman::Kalman,
    screening::ScreenedReports,
    tests::{Random, TUNED},
};
use crate::facts::{
    angle::Course,
    evidence::{GroundTrack, Report},
    path::curve::Path,
};

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
    /// Reports of ten minutes, from 6 to the most in a request.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "6 to 64")]
    fn n(&self) -> u32 {
        (600.0 / self.interval).clamp(6.0, 64.0) as u32
    }
}

/// Reports, and the position at the last one.
fn flight(case: Case, n: u32, seed: u64) -> (Vec<(usize, Report)>, Vector2<f64>) {
    let mut random = Random(seed);
    let path = Path::lawn_mower(
        Vector2::new(3.0, -7.0),
        std::f64::consts::TAU * random.uniform(),
        100.0,
        20.0,
        200,
    );
    let start = 2000.0 * random.uniform();
    let mut truth = Vector2::zeros();
    let reports = (0..n).map(|k| {
        let time = case.interval * f64::from(k);
        let point = path.at(start + case.speed * time);
        truth = point.position;
        let errors = random.normal();
        let (speed, course) = match case.says {
            Says::Nothing | Says::Truth => (case.speed, point.tangent),
            Says::Zero => (0.0, 0.0),
            Says::Knots => (case.speed * 1.944, point.tangent),
            Says::OtherCourse => (case.speed, point.tangent + 1.571),
        };
        let track = (case.says != Says::Nothing).then(|| GroundTrack {
            course: Course::new(course + 0.05 * errors.x),
            speed: if case.says == Says::Zero {
                0.0
            } else {
                (speed + 0.03 * errors.y).max(0.0)
            },
        });
        let fix = random.normal() * case.actual;
        let number = usize::try_from(k).expect("few");
        (
            number,
            Report::new(time, truth + fix, case.claimed).with_ground_track(track),
        )
    });
    (reports.collect(), truth)
}

#[derive(Debug, Default)]
struct Outcome {
    rms: f64,
    nees: f64,
}

fn outcome(case: Case, estimate: impl Fn(&[(usize, Report)]) -> Kalman) -> Outcome {
    let (mut squares, mut normalised) = (0.0, 0.0);
    for seed in 0..N_FLIGHTS {
        let (reports, truth) = flight(case, case.n(), seed);
        let time = reports.last().expect("6 or more").1.t_s;
        let found = estimate(&reports).at(time, TUNED);
        let error = found.position() - truth;
        squares += error.norm_squared();
        let covariance = found.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        normalised += error.dot(&(covariance.try_inverse().expect("positive definite") * error)) / 2.0;
    }
    #[expect(clippy::cast_precision_loss, reason = "few")]
    let n = N_FLIGHTS as f64;
    Outcome {
        rms: (squares / n).sqrt(),
        nees: normalised / n,
    }
}

/// The estimate from unscreened reports.
fn before(reports: &[(usize, Report)]) -> Kalman {
    Interacting::track(reports, TUNED).filter.combined()
}

fn after(reports: &[(usize, Report)]) -> Kalman {
    ScreenedReports::new(reports.to_vec(), TUNED, &|| false)
        .track
        .filter
        .combined()
}

/// The estimate with known accuracy and no velocities.
fn knowing(actual: f64) -> impl Fn(&[(usize, Report)]) -> Kalman {
    move |reports| {
        let known = |(number, report): &(usize, Report)| {
            let report = Report {
                sigma_m: actual,
                ..*report
            };
            (*number, report.with_ground_track(None))
        };
        before(&reports.iter().map(known).collect::<Vec<_>>())
    }
}

const TYPICAL: Case = Case {
    speed: 0.9,
    interval: 10.0,
    claimed: 1.5,
    actual: 1.5,
    says: Says::Truth,
};

#[test]
fn a_speed_that_becomes_0_is_contradicted_by_the_third_fix() {
    for (speed, interval) in [(0.5, 20.0), (0.9, 10.0), (1.5, 10.0), (3.0, 5.0)] {
        let (mut late, mut flights) = (0_u32, 0_u32);
        for seed in 0..200 {
            let case = Case {
                speed,
                interval,
                ..TYPICAL
            };
            let (mut reports, _) = flight(case, 23, seed);
            for (_, report) in &mut reports[20..] {
                report.speed_mps = Some(0.0);
            }
            flights += 1;
            late += u32::from(!ScreenedReports::new(reports, TUNED, &|| false).velocity_contradicted);
        }
        println!("{speed} m/s, {interval} s: {late} of {flights} not within three fixes");
        assert!(late <= flights / 20, "{speed} m/s: {late} of {flights}");
    }
}

#[test]
fn a_fix_of_unusual_accuracy_discards_no_other() {
    for odd in [0.001, 0.003, 2.0e4, 1.0e5] {
        let mut rejected = 0;
        for seed in 0..100 {
            let (mut reports, _) = flight(TYPICAL, 30, seed);
            for place in [0, 12, 29] {
                let claimed = std::mem::replace(&mut reports[place].1.sigma_m, odd);
                let screened = ScreenedReports::new(reports.clone(), TUNED, &|| false);
                rejected += reports.len() - screened.track.used.len();
                reports[place].1.sigma_m = claimed;
            }
        }
        println!("σ {odd} m: {rejected} of 9000 fixes rejected");
        // The gate itself refuses one in a thousand.
        assert!(rejected < 30, "{rejected}");
    }
}

#[test]
fn a_vehicle_carried_at_12_metres_per_second_is_at_its_fixes() {
    let reports: Vec<_> = (0..20_u32)
        .map(|k| {
            let time = 10.0 * f64::from(k);
            (0, Report::new(time, Vector2::new(12.0 * time, 0.0), 1.5))
        })
        .collect();
    let found = after(&reports);
    assert!(
        (found.position() - Vector2::new(12.0 * 190.0, 0.0)).norm() < 5.0,
        "{found:?}"
    );
}

#[test]
fn a_second_return_of_a_ping_inflates_no_accuracy() {
    let case = Case {
        speed: 1.0,
        interval: 10.0,
        claimed: 1.5,
        actual: 1.5,
        says: Says::Nothing,
    };
    for seed in 0..N_FLIGHTS {
        let (reports, truth) = flight(case, 20, seed);
        let last = reports.last().expect("20").1.t_s;
        let echoed = reports.into_iter().flat_map(|(number, report)| {
            let echo = Report::new(report.t_s, report.position() + Vector2::new(40.0, 30.0), 1.5);
            [(2 * number, report), (2 * number + 1, echo)]
        });
        let screened = ScreenedReports::new(echoed.collect(), TUNED, &|| false);
        assert_eq!(screened.inflation, 0.0, "seed {seed}");
        let error = (screened.track.filter.combined().at(last, TUNED).position() - truth).norm();
        assert!(error < 6.0, "seed {seed}: {error} m");
    }
}

mod slow {
    use super::*;

    #[test]
    fn overconfident_fixes_get_their_true_weight() {
        for (says, speed) in [
            (Says::Nothing, 0.05),
            (Says::Nothing, 0.2),
            (Says::Nothing, 0.9),
            (Says::Truth, 0.9),
        ] {
            for claimed in CLAIMS {
                println!("claims {claimed} m for 1 m, {speed} m/s, says {says:?}:");
                for interval in INTERVALS {
                    let case = Case {
                        interval,
                        claimed,
                        actual: 1.0,
                        says,
                        speed,
                    };
                    let (old, new) = (outcome(case, before), outcome(case, after));
                    println!(
                        "  {interval} s {:.2} → {:.2} m, NEES {:.1} → {:.1}",
                        old.rms, new.rms, old.nees, new.nees
                    );
                    assert!(new.rms < 1.01 * old.rms, "{case:?}: {old:?}, {new:?}");
                    // Between fixes 30 s apart the motion exceeds the error: no innovation shows
                    // it.
                    if claimed < 1.0 && interval <= 10.0 {
                        assert!(new.nees < 2.2, "{case:?}: {new:?}");
                        let known = outcome(Case { claimed: 1.0, ..case }, before);
                        assert!(new.rms < 1.25 * known.rms, "{case:?}: {new:?}, {known:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn true_claims_are_kept() {
        let (mut flights, mut doubted) = (0_u32, 0_u32);
        for says in [Says::Nothing, Says::Truth] {
            for sigma in CLAIMS {
                for interval in INTERVALS {
                    for speed in [0.05, 0.9, 3.0] {
                        let case = Case {
                            speed,
                            interval,
                            claimed: sigma,
                            actual: sigma,
                            says,
                        };
                        // Fixes farther apart than a lane show no velocity.
                        let seeds = if speed * interval < 100.0 { N_FLIGHTS } else { 0 };
                        for seed in 0..seeds {
                            let screened =
                                ScreenedReports::new(flight(case, case.n(), seed).0, TUNED, &|| false);
                            flights += 1;
                            if screened.inflation > 0.0 || screened.velocity_contradicted {
                                doubted += 1;
                                println!(
                                    "{case:?}: {} {}",
                                    screened.inflation, screened.velocity_contradicted
                                );
                            }
                        }
                    }
                }
            }
        }
        println!("{doubted} of {flights} doubted");
        assert!(
            f64::from(doubted) < 0.001 * f64::from(flights),
            "{doubted} of {flights}"
        );
    }

    #[test]
    fn a_contradicted_velocity_is_unused() {
        for says in [Says::Zero, Says::Knots, Says::OtherCourse] {
            for sigma in [0.01, 0.3, 1.0, 3.0] {
                println!("σ {sigma} m, says {says:?}:");
                for interval in [0.2, 1.0, 3.0, 10.0, 30.0, 60.0] {
                    let case = Case {
                        interval,
                        claimed: sigma,
                        actual: sigma,
                        says,
                        ..TYPICAL
                    };
                    let (old, new) = (outcome(case, before), outcome(case, after));
                    println!("  {interval} s {:.2} → {:.2} m", old.rms, new.rms);
                    let known = outcome(case, knowing(sigma));
                    // At one fix in 0.2 s, speeds in knots are detected in most flights only.
                    assert!(new.rms < 1.45 * known.rms + 0.05, "{case:?}: {new:?}, {known:?}");
                }
            }
        }
    }
}
