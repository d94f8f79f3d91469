//! Two metrics that are bought with each other: who is beaten in both, and a picture.

use serde::Serialize;

use super::{claims::beats, gather::Gather};
use crate::{
    campaign::{contender::Contender, statistics::student::mean, statistics::unit},
    chart::{Axes, BLACK_INK, BLUE, Colour, GREEN, Line, PURPLE, Panel, Sheet, Stroke, VERMILION},
};

/// Height of a panel, units.
const HEIGHT: u32 = 620;
const COLUMNS: usize = 2;
/// Points farther off than so many times the least of the laws are left out of the picture, so that the others can be told apart.
const SHOWN: f64 = 2.0;

/// Means of one controller in one scenario.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Point {
    pub(super) scenario: String,
    pub(super) controller: String,
    /// The entry of the file that it comes from.
    pub(super) entry: String,
    pub(super) is_planner: bool,
    /// Means of both columns, in their units.
    pub(super) means: [f64; 2],
    /// How many of the other kind, planners or laws, beat it: in neither worse, and better in one.
    pub(super) beaten_by: usize,
    /// Whether one of its own kind does.
    pub(super) beaten_by_its_kind: bool,
}

impl Gather<'_> {
    /// Means of a controller in a scenario; none where it did not fly, and where no Pareto front is asked for.
    pub(super) fn point(&self, controller: &str, scenario: &str) -> Option<[f64; 2]> {
        let metrics = self.campaign.file.report.pareto_front.as_ref()?;
        let values = metrics
            .each_ref()
            .map(|metric| self.flights.observations(controller, metric, scenario));
        values
            .iter()
            .all(|values| !values.is_empty())
            .then(|| values.each_ref().map(|values| mean(values).centre))
    }

    /// All means in every scenario.
    pub(super) fn pareto_points(&self) -> Vec<Point> {
        let mut all = vec![];
        for scenario in &self.scenarios {
            let flown = self
                .campaign
                .controllers
                .iter()
                .filter(|contender| contender.may_win());
            let points: Vec<(&Contender, [f64; 2])> = flown
                .filter_map(|contender| Some((contender, self.point(&contender.name, scenario)?)))
                .collect();
            for (contender, means) in &points {
                let is_planner = |contender: &Contender| contender.law_flown().is_none();
                let beating = || points.iter().filter(|(_, other)| beats(*other, *means));
                let same_kind = |other: &Contender| is_planner(other) == is_planner(contender);
                all.push(Point {
                    scenario: (*scenario).to_owned(),
                    controller: contender.name.clone(),
                    entry: contender.entry.clone(),
                    is_planner: is_planner(contender),
                    means: *means,
                    beaten_by: beating().filter(|(other, _)| !same_kind(other)).count(),
                    beaten_by_its_kind: beating().any(|(other, _)| same_kind(other)),
                });
            }
        }
        all
    }
}

/// The second column over the first, a panel a scenario: every gain of every law a dot, the planners joined in their order.
pub(super) fn picture(points: &[Point], metrics: &[String; 2]) -> String {
    let mut scenarios: Vec<&str> = points.iter().map(|point| point.scenario.as_str()).collect();
    scenarios.dedup();
    let panels = scenarios.into_iter().map(|scenario| {
        let here: Vec<&Point> = points.iter().filter(|point| point.scenario == scenario).collect();
        panel(scenario, &here, metrics)
    });
    let sheet = Sheet {
        columns: COLUMNS,
        panels: panels.collect(),
    };
    sheet.svg(&format!("{} and {}", metrics[0], metrics[1]))
}

fn panel(scenario: &str, points: &[&Point], metrics: &[String; 2]) -> Panel {
    let laws = || points.iter().filter(|point| !point.is_planner);
    let least = laws().map(|point| point.means[0]).reduce(f64::min);
    let farthest = least.map_or(f64::INFINITY, |least| SHOWN * least);
    let mut entries: Vec<&str> = laws().map(|point| point.entry.as_str()).collect();
    entries.dedup();
    let colours: [Colour; 4] = [BLUE, GREEN, VERMILION, PURPLE];
    let mut lines: Vec<Line> = entries
        .iter()
        .zip(colours.into_iter().cycle())
        .map(|(entry, colour)| Line {
            name: (*entry).to_owned(),
            colour,
            stroke: Stroke::Dots,
            points: laws()
                .filter(|point| point.entry == *entry && point.means[0] <= farthest)
                .map(|point| (point.means[0], point.means[1]))
                .collect(),
        })
        .collect();
    let planners = points.iter().filter(|point| point.is_planner);
    let planners: Vec<(f64, f64)> = planners.map(|point| (point.means[0], point.means[1])).collect();
    for stroke in [Stroke::Solid, Stroke::Dots] {
        lines.push(Line {
            name: "planner, in the file's order".to_owned(),
            colour: BLACK_INK,
            stroke,
            points: planners.clone(),
        });
    }
    let label = |metric: &str| format!("{metric}, {}", unit(metric));
    Panel {
        heading: scenario.to_owned(),
        x_label: label(&metrics[0]).into(),
        y_label: label(&metrics[1]).into(),
        axes: Axes::Time(HEIGHT),
        lines,
    }
}
