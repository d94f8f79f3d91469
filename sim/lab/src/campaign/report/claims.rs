//! The claims of a campaign file, decided by its rows.

use serde::Serialize;

use super::{
    gather::Gather,
    words::{interval, number},
};
use crate::campaign::{
    contender::{Contender, Paths},
    file::{Claim, Claimed},
    statistics::{
        Question, compare,
        student::{mean, median, paired_ratio},
    },
};

/// A claim about one controller in one scenario, or in all, decided.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Verdict {
    /// What is claimed.
    pub(super) claim: String,
    /// None for all together.
    pub(super) scenario: Option<String>,
    pub(super) controller: String,
    /// The controller that it is set beside.
    pub(super) beside: Option<String>,
    /// What was measured; 1, but for means, which are in the metric's unit.
    pub(super) measured: Option<f64>,
    pub(super) student_95: Option<[f64; 2]>,
    /// The same for people, with the scenarios that break it.
    pub(super) words: String,
    /// What is claimed of it, for people.
    pub(super) limit: String,
    pub(super) holds: bool,
}

impl Gather<'_> {
    /// Every claim that the rows decide, in the file's order.
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

    fn of(&self, entries: &[String], decide: impl Fn(&str) -> Option<Verdict>) -> Vec<Verdict> {
        let flown = self.of_entries(entries).into_iter();
        flown.filter_map(|contender| decide(&contender.name)).collect()
    }

    /// All controllers of these entries of the file.
    pub(super) fn of_entries(&self, entries: &[String]) -> Vec<&Contender> {
        let all = self.campaign.controllers.iter();
        all.filter(|contender| entries.contains(&contender.entry))
            .collect()
    }

    /// Scenarios that a claim is about.
    fn scenarios_of(&self, claim: &Claim) -> Vec<&str> {
        let all = self.scenarios.iter().copied();
        all.filter(|name| claim.scenarios.is_empty() || claim.scenarios.iter().any(|asked| asked == name))
            .collect()
    }

    /// Whether the scenario grants paths that a controller leaves unused: beside others it proves nothing there.
    fn is_less_informed(&self, contender: &Contender, scenario: &str) -> bool {
        let arena = self
            .campaign
            .arenas
            .iter()
            .find(|arena| arena.scenario.name == scenario);
        contender.paths == Paths::Uninformed && arena.is_some_and(|arena| arena.scenario.knowledge.paths)
    }

    /// Of these the one with the least mean of the first objective in a scenario; of equals the first.
    fn nearest(&self, entries: &[String], scenario: &str) -> Option<&str> {
        let objective = self.first_objective();
        let flown = self.of_entries(entries).into_iter().filter_map(|contender| {
            let values = self.flights.observations(&contender.name, objective, scenario);
            (!values.is_empty()).then(|| (contender.name.as_str(), mean(&values).centre))
        });
        flown.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(name, _)| name)
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
            let Some(beside) = self.nearest(&claim.beside, scenario) else {
                continue;
            };
            for contender in self.of_entries(&claim.controllers) {
                if self.is_less_informed(contender, scenario) {
                    continue;
                }
                let question = Question {
                    controller: &contender.name,
                    reference: beside,
                    metric: &claim.metric,
                    scenario: Some(scenario),
                    objective: Some(self.first_objective()),
                };
                let found = compare(self.flights, question, self.campaign.file.seed);
                let Some(centre) = found.estimate else { continue };
                let upper = found.student_95.map_or(centre, |[_, upper]| upper);
                verdicts.push(Verdict {
                    claim: claim.claim.clone(),
                    scenario: Some(scenario.to_owned()),
                    controller: contender.name.clone(),
                    beside: Some(beside.to_owned()),
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
                });
            }
        }
        verdicts
    }

    /// Of a controller in every scenario: those where the mean is larger are named with it.
    fn means(&self, claim: &Claim, controller: &str, most: f64) -> Option<Verdict> {
        let means = self.scenarios_of(claim).into_iter().filter_map(|scenario| {
            let values = self.flights.observations(controller, &claim.metric, scenario);
            (!values.is_empty()).then(|| (scenario, mean(&values).centre))
        });
        let means: Vec<(&str, f64)> = means.collect();
        let worst = means.iter().map(|(_, mean)| *mean).reduce(f64::max)?;
        let above = means.iter().filter(|(_, mean)| most < *mean);
        let named: Vec<String> = above
            .map(|(scenario, mean)| format!("`{scenario}` {}", number(*mean)))
            .collect();
        Some(Verdict {
            claim: claim.claim.clone(),
            scenario: None,
            controller: controller.to_owned(),
            beside: None,
            measured: Some(worst),
            student_95: None,
            words: if named.is_empty() {
                format!("{} at most", number(worst))
            } else {
                named.join(", ")
            },
            limit: format!("≤ {most}"),
            holds: named.is_empty(),
        })
    }

    /// The middle over scenarios of a controller's distance over what is allowed beside the bound.
    fn within_bound(&self, claim: &Claim, controller: &str, factor: f64, spare_m: f64) -> Option<Verdict> {
        let rows = self.flights.of_controller(controller, &claim.metric);
        let ratios = self.scenarios_of(claim).into_iter().filter_map(|scenario| {
            let here = rows
                .iter()
                .filter(|(group, _)| self.flights.groups[*group].scenario == scenario);
            let both = here.filter_map(|&(_, row)| {
                let bound = self.flights.value("bound_rms_m", row)?;
                Some((self.flights.value(&claim.metric, row)?, factor * bound + spare_m))
            });
            let (values, allowed): (Vec<f64>, Vec<f64>) = both.unzip();
            (!values.is_empty())
                .then(|| paired_ratio(&values, &allowed))
                .flatten()
                .map(|ratio| ratio.centre)
        });
        let middle = median(&ratios.collect::<Vec<f64>>())?;
        Some(Verdict {
            claim: claim.claim.clone(),
            scenario: None,
            controller: controller.to_owned(),
            beside: Some("bound".to_owned()),
            measured: Some(middle),
            student_95: None,
            words: number(middle),
            limit: format!("≤ 1 of {factor} × bound + {spare_m} m"),
            holds: middle <= 1.0,
        })
    }

    /// That none of the others beats any of the controllers in both columns of the front.
    fn undominated(&self, claim: &Claim) -> Vec<Verdict> {
        let scenarios = self.scenarios_of(claim).into_iter();
        let decided = scenarios.filter_map(|scenario| {
            let points = |entries: &[String]| -> Vec<[f64; 2]> {
                let flown = self.of_entries(entries).into_iter();
                flown
                    .filter_map(|contender| self.point(&contender.name, scenario))
                    .collect()
            };
            let (own, others) = (points(&claim.controllers), points(&claim.beside));
            if own.is_empty() || others.is_empty() {
                return None;
            }
            let beats_one = |other: &&[f64; 2]| own.iter().any(|point| beats(**other, *point));
            let beaten = others.iter().filter(beats_one).count();
            Some(Verdict {
                claim: claim.claim.clone(),
                scenario: Some(scenario.to_owned()),
                controller: claim.controllers.join(", "),
                beside: Some(claim.beside.join(", ")),
                measured: None,
                student_95: None,
                words: format!("{beaten} of {} beat one", others.len()),
                limit: "0".to_owned(),
                holds: beaten == 0,
            })
        });
        decided.collect()
    }
}

/// Whether `a` is in neither worse than `b`, and better in one.
pub(super) fn beats(a: [f64; 2], b: [f64; 2]) -> bool {
    a[0] <= b[0] && a[1] <= b[1] && a != b
}
