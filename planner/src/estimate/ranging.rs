//! Reports of which some are ranges: what they leave possible, and how it falls apart.

use nalgebra::Vector2;

use crate::{
    estimate::particles::{Cloud, Particle, Seen, Sight},
    facts::{angle::direction, evidence::Report},
    tuned::EstimateNumbers,
};

/// Least standard deviation of positions that may fall apart, m: less is no other place.
const APART_MIN: f64 = 5.0;

/// Least probability of another place.
const PROBABILITY_MIN: f64 = 0.01;

/// Inflations that are tried, in claimed standard deviations.
const FACTORS: [f64; 3] = [4.0, 16.0, 64.0];

/// Fewest measurements of which the claims are doubted.
const DOUBTED_FROM: usize = 8;

/// Probability from which a measurement is refused.
const REFUSED: f64 = 0.5;

/// Two places at one of which a vehicle is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Places {
    /// The likelier one (north, east), m.
    pub likelier: Vector2<f64>,
    /// The other one.
    pub other: Vector2<f64>,
    /// Probability of the likelier one.
    pub probability: f64,
}

/// The estimate from reports with ranges.
#[derive(Clone, Debug)]
pub(crate) struct Ranged {
    pub(crate) cloud: Cloud,
    /// The reports that are no outliers.
    pub(crate) used: Vec<(usize, Report)>,
    /// Root of the variance added to each measurement, m; 0 if the claims are consistent.
    pub(crate) inflation: f64,
    /// Depth, m, positive down.
    pub(crate) depth: f64,
}

impl Ranged {
    /// Estimates from `reports`, at least one, in order of time.
    pub(crate) fn new(reports: &[(usize, Report)], tuned: &EstimateNumbers, due: &dyn Fn() -> bool) -> Self {
        let claimed: Vec<_> = reports.iter().map(|(_, report)| sight(report, reports, tuned)).collect();
        let (inflation, cloud) = consistent(&claimed, tuned, due);
        let reported = claimed.last().and_then(|newest| depth_at(newest.time, reports));
        let unreported = || cloud.particles.iter().map(|of| of.depth * of.weight).sum();
        let depth = reported.unwrap_or_else(unreported);
        let refused = |place: usize| place.checked_sub(1).is_some_and(|i| REFUSED < cloud.outliers[i]);
        let used = reports.iter().enumerate().filter(|(place, _)| !refused(*place));
        let used = used.map(|(_, numbered)| *numbered).collect();
        Self { cloud, used, inflation, depth }
    }

    /// The two places, if the positions fall apart: the split across their longest axis that leaves
    /// the least variance within.
    pub(crate) fn places(&self, tuned: &EstimateNumbers) -> Option<Places> {
        let (mean, covariance) = self.cloud.moments();
        let angle = 0.5 * (2.0 * covariance.m12).atan2(covariance.m11 - covariance.m22);
        let axis = direction(angle);
        let along = |of: &Particle| (of.position - mean.xy()).dot(&axis);
        let mut sorted: Vec<_> = self.cloud.particles.iter().collect();
        sorted.sort_by(|a, b| along(a).total_cmp(&along(b)));
        let total: f64 = sorted.iter().map(|of| of.weight * along(of).powi(2)).sum();
        let (mut passed, mut moment, mut between, mut split) = (0.0, 0.0, 0.0, 0);
        for (place, particle) in (1..).zip(&sorted[..sorted.len() - 1]) {
            passed += particle.weight;
            moment += particle.weight * along(particle);
            let apart = moment * moment / (passed * (1.0 - passed)).max(f64::MIN_POSITIVE);
            if between < apart {
                (between, split) = (apart, place);
            }
        }
        if total < APART_MIN * APART_MIN || total - between > tuned.places_within * total {
            return None;
        }
        let part = |of: &[&Particle]| {
            let weight: f64 = of.iter().map(|of| of.weight).sum();
            (of.iter().map(|of| of.position * of.weight).sum::<Vector2<f64>>() / weight, weight)
        };
        let (before, after) = (part(&sorted[..split]), part(&sorted[split..]));
        let (likelier, other) = if after.1 <= before.1 { (before, after) } else { (after, before) };
        (PROBABILITY_MIN <= other.1).then(|| Places {
            likelier: likelier.0,
            other: other.0,
            probability: likelier.1.min(1.0),
        })
    }
}

/// The likeliest inflation of `claimed` accuracies, m, if it is much likelier than none, and what is
/// then possible.
///
/// Refused ranges would not show it: a vehicle that turns all the time explains any of them.
fn consistent(claimed: &[Sight], tuned: &EstimateNumbers, due: &dyn Fn() -> bool) -> (f64, Cloud) {
    let cloud = Cloud::new(claimed, tuned, due);
    let few = EstimateNumbers {
        particles_most: 0.5 * tuned.particles_least,
        particles_least: 0.5 * tuned.particles_least,
        ..*tuned
    };
    let smallest = claimed.iter().map(|sight| sight.sigma).fold(f64::INFINITY, f64::min);
    let wider = |inflation: f64| -> Vec<Sight> {
        let wider = |sight: &Sight| Sight { sigma: sight.sigma.hypot(inflation), ..*sight };
        claimed.iter().map(wider).collect()
    };
    let (mut best, mut largest) = (0.0, cloud.log_likelihood + tuned.inflation_evidence);
    for factor in FACTORS.into_iter().filter(|_| DOUBTED_FROM <= claimed.len()).take_while(|_| !due()) {
        let tried = Cloud::new(&wider(factor * smallest), &few, due);
        if largest < tried.log_likelihood {
            (best, largest) = (factor * smallest, tried.log_likelihood);
        }
    }
    if best > 0.0 { (best, Cloud::new(&wider(best), tuned, due)) } else { (best, cloud) }
}

/// A report as a measurement.
fn sight(report: &Report, all: &[(usize, Report)], tuned: &EstimateNumbers) -> Sight {
    let seen = match report.range_m {
        Some(range) => Seen::Range { from: report.position(), range, depth: depth_at(report.t_s, all) },
        None => Seen::Position(report.position()),
    };
    let velocity = report.ground_track().map(|track| {
        let along = tuned.speed_sigma.powi(2);
        (track.velocity(), along + 0.5 * (tuned.course_sigma * track.speed).powi(2))
    });
    Sight { time: report.t_s, sigma: report.sigma_m, seen, velocity }
}

/// The depth at `time`, s, between the reported ones.
fn depth_at(time: f64, reports: &[(usize, Report)]) -> Option<f64> {
    let depths = || reports.iter().filter_map(|(_, report)| Some((report.t_s, report.depth_m?)));
    let before = depths().rev().find(|(then, _)| *then <= time);
    let after = depths().find(|(then, _)| time <= *then);
    match (before, after) {
        (Some((from, depth)), Some((to, then))) if from < to => {
            Some(depth + (then - depth) * (time - from) / (to - from))
        }
        (Some((_, depth)), _) | (None, Some((_, depth))) => Some(depth),
        (None, None) => None,
    }
}
