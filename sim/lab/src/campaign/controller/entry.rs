//! An entry of a campaign file: a controller and its knowledge.

use std::collections::BTreeMap;

use planner::{
    FixedFigure,
    los::LawGains,
    snapshot::{FigureKind, ForecastModel},
    tuned::Tuned,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim::fleet::Assigner;

use super::variation::Variation;
use crate::campaign::grid::figures;
use crate::rules::Rule;

/// A controller and its knowledge.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControllerFile {
    /// Its name, unique in the campaign.
    #[schemars(length(min = 1, max = 80))]
    pub name: String,
    /// Knowledge of the AUVs' paths, speeds and dives.
    #[serde(default)]
    pub paths: Paths,
    /// Knowledge of the surface craft.
    #[serde(default)]
    pub craft: CraftKnowledge,
    /// Difference from the scenario or the craft; none if left out.
    pub variation: Option<Variation>,
    /// The planner. Give either this
    pub planner: Option<PlannerFile>,
    /// or a line-of-sight law,
    pub law: Option<LawFile>,
    /// or the address of a law outside of this program, which gets each snapshot over HTTP.
    pub guide: Option<String>,
    /// A rule instead of the planner's schedule, where the goal visits, or of its figure, where the
    /// goal localises.
    pub rule: Option<RuleFile>,
    /// What assigns the AUVs to several surface craft; the planner if left out.
    pub assign: Option<Assigner>,
}

/// A rule that visits AUVs, or localises them.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RuleFile {
    /// Its name.
    pub name: Rule,
    /// Time of a turn, or of a stay beyond the goal's least time, s; tuned per case if left out.
    #[schemars(range(min = 0, max = 100_000))]
    pub dwell_s: Option<f64>,
}

impl RuleFile {
    pub(super) fn dwells(&self) -> &[f64] {
        let own = self.dwell_s.as_ref().map(std::slice::from_ref);
        own.unwrap_or(self.name.dwells())
    }
}

/// The planner.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlannerFile {
    /// The forecast model that it must use; its own choice if left out.
    pub forecast: Option<ForecastModel>,
    /// The planner's levers, each the planner's default if left out, as for the members below.
    #[serde(flatten)]
    pub tuning: planner::snapshot::Tuning,
    /// Back-off of acoustic ranges, in standard deviations.
    pub range_back_off: Option<f64>,
    /// Least share of the weight of the distance to the goal, however uncertain the goal is.
    pub uncertain_goal_share: Option<f64>,
    /// Share of the largest planned speed above which a law preferred to a plan is slew-limited.
    pub hard_turn_share: Option<f64>,
    /// Fastest that a heading reference turns where the craft could turn faster, rad/s.
    pub heading_rate_max_radps: Option<f64>,
    /// The only figure that it may sail where the goal localises AUVs; its own choice if left out.
    pub figure: Option<FigureFile>,
    /// `true`: the fallback level of least predicted cost answers.
    pub cost_decides: Option<bool>,
    /// Tuned numbers by table and name, such as `parameters.estimate.gate`; the scenario's if left
    /// out.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, BTreeMap<String, f64>>")]
    pub parameters: Tuned,
}

impl PlannerFile {
    /// Its members, with those of the tuning, which Serde does not list.
    pub fn members() -> Vec<String> {
        let schema = schemars::schema_for!(Self).to_value();
        let members = schema["properties"].as_object();
        members.into_iter().flat_map(|members| members.keys().map(|name| format!("`{name}`"))).collect()
    }
}

/// A figure that the planner does not choose.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FigureFile {
    /// Its shape: `above`, `circle` or `zigzag_astern`.
    pub kind: FigureKind,
    /// Its radius, or its distance and half its width, m; tuned per case, with speed, if left out.
    #[schemars(range(min = 1, max = 10_000))]
    pub radius_m: Option<f64>,
    /// Share of the greatest speed about the AUVs; 1 if left out beside `radius_m`.
    #[schemars(range(min = 0.1, max = 1))]
    pub speed_share: Option<f64>,
}

impl FigureFile {
    pub(super) fn grid(&self) -> Vec<FixedFigure> {
        let kind = self.kind;
        let speed_share = self.speed_share.unwrap_or(1.0);
        self.radius_m
            .map_or_else(|| figures(kind), |radius_m| vec![FixedFigure { kind, radius_m, speed_share }])
    }
}

/// A line-of-sight law.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LawFile {
    /// Its name, such as `saturated_los`.
    pub name: String,
    /// Its gains; tuned for each scenario and craft if left out.
    pub gains: Option<LawGains>,
    /// Fly every point of the law's grid as a separate controller.
    #[serde(default)]
    pub whole_grid: bool,
}

/// A controller's knowledge of the AUVs' paths, speeds and dives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Paths {
    /// As the scenario grants.
    #[default]
    AsScenario,
    /// Nothing, unless the goal itself is given along a path.
    Unknown,
    /// Everything, independent of the scenario.
    Known,
}

/// A controller's knowledge of the surface craft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CraftKnowledge {
    /// The response to references, and all limits.
    #[default]
    Declared,
    /// Its least and its largest speed.
    Speeds,
}
