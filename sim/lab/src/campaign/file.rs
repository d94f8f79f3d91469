//! Campaign files: TOML of the shape of [`CampaignFile`].

use std::{fs, io, path::Path};

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim::scenario::{ScenarioError, line_of, line_of_field};

use super::controller::{Controller, ControllerFile, PlannerFile};
use super::score::{SCORES, Score};

mod check;
mod controllers;

/// Largest campaign file that is read, bytes.
const FILE_BYTES_MAX: u64 = 1_000_000;
/// Most replicates.
pub const REPLICATES_MAX: u64 = 1_000_000;
/// Seeds are at most this, so that columns of floating-point numbers hold them exactly.
pub(super) const SEED_MAX: u64 = 1 << 52;

/// A campaign: scenarios × craft × replicates × controllers.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CampaignFile {
    /// Version of this format.
    pub schema_version: Version,
    /// Its name: lower-case letters, digits and hyphens.
    #[schemars(regex(pattern = "^[a-z0-9-]{1,64}$"))]
    pub name: String,
    /// The question, in one line.
    pub title: String,
    /// Seed of everything that the campaign draws; 1 if left out.
    #[serde(default = "one")]
    #[schemars(range(max = SEED_MAX))]
    pub seed: u64,
    /// Names of built-in scenarios, or paths of scenario files relative to the campaign file; every
    /// built-in scenario with a surface craft if left out.
    #[serde(default)]
    pub scenarios: Vec<String>,
    /// Longest mission, s; as the scenarios say if left out.
    #[schemars(range(min = 1, max = 86_400))]
    pub duration_s: Option<f64>,
    /// Replicates of each scenario and craft, each with its own seed and parameters.
    #[schemars(range(min = 1, max = REPLICATES_MAX))]
    pub replicates: u64,
    /// Seed of the first replicate; the others follow. Drawn from `seed` if left out.
    pub first_seed: Option<u64>,
    /// The craft; that of the scenario if left out.
    #[serde(default)]
    pub craft: Vec<CraftEntry>,
    /// Numbers of the scenarios that are drawn for each replicate; equal for all controllers.
    #[serde(default)]
    pub parameters: Vec<Parameter>,
    /// The search for the gains of laws; needed by laws without `gains`.
    pub tuning: Option<Tuning>,
    /// The controllers.
    pub controllers: Vec<ControllerFile>,
    /// The comparisons of the report.
    #[serde(default)]
    pub report: ReportFile,
    /// Claims that the report decides.
    #[serde(default)]
    pub claims: Vec<Claim>,
}

fn one() -> u64 {
    1
}

/// Version of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Version {
    /// The only version.
    #[serde(rename = "1")]
    One,
}

/// A craft, or several random ones.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum CraftEntry {
    /// The craft of the scenario.
    Scenario,
    /// A MEDUSA.
    Medusa,
    /// An Otter.
    Otter,
    /// Random craft of consecutive seeds.
    Random {
        /// First seed.
        first: u64,
        /// Number of craft.
        count: u64,
    },
}

/// A number of the scenarios, drawn for each replicate: uniform in a range, or one of a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Its place in a scenario file, such as `knowledge.acoustics.sigma_m` or `auvs[0].speed_mps`.
    pub key: String,
    /// Least and largest value. Give either this
    pub uniform: Option<[f64; 2]>,
    /// or a list of values.
    pub choice: Option<Vec<f64>>,
}

/// The search for the gains of laws: the best of each law's grid, on replicates for tuning only.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Replicates of each scenario and craft.
    pub replicates: u64,
    /// Seed of the first tuning replicate, apart from the scored ones; drawn if left out.
    pub first_seed: Option<u64>,
    /// A law flies once for each of these, at the gains with its least mean; `rms_m` if left out.
    #[serde(default = "nearness")]
    pub objectives: Vec<Objective>,
}

fn nearness() -> Vec<Objective> {
    vec![Objective::RmsM]
}

/// A quantity that gains minimise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// Root mean square distance to the goal, m.
    RmsM,
    /// Propulsion energy, J.
    EnergyJ,
    /// Heading travel, rad.
    HeadingTravelRad,
    /// Mean cost of AUVs that are visited.
    VisitMeanCost,
    /// True error of AUVs that are localised, root mean square, m.
    NavigationRmsM,
}

impl Objective {
    /// Its column.
    pub fn name(self) -> &'static str {
        match self {
            Self::RmsM => "rms_m",
            Self::EnergyJ => "energy_j",
            Self::HeadingTravelRad => "heading_travel_rad",
            Self::VisitMeanCost => "visit_mean_cost",
            Self::NavigationRmsM => "navigation_rms_m",
        }
    }

    pub(super) fn of(self, score: &Score) -> f64 {
        let column = SCORES.into_iter().find(|(name, _)| *name == self.name());
        column.and_then(|column| score.value(column)).unwrap_or(0.0)
    }
}

/// The comparisons of a report.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReportFile {
    /// Controller to compare with; the first law if left out, else the first controller.
    pub reference: Option<String>,
    /// The compared columns; less is better in each.
    #[serde(default = "compared")]
    pub metrics: Vec<String>,
    /// Two columns whose means are plotted per scenario with the Pareto front; none if left out.
    pub pareto_front: Option<[String; 2]>,
}

/// A claim that a column of some controllers is small in some scenarios. It is decided for each
/// controller and scenario, unless it says otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// The claim, in words.
    pub claim: String,
    /// Names of the controllers that it is about.
    pub controllers: Vec<String>,
    /// Names of the scenarios that it is about; all if left out.
    #[serde(default)]
    pub scenarios: Vec<String>,
    /// The column; `rms_m` if left out.
    #[serde(default = "rms")]
    pub metric: String,
    /// Controllers to compare with: in each scenario the one with the least mean of the first
    /// tuning objective, at its gains for that objective.
    #[serde(default)]
    pub beside: Vec<String>,
    /// The claimed relation.
    pub is: Claimed,
}

/// A claimed relation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Claimed {
    /// The paired ratio to that controller is at most this.
    RatioAtMost(f64),
    /// The upper end of the ratio's 95 % interval is at most this.
    RatioSurelyAtMost(f64),
    /// The mean is at most this in every scenario; decided for all scenarios together.
    MeanAtMost(f64),
    /// The median over scenarios of the ratio of the value to `factor` × bound + `spare_m` is at
    /// most 1; decided for all scenarios together.
    WithinBound {
        /// Factor of the bound.
        factor: f64,
        /// Allowance beside it, m.
        spare_m: f64,
    },
    /// No controller of `beside` dominates `controllers` in the columns of `report.pareto_front`.
    Undominated,
}

fn rms() -> String {
    "rms_m".to_owned()
}

fn compared() -> Vec<String> {
    let columns = ["rms_m", "energy_j", "heading_travel_rad"];
    columns.map(str::to_owned).into()
}

impl Default for ReportFile {
    fn default() -> Self {
        Self { reference: None, metrics: compared(), pareto_front: None }
    }
}

/// A campaign cannot be read.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    #[error("cannot read {0}")]
    Unreadable(String, #[source] io::Error),
    #[error("{0}:{1}: {2}: {3}")]
    Invalid(String, usize, String, String),
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

impl CampaignError {
    /// `field` is wrong in `text`, which came from `file`.
    pub(super) fn invalid(text: &str, file: &str, field: String, reason: String) -> Self {
        Self::Invalid(file.to_owned(), line_of_field(text, &field), field, reason)
    }
}

impl CampaignFile {
    /// The text of the file at `path`.
    pub fn text(path: &Path) -> Result<String, CampaignError> {
        let unreadable = |error| CampaignError::Unreadable(path.display().to_string(), error);
        let bytes = fs::metadata(path).map_err(unreadable)?.len();
        if FILE_BYTES_MAX < bytes {
            return Err(unreadable(io::Error::other("it is larger than 1 MB")));
        }
        fs::read_to_string(path).map_err(unreadable)
    }

    /// The campaign in `text`, which came from `file`.
    pub fn parse(text: &str, file: &str) -> Result<Self, CampaignError> {
        let refused = |error: &toml::de::Error, field: String| {
            let line = error.span().map_or(1, |span| line_of(text, span.start));
            let mut reason = error.message().to_owned();
            if field.ends_with(".planner") && reason.starts_with("unknown field") {
                reason = format!("{reason}, expected one of {}", PlannerFile::members().join(", "));
            }
            CampaignError::Invalid(file.to_owned(), line, field, reason)
        };
        let document =
            toml::Deserializer::parse(text).map_err(|error| refused(&error, "syntax".to_owned()))?;
        let campaign: Self = serde_path_to_error::deserialize(document).map_err(|error| {
            let field = Some(error.path().to_string()).filter(|field| field != ".");
            refused(error.inner(), field.unwrap_or_else(|| "file".to_owned()))
        })?;
        let checked = campaign.check();
        checked.map_err(|(field, reason)| CampaignError::invalid(text, file, field, reason))?;
        Ok(campaign)
    }

    /// The controllers of all entries that are right.
    pub(super) fn all_controllers(&self) -> Vec<Controller> {
        let entries = self.controllers.iter();
        let right = entries.filter_map(|entry| entry.controllers().ok());
        right.flatten().collect()
    }

    /// The JSON Schema of campaign files.
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(Self).to_value()
    }
}

impl Parameter {
    /// The extreme values, which every scenario must accept.
    pub(super) fn extremes(&self) -> Vec<f64> {
        match (self.uniform, &self.choice) {
            (Some(limits), _) => limits.to_vec(),
            (None, Some(values)) => values.clone(),
            (None, None) => vec![],
        }
    }

    pub(super) fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        match (self.uniform, &self.choice) {
            (Some([least, most]), _) => rng.random_range(least..=most),
            (None, Some(values)) => values[rng.random_range(0..values.len())],
            (None, None) => f64::NAN,
        }
    }
}
