//! How large a campaign may be that the service flies: one thread that steps aside for missions has to come to its end.

use lab::{
    campaign::{Campaign, CampaignFile, contender::Pilot, design::World, file::CraftEntry},
    tuning::grid,
};
use planner::los::LosLaw;
use serde_json::{Value, json};
use sim::scenario::Scenario;
use wire::FieldError;

use super::posted::step;

/// Longest campaign file, bytes.
pub(super) const FILE_BYTES_MAX: usize = 64 << 10;
/// Most runs of a campaign: a night of the planner's missions of 15 minutes, at 3 ms a plan.
const RUNS_MAX: u64 = 10_000;
/// Most missions that find gains: a law's take a hundredth of a planner's.
const TUNING_MISSIONS_MAX: u64 = 100_000;
/// Most simulated time of all runs, h: that of as many runs as there may be, of 15 minutes.
const HOURS_MAX: f64 = 2_500.0;
/// Most scenarios times craft: each is made before the campaign is taken on.
const ARENAS_MAX: u64 = 1_000;
/// Most scenarios that the campaign brings along: each is tried before it is taken on.
const SCENARIO_FILES_MAX: usize = 10;
/// Most bytes of them that are read in all, once for each value of a parameter: a few tenths of a second.
const SCENARIO_BYTES_MAX: usize = 2_000_000;
/// Most craft that are drawn, some tens of ms each, before the campaign is taken on.
const DRAWN_MAX: u64 = 50;
/// Most controllers, each point of a whole grid one.
const CONTROLLERS_MAX: usize = 200;
/// Most values of parameters that are tried in all scenarios, before the campaign is taken on.
const TRIALS_MAX: usize = 500;
/// Most SCP iterations from one initial guess: one plan cannot be stopped.
const SCP_ITERATIONS_MAX: usize = 50;
/// Most intervals of a horizon, for the same reason.
const STEPS_MAX: usize = 100;
/// Most columns that a report compares: writing it cannot be stopped either.
const METRICS_MAX: usize = 32;

/// What the command line is for.
const BEYOND: &str = "beyond that use pilotfish campaign run";

/// What is too much in `file`, before anything of it is read or drawn.
pub(super) fn check_file(file: &CampaignFile) -> Result<(), Vec<FieldError>> {
    let mut errors = vec![];
    let known = Scenario::names();
    for (i, name) in file.scenarios.iter().enumerate() {
        if !known.contains(&name.as_str()) && !file.scenario_files.contains_key(name) {
            let detail = "must be the name of a built-in scenario or of one of scenario_files".to_owned();
            let error = FieldError::new(format!("/scenarios/{i}"), "unknown", detail);
            errors.push(error.given(name.as_str()).limit(json!(known)));
        }
    }
    errors.extend(check_scenario_files(file));
    let n_scenarios = if file.scenarios.is_empty() {
        known.len()
    } else {
        file.scenarios.len()
    };
    let drawn = file.craft.iter().map(|entry| match entry {
        CraftEntry::Random { count, .. } => *count,
        CraftEntry::Scenario | CraftEntry::Medusa | CraftEntry::Otter => 0,
    });
    let n_drawn: u64 = drawn.sum();
    errors.extend(above("/craft", "drawn craft", n_drawn, DRAWN_MAX));
    let n_craft = file
        .craft
        .iter()
        .filter(|entry| !matches!(entry, CraftEntry::Random { .. }));
    let n_craft = (n_craft.count() as u64 + n_drawn.min(DRAWN_MAX)).max(1);
    let n_arenas = n_craft * n_scenarios as u64;
    errors.extend(above("/craft", "scenarios times craft", n_arenas, ARENAS_MAX));
    let n_controllers = file.controllers.iter().map(|controller| {
        let law = controller.law.as_ref().filter(|law| law.whole_grid);
        let law = law.and_then(|law| LosLaw::ALL.into_iter().find(|known| known.name() == law.name));
        law.map_or(1, |law| grid(law).len())
    });
    errors.extend(above(
        "/controllers",
        "controllers, each point of a whole grid one",
        n_controllers.sum::<usize>(),
        CONTROLLERS_MAX,
    ));
    errors.extend(above(
        "/parameters",
        "values of parameters times scenarios",
        n_values(file) * n_scenarios,
        TRIALS_MAX,
    ));
    for (i, parameter) in file.parameters.iter().enumerate() {
        // How long all runs last is added up before one is drawn.
        if parameter.key == "duration_s" {
            let detail = "is the same for all missions here: give duration_s beside replicates";
            errors.push(FieldError::new(format!("/parameters/{i}/key"), "invalid", detail));
        }
    }
    let n_metrics = file.report.metrics.len();
    errors.extend(above("/report/metrics", "metrics", n_metrics, METRICS_MAX));
    for (i, controller) in file.controllers.iter().enumerate() {
        let Some(planner) = &controller.planner else {
            continue;
        };
        let field = |member: &str| format!("/controllers/{i}/planner/{member}");
        if let Some(given) = planner.scp_iterations {
            errors.extend(FieldError::outside(
                field("scp_iterations"),
                given,
                &(1..=SCP_ITERATIONS_MAX),
            ));
        }
        if let Some(steps) = &planner.steps_s {
            errors.extend(above(&field("steps_s"), "intervals", steps.len(), STEPS_MAX));
            let wrong = steps.iter().position(|step| !(step.is_finite() && 0.0 < *step));
            if steps.is_empty() || wrong.is_some() {
                let detail = "must be one length above 0 s or more";
                errors.push(FieldError::new(field("steps_s"), "invalid", detail));
            }
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// Values of parameters that are tried in every scenario.
fn n_values(file: &CampaignFile) -> usize {
    let values = file.parameters.iter().map(|parameter| match &parameter.choice {
        Some(values) => values.len(),
        None => 2,
    });
    values.sum()
}

/// What is too much in the scenarios that the campaign brings along.
fn check_scenario_files(file: &CampaignFile) -> Vec<FieldError> {
    let pointer = "/scenario_files";
    let mut errors = vec![];
    let n_files = file.scenario_files.len();
    errors.extend(above(pointer, "scenario files", n_files, SCENARIO_FILES_MAX));
    let n_bytes = file.scenario_files.values().map(String::len).sum::<usize>() * n_values(file).max(1);
    errors.extend(above(
        pointer,
        "bytes of scenario files times values of parameters",
        n_bytes,
        SCENARIO_BYTES_MAX,
    ));
    for (name, text) in &file.scenario_files {
        // What is no TOML is refused with its line, later.
        let table: toml::Table = text.parse().unwrap_or_default();
        let class = table.get("surface_craft").and_then(|craft| craft.get("class"));
        if class.is_some_and(toml::Value::is_table) {
            let detail =
                "must not draw its craft, each time that it is read: draw craft with the campaign's craft";
            errors.push(FieldError::new(
                format!("{pointer}/{}", step(name)),
                "invalid",
                detail,
            ));
        }
    }
    errors
}

/// What is too much for one thread in `campaign`.
pub(super) fn check_work(campaign: &Campaign) -> Result<(), Vec<FieldError>> {
    let mut errors = vec![];
    let runs = campaign.n_runs();
    errors.extend(above("/replicates", "runs", runs, RUNS_MAX));
    let tuning = campaign.file.tuning.as_ref();
    let searches = (0..campaign.arenas.len()).flat_map(|arena| &campaign.arenas[arena].controllers);
    let points = searches.map(|&controller| match campaign.controllers[controller].pilot {
        Pilot::Law(law) => grid(law).len() as u64,
        Pilot::Tuned(_) | Pilot::Planner { .. } => 0,
    });
    let missions = points.sum::<u64>() * tuning.map_or(0, |tuning| tuning.replicates);
    errors.extend(above(
        "/tuning/replicates",
        "missions that find gains",
        missions,
        TUNING_MISSIONS_MAX,
    ));
    let hours = (0..campaign.arenas.len()).map(|arena| {
        let world = World {
            arena,
            replicate: 0,
            tuning: false,
        };
        #[expect(clippy::cast_precision_loss, reason = "far fewer runs than 2⁵³")]
        let runs = (campaign.runs_in(world).len() as u64 * campaign.file.replicates) as f64;
        runs * campaign.arenas[arena].scenario.duration_s.most() / 3600.0
    });
    let hours = hours.sum::<f64>().ceil();
    if HOURS_MAX < hours {
        let detail = format!("all runs last {hours} h, and at most {HOURS_MAX} are flown here: {BEYOND}");
        let error = FieldError::new("/duration_s", "too_many", detail);
        errors.push(error.given(hours).limit(json!({ "most": HOURS_MAX })));
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// Limits of single members, in the words of JSON Schema, by where they stand among the parts of a campaign file's schema.
pub(crate) fn words() -> [(&'static str, Value); 10] {
    let laws = LosLaw::ALL.map(LosLaw::name);
    let either = |one: &str, other: &str| {
        let only = |given: &str, absent: &str| json!({ "required": [given], "properties": { given: { "not": { "type": "null" } }, absent: { "type": "null" } } });
        json!({ "allOf": [{ "oneOf": [only(one, other), only(other, one)] }] })
    };
    [
        (
            "/NewCampaign/properties/scenario_files",
            json!({ "maxProperties": SCENARIO_FILES_MAX }),
        ),
        (
            "/NewCampaign/properties/replicates",
            json!({ "minimum": 1, "maximum": RUNS_MAX }),
        ),
        (
            "/NewCampaign/properties/controllers",
            json!({ "minItems": 1, "maxItems": CONTROLLERS_MAX }),
        ),
        ("/CampaignController", either("planner", "law")),
        ("/CampaignParameter", either("uniform", "choice")),
        ("/CampaignLaw/properties/name", json!({ "enum": laws })),
        (
            "/CampaignPlanner/properties/scp_iterations",
            json!({ "minimum": 1, "maximum": SCP_ITERATIONS_MAX }),
        ),
        (
            "/CampaignPlanner/properties/steps_s",
            json!({ "minItems": 1, "maxItems": STEPS_MAX }),
        ),
        (
            "/CampaignPlanner/properties/steps_s/items",
            json!({ "exclusiveMinimum": 0 }),
        ),
        (
            "/CampaignReport/properties/metrics",
            json!({ "maxItems": METRICS_MAX }),
        ),
    ]
}

/// What is wrong with more than `most` of `what`.
fn above<T: PartialOrd + Copy + std::fmt::Display + Into<serde_json::Value>>(
    pointer: &str,
    what: &str,
    given: T,
    most: T,
) -> Option<FieldError> {
    (most < given).then(|| {
        let detail = format!("{given} {what} are more than {most}: {BEYOND}");
        FieldError::new(pointer, "too_many", detail)
            .given(given)
            .limit(json!({ "most": most.into() }))
    })
}

#[cfg(test)]
mod tests {
    use lab::campaign::ScenarioFiles;

    use super::*;

    fn file(of: &str) -> CampaignFile {
        let text = format!("schema_version = \"1\"\nname = \"a\"\ntitle = \"a\"\n{of}");
        CampaignFile::parse(&text, "test").expect("is a campaign")
    }

    fn wrong_in(of: &str) -> Vec<String> {
        let wrong = check_file(&file(of)).expect_err("is too much");
        wrong.into_iter().map(|error| error.pointer).collect()
    }

    #[test]
    fn what_costs_much_to_read_is_refused_before_it_is_read() {
        let planner = "[[controllers]]\nname = \"p\"\nplanner = {}";
        let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k"];
        for (of, pointer) in [
            (format!("replicates = 1\nscenarios = [\"crowded\", \"/etc/passwd\"]\n{planner}"), "/scenarios/1"),
            (format!("replicates = 1\nscenarios = [\"crowded\"]\ncraft = [{{ random = {{ first = 1, count = 51 }} }}]\n{planner}"), "/craft"),
            (format!("replicates = 1\nscenarios = [\"crowded\"]\n[[parameters]]\nkey = \"k\"\nchoice = {:?}\n{planner}", vec![1; TRIALS_MAX + 1]), "/parameters"),
            (format!("replicates = 1\nscenarios = [\"crowded\"]\n[[parameters]]\nkey = \"duration_s\"\nchoice = [86400]\n{planner}"), "/parameters/0/key"),
            (format!("replicates = 1\nscenarios = [\"m\"]\n{planner}\n[scenario_files]\nm = \"surface_craft.class.random = {{}}\""), "/scenario_files/m"),
            (format!("replicates = 1\nscenarios = {:?}\n{planner}\n[scenario_files]\n{}", names, names.map(|name| format!("{name} = \"\"\n")).concat()), "/scenario_files"),
            (format!("replicates = 1\nscenarios = [\"m\"]\n{planner}\n[[parameters]]\nkey = \"k\"\nchoice = {:?}\n[scenario_files]\nm = {:?}", [1; 500], "#".repeat(SCENARIO_BYTES_MAX / 500 + 1)), "/scenario_files"),
            ("replicates = 1\n[[controllers]]\nname = \"i\"\nlaw = { name = \"integral_los\", whole_grid = true }\n\
              [[controllers]]\nname = \"j\"\nlaw = { name = \"integral_los\", whole_grid = true }\n\
              [[controllers]]\nname = \"k\"\nlaw = { name = \"integral_los\", whole_grid = true }".to_owned(), "/controllers"),
            ("replicates = 1\n[[controllers]]\nname = \"p\"\nplanner = { scp_iterations = 51 }".to_owned(), "/controllers/0/planner/scp_iterations"),
            ("replicates = 1\n[[controllers]]\nname = \"p\"\nplanner = { steps_s = [] }".to_owned(), "/controllers/0/planner/steps_s"),
            ("replicates = 1\n[[controllers]]\nname = \"p\"\nplanner = { steps_s = [1.0, inf] }".to_owned(), "/controllers/0/planner/steps_s"),
        ] {
            assert_eq!(wrong_in(&of), [pointer], "{of}");
        }
    }

    #[test]
    fn the_limits_are_the_last_that_is_accepted() {
        let campaign = |replicates: u64, duration: u64| {
            let text = format!(
                "schema_version = \"1\"\nname = \"a\"\ntitle = \"a\"\nscenarios = [\"paper-intermittent\"]\n\
                 replicates = {replicates}\nduration_s = {duration}\n[[controllers]]\nname = \"p\"\nplanner = {{}}"
            );
            Campaign::parse(&text, "test", ScenarioFiles::default()).expect("is a campaign")
        };
        assert_eq!(check_work(&campaign(RUNS_MAX, 60)), Ok(()));
        let wrong = check_work(&campaign(RUNS_MAX + 1, 60)).expect_err("is too much");
        assert_eq!(wrong[0].pointer, "/replicates");
        assert!(
            wrong[0].detail.contains("10001 runs are more than 10000"),
            "{:?}",
            wrong[0]
        );
        assert_eq!(check_work(&campaign(RUNS_MAX, 900)), Ok(()));
        let wrong = check_work(&campaign(RUNS_MAX, 901)).expect_err("is too much");
        assert_eq!(wrong[0].pointer, "/duration_s");
    }
}
