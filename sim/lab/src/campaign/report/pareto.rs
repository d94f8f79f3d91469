//! Two conflicting metrics: dominated controllers, and a picture.

use serde::Serialize;

use super::{claims::dominates, data::Data};
use crate::{
    campaign::{controller::Controller, statistics::unit},
    chart::{BLACK_INK, BLUE, Colour, GREEN, Line, PURPLE, Panel, Sheet, Stroke, VERMILION},
};

const COLUMNS: usize = 2;
/// Points beyond this many times the least of the laws are not drawn, so that the others can be distinguished.
const SHOWN: f64 = 2.0;

/// Means of one controller in one scenario.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Point {
    pub(super) scenario: String,
    pub(super) controller: String,
    /// Its entry in the campaign file.
    pub(super) entry: String,
    pub(super) is_planner: bool,
    /// Means of both columns, in their units.
    pub(super) means: [f64; 2],
    /// How many of the other kind, planners or laws, dominate it.
    pub(super) beaten_by: usize,
    /// Whether one of its own kind dominates it.
    pub(super) beaten_by_its_kind: bool,
}

impl Data<'_> {
    /// Both means of a controller in a scenario; none if it did not fly, or without a Pareto front.
    pub(super) fn point(&self, controller: &str, scenario: &str) -> Option<[f64; 2]> {
        let metrics = self.campaign.file.report.pareto_front.as_ref()?;
        let [x, y] = metrics
            .each_ref()
            .map(|metric| self.mean(controller, metric, scenario));
        Some([x?.centre, y?.centre])
    }

    /// All means in every scenario.
    pub(super) fn pareto_points(&self) -> Vec<Point> {
        let mut all = vec![];
        for scenario in &self.scenarios {
            let flown = self
                .campaign
                .controllers
                .iter()
                .filter(|controller| controller.may_win());
            let points: Vec<(&Controller, [f64; 2])> = flown
                .filter_map(|controller| Some((controller, self.point(&controller.name, scenario)?)))
                .collect();
            for (controller, means) in &points {
                let is_planner = |controller: &Controller| controller.los_law().is_none();
                let beating = || points.iter().filter(|(_, other)| dominates(*other, *means));
                let same_kind = |other: &Controller| is_planner(other) == is_planner(controller);
                all.push(Point {
                    scenario: (*scenario).to_owned(),
                    controller: controller.name.clone(),
                    entry: controller.entry.clone(),
                    is_planner: is_planner(controller),
                    means: *means,
                    beaten_by: beating().filter(|(other, _)| !same_kind(other)).count(),
                    beaten_by_its_kind: beating().any(|(other, _)| same_kind(other)),
                });
            }
        }
        all
    }
}

/// The second column against the first, a panel for each scenario: a dot for each gain of a law, the planners joined in order.
pub(super) fn picture(points: &[Point], metrics: &[String; 2]) -> Sheet {
    let mut scenarios: Vec<&str> = points.iter().map(|point| point.scenario.as_str()).collect();
    scenarios.dedup();
    let panels = scenarios.into_iter().map(|scenario| {
        let here: Vec<&Point> = points.iter().filter(|point| point.scenario == scenario).collect();
        panel(scenario, &here, metrics)
    });
    Sheet {
        title: format!("Mean {} against mean {}, by scenario", metrics[1], metrics[0]),
        columns: COLUMNS,
        panels: panels.collect(),
    }
}

fn panel(scenario: &str, points: &[&Point], metrics: &[String; 2]) -> Panel {
    let laws = || points.iter().filter(|point| !point.is_planner);
    let least = laws().map(|point| point.means[0]).reduce(f64::min);
    let farthest = least.map_or(f64::INFINITY, |least| SHOWN * least);
    let mut entries: Vec<&str> = laws().map(|point| point.entry.as_str()).collect();
    entries.dedup();
    let colours: [Colour; 4] = [BLUE, GREEN, VERMILION, PURPLE];
    let mut lines: Vec<Line> = vec![];
    for (entry, colour) in entries.iter().zip(colours.into_iter().cycle()) {
        let own = laws().filter(|point| point.entry == *entry && point.means[0] <= farthest);
        lines.push(Line::new(
            *entry,
            colour,
            Stroke::Dots,
            own.map(|point| point.means.into()),
        ));
    }
    for stroke in [Stroke::Solid, Stroke::Dots] {
        let planners = points.iter().filter(|point| point.is_planner);
        let means = planners.map(|point| point.means.into());
        lines.push(Line::new(
            "planner, in the file's order",
            BLACK_INK,
            stroke,
            means,
        ));
    }
    let label = |metric: &str| format!("{metric}, {}", unit(metric));
    Panel {
        heading: scenario.to_owned(),
        x_label: label(&metrics[0]).into(),
        y_label: label(&metrics[1]).into(),
        lines,
    }
}
