//! Initial snapshots of tests, and the service with and without a socket.

pub mod autopilot;
pub mod broken;
pub mod client;
pub mod fuzz;
pub mod postgres;
pub mod random;
pub mod refusals;
pub mod server;
pub mod store;
pub mod voyage;

pub use random::goals;

use std::time::Duration;

use nalgebra::Vector2;
use planner::{
    angle::{Course, Heading},
    craft::CraftDescription,
    parameters::Parameters,
    plan::{Plan, Workspace, plan},
    snapshot::{Asc, Auv, AuvState, Goal, Limits, Offset, PlanRequest, PreviousPlan, Snapshot, VehicleId},
};

/// An AUV at (north, east) metres on a course, at a 50° sawtooth's horizontal 0.193 m/s.
pub fn auv(id: &str, north: f64, east: f64, course: f64) -> Auv {
    let state =
        AuvState { age_s: 0.4, ..AuvState::new(Vector2::new(north, east), 5.0, Course::new(course), 0.193) };
    Auv::new(id, state)
}

/// The state of AUV number `i`, to be changed.
pub fn state(observation: &mut PlanRequest, i: usize) -> &mut AuvState {
    let state = observation.auvs[i].state.as_mut();
    state.expect("the test's AUVs have states")
}

/// Moves AUV number `i` to `position` (north, east), m.
pub fn place(observation: &mut PlanRequest, i: usize, position: Vector2<f64>) {
    let auv = state(observation, i);
    [auv.north_m, auv.east_m] = position.into();
}

/// The names of the two AUVs of [`observation`].
pub fn both() -> Vec<VehicleId> {
    vec![VehicleId("auv-1".into()), VehicleId("auv-2".into())]
}

/// The craft with the tests' limits, described by its name.
pub fn medusa() -> CraftDescription {
    CraftDescription::of_preset("medusa")
}

/// A craft at the datum with two AUVs ahead, on parallel northward lanes 60 m apart.
pub fn observation(goal: Goal) -> PlanRequest {
    PlanRequest {
        current: Some(Vector2::new(0.02, 0.05).into()),
        limits: Some(Limits::MEDUSA.into()),
        craft: Some(medusa()),
        ..PlanRequest::new(
            200.0,
            Asc { sway_mps: 0.01, ..Asc::new(Vector2::zeros(), Heading::new(0.3), 0.3) },
            vec![auv("auv-1", 12.0, -3.0, 0.02), auv("auv-2", 10.0, 57.0, 0.0)],
            goal,
        )
    }
}

/// The offsets that do not need a path, to starboard and a little astern.
pub fn offsets() -> [Offset; 2] {
    let by = Vector2::new(-5.0, 15.0);
    [Offset::ned(by), Offset::target(by)]
}

/// The observation as a snapshot.
pub fn snapshot(observation: PlanRequest) -> Snapshot {
    Snapshot::try_from(observation).expect("the test starts from a valid observation")
}

/// The plan of a new workspace for the observation.
pub fn planned(observation: PlanRequest) -> Plan {
    let snapshot = snapshot(observation);
    plan(&snapshot, &Parameters::default(), &mut Workspace::default())
}

/// The answer to the snapshot with that plan.
pub fn answer(snapshot: &Snapshot, plan: &Plan) -> wire::PlanResponse {
    wire::Answer::new(snapshot, plan, Duration::ZERO, &serde_json::Map::new()).planned()
}

/// The first goal, and a craft that has followed the plan made `age` seconds ago and hands it back.
pub fn followed(age: f64) -> PlanRequest {
    let mut observation = observation(goals()[0].clone());
    let answer = planned(PlanRequest { t_s: observation.t_s - age, ..observation.clone() });
    let mut points = answer.trajectory.iter();
    let now = points.rfind(|point| point.t_s <= observation.t_s);
    let now = now.expect("the plan was made before");
    observation.asc = Asc::new(now.position(), now.heading(), now.speed_mps);
    let moved = state(&mut observation, 0).velocity() * age;
    let auv = state(&mut observation, 0);
    [auv.north_m, auv.east_m] = (auv.position() + moved).into();
    observation.previous_plan =
        Some(PreviousPlan { reference: None, craft_estimate: None, ..PreviousPlan::from(&answer) });
    observation
}
