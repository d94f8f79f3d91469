//! Consistency of the claimed accuracies and velocities of reports with their fixes.
//!
//! ```text
//! ℓ_k = ln(Σ_j μ_j N(ν_k; 0, S_k,j) + ε t₂(ν_k; s² + S_k))     log-likelihood, share ε of outliers
//! σ_e² = σ² + f²      f = argmax Σ_k ℓ_k(f)                      common covariance inflation
//! g ← clamp(g + ℓ_k(positions) − ℓ_k(with velocities), 0, 2h)    velocities unused if h ≤ g
//! ```
//! Claims are only ever widened. A lost vehicle that navigates by dead reckoning shows in no
//! innovation.
//! Sources: E. S. Page, "Continuous inspection schemes" (the test for g), 1954,
//! doi:10.1093/biomet/41.1-2.100; R. K. Mehra, "Approaches to adaptive filtering", 1972,
//! doi:10.1109/TAC.1972.1100100.

use crate::{
    estimate::{
        interacting::Interacting,
        track::{Track, mean},
    },
    facts::evidence::Report,
    tuned::EstimateNumbers,
};

/// Least tried inflation, m, then by factors of two: a tenth of the best acoustic fix.
const INFLATION_MIN: f64 = 0.05;

/// Largest inflation that is tried, m: a multipath.
const INFLATION_MAX: f64 = 250.0;

/// Reports with claims that are consistent with their fixes.
pub(crate) struct ScreenedReports<'a> {
    /// Reports with inflated standard deviations, without courses and speeds that fixes contradict.
    pub(crate) reports: Vec<(usize, Report)>,
    pub(crate) track: Track<Interacting<'a>>,
    /// Root of the variance added to each fix, m; 0 if the claims are consistent.
    pub(crate) inflation: f64,
    /// `true` if fixes contradict the reported courses and speeds.
    pub(crate) velocity_contradicted: bool,
}

impl<'a> ScreenedReports<'a> {
    /// Screens `claimed` reports, at least one. Once `due`, no inflation is tried.
    pub(crate) fn new(
        claimed: Vec<(usize, Report)>,
        tuned: &'a EstimateNumbers,
        due: &dyn Fn() -> bool,
    ) -> Self {
        let claimed = without_echoes(claimed, tuned);
        let positions: Vec<_> =
            claimed.iter().map(|(number, report)| (*number, report.with_ground_track(None))).collect();
        let (inflation, without) = inflated(&positions, tuned, due);
        let reports = with_inflation(&claimed, inflation);
        if claimed.iter().all(|(_, report)| report.ground_track().is_none()) {
            return Self { reports, track: without, inflation, velocity_contradicted: false };
        }
        let with = Interacting::track(&reports, tuned);
        let velocity_contradicted = contradicts(&without, &with, tuned);
        Self {
            reports: if velocity_contradicted { with_inflation(&positions, inflation) } else { reports },
            track: if velocity_contradicted { without } else { with },
            inflation,
            velocity_contradicted,
        }
    }
}

/// Drops misfits among simultaneous fixes: only one of a ping's returns is direct.
fn without_echoes(mut claimed: Vec<(usize, Report)>, tuned: &EstimateNumbers) -> Vec<(usize, Report)> {
    if claimed.windows(2).all(|two| two[0].1.t_s < two[1].1.t_s) {
        return claimed;
    }
    let used = Interacting::track(&claimed, tuned).used;
    claimed.retain(|(number, report)| {
        let fits = used.iter().any(|(used, _)| used == number);
        fits || used.iter().all(|(_, used)| used.t_s != report.t_s)
    });
    claimed
}

/// The most likely inflation of the positions of `reports`, and its track.
fn inflated<'a>(
    reports: &[(usize, Report)],
    tuned: &'a EstimateNumbers,
    due: &dyn Fn() -> bool,
) -> (f64, Track<Interacting<'a>>) {
    let track = |inflation: f64| Interacting::track(&with_inflation(reports, inflation), tuned);
    let sigmas = reports.iter().map(|(_, report)| report.sigma_m);
    let smallest = sigmas.fold(f64::INFINITY, f64::min);
    let mut best = (0.0, track(0.0));
    let mut largest = best.1.log_likelihood();
    let least = largest + tuned.inflation_evidence;
    let most = if best.1.is_inconsistent() {
        INFLATION_MAX
    } else {
        INFLATION_MAX.min(tuned.inflation_share * mean_step(reports))
    };
    let mut inflation = INFLATION_MIN;
    while inflation <= most && !due() {
        // An inflation that hardly changes any claim is skipped.
        if 0.5 * smallest <= inflation {
            let tried = track(inflation);
            let likelihood = tried.log_likelihood();
            if likelihood < largest - tuned.clearly_less && tried.hardly_rejects() {
                break;
            }
            if largest < likelihood {
                largest = likelihood;
                if least <= largest {
                    best = (inflation, tried);
                }
            }
        }
        inflation *= 2.0;
    }
    best
}

fn mean_step(reports: &[(usize, Report)]) -> f64 {
    let pairs = reports.iter().zip(&reports[1..]);
    mean(pairs.map(|((_, from), (_, to))| (to.position() - from.position()).norm()))
}

fn with_inflation(reports: &[(usize, Report)], inflation: f64) -> Vec<(usize, Report)> {
    let inflated = |(number, report): &(usize, Report)| {
        let sigma_m = if inflation > 0.0 { report.sigma_m.hypot(inflation) } else { report.sigma_m };
        (*number, Report { sigma_m, ..*report })
    };
    reports.iter().map(inflated).collect()
}

/// `true` if the positions of `reports` contradict the velocities in the track `with` them.
pub(crate) fn velocities_contradicted(
    reports: &[(usize, Report)],
    with: &Track<Interacting>,
    tuned: &EstimateNumbers,
) -> bool {
    let positions: Vec<_> =
        reports.iter().map(|(number, report)| (*number, report.with_ground_track(None))).collect();
    contradicts(&Interacting::track(&positions, tuned), with, tuned)
}

/// `true` if recent fixes are much likelier on the track `without` velocities.
fn contradicts(without: &Track<Interacting>, with: &Track<Interacting>, tuned: &EstimateNumbers) -> bool {
    let mut sum: f64 = 0.0;
    let both = without.log_likelihoods().zip(with.log_likelihoods());
    for (k, (without, with)) in both.enumerate() {
        let most = if k < 2 { tuned.velocity_evidence_at_first } else { f64::INFINITY };
        let gain = (without - with).min(most);
        sum = (sum + gain).clamp(0.0, 2.0 * tuned.velocity_evidence);
    }
    tuned.velocity_evidence <= sum
}
