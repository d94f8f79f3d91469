//! What a campaign file says: TOML of the shape of [`CampaignFile`].

use std::{collections::BTreeMap, fs, io, path::Path};

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::Deserialize;
use sim::scenario::ScenarioError;

use super::score::Score;

mod check;
mod contenders;

/// Largest campaign file that is read, bytes.
const FILE_BYTES_MAX: u64 = 1_000_000;
/// Most replicates of an arena.
pub const REPLICATES_MAX: u64 = 1_000_000;
/// Seeds are below this: columns of numbers hold them exactly.
pub(super) const SEED_MAX: u64 = 1 << 52;

/// A campaign: scenarios × craft × replicates, and who flies in each.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CampaignFile {
    /// Version of this format.
    pub schema_version: Version,
    /// Its name: lower-case letters, digits and hyphens.
    #[schemars(regex(pattern = "^[a-z0-9-]{1,64}$"))]
    pub name: String,
    /// What it asks, in one line.
    pub title: String,
    /// Seed of all that is drawn for the campaign; 1 if left out.
    #[serde(default = "one")]
    #[schemars(range(max = SEED_MAX))]
    pub seed: u64,
    /// Names of built-in scenarios or of `scenario_files`, or, where the campaign is a file, paths of others relative to it; every
    /// built-in scenario with a surface craft if left out.
    #[serde(default)]
    pub scenarios: Vec<String>,
    /// Texts of scenario files, TOML, by the names that `scenarios` calls them: for a campaign that is one file. They name no
    /// files themselves.
    #[serde(default)]
    pub scenario_files: BTreeMap<String, String>,
    /// End every mission after this many seconds, if it is not over before; as the scenarios say if left out.
    #[schemars(range(min = 1, max = 86_400))]
    pub duration_s: Option<f64>,
    /// Worlds of each scenario and craft.
    #[schemars(range(min = 1, max = REPLICATES_MAX))]
    pub replicates: u64,
    /// Seed of the first world's mission; the others follow it. Drawn from `seed` if left out.
    pub first_seed: Option<u64>,
    /// Which craft fly; that of the scenario if left out.
    #[serde(default)]
    pub craft: Vec<CraftEntry>,
    /// Numbers of the scenarios that are drawn for each world, the same for all of its controllers.
    #[serde(default)]
    pub parameters: Vec<Parameter>,
    /// How the gains of laws are found; laws whose gains are `tuned` need it.
    pub tuning: Option<Tuning>,
    /// Who flies.
    pub controllers: Vec<ControllerFile>,
    /// What the report compares.
    #[serde(default)]
    pub report: ReportFile,
    /// What is claimed beforehand, and decided by the report.
    #[serde(default)]
    pub claims: Vec<Claim>,
}

fn one() -> u64 {
    1
}

/// A version of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Version {
    /// The only one so far.
    #[serde(rename = "1")]
    One,
}

/// One craft, or several drawn ones.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum CraftEntry {
    /// That of the scenario.
    Scenario,
    /// A MEDUSA instead of it.
    Medusa,
    /// An Otter instead of it.
    Otter,
    /// Craft drawn from consecutive seeds.
    Random {
        /// Seed of the first.
        first: u64,
        /// How many.
        count: u64,
    },
}

/// A number of the scenarios that is drawn for each world: evenly between two limits, or one of some, each as likely.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Where it stands in a scenario file, such as `knowledge.acoustics.sigma_m` or `auvs[0].speed_mps`.
    pub key: String,
    /// Least and largest value; either this
    pub uniform: Option<[f64; 2]>,
    /// or the values.
    pub choice: Option<Vec<f64>>,
}

/// How the gains of laws are found: by the grid of each law, on worlds of their own.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Worlds of each scenario and craft.
    pub replicates: u64,
    /// Seed of the first of these worlds; drawn from the campaign's seed if left out. None is a world that is scored.
    pub first_seed: Option<u64>,
    /// A law flies at the gains with the least mean of each of these; `rms_m` if left out.
    #[serde(default = "nearness")]
    pub objectives: Vec<Objective>,
}

fn nearness() -> Vec<Objective> {
    vec![Objective::RmsM]
}

/// What gains are found for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// Root mean square distance to the goal, m.
    RmsM,
    /// Propulsion energy, J.
    EnergyJ,
    /// Heading travel, rad.
    HeadingTravelRad,
}

impl Objective {
    /// The column that it is.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::RmsM => "rms_m",
            Self::EnergyJ => "energy_j",
            Self::HeadingTravelRad => "heading_travel_rad",
        }
    }

    /// Its value.
    pub(super) fn of(self, score: &Score) -> f64 {
        match self {
            Self::RmsM => score.metrics.rms_m,
            Self::EnergyJ => score.metrics.energy_j,
            Self::HeadingTravelRad => score.metrics.heading_travel_rad,
        }
    }
}

/// Who flies, and what it knows.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControllerFile {
    /// Its name, unique in the campaign.
    #[schemars(length(min = 1, max = 80))]
    pub name: String,
    /// What it knows of the AUVs' paths, speeds and dives.
    #[serde(default)]
    pub paths: PathsFile,
    /// What is declared to it of the surface craft.
    #[serde(default)]
    pub craft: CraftKnowledgeFile,
    /// What is other than the scenario says, or than the craft is; nothing if left out.
    pub variation: Option<VariationFile>,
    /// The planner, or
    pub planner: Option<PlannerFile>,
    /// a line-of-sight law.
    pub law: Option<LawFile>,
}

/// What a controller knows of the AUVs' paths, speeds and dives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PathsFile {
    /// What the scenario grants.
    #[default]
    AsScenario,
    /// Nothing, unless its very goal is given along a path.
    Unknown,
    /// Everything, whatever the scenario says.
    Known,
}

/// What is declared to a controller of the surface craft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CraftKnowledgeFile {
    /// How it answers references, and all of its limits.
    #[default]
    Declared,
    /// Its least and its largest speed.
    Speeds,
}

/// The planner.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlannerFile {
    /// The forecast model that it has to use; its own choice if left out.
    pub forecast: Option<ForecastFile>,
    /// Price of propulsion energy, 1/J; the planner's own number if left out, as for those below.
    pub energy_weight_per_j: Option<f64>,
    /// SCP iterations from one initial guess.
    pub scp_iterations: Option<usize>,
    /// Standard deviations by which acoustic ranges are taken to be shorter.
    pub range_back_off: Option<f64>,
    /// Least share of its weight that a distance to the goal keeps, however uncertain the goal is.
    pub uncertain_goal_share: Option<f64>,
    /// Share of the largest planned speed above which a law that is preferred to a plan is slew-limited as one.
    pub hard_turn_share: Option<f64>,
    /// Fastest that a heading reference turns where the craft could turn faster, rad/s.
    pub heading_rate_max_radps: Option<f64>,
    /// Whether the fallback level of least predicted cost answers.
    pub cost_decides: Option<bool>,
    /// Lengths of the horizon's intervals, s.
    pub steps_s: Option<Vec<f64>>,
}

/// A forecast model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForecastFile {
    /// All stay where they are.
    Hold,
    /// All keep their velocity.
    ConstantVelocity,
    /// All keep their rate of turn.
    ConstantTurn,
    /// Along the paths.
    Path,
}

/// A line-of-sight law.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LawFile {
    /// Its name, as `saturated_los`.
    pub name: String,
    /// Its gains: the best of its grid for each scenario and craft if left out.
    pub gains: Option<GainsFile>,
    /// Whether it flies at every point of its grid, a controller each.
    #[serde(default)]
    pub whole_grid: bool,
}

/// Gains of a law.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GainsFile {
    /// Look-ahead distance, m.
    pub look_ahead_m: f64,
    /// Along-track gain, 1/s.
    pub along_track_gain_per_s: f64,
    /// Integral gain, m/s, of the law that has one; the planner's own number if left out.
    pub integral_gain_mps: Option<f64>,
}

/// What is other than the scenario says, or than the craft is.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum VariationFile {
    /// Masses, inertia and drags of the hull are this many times theirs.
    Hull(f64),
    /// This is added to every current that is known (north, east), m/s.
    WrongCurrentMps([f64; 2]),
    /// The surface craft's clock is ahead by this, s.
    ClockAheadS(f64),
    /// A fix is known later than the scenario says, by this, s.
    LateReportsS(f64),
    /// The controller takes the surge loop for one without lag.
    NoSurgeLag,
    /// The controller takes it that the craft turns as fast as any may.
    NoTurnRate,
    /// The controller follows the vehicle whose turn it is, and knows of no turn to come.
    NoPreview,
    /// The controller is asked every so many seconds, and its answer is held meanwhile.
    AskedEveryS(u32),
    /// Something of the surface craft breaks, and stays broken.
    Breakdown {
        /// What.
        what: BreakdownFile,
        /// When, s.
        at_s: f64,
    },
}

/// What breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BreakdownFile {
    /// The heading loop has twice its lag.
    SlowHeadingLoop,
    /// The port thruster is lost.
    PortThrusterLost,
    /// The rudder is stuck 10° to starboard, of 35° at most.
    RudderStuck,
    /// The craft comes to rest 10° to starboard of its heading reference.
    HeadingOffset,
}

/// What the report compares.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReportFile {
    /// The controller that the others are compared with; the first that is a law if left out, else the first.
    pub reference: Option<String>,
    /// Columns that are compared; less is better in each.
    #[serde(default = "compared")]
    pub metrics: Vec<String>,
    /// Two columns whose means are drawn over each other, scenario by scenario, and how many controllers are better in both than
    /// each; none if left out.
    pub pareto_front: Option<[String; 2]>,
}

/// A claim: that a column of some controllers is small in some scenarios. It is decided for each controller and scenario by itself,
/// but where it says otherwise.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
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
    /// Names of the controllers beside which it is set: in each scenario the one of them with the least mean of the first objective that
    /// gains are found for, at its gains for that objective.
    #[serde(default)]
    pub beside: Vec<String>,
    /// What is claimed.
    pub is: Claimed,
}

/// What is claimed.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Claimed {
    /// The paired ratio to the one beside it is at most this.
    RatioAtMost(f64),
    /// The upper end of the ratio's 95 % interval is at most this.
    RatioSurelyAtMost(f64),
    /// The mean is at most this in every scenario; it is decided for all of them together.
    MeanAtMost(f64),
    /// The middle over scenarios of its ratio to what the bound allows is at most 1; it is decided for all of them together.
    WithinBound {
        /// So many times the bound are allowed,
        factor: f64,
        /// and so much more, m.
        spare_m: f64,
    },
    /// None of those beside it has a smaller mean than any of the controllers in both columns of `report.pareto_front`.
    Undominated,
}

fn rms() -> String {
    "rms_m".to_owned()
}

fn compared() -> Vec<String> {
    ["rms_m", "energy_j", "heading_travel_rad"]
        .map(str::to_owned)
        .into()
}

impl Default for ReportFile {
    fn default() -> Self {
        Self {
            reference: None,
            metrics: compared(),
            pareto_front: None,
        }
    }
}

/// Why there is no campaign.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The file cannot be read.
    #[error("cannot read {path}")]
    Unreadable {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// Something in it is wrong.
    #[error("{file}:{line}: {field}: {reason}")]
    Invalid {
        /// Name of the file.
        file: String,
        /// Line of the member that is wrong, from 1 on.
        line: usize,
        /// The member.
        field: String,
        /// Value and limit.
        reason: String,
    },
    /// A scenario file of it is wrong.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

impl CampaignError {
    /// `field` is wrong in `text`, which came from `file`.
    pub(super) fn invalid(text: &str, file: &str, field: String, reason: String) -> Self {
        Self::Invalid {
            file: file.to_owned(),
            line: line_of_key(text, &field),
            field,
            reason,
        }
    }
}

impl CampaignFile {
    /// The text of the file at `path`.
    pub fn text(path: &Path) -> Result<String, CampaignError> {
        let unreadable = |source| CampaignError::Unreadable {
            path: path.display().to_string(),
            source,
        };
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
            CampaignError::Invalid {
                file: file.to_owned(),
                line,
                field,
                reason: error.message().to_owned(),
            }
        };
        let document =
            toml::Deserializer::parse(text).map_err(|error| refused(&error, "syntax".to_owned()))?;
        let campaign: Self = serde_path_to_error::deserialize(document).map_err(|error| {
            let field = error.path().to_string();
            refused(
                error.inner(),
                if field == "." { "file".to_owned() } else { field },
            )
        })?;
        campaign
            .check()
            .map_err(|(field, reason)| CampaignError::invalid(text, file, field, reason))?;
        Ok(campaign)
    }

    /// The JSON Schema of campaign files.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(Self).to_value()
    }
}

impl Parameter {
    /// Values at the ends of what may be drawn, which a scenario has to take.
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

fn line_of(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|byte| *byte == b'\n').count()
}

/// The line where the last named step of `field`, as `controllers[2].law.name`, stands: its table's n-th header, then the key.
fn line_of_key(text: &str, field: &str) -> usize {
    let (head, index) = match field.split_once('[') {
        Some((head, rest)) => (
            head,
            rest.split_once(']')
                .and_then(|(index, _)| index.parse().ok())
                .unwrap_or(0),
        ),
        None => (field.split('.').next().unwrap_or(field), 0),
    };
    let key = field.rsplit('.').next().unwrap_or(field);
    let key = key.split('[').next().unwrap_or(key);
    let lines: Vec<&str> = text.lines().map(str::trim_start).collect();
    let header =
        |line: &&str| line.starts_with(&format!("[[{head}]]")) || line.starts_with(&format!("[{head}]"));
    let starts: Vec<usize> = lines
        .iter()
        .enumerate()
        .filter(|(_, line)| header(line))
        .map(|(i, _)| i)
        .collect();
    let from = starts.get(index).copied().unwrap_or(0);
    let is_key = |line: &&str| {
        line.split(['=', '.', ' '])
            .any(|word| word.trim_matches(['{', ',']) == key)
    };
    let found = lines[from..].iter().position(is_key);
    1 + from + found.unwrap_or(0)
}
