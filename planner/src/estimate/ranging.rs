//! Reports of which some are ranges: what they leave possible, and how it falls apart.

use nalgebra::{Matrix2, Vector2};

use crate::{
    estimate::{
        gaussians::Gaussian,
        particles::{Cloud, Normals, Particle, Seen, Sight, count},
    },
    facts::{
        angle::{direction, starboard_of},
        evidence::Report,
        previous_plan::Ranging,
        ranges::{REPORT_SIGMA_MAX, REPORTS_MAX},
    },
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

/// Number of newest reports by which they are known again.
const KNOWN_BY: usize = 8;

/// Most reports added to an estimate before all are filtered again, which finds what was lost.
const ADDED_MAX: f64 = 32.0;

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
    pub(crate) gaussians: Vec<Gaussian>,
    /// What the next request returns; its Gaussians are these.
    pub(crate) memory: Ranging,
    pub(crate) depth: f64,
}

impl Ranged {
    /// Estimates from `reports`, at least one, carrying on what the previous plan knew if it fits.
    pub(crate) fn new(
        reports: &[(usize, Report)],
        before: Option<&Ranging>,
        tuned: &EstimateNumbers,
        due: &dyn Fn() -> bool,
    ) -> Self {
        let carried = before.and_then(|before| carried_on(reports, before, tuned, due));
        let (gaussians, memory) = carried.unwrap_or_else(|| from_all(reports, tuned, due));
        let reported = reports.last().and_then(|(_, newest)| depth_at(newest.t_s, reports));
        let unreported = || gaussians.iter().map(|of| of.depth() * of.weight).sum();
        Self { depth: reported.unwrap_or_else(unreported), gaussians, memory }
    }

    pub(crate) fn places(&self) -> Option<Places> {
        let part = |second: bool| {
            let of = || self.gaussians.iter().filter(move |of| of.is_second == second);
            let weight: f64 = of().map(|of| of.weight).sum();
            (of().map(|of| of.position() * of.weight).sum::<Vector2<f64>>() / weight, weight)
        };
        let (first, second) = (part(false), part(true));
        let (likelier, other) = if second.1 <= first.1 { (first, second) } else { (second, first) };
        (0.0 < other.1).then(|| Places {
            likelier: likelier.0,
            other: other.0,
            probability: likelier.1.min(1.0),
        })
    }
}

fn from_all(
    reports: &[(usize, Report)],
    tuned: &EstimateNumbers,
    due: &dyn Fn() -> bool,
) -> (Vec<Gaussian>, Ranging) {
    let claimed: Vec<_> = reports.iter().map(|(_, report)| sight(report, reports, tuned)).collect();
    let (inflation_m, cloud) = consistent(&claimed, tuned, due);
    let beyond = cloud.outliers.iter().zip(&claimed[1..]).filter(|(outlier, _)| REFUSED < **outlier);
    let refused = beyond.map(|(_, sight)| sight.time).collect();
    summarised(&cloud, reports, Ranging { inflation_m, refused, ..Ranging::default() }, tuned)
}

/// What the previous plan left possible `before`, and newer reports do: none if it does not fit the
/// `reports`, bends where ranges do, or if one of the newer ones may be an outlier.
fn carried_on(
    reports: &[(usize, Report)],
    before: &Ranging,
    tuned: &EstimateNumbers,
    due: &dyn Fn() -> bool,
) -> Option<(Vec<Gaussian>, Ranging)> {
    let (known, new) = reports.split_at(reports.partition_point(|(_, report)| report.t_s <= before.t_s));
    let is_known = known.last()?.1.t_s == before.t_s && before.fingerprint == fingerprint(known);
    let added = before.added + new.len() as f64;
    let is_young = 0.0 <= before.added && added <= ADDED_MAX;
    let is_possible =
        (0.0..=REPORT_SIGMA_MAX).contains(&before.inflation_m) && before.refused.len() <= REPORTS_MAX;
    let gaussians = Gaussian::read(&before.gaussians).filter(|_| is_known && is_young && is_possible)?;
    if new.is_empty() {
        return Some((gaussians, before.clone()));
    }
    let (mean, covariance) = Gaussian::moments(gaussians.iter());
    let variance = covariance.m11 + covariance.m22;
    let is_bent = |(_, report): &(usize, Report)| {
        let bend = 0.5 * variance / (mean.xy() - report.position()).norm();
        report.range_m.is_some() && tuned.bend_max * report.sigma_m.hypot(before.inflation_m) < bend
    };
    if gaussians.iter().any(|of| of.is_second) || new.iter().any(is_bent) {
        return None;
    }
    let claimed: Vec<_> = new.iter().map(|(_, report)| sight(report, reports, tuned)).collect();
    let k = (REPORTS_MAX + count(before.added)) as u64;
    let normals = Normals::new();
    let n = tuned.particles_least;
    let drawn = gaussians
        .iter()
        .zip(1..)
        .flat_map(|(of, i)| of.particles(i * 1000 + k, count(of.weight * n), &normals));
    let cloud = Cloud::of(drawn.collect()).after(
        k,
        before.t_s,
        &wider(&claimed, before.inflation_m),
        &normals,
        tuned,
        due,
    );
    if cloud.outliers.iter().any(|outlier| REFUSED < *outlier) {
        return None;
    }
    Some(summarised(&cloud, reports, Ranging { added, ..before.clone() }, tuned))
}

/// The Gaussians of `cloud`, and the `memory` with them.
fn summarised(
    cloud: &Cloud,
    reports: &[(usize, Report)],
    memory: Ranging,
    tuned: &EstimateNumbers,
) -> (Vec<Gaussian>, Ranging) {
    let gaussians = match split(cloud, tuned).or_else(|| sides(cloud, reports, tuned)) {
        Some((axis, at)) => Gaussian::all(cloud, |of| at < of.position.dot(&axis)),
        None => Gaussian::all(cloud, |_| false),
    };
    let memory = Ranging {
        t_s: reports.last().map_or(0.0, |(_, report)| report.t_s),
        fingerprint: fingerprint(reports),
        gaussians: gaussians.iter().map(Gaussian::row).collect(),
        ..memory
    };
    (gaussians, memory)
}

/// A number by which the newest of `reports` are known again.
fn fingerprint(reports: &[(usize, Report)]) -> f64 {
    let newest = reports.iter().rev().take(KNOWN_BY);
    let numbers = newest.flat_map(|(_, report)| [report.sigma_m, report.range_m.unwrap_or_default()]);
    let mixed =
        |sum: u64, number: f64| (sum.rotate_left(5) ^ number.to_bits()).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (numbers.fold(0, mixed) >> 12) as f64
}

/// The direction along which the positions fall apart, if they do, with least variance within.
fn split(cloud: &Cloud, tuned: &EstimateNumbers) -> Option<(Vector2<f64>, f64)> {
    let (mean, covariance) = cloud.moments();
    let axis = longest(&covariance.fixed_view::<2, 2>(0, 0).into_owned());
    let along = |of: &Particle| (of.position - mean.xy()).dot(&axis);
    let mut sorted: Vec<_> = cloud.particles.iter().map(|of| (along(of), of.weight)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = sorted.iter().map(|(along, weight)| weight * along.powi(2)).sum();
    let (mut passed, mut moment, mut between, mut found) = (0.0, 0.0, 0.0, None);
    for pair in sorted.windows(2) {
        let (along, weight) = pair[0];
        passed += weight;
        moment += weight * along;
        let apart = moment * moment / (passed * (1.0 - passed)).max(f64::MIN_POSITIVE);
        if between < apart {
            (between, found) = (apart, Some((passed, 0.5 * (along + pair[1].0))));
        }
    }
    let (share, at) = found.filter(|_| APART_MIN * APART_MIN <= total)?;
    let is_apart = total - between <= tuned.places_within * total;
    (is_apart && PROBABILITY_MIN <= share.min(1.0 - share)).then(|| (axis, mean.xy().dot(&axis) + at))
}

/// Least spread of the places from which a track with two sides was ranged, m (RMS).
const SIDES_TRACK: f64 = 5.0;

/// The direction across the craft's track, and where the track lies along it, if wide positions are
/// on both sides. Ranges beside a straight track leave mirror images, which may be longer along the
/// track than they are apart: then they do not fall apart, and their mean is at neither.
fn sides(cloud: &Cloud, reports: &[(usize, Report)], tuned: &EstimateNumbers) -> Option<(Vector2<f64>, f64)> {
    let from: Vec<_> =
        reports.iter().filter(|(_, of)| of.range_m.is_some()).map(|(_, of)| of.position()).collect();
    let mean = from.iter().sum::<Vector2<f64>>() / from.len().max(1) as f64;
    let scatter: Matrix2<f64> = from.iter().map(|at| (at - mean) * (at - mean).transpose()).sum();
    let axis = starboard_of(longest(&scatter));
    let (across, n) = (axis.dot(&(scatter * axis)), from.len() as f64);
    // A craft at rest or on a circle has no sides.
    let is_straight = SIDES_TRACK.powi(2) * n < scatter.trace() && 3.0 * across < scatter.trace();
    let at = mean.dot(&axis);
    let beyond = cloud.particles.iter().filter(|of| at < of.position.dot(&axis));
    let share: f64 = beyond.map(|of| of.weight).sum();
    let (_, covariance) = cloud.moments();
    let is_wide = tuned.sides_from.powi(2) <= covariance.m11 + covariance.m22;
    (is_straight && is_wide && PROBABILITY_MIN <= share.min(1.0 - share)).then_some((axis, at))
}

/// The direction of the largest variance.
fn longest(covariance: &Matrix2<f64>) -> Vector2<f64> {
    direction(0.5 * (2.0 * covariance.m12).atan2(covariance.m11 - covariance.m22))
}

/// The likeliest inflation of `claimed`, m, if much likelier than none, and what is then possible.
///
/// Refused ranges would not show it: a vehicle that turns all the time explains any of them.
fn consistent(claimed: &[Sight], tuned: &EstimateNumbers, due: &dyn Fn() -> bool) -> (f64, Cloud) {
    let normals = Normals::new();
    let cloud = Cloud::new(claimed, &normals, tuned, due);
    let few = EstimateNumbers {
        particles_most: 0.5 * tuned.particles_least,
        particles_least: 0.5 * tuned.particles_least,
        ..*tuned
    };
    let smallest = claimed.iter().map(|sight| sight.sigma).fold(f64::INFINITY, f64::min);
    let (mut best, mut largest) = (0.0, cloud.log_likelihood + tuned.inflation_evidence);
    for factor in FACTORS.into_iter().filter(|_| DOUBTED_FROM <= claimed.len()).take_while(|_| !due()) {
        let tried = Cloud::new(&wider(claimed, factor * smallest), &normals, &few, due);
        if largest < tried.log_likelihood {
            (best, largest) = (factor * smallest, tried.log_likelihood);
        }
    }
    if best > 0.0 { (best, Cloud::new(&wider(claimed, best), &normals, tuned, due)) } else { (best, cloud) }
}

/// `claimed` accuracies with an `inflation`, m.
fn wider(claimed: &[Sight], inflation: f64) -> Vec<Sight> {
    let wider = |sight: &Sight| Sight { sigma: sight.sigma.hypot(inflation), ..*sight };
    claimed.iter().map(wider).collect()
}

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
