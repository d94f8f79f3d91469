//! What a campaign file may hold, beyond its shape.

use sim::scenario::Scenario;

use super::{CampaignFile, Claimed, CraftEntry, Parameter, REPLICATES_MAX, SEED_MAX};
use crate::campaign::{contender::Pilot, rows::MORE, score::SCORES};

/// Most controllers, craft entries, scenarios, parameters or claims.
const ITEMS_MAX: usize = 200;
/// Most craft that one entry draws.
const CRAFT_MAX: u64 = 10_000;

impl CampaignFile {
    /// The first member that is wrong, and why.
    pub(super) fn check(&self) -> Result<(), (String, String)> {
        let wrong = |field: &str, reason: String| Err((field.to_owned(), reason));
        let is_letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if self.name.is_empty() || self.name.len() > 64 || !self.name.chars().all(is_letter) {
            return wrong(
                "name",
                format!(
                    "{:?} is not 1 to 64 lower-case letters, digits and hyphens",
                    self.name
                ),
            );
        }
        within("seed", self.seed, 0, SEED_MAX)?;
        within("replicates", self.replicates, 1, REPLICATES_MAX)?;
        if let Some(first) = self.first_seed {
            within("first_seed", first, 0, SEED_MAX - REPLICATES_MAX)?;
        }
        if let Some(duration) = self.duration_s
            && !(1.0..=86_400.0).contains(&duration)
        {
            return wrong("duration_s", format!("{duration} is outside 1 to 86400 s"));
        }
        for (field, count) in [
            ("scenarios", self.scenarios.len()),
            ("craft", self.craft.len()),
            ("parameters", self.parameters.len()),
            ("controllers", self.controllers.len()),
            ("claims", self.claims.len()),
        ] {
            if ITEMS_MAX < count {
                return wrong(field, format!("{count} is more than {ITEMS_MAX}"));
            }
        }
        for name in self.scenario_files.keys() {
            let field = format!("scenario_files.{name}");
            if Scenario::text(name).is_some() {
                return wrong(&field, "is the name of a built-in scenario".to_owned());
            }
            if !self.scenarios.contains(name) {
                return wrong(&field, "scenarios does not name it".to_owned());
            }
        }
        for (i, craft) in self.craft.iter().enumerate() {
            if let CraftEntry::Random { first, count } = craft {
                within(&format!("craft[{i}].random.first"), *first, 0, SEED_MAX)?;
                within(&format!("craft[{i}].random.count"), *count, 1, CRAFT_MAX)?;
            }
        }
        for (i, parameter) in self.parameters.iter().enumerate() {
            let named = |(member, reason)| (format!("parameters[{i}].{member}"), reason);
            parameter.check().map_err(named)?;
        }
        self.check_tuning()?;
        self.check_controllers()?;
        self.check_claims()
    }

    fn check_claims(&self) -> Result<(), (String, String)> {
        if let Some(columns) = &self.report.pareto_front {
            for (k, name) in columns.iter().enumerate() {
                is_column(name).map_err(|reason| (format!("report.pareto_front[{k}]"), reason))?;
            }
        }
        for (i, claim) in self.claims.iter().enumerate() {
            let field = |member: &str| format!("claims[{i}].{member}");
            is_column(&claim.metric).map_err(|reason| (field("metric"), reason))?;
            for (member, names) in [("controllers", &claim.controllers), ("beside", &claim.beside)] {
                for name in names {
                    if self.controllers.iter().all(|controller| controller.name != *name) {
                        return Err((field(member), format!("there is no controller {name:?}")));
                    }
                }
            }
            let needs_beside = matches!(
                claim.is,
                Claimed::RatioAtMost(_) | Claimed::RatioSurelyAtMost(_) | Claimed::Undominated
            );
            if claim.controllers.is_empty() {
                return Err((field("controllers"), "there is none".to_owned()));
            }
            if needs_beside && claim.beside.is_empty() {
                return Err((
                    field("beside"),
                    "there is none, and this is claimed beside others".to_owned(),
                ));
            }
            if claim.is == Claimed::Undominated && self.report.pareto_front.is_none() {
                return Err((field("is"), "undominated needs report.pareto_front".to_owned()));
            }
        }
        Ok(())
    }

    fn check_tuning(&self) -> Result<(), (String, String)> {
        let Some(tuning) = &self.tuning else { return Ok(()) };
        within("tuning.replicates", tuning.replicates, 1, REPLICATES_MAX)?;
        if tuning.objectives.is_empty() {
            return Err(("tuning.objectives".to_owned(), "there is none".to_owned()));
        }
        let Some(first) = tuning.first_seed else {
            return Ok(());
        };
        within("tuning.first_seed", first, 0, SEED_MAX - REPLICATES_MAX)?;
        match self.first_seed {
            Some(scored) if first < scored + self.replicates && scored < first + tuning.replicates => Err((
                "tuning.first_seed".to_owned(),
                format!(
                    "the seeds {first} to {} are scored too ({scored} to {}): gains are found on others",
                    first + tuning.replicates - 1,
                    scored + self.replicates - 1
                ),
            )),
            _ => Ok(()),
        }
    }

    fn check_controllers(&self) -> Result<(), (String, String)> {
        if self.controllers.is_empty() {
            return Err(("controllers".to_owned(), "there is none".to_owned()));
        }
        for (i, controller) in self.controllers.iter().enumerate() {
            let field = |member: &str| format!("controllers[{i}].{member}");
            let earlier = &self.controllers[..i];
            if controller.name.is_empty() || controller.name.len() > 80 || controller.name.contains('\n') {
                return Err((field("name"), "1 to 80 characters of one line".to_owned()));
            }
            if earlier.iter().any(|other| other.name == controller.name) {
                return Err((field("name"), format!("{:?} is the name of two", controller.name)));
            }
            let contenders = controller
                .contenders()
                .map_err(|(member, reason)| (field(&member), reason))?;
            let is_tuned = contenders
                .iter()
                .any(|contender| matches!(contender.pilot, Pilot::Law(_)));
            if is_tuned && self.tuning.is_none() {
                return Err((
                    field("law.gains"),
                    "without gains they are tuned, and there is no [tuning] that says on which worlds"
                        .to_owned(),
                ));
            }
        }
        for (i, name) in self.report.metrics.iter().enumerate() {
            is_column(name).map_err(|reason| (format!("report.metrics[{i}]"), reason))?;
        }
        if let Some(reference) = &self.report.reference
            && self
                .controllers
                .iter()
                .all(|controller| controller.name != *reference)
        {
            return Err((
                "report.reference".to_owned(),
                format!("there is no controller {reference:?}"),
            ));
        }
        Ok(())
    }
}

fn is_column(name: &str) -> Result<(), String> {
    let known: Vec<&str> = SCORES.iter().map(|(known, _)| *known).chain(MORE).collect();
    if known.contains(&name) {
        return Ok(());
    }
    Err(format!("there is no column {name:?}, only {}", known.join(", ")))
}

fn within(field: &str, given: u64, least: u64, most: u64) -> Result<(), (String, String)> {
    if (least..=most).contains(&given) {
        return Ok(());
    }
    Err((field.to_owned(), format!("{given} is outside {least} to {most}")))
}

impl Parameter {
    fn check(&self) -> Result<(), (String, String)> {
        let wrong = |member: &str, reason: String| Err((member.to_owned(), reason));
        if self.key.is_empty() {
            return wrong("key", "it is empty".to_owned());
        }
        match (self.uniform, &self.choice) {
            (Some([least, most]), None) if least.is_finite() && most.is_finite() && least <= most => Ok(()),
            (Some([least, most]), None) => wrong(
                "uniform",
                format!("[{least}, {most}] are not two limits, the lower one first"),
            ),
            (None, Some(values)) if !values.is_empty() && values.iter().all(|value| value.is_finite()) => {
                Ok(())
            }
            (None, Some(_)) => wrong("choice", "it is not one number or more".to_owned()),
            _ => wrong("uniform", "give either uniform or choice".to_owned()),
        }
    }
}
