//! The simulator from outside. `allocations.rs` is a binary of its own: it counts allocations.

use pilotfish_sim::guide::{Guide, LosGuide, MpcGuide};
use pilotfish_sim::mission::run;
use pilotfish_sim::record::{Record, SurfaceCraftRow};
use pilotfish_sim::scenario::{Files, Scenario};
use pilotfish_sim::world::World;
use planner::parameters::Parameters;

#[path = "../../../planner/src/tests/checks.rs"]
mod checks;
mod determinism;
mod effects;
mod estimates;
mod fleet;
mod gate;
mod path_following;
mod recorded_tracks;
mod scenario_claims;
mod scenario_reference;
mod scenarios;
mod step_responses;
mod surface_craft;
mod tracking_errors;
mod underwater_vehicle;
mod visits;

use checks::{near, near_to, rows};

fn los() -> LosGuide {
    LosGuide::new(Parameters::default().los)
}

fn mpc() -> MpcGuide {
    MpcGuide::new(Parameters::default())
}

fn named(name: &str) -> Scenario {
    Scenario::named(name).expect("exists")
}

/// The scenario written in `text`.
fn parsed(text: &str) -> Scenario {
    let scenario = Scenario::parse(text, "my.toml", Files::default());
    scenario.unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn flown_by(scenario: &Scenario, guide: &mut dyn Guide, seed: u64) -> Record {
    run(scenario, guide, seed, &mut |_| {}).expect("runs")
}

fn world(scenario: &Scenario, seed: u64) -> World {
    scenario.start(seed).expect("valid").world
}

/// Steps until `time`, s, without a reference to the surface craft.
fn step_until(world: &mut World, time: f64) {
    while world.time() < time {
        world.step(None);
    }
}

fn craft(row: &pilotfish_sim::record::Row) -> &SurfaceCraftRow {
    row.surface_craft.as_ref().expect("has one")
}
