//! The claims of a campaign file, decided by the rows.

use serde::Serialize;

use super::{
    data::Data,
    words::{interval, number},
};
use crate::campaign::{
    controller::{Controller, Paths},
    file::{Claim, Claimed},
    statistics::{
        Question, compare,
        student::{median, paired_ratio},
    },
};

/// A claim about one controller in one scenario, or in all, decided.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(super) struct Verdict {
    /// The claim.
    pub(super) claim: String,
    /// None for all together.
    pub(super) scenario: Option<String>,
    pub(super) controller: String,
    /// The controller it is compared with.
    pub(super) beside: Option<String>,
    /// The measured value: a ratio, or a mean in the metric's unit.
    pub(super) measured: Option<f64>,
    pub(super) student_95: Option<[f64; 2]>,
    /// The value in words, with the scenarios that break the claim.
    pub(super) words: String,
    /// The limit in words.
    pub(super) limit: String,
    pub(super) holds: bool,
}

impl Data<'_> {
    /// The verdicts on all claims, in the file's order.
    pub(super) fn claims(&self) -> Vec<Verdict> {
        let claims = self.campaign.file.claims.iter();
        claims.flat_map(|claim| self.decided(claim)).collect()
    }

    fn decided(&self, claim: &Claim) -> Vec<Verdict> {
        match claim.is {
            Claimed::RatioAtMost(most) => self.ratios(claim, most, false),
            Claimed::RatioSurelyAtMost(most) => self.ratios(claim, most, true),
            Claimed::MeanAtMost(most) => self.of(&claim.controllers, |name| self.means(claim, name, most)),
            Claimed::WithinBound { factor, spare_m } => self.of(&claim.controllers, |name| {
                self.within_bound(claim, name, factor, spare_m)
            }),
            Claimed::Undominated => self.undominated(claim),
        }
    }

    /// An empty verdict.
    fn open(claim: &Claim, controller: &str) -> Verdict {
        Verdict {
            claim: claim.claim.clone(),
            controller: controller.to_owned(),
            ..Verdict::default()
        }
    }

    fn of(&self, entries: &[String], decide: impl Fn(&str) -> Option<Verdict>) -> Vec<Verdict> {
        let flown = self.of_entries(entries).into_iter();
        flown.filter_map(|controller| decide(&controller.name)).collect()
    }

    /// All controllers of these entries of the file.
    pub(super) fn of_entries(&self, entries: &[String]) -> Vec<&Controller> {
        let all = self.campaign.controllers.iter();
        all.filter(|controller| entries.contains(&controller.entry))
            .collect()
    }

    /// The scenarios of a claim.
    fn scenarios_of(&self, claim: &Claim) -> Vec<&str> {
        let all = self.scenarios.iter().copied();
        all.filter(|name| claim.scenarios.is_empty() || claim.scenarios.iter().any(|asked| asked == name))
            .collect()
    }

    /// Whether the scenario grants paths that the controller does not use: a comparison proves nothing there.
    fn is_less_informed(&self, controller: &Controller, scenario: &str) -> bool {
        let case = self
            .campaign
            .cases
            .iter()
            .find(|case| case.scenario.name == scenario);
        controller.paths == Paths::Unknown && case.is_some_and(|case| case.scenario.knowledge.paths)
    }

    fn first_objective(&self) -> &'static str {
        self.campaign
            .objectives()
            .first()
            .map_or("rms_m", |objective| objective.name())
    }

    fn ratios(&self, claim: &Claim, most: f64, surely: bool) -> Vec<Verdict> {
        let mut verdicts = vec![];
        for scenario in self.scenarios_of(claim) {
            let entries = self.of_entries(&claim.beside);
            let Some(beside) = self.least(&entries, scenario, self.first_objective()) else {
                continue;
            };
            for controller in self.of_entries(&claim.controllers) {
                if self.is_less_informed(controller, scenario) {
                    continue;
                }
                let question = Question {
                    reference: &beside.name,
                    objective: Some(self.first_objective()),
                    ..self.question(&controller.name, &claim.metric, Some(scenario))
                };
                let found = compare(self.runs, question);
                let Some(centre) = found.estimate else { continue };
                let upper = found.student_95.map_or(centre, |[_, upper]| upper);
                verdicts.push(Verdict {
                    scenario: Some(scenario.to_owned()),
                    beside: Some(beside.name.clone()),
                    measured: Some(centre),
                    student_95: found.student_95,
                    words: format!("{} {}", number(centre), interval(found.student_95))
                        .trim()
                        .to_owned(),
                    limit: if surely {
                        format!("upper end ≤ {most}")
                    } else {
                        format!("≤ {most}")
                    },
                    holds: if surely { upper <= most } else { centre <= most },
                    ..Self::open(claim, &controller.name)
                });
            }
        }
        verdicts
    }

    /// The means of a controller in every scenario; larger ones are named.
    fn means(&self, claim: &Claim, controller: &str, most: f64) -> Option<Verdict> {
        let means = self
            .scenarios_of(claim)
            .into_iter()
            .filter_map(|scenario| Some((scenario, self.mean(controller, &claim.metric, scenario)?.centre)));
        let means: Vec<(&str, f64)> = means.collect();
        let worst = means.iter().map(|(_, mean)| *mean).reduce(f64::max)?;
        let above = means.iter().filter(|(_, mean)| most < *mean);
        let named: Vec<String> = above
            .map(|(scenario, mean)| format!("`{scenario}` {}", number(*mean)))
            .collect();
        Some(Verdict {
            measured: Some(worst),
            words: if named.is_empty() {
                format!("{} at most", number(worst))
            } else {
                named.join(", ")
            },
            limit: format!("≤ {most}"),
            holds: named.is_empty(),
            ..Self::open(claim, controller)
        })
    }

    /// The median over scenarios of a controller's value over the allowed one.
    fn within_bound(&self, claim: &Claim, controller: &str, factor: f64, spare_m: f64) -> Option<Verdict> {
        let rows = self.runs.of_controller(controller, &claim.metric);
        let ratios = self.scenarios_of(claim).into_iter().filter_map(|scenario| {
            let here = rows
                .iter()
                .filter(|(group, _)| self.runs.groups[*group].scenario == scenario);
            let both = here.filter_map(|&(_, row)| {
                let bound = self.runs.value("bound_rms_m", row)?;
                Some((self.runs.value(&claim.metric, row)?, factor * bound + spare_m))
            });
            let (values, allowed): (Vec<f64>, Vec<f64>) = both.unzip();
            (!values.is_empty())
                .then(|| paired_ratio(&values, &allowed))
                .flatten()
                .map(|ratio| ratio.centre)
        });
        let middle = median(&ratios.collect::<Vec<f64>>())?;
        Some(Verdict {
            beside: Some("bound".to_owned()),
            measured: Some(middle),
            words: number(middle),
            limit: format!("≤ 1 of {factor} × bound + {spare_m} m"),
            holds: middle <= 1.0,
            ..Self::open(claim, controller)
        })
    }

    /// No other controller dominates any of the controllers in the columns of the Pareto front.
    fn undominated(&self, claim: &Claim) -> Vec<Verdict> {
        let scenarios = self.scenarios_of(claim).into_iter();
        let decided = scenarios.filter_map(|scenario| {
            let points = |entries: &[String]| -> Vec<[f64; 2]> {
                let flown = self.of_entries(entries).into_iter();
                flown
                    .filter_map(|controller| self.point(&controller.name, scenario))
                    .collect()
            };
            let (own, others) = (points(&claim.controllers), points(&claim.beside));
            if own.is_empty() || others.is_empty() {
                return None;
            }
            let dominates_one = |other: &&[f64; 2]| own.iter().any(|point| dominates(**other, *point));
            let beaten = others.iter().filter(dominates_one).count();
            Some(Verdict {
                scenario: Some(scenario.to_owned()),
                beside: Some(claim.beside.join(", ")),
                words: format!("{beaten} of {} dominate one", others.len()),
                limit: "0".to_owned(),
                holds: beaten == 0,
                ..Self::open(claim, &claim.controllers.join(", "))
            })
        });
        decided.collect()
    }
}

/// Whether `a` dominates `b`: no worse in both, and better in one.
pub(super) fn dominates(a: [f64; 2], b: [f64; 2]) -> bool {
    a[0] <= b[0] && a[1] <= b[1] && a != b
}
