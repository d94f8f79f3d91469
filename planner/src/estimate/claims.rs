//! What reports claim of themselves, compared with their fixes: how accurate they are, and how the vehicle moves.
//!
//! ```text
//! ℓ_k = ln(Σ_j μ_j N(ν_k; 0, S_k,j) + ε t₂(ν_k; s² + S_k))        log-likelihood of a fix, of which a share ε are outliers
//! σ_e² = σ² + f²      f = argmax Σ_k ℓ_k(f)                       covariance inflation, common to all fixes
//! g ← clamp(g + ℓ_k(positions) − ℓ_k(with velocities), 0, 2h)     velocities are not used where h ≤ g: Page's test
//! ```
//! Claims are only ever widened: that a vehicle which navigates by dead reckoning is lost shows in no innovation, and is believed.
//!
//! Source: E. S. Page, "Continuous inspection schemes", 1954, doi:10.1093/biomet/41.1-2.100; R. K. Mehra, "Approaches to
//! adaptive filtering", 1972, doi:10.1109/TAC.1972.1100100.

use crate::{
    estimate::{
        interacting::Interacting,
        track::{REJECTED_MAX, Track, mean},
    },
    facts::evidence::Report,
};

/// Least and largest inflation that is tried, m, by factors of two: from a tenth of the most exact acoustic fix to a
/// multipath.
const INFLATION_MIN: f64 = 0.05;

/// As above.
const INFLATION_MAX: f64 = 250.0;

/// By how much larger the log-likelihood is to be with an inflation than without: twice what χ² with one degree of freedom
/// exceeds once in a hundred thousand.
const INFLATION_EVIDENCE: f64 = 10.0;

/// By how much a log-likelihood is below the largest where no wider inflation is tried, if hardly any fix is outside the gate. Where
/// most are, one more or less decides, and nothing is known of wider ones.
const CLEARLY_LESS: f64 = 3.0;

/// The largest inflation of fixes that do not contradict it, as a share of the mean distance between two of them. A vehicle
/// that turns between fixes can be taken for one that rests under inaccurate ones.
const INFLATION_SHARE: f64 = 0.1;

/// Page's threshold h: fixes are e^h times as likely without the velocities.
const VELOCITY_EVIDENCE: f64 = 8.0;

/// The most that the second and the third fix each count in that: two that differ from a first one, which may be the outlier,
/// contradict no velocity.
const VELOCITY_EVIDENCE_AT_FIRST: f64 = 3.9;

/// Reports with what they claim as far as their fixes bear it out.
pub(crate) struct Believed {
    /// The reports, with inflated standard deviations, and without course and speed where fixes contradict those.
    pub(crate) reports: Vec<(usize, Report)>,
    /// The track through them.
    pub(crate) track: Track<Interacting>,
    /// What is added to the standard deviations, as the root of the difference of squares, m; 0 where they are borne out.
    pub(crate) inflation: f64,
    /// Whether fixes contradict the courses and speeds that are reported.
    pub(crate) velocity_contradicted: bool,
}

impl Believed {
    /// Believes the `claimed` reports, at least one, in order of time. After the deadline (`due`) no further inflation is tried.
    pub(crate) fn new(claimed: Vec<(usize, Report)>, due: &dyn Fn() -> bool) -> Self {
        let claimed = without_echoes(claimed);
        let positions: Vec<_> = claimed
            .iter()
            .map(|(number, report)| (*number, report.with_ground_track(None)))
            .collect();
        let (inflation, without) = inflated(&positions, due);
        let reports = with_inflation(&claimed, inflation);
        if claimed.iter().all(|(_, report)| report.ground_track().is_none()) {
            return Self {
                reports,
                track: without,
                inflation,
                velocity_contradicted: false,
            };
        }
        let with = Track::through(&reports, Interacting::start);
        let velocity_contradicted = contradicts(&without, &with);
        Self {
            reports: if velocity_contradicted {
                with_inflation(&positions, inflation)
            } else {
                reports
            },
            track: if velocity_contradicted { without } else { with },
            inflation,
            velocity_contradicted,
        }
    }
}

/// Without the fixes that do not fit where another fix of the same time does: of several returns of one ping one is direct. They are
/// no sign of a false accuracy.
fn without_echoes(mut claimed: Vec<(usize, Report)>) -> Vec<(usize, Report)> {
    if claimed.windows(2).all(|two| two[0].1.t_s < two[1].1.t_s) {
        return claimed;
    }
    let used = Track::through(&claimed, Interacting::start).used;
    claimed.retain(|(number, report)| {
        let fits = used.iter().any(|(used, _)| used == number);
        fits || used.iter().all(|(_, used)| used.t_s != report.t_s)
    });
    claimed
}

/// The inflation with which the positions of `reports` are the most likely, and the track with it.
fn inflated(reports: &[(usize, Report)], due: &dyn Fn() -> bool) -> (f64, Track<Interacting>) {
    let track = |inflation: f64| Track::through(&with_inflation(reports, inflation), Interacting::start);
    let sigmas = reports.iter().map(|(_, report)| report.sigma_m);
    let smallest = sigmas.fold(f64::INFINITY, f64::min);
    let mut best = (0.0, track(0.0));
    let mut largest = best.1.log_likelihood();
    let least = largest + INFLATION_EVIDENCE;
    let most = if best.1.misfits() {
        INFLATION_MAX
    } else {
        INFLATION_MAX.min(INFLATION_SHARE * mean_step(reports))
    };
    let mut inflation = INFLATION_MIN;
    while inflation <= most && !due() {
        // One that hardly changes any of the claims needs no trial.
        if 0.5 * smallest <= inflation {
            let tried = track(inflation);
            let likelihood = tried.log_likelihood();
            if likelihood < largest - CLEARLY_LESS && tried.rejected_share() <= REJECTED_MAX {
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

/// Mean distance between two fixes after one another, m.
fn mean_step(reports: &[(usize, Report)]) -> f64 {
    let pairs = reports.iter().zip(&reports[1..]);
    mean(pairs.map(|((_, from), (_, to))| (to.position() - from.position()).norm()))
}

fn with_inflation(reports: &[(usize, Report)], inflation: f64) -> Vec<(usize, Report)> {
    let inflated = |(number, report): &(usize, Report)| {
        let sigma_m = if inflation > 0.0 {
            report.sigma_m.hypot(inflation)
        } else {
            report.sigma_m
        };
        (*number, Report { sigma_m, ..*report })
    };
    reports.iter().map(inflated).collect()
}

/// Whether the fixes of late are much likelier on the track `without` velocities.
fn contradicts(without: &Track<Interacting>, with: &Track<Interacting>) -> bool {
    let mut sum: f64 = 0.0;
    for (k, (without, with)) in without.innovations.iter().zip(&with.innovations).enumerate() {
        let most = if k < 2 {
            VELOCITY_EVIDENCE_AT_FIRST
        } else {
            f64::INFINITY
        };
        let gain = (without.log_likelihood() - with.log_likelihood()).min(most);
        sum = (sum + gain).clamp(0.0, 2.0 * VELOCITY_EVIDENCE);
    }
    VELOCITY_EVIDENCE <= sum
}
