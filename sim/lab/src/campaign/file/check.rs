//! Ranges and rules of a campaign file, beyond its shape.

use super::{CampaignFile, Claimed, CraftEntry, Parameter, REPLICATES_MAX, SEED_MAX};
use crate::campaign::{controller::Controller, rows::MORE, score::SCORES};

/// Most controllers, craft entries, scenarios, parameters or claims.
const ITEMS_MAX: usize = 200;
/// Most craft that one entry draws.
const CRAFT_MAX: u64 = 10_000;
/// Longest mission, s.
const DURATION_MAX: f64 = 86_400.0;

/// Nothing, or the member that is wrong and why.
type Checked = Result<(), (String, String)>;

pub(super) fn ensure(holds: bool, field: impl Into<String>, reason: impl Into<String>) -> Checked {
    if holds { Ok(()) } else { Err((field.into(), reason.into())) }
}

fn within(field: impl Into<String>, given: u64, least: u64, most: u64) -> Checked {
    let reason = format!("{given} is outside {least} to {most}");
    ensure((least..=most).contains(&given), field, reason)
}

fn is_column(field: impl Into<String>, name: &str) -> Checked {
    let known: Vec<&str> = SCORES.iter().map(|(known, _)| *known).chain(MORE).collect();
    let reason = format!("there is no column {name:?}, only {}", known.join(", "));
    ensure(known.contains(&name), field, reason)
}

impl CampaignFile {
    /// The first member that is wrong, and why.
    pub(super) fn check(&self) -> Checked {
        let is_letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        let name = &self.name;
        let is_name = (1..=64).contains(&name.len()) && name.chars().all(is_letter);
        let reason = format!("{name:?} is not 1 to 64 lower-case letters, digits and hyphens");
        ensure(is_name, "name", reason)?;
        within("seed", self.seed, 0, SEED_MAX)?;
        within("replicates", self.replicates, 1, REPLICATES_MAX)?;
        if let Some(first) = self.first_seed {
            within("first_seed", first, 0, SEED_MAX - REPLICATES_MAX)?;
        }
        if let Some(duration) = self.duration_s {
            let reason = format!("{duration} is outside 1 to {DURATION_MAX} s");
            ensure((1.0..=DURATION_MAX).contains(&duration), "duration_s", reason)?;
        }
        for (field, count) in [
            ("scenarios", self.scenarios.len()),
            ("craft", self.craft.len()),
            ("parameters", self.parameters.len()),
            ("controllers", self.controllers.len()),
            ("claims", self.claims.len()),
        ] {
            let reason = format!("{count} is more than {ITEMS_MAX}");
            ensure(count <= ITEMS_MAX, field, reason)?;
        }
        for (i, craft) in self.craft.iter().enumerate() {
            if let CraftEntry::Random { first, count } = craft {
                within(format!("craft[{i}].random.first"), *first, 0, SEED_MAX)?;
                within(format!("craft[{i}].random.count"), *count, 1, CRAFT_MAX)?;
            }
        }
        for (i, parameter) in self.parameters.iter().enumerate() {
            let named = |(member, reason)| (format!("parameters[{i}].{member}"), reason);
            parameter.check().map_err(named)?;
        }
        self.check_tuning()?;
        self.check_controllers()?;
        self.check_report()?;
        self.check_claims()
    }

    fn check_report(&self) -> Checked {
        for (i, name) in self.report.metrics.iter().enumerate() {
            is_column(format!("report.metrics[{i}]"), name)?;
        }
        for (k, name) in self.report.pareto_front.iter().flatten().enumerate() {
            is_column(format!("report.pareto_front[{k}]"), name)?;
        }
        let mut reference = self.report.reference.iter();
        reference.try_for_each(|reference| self.has_controller("report.reference", reference))
    }

    fn has_controller(&self, field: impl Into<String>, name: &str) -> Checked {
        let known = self.controllers.iter().any(|controller| controller.name == *name);
        ensure(known, field, format!("there is no controller {name:?}"))
    }

    fn check_claims(&self) -> Checked {
        for (i, claim) in self.claims.iter().enumerate() {
            let field = |member: &str| format!("claims[{i}].{member}");
            is_column(field("metric"), &claim.metric)?;
            for (member, names) in [("controllers", &claim.controllers), ("beside", &claim.beside)] {
                for name in names {
                    self.has_controller(field(member), name)?;
                }
            }
            ensure(!claim.controllers.is_empty(), field("controllers"), "is empty")?;
            let needs_beside = matches!(
                claim.is,
                Claimed::RatioAtMost(_) | Claimed::RatioSurelyAtMost(_) | Claimed::Undominated
            );
            let has_beside = !needs_beside || !claim.beside.is_empty();
            let reason = "is empty: name the controllers to compare with";
            ensure(has_beside, field("beside"), reason)?;
            let has_front = claim.is != Claimed::Undominated || self.report.pareto_front.is_some();
            ensure(has_front, field("is"), "undominated needs report.pareto_front")?;
        }
        Ok(())
    }

    fn check_tuning(&self) -> Checked {
        let Some(tuning) = &self.tuning else { return Ok(()) };
        within("tuning.replicates", tuning.replicates, 1, REPLICATES_MAX)?;
        ensure(!tuning.objectives.is_empty(), "tuning.objectives", "is empty")?;
        let Some(first) = tuning.first_seed else { return Ok(()) };
        within("tuning.first_seed", first, 0, SEED_MAX - REPLICATES_MAX)?;
        let Some(scored) = self.first_seed else { return Ok(()) };
        let (end, scored_end) = (first + tuning.replicates, scored + self.replicates);
        let (last, scored_last) = (end - 1, scored_end - 1);
        let reason = format!(
            "the seeds {first} to {last} overlap the scored ones ({scored} to {scored_last}): gains are found on others"
        );
        ensure(scored_end <= first || end <= scored, "tuning.first_seed", reason)
    }

    fn check_controllers(&self) -> Checked {
        ensure(!self.controllers.is_empty(), "controllers", "is empty")?;
        for (i, entry) in self.controllers.iter().enumerate() {
            let field = |member: &str| format!("controllers[{i}].{member}");
            let is_name = (1..=80).contains(&entry.name.len()) && !entry.name.contains('\n');
            ensure(is_name, field("name"), "1 to 80 characters of one line")?;
            let is_new = self.controllers[..i].iter().all(|other| other.name != entry.name);
            let reason = format!("{:?} is the name of two", entry.name);
            ensure(is_new, field("name"), reason)?;
            let named = |(member, reason): (String, String)| (field(&member), reason);
            let controllers = entry.controllers().map_err(named)?;
            let is_tuned = controllers.iter().any(Controller::is_tuned);
            let reason = "give gains, or say in [tuning] how they are found";
            ensure(!is_tuned || self.tuning.is_some(), field("law.gains"), reason)?;
        }
        Ok(())
    }
}

impl Parameter {
    fn check(&self) -> Checked {
        ensure(!self.key.is_empty(), "key", "is empty")?;
        match (self.uniform, &self.choice) {
            (Some([least, most]), None) => ensure(
                least.is_finite() && most.is_finite() && least <= most,
                "uniform",
                format!("[{least}, {most}] are not two limits, the lower one first"),
            ),
            (None, Some(values)) => ensure(
                !values.is_empty() && values.iter().all(|value| value.is_finite()),
                "choice",
                "is not a list of numbers",
            ),
            _ => ensure(false, "uniform", "give either uniform or choice"),
        }
    }
}
