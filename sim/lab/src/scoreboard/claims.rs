//! What the planner is claimed to do beside the laws, and whether it does.

use crate::bench::{
    AUTO, Board, CONSTANT_VELOCITY, Contender, Entry, Family, Match, Metric, PATH, Paths, Score,
    statistics::{Interval, mean, median, paired_ratio},
};
use planner::los::LosLaw;

use super::{Results, number, pareto, ratio, verdict::Verdict};

/// Scenarios in which foresight is everything.
const FORESIGHT: [&str; 4] = ["switching", "switching-opposed", "anti-phase", "target-stops"];

/// Scenarios in which the goal moves steadily, so that effort can be compared.
const STEADY: [&str; 7] = [
    "calm",
    "paper-tracking",
    "paper-midpoint",
    "cross-current",
    "cross-current-unknown",
    "cross-current-sheared",
    "slocum",
];

/// Every claim that the boards' scenarios and controllers can decide.
#[must_use]
pub(super) fn verdicts(results: &Results) -> Vec<Verdict> {
    let board = &results.board;
    let mut verdicts = vec![];
    for found in &board.matches {
        for name in [CONSTANT_VELOCITY, AUTO] {
            verdicts.extend(nearness(found, name));
            verdicts.extend(without_the_current(found, name));
        }
        verdicts.extend(with_paths(found));
        for name in [CONSTANT_VELOCITY, AUTO] {
            verdicts.extend(effort(found, name));
        }
    }
    for name in [CONSTANT_VELOCITY, AUTO, PATH] {
        verdicts.extend(calm_steering(board, name));
        verdicts.extend(limits_kept(board, name));
    }
    verdicts.extend(regrets(board));
    let other_plant = results.other_plant.iter().flat_map(|board| &board.matches);
    verdicts.extend(other_plant.filter_map(on_another_plant));
    verdicts.extend(results.pareto.iter().flat_map(pareto::undominated));
    verdicts
}

/// The best-tuned law with the information that the scenario grants.
pub(super) fn best_tuned_law(found: &Match) -> Option<&Entry> {
    let may = |contender: &Contender| contender.is_baseline() && contender.paths == Paths::AsScenario;
    found.least(Metric::Rms, may)
}

fn best_informed_law(found: &Match) -> Option<&Entry> {
    let informed = |contender: &Contender| contender.is_baseline() && contender.paths == Paths::Informed;
    found.least(Metric::Rms, informed)
}

/// The ratio of a metric to a law's at its gains for nearness.
fn beside(planner: &Entry, law: &Entry, metric: Metric) -> Option<Interval> {
    let values = |entry: &Entry| entry.values_at(metric, Family::Nearness);
    paired_ratio(&values(planner), &values(law))
}

#[derive(Clone, Copy)]
enum Bound {
    /// The estimate is to be no more.
    Centre(f64),
    /// The upper end of its interval is to be no more.
    Upper(f64),
}

impl Bound {
    fn verdict(
        self,
        claim: &'static str,
        found: &Match,
        planner: &Entry,
        law: &Entry,
        measured: &Interval,
    ) -> Verdict {
        let (limit, holds) = match self {
            Self::Centre(most) => (format!("≤ {most}"), measured.centre <= most),
            Self::Upper(most) => (format!("upper end ≤ {most}"), measured.upper() <= most),
        };
        Verdict {
            claim,
            scenario: found.scenario.clone(),
            controller: planner.contender.name.clone(),
            beside: law.contender.name.clone(),
            measured: ratio(measured),
            limit,
            holds,
        }
    }
}

fn nearness(found: &Match, name: &str) -> Vec<Verdict> {
    let (Some(planner), Some(law)) = (found.entry(name), best_tuned_law(found)) else {
        return vec![];
    };
    if planner.contender.is_less_informed(found) {
        return vec![];
    }
    let rms = "RMS distance beside the best-tuned law";
    let claims = match found.scenario.as_str() {
        foresight if FORESIGHT.contains(&foresight) => vec![(rms, Metric::Rms, Bound::Centre(0.5))],
        "about-face" => vec![
            (rms, Metric::Rms, Bound::Centre(0.6)),
            (
                "time to within 3 m beside the best-tuned law",
                Metric::TimeToNear,
                Bound::Centre(0.3),
            ),
        ],
        "cross-current" => vec![(rms, Metric::Rms, Bound::Centre(1.0))],
        // The hull is another and the policy the same.
        "otter" => vec![(rms, Metric::Rms, Bound::Centre(0.6))],
        _ => vec![(rms, Metric::Rms, Bound::Upper(1.02))],
    };
    let decided = claims.into_iter().filter_map(|(claim, metric, bound)| {
        let measured = beside(planner, law, metric)?;
        Some(bound.verdict(claim, found, planner, law, &measured))
    });
    decided.collect()
}

/// Beside the saturated law alone, nearest or not.
fn without_the_current(found: &Match, name: &str) -> Option<Verdict> {
    if found.scenario != "cross-current-unknown" {
        return None;
    }
    let (planner, law) = (found.entry(name)?, found.entry(LosLaw::SaturatedLos.name())?);
    let measured = beside(planner, law, Metric::Rms)?;
    let claim = "RMS distance beside the saturated law, with the current unknown";
    Some(Bound::Centre(0.5).verdict(claim, found, planner, law, &measured))
}

fn on_another_plant(found: &Match) -> Option<Verdict> {
    let (planner, law) = (found.entry(AUTO)?, best_tuned_law(found)?);
    let bound = match found.scenario.as_str() {
        "switching" => Bound::Centre(0.6),
        _ => Bound::Upper(1.05),
    };
    let measured = beside(planner, law, Metric::Rms)?;
    let claim = "RMS distance on an Otter beside the law that is nearest there";
    Some(bound.verdict(claim, found, planner, law, &measured))
}

fn with_paths(found: &Match) -> Vec<Verdict> {
    let Some(planner) = found.entry(PATH) else {
        return vec![];
    };
    let mut verdicts = vec![];
    let mut claim = |claim, law: Option<&Entry>, most| {
        let Some(law) = law else { return };
        let Some(measured) = beside(planner, law, Metric::Rms) else {
            return;
        };
        verdicts.push(Bound::Centre(most).verdict(claim, found, planner, law, &measured));
    };
    if ["silence", "noisy-fixes"].contains(&found.scenario.as_str()) {
        claim(
            "RMS distance, paths known, beside the best-tuned law without them",
            best_tuned_law(found),
            0.25,
        );
    }
    if found.scenario == "noisy-fixes" {
        claim(
            "RMS distance, paths known, beside the best-tuned law that knows them too",
            best_informed_law(found),
            1.0,
        );
    }
    verdicts
}

fn effort(found: &Match, name: &str) -> Vec<Verdict> {
    let (Some(planner), Some(law)) = (found.entry(name), best_tuned_law(found)) else {
        return vec![];
    };
    if !STEADY.contains(&found.scenario.as_str()) {
        return vec![];
    }
    let claims = [
        ("energy beside the best-tuned law", Metric::Energy),
        ("heading travel beside the best-tuned law", Metric::HeadingTravel),
    ];
    let decided = claims.into_iter().filter_map(|(claim, metric)| {
        let measured = beside(planner, law, metric)?;
        Some(Bound::Centre(1.1).verdict(claim, found, planner, law, &measured))
    });
    decided.collect()
}

/// Of a controller in every scenario: those where a `value` is above `most` are named with that value.
fn everywhere(
    board: &Board,
    name: &str,
    claim: &'static str,
    (most, unit): (f64, &str),
    value: impl Fn(&Entry) -> f64,
) -> Option<Verdict> {
    let values: Vec<(&str, f64)> = board
        .matches
        .iter()
        .filter_map(|found| Some((found.scenario.as_str(), value(found.entry(name)?))))
        .collect();
    let worst = values.iter().map(|(_, value)| *value).reduce(f64::max)?;
    let above = values.iter().filter(|(_, value)| most < *value);
    let named: Vec<String> = above
        .map(|(scenario, value)| format!("{scenario} {}{unit}", number(*value)))
        .collect();
    Some(Verdict {
        claim,
        scenario: "all".to_owned(),
        controller: name.to_owned(),
        beside: String::new(),
        measured: if named.is_empty() {
            format!("{}{unit} at most", number(worst))
        } else {
            named.join(", ")
        },
        limit: format!("≤ {most}{unit}"),
        holds: named.is_empty(),
    })
}

fn calm_steering(board: &Board, name: &str) -> Option<Verdict> {
    let claim = "heading references that step by more than 10°/s";
    let share = |entry: &Entry| entry.mean(Metric::SteepShare);
    everywhere(board, name, claim, (1.0, " %"), share)
}

fn limits_kept(board: &Board, name: &str) -> Vec<Verdict> {
    type Counted = fn(&Score) -> usize;
    let claims: [(&str, Counted); 3] = [
        (
            "speed references outside their limits, episodes per run",
            |score| score.reference.count,
        ),
        (
            "speed beyond its limit by a hundredth, episodes per run",
            |score| score.metrics.violations.speed.count,
        ),
        ("inside a keep-out disc, episodes per run", |score| {
            score.metrics.violations.keep_out.count
        }),
    ];
    let decided = claims.into_iter().filter_map(|(claim, counted)| {
        #[expect(clippy::cast_precision_loss, reason = "thousands of episodes, not 2⁵³")]
        let episodes = |entry: &Entry| {
            let scores = &entry.of(Family::Nearness).scores;
            mean(
                &scores
                    .iter()
                    .map(|score| counted(score) as f64)
                    .collect::<Vec<_>>(),
            )
            .centre
        };
        everywhere(board, name, claim, (0.0, ""), episodes)
    });
    decided.collect()
}

/// The middle over scenarios of RMS over what is claimed of it.
fn regrets(board: &Board) -> Vec<Verdict> {
    /// Beside the bound, m.
    const SPARE: f64 = 0.1;
    let claims = [(PATH, 1.25), (CONSTANT_VELOCITY, 2.0)];
    let decided = claims.into_iter().filter_map(|(name, factor)| {
        let ratios: Vec<f64> = board
            .matches
            .iter()
            .filter_map(|found| {
                let (planner, bounds) = (found.entry(name)?, found.bound_rms_m.as_ref()?);
                let allowed: Vec<f64> = bounds.iter().map(|bound| factor * bound + SPARE).collect();
                Some(paired_ratio(&planner.values(Metric::Rms), &allowed)?.centre)
            })
            .collect();
        let middle = median(&ratios)?;
        Some(Verdict {
            claim: "RMS distance over what the clairvoyant's bound allows, median over scenarios",
            scenario: "all".to_owned(),
            controller: name.to_owned(),
            beside: "clairvoyant".to_owned(),
            measured: number(middle),
            limit: format!("≤ 1 of {factor} × bound + {SPARE} m"),
            holds: middle <= 1.0,
        })
    });
    decided.collect()
}
