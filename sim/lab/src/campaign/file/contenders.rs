//! The controllers of a campaign file as contenders.

use planner::{
    los::{LosGains, LosLaw, LosTuning},
    policy::Policy,
    snapshot::ForecastModel,
};

use super::{
    BreakdownFile, ControllerFile, CraftKnowledgeFile, ForecastFile, GainsFile, LawFile, PathsFile,
    PlannerFile, VariationFile,
};
use crate::{
    campaign::contender::{Breakdown, Contender, Paths, Pilot, Variation},
    tuning::grid,
};

impl ControllerFile {
    /// The contenders that it describes: one, or one for each point of a grid. Else which member is wrong, and why.
    pub(in crate::campaign) fn contenders(&self) -> Result<Vec<Contender>, (String, String)> {
        let pilots = match (&self.planner, &self.law) {
            (Some(planner), None) => vec![(self.name.clone(), planner.pilot())],
            (None, Some(law)) => law.pilots(&self.name)?,
            _ => {
                return Err(("planner".to_owned(), "give either planner or law".to_owned()));
            }
        };
        let contender = |(name, pilot)| Contender {
            name,
            entry: self.name.clone(),
            paths: match self.paths {
                PathsFile::AsScenario => Paths::AsScenario,
                PathsFile::Unknown => Paths::Uninformed,
                PathsFile::Known => Paths::Informed,
            },
            craft_declared: self.craft == CraftKnowledgeFile::Declared,
            pilot,
            variation: self.variation.map(Variation::from),
        };
        Ok(pilots.into_iter().map(contender).collect())
    }
}

impl PlannerFile {
    fn pilot(&self) -> Pilot {
        fn put<T: Clone>(given: Option<&T>, place: &mut T) {
            if let Some(given) = given {
                place.clone_from(given);
            }
        }
        let mut policy = Policy::default();
        put(self.energy_weight_per_j.as_ref(), &mut policy.weights.energy);
        put(self.scp_iterations.as_ref(), &mut policy.scp_iterations);
        put(self.range_back_off.as_ref(), &mut policy.range_back_off);
        put(
            self.uncertain_goal_share.as_ref(),
            &mut policy.uncertain_goal_share,
        );
        put(self.hard_turn_share.as_ref(), &mut policy.hard_turn_share);
        put(self.heading_rate_max_radps.as_ref(), &mut policy.heading_rate_max);
        put(self.cost_decides.as_ref(), &mut policy.cost_decides);
        put(self.steps_s.as_ref(), &mut policy.steps);
        Pilot::Planner {
            policy: Box::new(policy),
            forecast: self.forecast.map(|model| match model {
                ForecastFile::Hold => ForecastModel::Hold,
                ForecastFile::ConstantVelocity => ForecastModel::ConstantVelocity,
                ForecastFile::ConstantTurn => ForecastModel::ConstantTurn,
                ForecastFile::Path => ForecastModel::Path,
            }),
        }
    }
}

impl LawFile {
    /// What steers, by name: at the gains that are found or given, or at each point of the grid.
    fn pilots(&self, name: &str) -> Result<Vec<(String, Pilot)>, (String, String)> {
        let law = LosLaw::ALL.into_iter().find(|law| law.name() == self.name);
        let law = law.ok_or_else(|| {
            let names = LosLaw::ALL.map(LosLaw::name).join(", ");
            (
                "law.name".to_owned(),
                format!("there is no law {:?}, only {names}", self.name),
            )
        })?;
        match (self.gains, self.whole_grid) {
            (None, false) => Ok(vec![(name.to_owned(), Pilot::Law(law))]),
            (Some(gains), false) => Ok(vec![(name.to_owned(), Pilot::Tuned(gains.of(law)?))]),
            (None, true) => {
                let named = grid(law).into_iter().map(|tuning| {
                    let LosGains {
                        look_ahead,
                        along_track_gain,
                    } = tuning.gains;
                    let name = format!(
                        "{name} {look_ahead} / {along_track_gain} / {}",
                        tuning.integral_gain
                    );
                    (name, Pilot::Tuned(tuning))
                });
                Ok(named.collect())
            }
            (Some(_), true) => Err((
                "law.whole_grid".to_owned(),
                "give either gains or whole_grid".to_owned(),
            )),
        }
    }
}

impl GainsFile {
    fn of(self, law: LosLaw) -> Result<LosTuning, (String, String)> {
        let integral_gain = self.integral_gain_mps.unwrap_or(Policy::default().integral_gain);
        for (member, value) in [
            ("look_ahead_m", self.look_ahead_m),
            ("along_track_gain_per_s", self.along_track_gain_per_s),
            ("integral_gain_mps", integral_gain),
        ] {
            if !(value.is_finite() && 0.0 < value) {
                return Err((format!("law.gains.{member}"), format!("{value} is not above 0")));
            }
        }
        Ok(LosTuning {
            law,
            gains: LosGains {
                look_ahead: self.look_ahead_m,
                along_track_gain: self.along_track_gain_per_s,
            },
            integral_gain,
        })
    }
}

impl From<VariationFile> for Variation {
    fn from(file: VariationFile) -> Self {
        match file {
            VariationFile::Hull(factor) => Self::Hull(factor),
            VariationFile::WrongCurrentMps([north, east]) => Self::WrongCurrent(north, east),
            VariationFile::ClockAheadS(by) => Self::ClockAhead(by),
            VariationFile::LateReportsS(by) => Self::LateReports(by),
            VariationFile::NoSurgeLag => Self::NoSurgeLag,
            VariationFile::NoTurnRate => Self::NoTurnRate,
            VariationFile::NoPreview => Self::NoPreview,
            VariationFile::AskedEveryS(seconds) => Self::Seldom(seconds.max(1)),
            VariationFile::Breakdown { what, at_s } => Self::Breakdown(
                match what {
                    BreakdownFile::SlowHeadingLoop => Breakdown::SlowHeadingLoop,
                    BreakdownFile::PortThrusterLost => Breakdown::PortThrusterLost,
                    BreakdownFile::RudderStuck => Breakdown::RudderStuck,
                    BreakdownFile::HeadingOffset => Breakdown::HeadingOffset,
                },
                at_s,
            ),
        }
    }
}
