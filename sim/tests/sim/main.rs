//! The simulator from outside. `allocations.rs` is a binary of its own: it counts allocations.

use pilotfish_sim::{
    guide::{LosGuide, MpcGuide},
    scenario::Scenario,
};
use planner::parameters::Parameters;

mod determinism;
mod effects;
mod estimates;
mod gate;
mod path_following;
mod recorded_tracks;
mod scenario_claims;
mod scenario_reference;
mod scenarios;
mod step_responses;
mod surface_craft;
mod underwater_vehicle;
mod visits;

fn los() -> LosGuide {
    LosGuide::new(Parameters::default().los)
}

fn mpc() -> MpcGuide {
    MpcGuide::new(Parameters::default())
}

fn named(name: &str) -> Scenario {
    Scenario::named(name).expect("exists")
}
