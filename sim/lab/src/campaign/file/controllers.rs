//! Controllers of a campaign from the entries of its file.

use planner::los::{LawGains, LosLaw, LosTuning};
use planner::parameters::Parameters;
use planner::snapshot::{FigureKind, Tuning};
use planner::tuned::Tuned;

use super::check::ensure;
use crate::campaign::controller::{ControlLaw, Controller, ControllerFile, LawFile, PlannerFile, RuleFile};
use crate::campaign::grid::{grid, tuned};
use crate::http_guide::GuideUrl;
use crate::rules::Rule;

/// Longest turn or stay of a rule, s: more than a day.
const TURN_MAX: f64 = 1.0e5;

/// A member that is wrong, and the reason.
type Wrong = (String, String);

fn wrong<T>(member: impl Into<String>, reason: impl Into<String>) -> Result<T, Wrong> {
    Err((member.into(), reason.into()))
}

impl ControllerFile {
    /// Its controllers: one, or one per point of a grid. The error names the member and the reason.
    pub(in crate::campaign) fn controllers(&self) -> Result<Vec<Controller>, Wrong> {
        let laws = match (&self.planner, &self.law, &self.guide) {
            (Some(planner), None, None) => vec![(self.name.clone(), planner.control_law()?)],
            (None, Some(law), None) => law.control_laws(&self.name)?,
            (None, None, Some(url)) => {
                let url = url.parse::<GuideUrl>();
                let url = url.map_err(|error| ("guide".to_owned(), error.to_string()))?;
                vec![(self.name.clone(), ControlLaw::Guide(url))]
            }
            _ => return wrong("planner", "give one of planner, law and guide"),
        };
        if let Some(RuleFile { name, dwell_s: Some(dwell) }) = self.rule {
            let least = if name == Rule::Clock { 1.0 } else { 0.0 };
            let reason = format!("{dwell} is outside {least} to {TURN_MAX} s");
            ensure((least..=TURN_MAX).contains(&dwell), "rule.dwell_s", reason)?;
        }
        let controllers = laws.into_iter().map(|(name, law)| {
            let entry = self.clone();
            Controller { name, law, entry }
        });
        let controllers: Vec<Controller> = controllers.collect();
        let is_tuned = self.guide.is_some() && controllers.iter().any(Controller::is_tuned);
        let reason = "is missing: nothing is tuned for a law outside of this program";
        ensure(!is_tuned, "rule.dwell_s", reason)?;
        Ok(controllers)
    }
}

impl PlannerFile {
    fn control_law(&self) -> Result<ControlLaw, Wrong> {
        if let Some(fault) = self.tuning.faults("planner").first() {
            return wrong(fault.pointer.replace('/', "."), fault.words());
        }
        if let Some(figure) = self.figure {
            use FigureKind::{Above, Circle, ZigzagAstern};
            let is_constant = matches!(figure.kind, Above | Circle | ZigzagAstern);
            ensure(is_constant, "planner.figure.kind", "must be above, circle or zigzag_astern")?;
            for (member, value, range) in
                [("radius_m", figure.radius_m, 1.0..=1.0e4), ("speed_share", figure.speed_share, 0.1..=1.0)]
            {
                let Some(value) = value else { continue };
                let reason = format!("{value} is outside {} to {}", range.start(), range.end());
                ensure(range.contains(&value), format!("planner.figure.{member}"), reason)?;
            }
        }
        let usual = Parameters::default().tuned(&self.tuning);
        let parameters = Parameters {
            range_back_off: self.range_back_off.unwrap_or(usual.range_back_off),
            uncertain_goal_share: self.uncertain_goal_share.unwrap_or(usual.uncertain_goal_share),
            hard_turn_share: self.hard_turn_share.unwrap_or(usual.hard_turn_share),
            heading_rate_max: self.heading_rate_max_radps.unwrap_or(usual.heading_rate_max),
            cost_decides: self.cost_decides.unwrap_or(usual.cost_decides),
            ..usual
        };
        Ok(ControlLaw::Planner {
            parameters: Box::new(parameters),
            tuning: (self.tuning != Tuning::default()).then(|| self.tuning.clone()),
            tuned: (self.parameters != Tuned::DEFAULT).then(|| Box::new(self.parameters)),
            forecast: self.forecast,
        })
    }
}

impl LawFile {
    /// Control laws by name: one at tuned or given gains, or one for each point of the grid.
    fn control_laws(&self, name: &str) -> Result<Vec<(String, ControlLaw)>, Wrong> {
        let Some(law) = LosLaw::ALL.into_iter().find(|law| law.name() == self.name) else {
            let names = LosLaw::ALL.map(LosLaw::name).join(", ");
            let reason = format!("there is no law {:?}, only {names}", self.name);
            return wrong("law.name", reason);
        };
        match (self.gains, self.whole_grid) {
            (None, false) => Ok(vec![(name.to_owned(), ControlLaw::Tuned(law))]),
            (Some(gains), false) => Ok(vec![(name.to_owned(), ControlLaw::Fixed(fixed(gains, law)?))]),
            (None, true) => {
                let named = grid(law).into_iter().map(|tuning| {
                    let (gains, integral) = (tuning.gains, tuning.integral_gain);
                    let [ahead, along] = [gains.look_ahead, gains.along_track_gain];
                    let name = format!("{name} {ahead} / {along} / {integral}");
                    (name, ControlLaw::Fixed(tuning))
                });
                Ok(named.collect())
            }
            (Some(_), true) => wrong("law.whole_grid", "give either gains or whole_grid"),
        }
    }
}

/// The tuning with the file's gains, all positive.
fn fixed(gains: LawGains, law: LosLaw) -> Result<LosTuning, Wrong> {
    let tuning = tuned(law, gains);
    for (member, value) in [
        ("look_ahead_m", tuning.gains.look_ahead),
        ("along_track_gain_per_s", tuning.gains.along_track_gain),
        ("integral_gain_mps", tuning.integral_gain),
    ] {
        let is_positive = value.is_finite() && 0.0 < value;
        ensure(is_positive, format!("law.gains.{member}"), format!("{value} is not above 0"))?;
    }
    Ok(tuning)
}
