//! A campaign and its rows, by condition.

use crate::campaign::{
    controller::Controller,
    design::Campaign,
    statistics::{
        Question, RunTable,
        student::{Interval, mean},
    },
};

/// A campaign and its rows.
pub(super) struct Data<'a> {
    pub(super) campaign: &'a Campaign,
    pub(super) runs: &'a RunTable,
    /// Columns that are compared.
    pub(super) metrics: &'a [String],
    /// Names of the scenarios, each once.
    pub(super) scenarios: Vec<&'a str>,
    /// The controller that the others are compared with.
    pub(super) reference: &'a str,
}

impl Data<'_> {
    /// The mean of a metric in one scenario; none without values.
    pub(super) fn mean(&self, controller: &str, metric: &str, scenario: &str) -> Option<Interval> {
        let values = self.runs.observations(controller, metric, scenario);
        (!values.is_empty()).then(|| mean(&values))
    }

    /// The controller of `all` with the least mean of a metric in one scenario; of equals the first.
    pub(super) fn least<'c>(
        &self,
        all: &[&'c Controller],
        scenario: &str,
        metric: &str,
    ) -> Option<&'c Controller> {
        let flown = all.iter().filter_map(|controller| {
            let mean = self.mean(&controller.name, metric, scenario)?;
            Some((*controller, mean.centre))
        });
        let least = flown.min_by(|a, b| a.1.total_cmp(&b.1));
        least.map(|(controller, _)| controller)
    }

    /// `controller` beside the reference.
    pub(super) fn question<'q>(
        &'q self,
        controller: &'q str,
        metric: &'q str,
        scenario: Option<&'q str>,
    ) -> Question<'q> {
        Question {
            controller,
            reference: self.reference,
            metric,
            scenario,
            objective: None,
        }
    }

    /// Names of all controllers but the reference.
    pub(super) fn compared(&self) -> impl Iterator<Item = &str> {
        let all = self.campaign.controllers.iter();
        all.map(|controller| controller.name.as_str())
            .filter(|name| *name != self.reference)
    }

    /// All scenarios together, then each.
    pub(super) fn places(&self) -> impl Iterator<Item = Option<&str>> {
        std::iter::once(None).chain(self.scenarios.iter().copied().map(Some))
    }
}
