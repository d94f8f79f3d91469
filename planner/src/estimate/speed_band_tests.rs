//! Speeds from 0.05 to 3 m/s: vehicles on lanes, a fix every ten seconds, 30 % lost.

#![expect(
    clippy::disallowed_macros,
    reason = "the planner has no output, its tests print what they measured"
)]

use nalgebra::Vector4;

use super::*;
use crate::{
    estimate::tests::{Random, TUNED},
    facts::{options::Forecast, ranges::REPORT_SIGMA_MIN},
    predict::forecast::{AuvForecast, Intent},
    tests::prelude::*,
};

const SPEEDS: [f64; 6] = [0.05, 0.2, 0.5, 0.9, 1.5, 3.0];

const INTERVAL: f64 = 10.0;

const LOSS: f64 = 0.3;

/// Latency of fixes, s.
const LATENCY: f64 = 2.0;

/// Age of the oldest reports, s.
const HISTORY: f64 = 300.0;

const N_FLIGHTS: u64 = 600;

#[derive(Clone, Copy, Debug)]
struct Band {
    speed: f64,
    /// σ of a fix, m.
    sigma: f64,
    telemetry: Telemetry,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Telemetry {
    None,
    /// σ 0.05 rad of the course, 0.03 m/s of the speed.
    Noisy,
    Exact,
}

/// A vehicle with its reports.
struct Flight {
    path: Path,
    speed: f64,
    reports: Vec<Report>,
    now: f64,
}

impl Flight {
    fn new(band: Band, seed: u64) -> Self {
        let mut random = Random(seed);
        // A vehicle at 3 m/s does not turn within 10 m.
        let (radius, lane) = if band.speed > 2.0 { (20.0, 200.0) } else { (10.0, 100.0) };
        let heading = std::f64::consts::TAU * random.uniform();
        let path = Path::lawn_mower(Vector2::new(3.0, -7.0), heading, lane, 2.0 * radius, 24);
        let now = HISTORY + random.uniform() * (1500.0 / band.speed).min(1500.0);
        let mut reports = Vec::new();
        let mut time = ((now - HISTORY) / INTERVAL).ceil() * INTERVAL;
        while time + LATENCY <= now {
            let (fix, telemetry) = (random.normal() * band.sigma, random.normal());
            if random.uniform() >= LOSS {
                let point = path.at(band.speed * time);
                let errors = if band.telemetry == Telemetry::Noisy { telemetry } else { Vector2::zeros() };
                let has_telemetry = band.telemetry != Telemetry::None;
                let track = has_telemetry.then(|| GroundTrack {
                    course: Course::new(point.tangent + 0.05 * errors.x),
                    speed: (band.speed + 0.03 * errors.y).max(0.0),
                });
                let report = Report::new(time, point.position + fix, band.sigma.max(REPORT_SIGMA_MIN));
                reports.push(Report {
                    turn_rate_radps: has_telemetry.then_some(point.curvature * band.speed),
                    ..report.with_ground_track(track)
                });
            }
            time += INTERVAL;
        }
        Self { path, speed: band.speed, reports, now }
    }

    /// True position and velocity.
    fn truth(&self, time: f64) -> (Vector2<f64>, Vector2<f64>) {
        let point = self.path.at(self.speed * time);
        (point.position, direction(point.tangent) * self.speed)
    }

    fn estimate(&self) -> Estimate {
        let auv = Auv::reported("a", self.reports.clone());
        Estimate::new(&auv, None, self.now, &Vector2::zeros(), None, None, &|| false)
    }

    /// The newest report as a state.
    fn newest(&self) -> Option<AuvState> {
        let report = self.reports.last()?;
        let track = report.ground_track()?;
        Some(AuvState {
            turn_rate_radps: report.turn_rate_radps.unwrap_or(0.0),
            age_s: self.now - report.t_s,
            ..AuvState::new(report.position(), 0.0, track.course, track.speed)
        })
    }

    /// Squared distance of the forecast of `state` now from the vehicle, m².
    fn square_miss(&self, state: &AuvState) -> f64 {
        let forecast = AuvForecast::new(state, Intent::default(), Forecast::Auto, &Vector2::zeros());
        (forecast.at(0.0).position - self.truth(self.now).0).norm_squared()
    }
}

/// Means over all flights of a band.
#[derive(Debug, Default)]
struct Outcome {
    /// Normalised squared error of position and velocity at the newest report; expected: 1.
    normalised: f64,
    /// Share of unused reports.
    rejected: f64,
    /// Root-mean-square position error now, m: of the estimate, and of the newest report alone.
    miss: f64,
    miss_of_newest: f64,
}

fn outcome(speed: f64, sigma: f64, telemetry: Telemetry) -> Outcome {
    let band = Band { speed, sigma, telemetry };
    let mut sum = Outcome::default();
    let mut n = 0.0;
    for seed in 0..N_FLIGHTS {
        let flight = Flight::new(band, seed);
        let found = flight.estimate();
        // Longer silences are forecast by other rules.
        if found.state.age_s > TUNED.turn_rate_age_max {
            continue;
        }
        let (position, velocity) = flight.truth(flight.now - found.state.age_s);
        let (dp, dv) = (found.state.position() - position, found.state.velocity() - velocity);
        let error = Vector4::new(dp.x, dp.y, dv.x, dv.y);
        let covariance = found.state.covariance().expect("made of reports");
        let inverse = covariance.try_inverse().expect("positive definite");
        n += 1.0;
        sum.normalised += error.dot(&(inverse * error)) / 4.0;
        let [rejected, reports] = [found.rejected.len(), flight.reports.len()]
            .map(|count| f64::from(u32::try_from(count).expect("few")));
        sum.rejected += rejected / reports;
        sum.miss += flight.square_miss(&found.state);
        sum.miss_of_newest += flight.newest().map_or(0.0, |state| flight.square_miss(&state));
    }
    let outcome = Outcome {
        normalised: sum.normalised / n,
        rejected: sum.rejected / n,
        miss: (sum.miss / n).sqrt(),
        miss_of_newest: (sum.miss_of_newest / n).sqrt(),
    };
    println!("{band:?}: {outcome:.3?}");
    assert!(outcome.rejected < 0.01, "{band:?}: {outcome:?}");
    outcome
}

#[test]
fn at_every_speed_the_error_matches_the_covariance_and_reports_improve_the_newest() {
    // The expected normalised error is 1. Slow lanes are straighter than the filter's model; its
    // turns are rarer than those of the fast vehicles, where unreported turns dominate the miss.
    for (speed, gain) in SPEEDS.into_iter().zip([0.6, 0.6, 0.8, 0.9, 1.0, 1.02]) {
        for telemetry in [Telemetry::None, Telemetry::Noisy] {
            let outcome = outcome(speed, 1.5, telemetry);
            assert!((0.4..=1.2).contains(&outcome.normalised), "{speed}: {outcome:?}");
            let is_near = outcome.miss < gain * outcome.miss_of_newest;
            assert!(telemetry == Telemetry::None || is_near, "{speed}: {outcome:?}");
        }
    }
}

mod slow {
    use super::*;

    #[test]
    fn exact_fixes_are_not_overweighted_and_no_worse_than_the_newest() {
        for speed in SPEEDS {
            for telemetry in [Telemetry::None, Telemetry::Noisy, Telemetry::Exact] {
                let outcome = outcome(speed, 0.0, telemetry);
                assert!(outcome.normalised < 1.2, "{speed} m/s: {outcome:?}");
                // The filter assumes noisier telemetry: 5 cm a few seconds later.
                let is_near = outcome.miss < 1.05 * outcome.miss_of_newest + 0.05;
                let is_exact = telemetry == Telemetry::Exact && SPEEDS[0] < speed;
                assert!(is_near || !is_exact, "{speed} m/s: {outcome:?}");
            }
        }
    }
}
